//! The shape of a log, by traffic that is made here byte by byte: of any size, byte order and number of drives, from any byte on.

mod few;

use rtex_block::BlockSize;
use rtex_block::inspect::{LogShape, ShapeDoubt};
use servowire_world::Draw;

/// What is on the bus.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Traffic {
    /// Cyclic positions of motors that turn.
    Positions,
    /// The same with the servo off.
    Standing,
    /// Cyclic speeds.
    Speeds,
    /// Profile mode; a monitor value is asked for.
    Profile,
}

/// A bus of some drives.
#[derive(Debug)]
struct Bus {
    traffic: Traffic,
    wide: bool,
    /// Commands ask for a value in the sub block too.
    asks: bool,
    /// Each block is sent twice.
    twice: bool,
    nops: usize,
    drives: Vec<u8>,
}

fn draw_bus(draw: &mut Draw, traffic: Traffic, wide: bool) -> Bus {
    let mut drives: Vec<u8> = (0..=draw.below(8)).map(|_| draw.below(32) as u8).collect();
    drives.sort_unstable();
    drives.dedup();
    let nops = [0, 4, 30, 100][draw.below(4) as usize];
    Bus { traffic, wide, asks: draw.below(2) == 1, twice: draw.below(4) == 0, nops, drives }
}

/// The log of so many communications after the NOPs.
fn log(bus: &Bus, draw: &mut Draw, periods: usize) -> Vec<Vec<u8>> {
    let mut positions: Vec<i32> = bus.drives.iter().map(|_| draw.below(1 << 32) as u32 as i32).collect();
    let fastest = [400, 100_000][draw.below(2) as usize];
    let speed = 1 + draw.below(fastest) as i32;
    let mut blocks = Vec::new();
    for k in 0..bus.nops + periods {
        let started = k >= bus.nops;
        let updates = k.saturating_sub(bus.nops) / if bus.twice { 2 } else { 1 };
        let counter = if started { (updates + 1) as u8 & 3 } else { 0 };
        for (drive, position) in bus.drives.iter().zip(&mut positions) {
            let turns = bus.traffic != Traffic::Standing;
            *position = position.wrapping_add(if turns { speed } else { 0 });
            let (mut command, mut response) = (vec![0; 32], vec![0; 32]);
            (command[0], response[0]) = (counter << 5 | drive, 0x80 | counter << 5 | drive);
            (command[16], response[2]) = (0x80, 0x40);
            let code = match bus.traffic {
                Traffic::Positions | Traffic::Standing => 0x20,
                Traffic::Speeds => 0x30,
                Traffic::Profile => 0x1a,
            };
            let torque = draw.below(300) as i32 - 100;
            response[4..8].copy_from_slice(&position.to_le_bytes());
            response[12..16].copy_from_slice(&torque.to_le_bytes());
            if started {
                (command[1], response[1]) = (code, code);
                let given = match bus.traffic {
                    Traffic::Positions => position.wrapping_add(40 + speed),
                    Traffic::Standing => *position,
                    Traffic::Speeds => 3_000,
                    Traffic::Profile => 2_000_000,
                };
                command[4..8].copy_from_slice(&given.to_le_bytes());
                if turns {
                    (command[2], response[2]) = (0x80, 0xc0);
                    response[8..12].copy_from_slice(&(9_000 + draw.below(2_000) as i32).to_le_bytes());
                }
                if bus.traffic == Traffic::Profile {
                    // Monitor: the torque.
                    command[8..12].copy_from_slice(&[6, 0, 0, 0]);
                    response[8..12].copy_from_slice(&[6, 0, 0, 0]);
                }
                if bus.asks {
                    command[16..18].copy_from_slice(&[0x8a, 0x11]);
                    response[16..18].copy_from_slice(&[0x0a, 0x11]);
                }
            }
            for mut block in [command, response] {
                block.truncate(if bus.wide { 32 } else { 16 });
                blocks.push(block);
            }
        }
    }
    blocks
}

fn written(blocks: &[Vec<u8>], word: usize) -> Vec<u8> {
    blocks.iter().flat_map(|block| block.chunks(word).flat_map(|word| word.iter().rev().copied())).collect()
}

/// From one 16-bit word inside a block on, words of 16 bits have header, code and counter where turned words of 32 bits have them.
fn are_twins(a: LogShape, b: LogShape) -> bool {
    let of = |narrow: LogShape, wide: LogShape| {
        (narrow.word, wide.word) == (2, 4) && narrow.skip == (wide.skip + 2) % wide.size.bytes()
    };
    a.size == b.size && (of(a, b) || of(b, a))
}

/// Whether what was told of a piece is true, where twins may look alike: then both are told, or the one that begins with a block.
fn is_fair(guess: Result<LogShape, ShapeDoubt>, want: LogShape) -> bool {
    match guess {
        Ok(shape) => shape == want || shape.skip == 0 && are_twins(shape, want),
        Err(ShapeDoubt::Either(a, b)) => are_twins(a, b) && (a == want || b == want),
        Err(ShapeDoubt::Unknown) => false,
    }
}

/// Every offset, both sizes, every byte order, one to eight drives, from power-up or later.
#[test]
fn a_log_from_any_byte_on_is_told() {
    let mut draw = Draw::seeded(26);
    for wide in [false, true] {
        let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
        for word in [1, 2, 4] {
            for from in 0..size.bytes() {
                for traffic in [Traffic::Positions, Traffic::Standing, Traffic::Speeds, Traffic::Profile] {
                    let bus = draw_bus(&mut draw, traffic, wide);
                    let blocks = log(&bus, &mut draw, 24);
                    let cut = draw.below((bus.nops * bus.drives.len() * 2 + 1) as u64) as usize;
                    let bytes = &written(&blocks[cut..], word)[from..];
                    let want = LogShape { size, word, skip: (size.bytes() - from) % size.bytes() };
                    let guess = LogShape::guess(bytes);
                    let is_exact = word == 1 || from == 0 || traffic == Traffic::Positions;
                    let holds = if is_exact { guess == Ok(want) } else { is_fair(guess, want) };
                    assert!(holds, "{guess:?} for {want:?}: {bus:?}");
                }
            }
        }
    }
}

/// No piece of a log looks like another shape; what is too little to tell by looks like nothing.
#[test]
fn no_piece_of_a_log_looks_like_another_shape() {
    let mut draw = Draw::seeded(27);
    let (mut told, mut pieces) = (0, 0);
    for _ in 0..300 {
        let traffic =
            [Traffic::Positions, Traffic::Standing, Traffic::Speeds, Traffic::Profile][draw.below(4) as usize];
        let (wide, word) = (draw.below(2) == 1, [1, 2, 4][draw.below(3) as usize]);
        let bus = draw_bus(&mut draw, traffic, wide);
        let bytes = written(&log(&bus, &mut draw, 60), word);
        let from = draw.below(3) as usize * draw.below(32) as usize;
        let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
        let want = LogShape { size, word, skip: (size.bytes() - from % size.bytes()) % size.bytes() };
        let len = 32 << draw.below(7);
        for piece in bytes[from..].chunks(len).take(12) {
            let guess = LogShape::guess(piece);
            let is_true = is_fair(guess, want) || guess == Err(ShapeDoubt::Unknown);
            assert!(is_true, "{guess:?} for {want:?} in {} bytes: {bus:?}", piece.len());
            pieces += u32::from(piece.len() == 2_048);
            told += u32::from(piece.len() == 2_048 && guess.is_ok());
        }
    }
    assert!(told * 2 > pieces, "{told} of {pieces}");
}

/// Commands to drives 10, 16 and 26 look like the sub blocks of responses: a few of them do not tell the size.
#[test]
fn a_few_blocks_do_not_tell_what_they_do_not_show() {
    let mut draw = Draw::seeded(29);
    for drive in [10, 16, 26] {
        for word in [1, 2, 4] {
            let (traffic, drives) = (Traffic::Speeds, vec![drive]);
            let bus = Bus { traffic, wide: false, asks: false, twice: false, nops: 4, drives };
            let bytes = written(&log(&bus, &mut draw, 20), word);
            for from in 0..16 {
                let want = LogShape { size: BlockSize::Bytes16, word, skip: (16 - from) % 16 };
                for end in (from + 32..bytes.len()).step_by(16) {
                    let guess = LogShape::guess(&bytes[from..end]);
                    let is_true = is_fair(guess, want) || guess == Err(ShapeDoubt::Unknown);
                    assert!(is_true, "{guess:?} for {want:?} in {} bytes of drive {drive}", end - from);
                }
                // All of them do.
                let guess = LogShape::guess(&bytes[from..]);
                assert!(is_fair(guess, want), "{guess:?} for {want:?} of drive {drive}");
            }
        }
    }
}

/// Two drives whose servos are off, a few blocks after the NOPs of power-up: words of 16 bits and of 32 bits look nearly alike, and the
/// order that begins with a block may see one more. The positions decide.
#[test]
fn a_few_blocks_behind_nops_are_told_by_their_positions() {
    for (word, from) in [(2, 30), (4, 2), (2, 0), (4, 0)] {
        for nops in [0, 8, 60] {
            for count in 9..24_u8 {
                let mut blocks = vec![vec![0; 32]; nops];
                for k in 0..count {
                    let (period, drive) = (k / 4, [3, 9][usize::from(k / 2 % 2)]);
                    let place = -90_000 * i32::from(drive) + 130 * i32::from(period);
                    let mut block = vec![0; 32];
                    block[..2].copy_from_slice(&[(period + 1) % 4 * 32 + drive, 0x20]);
                    block[4..8].copy_from_slice(&place.to_le_bytes());
                    if k % 2 == 0 {
                        block[16] = 0x80;
                    } else {
                        (block[0], block[2]) = (block[0] + 0x80, 0x41);
                        block[4..8].copy_from_slice(&(place - 40).to_le_bytes());
                    }
                    blocks.push(block);
                }
                // One more, of which the beginning is cut; and the log is cut at the length of whole blocks.
                blocks.insert(0, vec![0; 32]);
                let mut bytes = written(&blocks, word)[from..].to_vec();
                bytes.truncate(bytes.len() / 32 * 32);
                let want = LogShape { size: BlockSize::Bytes32, word, skip: (32 - from) % 32 };
                assert_eq!(LogShape::guess(&bytes), Ok(want), "{nops} NOPs and {count} blocks");
            }
        }
    }
}

/// One block in ten is damaged, by one byte or all of them.
#[test]
fn damaged_blocks_do_not_change_the_shape() {
    let mut draw = Draw::seeded(28);
    for log_number in 0..150 {
        let (wide, word) = (draw.below(2) == 1, [1, 2, 4][draw.below(3) as usize]);
        let bus = draw_bus(&mut draw, Traffic::Positions, wide);
        let mut blocks = log(&bus, &mut draw, 60);
        for block in &mut blocks {
            match draw.below(20) {
                0 => block.iter_mut().for_each(|byte| *byte = draw.below(256) as u8),
                1 => block[draw.below(16) as usize] ^= 1 << draw.below(8),
                _ => {}
            }
        }
        let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
        let guess = LogShape::guess(&written(&blocks, word));
        assert_eq!(guess, Ok(LogShape { size, word, skip: 0 }), "{log_number}: {bus:?}");
    }
}
