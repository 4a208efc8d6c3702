//! A-format over the port: a master that prints positions, and an encoder.

use core::convert::Infallible;
use core::fmt::{self, Write as _};

use nikon_aformat::device::Device;
use nikon_aformat::master::{
    EepromRead, Exchange, GuardedReset, Line, Progress, Reset, Transaction, VerifiedWrite, Write,
};
use nikon_aformat::{
    BitRate, EncoderAddress, Error, FRAME_BITS, Operation, Request, Resolution, Response, UserAddress,
};
use servowire_core::{Ended, Procedure};

use crate::board::{Board, Console};
use crate::clock::Clock;
use crate::commands::{Command, Typed};
use crate::port::{Prepared, RingReceiver, Transmitter, Unit};
use crate::programs::Rate;

/// From the end of one transaction to the beginning of the next, on top of what the protocol wants.
const PAUSE_NS: u64 = 20_000;
/// By how much the end time of a block may be late: how long this processor may take over a frame.
const LATENCY_NS: u32 = 2_000;
/// Frames of the longest response, and some noise.
const MOST_FRAMES: usize = 8;
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

/// The line to an encoder.
struct Master {
    clock: Clock,
    transmitter: Transmitter,
    receiver: RingReceiver,
    line: Line,
    /// From when on the line is free.
    free_ns: u64,
}

impl Master {
    /// One request and its answer, when the line is free. How long they took.
    fn exchange(&mut self, request: Request, message: &Prepared) -> (Result<Exchange, Error>, u64) {
        let Self { clock, transmitter, receiver, line, free_ns } = self;
        let frame_ns = u64::from(line.rate.bits_ns(FRAME_BITS));
        receiver.settle(clock, *free_ns, 2 * frame_ns);
        let began_ns = clock.now_ns();
        let mut transaction = Transaction::start(request, Resolution::default(), *line, began_ns);
        transmitter.send(message);
        // The receiver is on again from the end of the request on, so nothing that comes is older.
        let since_ns = transaction.transmission().end_ns;
        let (mut frames, mut count, mut last_ns) = ([None; MOST_FRAMES], 0, 0);
        let outcome = loop {
            let unit = receiver.take();
            let now_ns = clock.now_ns();
            let progress = match unit {
                Some(Unit { content, framed }) => {
                    if let Some(place) = frames.get_mut(count) {
                        *place = framed.then_some(content);
                        count += 1;
                    }
                    last_ns = now_ns;
                    transaction.progress()
                }
                // The line is quiet again: what has come is a block.
                None if count > 0 && now_ns > last_ns + frame_ns + frame_ns / 2 => {
                    let block = &frames[..count];
                    count = 0;
                    transaction.hear_since(block, since_ns, last_ns)
                }
                None => transaction.poll(now_ns),
            };
            let (end, ready_ns) = match progress {
                Progress::Pending { .. } => continue,
                Progress::Done { value, ready_ns } => (Ok(value), ready_ns),
                Progress::Failed { error, ready_ns } => (Err(error), ready_ns),
            };
            *free_ns = ready_ns;
            break end;
        };
        (outcome, clock.now_ns() - began_ns)
    }

    /// A procedure of several exchanges.
    fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Error>
    where
        P: Procedure<Request = Request, Response = Response, Error = Error>,
    {
        let now_ns = self.clock.now_ns();
        let Ok(Ended { outcome, ready_ns }) = servowire_core::run(procedure, now_ns, |request, not_before_ns| {
            while self.clock.now_ns() < not_before_ns {}
            let (outcome, _) = self.exchange(request, &message(request, self.line));
            let ready_ns = self.free_ns.max(self.clock.now_ns());
            Ok::<_, Infallible>(Ended { outcome: outcome.map(|exchange| exchange.response), ready_ns })
        });
        self.free_ns = ready_ns;
        outcome
    }

    /// Does what was typed, and says what came of it.
    fn command(&mut self, command: Command, console: &mut Console) -> fmt::Result {
        let ea = EncoderAddress::ZERO;
        match command {
            Command::Read { address } => self.say_word(address, console),
            Command::Write { address, data } => {
                let Some(user) = UserAddress::new(address) else { return console.write_str("that is not for users\n") };
                let mut write = VerifiedWrite::new(Write::eeprom(ea, user, data));
                match self.run(&mut write) {
                    Ok(()) => self.say_word(address, console),
                    Err(error) => writeln!(console, "EEPROM {address:02x}: {error}"),
                }
            }
            Command::LoseMultiTurnReference => {
                let mut reset = GuardedReset::new(Reset::clear_multiturn(ea));
                match self.run(&mut reset) {
                    Ok(_) => console.write_str("turns: cleared\n"),
                    Err(error) => writeln!(console, "turns: {error}"),
                }
            }
            Command::Unknown => console.write_str("?\n"),
        }
    }

    fn say_word(&mut self, address: u8, console: &mut Console) -> fmt::Result {
        let mut read = EepromRead::new(EncoderAddress::ZERO, address);
        match self.run(&mut read) {
            Ok(word) => writeln!(console, "EEPROM {address:02x}: {word:04x}"),
            Err(error) => writeln!(console, "EEPROM {address:02x}: {error}"),
        }
    }
}

/// The frames of a request, with the pauses between them.
fn message(request: Request, line: Line) -> Prepared {
    let gap_bits = line.rate.bits(line.frame_gap_ns);
    let (mut bits, mut len) = (0, 0);
    for frame in request.emit().as_slice() {
        if len > 0 {
            bits |= ((1 << gap_bits) - 1) << len;
            len += gap_bits;
        }
        bits |= frame.line().bits() << len;
        len += FRAME_BITS;
    }
    Prepared::new(bits, len, 0)
}

/// Reads the whole position of encoder 0 for ever; prints every sixteenth, and every fault. Does what is typed meanwhile.
///
/// # Panics
/// At 16 Mbit/s.
pub fn master(rate: BitRate) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let Board { mut console, clock, transmitter, receiver, channel } = Board::new(port, 16);
    let receiver = RingReceiver::new(channel, receiver);
    let line = Line::new(rate).with_response_timeout_ns(RESPONSE_TIMEOUT_NS).with_hand_over_ns(LATENCY_NS);
    let mut master = Master { clock, transmitter, receiver, line, free_ns: 0 };
    let mut typed = Typed::default();
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs40);
    let message = message(request, line);
    let (mut good, mut bad) = (0_u32, 0_u32);
    let _ = writeln!(console, "A-format master, {} bit/s", rate.bits_per_second());
    loop {
        let (outcome, took_ns) = master.exchange(request, &message);
        match outcome {
            Ok(exchange) => {
                good += 1;
                if good % 16 == 1 {
                    let abs = exchange.response.abs().unwrap_or(0);
                    let _ = writeln!(console, "abs {abs} in {took_ns} ns, {good} good, {bad} bad");
                }
            }
            Err(error) => {
                bad += 1;
                let _ = writeln!(console, "fault: {error}, {good} good, {bad} bad");
            }
        }
        if let Some(command) = typed.take(&console) {
            let _ = master.command(command, &mut console);
        }
        master.free_ns += PAUSE_NS;
    }
}

/// Encoder 0, whose shaft turns on by one with every answer.
///
/// As with T-Format the answer to the read request that came last is made ahead, but not after another request. `wait_cycles` are on top of the way through
/// the processor.
///
/// # Panics
/// At 16 Mbit/s.
pub fn encoder(rate: BitRate, wait_cycles: u32) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let Board { mut console, mut clock, mut transmitter, mut receiver, .. } = Board::new(port, 16);
    let mut device = Device::<1>::new(EncoderAddress::ZERO, Resolution::default(), rate);
    let mut position = 0x1_2345;
    let mut ahead = Some(prepare(&mut device, Operation::Abs40, &mut position, wait_cycles));
    let _ = writeln!(console, "A-format encoder, {} bit/s", rate.bits_per_second());
    loop {
        let Some(unit) = receiver.take() else { continue };
        // Data frames have another sync code, so the content of a command frame says all.
        let prepared = ahead.as_ref().filter(|(command_frame, _)| unit.framed && unit.content == *command_frame);
        let started = prepared.is_some();
        if let Some((_, message)) = prepared {
            transmitter.send(message);
        }
        let now_ns = clock.now_ns();
        let reply = device.hear(&[unit.framed.then_some(unit.content)], now_ns);
        if !unit.framed {
            continue;
        }
        let answered = reply.is_some();
        if let Some(reply) = reply.filter(|_| !started) {
            transmitter.send(&Prepared::new(reply.line.bits(), reply.line.len(), 0));
        }
        let operation = READS.into_iter().find(|operation| command_frame(*operation) == unit.content);
        if let Some(operation) = operation {
            ahead = Some(prepare(&mut device, operation, &mut position, wait_cycles));
        } else if answered {
            // It may have changed what an answer says, and repetitions are counted: nothing is made ahead now.
            ahead = None;
        }
    }
}

/// The requests that change nothing and are one frame long.
const READS: [Operation; 4] = [Operation::Abs40, Operation::Abs24Low, Operation::Abs17, Operation::Status];

fn command_frame(operation: Operation) -> u16 {
    let request = Request::new(EncoderAddress::ZERO, operation);
    request.emit().as_slice().first().map_or(0, |frame| frame.content())
}

/// The shaft moves, and the answer to `operation` is made.
fn prepare(device: &mut Device<1>, operation: Operation, position: &mut u32, wait_cycles: u32) -> (u16, Prepared) {
    *position += 1;
    device.set_position(*position, 7);
    let answer = device.answer(Request::new(EncoderAddress::ZERO, operation), 0);
    let line = answer.map_or(nikon_aformat::Window::EMPTY, |answer| answer.emit().line());
    (command_frame(operation), Prepared::new(line.bits(), line.len(), wait_cycles))
}
