//! A controller finds an encoder and reads it: `cargo run -p nikon-aformat --example find_and_read`.
//!
//! The encoder is simulated, so that the example runs anywhere; on a board its part is played by a shift register.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use core::convert::Infallible;

use nikon_aformat::device::{Device, Fault};
use nikon_aformat::master::{Counters, Detection, Exchange, Line, Progress, Transaction};
use nikon_aformat::{Alm, BitRate, EncoderAddress, Error, Operation, Policy, Request, Resolution};
use servowire_core::{Ended, run};

const RATE: BitRate = BitRate::Mbit4;

/// Two cycles old at the most, and without any alarm.
const POLICY: Policy = Policy::new(250_000);

fn main() -> Result<(), Error> {
    let address = EncoderAddress::truncate(2);
    let optical = Resolution::new(22, 16).unwrap_or_default();
    let mut encoder = Device::<1>::new(address, optical, RATE);

    let (ea, resolution, mut now_ns) = find(&mut encoder)?;
    println!("encoder {ea}: {} + {} bits", resolution.st_bits(), resolution.mt_bits());

    let mut counters = Counters::new();
    let request = Request::new(ea, Operation::Abs40);
    for cycle in 0..6_u32 {
        now_ns += 125_000;
        encoder.set_position(0x3f_fff0 + cycle * 5, 41);
        if cycle == 5 {
            encoder.raise_alarms(Alm::OVSPD);
        }
        // The cable is bad in the fourth cycle.
        encoder.set_fault(if cycle == 3 { Fault::FlipBit { at: 37 } } else { Fault::None });
        let outcome = transact(&mut encoder, request, resolution, now_ns);
        counters.record(&outcome);
        match outcome {
            // The loop that uses it runs 50 us later.
            Ok(exchange) => match exchange.evidence(resolution).at(now_ns + 50_000, POLICY) {
                Ok(sample) => println!("{cycle}: {sample}"),
                Err(doubt) => println!("{cycle}: not to be used, {doubt}"),
            },
            Err(error) => println!("{cycle}: refused, {error}"),
        }
    }
    println!("{} good, {} refused", counters.good(), counters.errors());
    Ok(())
}

/// Address and widths of the only encoder on the line, and when that was known.
fn find(encoder: &mut Device<1>) -> Result<(EncoderAddress, Resolution, u64), Error> {
    let Ok(Ended { outcome, ready_ns }) = run(&mut Detection::search(), 0, |request, not_before_ns| {
        println!("   {} to encoder {}", request.command(), request.ea);
        let outcome = transact(encoder, request, Resolution::default(), not_before_ns);
        let outcome = outcome.map(|exchange| exchange.response);
        Ok::<_, Infallible>(Ended { outcome, ready_ns: not_before_ns + 100_000 })
    });
    let found = outcome?;
    Ok((found.ea, found.resolution.ok_or(Error::NotCarried)?, ready_ns))
}

/// One request and its response, carried from one end to the other.
fn transact(
    encoder: &mut Device<1>,
    request: Request,
    resolution: Resolution,
    start_ns: u64,
) -> Result<Exchange, Error> {
    let mut transaction = Transaction::start(request, resolution, Line::new(RATE), start_ns);
    let sent = transaction.transmission();
    if let Some(answer) = encoder.hear(sent.frames.units().as_slice(), sent.end_ns) {
        let _ = transaction.hear(answer.units().as_slice(), answer.end_ns);
    }
    match transaction.poll(start_ns + 10_000_000) {
        Progress::Done { value, .. } => Ok(value),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => unreachable!("10 ms are longer than any time-out"),
    }
}
