//! Fits an encoder to a machine: sets the zero of the turn, sets the turns to 0, and writes and reads a name.
//!
//! `cargo run -p tformat --example commissioning`. **On a motor in service the first step shifts the commutation angle.**
//! The encoder is simulated, under combinations of all that the documents leave open: the master has to cope with each.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use core::convert::Infallible;

use servowire_core::{Ended, Procedure};
use tformat::device::{Behaviour, Device};
use tformat::master::{
    DriverOff, EEPROM_POLLING, EepromAccess, Line, MultiTurnZero, Progress, SingleTurnZero, Transaction, Transmission,
};
use tformat::{Abm, Abs, Address, BitRate, Error, OutOfRange, Page, Request, Resolution, Response};

const NAME: &[u8] = b"axis 2";

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let line = line();
    let transaction = Transaction::start(Request::ReadAll, line, 100_000);
    let Transmission { driver_on_ns, driver_off: DriverOff { earliest_ns, latest_ns }, .. } =
        transaction.transmission();
    println!("driver on at {driver_on_ns} ns, off between {earliest_ns} and {latest_ns} ns");

    let resolution = resolution()?;
    for number in (0..Behaviour::NUMBERED).step_by(819) {
        let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
        encoder.set_behaviour(Behaviour::numbered(number));
        encoder.set_position(Abs::truncate(0x12_3456), Abm::truncate(700));
        encoder.eeprom_mut()[1][0] = b'?';
        let fitted = fit(&mut encoder, line, resolution)?;
        println!("combination {number:4}: {fitted}");
    }
    // An encoder that answers after the master's patience has ended.
    let mut slow = Device::<6>::new(0x17, BitRate::Mbit2_5);
    slow.set_behaviour(Behaviour::new().with_response_delay_ns(90_000));
    let ended = fit(&mut slow, line, resolution);
    println!("a slow encoder: {}", ended.unwrap_or_else(|error| error.to_string()));
    Ok(())
}

/// 100 m of cable, a receiver that is always on, a driver that needs 1.2 us, and DMA blocks.
fn line() -> Line {
    Line::new(BitRate::Mbit2_5)
        .with_echo()
        .with_driver_lead_ns(1_200)
        .with_turn_around_ns(1_600)
        .with_response_timeout_ns(12_000)
        .with_field_timeout_ns(8_000)
        .with_hand_over_ns(50_000)
        .with_sampling_ns(480)
}

/// 23 bits in the turn and 16 bits of turns, counted from 0 to 65,535; upper bits of a compatible encoder are left alone.
fn resolution() -> Result<Resolution, OutOfRange> {
    let resolution = Resolution::new(23, 16)?.with_unsigned_turns().with_upper_bits_ignored();
    assert!(!resolution.has_signed_turns());
    Ok(resolution)
}

fn fit(encoder: &mut Device<6>, line: Line, resolution: Resolution) -> Result<String, Error> {
    let mut host = Host { encoder, line, now_ns: 0 };
    let single = host.run(&mut SingleTurnZero::set_and_shift_commutation_angle(resolution, 4))?;
    let multi = host.run(&mut MultiTurnZero::set_and_lose_multi_turn_reference(resolution, 1))?;
    for (address, byte) in (0..).zip(NAME) {
        let mut access = EepromAccess::write(Page::truncate(1), Address::truncate(address), *byte, EEPROM_POLLING);
        assert_eq!(host.run(&mut access)?, *byte, "it was read back");
    }
    Ok(format!("{single}, {multi}, a name of {} bytes, after {} ms", NAME.len(), host.now_ns / 1_000_000))
}

/// What a program has at its line.
struct Host<'a> {
    encoder: &'a mut Device<6>,
    line: Line,
    now_ns: u64,
}

impl Host<'_> {
    /// A procedure from its start to its end, and then on from when the line is free.
    fn run<P: Procedure<Request = Request, Response = Response, Error = Error>>(
        &mut self,
        procedure: &mut P,
    ) -> Result<P::Value, Error> {
        let now_ns = self.now_ns;
        let Ok(Ended { outcome, ready_ns }) = servowire_core::run(procedure, now_ns, |request, not_before_ns| {
            Ok::<_, Infallible>(self.exchange(request, not_before_ns))
        });
        self.now_ns = ready_ns;
        outcome
    }

    /// One request and its response in one block, as a DMA would hand it over.
    fn exchange(&mut self, request: Request, start_ns: u64) -> Ended<Response, Error> {
        let mut transaction = Transaction::start(request, self.line, start_ns);
        let request = transaction.transmission();
        if let Some(answer) = self.encoder.hear(request.frame.as_bytes(), request.end_ns) {
            // What is not there when the time is over comes too late.
            let in_time = matches!(transaction.progress(), Progress::Pending { until_ns } if answer.end_ns <= until_ns);
            if in_time {
                let _ = transaction.hear(answer.frame.as_bytes(), answer.end_ns);
            }
        }
        let (outcome, ready_ns) = match transaction.poll(u64::MAX) {
            Progress::Done { value, ready_ns } => (Ok(value.response), ready_ns),
            Progress::Failed { error, ready_ns } => (Err(error), ready_ns),
            Progress::Pending { .. } => unreachable!("its time is over"),
        };
        Ended { outcome, ready_ns }
    }
}
