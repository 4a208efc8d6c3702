//! Reception by bytes and times of one's own: where the response stands in what was handed over, and when that was. At
//! 2.5 Mbit/s a field lasts 4 us; the encoder answers 3 us after the request.

use tformat::master::{Line, Progress, Transaction};
use tformat::{Address, BitRate, Error, Request, Response};

const LINE: Line = Line::new(BitRate::Mbit2_5);

/// Fields with their check field.
fn checked(fields: &[u8]) -> Vec<u8> {
    let sum = fields.iter().fold(0, |sum, byte| sum ^ byte);
    [fields, &[sum]].concat()
}

/// One exchange of each kind, by the bytes on the line.
fn exchanges() -> [(Request, Vec<u8>); 5] {
    [
        (Request::ReadSingleTurn, checked(&[0x02, 0x20, 0xb4, 0xbd, 0x1c])),
        (Request::ReadAll, checked(&[0x1a, 0, 0x29, 0xc0, 0x3b, 0x17, 7, 0, 0, 0])),
        (Request::ReadEncoderId, checked(&[0x92, 0, 0x17])),
        (Request::read_eeprom(Address::truncate(5)), checked(&[0xea, 5, 0x5a])),
        (Request::write_eeprom(Address::truncate(5), 0x5a), checked(&[0x32, 5, 0x5a])),
    ]
}

fn outcome(transaction: &mut Transaction) -> Result<Response, Error> {
    if let Progress::Pending { until_ns } = transaction.progress() {
        let _ = transaction.poll(until_ns);
    }
    match transaction.progress() {
        Progress::Done { value, .. } => Ok(value.response),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => panic!("the time-out did not end it"),
    }
}

fn request_ns(request: Request) -> u64 {
    4_000 * request.emit().as_bytes().len() as u64
}

/// In one block that is told to end at this time.
fn in_a_block(request: Request, block: &[u8], end_ns: u64) -> Result<Response, Error> {
    let mut transaction = Transaction::start(request, LINE, 0);
    let _ = transaction.hear(block, end_ns);
    outcome(&mut transaction)
}

/// 1 in 256 EEPROM writes has the check field 1A, with which a refusal begins. Late by up to a turn-around and a field the
/// last bytes of the echo are not told from the response by their time.
#[test]
fn an_echo_that_ends_like_a_refusal() {
    let mut seen = 0;
    for edf in 0..=255 {
        for address in [0x05, 0x32, 0x28, 0x1a] {
            let request = Request::write_eeprom(Address::truncate(address), edf);
            let sent = request.emit().as_bytes().to_vec();
            seen += u32::from(sent[3] == 0x1a);
            // 16 us of request, 3 us, 16 us of response.
            for late_ns in [0, 1_000, 2_600, 5_599] {
                let both = [&sent[..], &sent[..]].concat();
                assert!(in_a_block(request, &both, 35_000 + late_ns).is_ok(), "{request}, {late_ns} ns late");
            }
            let mut transaction = Transaction::start(request, LINE, 0);
            for (byte, k) in sent.iter().zip(1..) {
                let _ = transaction.hear(&[*byte], 4_000 * k + 5_599);
            }
            for (byte, k) in sent.iter().zip(1..) {
                let _ = transaction.hear(&[*byte], 19_000 + 4_000 * k);
            }
            assert!(outcome(&mut transaction).is_ok(), "{request} byte by byte");
            assert_eq!(in_a_block(request, &sent, 16_000 + 5_599), Err(Error::NoResponse { echo: true }));
        }
    }
    assert!(seen > 3, "{seen}");
}

/// Any glitch after the response or before it, in the same block or alone, with the echo and without.
#[test]
fn a_glitch_costs_nothing() {
    for (request, answer) in exchanges() {
        let want = Response::parse(request, &answer);
        let (asked_ns, sent) = (request_ns(request), request.emit().as_bytes().to_vec());
        let end_ns = asked_ns + 3_000 + 4_000 * answer.len() as u64;
        for glitch in 0..=255 {
            for echo in [&[][..], &sent] {
                let block = [echo, &answer, &[glitch]].concat();
                assert_eq!(in_a_block(request, &block, end_ns + 4_000), want, "{glitch:#x} after {request}");
                let block = [echo, &answer, &[glitch, 0x55]].concat();
                assert_eq!(in_a_block(request, &block, end_ns + 8_000), want, "{glitch:#x} 55 after {request}");
            }
            // A response that begins 3 us later than usual, and a glitch between.
            let mut transaction = Transaction::start(request, LINE, 0);
            let _ = transaction.hear(&[glitch], asked_ns + 5_800);
            for (byte, k) in answer.iter().zip(1..) {
                let _ = transaction.hear(&[*byte], asked_ns + 6_000 + 4_000 * k);
            }
            // A glitch that begins a response or a refusal and makes a sound one of other bytes: one in 65,536.
            assert_eq!(outcome(&mut transaction), want, "{glitch:#x} before {request}");
        }
        let mut transaction = Transaction::start(request, LINE, 0);
        let _ = transaction.framing_error(asked_ns + 5_800);
        // The echo, which was held up in a buffer.
        let _ = transaction.hear(&sent, asked_ns);
        let _ = transaction.hear(&answer, end_ns + 3_000);
        assert_eq!(outcome(&mut transaction), want);
    }
}

/// Two responses of which each is sound: nobody knows which one answers the request.
#[test]
fn two_responses_in_a_block_are_a_doubt() {
    for (request, answer) in exchanges() {
        let other = match *answer.as_slice() {
            [cf, .., _] if answer.len() == 4 => checked(&[cf, answer[1], answer[2]]),
            [.., _] => checked(&[&answer[..2], &[1, 2, 3], &answer[5..answer.len() - 1]].concat()),
            [] => panic!("no answer"),
        };
        let both = [&answer[..], &other].concat();
        let end_ns = request_ns(request) + 3_000 + 4_000 * both.len() as u64;
        let want = match request {
            // The first of two like the request is the echo of a line on which the encoder was slow.
            Request::WriteEeprom { .. } => Response::parse(request, &answer),
            _ => Err(Error::TwoResponses),
        };
        assert_eq!(in_a_block(request, &both, end_ns), want, "{request}");
    }
}

/// A response that began while the request was on the line, or within a bit after it, is older than its request, however late
/// within 1.2 us it is told; 0.6 us at 5 Mbit/s.
#[test]
fn what_is_told_late_is_not_younger() {
    for (rate, field_ns, budget_ns) in [(BitRate::Mbit2_5, 4_000, 1_200), (BitRate::Mbit5, 2_000, 600)] {
        let line = Line::new(rate);
        assert_eq!(u64::from(line.latency_budget_ns()), budget_ns);
        let stale = checked(&[0x02, 0x00, 0x01, 0x02, 0x03]);
        for began_ns in (0..field_ns + field_ns / 10).step_by(100).chain([field_ns + 1]) {
            for late_ns in (0..=budget_ns).step_by(100) {
                let mut alone = Transaction::start(Request::ReadSingleTurn, line, 0);
                let mut block = alone;
                for (byte, k) in stale.iter().zip(1..) {
                    let _ = alone.hear(&[*byte], began_ns + field_ns * k + late_ns);
                }
                let _ = block.hear(&stale, began_ns + field_ns * 6 + late_ns);
                for (mut transaction, how) in [(alone, "byte by byte"), (block, "in a block")] {
                    let end = outcome(&mut transaction);
                    assert!(end.is_err(), "{rate}: began at {began_ns}, {late_ns} late, {how}: {end:?}");
                }
            }
        }
    }
}

/// A response that other bytes of the line happen to repeat: all positions of a shaft, in one block with the echo and a glitch.
#[test]
fn no_position_is_lost_on_a_sound_line() {
    for abs in (0..0x2_0000_u32).step_by(7) {
        let [low, middle, high, _] = abs.to_le_bytes();
        let answer = checked(&[0x02, 0x00, low, middle, high]);
        for block in [[&[0x02][..], &answer].concat(), answer.clone()] {
            let got = in_a_block(Request::ReadSingleTurn, &block, 31_000);
            assert_eq!(got.map(|response| response.abs().map(tformat::Abs::get)), Ok(Some(abs)));
        }
    }
}

/// The first field is told late, as late as the answer to the request would begin; by the time of the last field, and by four fields
/// before it, it began too early.
#[test]
fn a_response_is_as_old_as_its_last_field_says() {
    // From 5.6 us on, 1.6 after the request; the first field ends at 9.6 us then.
    for (begin_ns, taken) in [(5_600, true), (5_500, false)] {
        let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        for (k, byte) in (1..).zip(checked(&[0x02, 0, 1, 2, 3])) {
            let end_ns: u64 = begin_ns + 4_000 * k;
            let _ = transaction.hear(&[byte], if k == 1 { end_ns.max(9_700) } else { end_ns });
        }
        assert_eq!(outcome(&mut transaction).is_ok(), taken, "{begin_ns}");
    }
}

/// Two responses are refused: the first one says why.
#[test]
fn the_first_fault_is_told() {
    let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
    let _ = transaction.hear(&[0x02, 0, 1, 2, 3, 0x55], 31_000);
    let _ = transaction.hear(&[0x02, 0, 1, 2, 3, 0x66], 55_000);
    assert_eq!(outcome(&mut transaction), Err(Error::Crc { got: 0x55, want: 0x02 }));
}

/// Noise that looks like the start of a refusal, with the response right after it: it ends with the last field of the response, and
/// not when the time is over.
#[test]
fn a_response_behind_what_looks_like_a_refusal_is_not_waited_for() {
    let response = checked(&[0x02, 0x20, 0xb4, 0xbd, 0x1c]);
    for noise in [&[0x02, 0x1a][..], &[0x02, 0, 0x1a]] {
        let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        for (k, byte) in (1..).zip(noise.iter().chain(&response)) {
            let _ = transaction.hear(&[*byte], 7_000 + 4_000 * k);
        }
        assert!(matches!(transaction.progress(), Progress::Done { .. }), "{:?}", transaction.progress());
    }
}
