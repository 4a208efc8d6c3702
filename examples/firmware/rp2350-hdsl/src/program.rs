//! The PIO program: one state machine sends, releases the line for one bit, and samples it, two clocks a sample.

use pio::{PioVersion, Program, SideSet, Wrap};

/// Samples in a bit of 9.375 Mbit/s: 75 MHz, two clocks of 150 MHz each.
pub const SAMPLES_PER_BIT: u32 = 8;
/// Samples by which the last one of a message is made longer, on the way through the instructions that follow it.
pub const HELD: u32 = 3;

/// Takes words: how many samples to send - 1, the samples, the first in bit 0, and how many samples to take - 1, or 0 for none.
///
/// Automatic pull and push, 32 bits; out to the right, in to the left. It starts at `begin`, which is the wrap, and goes on at `send`.
/// The number of samples must not be a multiple of 32.
///
/// The instructions are encoded here, so that they can be found in the image and run in another emulator.
#[used]
static CODE: [u16; 12] = [
    0x7001, // send:   out pins, 1    side 1
    0x1040, //         jmp x-- send   side 1
    0x7160, //         out null, 32   side 1 [1]    what is left of the last word is thrown away
    0x7020, //         out x, 32      side 1        how many to take
    0x102a, //         jmp !x more    side 1
    0xb142, //         mov y, y       side 1 [1]    the last sample has been held for six clocks by now
    0xaf42, //         mov y, y       side 0 [15]   released for one bit
    0x4001, // take:   in pins, 1     side 0
    0x0047, //         jmp x-- take   side 0
    0x6020, // begin:  out x, 32      side 0        waits for the next message, driver off; then on at send
    0x7020, // more:   out x, 32      side 1        the next message follows without a pause: six clocks again
    0x1000, //         jmp send       side 1
];

const SEND: u8 = 0;
/// Where it starts.
pub const BEGIN: u8 = 9;

/// The program.
pub fn program() -> Program<32> {
    Program {
        code: CODE.into_iter().collect(),
        origin: None,
        wrap: Wrap { source: BEGIN, target: SEND },
        side_set: SideSet::new(false, 1, false),
        version: PioVersion::V0,
    }
}
