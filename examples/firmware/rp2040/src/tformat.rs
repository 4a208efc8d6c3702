//! T-Format over the port: a master that prints positions, and an encoder.

use core::fmt::Write;

use tformat::device::Device;
use tformat::master::{Line, Progress, Transaction};
use tformat::{Abm, Abs, BitRate, Request, Response};

use crate::board::Board;
use crate::port::{Prepared, RingReceiver, Unit};
use crate::programs::Rate;

/// From the end of one transaction to the beginning of the next.
const PAUSE_NS: u64 = 20_000;

const fn rate_of(rate: BitRate) -> Rate {
    match rate {
        BitRate::Mbit2_5 => Rate::MBIT2_5,
        BitRate::Mbit5 => Rate::MBIT5,
    }
}

/// Reads all data of the encoder for ever; prints every sixteenth position, and every fault.
pub fn master(rate: BitRate) -> ! {
    let Board { mut console, mut clock, mut transmitter, receiver, channel } = Board::new(rate_of(rate), 8);
    let mut receiver = RingReceiver::new(channel, receiver);
    let line = Line::new(rate);
    let request = Request::ReadAll;
    let bits = request.emit().line();
    let message = Prepared::new(bits.bits(), bits.len(), 0);
    let (mut good, mut bad) = (0_u32, 0_u32);
    let _ = writeln!(console, "T-Format master, {} bit/s", rate.bits_per_second());
    loop {
        let began_ns = clock.now_ns();
        let mut transaction = Transaction::start(request, line, began_ns);
        transmitter.send(&message);
        let (end, ready_ns) = loop {
            let progress = match receiver.take() {
                Some(Unit { content, framed: true }) => transaction.bytes(&[content as u8], clock.now_ns()),
                Some(_) => transaction.framing_error(clock.now_ns()),
                None => transaction.poll(clock.now_ns()),
            };
            match progress {
                Progress::Pending { .. } => {}
                Progress::Done { value, ready_ns } => break (Ok(value.response), ready_ns),
                Progress::Failed { error, ready_ns } => break (Err(error), ready_ns),
            }
        };
        let took_ns = clock.now_ns() - began_ns;
        match end {
            Ok(Response::ReadAll(all)) => {
                good += 1;
                if good % 16 == 1 {
                    let (abs, abm, enid) = (all.abs.get(), all.abm.get(), all.enid);
                    let _ = writeln!(
                        console,
                        "abs {abs} abm {abm} enid {enid:02x} in {took_ns} ns, {good} good, {bad} bad"
                    );
                }
            }
            Ok(_) => {}
            Err(error) => {
                bad += 1;
                let _ = writeln!(console, "fault: {error}, {good} good, {bad} bad");
            }
        }
        receiver.settle(&mut clock, ready_ns + PAUSE_NS, u64::from(rate.fields_ns(2)));
    }
}

const ENCODER_ID: u8 = 0x17;
/// A field that comes later than this is not of the request before.
const FIELD_GAP_NS: u64 = 8_000;

/// An encoder whose shaft turns on by one with every answer.
///
/// The answer has to begin 3 us after the request, and this processor needs longer to make one. So the answer to a read
/// request that came last is made ahead, while it is sent: when the request comes again, it only has to be started. All
/// others are answered when they are ready. `wait_cycles`: what the way through the processor leaves of the 3 us.
pub fn encoder(rate: BitRate, wait_cycles: u32) -> ! {
    let Board { mut console, mut clock, mut transmitter, mut receiver, .. } = Board::new(rate_of(rate), 8);
    let mut device = Device::<6>::new(ENCODER_ID, rate);
    let mut position = 0x12_3456;
    let mut ahead = prepare(&mut device, Request::ReadAll, &mut position, wait_cycles);
    let (mut inside, mut last_ns) = (false, 0);
    let _ = writeln!(console, "T-Format encoder, {} bit/s", rate.bits_per_second());
    loop {
        let Some(unit) = receiver.take() else {
            inside = inside && clock.now_ns() - last_ns < FIELD_GAP_NS;
            continue;
        };
        let byte = unit.content as u8;
        let started = !inside && unit.framed && byte == ahead.0;
        if started {
            transmitter.send(&ahead.1);
        }
        let first = !inside;
        last_ns = clock.now_ns();
        let reply = if unit.framed { device.byte(byte, last_ns) } else { device.framing_error(last_ns) };
        inside = reply.is_none();
        if let Some(reply) = reply.filter(|_| !started) {
            transmitter.send(&Prepared::new(reply.line.bits(), reply.line.len(), 0));
        }
        let request = READS.into_iter().find(|request| first && unit.framed && control_field(*request) == byte);
        if let Some(request) = request {
            ahead = prepare(&mut device, request, &mut position, wait_cycles);
        }
    }
}

/// The requests that change nothing and are one byte long.
const READS: [Request; 4] = [Request::ReadSingleTurn, Request::ReadMultiTurn, Request::ReadEncoderId, Request::ReadAll];

fn control_field(request: Request) -> u8 {
    request.emit().as_bytes().first().copied().unwrap_or_default()
}

/// The shaft moves, and the answer to `request` is made.
fn prepare(device: &mut Device<6>, request: Request, position: &mut u32, wait_cycles: u32) -> (u8, Prepared) {
    *position += 1;
    device.set_position(Abs::truncate(*position), Abm::truncate(7));
    let answer = device.answer(request, 0).emit().line();
    (control_field(request), Prepared::new(answer.bits(), answer.len(), wait_cycles))
}
