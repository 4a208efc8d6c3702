//! Both ends talk to each other.

use core::convert::Infallible;

use crate::common::every;
use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::device::{Device, Encoders, Fault, Transmission};
use nikon_aformat::master::{
    BusTransaction, Detected, Detection, EepromRead, Line, Progress, Reset, Transaction, Write,
};
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{
    Alm, BitRate, EncoderAddress, EncoderId, Error, Layout, Operation, Request, Resolution, Response, UserAddress,
    Version, Window,
};
use proptest::prelude::*;
use servowire_core::{Ended, Procedure};

const RATE: BitRate = BitRate::Mbit16;
const LINE: Line = Line::new(RATE);

fn ea(address: u8) -> EncoderAddress {
    EncoderAddress::truncate(address)
}

fn eight(resolution: Resolution) -> Encoders<8, 2> {
    Encoders {
        all: EncoderAddress::ALL.map(|ea| {
            let mut device = Device::new(ea, resolution, RATE);
            device.set_position(u32::from(ea.get()) * 1111, u32::from(ea.get()) + 3);
            device.set_id(EncoderId::truncate(0x10_0000 + u32::from(ea.get())));
            device
        }),
    }
}

/// Sends the request of a transaction and gives the line bits that come back, in the order of time.
fn send<const N: usize, const B: usize>(
    encoders: &mut Encoders<N, B>,
    request: Request,
    now_ns: u64,
) -> (u64, Vec<Transmission>) {
    let frame_ns = u64::from(RATE.bits_ns(18));
    let mut at = now_ns;
    let mut answers = Vec::new();
    for (k, frame) in request.emit().as_slice().iter().enumerate() {
        at += frame_ns + if k > 0 { 1_000 } else { 0 };
        answers.extend(encoders.hear(&[Some(frame.content())], at).into_iter().flatten());
    }
    answers.sort_by_key(|answer| answer.start_ns);
    (at, answers)
}

/// A whole transaction; the outcome and when it ended.
fn transact<const N: usize, const B: usize>(
    encoders: &mut Encoders<N, B>,
    request: Request,
    resolution: Resolution,
    now_ns: u64,
) -> (Result<Response, Error>, u64) {
    let mut transaction = Transaction::start(request, resolution, LINE, now_ns);
    let (_, answers) = send(encoders, request, now_ns);
    for answer in answers {
        for frame in 0..answer.line.len() / 18 {
            let bits = answer.line.skip(frame * 18).unwrap().bits();
            let now_ns = answer.start_ns + u64::from(frame + 1) * 1_125;
            let framed = bits & 1 == 0 && bits >> 17 & 1 == 1;
            let _ = if framed {
                transaction.hear(&[Some((bits >> 1) as u16)], now_ns)
            } else {
                transaction.framing_error(now_ns)
            };
            match transaction.progress() {
                Progress::Pending { .. } => {}
                Progress::Done { value, .. } => return (Ok(value.response), now_ns),
                Progress::Failed { error, .. } => return (Err(error), now_ns),
            }
        }
    }
    match transaction.progress() {
        Progress::Pending { until_ns } => match transaction.poll(until_ns) {
            Progress::Failed { error, .. } => (Err(error), until_ns),
            other => panic!("{other:?}"),
        },
        Progress::Done { value, .. } => (Ok(value.response), now_ns),
        Progress::Failed { error, .. } => (Err(error), now_ns),
    }
}

/// Drives a procedure to its end; the result, the requests sent and when it ended.
fn drive<P, const N: usize, const B: usize>(
    encoders: &mut Encoders<N, B>,
    resolution: Resolution,
    procedure: &mut P,
    now_ns: u64,
) -> (Result<P::Value, Error>, Vec<Request>, u64)
where
    P: Procedure<Request = Request, Response = Response, Error = Error>,
{
    let mut sent = Vec::new();
    let Ok(Ended { outcome, ready_ns }) = servowire_core::run(procedure, now_ns, |request, not_before_ns| {
        sent.push(request);
        assert!(sent.len() < 100);
        let (outcome, ready_ns) = transact(encoders, request, resolution, not_before_ns);
        Ok::<_, Infallible>(Ended { outcome, ready_ns })
    });
    (outcome, sent, ready_ns)
}

/// Every operation to every encoder is answered by it alone, in the layout that the resolution says, and accepted.
#[test]
fn every_operation_to_every_encoder() {
    for resolution in [Resolution::default(), Resolution::default().with_velocity_in_low().with_position_in_resets()] {
        for operation in every(0x21, 1, 0xbeef, 0x10_0003) {
            for to in EncoderAddress::ALL {
                let mut encoders = eight(resolution);
                let request = Request::new(to, operation);
                let (_, answers) = send(&mut encoders, request, 0);
                let want = match operation {
                    Operation::SetAddress1 | Operation::IdRead2 | Operation::IdWrite2 { .. } => 8,
                    Operation::SetAddress2 { .. } => 1,
                    _ if request.command().is_multi_response() => usize::from(to.get()) + 1,
                    _ => 1,
                };
                assert_eq!(answers.len(), want, "{operation:?}");
                let expected = request.expected(resolution);
                for answer in answers {
                    assert!(Response::parse(&expected, &answer.frames).is_ok(), "{operation:?} {to}");
                }
            }
        }
    }
}

#[test]
fn version_2_1_does_not_understand_3_0() {
    let resolution = Resolution::new(20, 16).unwrap();
    for operation in every(0x21, 1, 0xbeef, 5) {
        let (_, answers) = send(&mut eight(resolution), Request::new(ea(0), operation), 0);
        let understood = !operation.needs_version_3();
        // No encoder has the identification code 5.
        let meant = !matches!(operation, Operation::SetAddress2 { .. });
        assert_eq!(!answers.is_empty(), understood && meant, "{operation:?}");
        assert_eq!(resolution.version(), Version::V2_1);
    }
}

#[test]
fn eeprom_written_once_and_read_back() {
    let resolution = Resolution::default();
    let mut encoders = eight(resolution);
    let mut write = Write::eeprom(ea(3), UserAddress::new(0x42).unwrap(), 0x1234);
    let (end, sent, now_ns) = drive(&mut encoders, resolution, &mut write, 0);
    assert!(end.is_ok());
    assert_eq!(sent.iter().filter(|r| r.operation.writes()).count(), 1);
    assert_eq!(encoders.all[3].eeprom(0, 0x42), Some(0x1234));
    assert_eq!(encoders.all[2].eeprom(0, 0x42), Some(0xffff));
    let mut read = EepromRead::new(ea(3), 0x42);
    let (end, sent, now_ns) = drive(&mut encoders, resolution, &mut read, now_ns);
    assert_eq!((end, sent.len()), (Ok(0x1234), 4));
    let mut read = EepromRead::of_bank(ea(3), 2, 0x42);
    let (end, ..) = drive(&mut encoders, resolution, &mut read, now_ns);
    assert_eq!(end, Err(Error::BankError));
}

#[test]
fn resets_take_effect_with_the_eighth_request() {
    let resolution = Resolution::default();
    let mut encoders = eight(resolution);
    encoders.all[5].raise_alarms(Alm::BATT | Alm::OVTEMP);
    encoders.all[5].end_alarms(Alm::BATT);
    let mut reset = Reset::clear_status_and_multiturn(ea(5));
    let (end, sent, now_ns) = drive(&mut encoders, resolution, &mut reset, 0);
    let status = end.unwrap();
    assert_eq!((sent.len(), status.alm()), (9, Some(Alm::OVTEMP)));
    assert_eq!(encoders.all[5].abs(), resolution.compose(5555, 0));
    let mut reset = Reset::set_single_turn_zero_and_shift_commutation_angle(ea(5));
    let (end, ..) = drive(&mut encoders, resolution, &mut reset, now_ns);
    assert!(end.is_ok());
    assert_eq!(encoders.all[5].abs().get(), 0);
}

/// A request for another encoder between the eight starts the count again.
#[test]
fn an_intervening_request_starts_the_count_again() {
    let resolution = Resolution::default();
    let mut encoders = eight(resolution);
    let reset = Request::new(ea(5), Operation::ClearMultiturn);
    let mut now_ns = 0;
    for k in 0..15 {
        let _ = send(&mut encoders, reset, now_ns);
        now_ns += 50_000;
        if k == 6 {
            let _ = send(&mut encoders, Request::new(ea(1), Operation::Abs17), now_ns);
            now_ns += 50_000;
        }
        assert_eq!(encoders.all[5].abs() == resolution.compose(5555, 0), k == 14, "after {}", k + 1);
    }
}

#[test]
fn addresses_are_given_by_wire_and_by_id() {
    let resolution = Resolution::default();
    let mut one = Encoders::<1, 1> { all: [Device::new(ea(0), resolution, RATE)] };
    let mut reset = Reset::set_address_of_the_only_encoder(ea(6));
    let (end, ..) = drive(&mut one, resolution, &mut reset, 0);
    assert_eq!((end.map(|status| status.ea), one.all[0].ea()), (Ok(ea(6)), ea(6)));
    let mut encoders = eight(resolution);
    let mut write = Write::address(EncoderId::truncate(0x10_0002), ea(7));
    let (end, ..) = drive(&mut encoders, resolution, &mut write, 0);
    // Encoder 7 is there already: both answer STATUS, and the first response is taken.
    assert!(end.is_ok());
    assert_eq!(encoders.all[2].ea(), ea(7));
    let (_, answers) = send(&mut encoders, Request::new(ea(7), Operation::Status), 1_000_000_000);
    assert_eq!(answers.len(), 2);
}

#[test]
fn detection_finds_address_and_widths() {
    for (st_bits, mt_bits) in [(17, 0), (20, 16), (22, 16), (24, 0)] {
        let resolution = Resolution::new(st_bits, mt_bits).unwrap();
        let mut one = Encoders::<1, 1> { all: [Device::new(ea(4), resolution, RATE)] };
        let mut detection = Detection::search();
        let (end, sent, _) = drive(&mut one, resolution, &mut detection, 0);
        let Ok(Detected { ea: found, resolution: got, .. }) = end else { panic!("{end:?}") };
        assert_eq!((found, got, sent.len()), (ea(4), Some(resolution), 5));
        one.all[0].set_fault(Fault::Silent);
        let mut detection = Detection::of(ea(4));
        let (end, ..) = drive(&mut one, resolution, &mut detection, 0);
        assert_eq!(end.unwrap_err(), Error::NoResponse);
    }
}

/// Every fault of every encoder on the bus costs its own response and no other.
#[test]
fn one_fault_costs_one_response() {
    let resolution = Resolution::default();
    let mut faults = vec![Fault::Silent, Fault::BadCrc];
    faults.extend((0..72).map(|at| Fault::FlipBit { at }));
    faults.extend((1..72).step_by(5).map(|bits| Fault::CutAfter { bits }));
    let request = Request::new(ea(7), Operation::Abs40Mt);
    for fault in faults {
        for bad in 0..8 {
            let mut encoders = eight(resolution);
            encoders.all[usize::from(bad)].set_fault(fault);
            let mut transaction = BusTransaction::start(request, resolution, Addresses::ALL, LINE, 0);
            let (_, answers) = send(&mut encoders, request, 0);
            let whole = answers.iter().filter(|a| ends_like(a.line, a.frames.line())).count();
            if whole == 8 {
                continue;
            }
            let mut receiver = LineReceiver::bits(Layout::Abs40);
            let bus = hear(&mut receiver, &answers, transaction.bus());
            assert!(matches!(transaction.poll(u64::MAX), Progress::Done { .. }));
            for address in EncoderAddress::ALL {
                assert_eq!(bus.response(address).is_some(), address.get() != bad, "{fault:?} of {bad}, {address}");
            }
        }
    }
}

/// Whether a cut line reads like the whole one because the idle line continues it.
fn ends_like(cut: Window, whole: Window) -> bool {
    cut.bits() | u128::MAX << cut.len() & !(u128::MAX << whole.len()) == whole.bits()
}

/// The bus as a receiver of the sampled line hears it.
fn hear(receiver: &mut LineReceiver, answers: &[Transmission], empty: &Bus) -> Bus {
    let mut bus = *empty;
    for level in render(answers) {
        if let Some(raw) = receiver.push(level) {
            bus.push(raw);
        }
    }
    if let Some(error) = receiver.finish() {
        bus.push(Err(error));
    }
    bus
}

/// Answers as one line, one sample a bit, beginning with the first start bit; idle line after the last.
fn render(answers: &[Transmission]) -> Vec<bool> {
    let Some(first) = answers.first() else { return Vec::new() };
    let mut line = Vec::new();
    for answer in answers {
        let at = ((answer.start_ns - first.start_ns) * 1000 / u64::from(RATE.bit_ps())) as usize;
        line.resize(at.max(line.len()), true);
        line.extend((0..answer.line.len()).map(|k| answer.line.get(k) == Some(true)));
    }
    line.extend([true; 24]);
    line
}

proptest! {
    /// Whatever frames arrive, an encoder answers nothing or a sound response, and later understands a good request.
    #[test]
    fn noise_does_not_lock_it_up(contents in prop::collection::vec((any::<u16>(), 0..100_000_u64, any::<bool>()), 0..40)) {
        let mut encoders = eight(Resolution::default());
        let mut now_ns = 0;
        for (content, pause, framed) in contents {
            now_ns += pause;
            if framed {
                for answer in encoders.hear(&[Some(content)], now_ns).into_iter().flatten() {
                    prop_assert_eq!(answer.frames.crc().got, answer.frames.crc().want);
                }
            } else {
                encoders.framing_error(now_ns);
            }
        }
        now_ns += 1_000_000_000;
        let (outcome, _) = transact(&mut encoders, Request::new(ea(1), Operation::Abs40), Resolution::default(), now_ns);
        prop_assert!(outcome.is_ok());
    }
}
