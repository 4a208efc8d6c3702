//! A-format over the port: a master that prints positions, and an encoder.

use core::fmt::Write;

use nikon_aformat::device::Device;
use nikon_aformat::master::{Line, Progress, Transaction};
use nikon_aformat::{BitRate, EncoderAddress, FRAME_BITS, Operation, Request, Resolution};

use crate::board::Board;
use crate::port::{Prepared, RingReceiver, Unit};
use crate::programs::Rate;

/// From the end of one transaction to the beginning of the next, on top of what the protocol wants.
const PAUSE_NS: u64 = 20_000;
/// How long this processor may take over one frame while the next ones wait in the ring.
const LATENCY_NS: u32 = 8_000;
/// Longest wait for the response: encoders answer after some microseconds.
const RESPONSE_TIMEOUT_NS: u32 = 20_000;

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

/// Reads the whole position of encoder 0 for ever; prints every sixteenth, and every fault.
///
/// # Panics
/// At 16 Mbit/s.
pub fn master(rate: BitRate) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let Board { mut console, mut clock, mut transmitter, receiver, channel } = Board::new(port, 16);
    let mut receiver = RingReceiver::new(channel, receiver);
    let mut line = Line::new(rate).with_response_timeout_ns(RESPONSE_TIMEOUT_NS);
    line.idle_in_response_ns += LATENCY_NS;
    let resolution = Resolution::default();
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs40);
    let message = message(Operation::Abs40);
    let frame_ns = u64::from(rate.bits_ns(FRAME_BITS));
    let (mut good, mut bad) = (0_u32, 0_u32);
    let _ = writeln!(console, "A-format master, {} bit/s", rate.bits_per_second());
    loop {
        let began_ns = clock.now_ns();
        let mut transaction = Transaction::start(request, resolution, line, began_ns);
        transmitter.send(&message);
        let mut last_ns = None;
        let (end, ready_ns) = loop {
            // Frames that wait in the ring have come one after the other.
            let unit = receiver.take();
            let at_ns = last_ns.map_or_else(|| clock.now_ns(), |last_ns| last_ns + frame_ns);
            let progress = match unit {
                Some(Unit { content, framed: true }) => transaction.frame(content, at_ns),
                Some(_) => transaction.framing_error(at_ns),
                None => transaction.poll(clock.now_ns()),
            };
            last_ns = unit.map(|_| at_ns).or(last_ns);
            match progress {
                Progress::Pending { .. } => {}
                Progress::Done { value, ready_ns } => break (Ok(value), ready_ns),
                Progress::Failed { error, ready_ns } => break (Err(error), ready_ns),
            }
        };
        let took_ns = clock.now_ns() - began_ns;
        match end.map(|response| response.abs40()) {
            Ok(Some(abs)) => {
                good += 1;
                if good % 16 == 1 {
                    let abs = abs.get();
                    let _ = writeln!(console, "abs {abs} in {took_ns} ns, {good} good, {bad} bad");
                }
            }
            Ok(None) => {}
            Err(error) => {
                bad += 1;
                let _ = writeln!(console, "fault: {error}, {good} good, {bad} bad");
            }
        }
        receiver.settle(&mut clock, ready_ns + PAUSE_NS, 2 * frame_ns);
    }
}

/// The one frame of a read request.
fn message(operation: Operation) -> Prepared {
    Prepared::new(u128::from(command_frame(operation)) << 1 | 1 << 17, FRAME_BITS, 0)
}

/// Encoder 0, whose shaft turns on by one with every answer.
///
/// As with T-Format the answer to the read request that came last is made ahead. `wait_cycles` are on top of the way through
/// the processor.
///
/// # Panics
/// At 16 Mbit/s.
pub fn encoder(rate: BitRate, wait_cycles: u32) -> ! {
    let port = rate_of(rate).expect("a rate of this port");
    let Board { mut console, mut clock, mut transmitter, mut receiver, .. } = Board::new(port, 16);
    let mut device = Device::<1>::new(EncoderAddress::ZERO, Resolution::default(), rate);
    let mut position = 0x1_2345;
    let mut ahead = prepare(&mut device, Operation::Abs40, &mut position, wait_cycles);
    let _ = writeln!(console, "A-format encoder, {} bit/s", rate.bits_per_second());
    loop {
        let Some(unit) = receiver.take() else { continue };
        // Data frames have another sync code, so the content of a command frame says all.
        let started = unit.framed && unit.content == ahead.0;
        if started {
            transmitter.send(&ahead.1);
        }
        let now_ns = clock.now_ns();
        if !unit.framed {
            device.framing_error(now_ns);
            continue;
        }
        if let Some(reply) = device.frame(unit.content, now_ns).filter(|_| !started) {
            transmitter.send(&Prepared::new(reply.line.bits(), reply.line.len(), 0));
        }
        let operation = READS.into_iter().find(|operation| command_frame(*operation) == unit.content);
        if let Some(operation) = operation {
            ahead = prepare(&mut device, operation, &mut position, wait_cycles);
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
