use super::*;
use crate::master::{EepromAccess, Line, Page, Polling, Progress, Step, Transaction};
use crate::request::tests::requests;
use nrz_line::Wave;
use proptest::prelude::*;
use std::vec::Vec;

fn encoder() -> Device<6> {
    let mut device = Device::new(0x17, BitRate::Mbit2_5);
    device.set_position(U24::truncate(0x51_2345), U24::truncate(0xfffe));
    device
}

/// Sends a request by bytes and gives the reply.
fn send(device: &mut Device<6>, bytes: &[u8], now_ns: u64) -> Option<Reply> {
    (1..).zip(bytes).fold(None, |reply, (k, byte)| device.byte(*byte, now_ns + 4_000 * k).or(reply))
}

/// One transaction over UARTs that hear each other; the outcome and the time it ended.
fn transact(device: &mut Device<6>, request: Request, now_ns: u64) -> (Result<Response, Error>, u64) {
    let mut master = Transaction::start(request, Line::new(BitRate::Mbit2_5).with_echo(), now_ns);
    let sent = request.emit();
    for (k, byte) in (1..).zip(sent.as_bytes()) {
        let _ = master.byte(*byte, now_ns + 4_000 * k);
    }
    if let Some(reply) = send(device, sent.as_bytes(), now_ns) {
        for (k, byte) in (1..).zip(reply.frame.as_bytes()) {
            let _ = master.byte(*byte, reply.at_ns + 4_000 * k);
        }
    }
    match master.progress() {
        Progress::Done(response) => (Ok(response), now_ns + 60_000),
        Progress::Failed(error) => (Err(error), now_ns + 60_000),
        Progress::Waiting { until_ns } => match master.poll(until_ns + 1) {
            Progress::Failed(error) => (Err(error), until_ns),
            other => panic!("{other:?}"),
        },
    }
}

/// Runs a procedure to its end.
macro_rules! run {
    ($procedure:expr, $device:expr, $now:expr) => {{
        let mut procedure = $procedure;
        let mut step = procedure.start($now);
        loop {
            match step {
                Step::Send { request, not_before_ns } => {
                    let (outcome, end) = transact($device, request, not_before_ns);
                    step = procedure.answer(outcome, end);
                }
                Step::Done { value, not_before_ns } => break (Ok(value), not_before_ns),
                Step::Failed { error, not_before_ns } => break (Err(error), not_before_ns),
            }
        }
    }};
}

proptest! {
    #[test]
    fn every_request_is_answered_in_kind(request in requests()) {
        let mut device = encoder();
        let request = match request {
            Request::Id6 { adf, edf } => Request::write_eeprom(adf.address(), edf),
            Request::IdD { adf } => Request::read_eeprom(adf.address()),
            other => other,
        };
        let (outcome, _) = transact(&mut device, request, 100_000);
        prop_assert_eq!(outcome.map(Response::data_id), Ok(request.data_id()));
    }

    /// No damaged request moves anything in the encoder.
    #[test]
    fn damaged_requests_change_nothing(request in requests(), bit in 0..32usize) {
        let mut device = encoder();
        let mut bytes = request.emit().as_bytes().to_vec();
        let bit = bit % (bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        let before = device;
        let reply = send(&mut device, &bytes, 0);
        prop_assert_eq!((device.eeprom, device.page, device.zero, device.abm), (before.eeprom, before.page, before.zero, before.abm));
        if let Some(reply) = reply {
            prop_assert_eq!(Full::parse(reply.frame.as_bytes()).map(|f| f.sf.request_delimiter_error()), Ok(false));
        }
    }

    /// Whatever arrives, in whatever rhythm, the encoder takes it.
    #[test]
    fn any_bytes(bytes in prop::collection::vec((any::<u8>(), 0..9_000_u64, any::<bool>()), 0..60)) {
        let mut device = encoder();
        let mut now_ns = 0;
        for (byte, gap, framed) in bytes {
            now_ns += gap;
            let _ = if framed { device.byte(byte, now_ns) } else { device.framing_error(now_ns) };
        }
    }
}

#[test]
fn damage_is_told_in_the_status() {
    let mut device = encoder();
    let sf = |reply: Option<Reply>| reply.map(|r| Full::parse(r.frame.as_bytes()).unwrap().sf.raw());
    assert_eq!(sf(send(&mut device, &[0x12], 0)), Some(0x40));
    assert_eq!(sf(send(&mut device, &[0xa2], 100_000)), Some(0x00));
    assert_eq!(sf(send(&mut device, &[0xea, 0x01, 0xea], 200_000)), Some(0x00));
    assert_eq!(sf(device.framing_error(300_000)), Some(0x80));
    assert_eq!(send(&mut device, &[0x1b], 400_000), None);
    // A request that stops half way is forgotten.
    assert_eq!(send(&mut device, &[0xea, 0x01], 500_000), None);
    assert_eq!(sf(send(&mut device, &[0x1a], 600_000)), Some(0x00));
}

#[test]
fn resets_do_what_the_table_says() {
    let mut device = encoder();
    device.set_alarm(Alarm::BatteryError, true);
    device.set_alarm(Alarm::OverHeat, true);
    device.set_alarm(Alarm::BatteryError, false);
    assert_eq!(device.almc().raw(), 0x50);
    let (done, now_ns) = run!(Reset::clear_errors(), &mut device, 0);
    assert!(done.is_ok());
    // The cause of the over-heat is still there; position and turns are as before.
    assert_eq!((device.almc().raw(), device.single_turn().get(), device.abm.get()), (0x10, 0x51_2345, 0xfffe));
    let (done, now_ns) = run!(Reset::set_single_turn_zero_and_shift_commutation_angle(), &mut device, now_ns);
    assert!(done.is_ok());
    assert_eq!((device.single_turn().get(), device.abm.get()), (0, 0xfffe));
    device.set_alarm(Alarm::OverHeat, false);
    let (done, _) = run!(Reset::clear_turns_and_errors(), &mut device, now_ns);
    assert!(done.is_ok());
    assert_eq!((device.almc().raw(), device.abm.get()), (0, 0));
}

#[test]
fn another_request_or_a_short_pause_starts_the_count_again() {
    for disturb in [true, false] {
        let mut device = encoder();
        for k in 0..10 {
            let now_ns = k * 80_000;
            let _ = device.answer(Request::IdC, now_ns);
            if disturb && k == 5 {
                let _ = device.answer(Request::Id0, now_ns + 40_000);
            }
        }
        assert_eq!(device.abm.get(), if disturb { 0xfffe } else { 0 });
    }
    let mut hasty = encoder();
    for k in 0..10 {
        let _ = hasty.answer(Request::IdC, k * 39_999);
    }
    assert_eq!(hasty.abm.get(), 0xfffe);
}

#[test]
fn the_whole_eeprom_is_written_and_read_back() {
    let mut device = encoder();
    let mut now_ns = 0;
    for index in (0..762).step_by(31) {
        let (page, address) = Page::locate(index, 6).unwrap();
        let data = (index % 251) as u8;
        let (value, end) =
            run!(EepromAccess::write(Some(page), address, data, Polling::default()), &mut device, now_ns);
        assert_eq!(value, Ok(data));
        now_ns = end;
    }
    for index in (0..762).step_by(31) {
        let (page, address) = Page::locate(index, 6).unwrap();
        let (value, end) = run!(EepromAccess::read(Some(page), address, Polling::default()), &mut device, now_ns);
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
        transact(&mut device, Request::Id0, now_ns).0
    };
    assert_eq!(outcome(Fault::Silent), Err(Error::NoResponse { echo: true }));
    assert!(matches!(outcome(Fault::BadCrc), Err(Error::Crc { .. })));
    assert_eq!(outcome(Fault::CutAfter { fields: 4 }), Err(Error::Truncated { got: 4, want: 6 }));
    assert!(matches!(outcome(Fault::FlipBit { at: 23 }), Err(Error::Crc { .. })));
    assert!(matches!(outcome(Fault::FlipBit { at: 5 }), Err(Error::Parity { .. })));
    assert!(matches!(outcome(Fault::RejectAll), Err(Error::Rejected { .. })));
    assert!(outcome(Fault::None).is_ok());
    device.set_fault(Fault::FlipBit { at: 9 });
    let reply = send(&mut device, &[0x02], 20_000_000).unwrap();
    assert_eq!(Response::parse_line(Request::Id0, reply.line), Err(Error::Delimiter { field: 0 }));
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
        let abs = U24::truncate(next(&mut seed) as u32 & 0x7f_ffff);
        device.set_position(abs, U24::truncate(k as u32));
        let (request, now_ns) = ([Request::Id0, Request::Id3][(k % 2) as usize], k * 1_000_000);
        let mut master = Transaction::start(request, Line::new(BitRate::Mbit2_5), now_ns);
        let heard = over_the_line(master.frame().line(), &mut seed, false);
        assert_eq!(heard, [(request.emit().as_bytes()[0], true)]);
        let reply = device.byte(heard[0].0, now_ns + 4_000).unwrap();
        let damaged = next(&mut seed) % 3 == 0;
        let cable_ns = next(&mut seed) % 1_000;
        for (n, (byte, framed)) in (1..).zip(over_the_line(reply.line, &mut seed, damaged)) {
            let at_ns = reply.at_ns + cable_ns + 4_000 * n;
            let _ = if framed { master.byte(byte, at_ns) } else { master.framing_error(at_ns) };
        }
        match master.poll(now_ns + 900_000) {
            Progress::Done(response) => {
                assert!(!damaged, "a wrong bit was not seen");
                assert_eq!(response.abs(), Some(abs));
            }
            Progress::Failed(_) => {
                assert!(damaged);
                refused += 1;
            }
            Progress::Waiting { .. } => panic!("the time-out did not end it"),
        }
    }
    assert!((900..1_100).contains(&refused), "{refused}");
}

#[test]
fn bit_by_bit_is_the_same() {
    let request = Request::write_eeprom(Address::new(9).unwrap(), 0x5a);
    let mut by_bits = encoder();
    let line = request.emit().line();
    let mut reply = None;
    for at in 0..line.len() {
        let now_ns = 400 * u64::from(at + 1);
        reply = by_bits.bit(line.get(at).unwrap(), now_ns).or(reply);
    }
    let mut by_bytes = encoder();
    assert_eq!(reply, send(&mut by_bytes, request.emit().as_bytes(), 0));
    assert!(reply.is_some());
}
