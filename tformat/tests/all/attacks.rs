//! Attacks on the masters, each with bytes and times of its own: no simulated encoder, no simulated line.

use tformat::master::{
    EepromAccess, Exchange, Line, MultiTurnZero, Polling, Progress, Reset, SingleTurnZero, Step, Transaction,
};
use tformat::{
    Address, BitRate, Doubt, Error, ErrorClass, Page, Policy, Request, Resolution, Response, Sample, Tolerated,
};

const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });
const POLLING: Polling = Polling { interval_ns: 1_000, max_tries: 4 };

/// The response with these fields and a sound check field.
fn response(request: Request, fields: &[u8]) -> Result<Response, Error> {
    let sum = fields.iter().fold(0, |sum, byte| sum ^ byte);
    Response::parse(request, &[fields, &[sum]].concat())
}

/// An endless run of control fields, as a second master makes it that never stops asking: each of them may be the echo of
/// the request, and none of them is a response.
#[test]
fn a_line_that_never_falls_silent_does_not_hold_a_transaction() {
    for request in [Request::ReadSingleTurn, Request::ReadAll] {
        let [cf] = *request.emit().as_bytes() else { panic!("one field") };
        let mut transaction = Transaction::start(request, Line::new(BitRate::Mbit2_5), 0);
        let mut now_ns = 4_000;
        while matches!(transaction.progress(), Progress::Pending { .. }) {
            now_ns += 4_000;
            let _ = transaction.hear(&[cf], now_ns);
            let _ = transaction.poll(now_ns);
            // 4 us of request, 10 us to the start bit, eleven fields of 6 us, and 5.6 us to hand the last one over.
            assert!(now_ns < 100_000, "still pending after {now_ns} ns");
        }
        assert!(matches!(transaction.progress(), Progress::Failed { .. }));
    }
}

/// It is listened to as long as the slowest response lasts: 4 us of request, 10 us to its start bit, eleven fields of 6 us,
/// and 5.599 us to hand the last one over.
#[test]
fn the_slowest_response_is_waited_for_and_nothing_longer() {
    let mut transaction = Transaction::start(Request::ReadAll, Line::new(BitRate::Mbit2_5), 0);
    for k in 2..=21 {
        let _ = transaction.hear(&[0x1a], 4_000 * k);
    }
    assert_eq!(transaction.progress(), Progress::Pending { until_ns: 85_600 });
    // The logged response, its fields a time-out apart and each handed over at the last moment.
    let fields = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];
    let mut transaction = Transaction::start(Request::ReadAll, Line::new(BitRate::Mbit2_5), 0);
    for (field, k) in fields.into_iter().zip(0..) {
        let late_ns = 18_000 + 6_000 * k + 5_599;
        assert!(matches!(transaction.poll(late_ns), Progress::Pending { .. }), "field {k}");
        let _ = transaction.hear(&[field], late_ns);
    }
    assert!(matches!(transaction.progress(), Progress::Done { ready_ns: 83_599, .. }));
}

/// Whoever polls when he was told to is not told the same again.
#[test]
fn polling_at_the_time_that_was_named_ends_it() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, Line::new(BitRate::Mbit2_5), 0);
    let Progress::Pending { until_ns } = transaction.progress() else { panic!("pending") };
    assert!(matches!(transaction.poll(until_ns - 1), Progress::Pending { .. }));
    assert!(matches!(transaction.poll(until_ns), Progress::Failed { .. }));
}

/// CA0 (0x40) and CA1 (0x80) say that the encoder found the request damaged: what it answers, it has not counted.
#[test]
fn a_response_that_says_that_the_request_was_damaged_is_none_of_the_ten() {
    for sf in [0x40, 0x80, 0xc0] {
        let mut zero = Reset::set_single_turn_zero_and_shift_commutation_angle();
        let _ = zero.start(0);
        let damaged = response(Request::SetSingleTurnZero, &[0xc2, sf, 1, 2, 3]);
        let because = ErrorClass::Rejected;
        let want = Step::Failed { error: Error::EffectUnknown { because }, ready_ns: 18_000_000 };
        assert_eq!(zero.receive(damaged, 0), want);
    }
    // Nor is it a witness of anything.
    let resolution = Resolution::new(17, 16).unwrap();
    let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
    let _ = zero.start(0);
    let damaged = response(Request::ReadSingleTurn, &[0x02, 0x80, 1, 2, 0]);
    assert_eq!(zero.receive(damaged, 7), Step::Send { request: Request::ReadSingleTurn, not_before_ns: 18_000_007 });
    let mut turns = MultiTurnZero::set_and_lose_multi_turn_reference(resolution, 1);
    let _ = turns.start(0);
    let damaged = response(Request::ReadMultiTurn, &[0x8a, 0x40, 1, 2, 0]);
    assert_eq!(turns.receive(damaged, 7), Step::Send { request: Request::ReadMultiTurn, not_before_ns: 18_000_007 });
}

/// A host that hands in one outcome too many, after the end, gets the end again and nothing to send.
#[test]
fn what_has_ended_sends_nothing_more() {
    let good = response(Request::SetSingleTurnZero, &[0xc2, 0, 1, 2, 3]);
    let mut reset = Reset::set_single_turn_zero_and_shift_commutation_angle();
    let _ = reset.start(0);
    let end = reset.receive(LOST, 0);
    assert!(matches!(end, Step::Failed { .. }));
    for outcome in [good, LOST, good] {
        assert_eq!(reset.receive(outcome, 1), end);
    }

    let resolution = Resolution::new(17, 16).unwrap();
    let read = response(Request::ReadSingleTurn, &[0x02, 0, 1, 2, 0]);
    let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 4);
    let _ = zero.start(0);
    let mut end = zero.receive(LOST, 0);
    while let Step::Send { .. } = end {
        end = zero.receive(LOST, 0);
    }
    assert!(matches!(end, Step::Failed { error: Error::NoResponse { .. }, .. }));
    for outcome in [read, good, LOST] {
        assert_eq!(zero.receive(outcome, 1), end);
    }

    let address = Address::new(5).unwrap();
    let mut access = EepromAccess::write(Page::truncate(2), address, 0x5a, POLLING);
    let _ = access.start(0);
    let mut end = access.receive(LOST, 0);
    while let Step::Send { .. } = end {
        end = access.receive(LOST, 0);
    }
    let select = Request::write_eeprom(Address::PAGE_REGISTER, 2);
    let check = Request::read_eeprom(Address::PAGE_REGISTER);
    for outcome in [response(select, &[0x32, 127, 2]), response(check, &[0xea, 127, 2])] {
        assert_eq!(access.receive(outcome, 1), end);
    }
}

/// Three pages' worth of one cell.
struct Paged {
    cells: [u8; 3],
    page: usize,
}

impl Paged {
    fn answer(&mut self, request: Request) -> Result<Response, Error> {
        match *request.emit().as_bytes() {
            [0x32, 127, page, _] => self.page = page.into(),
            [0x32, 5, data, _] => self.cells[self.page] = data,
            [0xea, 127, _] => return response(request, &[0xea, 127, u8::try_from(self.page).unwrap()]),
            [0xea, 5, _] => return response(request, &[0xea, 5, self.cells[self.page]]),
            ref other => panic!("{other:?}"),
        }
        response(request, &request.emit().as_bytes()[..3])
    }
}

/// An encoder that starts anew, its supply having failed for a moment, is on page 0 again and does not say so: before any of
/// the requests, and whether that one is answered or not. What is said to be done is done on the page that was named; where
/// another page may have been written to, that is said.
#[test]
fn an_encoder_that_starts_anew_between_any_two_requests() {
    let address = Address::new(5).unwrap();
    for (fails, lost, write_it) in
        (0..8).flat_map(|k| [(k, false), (k, true)]).flat_map(|(k, l)| [(k, l, false), (k, l, true)])
    {
        let mut encoder = Paged { cells: [0x11, 0x22, 0x33], page: 0 };
        let page = Page::truncate(2);
        let mut access = if write_it {
            EepromAccess::write(page, address, 0x5a, POLLING)
        } else {
            EepromAccess::read(page, address, POLLING)
        };
        let mut step = access.start(0);
        let mut order = Vec::new();
        while let Step::Send { request, not_before_ns } = step {
            let outcome = if order.len() == fails {
                encoder.page = 0;
                if lost { LOST } else { encoder.answer(request) }
            } else {
                encoder.answer(request)
            };
            order.push(request.to_string());
            assert!(order.len() < 20, "{order:?}");
            step = access.receive(outcome, not_before_ns);
        }
        let case = format!("fails before {fails}, lost: {lost}, {order:?}");
        match step {
            Step::Done { value, .. } if write_it => {
                assert_eq!((value, encoder.cells), (0x5a, [0x11, 0x22, 0x5a]), "{case}");
            }
            Step::Done { value, .. } => assert_eq!((value, encoder.cells), (0x33, [0x11, 0x22, 0x33]), "{case}"),
            Step::Failed { error: Error::EffectUnknown { .. }, .. } => assert!(write_it && fails >= 3, "{case}"),
            // The page that was said to be selected is not: there may be none.
            Step::Failed { error: Error::DataMismatch { got: 0, want: 2 }, .. } => {
                assert!(fails == 2 && encoder.cells == [0x11, 0x22, 0x33], "{case}");
            }
            other => panic!("{other:?}, {case}"),
        }
    }
}

/// A clock that was set back, or that wrapped, makes no position young.
#[test]
fn a_position_from_the_future_is_as_old_as_it_is_far_away() {
    let response = response(Request::ReadSingleTurn, &[0x02, 0, 1, 2, 0]).unwrap();
    let exchange = Exchange { response, sampled_ns: 5_000_000_000, began_ns: 5_000_002_520 };
    let resolution = Resolution::new(17, 16).unwrap();
    let policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
    let at = |now_ns| exchange.evidence(resolution).at(now_ns, policy).map(Sample::single_turn);
    assert_eq!((at(5_000_125_000), at(4_999_875_000)), (Ok(0x201), Ok(0x201)));
    assert_eq!(at(17), Err(Doubt::Old { age_ns: 4_999_999_983 }));
}
