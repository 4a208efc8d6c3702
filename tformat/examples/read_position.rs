//! A controller reads an encoder: `cargo run -p tformat --example read_position`.
//!
//! The encoder is simulated, so that the example runs anywhere; on a board its part is played by the UART.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use tformat::device::{Device, Fault};
use tformat::master::{Counters, Line, Progress, Transaction};
use tformat::{Abm, Abs, Almc, BitRate, Error, Request, Resolution, Response};

/// Time of one field at 2.5 Mbit/s.
const FIELD_NS: u64 = 4_000;

fn main() -> Result<(), Error> {
    let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
    encoder.set_alarms(Almc::BA, true);
    let mut counters = Counters::new();

    for cycle in 0..6_u32 {
        let now_ns = u64::from(cycle) * 125_000;
        encoder.set_position(Abs::truncate(0x7f_fff0 + cycle * 5), Abm::truncate(41));
        // The cable is bad in the fourth cycle.
        encoder.set_fault(if cycle == 3 { Fault::FlipBit { at: 37 } } else { Fault::None });

        let outcome = read(&mut encoder, now_ns);
        counters.record(&outcome);
        match outcome {
            Ok(Response::ReadAll(data)) => match Resolution::from_enid(data.enid) {
                Some(hint) => {
                    let position = hint.resolution.position(data.abs, data.abm)?;
                    println!("{cycle}: {position}, alarms [{}]", data.almc);
                }
                None => println!("{cycle}: an encoder of unknown widths, {data}"),
            },
            Ok(other) => println!("{cycle}: unexpected {other}"),
            Err(error) => println!("{cycle}: refused, {error}"),
        }
    }
    let (good, refused, share) = (counters.good(), counters.errors(), counters.errors_per_million());
    println!("{good} good, {refused} refused: {share} of a million");
    Ok(())
}

/// One request for ID 3 and its response, the bytes carried from one end to the other.
fn read(encoder: &mut Device<6>, now_ns: u64) -> Result<Response, Error> {
    let mut transaction = Transaction::start(Request::ReadAll, Line::new(BitRate::Mbit2_5), now_ns);
    let mut sent = None;
    for (k, byte) in (1..).zip(transaction.frame().as_bytes()) {
        sent = encoder.byte(*byte, now_ns + FIELD_NS * k);
    }
    if let Some(sent) = sent {
        for (k, byte) in (1..).zip(sent.frame.as_bytes()) {
            let _ = transaction.bytes(&[*byte], sent.at_ns + FIELD_NS * k);
        }
    }
    match transaction.poll(now_ns + 100_000) {
        Progress::Done { value, .. } => Ok(value.response),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => unreachable!("100 us are longer than any time-out"),
    }
}
