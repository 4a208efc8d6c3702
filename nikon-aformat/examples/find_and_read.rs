//! A controller finds an encoder and reads it: `cargo run -p nikon-aformat --example find_and_read`.
//!
//! The encoder is simulated, so that the example runs anywhere; on a board its part is played by a shift register.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use nikon_aformat::device::{Device, Fault};
use nikon_aformat::master::{Counters, Detection, Line, Progress, Step, Transaction};
use nikon_aformat::{
    Alm, BitRate, EncoderAddress, Error, FRAME_BITS, Operation, Request, Resolution, Response, Window,
};

const RATE: BitRate = BitRate::Mbit4;

fn main() -> Result<(), Error> {
    let address = EncoderAddress::truncate(2);
    let optical = Resolution::new(22, 16).unwrap_or_default();
    let mut encoder = Device::<1>::new(address, optical, RATE);
    encoder.set_alarms(Alm::BATT, true);

    let (ea, resolution, mut now_ns) = find(&mut encoder)?;
    println!("encoder {ea}: {} + {} bits", resolution.st_bits(), resolution.mt_bits());

    let mut counters = Counters::new();
    let request = Request::new(ea, Operation::Abs40);
    for cycle in 0..6_u32 {
        now_ns += 125_000;
        encoder.set_position(0x3f_fff0 + cycle * 5, 41);
        // The cable is bad in the fourth cycle.
        encoder.set_fault(if cycle == 3 { Fault::FlipBit { at: 37 } } else { Fault::None });
        let outcome = transact(&mut encoder, request, resolution, now_ns);
        counters.record(&outcome);
        match outcome.and_then(|raw| Ok((resolution.position(raw.abs().unwrap_or(0), 40)?, raw.es()))) {
            Ok((position, es)) => {
                let es = es.unwrap_or_default();
                println!("{cycle}: turn {:>3}, {:>7} counts, status {es}", position.turns, position.single_turn);
            }
            Err(error) => println!("{cycle}: refused, {error}"),
        }
    }
    println!("{} good, {} refused", counters.good(), counters.errors());
    Ok(())
}

/// Address and widths of the only encoder on the line, and when that was known.
fn find(encoder: &mut Device<1>) -> Result<(EncoderAddress, Resolution, u64), Error> {
    let mut detection = Detection::search();
    let mut step = detection.start(0);
    loop {
        match step {
            Step::Send { request, not_before_ns } => {
                println!("   {} to encoder {}", request.command(), request.ea);
                let outcome = transact(encoder, request, Resolution::default(), not_before_ns);
                step = detection.receive(outcome, not_before_ns + 100_000);
            }
            Step::Done { value, ready_ns } => {
                let resolution = value.resolution.ok_or(Error::NotCarried)?;
                return Ok((value.ea, resolution, ready_ns));
            }
            Step::Failed { error, .. } => return Err(error),
        }
    }
}

/// One request and its response, the frames carried from one end to the other.
fn transact(encoder: &mut Device<1>, request: Request, resolution: Resolution, now_ns: u64) -> Result<Response, Error> {
    let line = Line::new(RATE);
    let mut transaction = Transaction::start(request, resolution, line, now_ns);
    let frame_ns = u64::from(RATE.bits_ns(FRAME_BITS));
    let mut at_ns = now_ns;
    let mut answer = None;
    for frame in transaction.frames().as_slice() {
        at_ns += frame_ns + u64::from(line.frame_gap_ns);
        answer = encoder.frame(frame.content(), at_ns);
    }
    if let Some(answer) = answer {
        let mut rest = answer.line;
        at_ns = answer.at_ns;
        while rest.len() >= FRAME_BITS {
            at_ns += frame_ns;
            let _ = match rest.get(17) {
                Some(true) => transaction.frame(content(rest), at_ns),
                _ => transaction.framing_error(at_ns),
            };
            rest = rest.skip(FRAME_BITS).unwrap_or(Window::EMPTY);
        }
    }
    match transaction.poll(now_ns + 10_000_000) {
        Progress::Done { value, .. } => Ok(value.response),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => unreachable!("10 ms are longer than any time-out"),
    }
}

/// The content bits of the frame at the beginning of a piece of line.
fn content(line: Window) -> u16 {
    u16::try_from(line.bits() >> 1 & 0xffff).unwrap_or(0)
}
