//! What a log shows between its blocks, by hand-written bytes.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    missing_docs
)]

use rtex_block::inspect::{LogAnalysis, LogFinding, LogShape};
use rtex_block::position::Gear;
use rtex_block::{BlockSize, MacId, UpdateCounter};

fn command(counter: u8, code: u8, position: i32) -> [u8; 16] {
    let mut block = [0; 16];
    block[..4].copy_from_slice(&[counter << 5 | 5, code, 0x80, 0]);
    block[4..8].copy_from_slice(&position.to_le_bytes());
    block
}

fn response(counter: u8, code: u8, nine: u8) -> [u8; 16] {
    let mut block = [0; 16];
    block[..4].copy_from_slice(&[0x80 | counter << 5 | 5, code, 0xc1, 0]);
    block[9] = nine;
    block
}

/// Findings with the number of the block, from 0.
fn findings(analysis: &mut LogAnalysis, blocks: &[[u8; 16]]) -> Vec<(usize, LogFinding)> {
    let found = blocks.iter().enumerate();
    found.flat_map(|(k, block)| analysis.block(block).map(move |finding| (k, finding)).collect::<Vec<_>>()).collect()
}

fn analysis() -> LogAnalysis {
    LogAnalysis::new(Some(500_000), Gear::new(2, 1).unwrap())
}

#[test]
fn a_good_log_shows_nothing() {
    let mut blocks = Vec::new();
    for k in 0..20_u8 {
        blocks.push(command((k + 1) % 4, 0x20, i32::from(k) * 100_000));
        // The code comes one command later, the counter at once.
        blocks.push(response((k + 1) % 4, if k == 0 { 0 } else { 0x20 }, 0));
    }
    assert_eq!(findings(&mut analysis(), &blocks), []);
    // Two communications in an update period: every block twice.
    let twice: Vec<_> = blocks.chunks(2).flat_map(|pair| [pair[0], pair[1], pair[0], pair[1]]).collect();
    assert_eq!(findings(&mut analysis(), &twice), []);
    assert_eq!(analysis().end().count(), 0);
}

#[test]
fn counters_that_do_not_count() {
    let still = [1, 2, 2, 2, 2, 3, 3, 3].map(|counter| response(counter, 0x20, 0));
    let stands = LogFinding::EchoStands { responses: 3 };
    assert_eq!(findings(&mut analysis(), &still), [(3, stands), (7, stands)]);
    let jumps = [1, 2, 2, 2, 0, 1].map(|counter| command(counter, 0x20, 0));
    let of =
        |from, to| LogFinding::CounterJumps { from: UpdateCounter::truncate(from), to: UpdateCounter::truncate(to) };
    assert_eq!(findings(&mut analysis(), &jumps), [(3, of(2, 2)), (4, of(2, 0))]);
}

/// 400 M pulses a second at gear 2/1 are 100 000 units in half a millisecond.
#[test]
fn steps_of_the_command_position() {
    let blocks = [(1, 0), (2, 100_000), (3, -1), (0, i32::MAX), (1, i32::MIN)].map(|(c, at)| command(c, 0x20, at));
    let too_far = |step| LogFinding::PositionStep { step, max: 100_000 };
    assert_eq!(findings(&mut analysis(), &blocks), [(2, too_far(-100_001)), (3, too_far(i32::MIN))]);
    // Without the period there is no limit; with the servo off the drive follows nothing.
    assert_eq!(findings(&mut LogAnalysis::new(None, Gear::UNITY), &blocks), []);
    let off = blocks.map(|mut block| {
        block[2] = 0;
        block
    });
    assert_eq!(findings(&mut analysis(), &off), []);
}

#[test]
fn requests_and_their_answers() {
    let blocks = [
        command(1, 0x20, 0),
        response(1, 0x20, 0),
        command(2, 0x26, 0),
        response(2, 0x20, 0),
        command(3, 0x26, 0),
        response(3, 0x26, 0x10),
        command(0, 0x26, 0),
        response(0, 0x26, 0x10),
        command(1, 0x26, 0),
        response(1, 0x26, 0),
        command(2, 0x26, 0),
        response(2, 0x26, 0),
    ];
    assert_eq!(findings(&mut analysis(), &blocks), [(9, LogFinding::Answered { responses: 4, busy: 2 })]);
    let late: Vec<_> =
        (1..=4).flat_map(|k| [command(k % 4, 0x20, 0), response(k % 4, if k < 4 { 0 } else { 0x20 }, 0)]).collect();
    assert_eq!(findings(&mut analysis(), &late), [(7, LogFinding::CodeLate { responses: 4 })]);
}

#[test]
fn drives_on_one_side_only() {
    let mut log = analysis();
    let mut other = response(1, 0x20, 0);
    other[0] ^= 2;
    assert_eq!(findings(&mut log, &[command(1, 0x20, 0), other]), []);
    let id = |number| MacId::new(number).unwrap();
    assert!(log.end().eq([LogFinding::NeverAnswered(id(5)), LogFinding::NeverAsked(id(7))]));
    // A log of one direction alone says nothing about the other.
    let mut log = analysis();
    findings(&mut log, &[command(1, 0x20, 0)]);
    assert_eq!(log.end().count(), 0);
    let mut log = analysis();
    findings(&mut log, &[response(1, 0x20, 0)]);
    assert_eq!(log.end().count(), 0);
    // Before the start the counter stands at 0, and its echo with it.
    let nop: Vec<_> = (0..5).flat_map(|_| [command(0, 0, 0), response(0, 0, 0)]).collect();
    assert_eq!(findings(&mut analysis(), &nop), []);
}

/// A drive that goes silent is missed at the third command, once, and again after it has come back.
#[test]
fn a_drive_that_goes_silent() {
    let asked = |counter| command(counter, 0x20, 0);
    let answered = |counter| response(counter, 0x20, 0);
    let blocks = [
        asked(1),
        answered(1),
        asked(2),
        asked(2),
        answered(2),
        asked(3),
        asked(0),
        asked(1),
        asked(2),
        answered(2),
        asked(3),
        asked(0),
        asked(1),
    ];
    let silent = LogFinding::NoAnswer { commands: 3 };
    assert_eq!(findings(&mut analysis(), &blocks), [(7, silent), (12, silent)]);
    // One that has never answered is said at the end.
    let mut log = analysis();
    assert_eq!(findings(&mut log, &[1, 2, 3, 0].map(asked)), []);
}

#[test]
fn size_and_byte_order_of_a_log() {
    let mut short = Vec::new();
    let mut long = Vec::new();
    for k in 1..=8_u8 {
        for block in [command(k % 4, 0x20, 5), response(k % 4, 0x20, 0)] {
            short.extend(block);
            long.extend(block);
            let mut sub = [0; 16];
            // A sub-command, and the answer to it.
            sub[0] = if block[0] < 0x80 { 0x8a } else { 0x0a };
            long.extend(sub);
        }
    }
    let swapped = |bytes: &[u8], width: usize| -> Vec<u8> {
        bytes.chunks(width).flat_map(|word| word.iter().rev().copied()).collect()
    };
    for word in [1, 2, 4] {
        let guess = LogShape::guess(&swapped(&short, word));
        assert_eq!(guess, Some(LogShape { size: BlockSize::Bytes16, word }));
        let guess = LogShape::guess(&swapped(&long, word));
        assert_eq!(guess, Some(LogShape { size: BlockSize::Bytes32, word }));
    }
    assert_eq!(LogShape::guess(&[0; 256]), None);
    // Four blocks are enough, of which more than half make sense.
    let shape = Some(LogShape { size: BlockSize::Bytes16, word: 1 });
    assert_eq!(LogShape::guess(&short[..64]), shape);
    let spoilt = |blocks: usize| {
        let mut bytes = short.clone();
        bytes.chunks_mut(16).take(blocks).for_each(|block| block[1] = 0x7f);
        LogShape::guess(&bytes)
    };
    assert_eq!((spoilt(7), spoilt(8)), (shape, None));
    // Sub blocks of which some look like main blocks: 32 bytes explain more. Where all of them do, 16 are enough.
    let like_main = |subs: usize| {
        let mut bytes = long.clone();
        bytes.chunks_mut(32).take(subs).for_each(|block| block[17] = 0x20);
        LogShape::guess(&bytes).map(|shape| shape.size)
    };
    assert_eq!(like_main(10), Some(BlockSize::Bytes32));
    assert_eq!(like_main(16), Some(BlockSize::Bytes16));
    assert_eq!(LogShape::guess(&short[..48]), None);
}
