//! The two PIO programs: one plays the line, one samples it, both at 75 MHz, two clocks of 150 MHz each.

use pio::{Instruction, InstructionOperands, JmpCondition, PioVersion, Program, SetDestination, SideSet, Wrap};

/// Plays pairs of DI (bit 0 of a pair) and DE (bit 1), the first pair in the low bits of a word. It knows nothing of frames: what it
/// plays comes by DMA and has no end, so a bit is 16 clocks long whatever the processor does.
///
/// The instructions of both programs are encoded here, so that they can be found in the image and run in another emulator.
#[used]
static PLAY: [u16; 1] = [
    0x6102, // play: out pins, 2 [1]
];

/// Waits until the first window begins, then takes a sample each two clocks without an end, 32 in a word, the first in bit 31.
#[used]
static SAMPLE: [u16; 2] = [
    0x0f40, // wait:   jmp x-- wait [15]   a bit
    0x4101, // sample: in pins, 1 [1]
];

/// The player.
pub fn play() -> Program<32> {
    program(&PLAY, Wrap { source: 0, target: 0 })
}

/// The sampler. X holds the number of bits to wait, less one.
pub fn sample() -> Program<32> {
    program(&SAMPLE, Wrap { source: 1, target: 1 })
}

fn program(code: &[u16], wrap: Wrap) -> Program<32> {
    Program {
        code: code.iter().copied().collect(),
        origin: None,
        wrap,
        side_set: SideSet::default(),
        version: PioVersion::V0,
    }
}

/// X of the sampler, which waits for this many bits.
pub const fn wait_bits(bits: u8) -> Instruction {
    let operands = InstructionOperands::SET { destination: SetDestination::X, data: bits - 1 };
    Instruction { operands, delay: 0, side_set: None }
}

/// `jmp address`.
pub const fn jump(address: u8) -> Instruction {
    let operands = InstructionOperands::JMP { condition: JmpCondition::Always, address };
    Instruction { operands, delay: 0, side_set: None }
}
