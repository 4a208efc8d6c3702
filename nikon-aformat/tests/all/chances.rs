//! Frames of two responses, or one that came twice, whose CRC-8 is right by chance: no response is lost through them.

use nikon_aformat::bus::{Addresses, Outcome};
use nikon_aformat::master::BusTransaction;
use nikon_aformat::{BitOrder, Command, EncoderAddress, Expected, Operation, Request, Resolution, Response};

use crate::transactions::{FRAME_NS, LINE, bus, ea, ended, response, start};

/// A bus that has heard, frame by frame, half of one response and all of the next, if the CRC-8 over the first four of these frames is
/// right by chance.
pub fn by_chance(expected: &Expected, first: &[u16], second: &[u16]) -> Option<BusTransaction> {
    let frames: Vec<_> = first[..2].iter().chain(second).copied().collect();
    Response::parse_words(expected, &frames[..4], BitOrder::LsbFirst).ok()?;
    let mut bus = bus(0b111, LINE);
    for (k, content) in (1..).zip(frames) {
        let _ = bus.hear(&[Some(content)], 10_000 + k * FRAME_NS);
    }
    Some(bus)
}

/// A shaft at rest: inside the responses of a bus that lost nothing there may be another sound one, made of the end of one
/// response and the start of the next, in every cycle again. All turns and positions that make one are heard.
#[test]
fn no_response_is_lost_on_a_sound_line() {
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let expected = request.expected(Resolution::default());
    let next = response(Command::Abs40Mt, 1, 0x1234).emit().contents().to_vec();
    let mut chances = 0;
    for low in 0..1 << 16 {
        // The third frame looks like the first one of encoder 0.
        let contents = response(Command::Abs40Mt, 0, low | 0x0104 << 16 | 5 << 32).emit().contents().to_vec();
        let inside: Vec<_> = contents[2..].iter().chain(&next[..2]).copied().collect();
        if Response::parse_words(&expected, &inside, BitOrder::LsbFirst).is_err() {
            continue;
        }
        chances += 1;
        let block: Vec<_> = contents.iter().chain(&next).copied().map(Some).collect();
        let mut bus = bus(0b11, LINE);
        let _ = bus.hear_since(&block, 4_500, 60_000);
        assert_eq!(bus.bus().missing(), Addresses::NONE, "{low:#x}");
    }
    assert!(chances > 100, "{chances}");
}

/// The last two frames of a response are lost, and the CRC-8 over the first two and those that begin the next one is right by
/// chance. Frame by frame that is known only when the next one is complete: it is heard, and the other one is withdrawn.
#[test]
fn a_response_is_not_lost_in_the_rest_of_another() {
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let expected = request.expected(Resolution::default());
    let mut chances = 0;
    for position in 0..1 << 16 {
        let first = response(Command::Abs40Mt, 0, position).emit().contents().to_vec();
        let sent = response(Command::Abs40Mt, 1, 0x1234);
        let second = sent.emit().contents().to_vec();
        let Some(bus) = by_chance(&expected, &first, &second) else { continue };
        chances += 1;
        assert_eq!(bus.bus().of(ea(1)), Outcome::Good(sent), "{position:#x}");
        assert_eq!((bus.bus().of(ea(0)), bus.bus().damaged()), (Outcome::Missing, 1), "{position:#x}");
    }
    assert!(chances > 100, "{chances}");
}

/// The first frame comes twice, and the CRC-8 over it and the first three frames is right by chance: the response begins with
/// the second of them.
#[test]
fn a_repeated_frame_is_no_part_of_a_response() {
    let request = Request::new(ea(3), Operation::Abs40);
    let expected = request.expected(Resolution::default());
    let mut chances = 0;
    for high in 0..256 {
        let sent = response(Command::Abs40, 3, 0x1234 | high << 24);
        let contents = sent.emit().contents().to_vec();
        let block: Vec<_> = [contents[0]].iter().chain(&contents).copied().collect();
        if Response::parse_words(&expected, &block[..4], BitOrder::LsbFirst).is_err() {
            continue;
        }
        chances += 1;
        let block: Vec<_> = block.into_iter().map(Some).collect();
        let mut transaction = start(LINE);
        let _ = transaction.hear_since(&block, 4_500, 200_000);
        assert_eq!(ended(transaction), Ok(sent));
    }
    assert_eq!(chances, 1, "one byte in 256 is the CRC-8");
}

/// Noise of two frames after a response, in one block: all that its last frame can be makes some CRC-8 right in which the response
/// would be the rest of another one. It is that only if a response begins there, and is sound then.
#[test]
fn noise_behind_a_response_costs_nothing() {
    let request = Request::new(ea(3), Operation::Abs40);
    let expected = request.expected(Resolution::default());
    let first = u64::from(response(Command::Abs40, 3, 0).emit().contents()[0]);
    for (position, begins) in [(0x1234, false), (first << 16 | 0x1234, true)] {
        let sent = response(Command::Abs40, 3, position);
        let contents = sent.emit().contents().to_vec();
        assert_eq!(contents[2] == contents[0], begins);
        let mut chances = 0;
        for last in 0..=0xffff {
            let block: Vec<_> = contents.iter().copied().chain([0, last]).collect();
            if Response::parse_words(&expected, &block[2..], BitOrder::LsbFirst).is_ok() {
                chances += 1;
                continue;
            }
            let block: Vec<_> = block.into_iter().map(Some).collect();
            let mut transaction = start(LINE);
            let _ = transaction.hear_since(&block, 4_500, 200_000);
            assert_eq!(ended(transaction), Ok(sent), "{position:#x} {last:#x}");
        }
        assert_eq!(chances, if begins { 256 } else { 0 });
    }
}
