//! When a log that is read line by line is shown, and in which shape; by blocks made here.

use super::*;

#[derive(Default)]
struct Kept(Vec<Event>);

impl Sink for Kept {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        self.0.push(event.clone());
        Ok(())
    }
}

/// A response of drive 5 in cyclic position, with status and speed as they are.
fn response(k: u32, position: i32, in_position: bool, speed: i32) -> [u8; 16] {
    let mut block = [0; 16];
    block[..4].copy_from_slice(&[0x85 | (k % 4 * 32) as u8, 0x20, 0xc0 | u8::from(in_position), 0]);
    block[4..8].copy_from_slice(&position.to_le_bytes());
    block[8..12].copy_from_slice(&speed.to_le_bytes());
    block
}

fn nop() -> [u8; 16] {
    [5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
}

/// Blocks as bytes, with those of each word of so many in the other order.
fn bytes(word: usize, blocks: impl IntoIterator<Item = [u8; 16]>) -> Vec<u8> {
    blocks
        .into_iter()
        .flat_map(|block| block.chunks(word).flat_map(|word| word.iter().rev().copied()).collect::<Vec<_>>())
        .collect()
}

/// A motor that turns, with an actual speed around 0 and a flag that comes and goes; or one that stands, where all is the same.
fn run(from: u32, count: u32, speed: i32) -> impl Iterator<Item = [u8; 16]> {
    (from..from + count).map(move |k| match speed {
        0 => response(k, 0, true, 0),
        _ => response(k, k as i32 * speed, k / 2 % 2 == 0, if k % 3 == 0 { -7 } else { 9 }),
    })
}

/// One of which everything but the position stays.
fn steady(count: u32, speed: i32) -> impl Iterator<Item = [u8; 16]> {
    (1..=count).map(move |k| response(k, k as i32 * speed, false, 9_000))
}

/// Gives a decoder lines of 16 bytes, without a sample; returns its events, and after how many lines there were the first.
fn decoded(bytes: &[u8]) -> (Vec<Event>, Option<usize>) {
    let (mut decoder, mut kept, mut first) = (Decoder::new(settings::Rtex::default(), &[]), Kept::default(), None);
    for (line, bytes) in (1..).zip(bytes.chunks_exact(16)) {
        decoder.burst(&Burst::new(line, bytes.to_vec()), &mut kept).unwrap();
        if first.is_none() && !kept.0.is_empty() {
            first = Some(line as usize);
        }
    }
    decoder.end(&mut kept).unwrap();
    (kept.0, first)
}

fn positions(events: &[Event]) -> Vec<i64> {
    events.iter().filter_map(|event| Some(event.position.as_ref()?.counts)).collect()
}

/// NOPs are held back, and shown with the first sixteen lines that tell the shape.
#[test]
fn sixteen_lines_that_tell_are_enough() {
    for word in [1, 2, 4] {
        let log = bytes(word, core::iter::repeat_n(nop(), 70).chain(run(1, 40, 1_001)));
        let (events, first) = decoded(&log);
        assert_eq!(first, Some(86), "{word}");
        let want: Vec<i64> = (1..=40).map(|k| k * 1_001).collect();
        assert_eq!(positions(&events), want, "{word}");
    }
}

/// Lines that have one of two shapes because they begin with a block wait for what is certain, but not for ever.
#[test]
fn a_log_of_which_nothing_tells_waits() {
    for word in [2, 4] {
        let log = bytes(word, run(1, 1_100, 0));
        assert_eq!(decoded(&log).1, Some(ENOUGH), "{word}");
        // Whatever NOPs were before it.
        for nops in [1, 40, 70, 200] {
            let log = [bytes(word, core::iter::repeat_n(nop(), nops)), log.clone()].concat();
            assert_eq!(decoded(&log).1, Some(nops + ENOUGH), "{word} {nops}");
        }
    }
}

/// A log that goes on in another byte order is read in the first one up to there.
#[test]
fn the_first_piece_decides_for_the_beginning() {
    let log = [bytes(4, run(1, 192, 1_001)), bytes(1, run(193, 400, 1_001))].concat();
    let (events, _) = decoded(&log);
    let shown = positions(&events);
    assert_eq!(shown[..190], (1..=190).map(|k| k * 1_001).collect::<Vec<_>>());
    assert_eq!(shown.last(), Some(&(592 * 1_001)));
    // As a sample, too: the piece that it begins with counts.
    let sample: Vec<Burst> =
        (1..).zip(log.chunks_exact(16)).map(|(line, bytes)| Burst::new(line, bytes.to_vec())).collect();
    let decoder = Decoder::new(settings::Rtex::default(), &sample);
    assert_eq!(decoder.blocks.shape().0.map(|shape| (shape.word, shape.skip)), Some((4, 0)));
}

/// Bytes are lost, and what follows stands: it is taken for blocks that begin with a line until the motor turns, which tells that it is
/// not so.
#[test]
fn what_was_preferred_in_the_middle_gives_way() {
    let turned = bytes(4, run(193, 130, 0).chain(run(323, 400, 1_001)));
    let log = [bytes(1, run(1, 192, 1_001)), turned[2..].to_vec()].concat();
    let (events, _) = decoded(&log);
    let said = |what: &str| events.iter().filter(|event| event.remark && format!("{event:?}").contains(what)).count();
    assert_eq!(
        said("from here on the log looks like"),
        2,
        "{:?}",
        events.iter().filter(|it| it.remark).collect::<Vec<_>>()
    );
    let shown = positions(&events);
    assert_eq!(shown[shown.len() - 200..], (522..=721).map(|k| k * 1_001).collect::<Vec<_>>());
}

/// A log whose last line ends inside a block says so, however little of the block there is; one that ends with a block does not.
#[test]
fn a_cut_last_block_is_said() {
    let log = bytes(1, run(1, 60, 1_001));
    let said = |log: &[u8]| {
        let (events, _) = decoded(log);
        let last = events.last().unwrap();
        last.remark && format!("{last:?}").contains("the log ends in the middle of a block")
    };
    for from in 1..16 {
        assert!(said(&log[from..]), "{from}");
    }
    assert!(!said(&log));
}

/// Bytes are lost twice, and each time the blocks go on over the ends of lines.
#[test]
fn bytes_are_lost_again() {
    let log = [&bytes(1, run(1, 192, 1_001))[4..], &bytes(1, run(193, 400, 1_001))[2..]].concat();
    let (events, _) = decoded(&log);
    let changes = |event: &&Event| format!("{event:?}").contains("from here on the log looks like");
    assert_eq!(events.iter().filter(changes).count(), 1);
    let shown = positions(&events);
    assert_eq!(shown[..180], (2..=181).map(|k| k * 1_001).collect::<Vec<_>>());
    assert_eq!(shown[shown.len() - 200..], (392..=591).map(|k| k * 1_001).collect::<Vec<_>>());
}

/// A refusal names the byte that it is about.
#[test]
fn a_refused_block_names_the_byte() {
    let refused = |bytes: &[u8]| match verdict(&inspect(bytes)) {
        Verdict::Refused(refusal) => (refusal.class, refusal.field),
        Verdict::Ok => panic!("{bytes:02x?}"),
    };
    let mut wide = [0; 32];
    let mut block = |[one, sixteen]: [u8; 2]| {
        (wide[0], wide[1], wide[16]) = (5, one, sixteen);
        wide
    };
    let byte = |number: u8| Some(format!("byte {number}"));
    for (with, class, at) in [
        ([0x50, 0x80], "cyclic_code", 1),
        ([0x23, 0x80], "non_cyclic_code", 1),
        ([0x20, 0x00], "sub_chk", 16),
        ([0x20, 0x81], "sub_command_code", 16),
    ] {
        assert_eq!(refused(&block(with)), (class, byte(at)));
    }
    assert_eq!(refused(&block([0x20, 0x80])[..3]), ("truncated", None));
}

/// A motor that turns by just over 2^16 in each update period, in a log of responses that begins inside a block: the lower half of its
/// position alone moves less than the whole. No wrong position is shown.
#[test]
fn a_fast_motor_is_not_misread() {
    for (word, from) in [(4, 1), (2, 5), (4, 7), (2, 11)] {
        for speed in [65_540, 65_700, 70_001, -65_600, 131_100] {
            let log = bytes(word, steady(700, speed));
            let (events, _) = decoded(&log[from..]);
            let is_wrong = |position: &i64| position % i64::from(speed) != 0;
            let wrong = positions(&events).iter().filter(|position| is_wrong(position)).count();
            assert_eq!(wrong, 0, "{word} {from} {speed}: {:?}", events.first());
        }
    }
}

/// A log that begins inside a block, and in which many blocks are no blocks later: it goes on as it was.
#[test]
fn unsound_blocks_are_no_other_shape() {
    let unsound = |mut block: [u8; 16]| {
        block[1] = if block[0] & 0x60 == 0 { 0x50 } else { block[1] };
        block
    };
    for (word, from) in [(1, 5), (2, 6), (4, 4)] {
        let log = bytes(word, run(1, 192, 1_001).chain(run(193, 400, 1_001).map(unsound)));
        let (events, _) = decoded(&log[from..]);
        let remarks: Vec<_> = events.iter().filter(|event| event.remark).map(|event| format!("{event:?}")).collect();
        assert!(!remarks.iter().any(|remark| remark.contains("from here on")), "{word} {from}: {remarks:?}");
    }
}

/// A line of another length among blocks that go on over the ends of lines costs the two blocks that it is part of, wherever it is; no
/// block is put together from the lines around it.
#[test]
fn a_stray_line_costs_its_two_blocks() {
    let log = &bytes(1, run(1, 200, 1_001))[5..];
    for stray in [1, 2, 30] {
        let (mut decoder, mut kept) = (Decoder::new(settings::Rtex::default(), &[]), Kept::default());
        for (line, bytes) in log.chunks_exact(16).enumerate() {
            let bytes = if line == stray { &bytes[..9] } else { bytes };
            decoder.burst(&Burst::new(line as u64 + 1, bytes.to_vec()), &mut kept).unwrap();
        }
        decoder.end(&mut kept).unwrap();
        let lost = [stray as i64, stray as i64 + 1];
        let want: Vec<i64> = (1..199).filter(|block| !lost.contains(block)).map(|block| (block + 1) * 1_001).collect();
        assert_eq!(positions(&kept.0), want, "{stray}");
    }
}

/// A line that is no bytes costs nothing else where every line begins with a block, even if the lines are longer than one.
#[test]
fn a_spoilt_line_costs_no_other() {
    let (mut decoder, mut kept) = (Decoder::new(settings::Rtex::default(), &[]), Kept::default());
    let line = |number: u64| Burst::new(number, vec![0x55; 20]);
    for number in 1..=ENOUGH as u64 {
        decoder.burst(&line(number), &mut kept).unwrap();
    }
    let before = kept.0.len();
    decoder.spoilt(&mut kept).unwrap();
    decoder.burst(&line(ENOUGH as u64 + 2), &mut kept).unwrap();
    let shown: Vec<_> = kept.0[before..].iter().map(|event| event.place).collect();
    assert_eq!(shown, [Place::Line(ENOUGH as u64 + 2); 2]);
}

/// The order of the bytes changes in a log that begins inside a block: blocks still go on over the ends of lines.
#[test]
fn another_order_begins_no_line() {
    for (before, after) in [(1, 4), (1, 2), (4, 1)] {
        let log = [bytes(before, run(1, 192, 1_001)), bytes(after, run(193, 400, 1_001))].concat();
        let (events, _) = decoded(&log[4..]);
        let shown = positions(&events);
        // The next window of 64 blocks tells.
        let want: Vec<i64> = (260..=591).map(|k| k * 1_001).collect();
        assert_eq!(shown[shown.len() - want.len()..], want, "{before} {after}");
    }
}

/// A motor that stands for longer than a piece of the log, and then turns, in a log that may seem to begin with a block: all is shown in
/// the shape that is told only then.
#[test]
fn what_stands_gives_way_to_what_turns() {
    let place = |k: u32| 70_000 + 1_001 * k.saturating_sub(140) as i32;
    let speed = |k: u32| if k <= 140 { 0 } else { [-7, 9, 9][k as usize % 3] };
    for (word, from) in [(2, 14), (4, 2)] {
        let log = bytes(word, (1..=400).map(|k| response(k, place(k), k <= 140 || k / 2 % 2 == 0, speed(k))));
        let (events, _) = decoded(&log[from..]);
        let want: Vec<i64> = (2..400).map(|k| place(k).into()).collect();
        let shown = positions(&events);
        assert_eq!(shown[..want.len()], want, "{word} {from}");
        assert!(!events.iter().any(|event| format!("{event:?}").contains("from here on")), "{word} {from}");
    }
}

/// Where either of two shapes may be the right one, what is wrong at the end of the log is said of the block that it ends with.
#[test]
fn an_unknown_shape_ends_at_its_last_block() {
    let log = bytes(2, run(1, 60, 0));
    let (events, _) = decoded(&log[5..]);
    // The last of 59 lines holds the end of the 58th whole block, which begins in the line before, and part of the next one.
    let blocks: Vec<_> = events.iter().filter(|event| !event.remark).map(|event| event.place).collect();
    assert_eq!(blocks, (1..=58).map(Place::Line).collect::<Vec<_>>());
    let last = events.last().unwrap();
    assert!(last.remark && format!("{last:?}").contains("the log ends in the middle of a block"), "{last:?}");
    assert_eq!(last.place, Place::Line(58));
    // Bytes have two digits each.
    for event in events.iter().filter(|event| !event.remark) {
        let crate::event::Value::Text(bytes) = &event.fields[0].value else { panic!("{event:?}") };
        assert!(bytes.split(' ').count() == 16 && bytes.split(' ').all(|byte| byte.len() == 2), "{bytes}");
    }
}

/// Commands and responses of drive 5 in turn.
fn exchange(k: u32) -> [[u8; 16]; 2] {
    let answer = response(k, 1_000 * k as i32, k % 5 == 0, 20_000);
    let mut command = [0; 16];
    (command[0], command[1], command[2]) = (answer[0] & 0x7f, 0x20, 0x80);
    command[4..8].copy_from_slice(&answer[4..8]);
    [command, answer]
}

/// Bytes are lost in the middle of a log or six blocks before its end, wherever a window of the shape begins: what is made of the blocks that
/// were cut in the wrong places until that was noticed is no drive, and is said to be none.
#[test]
fn drives_of_misread_blocks_are_not_trusted() {
    let log = bytes(1, (0..240).flat_map(exchange));
    let mut phantoms = 0;
    for (block, count) in (100..180).map(|block| (block, 480)).chain((6..90).map(|rest| (480 - rest, 480))) {
        for lost in [1, 2, 4, 5, 11, 15] {
            let at = 16 * block;
            let log = [&log[..at], &log[at + lost..16 * count]].concat();
            let (events, _) = decoded(&log);
            let said: Vec<_> =
                events.iter().filter(|event| event.remark).map(|event| event.happened.join(" ")).collect();
            let from = |event: &&Event| event.address.is_some_and(|address| address != 5);
            let mut others: Vec<_> =
                events.iter().filter(|event| !event.remark).filter(from).filter_map(|it| it.address).collect();
            others.sort_unstable();
            others.dedup();
            let retracted: Vec<_> =
                events.iter().filter(|event| event.misread).filter_map(|event| event.address).collect();
            assert_eq!(retracted, others, "{block} {lost}: {said:?}");
            phantoms += others.len();
            for what in ["never", "at the end"] {
                assert!(!said.iter().any(|said| said.contains(what)), "{block} {lost}: {said:?}");
            }
        }
    }
    assert!(phantoms > 500, "{phantoms}");
}

/// Lines that have no shape are shown once there are enough of them, and each later one at once.
#[test]
fn what_has_no_shape_is_not_held_twice() {
    let mut noise = 1_u32;
    let mut line = || -> Vec<u8> {
        (0..16)
            .map(|_| {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (noise >> 24) as u8
            })
            .collect()
    };
    let (mut decoder, mut kept) = (Decoder::new(settings::Rtex::default(), &[]), Kept::default());
    let mut at = |number: usize| {
        decoder.burst(&Burst::new(number as u64, line()), &mut kept).unwrap();
        kept.0.iter().filter(|event| !event.remark).count()
    };
    for number in 1..ENOUGH {
        assert_eq!(at(number), 0, "{number}");
    }
    for number in ENOUGH..ENOUGH + 20 {
        assert_eq!(at(number), number);
    }
    // They are read as blocks of 16 bytes in order, and it is nothing new if they are that.
    for (number, block) in (2_000..).zip(run(1, 300, 1_001)) {
        decoder.burst(&Burst::new(number, block.to_vec()), &mut kept).unwrap();
    }
    let remarks: Vec<_> = kept.0.iter().filter(|event| event.remark).collect();
    assert!(remarks.is_empty(), "{remarks:?}");
    assert_eq!(kept.0.last().and_then(|event| event.position.as_ref()).map(|it| it.counts), Some(300 * 1_001));
}

/// Blocks of a size that is given are read without a line before them.
#[test]
fn a_size_that_is_given_needs_no_sample() {
    let settings = settings::Rtex { block_size: Some(32), ..settings::Rtex::default() };
    let (mut decoder, mut kept) = (Decoder::new(settings, &[]), Kept::default());
    for (number, block) in (1..).zip(run(1, 20, 1_001)) {
        decoder.burst(&Burst::new(number, [block, [0; 16]].concat()), &mut kept).unwrap();
    }
    assert_eq!(positions(&kept.0), (1..=20).map(|k| k * 1_001).collect::<Vec<_>>());
}

/// Bytes 2 and 3 are one field of four digits.
#[test]
fn flags_are_one_field() {
    let mut command = response(2, 1_001, true, 9);
    command[0] &= 0x7f;
    for (block, name, raw) in [(response(1, 1_001, true, 9), "Status_Flags", 0xc1), (command, "Control_Bits", 0xc1)] {
        let (events, _) = decoded(&block);
        let flags = events[0].fields.iter().find(|field| field.name == name).unwrap();
        let place = Place::Line(1);
        assert_eq!(flags.span, Some(Span { first: 16, last: 31, place }));
        let crate::event::Value::Flags { raw: read, digits, .. } = flags.value else { panic!("{flags:?}") };
        assert_eq!((read, digits), (raw, 4));
    }
}

/// Where the blocks begin is said, even if it is the second byte.
#[test]
fn where_blocks_begin() {
    let shape = |skip| LogShape { size: rtex_block::BlockSize::Bytes16, word: 1, skip };
    assert_eq!(said(shape(0)), "blocks of 16 bytes");
    assert_eq!(said(shape(1)), "blocks of 16 bytes, the first of which begins at byte 1");
}
