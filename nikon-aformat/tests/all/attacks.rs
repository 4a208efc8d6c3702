//! Attacks on the procedures, each with responses and times of its own: no simulated encoder, no simulated line.

use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{
    BusTransaction, Detection, EepromRead, Exchange, GuardedReset, Line, Polling, Progress, Reset, Step, Transaction,
    VerifiedWrite, Write,
};
use nikon_aformat::{
    Alm, BitRate, Command, Data, Doubt, EncoderAddress, EncoderId, EncoderStatus, Error, Operation, PmAlm, Policy,
    Request, Resolution, Response, Sample, Tolerated, U17, U19, U40, UserAddress,
};

const LOST: Result<Response, Error> = Err(Error::NoResponse);
const THREE: EncoderAddress = EncoderAddress::truncate(3);
const FIVE: EncoderAddress = EncoderAddress::truncate(5);

fn response(ea: EncoderAddress, command: Command, data: Data) -> Result<Response, Error> {
    Ok(Response::new(ea, command, EncoderStatus::empty(), data))
}

fn status(ea: EncoderAddress, command: Command, alm: Alm) -> Result<Response, Error> {
    response(ea, command, Data::Status { alm, pm_alm: PmAlm::empty() })
}

fn word(address: u8, data: u16, busy: bool) -> Result<Response, Error> {
    let es = if busy { EncoderStatus::BUSY } else { EncoderStatus::empty() };
    Ok(Response::new(THREE, Command::EepromRead, es, Data::Eeprom { data, address }))
}

/// The only encoder is the one that has answered with its identification code; any other response does not say who it is.
#[test]
fn only_an_identification_code_tells_who_the_only_encoder_is() {
    let mut write = VerifiedWrite::new(Write::id_of_the_only_encoder(EncoderId::truncate(0x12_3456)));
    let asked = |step| match step {
        Step::Send { request, .. } => Some((request.ea, request.operation)),
        _ => None,
    };
    let first = asked(write.start(0));
    assert!(matches!(first, Some((_, Operation::IdRead2))));
    assert_eq!(asked(write.receive(status(FIVE, Command::Status, Alm::empty()), 0)), first);
    let named = response(FIVE, Command::IdRead2, Data::Id { id: EncoderId::truncate(1) });
    assert_eq!(asked(write.receive(named, 0)), Some((FIVE, Operation::Status)));
}

/// A host that mixes up the outcomes of its requests: another encoder's response to the same command, or one that repeats
/// other arguments, says nothing of this write.
#[test]
fn a_write_takes_nobody_elses_response() {
    let (id, other_id) = (EncoderId::truncate(0x12_3456), EncoderId::truncate(0x12_3457));
    let (nineteen, other_nineteen) = (U19::truncate(7), U19::truncate(8));
    let word = |address, data| Data::Eeprom { data, address };
    let bank = |bank, address, data| Data::EepromBank { data, bank, address, bank_error: false };
    let cases = [
        (
            Write::eeprom(THREE, UserAddress::new(0x10).unwrap(), 0xbeef),
            (Command::EepromWrite, word(0x10, 0xbeef)),
            vec![(THREE, word(0x11, 0xbeef)), (THREE, word(0x10, 0xbeee)), (FIVE, word(0x10, 0xbeef))],
        ),
        (
            Write::eeprom_of_bank(THREE, 1, 0x10, 0xbeef),
            (Command::EepromWrite, bank(1, 0x10, 0xbeef)),
            vec![(THREE, bank(2, 0x10, 0xbeef)), (THREE, word(0x10, 0xbeef)), (FIVE, bank(1, 0x10, 0xbeef))],
        ),
        (
            Write::id(THREE, id),
            (Command::IdWrite1, Data::Id { id }),
            vec![(THREE, Data::Id { id: other_id }), (FIVE, Data::Id { id })],
        ),
        (
            Write::id_of_the_only_encoder(id),
            (Command::IdWrite2, Data::Id { id }),
            vec![(THREE, Data::Id { id: other_id })],
        ),
        (
            Write::address(id, THREE),
            (Command::SetAddress2, Data::Id { id }),
            vec![(THREE, Data::Id { id: other_id }), (FIVE, Data::Id { id: other_id })],
        ),
        (
            Write::coefficient(THREE, nineteen),
            (Command::IdWrite1, Data::Coefficient { coefficient: nineteen }),
            vec![
                (THREE, Data::Coefficient { coefficient: other_nineteen }),
                (FIVE, Data::Coefficient { coefficient: nineteen }),
                (THREE, Data::Id { id: EncoderId::truncate(7) }),
            ],
        ),
    ];
    for (write, (command, own), others) in cases {
        let mut good = write;
        let _ = good.start(0);
        let ask = Step::Send { request: Request::new(THREE, Operation::Status), not_before_ns: 30_000_000 };
        assert_eq!(good.receive(response(THREE, command, own), 0), ask, "{}", write.request());
        for (ea, other) in others {
            let mut write = write;
            let _ = write.start(0);
            let end = write.receive(response(ea, command, other), 0);
            let unknown = Step::Failed { error: Error::EffectUnknown, ready_ns: 30_000_000 };
            assert_eq!(end, unknown, "{} answered with {other} of {ea}", write.request());
        }
    }
}

/// The encoder says that it has no such bank: nothing was written, and that is known.
#[test]
fn a_wrong_bank_is_known_not_to_be_written() {
    let mut write = Write::eeprom_of_bank(THREE, 9, 0x10, 1);
    let _ = write.start(0);
    assert!(matches!(write.receive(Err(Error::BankError), 0), Step::Failed { error: Error::BankError, .. }));
    // Verified: the read says so too.
    let mut write = VerifiedWrite::new(Write::eeprom_of_bank(THREE, 9, 0x10, 1));
    let _ = write.start(0);
    let _ = write.receive(status(THREE, Command::Status, Alm::empty()), 0);
    assert!(matches!(write.receive(Err(Error::BankError), 0), Step::Send { .. }));
    assert!(matches!(write.receive(Err(Error::BankError), 0), Step::Failed { error: Error::BankError, .. }));
}

/// An address and a zero are kept in the EEPROM: where the status after the eight requests shows MEMERR, they may be lost with
/// the supply.
#[test]
fn what_could_not_be_stored_is_not_done() {
    let zero = Reset::set_single_turn_zero_and_shift_commutation_angle(THREE);
    for mut reset in [zero, Reset::set_address_of_the_only_encoder(THREE)] {
        let _ = reset.start(0);
        for _ in 0..8 {
            let _ = reset.receive(status(THREE, reset.command(), Alm::empty()), 0);
        }
        let end = reset.receive(status(THREE, Command::Status, Alm::MEMERR), 7);
        assert_eq!(end, Step::Failed { error: Error::EffectUnknown, ready_ns: 7 });
    }
    // An old fault would hide a new one: with it the eight requests are not begun.
    let mut guarded = GuardedReset::new(zero);
    let _ = guarded.start(0);
    let end = guarded.receive(status(THREE, Command::Status, Alm::MEMERR), 7);
    assert!(matches!(end, Step::Failed { error: Error::MemoryFault, .. }), "{end:?}");
    // Turns and alarms are not in the EEPROM, and command 8 is what clears MEMERR.
    let mut clear = GuardedReset::new(Reset::clear_status(THREE));
    let _ = clear.start(0);
    assert!(matches!(clear.receive(status(THREE, Command::Status, Alm::MEMERR), 7), Step::Send { .. }));
    for _ in 0..8 {
        let _ = clear.receive(status(THREE, Command::ClearStatus, Alm::MEMERR), 0);
    }
    assert!(matches!(clear.receive(status(THREE, Command::Status, Alm::MEMERR), 7), Step::Done { .. }));
}

/// The word of another address keeps the memory busy for up to 300 us, and a busy memory does not begin with a read: however
/// often is asked, the first request for the word itself waits that long.
#[test]
fn a_word_is_asked_for_when_the_other_one_is_over() {
    let mut read = EepromRead::new(THREE, 9).with_polling(Polling { interval_ns: 20_000, max_tries: 40 });
    let _ = read.start(0);
    let own = Request::new(THREE, Operation::EepromRead { address: 9 });
    assert_eq!(read.receive(word(8, 1, false), 1_000), Step::Send { request: own, not_before_ns: 301_000 });
    // From then on as often as one likes.
    assert_eq!(read.receive(word(9, 1, true), 301_000), Step::Send { request: own, not_before_ns: 321_000 });
}

/// Starting again in the middle breaks a read off: what the next response shows is not known any more.
#[test]
fn a_read_that_is_started_again_was_broken_off() {
    let mut read = EepromRead::new(THREE, 9).knowing_that_none_was_broken_off();
    let (own, other) = (Operation::EepromRead { address: 9 }, Operation::EepromRead { address: 8 });
    let _ = read.start(0);
    assert!(matches!(read.receive(word(9, 0xdead, false), 0), Step::Send { request, .. } if request.operation == own));
    assert!(matches!(read.start(0), Step::Send { request, .. } if request.operation == other));
}

/// A host that hands in one outcome too many, after the end, gets the end again and nothing to send.
#[test]
fn what_has_ended_sends_nothing_more() {
    fn ended<T: PartialEq + Copy + core::fmt::Debug>(
        end: Step<T>,
        mut receive: impl FnMut(Result<Response, Error>, u64) -> Step<T>,
    ) {
        assert!(!matches!(end, Step::Send { .. }));
        let id = Data::Id { id: EncoderId::truncate(1) };
        for outcome in [
            status(THREE, Command::ZeroPreset, Alm::empty()),
            status(THREE, Command::Status, Alm::empty()),
            response(THREE, Command::IdWrite1, id),
            word(8, 1, false),
            response(THREE, Command::Abs40Mt, Data::Abs40 { abs: U40::truncate(5) }),
            LOST,
        ] {
            assert_eq!(receive(outcome, 1), end);
        }
    }
    let mut reset = Reset::set_single_turn_zero_and_shift_commutation_angle(THREE);
    for lost in 0..8 {
        let _ = reset.start(0);
        for _ in 0..lost {
            let _ = reset.receive(status(THREE, Command::ZeroPreset, Alm::empty()), 0);
        }
        let end = reset.receive(LOST, 0);
        ended(end, |outcome, now_ns| reset.receive(outcome, now_ns));
    }
    let mut guarded = GuardedReset::new(reset);
    let _ = guarded.start(0);
    let mut end = guarded.receive(LOST, 0);
    while let Step::Send { .. } = end {
        end = guarded.receive(LOST, 0);
    }
    ended(end, |outcome, now_ns| guarded.receive(outcome, now_ns));

    let mut write = Write::id(THREE, EncoderId::truncate(1));
    let _ = write.start(0);
    let end = write.receive(LOST, 0);
    ended(end, |outcome, now_ns| write.receive(outcome, now_ns));
    let mut verified = VerifiedWrite::new(write);
    let _ = verified.start(0);
    let mut end = verified.receive(LOST, 0);
    while let Step::Send { .. } = end {
        end = verified.receive(LOST, 0);
    }
    ended(end, |outcome, now_ns| verified.receive(outcome, now_ns));

    let mut read = EepromRead::new(THREE, 9);
    let _ = read.start(0);
    let mut end = read.receive(LOST, 0);
    while let Step::Send { .. } = end {
        end = read.receive(LOST, 0);
    }
    ended(end, |outcome, now_ns| read.receive(outcome, now_ns));
    let mut detection = Detection::search();
    let _ = detection.start(0);
    let end = detection.receive(LOST, 0);
    ended(end, |outcome, now_ns| detection.receive(outcome, now_ns));
}

/// An encoder is busy for up to 30 ms; a guarded reset waits for that.
#[test]
fn a_guarded_reset_waits_for_a_busy_encoder() {
    let mut guarded = GuardedReset::new(Reset::clear_multiturn(THREE));
    let mut step = guarded.start(0);
    let busy = Response::new(
        THREE,
        Command::Status,
        EncoderStatus::BUSY,
        Data::Status { alm: Alm::MEMBUSY, pm_alm: PmAlm::empty() },
    );
    while let Step::Send { not_before_ns, .. } = step {
        step = guarded.receive(Ok(busy), not_before_ns);
        if let Step::Failed { ready_ns, .. } = step {
            assert!(ready_ns >= 30_000_000, "given up after {ready_ns} ns");
        }
    }
}

/// A clock that was set back, or that wrapped, makes no position young.
#[test]
fn a_position_from_the_future_is_as_old_as_it_is_far_away() {
    let response = Response::abs17(THREE, EncoderStatus::empty(), U17::truncate(77));
    let exchange = Exchange { response, sampled_ns: 5_000_000_000, began_ns: 5_000_003_000 };
    let resolution = Resolution::new(17, 16).unwrap();
    let policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
    let at = |now_ns| exchange.evidence(resolution).at(now_ns, policy).map(Sample::single_turn);
    assert_eq!((at(5_000_125_000), at(4_999_875_000)), (Ok(77), Ok(77)));
    assert_eq!(at(17), Err(Doubt::Old { age_ns: 4_999_999_983 }));
}

/// A FIFO that is emptied at once: all frames carry the time of the last. At 8 Mbit/s a request of one frame is out after
/// 2.25 us, and the two frames of ABS17 last 4.5 us, so what has ended at 6.7 us began before.
#[test]
fn frames_with_one_stamp_are_as_old_as_the_last_of_them() {
    let response = Response::abs17(EncoderAddress::ZERO, EncoderStatus::empty(), U17::truncate(77));
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs17);
    let (line, resolution) = (Line::new(BitRate::Mbit8), Resolution::default());
    let heard = |end_ns| {
        let mut single = Transaction::start(request, resolution, line, 0);
        let asked = Addresses::first(1);
        let mut bus = BusTransaction::start(request, resolution, asked, line, 0);
        for content in response.emit().contents() {
            let _ = single.hear(&[Some(*content)], end_ns);
            let _ = bus.hear(&[Some(*content)], end_ns);
        }
        let alone = matches!(single.progress(), Progress::Done { .. });
        assert_eq!(alone, bus.exchange(EncoderAddress::ZERO).is_some());
        alone
    };
    assert!(!heard(6_100) && !heard(6_749) && heard(20_000));
}
