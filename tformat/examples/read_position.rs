//! A controller reads an encoder: `cargo run -p tformat --example read_position`.
//!
//! The encoder is simulated, so that the example runs anywhere; on a board its part is played by the UART.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use tformat::device::{Device, Fault};
use tformat::master::{Counters, Exchange, Line, Progress, Transaction};
use tformat::{Abm, Abs, Almc, BitRate, Error, OutOfRange, Policy, Request, Resolution, Tolerated};

/// Time of one field at 2.5 Mbit/s.
const FIELD_NS: u64 = 4_000;

fn main() -> Result<(), OutOfRange> {
    let resolution = Resolution::new(23, 16)?;
    let policy = Policy::new(125_000).tolerating(Tolerated::MULTI_TURN);
    let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
    encoder.raise_alarms(Almc::BA);
    let mut counters = Counters::new();

    for cycle in 0..6_u32 {
        let now_ns = u64::from(cycle) * 125_000;
        encoder.set_position(Abs::truncate(0x7f_fff0 + cycle * 5), Abm::truncate(41));
        // The cable is bad in the fourth cycle.
        encoder.set_fault(if cycle == 3 { Fault::FlipBit { at: 37 } } else { Fault::None });

        // In the sixth the battery is empty.
        if cycle == 5 {
            encoder.raise_alarms(Almc::BE);
        }

        let outcome = read(&mut encoder, now_ns);
        counters.record(&outcome);
        match outcome {
            // The raw fields stay readable; control takes a position only if it may be used, and is not older than a cycle.
            Ok(exchange) => match exchange.evidence(resolution).at(now_ns + 60_000, policy) {
                Ok(sample) => println!("{cycle}: {sample}"),
                Err(doubt) => println!("{cycle}: not to be used, {doubt}: {}", exchange.response),
            },
            Err(error) => println!("{cycle}: refused, {error}"),
        }
    }
    let (good, refused, share) = (counters.good(), counters.errors(), counters.errors_per_million());
    println!("{good} good, {refused} refused: {share} of a million");
    Ok(())
}

/// One request for ID 3 and its response, the bytes carried from one end to the other.
fn read(encoder: &mut Device<6>, now_ns: u64) -> Result<Exchange, Error> {
    let mut transaction = Transaction::start(Request::ReadAll, Line::new(BitRate::Mbit2_5), now_ns);
    let request = transaction.transmission();
    if let Some(answer) = encoder.hear(request.frame.as_bytes(), request.end_ns) {
        for (k, byte) in (1..).zip(answer.frame.as_bytes()) {
            let _ = transaction.hear(&[*byte], answer.start_ns + FIELD_NS * k);
        }
    }
    match transaction.poll(now_ns + 100_000) {
        Progress::Done { value, .. } => Ok(value),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => unreachable!("100 us are longer than any time-out"),
    }
}
