use super::*;
use crate::address::{Address, Adf};
use crate::doubt::Doubt;
use crate::response::tests::plain_exchanges;
use crate::status::StatusField;
use crate::timing::BitRate;
use crate::tolerated::{Policy, Tolerated};
use proptest::prelude::*;
use std::vec::Vec;

const LINE: Line = Line::new(BitRate::Mbit2_5);
/// A logged response to ID 0.
const RESPONSE: [u8; 6] = [0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37];

/// Each byte with the end of its delimiter: fields of 4 us, the first begins at `from`.
fn at(from: u64, bytes: &[u8]) -> Vec<(u8, u64)> {
    bytes.iter().zip(1..).map(|(byte, k)| (*byte, from + 4_000 * k)).collect()
}

/// Feeds bytes one by one and waits for the end.
fn run(request: Request, line: Line, bytes: &[(u8, u64)]) -> Result<Response, Error> {
    let mut transaction = Transaction::start(request, line, 0);
    for (byte, end_ns) in bytes {
        let _ = transaction.hear(&[*byte], *end_ns);
    }
    ended(&mut transaction)
}

fn ended(transaction: &mut Transaction) -> Result<Response, Error> {
    if let Progress::Pending { until_ns } = transaction.progress() {
        assert_eq!(transaction.poll(until_ns - 1), Progress::Pending { until_ns });
        let _ = transaction.poll(until_ns);
    }
    match transaction.progress() {
        Progress::Done { value, .. } => Ok(value.response),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => panic!("the time-out did not end it"),
    }
}

/// The numbers of the sources: 10 us to the start bit, one and a half fields from field to field, four bits of
/// turn-around, 1 us of lead, 0.48 us to the sampling instant.
#[test]
fn defaults_are_numbers_of_the_sources() {
    let slow = Line::new(BitRate::Mbit2_5);
    let got = (slow.response_timeout_ns, slow.field_timeout_ns, slow.turn_around_ns, slow.latency_budget_ns());
    assert_eq!(got, (10_000, 6_000, 1_600, 1_200));
    assert_eq!((slow.hand_over_ns, slow.driver_lead_ns, slow.sampling_ns, slow.echo), (5_599, 1_000, 480, false));
    let fast = Line::new(BitRate::Mbit5);
    let got = (fast.response_timeout_ns, fast.field_timeout_ns, fast.turn_around_ns, fast.latency_budget_ns());
    assert_eq!((got, fast.hand_over_ns), ((10_000, 3_000, 800, 600), 2_799));
}

/// Each setting is changed by its own call, and by no other.
#[test]
fn settings_are_independent() {
    let changed = LINE
        .with_echo()
        .with_response_timeout_ns(1)
        .with_field_timeout_ns(2)
        .with_turn_around_ns(3)
        .with_hand_over_ns(4)
        .with_driver_lead_ns(5)
        .with_sampling_ns(6);
    let times = [
        changed.response_timeout_ns,
        changed.field_timeout_ns,
        changed.turn_around_ns,
        changed.hand_over_ns,
        changed.driver_lead_ns,
        changed.sampling_ns,
    ];
    assert_eq!((changed.rate, changed.echo, times), (BitRate::Mbit2_5, true, [1, 2, 3, 4, 5, 6]));
}

/// A time-out before the turn-around, and fields shorter than fields are: no response could ever be taken.
#[test]
fn absurd_lines_are_refused() {
    let absurd = Progress::Failed { error: Error::Line, ready_ns: 7 };
    for (line, fails) in [
        (LINE.with_response_timeout_ns(1_599), true),
        (LINE.with_response_timeout_ns(1_600), false),
        (LINE.with_turn_around_ns(10_001), true),
        (LINE.with_turn_around_ns(10_000), false),
        (LINE.with_field_timeout_ns(3_999), true),
        (LINE.with_field_timeout_ns(4_000), false),
    ] {
        let mut transaction = Transaction::start(Request::ReadSingleTurn, line, 7);
        assert_eq!(transaction.progress() == absurd, fails, "{line:?}");
        assert_eq!(transaction.hear(&RESPONSE, 60_000) == absurd, fails, "{line:?}");
    }
}

/// The own request does not shorten the wait for the response: 4 us, 10 us, a field, 5.599 us to hand it over.
#[test]
fn an_echo_leaves_the_time_out_as_it_is() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    assert_eq!(transaction.hear(&[0x02], 4_000), Progress::Pending { until_ns: 23_600 });
    assert_eq!(transaction.poll(23_599), Progress::Pending { until_ns: 23_600 });
    // Nor does a line on which fields may be far apart lengthen it.
    let mut patient = Transaction::start(Request::ReadSingleTurn, LINE.with_field_timeout_ns(100_000), 0);
    assert_eq!(patient.hear(&[0x02], 4_000), Progress::Pending { until_ns: 23_600 });
}

/// The request of 4 us begins at 10 us. Its driver is on 1 us before, and off before the encoder answers.
#[test]
fn times_of_a_transaction() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 10_000);
    let sent = transaction.transmission();
    assert_eq!(
        (sent.frame.as_bytes(), sent.start_ns, sent.end_ns, sent.driver_on_ns),
        (&[0x02][..], 10_000, 14_000, 9_000)
    );
    assert_eq!(sent.driver_off, DriverOff { earliest_ns: 14_000, latest_ns: 15_600 });
    // 14 us, 10 us to the start bit, 4 us for the field, 5.599 us until it is handed over.
    assert_eq!(transaction.progress(), Progress::Pending { until_ns: 33_600 });
    assert_eq!(transaction.poll(33_599), Progress::Pending { until_ns: 33_600 });
    // The longest response begun at 24 us is over 44 us later.
    let want = Progress::Failed { error: Error::NoResponse { echo: false }, ready_ns: 68_000 };
    assert_eq!(transaction.poll(33_600), want);

    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 10_000);
    // The next field ends 6 us later at the latest, and 5.599 us later it is handed over; what came may be a glitch.
    assert_eq!(transaction.hear(&[0x02], 21_000), Progress::Pending { until_ns: 33_600 });
    assert_eq!(transaction.hear(&[0x20], 27_000), Progress::Pending { until_ns: 38_600 });
    let done = transaction.hear(&RESPONSE[2..], 41_000);
    let response = Response::parse(Request::ReadSingleTurn, &RESPONSE).unwrap();
    let value = Exchange { response, sampled_ns: 14_480, began_ns: 17_000 };
    assert_eq!(done, Progress::Done { value, ready_ns: 41_000 });
}

/// A block that is the response alone is taken at one go: with the same end as byte by byte, whatever its second byte is, and one
/// byte of it wrong or too early.
#[test]
fn a_whole_block_ends_as_its_bytes_do() {
    let requests = [
        Request::ReadSingleTurn,
        Request::ReadAll,
        Request::ReadEncoderId,
        Request::ReadEeprom { adf: Adf::from_bits(3) },
    ];
    let (mut done, mut failed) = (0, 0);
    for (request, second) in requests.into_iter().flat_map(|request| (0..=255).map(move |second| (request, second))) {
        let id = request.data_id();
        let mut block = std::vec![0; usize::from(id.response_fields())];
        (block[0], block[1]) = (id.control_field().get(), second);
        for wrong in [0, 0x10] {
            *block.last_mut().unwrap() = crate::crc(&block[..block.len() - 1]) ^ wrong;
            let asked_ns = 4_000 * u64::from(id.request_fields());
            // The first is a bit time too early: the earliest start bit is 1.6 us after the request.
            for begin_ns in [asked_ns + 1_200, asked_ns + 1_600] {
                let bytes = at(begin_ns, &block);
                let mut whole = Transaction::start(request, LINE, 0);
                let _ = whole.push(&block, bytes.last().unwrap().1);
                let mut single = Transaction::start(request, LINE, 0);
                for (byte, end_ns) in bytes {
                    let _ = single.hear(&[byte], end_ns);
                }
                assert_eq!(ended(&mut whole), ended(&mut single), "{id} {second:02x} {wrong} {begin_ns}");
                assert_eq!(whole.until_ns(), single.until_ns());
                *if whole.outcome().unwrap().is_ok() { &mut done } else { &mut failed } += 1;
            }
        }
    }
    // In place of SF no CF of the request and no 1A; to ID D its own address, busy or not.
    assert_eq!((done, failed), (254 + 255 + 254 + 2, 4 * 4 * 256 - 765));
}

/// In the same place as in a new one, after whatever was before; nothing was asked before the first.
#[test]
fn a_transaction_begins_anew_in_its_place() {
    let mut place = Transaction::idle();
    let free = Progress::Failed { error: Error::NoResponse { echo: false }, ready_ns: 0 };
    assert_eq!((place.hear(&RESPONSE, 31_000), place.poll(u64::MAX)), (free, free));
    for (begin_ns, line) in [(0, LINE), (100_000, LINE.with_echo()), (200_000, LINE.with_turn_around_ns(10_001))] {
        place.restart(Request::ReadSingleTurn, line, begin_ns);
        let mut new = Transaction::start(Request::ReadSingleTurn, line, begin_ns);
        assert_eq!(place, new);
        assert_eq!(
            (place.outcome().is_none(), place.until_ns()),
            match place.progress() {
                Progress::Pending { until_ns } => (true, until_ns),
                Progress::Done { ready_ns, .. } | Progress::Failed { ready_ns, .. } => (false, ready_ns),
            }
        );
        let heard = place.push(&RESPONSE, begin_ns + 31_000).copied();
        assert_eq!(
            heard.map(|outcome| outcome.map(|value| value.response)),
            Some(ended(&mut {
                let _ = new.hear(&RESPONSE, begin_ns + 31_000);
                new
            }))
        );
    }
    assert_eq!(place.outcome(), Some(&Err(Error::Line)));
}

proptest! {
    /// With and without echo, whatever the master was told, byte by byte and in blocks cut anywhere.
    #[test]
    fn responses_arrive((request, response) in plain_exchanges(), echo: bool, hint: bool, cuts: [bool; 16]) {
        let (sent, answer) = (request.emit(), response.emit());
        let end = 4_000 * u64::from(sent.fields());
        let mut bytes = if echo { at(0, sent.as_bytes()) } else { Vec::new() };
        bytes.extend(at(end + 3_000, answer.as_bytes()));
        let line = Line { echo: hint, ..LINE };
        prop_assert_eq!(run(request, line, &bytes), Ok(response));
        let mut transaction = Transaction::start(request, line, 0);
        let mut block = Vec::new();
        for (k, (byte, end_ns)) in bytes.iter().enumerate() {
            block.push(*byte);
            if cuts[k] || k + 1 == bytes.len() {
                let _ = transaction.hear(&block, *end_ns);
                block.clear();
            }
        }
        prop_assert_eq!(ended(&mut transaction), Ok(response));
    }

    /// Up to 5.599 us late no echo is ever a response, and no good response is lost.
    #[test]
    fn late_interrupts((request, response) in plain_exchanges(), late in prop::collection::vec(0..=5_599_u64, 15), answers: bool) {
        let (sent, answer) = (request.emit(), response.emit());
        let end = 4_000 * u64::from(sent.fields());
        let mut bytes = at(0, sent.as_bytes());
        if answers {
            bytes.extend(at(end + 3_000, answer.as_bytes()));
        }
        // Handlers run one after the other.
        let mut before = 0;
        for ((_, end_ns), late) in bytes.iter_mut().zip(late) {
            before = (*end_ns + late).max(before);
            *end_ns = before;
        }
        let want = if answers { Ok(response) } else { Err(Error::NoResponse { echo: true }) };
        prop_assert_eq!(run(request, LINE, &bytes), want);
    }

    #[test]
    fn cut_responses_end_by_time_out((request, response) in plain_exchanges(), cut in 0..11_usize, echo: bool) {
        let (sent, answer) = (request.emit(), response.emit());
        let cut = cut.min(answer.as_bytes().len() - 1);
        let mut bytes = if echo { at(0, sent.as_bytes()) } else { Vec::new() };
        bytes.extend(at(4_000 * u64::from(sent.fields()) + 3_000, &answer.as_bytes()[..cut]));
        let want = match cut {
            0 => Error::NoResponse { echo },
            _ => Error::Truncated { got: cut as u16, want: answer.fields().into() },
        };
        prop_assert_eq!(run(request, LINE, &bytes), Err(want));
    }

    /// What has ended does not change any more, whatever comes.
    #[test]
    fn an_end_is_an_end((request, response) in plain_exchanges(), more: [u8; 20]) {
        let mut transaction = Transaction::start(request, LINE, 0);
        let _ = transaction.hear(response.emit().as_bytes(), 100_000);
        let ended = transaction;
        let done = matches!(ended.progress(), Progress::Done { value, ready_ns: 100_000 } if value.response == response);
        prop_assert!(done);
        for byte in more {
            let _ = transaction.hear(&[byte], 100_000);
            let _ = transaction.framing_error(100_000);
            let _ = transaction.poll(u64::MAX);
        }
        prop_assert_eq!(transaction, ended);
    }
}

/// A response that ended before the request had left, or that belongs to the request before, is not one.
#[test]
fn what_is_older_than_the_request_is_not_a_response() {
    let early: Vec<_> = RESPONSE.iter().zip(1..).map(|(byte, k)| (*byte, 500 * k)).collect();
    assert_eq!(run(Request::ReadSingleTurn, LINE, &early), Err(Error::NoResponse { echo: true }));
    // It began 1 us before the end of the request: its first bytes are dropped, and the rest is no response.
    let stale = run(Request::ReadSingleTurn, LINE, &at(3_000, &RESPONSE));
    assert!(stale.is_err(), "{stale:?}");
    // The earliest response begins 1.6 us after the request.
    assert!(run(Request::ReadSingleTurn, LINE, &at(5_600, &RESPONSE)).is_ok());
    assert!(run(Request::ReadSingleTurn, LINE, &at(5_599, &RESPONSE)).is_err());
}

#[test]
fn a_write_is_not_done_by_its_own_echo() {
    let request = Request::write_eeprom(Address::truncate(1), 0x5a);
    let sent = request.emit();
    let only = run(request, LINE, &at(0, sent.as_bytes()));
    assert_eq!(only, Err(Error::NoResponse { echo: true }));
    // Nor in a block that is handed over late, with the time of its end.
    let mut transaction = Transaction::start(request, LINE, 0);
    let _ = transaction.hear(sent.as_bytes(), 16_000);
    assert_eq!(ended(&mut transaction), Err(Error::NoResponse { echo: true }));
}

/// All positions of 16 bits: an echo in front never makes another one of them, even if its time is not known.
#[test]
fn an_echo_is_never_part_of_a_position() {
    for abs in (0..65_536_u32).step_by(if cfg!(miri) { 4_099 } else { 1 }) {
        let [low, high, ..] = abs.to_le_bytes();
        let mut bytes = [0x02, 0x02, 0x20, low, high, 0, 0];
        bytes[6] = crate::crc(&bytes[1..6]);
        let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        for byte in bytes {
            let _ = transaction.hear(&[byte], 100_000);
        }
        assert_eq!(ended(&mut transaction).map(|r| r.abs().map(crate::Abs::get)), Ok(Some(abs)));
    }
}

/// 1.1 us late at 5 Mbit/s, and the whole response at once after 4 us of idle line.
#[test]
fn what_is_there_is_taken_before_the_clock_is_asked() {
    let response = Response::parse(Request::ReadSingleTurn, &RESPONSE);
    let mut fast = Transaction::start(Request::ReadSingleTurn, Line::new(BitRate::Mbit5), 0);
    for (byte, k) in RESPONSE.iter().zip(1..) {
        let late = if k == 4 { 1_100 } else { 0 };
        let _ = fast.poll(5_000 + 2_000 * k);
        let _ = fast.hear(&[*byte], 5_000 + 2_000 * k + late);
    }
    assert_eq!(ended(&mut fast), response);
    let mut block = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let _ = block.hear(&RESPONSE, 1_000_000);
    assert_eq!(ended(&mut block), response);
}

#[test]
fn the_echo_is_told_where_nothing_else_came() {
    let request = Request::write_eeprom(Address::PAGE_REGISTER, 1);
    let wrong = at(0, &[0x32, 0x7f, 0x03, 0x4c]);
    let error = Error::EchoMismatch { at: 2, got: 3, want: 1 };
    assert_eq!(run(request, LINE.with_echo(), &wrong), Err(error));
    assert_eq!(run(request, LINE, &wrong), Err(Error::NoResponse { echo: false }));
    assert_eq!(run(request, LINE.with_echo(), &at(0, &[0x32, 0x7f])), Err(Error::NoResponse { echo: false }));
    let mut transaction = Transaction::start(request, LINE.with_echo(), 0);
    let _ = transaction.framing_error(4_000);
    assert_eq!(ended(&mut transaction), Err(Error::EchoMismatch { at: 0, got: 0, want: 0x32 }));
}

#[test]
fn a_refusal_is_received_whole() {
    let refusal = [0x1a, 0x40, 0xeb, 0x3b, 0x1c, 0x17, 0x04, 0x27, 0x00, 0x00, 0xa2];
    let outcome = run(Request::ReadSingleTurn, LINE, &at(7_000, &refusal));
    assert_eq!(outcome, Err(Error::Rejected { sf: StatusField::CA0 }));
    // After an echo, in one block.
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let block = [&[0x02], &refusal[..]].concat();
    let _ = transaction.hear(&block, 51_000);
    assert_eq!(ended(&mut transaction), Err(Error::Rejected { sf: StatusField::CA0 }));
}

/// After a framing error the encoder goes on to talk: the line is free when the longest response is over.
#[test]
fn framing_errors_of_the_uart() {
    let mut plain = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let _ = plain.hear(&[0x02], 11_000);
    let want = Progress::Failed { error: Error::Delimiter { field: 1 }, ready_ns: 58_000 };
    assert_eq!(plain.framing_error(15_000), want);
    let mut late = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let want = Progress::Failed { error: Error::Delimiter { field: 0 }, ready_ns: 99_000 };
    assert_eq!(late.framing_error(99_000), want);
}

/// A response cannot end its first field before 9.6 us: what was damaged then was the echo. Later, the response may still come; it is
/// waited for to the end, 23.599 us.
#[test]
fn a_framing_error_before_a_response_is_remembered() {
    let heard = |end_ns| {
        let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        (transaction.framing_error(end_ns), ended(&mut transaction))
    };
    let pending = Progress::Pending { until_ns: 23_600 };
    let (none, delimiter) = (Error::NoResponse { echo: false }, Error::Delimiter { field: 0 });
    assert_eq!(heard(9_599), (pending, Err(none)));
    assert_eq!(heard(9_600), (pending, Err(delimiter)));
    assert_eq!(heard(23_599), (pending, Err(delimiter)));
    assert_eq!(heard(23_600).0, Progress::Failed { error: delimiter, ready_ns: 58_000 });
    let mut good = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let _ = good.framing_error(9_600);
    let _ = good.hear(&RESPONSE, 36_000);
    assert_eq!(ended(&mut good), Response::parse(Request::ReadSingleTurn, &RESPONSE));
}

/// A response that is wrong is refused when it is there, not when its time is over.
#[test]
fn a_wrong_response_is_refused_at_once() {
    let [cf, sf, rest @ ..] = RESPONSE;
    let wrong = [&[cf, sf ^ 0x40][..], &rest].concat();
    let refused = Progress::Failed { error: Error::Crc { got: 0x37, want: 0x77 }, ready_ns: 58_000 };
    let mut block = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    assert_eq!(block.hear(&wrong, 31_000), refused);
    let mut single = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let mut last = single.progress();
    for (byte, end_ns) in at(7_000, &wrong) {
        assert!(matches!(last, Progress::Pending { .. }), "{last:?}");
        last = single.hear(&[byte], end_ns);
    }
    assert_eq!(last, refused);
}

/// Glitches that look like the begin of all data (ID 3), which has 11 fields: the response after them has its first field in the last of
/// these, or is shorter than they let expect.
#[test]
fn a_response_is_found_behind_the_begin_of_a_longer_one() {
    for glitches in [&[0x1a, 0x55][..], &[0x1a, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55]] {
        let bytes = at(5_700, &[glitches, &RESPONSE[..]].concat());
        let outcome = run(Request::ReadSingleTurn, LINE, &bytes);
        assert_eq!(outcome, Response::parse(Request::ReadSingleTurn, &RESPONSE), "{glitches:02x?}");
    }
}

/// Its first byte was on the line before a response can be: what came before it was not the begin of one either.
#[test]
fn a_block_that_reaches_far_back_begins_anew() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let _ = transaction.hear(&[0x1a], 9_700);
    let block = [&[0x55], &RESPONSE[..]].concat();
    let progress = transaction.hear(&block, 33_599);
    assert!(matches!(progress, Progress::Done { .. }), "{progress:?}");
}

/// More bytes than any request and response have: the last ones count.
#[test]
fn a_long_block_ends_with_the_response() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let block = [&[0x55; 40], &RESPONSE[..]].concat();
    let _ = transaction.hear(&block, 200_000);
    assert_eq!(ended(&mut transaction), Response::parse(Request::ReadSingleTurn, &RESPONSE));
}

/// Noise before the own request, and after that a refusal: the longest request and response are the last 15 bytes.
#[test]
fn a_long_block_with_an_echo_ends_with_the_response() {
    let refusal = [0x1a, 0x40, 0xeb, 0x3b, 0x1c, 0x17, 0x04, 0x27, 0x00, 0x00, 0xa2];
    let request = Request::write_eeprom(Address::truncate(1), 0x5a);
    let mut transaction = Transaction::start(request, LINE, 0);
    let block = [&[0x55; 40], request.emit().as_bytes(), &refusal[..]].concat();
    let _ = transaction.hear(&block, 400_000);
    assert_eq!(ended(&mut transaction), Err(Error::Rejected { sf: StatusField::CA0 }));
}

/// The evidence is as old as the instant of sampling: 125 us where 125 us are allowed.
#[test]
fn evidence_of_an_exchange() {
    let response = Response::parse(Request::ReadSingleTurn, &RESPONSE).unwrap();
    let exchange = Exchange { response, sampled_ns: 4_480, began_ns: 7_000 };
    let evidence = exchange.evidence(Resolution::new(23, 16).unwrap());
    let policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN.alarms(crate::Almc::all()));
    let at = |now_ns| evidence.at(now_ns, policy).map(crate::Sample::single_turn);
    assert_eq!(
        (at(4_480), at(129_480), at(129_481)),
        (Ok(1_883_572), Ok(1_883_572), Err(Doubt::Old { age_ns: 125_001 }))
    );
    // EA1 is set in the logged response.
    assert_eq!(
        evidence.at(4_480, Policy::new(0).tolerating(Tolerated::SINGLE_TURN)),
        Err(Doubt::Status { sf: StatusField::EA1 })
    );
    // ID 0 carries no turns.
    assert_eq!(evidence.at(4_480, Policy::new(0)), Err(Doubt::Absent));
}
