//! Fits an encoder to a machine: sets the zero of the turn, sets the turns to 0, and writes and reads a name.
//!
//! `cargo run -p tformat --example commissioning`. **On a motor in service the first step shifts the commutation angle.**
//! The encoder is simulated, under combinations of all that the documents leave open: the master has to cope with each.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use tformat::device::{Behaviour, Device};
use tformat::master::{EEPROM_POLLING, EepromAccess, Line, MultiTurnZero, Progress, SingleTurnZero, Step, Transaction};
use tformat::{Abm, Abs, Address, BitRate, Error, OutOfRange, Page, Request, Resolution, Response};

const NAME: &[u8] = b"axis 2";

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let line = line();
    let transaction = Transaction::start(Request::ReadAll, line, 100_000);
    let (earliest, latest) = transaction.driver_off_ns();
    println!("driver on at {} ns, off between {earliest} and {latest} ns", transaction.driver_on_ns());

    let resolution = resolution()?;
    for number in (0..Behaviour::NUMBERED).step_by(819) {
        let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5).with_behaviour(Behaviour::numbered(number));
        encoder.set_position(Abs::truncate(0x12_3456), Abm::truncate(700));
        encoder.eeprom_mut()[1][0] = b'?';
        let fitted = fit(&mut encoder, line, resolution)?;
        println!("combination {number:4}: {fitted}");
    }
    // An encoder that answers after the master's patience has ended.
    let slow = Behaviour::new().with_response_delay_ns(90_000);
    let ended = fit(&mut Device::<6>::new(0x17, BitRate::Mbit2_5).with_behaviour(slow), line, resolution);
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
    let mut now_ns = 0;
    let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
    let first = zero.start(now_ns);
    let single = run(encoder, line, &mut now_ns, first, |outcome, ready_ns| zero.receive(outcome, ready_ns))?;

    let mut turns = MultiTurnZero::set_and_lose_multi_turn_reference(resolution, 1);
    let first = turns.start(now_ns);
    let multi = run(encoder, line, &mut now_ns, first, |outcome, ready_ns| turns.receive(outcome, ready_ns))?;

    for (address, byte) in (0..).zip(NAME) {
        let mut access = EepromAccess::write(Page::new(1), Address::truncate(address), *byte, EEPROM_POLLING);
        let first = access.start(now_ns);
        let held = run(encoder, line, &mut now_ns, first, |outcome, ready_ns| access.receive(outcome, ready_ns))?;
        assert_eq!(held, *byte, "it was read back");
    }
    Ok(format!("{single}, {multi}, a name of {} bytes, after {} ms", NAME.len(), now_ns / 1_000_000))
}

/// Runs a procedure: each request when it may be sent, and its outcome.
fn run<T>(
    encoder: &mut Device<6>,
    line: Line,
    now_ns: &mut u64,
    mut step: Step<T>,
    mut receive: impl FnMut(Result<Response, Error>, u64) -> Step<T>,
) -> Result<T, Error> {
    loop {
        let (outcome, ready_ns) = match step {
            Step::Send { request, not_before_ns } => exchange(encoder, line, request, not_before_ns.max(*now_ns)),
            Step::Done { value, ready_ns } => {
                *now_ns = ready_ns;
                return Ok(value);
            }
            Step::Failed { error, .. } => return Err(error),
        };
        *now_ns = ready_ns;
        step = receive(outcome, ready_ns);
    }
}

/// One request and its response in one block, as a DMA would hand it over.
fn exchange(encoder: &mut Device<6>, line: Line, request: Request, start_ns: u64) -> (Result<Response, Error>, u64) {
    let field_ns = u64::from(line.rate.fields_ns(1));
    let mut transaction = Transaction::start(request, line, start_ns);
    let mut sent = None;
    for (k, byte) in (1..).zip(transaction.frame().as_bytes()) {
        sent = encoder.byte(*byte, start_ns + field_ns * k);
    }
    if let Some(sent) = sent {
        let end_ns = sent.at_ns + field_ns * u64::from(sent.frame.fields());
        // What is not there when the time is over comes too late.
        let in_time = matches!(transaction.progress(), Progress::Pending { until_ns } if end_ns <= until_ns);
        let _ = if in_time { transaction.bytes(sent.frame.as_bytes(), end_ns) } else { transaction.progress() };
    }
    match transaction.poll(u64::MAX) {
        Progress::Done { value, ready_ns } => (Ok(value.response), ready_ns),
        Progress::Failed { error, ready_ns } => (Err(error), ready_ns),
        Progress::Pending { .. } => unreachable!("its time is over"),
    }
}
