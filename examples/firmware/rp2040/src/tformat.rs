//! T-Format over the port: a master that prints positions, and an encoder.

use core::convert::Infallible;
use core::fmt::{self, Write};

use servowire_core::{Ended, Procedure};
use tformat::device::Device;
use tformat::master::{EEPROM_POLLING, EepromAccess, Line, MultiTurnZero, Progress, Transaction};
use tformat::{Abm, Abs, Address, BitRate, Error, Page, Request, Resolution, Response};

use crate::board::{Board, Console};
use crate::clock::Clock;
use crate::commands::{Command, Typed};
use crate::port::{Prepared, RingReceiver, Transmitter, Unit};
use crate::programs::Rate;

/// From the end of one transaction to the beginning of the next.
const PAUSE_NS: u64 = 20_000;

/// That of the encoder below.
const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};

const fn rate_of(rate: BitRate) -> Rate {
    match rate {
        BitRate::Mbit2_5 => Rate::MBIT2_5,
        BitRate::Mbit5 => Rate::MBIT5,
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

/// How long a procedure waits for an answer.
const PATIENT_NS: u32 = 40_000;

impl Master {
    /// One request and its answer, when the line is free. How long they took.
    fn exchange(&mut self, request: Request, message: &Prepared) -> (Result<Response, Error>, u64) {
        let Self { clock, transmitter, receiver, line, free_ns } = self;
        receiver.settle(clock, *free_ns, u64::from(line.rate.fields_ns(2)));
        let began_ns = clock.now_ns();
        let mut transaction = Transaction::start(request, *line, began_ns);
        transmitter.send(message);
        let outcome = loop {
            let progress = match receiver.take() {
                Some(Unit { content, framed: true }) => transaction.hear(&[content as u8], clock.now_ns()),
                Some(_) => transaction.framing_error(clock.now_ns()),
                None => transaction.poll(clock.now_ns()),
            };
            let (end, ready_ns) = match progress {
                Progress::Pending { .. } => continue,
                Progress::Done { value, ready_ns } => (Ok(value.response), ready_ns),
                Progress::Failed { error, ready_ns } => (Err(error), ready_ns),
            };
            *free_ns = ready_ns;
            break end;
        };
        (outcome, clock.now_ns() - began_ns)
    }

    /// A procedure of several exchanges.
    fn run<P: Procedure<Request = Request, Response = Response, Error = Error>>(
        &mut self,
        mut procedure: P,
    ) -> Result<P::Value, Error> {
        // An encoder made of software, as that of this folder, takes more than 10 us for an answer that it has not made ahead.
        let line = self.line;
        self.line = line.with_response_timeout_ns(PATIENT_NS);
        let now_ns = self.clock.now_ns();
        let Ok(ended) = servowire_core::run(&mut procedure, now_ns, |request, not_before_ns| {
            while self.clock.now_ns() < not_before_ns {}
            let (outcome, _) = self.exchange(request, &message(request));
            Ok::<_, Infallible>(Ended { outcome, ready_ns: self.free_ns.max(self.clock.now_ns()) })
        });
        self.free_ns = ended.ready_ns;
        // Afterwards it has the answer to this one ready again.
        let _ = self.exchange(Request::ReadAll, &message(Request::ReadAll));
        self.line = line;
        ended.outcome
    }

    /// Does what was typed, and says what came of it.
    fn command(&mut self, command: Command, console: &mut Console) -> fmt::Result {
        let (address, access) = match command {
            Command::Read { address } => {
                (address, EepromAccess::read(Page::truncate(0), Address::truncate(address), EEPROM_POLLING))
            }
            Command::Write { address, data } => (
                address,
                EepromAccess::write(Page::truncate(0), Address::truncate(address), data as u8, EEPROM_POLLING),
            ),
            Command::LoseMultiTurnReference => {
                return match self.run(MultiTurnZero::set_and_lose_multi_turn_reference(RESOLUTION, 1)) {
                    Ok(multi) => writeln!(console, "turns: {}", multi.abm.get()),
                    Err(error) => writeln!(console, "turns: {error}"),
                };
            }
            Command::Unknown => return console.write_str("?\n"),
        };
        match self.run(access) {
            Ok(byte) => writeln!(console, "EEPROM {address:02x}: {byte:02x}"),
            Err(error) => writeln!(console, "EEPROM {address:02x}: {error}"),
        }
    }
}

fn message(request: Request) -> Prepared {
    let bits = request.emit().line();
    Prepared::new(bits.bits(), bits.len(), 0)
}

/// Reads all data of the encoder for ever; prints every sixteenth position, and every fault. Does what is typed meanwhile.
pub fn master(rate: BitRate) -> ! {
    let Board { mut console, clock, transmitter, receiver, channel } = Board::new(rate_of(rate), 8);
    let receiver = RingReceiver::new(channel, receiver);
    let mut master = Master { clock, transmitter, receiver, line: Line::new(rate), free_ns: 0 };
    let mut typed = Typed::default();
    let request = Request::ReadAll;
    let message = message(request);
    let (mut good, mut bad) = (0_u32, 0_u32);
    let _ = writeln!(console, "T-Format master, {} bit/s", rate.bits_per_second());
    loop {
        let (outcome, took_ns) = master.exchange(request, &message);
        match outcome {
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
        if let Some(command) = typed.take(&console) {
            let _ = master.command(command, &mut console);
        }
        master.free_ns += PAUSE_NS;
    }
}

const ENCODER_ID: u8 = 0x17;
/// Until they are reset.
const TURNS: Abm = Abm::truncate(7);
/// A field that comes later than this is not of the request before.
const FIELD_GAP_NS: u64 = 8_000;

/// An encoder whose shaft turns on by one with every answer.
///
/// The answer has to begin 3 us after the request, and this processor needs longer to make one. So the answer to a read
/// request that came last is made ahead, while it is sent: when the request comes again, it only has to be started. All
/// others are answered when they are ready, and so is the first read after one of them. `wait_cycles`: what the way through the processor leaves of the 3 us.
pub fn encoder(rate: BitRate, wait_cycles: u32) -> ! {
    let Board { mut console, mut clock, mut transmitter, mut receiver, .. } = Board::new(rate_of(rate), 8);
    let mut device = Device::<6>::new(ENCODER_ID, rate);
    let mut position = 0x12_3456;
    device.set_position(Abs::truncate(position), TURNS);
    let mut ahead = prepare(&mut device, Request::ReadAll, &mut position, wait_cycles);
    let (mut inside, mut last_ns) = (false, 0);
    let _ = writeln!(console, "T-Format encoder, {} bit/s", rate.bits_per_second());
    loop {
        let Some(unit) = receiver.take() else {
            inside = inside && clock.now_ns() - last_ns < FIELD_GAP_NS;
            continue;
        };
        let byte = unit.content as u8;
        let prepared = ahead.as_ref().filter(|(control_field, _)| !inside && unit.framed && byte == *control_field);
        let started = prepared.is_some();
        if let Some((_, message)) = prepared {
            transmitter.send(message);
        }
        let first = !inside;
        last_ns = clock.now_ns();
        let reply = if unit.framed { device.hear(&[byte], last_ns) } else { device.framing_error(last_ns) };
        inside = reply.is_none();
        if let Some(reply) = reply.filter(|_| !started) {
            transmitter.send(&Prepared::new(reply.line.bits(), reply.line.len(), 0));
        }
        let request = READS.into_iter().find(|request| first && unit.framed && control_field(*request) == byte);
        if let Some(request) = request {
            ahead = prepare(&mut device, request, &mut position, wait_cycles);
        } else if !inside {
            // It may have changed what an answer says, and a repetition is counted: nothing is made ahead now.
            ahead = None;
        }
    }
}

/// The requests that change nothing and are one byte long.
const READS: [Request; 4] = [Request::ReadSingleTurn, Request::ReadMultiTurn, Request::ReadEncoderId, Request::ReadAll];

fn control_field(request: Request) -> u8 {
    request.emit().as_bytes().first().copied().unwrap_or_default()
}

/// The shaft moves, and the answer to `request` is made.
fn prepare(device: &mut Device<6>, request: Request, position: &mut u32, wait_cycles: u32) -> Option<(u8, Prepared)> {
    *position += 1;
    device.set_position(Abs::truncate(*position), device.abm());
    let answer = device.answer(request, 0)?.emit().line();
    Some((control_field(request), Prepared::new(answer.bits(), answer.len(), wait_cycles)))
}
