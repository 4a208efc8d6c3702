//! Procedures step by step: what they send, when, and how they end.

use nikon_aformat::master::{Detected, Detection, EepromRead, GuardedReset, Reset, Step, VerifiedWrite, Write};
use nikon_aformat::{
    Alm, Command, Data, EncoderAddress, EncoderId, EncoderStatus, Error, Operation, PmAlm, Request, Response, TypeWord,
    U19, U40, UserAddress,
};

const EA: EncoderAddress = EncoderAddress::truncate(5);
const LOST: Result<Response, Error> = Err(Error::NoResponse);
const MS: u64 = 1_000_000;

fn ea(address: u8) -> EncoderAddress {
    EncoderAddress::truncate(address)
}

fn send<T>(ea: EncoderAddress, operation: Operation, not_before_ns: u64) -> Step<T> {
    Step::Send { request: Request::new(ea, operation), not_before_ns }
}

/// ES0 is the lowest bit of `es`.
fn said(ea: EncoderAddress, command: Command, es: u8, data: Data) -> Result<Response, Error> {
    Ok(Response::new(ea, command, EncoderStatus::from_bits_truncate(es), data))
}

fn status(ea: EncoderAddress, es: u8, alm: Alm) -> Result<Response, Error> {
    said(ea, Command::Status, es, Data::Status { alm, pm_alm: PmAlm::empty() })
}

fn idle() -> Result<Response, Error> {
    status(EA, 0, Alm::empty())
}

fn reset(command: Command) -> Result<Response, Error> {
    said(EA, command, 0, Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() })
}

fn id(ea: EncoderAddress, command: Command, es: u8, id: u32) -> Result<Response, Error> {
    said(ea, command, es, Data::Id { id: EncoderId::truncate(id) })
}

fn word(command: Command, es: u8, address: u8, data: u16) -> Result<Response, Error> {
    said(EA, command, es, Data::Eeprom { data, address })
}

/// STATUS until it is answered by this encoder and ES0 is clear, a millisecond apart, forty times at the most: an access
/// lasts 30 ms. Then the reset.
#[test]
fn a_reset_begins_when_the_encoder_is_idle() {
    let mut guarded = GuardedReset::new(Reset::clear_status(EA));
    let ask = |not_before_ns| send(EA, Operation::Status, not_before_ns);
    for (refused, error) in [
        (LOST, Error::NoResponse),
        (status(EA, 1, Alm::empty()), Error::Busy { tries: 40 }),
        (status(ea(4), 0, Alm::empty()), Error::NotCarried),
        (reset(Command::ClearStatus), Error::NotCarried),
    ] {
        assert_eq!(guarded.start(7), ask(7));
        for k in 1..40 {
            assert_eq!(guarded.receive(refused, 100 * k), ask(100 * k + MS));
        }
        assert_eq!(guarded.receive(refused, 5), Step::Failed { error, ready_ns: 5 + MS });
    }
    // The alarms that are to be cleared are no obstacle.
    assert_eq!(guarded.start(7), ask(7));
    assert_eq!(guarded.receive(status(EA, 0b1110, Alm::BATT), 50), send(EA, Operation::ClearStatus, 10_050));
    for _ in 0..7 {
        assert_eq!(guarded.receive(reset(Command::ClearStatus), 100), send(EA, Operation::ClearStatus, 10_100));
    }
    assert_eq!(guarded.receive(reset(Command::ClearStatus), 100), ask(30 * MS + 100));
    assert_eq!(guarded.receive(idle(), 9), Step::Done { value: idle().unwrap(), ready_ns: 9 });
    // It begins with STATUS again.
    assert_eq!(guarded.start(8), ask(8));
}

/// The address of the only encoder is not known: whatever it is, command 17 is answered.
#[test]
fn setting_an_address_begins_with_the_identification_code() {
    let mut guarded = GuardedReset::new(Reset::set_address_of_the_only_encoder(EA));
    assert_eq!(guarded.start(7), send(EA, Operation::IdRead2, 7));
    assert_eq!(guarded.receive(idle(), 0), send(EA, Operation::IdRead2, MS));
    assert_eq!(guarded.receive(id(ea(2), Command::IdRead2, 0, 1), 50), send(EA, Operation::SetAddress1, 10_050));
}

/// Reads of an EEPROM word: another address, twice the own one, every 300 us.
fn read_back(write: &mut VerifiedWrite, from_ns: u64, data: u16) -> Step<()> {
    let read = |address, not_before_ns| send(EA, Operation::EepromRead { address }, not_before_ns);
    let answer = |address, data| word(Command::EepromRead, 0, address, data);
    assert_eq!(write.receive(answer(0x43, 1), from_ns), read(0x42, from_ns + 300_000));
    assert_eq!(write.receive(answer(0x42, 2), from_ns), read(0x42, from_ns + 300_000));
    write.receive(answer(0x42, data), from_ns)
}

fn eeprom_write() -> VerifiedWrite {
    VerifiedWrite::new(Write::eeprom(EA, UserAddress::new(0x42).unwrap(), 0x1234))
}

const WRITE: Operation = match UserAddress::new(0x42) {
    Some(address) => Operation::EepromWrite { address, data: 0x1234 },
    None => panic!("a user address"),
};

#[test]
fn a_word_is_written_once_and_read_back() {
    // The CRC-8 of a value may be right by chance: one that differs counts once it has been read twice in a row, and so does the one
    // that was written, unless the encoder has answered the write.
    let again = send(EA, Operation::EepromRead { address: 0x43 }, 99 + MS);
    let ends = [Step::Done { value: (), ready_ns: 99 }, Step::Failed { error: Error::NotDone, ready_ns: 99 }];
    for (answered, unanswered, end) in [
        (&[0x1234_u16] as &[_], &[0x1234_u16, 0x1234] as &[_], ends[0]),
        (&[0x1235, 0x1234], &[0x1235, 0x1234, 0x1235, 0x1234, 0x1234], ends[0]),
        (&[0x1235, 0x1235], &[0x1235, 0x1235], ends[1]),
        (&[0x1235, 0x1236, 0x1235, 0x1235], &[0x1234, 0x1235, 0x1235], ends[1]),
    ] {
        for (lost, values) in [(false, answered), (true, unanswered)] {
            let mut write = eeprom_write();
            assert_eq!(write.start(7), send(EA, Operation::Status, 7));
            assert_eq!(write.receive(idle(), 50), send(EA, WRITE, 10_050));
            let other = send(EA, Operation::EepromRead { address: 0x43 }, if lost { 60 + 30 * MS } else { 70 });
            if lost {
                assert_eq!(write.receive(LOST, 60), other);
            } else {
                let echo = word(Command::EepromWrite, 1, 0x42, 0x1234);
                assert_eq!(write.receive(echo, 60), send(EA, Operation::Status, 60 + 30 * MS));
                assert_eq!(write.receive(idle(), 70), other);
            }
            for (k, data) in values.iter().enumerate() {
                let last = k + 1 == values.len();
                assert_eq!(read_back(&mut write, 99, *data), if last { end } else { again }, "{values:x?} {k}");
            }
        }
    }
}

/// Nothing is written while the encoder is busy, or while an old MEMERR would hide a new one.
#[test]
fn a_write_begins_when_the_encoder_is_idle() {
    let ask = |not_before_ns| send(EA, Operation::Status, not_before_ns);
    for (refused, error) in [
        (LOST, Error::NoResponse),
        (status(EA, 1, Alm::empty()), Error::Busy { tries: 40 }),
        (status(EA, 0, Alm::MEMBUSY), Error::Busy { tries: 40 }),
        (status(EA, 1, Alm::MEMERR), Error::Busy { tries: 40 }),
        (status(ea(4), 0, Alm::empty()), Error::NotCarried),
        (id(EA, Command::IdRead1, 0, 1), Error::NotCarried),
    ] {
        let mut write = eeprom_write();
        assert_eq!(write.start(7), ask(7));
        for k in 1..40 {
            assert_eq!(write.receive(refused, 100 * k), ask(100 * k + MS));
        }
        assert_eq!(write.receive(refused, 5), Step::Failed { error, ready_ns: 5 + MS });
        // A new start has all its tries.
        assert_eq!(write.start(8), ask(8));
        assert_eq!(write.receive(refused, 5), ask(5 + MS));
        assert_eq!(write.receive(status(EA, 0b0100, Alm::empty()), 50), send(EA, WRITE, 10_050));
    }
    let mut write = eeprom_write();
    let _ = write.start(0);
    let end = write.receive(status(EA, 0b0100, Alm::MEMERR), 50);
    assert_eq!(end, Step::Failed { error: Error::MemoryFault, ready_ns: 10_050 });
}

/// MEMERR after the write, and a cell that cannot be read.
#[test]
fn how_a_write_fails() {
    let mut write = eeprom_write();
    let _ = write.start(0);
    let _ = write.receive(idle(), 0);
    let _ = write.receive(word(Command::EepromWrite, 0, 0x42, 0x1234), 0);
    // Once is no evidence, nor once more after it was clear.
    let ask = |ready_ns| send(EA, Operation::Status, ready_ns + MS);
    assert_eq!(write.receive(status(EA, 4, Alm::MEMERR), 7), ask(7));
    assert_eq!(write.receive(status(EA, 1, Alm::empty()), 7), ask(7));
    assert_eq!(write.receive(status(EA, 4, Alm::MEMERR), 8), ask(8));
    assert_eq!(write.receive(LOST, 8), ask(8));
    let end = write.receive(status(EA, 4, Alm::MEMERR), 9);
    assert_eq!(end, Step::Failed { error: Error::MemoryFault, ready_ns: 9 });
    // A new start knows nothing of it.
    let _ = write.start(0);
    let _ = write.receive(idle(), 0);
    let _ = write.receive(word(Command::EepromWrite, 0, 0x42, 0x1234), 0);
    assert_eq!(write.receive(status(EA, 4, Alm::MEMERR), 7), ask(7));
    let other = send(EA, Operation::EepromRead { address: 0x43 }, 9);
    assert_eq!(write.receive(idle(), 9), other);

    let _ = write.start(0);
    let _ = write.receive(idle(), 0);
    let _ = write.receive(LOST, 0);
    for _ in 1..10 {
        assert!(matches!(write.receive(LOST, 0), Step::Send { .. }));
    }
    assert_eq!(write.receive(LOST, 0), Step::Failed { error: Error::EffectUnknown, ready_ns: 300_000 });
}

#[test]
fn an_identification_code_is_read_back() {
    let new = EncoderId::truncate(0x12_3456);
    let ask = |not_before_ns| send(EA, Operation::IdRead1, not_before_ns);
    let mut write = VerifiedWrite::new(Write::id(EA, new));
    let begin = |write: &mut VerifiedWrite| {
        assert_eq!(write.start(7), send(EA, Operation::Status, 7));
        assert_eq!(write.receive(idle(), 0), send(EA, Operation::IdWrite1 { id: new }, 10_000));
        assert_eq!(write.receive(LOST, 0), ask(30 * MS));
    };
    begin(&mut write);
    assert_eq!(write.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), ask(9 + MS));
    assert_eq!(write.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), Step::Done { value: (), ready_ns: 9 });
    begin(&mut write);
    let mut told = |held| write.receive(id(EA, Command::IdRead1, 0, held), 9);
    assert_eq!([told(0x12_3457), told(0x12_3458), told(0x12_3457)], [ask(9 + MS); 3]);
    assert_eq!(told(0x12_3457), Step::Failed { error: Error::NotDone, ready_ns: 9 });
    // What was read back after another write says nothing of this one, nor how that one was answered.
    begin(&mut write);
    assert_eq!(write.receive(id(EA, Command::IdRead1, 0, 0x12_3457), 9), ask(9 + MS));
    let _ = write.start(7);
    let _ = write.receive(idle(), 0);
    let answered = id(EA, Command::IdWrite1, 0, 0x12_3456);
    assert_eq!(write.receive(answered, 0), send(EA, Operation::Status, 30 * MS));
    assert_eq!(write.receive(idle(), 5), ask(5));
    assert_eq!(write.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), Step::Done { value: (), ready_ns: 9 });
    begin(&mut write);
    assert_eq!(write.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), ask(9 + MS));
    // What is no answer is asked again, forty times at the most.
    for nothing in [
        LOST,
        id(EA, Command::IdRead1, 1, 0x12_3456),
        id(ea(4), Command::IdRead1, 0, 0x12_3456),
        id(EA, Command::IdRead2, 0, 0x12_3456),
        idle(),
    ] {
        begin(&mut write);
        for k in 1..40 {
            assert_eq!(write.receive(nothing, 100 * k), ask(100 * k + MS));
        }
        assert_eq!(write.receive(nothing, 5), Step::Failed { error: Error::EffectUnknown, ready_ns: 5 + MS });
    }
}

/// Of the only encoder, of one that is known by its identification code, and a coefficient.
#[test]
fn other_writes_and_how_they_are_read_back() {
    let new = EncoderId::truncate(0x12_3456);
    let zero = EncoderAddress::ZERO;
    // It is asked for its address and its status before; every address may answer.
    let mut only = VerifiedWrite::new(Write::id_of_the_only_encoder(new));
    assert_eq!(only.start(7), send(zero, Operation::IdRead2, 7));
    assert_eq!(only.receive(LOST, 0), send(zero, Operation::IdRead2, MS));
    assert_eq!(only.receive(id(EA, Command::IdRead2, 0, 1), 0), send(EA, Operation::Status, 10_000));
    assert_eq!(only.receive(idle(), 0), send(zero, Operation::IdWrite2 { id: new }, 10_000));
    assert_eq!(only.receive(LOST, 0), send(zero, Operation::IdRead2, 30 * MS));
    assert_eq!(only.receive(id(EA, Command::IdRead2, 0, 0x12_3456), 9), send(zero, Operation::IdRead2, 9 + MS));
    assert_eq!(only.receive(id(EA, Command::IdRead2, 0, 0x12_3456), 9), Step::Done { value: (), ready_ns: 9 });

    // At the new address there is an encoder with this code.
    let mut address = VerifiedWrite::new(Write::address(new, EA));
    assert_eq!(address.start(7), send(EA, Operation::SetAddress2 { id: new }, 7));
    assert_eq!(address.receive(LOST, 0), send(EA, Operation::IdRead1, 30 * MS));
    assert_eq!(address.receive(id(ea(2), Command::IdRead1, 0, 0x12_3456), 0), send(EA, Operation::IdRead1, MS));
    assert_eq!(address.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), send(EA, Operation::IdRead1, 9 + MS));
    assert_eq!(address.receive(id(EA, Command::IdRead1, 0, 0x12_3456), 9), Step::Done { value: (), ready_ns: 9 });

    let coefficient = U19::truncate(0x4_0001);
    let carried = |coefficient| said(EA, Command::IdRead1, 0, Data::Coefficient { coefficient });
    for (held, done) in [(coefficient, true), (U19::truncate(1), false)] {
        let mut write = VerifiedWrite::new(Write::coefficient(EA, coefficient));
        assert_eq!(write.start(7), send(EA, Operation::Status, 7));
        assert_eq!(write.receive(idle(), 0), send(EA, Operation::CoefficientWrite { coefficient }, 10_000));
        assert_eq!(write.receive(LOST, 0), send(EA, Operation::CoefficientRead, 30 * MS));
        assert_eq!(write.receive(carried(held), 9), send(EA, Operation::CoefficientRead, 9 + MS));
        let end = write.receive(carried(held), 9);
        let want = if done {
            Step::Done { value: (), ready_ns: 9 }
        } else {
            Step::Failed { error: Error::NotDone, ready_ns: 9 }
        };
        assert_eq!(end, want);
    }

    let bank = Operation::EepromWriteBank { bank: 3, address: 0x10, data: 5 };
    let mut word = VerifiedWrite::new(Write::eeprom_of_bank(EA, 3, 0x10, 5));
    let _ = word.start(0);
    assert_eq!(word.receive(idle(), 0), send(EA, bank, 10_000));
    assert_eq!(word.receive(LOST, 0), send(EA, Operation::EepromReadBank { bank: 3, address: 0x11 }, 30 * MS));
}

/// That there is no such bank is believed if the write and the read say so; one of them may be right by chance.
#[test]
fn a_wrong_bank_is_believed_if_the_read_says_so_too() {
    let read = |address, not_before_ns| send(EA, Operation::EepromReadBank { bank: 3, address }, not_before_ns);
    let no_bank = Err(Error::BankError);
    let begin = |write: &mut VerifiedWrite, outcome| {
        let _ = write.start(0);
        let _ = write.receive(idle(), 0);
        assert_eq!(write.receive(outcome, 5), read(0x11, 5 + 30 * MS));
    };
    let mut write = VerifiedWrite::new(Write::eeprom_of_bank(EA, 3, 0x10, 5));
    for (of_write, of_read, error) in [(no_bank, no_bank, Error::BankError), (LOST, no_bank, Error::EffectUnknown)] {
        begin(&mut write, of_write);
        assert_eq!(write.receive(of_read, 9), Step::Failed { error, ready_ns: 9 + 300_000 });
    }
    // The write said so, and yet the word is there: twice.
    begin(&mut write, no_bank);
    let of = |address, data| {
        said(EA, Command::EepromRead, 0, Data::EepromBank { data, bank: 3, address, bank_error: false })
    };
    let mut back = || {
        let _ = write.receive(of(0x11, 1), 0);
        let _ = write.receive(of(0x10, 2), 0);
        write.receive(of(0x10, 5), 9)
    };
    assert_eq!([back(), back()], [read(0x11, 9 + MS), Step::Done { value: (), ready_ns: 9 }]);
}

/// MEMERR that was set long ago: command 19 does not begin, command 20 cannot know, and neither says that it failed.
#[test]
fn an_old_memory_fault_says_nothing_of_a_write() {
    let (new, zero) = (EncoderId::truncate(0x12_3456), EncoderAddress::ZERO);
    let fault = || said(EA, Command::Status, 0, Data::Status { alm: Alm::MEMERR, pm_alm: PmAlm::empty() });
    let mut only = VerifiedWrite::new(Write::id_of_the_only_encoder(new));
    let _ = only.start(0);
    let _ = only.receive(id(EA, Command::IdRead2, 0, 1), 0);
    assert_eq!(only.receive(fault(), 0), Step::Failed { error: Error::MemoryFault, ready_ns: 10_000 });

    for (held, error) in [(0x12_3456, Error::EffectUnknown), (1, Error::NotDone)] {
        let mut address = VerifiedWrite::new(Write::address(new, EA));
        assert_eq!(address.start(7), send(EA, Operation::SetAddress2 { id: new }, 7));
        let answered = id(zero, Command::SetAddress2, 0, 0x12_3456);
        assert_eq!(address.receive(answered, 0), send(EA, Operation::Status, 30 * MS));
        assert_eq!(address.receive(fault(), 0), send(EA, Operation::Status, MS));
        assert_eq!(address.receive(fault(), 0), send(EA, Operation::IdRead1, 0));
        let mut end = address.receive(id(EA, Command::IdRead1, 0, held), 9);
        if error == Error::NotDone {
            assert_eq!(end, send(EA, Operation::IdRead1, 9 + MS));
            end = address.receive(id(EA, Command::IdRead1, 0, held), 9);
        }
        assert_eq!(end, Step::Failed { error, ready_ns: 9 });
    }
}

/// The count was begun anew by another command, so fewer than eight requests have no effect; a plain reset cannot say that.
#[test]
fn not_done_only_after_the_count_was_begun_anew() {
    let answer = || said(EA, Command::ZeroPreset, 0, Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() });
    for done in 0..8 {
        let plain = || Reset::set_single_turn_zero_and_shift_commutation_angle(EA);
        let (mut guarded, mut bare) = (GuardedReset::new(plain()), plain());
        let _ = (guarded.start(0), bare.start(0), guarded.receive(idle(), 0));
        for _ in 0..done {
            let _ = (guarded.receive(answer(), 0), bare.receive(answer(), 0));
        }
        let (sure, open) = (guarded.receive(LOST, 0), bare.receive(LOST, 0));
        let error = if done == 7 { Error::EffectUnknown } else { Error::Interrupted { done } };
        assert_eq!(open, Step::Failed { error, ready_ns: 30 * MS });
        let (error, ready_ns) = if done == 7 { (Error::EffectUnknown, 30 * MS) } else { (Error::NotDone, 10_000) };
        assert_eq!(sure, Step::Failed { error, ready_ns });
    }
}

/// A word of a bank: another address, twice the own one; what comes from another bank or address is begun anew.
#[test]
fn a_word_of_a_bank() {
    let ask = |address, not_before_ns| send(EA, Operation::EepromReadBank { bank: 3, address }, not_before_ns);
    let of = |bank, address, data| {
        said(EA, Command::EepromRead, 0, Data::EepromBank { data, bank, address, bank_error: false })
    };
    for wrong in [of(2, 0x10, 7), of(3, 0x12, 7), word(Command::EepromRead, 0, 0x10, 7), LOST] {
        let mut read = EepromRead::of_bank(EA, 3, 0x10);
        assert_eq!(read.start(7), ask(0x11, 7));
        assert_eq!(read.receive(of(3, 0x11, 1), 0), ask(0x10, 300_000));
        assert_eq!(read.receive(wrong, 0), ask(0x11, 300_000));
        assert_eq!(read.receive(of(3, 0x11, 1), 0), ask(0x10, 300_000));
        assert_eq!(read.receive(of(3, 0x10, 2), 0), ask(0x10, 300_000));
        assert_eq!(read.receive(of(3, 0x10, 0x1234), 9), Step::Done { value: 0x1234, ready_ns: 9 });
    }
}

/// Command 4 to the highest address, then the type word, with another word before it.
#[test]
fn detection_asks_for_a_position_and_the_type_word() {
    let position = said(EA, Command::Abs40Mt, 0, Data::Abs40 { abs: U40::truncate(5) });
    let mut search = Detection::search();
    assert_eq!(search.start(7), send(EncoderAddress::MAX, Operation::Abs40Mt, 7));
    assert_eq!(search.receive(LOST, 50), Step::Failed { error: Error::NoResponse, ready_ns: 10_050 });
    let _ = search.start(7);
    // What answers another request tells nothing of who answers this one.
    let other = said(EA, Command::Abs40, 0, Data::Abs40 { abs: U40::truncate(5) });
    assert_eq!(search.receive(other, 50), Step::Failed { error: Error::NotCarried, ready_ns: 10_050 });
    let _ = search.start(7);
    let read = |address, not_before_ns| send(EA, Operation::EepromRead { address }, not_before_ns);
    assert_eq!(search.receive(position, 50), read(0xf7, 10_050));
    assert_eq!(search.receive(word(Command::EepromRead, 0, 0xf7, 1), 60), read(0xf6, 300_060));
    assert_eq!(search.receive(word(Command::EepromRead, 0, 0xf6, 1), 60), read(0xf6, 300_060));
    // 20 bits, optical turns.
    let end = search.receive(word(Command::EepromRead, 0, 0xf6, 0b10_001), 70);
    let Step::Done { value: Detected { ea, type_word, resolution }, ready_ns: 70 } = end else { panic!("{end:?}") };
    assert_eq!((ea, type_word), (EA, TypeWord(0b10_001)));
    assert_eq!(resolution.map(|resolution| (resolution.st_bits(), resolution.mt_bits())), Some((20, 16)));
    // It begins with the position again.
    assert_eq!(search.start(8), send(EncoderAddress::MAX, Operation::Abs40Mt, 8));

    let mut known = Detection::of(EA);
    assert_eq!(known.start(7), read(0xf7, 7));
    for _ in 1..10 {
        assert!(matches!(known.receive(LOST, 0), Step::Send { .. }));
    }
    assert_eq!(known.receive(LOST, 0), Step::Failed { error: Error::NoResponse, ready_ns: 300_000 });
}
