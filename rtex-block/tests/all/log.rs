//! What a log shows between its blocks, by hand-written bytes.

mod over;

use rtex_block::inspect::{DriveTrouble, LogAnalysis, LogFinding, LogShape, ShapeDoubt, Trouble, Unfinished};
use rtex_block::position::Gear;
use rtex_block::{BlockSize, Code, MacId, UpdateCounter};

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

/// Of drive 5.
fn at_end(what: Unfinished) -> LogFinding {
    LogFinding::AtEnd(MacId::new(5).unwrap(), what)
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
    // What stood for longer than was said is said again when it is over, or at the end.
    let mut log = analysis();
    let goes_on = LogFinding::EchoGoesOn { responses: 4 };
    assert_eq!(findings(&mut log, &still), [(3, stands), (5, goes_on), (7, stands)]);
    assert_eq!(log.end().count(), 0);
    // Three that were said are not said again.
    assert_eq!(findings(&mut log.clone(), &[still[0]]), []);
    assert_eq!(findings(&mut log, &[still[7]; 4]), []);
    assert!(log.end().eq([at_end(Unfinished::Echo { responses: 7 })]));
    let goes_on = LogFinding::EchoGoesOn { responses: 7 };
    assert_eq!(findings(&mut log, &[still[0], still[0], still[1]]), [(0, goes_on)]);
    assert_eq!(log.end().count(), 0);
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
    // A speed is no position, nor is the position after it a step.
    let speeds = [(1, 0x20, 0), (2, 0x30, 900_000), (3, 0x30, -900_000), (0, 0x20, 500_000), (1, 0x20, 500_001)];
    assert_eq!(findings(&mut analysis(), &speeds.map(|(c, code, at)| command(c, code, at))), []);
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
    // Before it has come back it is late at the end.
    for (blocks, want) in [(6, None), (7, None)] {
        let mut log = analysis();
        assert_eq!(findings(&mut log, &late[..blocks]), []);
        assert_eq!(log.end().next(), want);
    }
    let mut log = analysis();
    let never: Vec<_> = (1..=5).flat_map(|k| [command(k % 4, 0x20, 0), response(k % 4, 0x10, 0)]).collect();
    assert_eq!(findings(&mut log, &never), []);
    let code = Code::CYCLIC_POSITION;
    assert!(log.end().eq([at_end(Unfinished::Code { code, responses: 5 })]));
}

/// A drive that stays busy, one that fails while it says Busy, and one that answers to something else.
#[test]
fn requests_without_an_answer() {
    let with = |mut block: [u8; 16], type_code| {
        block[8] = type_code;
        block
    };
    let code = Code::truncate(0x26);
    let busy = |n: u8| -> Vec<[u8; 16]> {
        (1..=n).flat_map(|k| [with(command(k % 4, 0x26, 0), 7), with(response(k % 4, 0x26, 0x10), 7)]).collect()
    };
    let mut log = analysis();
    assert_eq!(findings(&mut log, &busy(3)), []);
    assert_eq!(log.end().count(), 0);
    let mut log = analysis();
    assert_eq!(findings(&mut log, &busy(4)), []);
    assert!(log.end().eq([at_end(Unfinished::Request { code, responses: 4, busy: 4 })]));
    // The master gives up: the normal command, or another request.
    let index = |at: usize| {
        let mut next = with(command(1, 0x26, 0), 7);
        next[at] = 7;
        next
    };
    let others = [with(command(1, 0x26, 0), 8), command(1, 0x2a, 0), index(10), index(11)];
    for next in [command(1, 0x20, 0)].into_iter().chain(others) {
        let mut log = analysis();
        findings(&mut log, &busy(4));
        assert_eq!(findings(&mut log, &[next]), [(0, LogFinding::GivenUp { code, responses: 4, busy: 4 })]);
        assert_eq!(log.end().count(), 0);
        let mut log = analysis();
        findings(&mut log, &busy(3));
        assert_eq!(findings(&mut log, &[with(command(0, 0x20, 0), 8)]), []);
    }
    // Feed-forward in bytes 12-15 is no other request, nor are the flags of byte 9 an answer to one.
    let mut log = analysis();
    findings(&mut log, &busy(4));
    let mut fed = with(command(1, 0x26, 0), 7);
    fed[12] = 1;
    assert_eq!(findings(&mut log, &[fed]), []);
    // ERR ends it, whatever Busy says; so does CMD_Error, whose bytes 8-9 are the error code.
    for last in [with(response(1, 0x26, 0x90), 7), response(1, 0xa6, 0)] {
        let answered = LogFinding::Answered { responses: 5, busy: 4 };
        let mut log = analysis();
        findings(&mut log, &busy(4));
        assert_eq!(findings(&mut log, &[with(command(1, 0x26, 0), 7), last]), [(1, answered)]);
        assert_eq!(log.end().count(), 0);
    }
    // Answers to another type, or with another code, do not belong to this request.
    let mut log = analysis();
    findings(&mut log, &busy(1));
    let others = [with(response(1, 0x26, 0), 6), with(response(2, 0x2a, 0), 7), with(response(3, 0x26, 0), 6)];
    assert_eq!(findings(&mut log, &others), []);
    assert!(log.end().eq([at_end(Unfinished::Request { code, responses: 4, busy: 1 })]));
    // A profile motion is no request.
    let mut log = analysis();
    let motion: Vec<_> = (1..=9).flat_map(|k| [command(k % 4, 0x17, 0), response(k % 4, 0x17, 0x10)]).collect();
    assert_eq!(findings(&mut log, &motion), []);
    assert_eq!(log.end().count(), 0);
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
    let mut log = analysis();
    assert_eq!(findings(&mut log, &nop), []);
    assert_eq!(log.end().count(), 0);
    assert_eq!(findings(&mut log, &[command(1, 0x20, 0), response(1, 0, 0)]), []);
}

/// With Index 0 the read-out of attributes echoes the alarm; history and present alarm echo the index that was asked for.
#[test]
fn attributes_are_no_alarm_codes() {
    let alarm = |mut block: [u8; 16], index: u8, eight: u8| {
        (block[8], block[10], block[11]) = (eight, index, 0x26);
        block[11] *= u8::from(index > 0);
        block[12..].copy_from_slice(&[0x01, 0x01, 0, 0x80]);
        block
    };
    let about = |asked: [u8; 16], answer: [u8; 16]| {
        let mut log = analysis();
        findings(&mut log, &[command(1, 0x20, 0), response(1, 0x20, 0), asked, answer])
    };
    let answered = LogFinding::Answered { responses: 1, busy: 0 };
    let attributes = LogFinding::Attributes { alarm: 0x2601, bits: 0x8000_0101 };
    let (asked, answer) = (command(2, 0x25, 0), response(2, 0x25, 0));
    let ask = |index, eight| alarm(asked, index, eight);
    assert_eq!(about(ask(0, 7), alarm(answer, 1, 7)), [(3, answered), (3, attributes)]);
    assert_eq!(about(ask(0, 7), alarm(answer, 0, 7)), [(3, answered)]);
    assert_eq!(about(ask(1, 7), alarm(answer, 1, 7)), [(3, answered)]);
    // The smallest alarm number.
    let mut first = alarm(answer, 0, 7);
    first[10] = 1;
    assert_eq!(about(ask(0, 7), first), [(3, answered), (3, LogFinding::Attributes { alarm: 1, bits: 0x8000_0101 })]);
    // An answer to another type is an older one, and one that is busy has no data yet.
    assert_eq!(about(ask(0, 7), alarm(answer, 1, 8)), []);
    assert_eq!(about(ask(0, 7), alarm(response(2, 0x25, 0x10), 1, 7)), []);
    // Nor does a monitor value.
    assert_eq!(about(alarm(command(2, 0x2a, 0), 0, 7), alarm(response(2, 0x2a, 0), 1, 7)), [(3, answered)]);
    assert_eq!(attributes.to_string(), "attributes 80000101h of the alarm with index 2601h");
}

/// What a person reads.
#[test]
fn findings_in_words() {
    let code = Code::truncate(0x26);
    let say = |finding: LogFinding| finding.to_string();
    assert_eq!(say(LogFinding::EchoGoesOn { responses: 9 }), "the counter echo goes on after 9 responses");
    assert_eq!(say(LogFinding::AnswersAgain { commands: 5 }), "answers again after 5 commands");
    assert_eq!(
        say(LogFinding::GivenUp { code, responses: 9, busy: 8 }),
        "CP parameter (26h) is given up after 9 responses, 8 of them busy"
    );
    for (what, want) in [
        (Unfinished::Echo { responses: 7 }, "at the end drive 5 has sent the same counter echo in 7 responses"),
        (Unfinished::Silence { commands: 4 }, "at the end drive 5 has not answered the last 4 commands"),
        (
            Unfinished::Request { code, responses: 9, busy: 8 },
            "at the end drive 5 has not answered CP parameter (26h) in 9 responses, 8 of them busy",
        ),
        (
            Unfinished::Code { code, responses: 9 },
            "at the end drive 5 has not sent back CP parameter (26h) in 9 responses",
        ),
    ] {
        assert_eq!(say(at_end(what)), want);
    }
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
    let mut log = analysis();
    let again = LogFinding::AnswersAgain { commands: 4 };
    assert_eq!(findings(&mut log, &blocks), [(7, silent), (9, again), (12, silent)]);
    assert_eq!(log.end().count(), 0);
    assert_eq!(findings(&mut log, &[asked(2)]), []);
    assert!(log.end().eq([at_end(Unfinished::Silence { commands: 4 })]));
    // One that has never answered is said at the end.
    let mut log = analysis();
    assert_eq!(findings(&mut log, &[1, 2, 3, 0].map(asked)), []);
    assert_eq!(log.end().count(), 0);
    // Its first answer is not one that comes again.
    assert_eq!(findings(&mut log, &[answered(0)]), []);
    // After three commands it was said; nothing is longer than that.
    let blocks = [asked(1), answered(1), asked(2), asked(3), asked(0), answered(0)];
    assert_eq!(findings(&mut analysis(), &blocks), [(4, silent)]);
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
        assert_eq!(guess, Ok(LogShape { size: BlockSize::Bytes16, word, skip: 0 }));
        let guess = LogShape::guess(&swapped(&long, word));
        assert_eq!(guess, Ok(LogShape { size: BlockSize::Bytes32, word, skip: 0 }));
    }
    assert_eq!(LogShape::guess(&[0; 256]), Err(ShapeDoubt::Unknown));
    // Four blocks are enough, of which more than half make sense.
    let shape = Ok(LogShape { size: BlockSize::Bytes16, word: 1, skip: 0 });
    assert_eq!(LogShape::guess(&short[..64]), shape);
    let spoilt = |blocks: usize| {
        let mut bytes = short.clone();
        bytes.chunks_mut(16).take(blocks).for_each(|block| block[1] = 0x7f);
        LogShape::guess(&bytes)
    };
    assert_eq!((spoilt(7), spoilt(8)), (shape, Err(ShapeDoubt::Unknown)));
    // Sub blocks that look like main blocks: their counters do not advance, so 32 bytes explain more.
    let like_main = |subs: usize| {
        let mut bytes = long.clone();
        bytes.chunks_mut(32).take(subs).for_each(|block| block[17] = 0x20);
        LogShape::guess(&bytes).map(|shape| shape.size)
    };
    assert_eq!(like_main(10), Ok(BlockSize::Bytes32));
    assert_eq!(like_main(16), Ok(BlockSize::Bytes32));
    assert_eq!(LogShape::guess(&short[..48]), Err(ShapeDoubt::Unknown));
}

/// Seconds of NOPs from before the start say nothing of the shape, and nothing against the one that comes after them: in every size,
/// byte order, and from any byte on.
#[test]
fn a_log_from_power_up() {
    for wide in [false, true] {
        for word in [1, 2, 4] {
            let mut bytes = Vec::new();
            for k in 0..400_u16 {
                let started = k >= 380;
                let mut block =
                    command(if started { k as u8 & 3 } else { 0 }, if started { 0x20 } else { 0 }, 0).to_vec();
                if !started {
                    block[2] = 0;
                }
                if wide {
                    block.extend([0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
                }
                bytes.extend(block.chunks(word).flat_map(|word| word.iter().rev().copied().collect::<Vec<_>>()));
            }
            let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
            assert_eq!(LogShape::guess(&bytes), Ok(LogShape { size, word, skip: 0 }), "{wide} {word}");
            let begins = bytes.len() - 20 * size.bytes();
            assert_eq!(LogShape::guess(&bytes[..begins]), Err(ShapeDoubt::Unknown), "{wide} {word}: NOPs alone");
            // It begins five bytes before a block. Standing positions do not tell turned words from exchanged ones.
            let cut = LogShape::guess(&bytes[begins - 5..]);
            let want = LogShape { size, word, skip: 5 };
            let holds = match cut {
                Err(ShapeDoubt::Either(a, b)) => word > 1 && (a == want || b == want),
                _ => cut == Ok(want),
            };
            assert!(holds, "{wide} {word}: {cut:?}");
        }
    }
}

/// NOPs of a master, and what a drive says to them: its position, speed and torque are whatever they are.
#[test]
fn nops_from_before_the_start_are_no_log_that_begins_inside_a_block() {
    let mut random = 1_u64;
    let mut next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 32).to_le_bytes()
    };
    for log in 0..2000 {
        let mut bytes = Vec::new();
        let place = next();
        for _ in 0..8 {
            let ([a, b, c, d, ..], [e, f, g, h, ..]) = (next(), next());
            bytes.extend([1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            bytes.extend([
                0x81,
                0,
                0x40 | a & 3,
                b & 7,
                place[0],
                place[1],
                place[2],
                place[3],
                a,
                b,
                c,
                d,
                e,
                f,
                g,
                h,
            ]);
        }
        assert_eq!(LogShape::guess(&bytes), Err(ShapeDoubt::Unknown), "{log}");
    }
}

/// An alarm at any time, an echo that stood still, or commands without an answer: none is over with the next block, and each is said
/// of its drive.
#[test]
fn what_somebody_has_to_look_after() {
    let response = |echo: u8, status: u8| {
        let mut block = [0; 16];
        block[..3].copy_from_slice(&[0x85 | echo << 5, 0x20, status]);
        block
    };
    let said =
        |log: &LogAnalysis| log.troubles().map(|it| format!("{} {}", it.mac_id, it.trouble.name())).collect::<Vec<_>>();
    let mut log = LogAnalysis::new(None, Gear::UNITY);
    for k in 0..4 {
        log.block(&command(k, 0x20, 0)).count();
        log.block(&response(k, 0x40)).count();
    }
    assert_eq!(log.troubles().count(), 0);
    for k in 4..8 {
        log.block(&command(k & 3, 0x20, 0)).count();
        log.block(&response(0, 0x40)).count();
    }
    log.block(&response(1, 0x40)).count();
    assert_eq!(said(&log), ["5 sent a counter echo that stood still"]);
    log.block(&response(2, 0x60)).count();
    log.block(&response(3, 0x40)).count();
    let both = ["5 reported an alarm", "5 sent a counter echo that stood still"];
    assert_eq!(said(&log), both);
    // The same again does not undo it.
    log.block(&response(0, 0x60)).count();
    (0..4).for_each(|_| _ = log.block(&response(1, 0x40)).count());
    log.block(&response(2, 0x40)).count();
    assert_eq!(said(&log), both);
    // Two commands may be under way without an answer, three are silence; so is a drive that never answered beside one that does.
    for (commands, silent) in [(2, false), (3, true)] {
        let mut log = LogAnalysis::new(None, Gear::UNITY);
        log.block(&response(0, 0x40)).count();
        (0..commands).for_each(|k| _ = log.block(&command(k, 0x20, 0)).count());
        log.block(&response(1, 0x40)).count();
        let troubles: Vec<_> = log.troubles().collect();
        let want = DriveTrouble { mac_id: MacId::new(5).unwrap(), trouble: Trouble::Silence };
        let want: Vec<_> = [want].into_iter().filter(|_| silent).collect();
        assert_eq!(troubles, want, "{commands}");
        (0..commands).for_each(|k| _ = log.block(&command(k, 0x20, 0)).count());
        log.block(&response(1, 0x40)).count();
        assert!(log.troubles().eq(want), "{commands} twice");
    }
    let mut log = LogAnalysis::new(None, Gear::UNITY);
    let mut other = command(0, 0x20, 0);
    other[0] ^= 2;
    log.block(&other).count();
    assert_eq!(log.troubles().count(), 0);
    log.block(&response(0, 0x40)).count();
    assert_eq!(said(&log), ["7 did not answer"]);
}
