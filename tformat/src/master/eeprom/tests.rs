#![allow(clippy::unnecessary_wraps, reason = "outcomes as a procedure is told them")]

use super::*;
use crate::address::Adf;
use std::vec::Vec;

const ADDRESS: Address = Address::truncate(5);
const TWO: Page = Page::truncate(2);
const POLLING: Polling = Polling { interval_ns: 1000, max_tries: 3 };
const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });
const WRITE: Request = Request::write_eeprom(ADDRESS, 0x5a);
const READ: Request = Request::read_eeprom(ADDRESS);
const SELECT: Request = Request::write_eeprom(Address::PAGE_REGISTER, 2);
const CHECK: Request = Request::read_eeprom(Address::PAGE_REGISTER);

const fn memory(address: Address, busy: bool, edf: u8) -> Memory {
    Memory { adf: Adf::answered(address, busy), edf }
}

const fn wrote(busy: bool, edf: u8) -> Result<Response, Error> {
    Ok(Response::WriteEeprom(memory(ADDRESS, busy, edf)))
}

const fn read(busy: bool, edf: u8) -> Result<Response, Error> {
    Ok(Response::ReadEeprom(memory(ADDRESS, busy, edf)))
}

/// The page register holds this.
const fn page(number: u8) -> Result<Response, Error> {
    Ok(Response::ReadEeprom(memory(Address::PAGE_REGISTER, false, number)))
}

const fn selected(busy: bool) -> Result<Response, Error> {
    Ok(Response::WriteEeprom(memory(Address::PAGE_REGISTER, busy, 2)))
}

fn send(request: Request, not_before_ns: u64) -> Step<u8> {
    Step::Send { request, not_before_ns }
}

fn unknown(because: ErrorClass, ready_ns: u64) -> Step<u8> {
    Step::Failed { error: Error::EffectUnknown { because }, ready_ns }
}

fn not_done(sent: u8) -> Step<u8> {
    Step::Failed { error: Error::NotDone { sent, because: ErrorClass::DataMismatch }, ready_ns: 0 }
}

fn writing(max_tries: u16) -> EepromAccess {
    EepromAccess::write(TWO, ADDRESS, 0x5a, Polling { max_tries, ..POLLING })
}

/// Plays outcomes; gives what was sent and the end, if there is one.
fn play(mut access: EepromAccess, outcomes: &[Result<Response, Error>]) -> (Vec<Request>, Step<u8>) {
    let mut step = access.start(0);
    let mut sent = Vec::new();
    for outcome in outcomes {
        let Step::Send { request, .. } = step else { panic!("ended with {step:?} before {outcome:?}") };
        sent.push(request);
        step = access.receive(*outcome, 0);
    }
    (sent, step)
}

#[test]
fn a_write_looks_at_the_page_before_and_after() {
    let mut access = writing(3);
    assert_eq!(access.start(0), send(CHECK, 0));
    assert_eq!(access.receive(page(0), 5), send(SELECT, 5));
    assert_eq!(access.receive(selected(false), 10), send(CHECK, 10));
    // The selection was answered, and the register shows it: these are two.
    assert_eq!(access.receive(page(2), 15), send(WRITE, 15));
    assert_eq!(access.receive(wrote(false, 0x5a), 20), send(READ, 20));
    assert_eq!(access.receive(read(true, 0), 30), send(READ, 1030));
    assert_eq!(access.receive(read(false, 0x5a), 1040), send(CHECK, 1040));
    assert_eq!(access.receive(page(2), 1050), Step::Done { value: 0x5a, ready_ns: 1050 });
}

/// To find another page selected is no failure: one try is enough where nothing fails.
#[test]
fn one_try_is_enough_for_a_sound_line() {
    let outcomes = [page(0), selected(false), page(2), wrote(false, 0x5a), read(false, 0x5a), page(2)];
    assert_eq!(play(writing(1), &outcomes).1, Step::Done { value: 0x5a, ready_ns: 0 });
}

/// A page that is selected already is not selected again: each writes to the register.
#[test]
fn a_read_on_the_page_takes_three_requests() {
    let (sent, end) = play(EepromAccess::read(TWO, ADDRESS, POLLING), &[page(2), read(false, 7), page(2)]);
    assert_eq!((sent.as_slice(), end), (&[CHECK, READ, CHECK][..], Step::Done { value: 7, ready_ns: 0 }));
}

/// The encoder starts anew after the page was found: what was read or written was another page's.
#[test]
fn a_page_that_is_gone_afterwards() {
    // A cell of page 0 now holds it, and nothing tells.
    let (_, end) = play(writing(3), &[page(2), page(2), wrote(false, 0x5a), read(false, 0x5a), page(0)]);
    assert_eq!(end, unknown(ErrorClass::DataMismatch, 0));
    let (_, end) = play(writing(3), &[page(2), page(2), LOST, read(false, 0xff), page(0)]);
    assert_eq!(end, unknown(ErrorClass::DataMismatch, 0));
    // A read selects the page again.
    let again = [page(2), read(false, 0x11), page(0), selected(false), page(2), read(false, 7), page(2)];
    let (sent, end) = play(EepromAccess::read(TWO, ADDRESS, POLLING), &again);
    assert_eq!(sent, [CHECK, READ, CHECK, SELECT, CHECK, READ, CHECK]);
    assert_eq!(end, Step::Done { value: 7, ready_ns: 0 });
}

/// An encoder that has no such page answers the selection and keeps another: nothing is written.
#[test]
fn a_page_that_does_not_come_is_an_error() {
    let (_, end) = play(writing(3), &[page(0), selected(false), page(0), page(0)]);
    assert_eq!(end, Step::Failed { error: Error::DataMismatch { got: 0, want: 2 }, ready_ns: 0 });
}

/// A selection while the memory is busy was not taken: the register shows it, and the page is selected again.
#[test]
fn a_busy_answer_to_a_selection_is_followed_by_reading_the_register() {
    let (sent, next) = play(writing(4), &[page(0), selected(true), page(0), page(0)]);
    assert_eq!((sent.as_slice(), next), (&[CHECK, SELECT, CHECK, CHECK][..], send(SELECT, 0)));
}

/// The check field may fit by chance: what the register shows once is no reason to write to the page, nor to select it again.
#[test]
fn the_register_is_read_twice_unless_a_selection_was_answered() {
    let (sent, next) = play(writing(3), &[page(2), page(2)]);
    assert_eq!((sent.as_slice(), next), (&[CHECK, CHECK][..], send(WRITE, 0)));
    // Another page the second time: it is selected.
    let (sent, next) = play(writing(3), &[page(2), page(0), selected(false), page(2)]);
    assert_eq!((sent.as_slice(), next), (&[CHECK, CHECK, SELECT, CHECK][..], send(WRITE, 0)));
    // What one reading said of a selection that was lost, the next two refute.
    let (sent, next) = play(writing(9), &[page(0), LOST, page(0), page(2), page(2)]);
    assert_eq!((sent.as_slice(), next), (&[CHECK, SELECT, CHECK, CHECK, CHECK][..], send(WRITE, 0)));
    // What was read before a selection says nothing of it.
    let (_, next) = play(writing(9), &[page(2), page(0), LOST, page(2)]);
    assert_eq!(next, send(CHECK, 0));
    // A read looks at it once before and once after, which are two.
    let (_, next) = play(EepromAccess::read(TWO, ADDRESS, POLLING), &[page(2)]);
    assert_eq!(next, send(READ, 0));
}

/// A register that shows another page each time: each contradiction is a try.
#[test]
fn a_register_that_contradicts_itself_ends_it() {
    let (_, end) = play(writing(3), &[page(0), LOST, page(1), page(2), page(1)]);
    assert_eq!(end, unknown(ErrorClass::DataMismatch, 0));
}

/// The selection was lost, and nothing can be read: whether the encoder is on another page now is not known.
#[test]
fn a_selection_that_is_lost_has_an_unknown_effect() {
    for access in [writing(3), EepromAccess::read(TWO, ADDRESS, POLLING)] {
        let (_, end) = play(access, &[page(0), LOST, LOST, LOST]);
        assert_eq!(end, unknown(ErrorClass::NoResponse, 1000));
    }
    // Without a selection nothing has happened.
    let (_, end) = play(writing(3), &[LOST, LOST, LOST]);
    assert_eq!(end, Step::Failed { error: Error::NoResponse { echo: false }, ready_ns: 1000 });
}

/// In each of its bits.
#[test]
fn a_byte_that_did_not_stick_is_an_error() {
    for bit in 0..8 {
        let got = 0x5a ^ 1 << bit;
        let other = [read(false, got), page(2)];
        let (_, end) = play(writing(3), &[&[page(2), page(2), wrote(false, 0x5a)], &other[..], &other].concat());
        assert_eq!(end, not_done(1));
    }
}

/// After a lost response the cell is read; it is written again only if it holds another value.
#[test]
fn a_write_is_repeated_only_when_the_cell_differs() {
    for holds in [0x5a, 0xff] {
        let held = [read(false, holds), page(2)];
        let (sent, next) = play(writing(3), &[&[page(2), page(2), LOST], &held[..], &held].concat());
        assert_eq!(sent, [CHECK, CHECK, WRITE, READ, CHECK, READ, CHECK]);
        assert_eq!(next, if holds == 0x5a { Step::Done { value: 0x5a, ready_ns: 0 } } else { send(WRITE, 0) });
    }
}

/// The check field of a reading may fit by chance: what is read once proves neither that the byte is there nor that it is not.
#[test]
fn one_reading_proves_nothing() {
    let held = |value| [read(false, value), page(2)];
    let done = Step::Done { value: 0x5a, ready_ns: 0 };
    let unanswered = [page(2), page(2), LOST];
    let answered = [page(2), page(2), wrote(false, 0x5a)];
    for (outcomes, want) in [
        ([&answered[..], &held(0x58), &held(0x5a)].concat(), done),
        ([&answered[..], &held(0x58), &held(0x59)].concat(), send(READ, 0)),
        ([&answered[..], &held(0x58), &held(0x59), &held(0x59)].concat(), not_done(1)),
        ([&unanswered[..], &held(0x5a)].concat(), send(READ, 0)),
        ([&unanswered[..], &held(0x58), &held(0x5a)].concat(), send(READ, 0)),
        ([&unanswered[..], &held(0x58), &held(0x5a), &held(0x5a)].concat(), done),
        // What was read after the write before says nothing of this one.
        ([&unanswered[..], &held(0x58), &held(0x58), &[LOST], &held(0x58)].concat(), send(READ, 0)),
    ] {
        assert_eq!(play(writing(9), &outcomes).1, want, "{outcomes:?}");
    }
    // Readings that go on to contradict each other end it.
    let (_, end) = play(writing(2), &[&answered[..], &held(0x58), &held(0x59), &held(0x58)].concat());
    assert_eq!(end, unknown(ErrorClass::DataMismatch, 0));
}

/// Nor does one answer that says busy: two wrong bits may have made it of one that took the byte.
#[test]
fn a_busy_answer_is_no_proof() {
    let (_, end) = play(writing(2), &[page(2), page(2), wrote(true, 0x5a), LOST]);
    assert_eq!(end, unknown(ErrorClass::NoResponse, 1000));
    let held = [read(false, 0xff), page(2)];
    let (sent, next) = play(writing(3), &[&[page(2), page(2), wrote(true, 0x5a)], &held[..], &held].concat());
    assert_eq!((sent.len(), next), (7, send(WRITE, 0)));
}

/// Writing, reading, and no response at all.
#[test]
fn polling_is_bounded_and_says_what_is_known() {
    let (_, end) = play(writing(3), &[page(2), page(2), LOST, LOST, LOST]);
    assert_eq!(end, unknown(ErrorClass::NoResponse, 1000));
    let (_, end) = play(EepromAccess::read(TWO, ADDRESS, POLLING), &[page(2), read(true, 0), LOST, read(true, 0)]);
    assert_eq!(end, Step::Failed { error: Error::Busy { tries: 3 }, ready_ns: 1000 });
    let (_, end) = play(writing(1), &[page(2), page(2), wrote(true, 0x5a)]);
    assert_eq!(end, unknown(ErrorClass::Busy, 1000));
    // What holds the value, on a page that is not known.
    let (_, end) = play(writing(2), &[page(2), page(2), wrote(false, 0x5a), read(false, 0x5a), LOST, LOST]);
    assert_eq!(end, unknown(ErrorClass::NoResponse, 1000));
}

/// Two tries: the write whose response was lost, and the reading that shows that it was not done.
#[test]
fn a_write_is_not_repeated_beyond_the_tries() {
    let held = [read(false, 0xff), page(2)];
    let (_, end) = play(writing(2), &[&[page(2), page(2), LOST], &held[..], &held].concat());
    assert_eq!(end, not_done(1));
}

/// What was tried for the page does not count against the byte.
/// What was lost until the memory has taken the byte is not counted against the memory that is busy then.
#[test]
fn what_is_written_has_its_own_tries() {
    let (busy, done) = (read(true, 0), read(false, 0x5a));
    let held = [read(false, 0), page(2)];
    let after = [wrote(false, 0x5a), busy, busy, done, page(2)];
    let (sent, end) = play(writing(3), &[&[page(2), page(2), LOST], &held[..], &held, &after].concat());
    assert_eq!(sent, [CHECK, CHECK, WRITE, READ, CHECK, READ, CHECK, WRITE, READ, READ, READ, CHECK]);
    assert_eq!(end, Step::Done { value: 0x5a, ready_ns: 0 });
}

#[test]
fn the_page_has_its_own_tries() {
    let outcomes = [page(0), LOST, page(2), LOST, LOST, read(false, 7), page(2)];
    let (_, end) = play(EepromAccess::read(TWO, ADDRESS, Polling { max_tries: 3, ..POLLING }), &outcomes);
    assert_eq!(end, Step::Done { value: 7, ready_ns: 0 });
}

/// An encoder that starts anew after every reading: going back to the page does not count the tries anew.
#[test]
fn looking_for_the_page_does_not_go_on_for_ever() {
    let mut access = EepromAccess::read(TWO, ADDRESS, POLLING);
    let (mut step, mut on) = (access.start(0), 0);
    for requests in 1.. {
        let Step::Send { request, .. } = step else { break };
        assert!(requests <= 20, "it does not end");
        let outcome = match request {
            CHECK => page(on),
            SELECT => {
                on = 2;
                selected(false)
            }
            _ => {
                on = 0;
                read(false, 7)
            }
        };
        step = access.receive(outcome, 0);
    }
    assert_eq!(step, Step::Failed { error: Error::DataMismatch { got: 0, want: 2 }, ready_ns: 0 });
}

/// What another cell holds says nothing of this one, nor of the page register; in each bit of the address.
#[test]
fn responses_of_another_address_are_refused() {
    for bit in 0..7 {
        let elsewhere = |address: Address, edf| {
            Ok(Response::ReadEeprom(memory(Address::truncate(address.get() ^ 1 << bit), false, edf)))
        };
        let page_of_another = elsewhere(Address::PAGE_REGISTER, 2);
        let (sent, _) =
            play(writing(9), &[page_of_another, page(2), page(2), LOST, elsewhere(ADDRESS, 0x5a), read(false, 0x5a)]);
        assert_eq!(sent, [CHECK, CHECK, CHECK, WRITE, READ, READ]);
        let mut access = EepromAccess::read(TWO, ADDRESS, Polling { max_tries: 1, ..POLLING });
        let _ = access.start(0);
        let _ = access.receive(page(2), 0);
        let error = Error::AddressMismatch { got: 5 ^ 1 << bit, want: 5 };
        assert_eq!(access.receive(elsewhere(ADDRESS, 7), 0), Step::Failed { error, ready_ns: 1000 });
    }
}

/// A read is never taken for the response to a write, nor the other way round.
#[test]
fn responses_of_the_other_kind_are_refused() {
    let (sent, next) = play(writing(9), &[page(2), page(2), read(false, 0x5a), wrote(false, 0x5a)]);
    assert_eq!((sent.as_slice(), next), (&[CHECK, CHECK, WRITE, READ][..], send(READ, 1000)));
}
