//! Logs of a few blocks, byte by byte: what decides, and from how much on.

use rtex_block::BlockSize;
use rtex_block::inspect::{LogShape, ShapeDoubt};

const fn shape(size: BlockSize, word: usize, skip: usize) -> LogShape {
    LogShape { size, word, skip }
}

fn bytes(lines: &str) -> Vec<u8> {
    let digits: Vec<u8> = lines.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|two| u8::from_str_radix(core::str::from_utf8(two).unwrap(), 16).unwrap()).collect()
}

/// Three update periods of a drive, each block twice, as it is: pairs of its blocks are 32 bytes long, and every second one could be
/// the sub block of the first, but then fewer make sense.
#[test]
fn six_blocks_that_begin_with_one() {
    let log = "30208000c038f9ff0000000000000000 b000c000c038f9ff60230000f4ffffff
               30208000c338f9ff0000000000000000 b020c000c338f9ff61260000ecffffff
               50208000c638f9ff0000000000000000 d020c000c638f9ff292400000b000000";
    assert_eq!(LogShape::guess(&bytes(log)), Ok(shape(BlockSize::Bytes16, 1, 0)));
}

/// Four commands with exchanged words, and the beginning of a fifth: shapes of other sizes explain them as well, and there is nothing
/// to tell them apart by.
#[test]
fn four_commands_of_which_several_shapes_make_sense() {
    let log = "00000000000000000000000000000000 00800000000000000000000000000000
               2000008073a900000000000000000000 118a0000000000000000000000000000
               2020008073aa00000000000000000000 118a0000000000000000000000000000
               2040008073ab00000000000000000000 118a0000000000000000000000000000
               2060008073ac00000000000000000000 118a00000000000000000000000000";
    assert_eq!(LogShape::guess(&bytes(log)), Err(ShapeDoubt::Unknown));
}

/// Two drives that turn slowly, in exchanged words from byte 11 on: a command is near the response before it.
#[test]
fn commands_and_responses_are_compared() {
    let log = "37ab5d000000000000000000d300c077 b3ab5d25420000ffbaffff2057008003
               850000000000000000000000d700c000 010000249c000000740000205300807b
               38ab5d000000000000000020d300c077 b4ab5d243e0000000900002057008003
               860000000000000000000020d700c000 020000275a000000510000207300807b
               39ab5d000000000000000020f300c077 b5ab5d2a96000000b700002077008003
               870000000000000000000020f700c000 0300002af50000008c0000";
    assert_eq!(LogShape::guess(&bytes(log)), Ok(shape(BlockSize::Bytes16, 2, 11)));
}

/// Turned words that begin inside a NOP. The first response still has the code of the NOP, so the blocks that count begin behind it.
#[test]
fn a_nop_among_the_first_blocks() {
    let log = "00800000000000000000000000000040 008c30769fc200000000000000000000
               00000000000000000000000000000080 202c3077b15a00000000000000000000
               008000000000000000000000000000c0 00ac3077b13200002863ffffffe20000
               00000000000000000000000000000080 204c3078c2ca00000000000000000000
               008000000000000000000000000000c0 20cc3078c2a2000024ee000000c00000
               00000000000000000000000000000080 206c3079d43a00000000000000000000
               008000000000000000000000000000c0 20ec3079d412000026440000009d0000
               0000000000000000000000000000";
    assert_eq!(LogShape::guess(&bytes(log)), Ok(shape(BlockSize::Bytes32, 4, 14)));
}

/// Responses of a drive that is not moved, as words of 16 bits with exchanged bytes from one word inside a block on. In turned words
/// of 32 bits that begin with a block, bytes 2 and 3 would be the upper half of the position. `change` makes each block.
fn exchanged(blocks: usize, change: impl Fn(usize, &mut [u8; 16])) -> Vec<u8> {
    let log = (0..=blocks).flat_map(|k| {
        let mut block = [0; 16];
        block[..3].copy_from_slice(&[0x85 | (k % 4 * 32) as u8, 0x20, 0x40]);
        change(k, &mut block);
        block
    });
    let log: Vec<u8> = log.collect();
    log.chunks(2).flat_map(|word| word.iter().rev()).copied().skip(14).take(16 * blocks).collect()
}

const EXCHANGED: LogShape = shape(BlockSize::Bytes16, 2, 2);
const TURNED: LogShape = shape(BlockSize::Bytes16, 4, 0);

fn is_either(guess: Result<LogShape, ShapeDoubt>) -> bool {
    [(EXCHANGED, TURNED), (TURNED, EXCHANGED)].into_iter().any(|(a, b)| guess == Err(ShapeDoubt::Either(a, b)))
}

/// Where nothing moves, a log is taken to begin with a block. What moves by up to 16 bits does not change that; what moves by more is
/// a reason to doubt, and only what moves by two bits and more a block tells.
#[test]
fn what_moves_decides_between_twins() {
    assert_eq!(LogShape::guess(&exchanged(12, |_, _| {})), Ok(TURNED));
    // IN_POSITION and a step of 1: 17 bits against 1.
    let slight = exchanged(12, |k, block| {
        if k >= 6 {
            (block[2], block[4]) = (0x41, 1);
        }
    });
    assert_eq!(LogShape::guess(&slight), Ok(TURNED));
    // A bit of byte 3 that changes so many times, in every second block, would be as many moves by so many bits.
    let inputs = |bit: u32, changes: usize, blocks| {
        exchanged(blocks, |k, block| {
            block[3] = if (k.saturating_sub(2) / 2).min(changes) % 2 == 1 { 1 << bit } else { 0 }
        })
    };
    assert!(is_either(LogShape::guess(&inputs(5, 1, 12))));
    // 64 points, of not more than 16 blocks, are enough; 62 are not, and 62 are more than four a block.
    assert_eq!(LogShape::guess(&inputs(7, 2, 12)), Ok(EXCHANGED));
    assert!(is_either(LogShape::guess(&inputs(6, 2, 12))));
    // Of 30 blocks, 90 points are too few, and 120 are enough.
    assert!(is_either(LogShape::guess(&inputs(5, 3, 31))));
    assert_eq!(LogShape::guess(&inputs(5, 4, 31)), Ok(EXCHANGED));
    assert_eq!(LogShape::guess(&inputs(5, 12, 31)), Ok(EXCHANGED));
}

/// Responses of a drive that turns, from byte `from` on, with the bytes of each word of so many in the other order.
fn turning(blocks: usize, (word, from): (usize, usize), speed: i32, is_damaged: impl Fn(usize) -> bool) -> Vec<u8> {
    let log = (0..blocks).flat_map(|k| {
        let mut block = [0; 16];
        let code = if is_damaged(k) { 0x50 } else { 0x20 };
        block[..4].copy_from_slice(&[0x85 | (k % 4 * 32) as u8, code, 0xc0, 0]);
        block[4..8].copy_from_slice(&(k as i32 * speed).to_le_bytes());
        block[8..12].copy_from_slice(&9_000_i32.to_le_bytes());
        block
    });
    let log: Vec<u8> = log.collect();
    log.chunks(word).flat_map(|word| word.iter().rev()).copied().skip(from).collect()
}

/// Four of five sound blocks are enough for a log that begins with one, and not for one that begins inside a block.
#[test]
fn nine_of_ten_blocks_of_a_log_that_begins_inside_one_are_sound() {
    let fifth = |k| k % 5 == 4;
    assert_eq!(LogShape::guess(&turning(60, (1, 0), 1_001, fifth)), Ok(shape(BlockSize::Bytes16, 1, 0)));
    assert_eq!(LogShape::guess(&turning(60, (1, 4), 1_001, fifth)), Err(ShapeDoubt::Unknown));
    let twentieth = |k| k % 20 == 4;
    assert_eq!(LogShape::guess(&turning(60, (1, 4), 1_001, twentieth)), Ok(shape(BlockSize::Bytes16, 1, 12)));
}

/// A drive of which only responses are logged, and that turns by just over 2^16 in a period, is where its last step leads: that the
/// lower half of its position moves less is no reason to read it in the other order.
#[test]
fn responses_alone_are_followed_by_their_steps() {
    for (word, from) in [(4, 0), (4, 1), (2, 5), (4, 7), (2, 11)] {
        for speed in [65_540, 70_001, -65_600, 131_100] {
            let guess = LogShape::guess(&turning(64, (word, from), speed, |_| false));
            let want = shape(BlockSize::Bytes16, word, (16 - from) % 16);
            let is_doubt = from > 0 && matches!(guess, Err(ShapeDoubt::Either(a, b)) if a == want || b == want);
            assert!(guess == Ok(want) || is_doubt, "{word} {from} {speed}: {guess:?}");
        }
    }
}
