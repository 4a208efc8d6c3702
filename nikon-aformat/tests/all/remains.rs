//! What is left of one response when the next frames come: nothing of it is counted twice, and nothing in it hides another response.

use nikon_aformat::bus::Outcome;
use nikon_aformat::{Command, EncoderAddress, Error, Operation, Request, Resolution};

use crate::chances::by_chance;
use crate::transactions::{FRAME_NS, LINE, bus, ea, ended, response, start};

/// Sync code and command of the first frame of a response to command 4.
fn begins(content: u16) -> bool {
    content & 7 == 4 && content >> 6 & 0x1f == 4
}

/// Two frames are left of a damaged response, and the CRC-8 over them and the first two of the next one is right by chance. The last
/// frame of that one looks like the start of a third, which it is not.
#[test]
fn a_response_of_which_the_last_frame_looks_like_a_first_one_is_heard() {
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let expected = request.expected(Resolution::default());
    let (mut chances, mut alike) = (0, 0);
    for high in 0..1 << 16 {
        let sent = response(Command::Abs40Mt, 1, 0x1234 | high << 24);
        let second = sent.emit().contents().to_vec();
        if !begins(second[3]) || begins(second[1]) || begins(second[2]) {
            continue;
        }
        alike += 1;
        for position in 0..1 << 11 {
            let first = response(Command::Abs40Mt, 0, position).emit().contents().to_vec();
            let Some(bus) = by_chance(&expected, &first, &second) else { continue };
            chances += 1;
            assert_eq!(bus.bus().of(ea(1)), Outcome::Good(sent), "{high:#x} {position:#x}");
            assert_eq!((bus.bus().of(ea(0)), bus.bus().damaged()), (Outcome::Missing, 1), "{high:#x} {position:#x}");
        }
    }
    assert!(alike > 5 && chances > 20, "{alike} {chances}");
}

/// A block that may have begun long before the request: a frame without delimiter, then half of the response, so late that it can
/// only have begun after the request.
#[test]
fn half_of_a_response_behind_a_glitch_is_as_young_as_its_own_frames() {
    let sent = response(Command::Abs40, 3, 0x12_3456);
    let contents = sent.emit().contents().to_vec();
    let request = Request::new(ea(3), Operation::Abs40);
    let mut transaction = nikon_aformat::master::Transaction::start(request, Resolution::default(), LINE, 100_000);
    // The request has left at 104.5 us.
    let begin_ns = 106_000;
    let _ = transaction.hear(&[None, Some(contents[0]), Some(contents[1])], begin_ns + 2 * FRAME_NS);
    let _ = transaction.hear(&[Some(contents[2]), Some(contents[3])], begin_ns + 4 * FRAME_NS);
    assert_eq!(ended(transaction), Ok(sent));
}

/// The first frame came too early to be an answer for certain; the pause after it does not make it younger.
#[test]
fn a_frame_does_not_get_younger_by_the_pause_behind_it() {
    let contents = response(Command::Abs40, 3, 0x12_3456).emit().contents().to_vec();
    for (begin_ns, pause_ns, fault) in
        [(5_000, 1_000, None), (4_600, 0, Some(Error::NoResponse)), (4_600, 1_000, Some(Error::NoResponse))]
    {
        let mut transaction = start(LINE);
        let _ = transaction.hear(&[Some(contents[0])], begin_ns + FRAME_NS);
        let _ = transaction.hear(&[Some(contents[1]), Some(contents[2])], begin_ns + pause_ns + 3 * FRAME_NS);
        let _ = transaction.hear(&[Some(contents[3])], begin_ns + pause_ns + 4 * FRAME_NS);
        assert_eq!(ended(transaction).err(), fault, "{begin_ns} {pause_ns}");
    }
}

/// Two frames of noise, a pause, and a frame without delimiter: it is the first of what might have been a response.
#[test]
fn frames_before_a_pause_do_not_count() {
    let mut transaction = start(LINE);
    let _ = transaction.hear(&[Some(0)], 20_000);
    let _ = transaction.hear(&[Some(0)], 20_000 + FRAME_NS);
    let _ = transaction.framing_error(60_000);
    assert_eq!(ended(transaction), Err(Error::Delimiter { frame: 0 }));
}

/// A response that is cut off, and a frame without delimiter after a pause: two are damaged, and not a third when the time is over.
#[test]
fn what_is_cut_off_is_counted_once() {
    let contents = response(Command::Abs40Mt, 0, 0).emit().contents().to_vec();
    let mut bus = bus(0b11, LINE);
    let _ = bus.hear(&[Some(contents[0])], 20_000);
    let _ = bus.framing_error(60_000);
    let _ = bus.poll(u64::MAX);
    assert_eq!(bus.bus().damaged(), 2);
}

/// Half of a response, and in the next block the rest with another response, 4 us after it: the block lasts longer than its frames
/// because of the idle time between the two.
#[test]
fn the_rest_of_a_response_may_come_with_the_next_one() {
    let answers = [0, 1].map(|address| response(Command::Abs40Mt, address, 0x77));
    let [first, second] = answers.map(|answer| answer.emit().contents().iter().copied().map(Some).collect::<Vec<_>>());
    let mut bus = bus(0b11, LINE);
    let half_ns = 10_000 + 2 * FRAME_NS;
    let _ = bus.hear_since(&first[..2], 4_500, half_ns);
    let _ = bus.hear_since(&[&first[2..], &second].concat(), half_ns, half_ns + 6 * FRAME_NS + 4_000);
    assert_eq!([0, 1].map(|address| bus.bus().of(ea(address))), answers.map(Outcome::Good));
    assert_eq!(bus.bus().damaged(), 0);
}
