//! A-format over the port: a master that prints positions, and an encoder.

use core::fmt::{self, Display, Write as _};

use nikon_aformat::device::Device;
use nikon_aformat::master::{GuardedReset, Line, Reset, VerifiedWrite, Write};
use nikon_aformat::{BitRate, EncoderAddress, EvidenceCell, FRAME_BITS, Operation, Request, Resolution, UserAddress};
use servowire_boards::Readings;
use servowire_drivers::Clock as _;
use servowire_drivers::nikon::blocking::Driver;

use crate::answering::Answering;
use crate::board::Board;
use crate::clock::Clock;
use crate::commands::{Command, Typed};
use crate::console::Console;
use crate::frames::{self, Frames};
use crate::port::{RingReceiver, Unit};
use crate::programs::{self, Rate};

/// Time from the end of one transaction to the beginning of the next, in addition to what the protocol requires.
const PAUSE_NS: u64 = 20_000;
/// One position in this many is printed.
const PRINTED: u32 = 16;
/// By how much the end time of a block may be late.
const LATENCY_NS: u32 = 2_000;
/// Longest wait for the response: encoders answer after some microseconds, the one below after 30 if it has made no answer ahead.
const RESPONSE_TIMEOUT_NS: u32 = 60_000;

/// The rates that the port makes exactly; 16 Mbit/s would be 7.5 clocks a bit.
const fn rate_of(rate: BitRate) -> Option<Rate> {
    match rate {
        BitRate::Mbit2_5 => Some(Rate::MBIT2_5),
        BitRate::Mbit4 => Some(Rate::MBIT4),
        BitRate::Mbit6_67 => Some(Rate::MBIT6_67),
        BitRate::Mbit8 => Some(Rate::MBIT8),
        BitRate::Mbit16 => None,
    }
}

type Encoders<'a> = Driver<Frames<'a>, &'a Clock>;

/// Executes a typed command, and prints the result.
fn command(encoders: &mut Encoders<'_>, command: Command, console: &mut Console) -> fmt::Result {
    let ea = EncoderAddress::ZERO;
    match command {
        Command::Read { address } => say_word(encoders, address, console),
        Command::Write { address, data } => {
            let Some(user) = UserAddress::new(address) else { return console.write_str("that is not for users\n") };
            match encoders.run(&mut VerifiedWrite::new(Write::eeprom(ea, user, data))) {
                Ok(()) => say_word(encoders, address, console),
                Err(error) => say(console, "EEPROM", error),
            }
        }
        Command::LoseMultiTurnReference => match encoders.run(&mut GuardedReset::new(Reset::clear_multiturn(ea))) {
            Ok(_) => console.write_str("turns: cleared\n"),
            Err(error) => say(console, "turns", error),
        },
        Command::Unknown => console.write_str("?\n"),
    }
}

fn say_word(encoders: &mut Encoders<'_>, address: u8, console: &mut Console) -> fmt::Result {
    match encoders.read_eeprom(EncoderAddress::ZERO, address) {
        Ok(word) => writeln!(console, "EEPROM {address:02x}: {word:04x}"),
        Err(error) => say(console, "EEPROM", error),
    }
}

fn say(console: &mut Console, what: &str, error: impl Display) -> fmt::Result {
    writeln!(console, "{what}: {error}")
}

/// Reads the position of encoder 0 without end; prints every sixteenth, and every fault. Executes commands typed meanwhile.
///
/// # Panics
/// At 16 Mbit/s, or if a clock does not start.
pub fn master(image: &'static str, rate: BitRate) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let board = Board::new(image, rate.bits_per_second(), port, frames::BITS);
    let (mut clock, console) = (&board.clock, &mut Console::new(board.uart, board.usb, board.first, board.before));
    let receiver = RingReceiver::new(board.channel, board.receiver);
    let port = Frames::new(board.transmitter, receiver, clock, rate.bits_ns(FRAME_BITS));
    let line = Line::new(rate).with_response_timeout_ns(RESPONSE_TIMEOUT_NS).with_hand_over_ns(LATENCY_NS);
    let mut encoders = Driver::new(port, clock, Resolution::default(), line);
    let mut cell = EvidenceCell::new();
    let mut readings = Readings::new(&mut cell, PRINTED);
    let mut typed = Typed::default();
    loop {
        board.watchdog.feed();
        console.poll();
        let read = encoders.read_evidence(EncoderAddress::ZERO);
        let _ = readings.take(console, read, clock.now_ns());
        if let Some(typed) = typed.take(console) {
            let _ = command(&mut encoders, typed, console);
        }
        clock.pause(PAUSE_NS);
    }
}

/// From the end of a request to the answer.
const TURN_NS: u32 = 2_800;
/// A frame that comes later than this does not belong to the previous request.
const FRAME_GAP_NS: u64 = 8_000;
/// The next request comes at least this much later.
const LATER_NS: u64 = 50_000;

/// An encoder, and the answer that it has prepared.
struct Ahead {
    device: Device<1>,
    position: u32,
    line: Answering,
    wait_cycles: u32,
}

impl Ahead {
    /// Holds the encoder's answer to a command frame, which starts it; a copy of the encoder prepares it. The shaft moves.
    fn hold(&mut self, command_frame: u16, now_ns: u64) {
        self.position += 1;
        self.device.set_position(self.position, 7);
        let mut copy = self.device;
        let Some(reply) = copy.hear(&[Some(command_frame)], now_ns) else { return };
        let contents = reply.frames.contents().iter().copied();
        self.line.hold(&frames::prepared(contents, 0, self.wait_cycles), command_frame);
    }
}

/// Encoder 0, whose shaft turns by one count with every answer.
///
/// As with T-Format the answer to the request that came last is made ahead, if it had one frame, and the receiver starts it. All others
/// are answered when they are ready.
///
/// # Panics
/// At 16 Mbit/s, or if a clock does not start.
pub fn encoder(image: &'static str, rate: BitRate) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let Board { clock, transmitter, receiver, watchdog, .. } =
        Board::new(image, rate.bits_per_second(), port, frames::BITS);
    let device = Device::new(EncoderAddress::ZERO, Resolution::default(), rate);
    let wait_cycles = programs::wait_cycles(port, TURN_NS);
    let mut ahead = Ahead { device, position: 0x1_2345, line: Answering::new(transmitter, receiver), wait_cycles };
    let read = Request::new(EncoderAddress::ZERO, Operation::Abs40).emit();
    let mut again = read.as_slice().first().map_or(0, |frame| frame.content());
    let (mut first, mut last_ns) = (true, 0);
    loop {
        watchdog.feed();
        let Some((Unit { content, framed }, started)) = ahead.line.take() else {
            let now_ns = clock.latest_ns();
            if now_ns - last_ns >= FRAME_GAP_NS {
                first = true;
                if !ahead.line.is_ready() {
                    ahead.hold(again, now_ns + LATER_NS);
                }
            }
            continue;
        };
        let frame = framed.then_some(content);
        last_ns = clock.latest_ns();
        let reply = ahead.device.hear(&[frame], last_ns);
        if reply.is_some() && first {
            again = content;
        }
        first = false;
        if let Some(reply) = reply.filter(|_| !started) {
            let contents = reply.frames.contents().iter().copied();
            ahead.line.send(&frames::prepared(contents, 0, 0));
        }
    }
}
