//! Master and encoder on one line.

use core::convert::Infallible;

use nrz_line::{Format, Receiver, Wave};
use proptest::prelude::*;
use servowire_core::{Ended, Procedure};
use tformat::device::{Behaviour, Device, Fault};
use tformat::master::{EEPROM_POLLING, EepromAccess, Line, Progress, Reset, SingleTurnZero, Transaction};
use tformat::{Abm, Abs, Adf, Almc, BitRate, DataId, Error, Page, Request, Resolution, Response, Window};

fn encoder() -> Device<6> {
    let mut device = Device::new(0x17, BitRate::Mbit2_5);
    device.set_position(Abs::truncate(0x51_2345), Abm::truncate(0xfffe));
    device
}

/// One transaction over UARTs that hear each other; the outcome and the time it ended.
fn transact(device: &mut Device<6>, request: Request, now_ns: u64) -> Ended<Response, Error> {
    let mut master = Transaction::start(request, Line::new(BitRate::Mbit2_5).with_echo(), now_ns);
    let sent = request.emit();
    for (k, byte) in (1..).zip(sent.as_bytes()) {
        let _ = master.hear(&[*byte], now_ns + 4_000 * k);
    }
    if let Some(answer) = device.hear(sent.as_bytes(), now_ns + 4_000 * sent.as_bytes().len() as u64) {
        for (k, byte) in (1..).zip(answer.frame.as_bytes()) {
            let _ = master.hear(&[*byte], answer.start_ns + 4_000 * k);
        }
    }
    match master.progress() {
        Progress::Done { value, .. } => Ended { outcome: Ok(value.response), ready_ns: now_ns + 60_000 },
        Progress::Failed { error, .. } => Ended { outcome: Err(error), ready_ns: now_ns + 60_000 },
        Progress::Pending { until_ns } => match master.poll(until_ns + 1) {
            Progress::Failed { error, .. } => Ended { outcome: Err(error), ready_ns: until_ns },
            other => panic!("{other:?}"),
        },
    }
}

/// Runs a procedure to its end.
fn run<P: Procedure<Request = Request, Response = Response, Error = Error>>(
    mut procedure: P,
    device: &mut Device<6>,
    now_ns: u64,
) -> (Result<P::Value, Error>, u64) {
    let Ok(ended) = servowire_core::run(&mut procedure, now_ns, |request, not_before_ns| {
        Ok::<_, Infallible>(transact(device, request, not_before_ns))
    });
    (ended.outcome, ended.ready_ns)
}

proptest! {
    #[test]
    fn every_request_is_answered_in_kind(id in prop::sample::select(DataId::ALL.to_vec()), address in 0..128_u8, edf: u8) {
        let mut device = encoder();
        let request = Request::of(id, Adf::from_bits(address), edf);
        let ended = transact(&mut device, request, 100_000);
        prop_assert_eq!(ended.outcome.map(Response::data_id), Ok(request.data_id()));
    }
}

#[test]
fn resets_do_what_the_table_says() {
    let mut device = encoder();
    device.raise_alarms(Almc::BE | Almc::OH);
    device.end_alarms(Almc::BE);
    assert_eq!(device.almc().bits(), 0x50);
    let (done, now_ns) = run(Reset::clear_errors(), &mut device, 0);
    assert!(done.is_ok());
    // The cause of the over-heat is still there; position and turns are as before.
    assert_eq!((device.almc().bits(), device.abs().get(), device.abm().get()), (0x10, 0x51_2345, 0xfffe));
    let (done, now_ns) = run(Reset::set_single_turn_zero_and_shift_commutation_angle(), &mut device, now_ns);
    assert!(done.is_ok());
    assert_eq!((device.abs().get(), device.abm().get()), (0, 0xfffe));
    device.end_alarms(Almc::OH);
    let (done, _) = run(Reset::clear_turns_and_lose_multi_turn_reference(), &mut device, now_ns);
    assert!(done.is_ok());
    assert_eq!((device.almc().bits(), device.abm().get()), (0, 0));
}

/// A master that sent some of the ten and was dropped, a controller that starts again: what the encoder has counted stays, or
/// does not, and it stores in silence, or does not. One more attempt says what is so: with any response of it lost, and any
/// three.
#[test]
fn a_zero_after_any_past() {
    let (mut ends, resolution) = ([0; 4], Resolution::new(23, 16).unwrap());
    for number in (0..Behaviour::NUMBERED).step_by(if cfg!(miri) { 1_001 } else { 7 }) {
        let (sent_before, lost) = (number % 10, 1 + number / 10 % 14);
        let mut device = encoder();
        device.set_behaviour(Behaviour::numbered(number));
        let mut now_ns = 100_000;
        for _ in 0..sent_before {
            now_ns = transact(&mut device, Request::SetSingleTurnZero, now_ns + 50_000).ready_ns;
        }
        assert_eq!(device.effects(), 0);
        let (before, mut exchange) = (device.abs(), 0);
        let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
        let Ok(ended) = servowire_core::run(&mut zero, now_ns + 50_000, |request, not_before_ns| {
            exchange += 1;
            let ended = transact(&mut device, request, not_before_ns);
            let hidden = exchange == lost || number % 3 == 0 && (lost..lost + 3).contains(&exchange);
            let outcome = if hidden { Err(Error::NoResponse { echo: false }) } else { ended.outcome };
            Ok::<_, Infallible>(Ended { outcome, ..ended })
        });
        let case =
            format!("{number}: {sent_before} before, {lost} lost, {:?}, effects {}", ended.outcome, device.effects());
        let set = device.effects() > 0;
        assert!(device.effects() <= 1 && set == (device.abs() != before), "{case}");
        ends[match ended.outcome {
            Ok(_) => usize::from(set) - 1,
            Err(Error::NotDone { .. }) => 1 + usize::from(set) * 9,
            Err(Error::EffectUnknown { .. }) => 2,
            Err(_) => 3 + usize::from(set) * 9,
        }] += 1;
    }
    assert!(ends[0] > 0 && ends[1] > 0, "{ends:?}");
}

#[test]
fn the_whole_eeprom_is_written_and_read_back() {
    let mut device = encoder();
    let mut now_ns = 0;
    for index in (0..762).step_by(31) {
        let (page, address) = Page::locate(index, 6).unwrap();
        let data = (index % 251) as u8;
        let (value, end) = run(EepromAccess::write(page, address, data, EEPROM_POLLING), &mut device, now_ns);
        assert_eq!(value, Ok(data));
        now_ns = end;
    }
    for index in (0..762).step_by(31) {
        let (page, address) = Page::locate(index, 6).unwrap();
        let (value, end) = run(EepromAccess::read(page, address, EEPROM_POLLING), &mut device, now_ns);
        assert_eq!(value, Ok((index % 251) as u8));
        now_ns = end;
    }
    assert_eq!(device.eeprom_mut()[0][1], 0xff);
}

#[test]
fn faults_are_seen_by_the_master() {
    let mut device = encoder();
    let mut now_ns = 0;
    let mut outcome = |fault| {
        device.set_fault(fault);
        now_ns += 1_000_000;
        transact(&mut device, Request::ReadSingleTurn, now_ns).outcome
    };
    assert_eq!(outcome(Fault::Silent), Err(Error::NoResponse { echo: true }));
    assert!(matches!(outcome(Fault::BadCrc), Err(Error::Crc { .. })));
    assert_eq!(outcome(Fault::CutAfter { fields: 4 }), Err(Error::Truncated { got: 4, want: 6 }));
    assert!(matches!(outcome(Fault::FlipBit { at: 23 }), Err(Error::Crc { .. })));
    assert!(matches!(outcome(Fault::FlipBit { at: 5 }), Err(Error::Parity { .. })));
    assert!(matches!(outcome(Fault::RejectAll), Err(Error::Rejected { .. })));
    assert!(outcome(Fault::None).is_ok());
    device.set_fault(Fault::FlipBit { at: 9 });
    let reply = device.hear(&[0x02], 20_004_000).unwrap();
    assert_eq!(Response::parse_line(Request::ReadSingleTurn, reply.line), Err(Error::Delimiter { field: 0 }));
}

/// xorshift: the noise of the line must be the same in every run.
fn next(seed: &mut u64) -> u64 {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    *seed
}

/// One way over the line: rendered at 16 samples a bit with rate error, jitter of every edge by up to two samples
/// and now and then a wrong bit, received by the oversampling receiver. Gives the bytes with their framing.
fn over_the_line(line: Window, seed: &mut u64, wrong_bits: bool) -> Vec<(u8, bool)> {
    let wave = Wave::new(16, (next(seed) % 20_000) as i32 - 10_000, next(seed) as u32);
    let flip = if wrong_bits { next(seed) % u64::from(line.len()) } else { u64::MAX };
    let mut edge = |bit: u64| wave.first_sample(bit + 2) + next(seed) % 5;
    let mut receiver = Receiver::new(Format::new(16, 8).unwrap());
    let mut fields = Vec::new();
    let mut from = edge(0);
    fields.extend(receiver.run(true, from));
    for bit in 0..u64::from(line.len()) {
        let to = edge(bit + 1);
        fields.extend(receiver.run(line.get(bit as u32).unwrap() != (bit == flip), to - from));
        from = to;
    }
    fields.extend(receiver.run(true, 200));
    fields.iter().map(|f| (f.content as u8, f.delimiter)).collect()
}

/// Master and encoder over a line with delay, jitter, rate error and, in a third of the answers, one wrong bit:
/// clean answers always arrive, no answer with a single wrong bit is ever taken for a good one.
#[test]
fn both_ends_over_a_poor_line() {
    let mut device = encoder();
    let mut seed = 0x5eed_0123_4567_89ab;
    let mut refused = 0;
    for k in 0..3_000_u64 {
        let abs = Abs::truncate(next(&mut seed) as u32 & 0x7f_ffff);
        device.set_position(abs, Abm::truncate(k as u32));
        let (request, now_ns) = ([Request::ReadSingleTurn, Request::ReadAll][(k % 2) as usize], k * 1_000_000);
        let mut master = Transaction::start(request, Line::new(BitRate::Mbit2_5), now_ns);
        let heard = over_the_line(master.transmission().frame.line(), &mut seed, false);
        assert_eq!(heard, [(request.emit().as_bytes()[0], true)]);
        let reply = device.hear(&[heard[0].0], now_ns + 4_000).unwrap();
        let damaged = next(&mut seed) % 3 == 0;
        let cable_ns = next(&mut seed) % 1_000;
        for (n, (byte, framed)) in (1..).zip(over_the_line(reply.line, &mut seed, damaged)) {
            let at_ns = reply.start_ns + cable_ns + 4_000 * n;
            let _ = if framed { master.hear(&[byte], at_ns) } else { master.framing_error(at_ns) };
        }
        match master.poll(now_ns + 900_000) {
            Progress::Done { value, .. } => {
                assert!(!damaged, "a wrong bit was not seen");
                assert_eq!(value.response.abs(), Some(abs));
            }
            Progress::Failed { .. } => {
                assert!(damaged);
                refused += 1;
            }
            Progress::Pending { .. } => panic!("the time-out did not end it"),
        }
    }
    assert!((900..1_100).contains(&refused), "{refused}");
}
