//! T-Format over the port: a master that prints positions, and an encoder.

use core::fmt::{self, Write};

use servowire_boards::{RESOLUTION, Readings};
use servowire_drivers::tformat::blocking::{Driver, Failure};
use servowire_drivers::{Automatic, Clock as _};
use tformat::device::Device;
use tformat::master::{Line, MultiTurnZero};
use tformat::{Abm, Abs, Address, BitRate, DataId, EvidenceCell, Page, Request};

use crate::answering::Answering;
use crate::board::Board;
use crate::clock::Clock;
use crate::commands::{Command, Typed};
use crate::console::Console;
use crate::port::{RingReceiver, Unit};
use crate::programs::{self, Rate};
use crate::uart::{self, Uart};

/// Time from the end of one transaction to the beginning of the next.
const PAUSE_NS: u64 = 20_000;
/// One position in this many is printed.
const PRINTED: u32 = 16;

const fn rate_of(rate: BitRate) -> Rate {
    match rate {
        BitRate::Mbit2_5 => Rate::MBIT2_5,
        BitRate::Mbit5 => Rate::MBIT5,
    }
}

type Encoder<'a> = Driver<Uart, Automatic, &'a Clock>;

/// Executes a typed command, and prints the result.
fn command(encoder: &mut Encoder<'_>, command: Command, console: &mut Console) -> fmt::Result {
    let page = Page::truncate(0);
    let (address, byte) = match command {
        Command::Read { address } => (address, encoder.read_eeprom(page, Address::truncate(address))),
        Command::Write { address, data } => {
            (address, encoder.write_eeprom(page, Address::truncate(address), data as u8))
        }
        Command::LoseMultiTurnReference => {
            let mut zero = MultiTurnZero::set_and_lose_multi_turn_reference(RESOLUTION, 1);
            return match encoder.run(&mut zero) {
                Ok(multi) => writeln!(console, "ABM: {}", multi.abm.get()),
                Err(error) => say(console, "ABM", error),
            };
        }
        Command::Unknown => return console.write_str("?\n"),
    };
    match byte {
        Ok(byte) => writeln!(console, "EEPROM {address:02x}: {byte:02x}"),
        Err(error) => say(console, "EEPROM", error),
    }
}

fn say(console: &mut Console, what: &str, error: Failure<Uart, Automatic>) -> fmt::Result {
    writeln!(console, "{what}: {error}")
}

/// Reads the position of the encoder without end; prints every sixteenth, and every fault. Executes commands typed meanwhile.
///
/// # Panics
/// If a clock does not start.
pub fn master(image: &'static str, rate: BitRate) -> ! {
    let board = Board::new(image, rate.bits_per_second(), rate_of(rate), uart::BITS);
    let (mut clock, console) = (&board.clock, &mut Console::new(board.uart, board.usb, board.first, board.before));
    let uart = Uart::new(board.transmitter, RingReceiver::new(board.channel, board.receiver));
    let mut encoder = Driver::new(uart, Automatic, clock, Line::new(rate)).expect("the PIO switches the driver");
    let mut cell = EvidenceCell::new();
    let mut readings = Readings::new(&mut cell, PRINTED);
    let mut typed = Typed::default();
    loop {
        board.watchdog.feed();
        console.poll();
        let read = encoder.read_evidence(RESOLUTION);
        let _ = readings.take(console, read, clock.now_ns());
        if let Some(typed) = typed.take(console) {
            let _ = command(&mut encoder, typed, console);
        }
        clock.pause(PAUSE_NS);
    }
}

const ENCODER_ID: u8 = 0x17;
/// Until they are reset.
const TURNS: Abm = Abm::truncate(7);
/// From the end of a request to the answer.
const TURN_NS: u32 = 3_000;
/// The same of an answer that is made while the end of its request comes, and hardly ready in time.
const LEAST_TURN_NS: u32 = 2_000;
/// A field that comes later than this does not belong to the previous request.
const FIELD_GAP_NS: u64 = 8_000;

/// The next request comes at least this much later.
const LATER_NS: u64 = 50_000;

/// An encoder, and the answer that it has prepared.
struct Ahead {
    device: Device<1>,
    line: Answering,
}

impl Ahead {
    /// Holds what the encoder will answer to `request`, whose last byte starts it.
    fn hold(&mut self, request: Request, now_ns: u64, wait_cycles: u32) {
        let reply = match request {
            // It changes nothing.
            Request::ReadEeprom { .. } => self.device.answer(request, now_ns),
            _ => { self.device }.answer(request, now_ns),
        };
        let asked = request.emit();
        let Some((reply, last)) = reply.zip(asked.as_bytes().last()) else { return };
        self.line.hold(&uart::prepared(reply.emit().as_bytes(), wait_cycles), (*last).into());
    }

    /// Handles a complete or damaged request: answers it, unless the answer is already on its way.
    fn ended(&mut self, bytes: &[u8], now_ns: u64, started: bool) -> Option<Request> {
        let request = Request::parse(bytes).ok();
        let reply = match request {
            Some(request) => self.device.answer(request, now_ns).map(|response| response.emit()),
            None => self.device.hear(bytes, now_ns).map(|reply| reply.frame),
        };
        if let Some(reply) = reply.filter(|_| !started) {
            self.line.send(&uart::prepared(reply.as_bytes(), 0));
        }
        request
    }
}

/// Returns the number of fields in a request with this control field.
const fn fields(control_field: u8) -> usize {
    const READ: u8 = DataId::ReadEeprom.control_field().get();
    const WRITE: u8 = DataId::WriteEeprom.control_field().get();
    match control_field {
        READ => 3,
        WRITE => 4,
        _ => 1,
    }
}

/// An encoder whose shaft turns by one count with every answer.
///
/// The answer has to begin 3 us after the request, and this processor needs longer to make one. The answer to the latest
/// request is therefore prepared ahead and held by the transmitter, and the receiver starts it when the request comes
/// again, whatever the processor is doing then. The answer to a request with several fields is made while the last field
/// arrives. All others are answered when they are
/// ready.
///
/// # Panics
/// If a clock does not start.
pub fn encoder(image: &'static str, rate: BitRate) -> ! {
    let port = rate_of(rate);
    let Board { clock, transmitter, receiver, watchdog, .. } =
        Board::new(image, rate.bits_per_second(), port, uart::BITS);
    let mut device = Device::new(ENCODER_ID, rate);
    device.set_position(Abs::truncate(0), TURNS);
    let [wait_cycles, least_cycles] = [TURN_NS, LEAST_TURN_NS].map(|turn_ns| programs::wait_cycles(port, turn_ns));
    let mut ahead = Ahead { device, line: Answering::new(transmitter, receiver) };
    let mut position = 0x12_3456;
    let mut again = Request::ReadAll;
    let (mut request, mut len, mut last_ns) = ([0; 4], 0, 0);
    loop {
        watchdog.feed();
        let Some((Unit { content, framed }, started)) = ahead.line.take() else {
            let now_ns = clock.latest_ns();
            if now_ns - last_ns >= FIELD_GAP_NS {
                len = 0;
                if !ahead.line.is_ready() {
                    position += 1;
                    ahead.device.set_position(Abs::truncate(position), ahead.device.abm());
                    ahead.hold(again, now_ns + LATER_NS, wait_cycles);
                }
            }
            continue;
        };
        let byte = content as u8;
        last_ns = clock.latest_ns();
        let Some(place) = request.get_mut(len) else { continue };
        *place = byte;
        len += 1;
        let (came, fields) = (&request[..len], fields(request[0]));
        if !framed {
            let _ = ahead.device.framing_error(last_ns);
            len = OVER;
        } else if len == fields {
            again = ahead.ended(came, last_ns, started).filter(|_| fields == 1).unwrap_or(again);
            len = OVER;
        } else if len + 1 == fields {
            request[len] = came.iter().fold(0, |sum, field| sum ^ field);
            if let Ok(request) = Request::parse(&request[..=len]) {
                ahead.hold(request, last_ns, least_cycles);
            }
        }
    }
}

/// Fields of a complete request: anything after it is ignored.
const OVER: usize = usize::MAX;
