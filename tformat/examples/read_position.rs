//! A controller reads an encoder: `cargo run -p tformat --example read_position`.
//!
//! The encoder is simulated, so that the example runs anywhere; on a board its part is played by the UART.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use tformat::device::{Device, Fault};
use tformat::master::{Counters, Line, Progress, Transaction};
use tformat::{Alarm, BitRate, Error, Profile, Request, Response, U24};

/// Time of one field at 2.5 Mbit/s.
const FIELD_NS: u64 = 4_000;

fn main() -> Result<(), Error> {
    let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
    encoder.set_alarm(Alarm::BatteryAlarm, true);
    let mut counters = Counters::new();

    for cycle in 0..6_u32 {
        let now_ns = u64::from(cycle) * 125_000;
        encoder.set_position(U24::truncate(0x7f_fff0 + cycle * 5), U24::truncate(41));
        // The cable is bad in the fourth cycle.
        encoder.set_fault(if cycle == 3 { Fault::FlipBit { at: 37 } } else { Fault::None });

        let outcome = read(&mut encoder, now_ns);
        counters.record(&outcome);
        match outcome {
            Ok(Response::Id3(full)) => {
                let profile =
                    Profile::from_enid(full.enid).map_or_else(|| Profile::new(24, 16), |hint| Ok(hint.profile));
                let profile = profile.unwrap_or_else(|_| unreachable!("24 and 16 bits are possible widths"));
                let position = profile.position(full.abs, full.abm)?;
                println!("{cycle}: turn {:>3}, {:>7} counts, alarms {}", position.turns, position.abs, full.almc);
            }
            Ok(other) => println!("{cycle}: unexpected {other:?}"),
            Err(error) => println!("{cycle}: refused, {error}"),
        }
    }
    println!("{} good, {} refused", counters.good(), counters.errors());
    Ok(())
}

/// One request for ID 3 and its answer, the bytes carried from one end to the other.
fn read(encoder: &mut Device<6>, now_ns: u64) -> Result<Response, Error> {
    let mut transaction = Transaction::start(Request::Id3, Line::new(BitRate::Mbit2_5), now_ns);
    let mut reply = None;
    for (k, byte) in (1..).zip(transaction.frame().as_bytes()) {
        reply = encoder.byte(*byte, now_ns + FIELD_NS * k);
    }
    if let Some(reply) = reply {
        for (k, byte) in (1..).zip(reply.frame.as_bytes()) {
            let _ = transaction.byte(*byte, reply.at_ns + FIELD_NS * k);
        }
    }
    match transaction.poll(now_ns + 100_000) {
        Progress::Done(response) => Ok(response),
        Progress::Failed(error) => Err(error),
        Progress::Waiting { .. } => unreachable!("100 us are longer than any time-out"),
    }
}
