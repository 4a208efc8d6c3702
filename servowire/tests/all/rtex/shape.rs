//! Size, byte order and beginning of a log.

use std::fmt::Write as _;

use super::{exchanges, hex_log};
use crate::common::{self, Bench};

/// Blocks of 32 bytes in lines of 16, of which one is spoilt: no sub block is taken for a drive.
#[test]
fn long_blocks_in_two_lines() {
    let bench = Bench::new();
    let mut lines = vec!["# main half, sub half".to_owned()];
    for (command, response) in exchanges() {
        for (block, sub) in [(command, 0x8a_u8), (response, 0x0a)] {
            lines.push(format!("{:032x}", u128::from_be_bytes(block)));
            lines.push(format!("{sub:02x}{:030x}", 0));
        }
    }
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let kinds = |run: &common::Run| {
        run.json().iter().map(|event| event["kind"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let run = bench.decode("log.txt", lines.join("\n"), &options);
    assert_eq!(run.is_good().json().len(), 12);
    assert!(kinds(&run).iter().all(|kind| kind.ends_with('5')), "{:?}", kinds(&run));
    for spoilt in [5, 6] {
        let mut lines = lines.clone();
        lines[spoilt].replace_range(3..4, "g");
        let run = bench.decode("log.txt", lines.join("\n"), &options);
        let of_drives: Vec<_> = kinds(&run).into_iter().filter(|kind| kind != "line").collect();
        assert_eq!(of_drives.len(), 11);
        assert!(of_drives.iter().all(|kind| kind.ends_with('5')), "{of_drives:?}");
    }
    lines.pop();
    let run = bench.decode("log.txt", lines.join("\n"), &options);
    assert_eq!(run.json().last().unwrap()["fields"]["note"], "the log ends in the middle of a block");
    // The size that is given wrongly is said.
    let wrong = bench.decode("log.txt", lines.join("\n"), &[&options[..], &["--block-size", "16"]].concat());
    assert!(wrong.err.contains("looks like blocks of 32 bytes; try --block-size"), "{}", wrong.err);
}

/// Words of 16 or 32 bits written the wrong way round are said as such, for the log as a whole.
#[test]
fn logs_with_exchanged_bytes() {
    let bench = Bench::new();
    for (width, want) in [
        (2, "with the bytes of each 16-bit word exchanged"),
        (4, "with the bytes of each 32-bit word in the other order"),
    ] {
        let mut text = String::new();
        for block in exchanges().into_iter().flat_map(|(command, response)| [command, response]) {
            for byte in block.chunks(width).flat_map(|word| word.iter().rev()) {
                write!(text, "{byte:02x}").unwrap();
            }
            text.push('\n');
        }
        let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes"]);
        // The size of the blocks is not in doubt.
        assert!(run.err.contains(want) && !run.err.contains("--block-size"), "{}", run.err);
        // Said once more at the end, as the error that it is: what was shown is not what was sent.
        assert_eq!(run.code, 1);
        assert!(run.err.lines().last().is_some_and(|line| line.ends_with(": pack with shifts")), "{}", run.err);
    }
}

/// Exchanged words of 16 bits and turned words of 32 bits have address, counter and code in the same places, if the log begins inside
/// a block. Where motors stand, nothing tells them apart: then nothing is shown as if it were known.
#[test]
fn a_log_that_may_have_either_of_two_shapes() {
    let bench = Bench::new();
    // The log begins inside a block.
    let standing = |blocks: u8| -> Vec<u8> {
        (1..=blocks)
            .flat_map(|k| [k % 4 * 32 + 5, 0x20, 0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0])
            .collect::<Vec<u8>>()
            .chunks(2)
            .flat_map(|word| [word[1], word[0]])
            .skip(5)
            .collect()
    };
    let lines = |bytes: &[u8]| {
        let mut text = String::new();
        for line in bytes.chunks_exact(16) {
            writeln!(text, "{:032x}", u128::from_be_bytes(line.try_into().unwrap())).unwrap();
        }
        text
    };
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let run = bench.decode("log.txt", lines(&standing(60)), &options);
    assert!(run.code != 0 && run.err.contains("nothing in it tells which"), "{} {}", run.code, run.err);
    let blocks: Vec<_> = run.json().into_iter().filter(|event| event["kind"] == "block").collect();
    assert!(blocks.len() > 50 && blocks.iter().all(|event| event["verdict"] == "shape"), "{:?}", run.verdicts());
    assert!(run.json().iter().all(|event| event["position"].is_null() && event["address"].is_null()));
    // Nor are there figures of a drive.
    let figures = bench.decode("log.txt", lines(&standing(60)), &["--protocol", "rtex", "--bytes", "--stats"]);
    assert!(!figures.out.contains("drive") && !figures.out.contains("address"), "{}", figures.out);
    // However long it goes on, whichever of the two it is, and whether or not a line is as long as a block.
    for (word, size) in [(2, 16), (4, 16), (2, 32), (4, 32)] {
        let bytes: Vec<u8> = (1..=300_u16)
            .flat_map(|k| {
                let mut block = [0; 32];
                (block[0], block[1], block[16]) = ((k % 4 * 32 + 5) as u8, 0x20, 0x80);
                block.into_iter().take(size)
            })
            .collect();
        let read: Vec<u8> = bytes.chunks(word).flat_map(|word| word.iter().rev()).copied().skip(5).collect();
        let run = bench.decode("log.txt", lines(&read), &options);
        assert!(run.code != 0 && run.err.contains("nothing in it tells which"), "{word} {size}: {}", run.err);
        assert!(run.json().iter().all(|event| event["address"].is_null()), "{word} {size}: {:?}", run.verdicts());
    }
    // What follows is told once the motor turns: from there on it is shown.
    let turning: Vec<u8> = (1..=200_u8)
        .flat_map(|k| {
            let place = i32::from(k) * 70_000;
            [(k % 4 * 32 + 5, place), (0x80 | (k % 4 * 32 + 5), place - 900)].map(|(byte0, place)| {
                let [l, ml, mh, h] = place.to_le_bytes();
                [byte0, 0x20, if byte0 < 0x80 { 0x80 } else { 0xc1 }, 0, l, ml, mh, h, 0, 0, 0, 0, 0, 0, 0, 0]
            })
        })
        .flatten()
        .collect::<Vec<u8>>()
        .chunks(2)
        .flat_map(|word| [word[1], word[0]])
        .collect();
    // At once if there is enough of it at the beginning, and then from the first block on; otherwise from where it is seen.
    for (blocks, least) in [(60, 450), (150, 540), (250, 300)] {
        let run = bench.decode("log.txt", lines(&[standing(blocks), turning.clone()].concat()), &options);
        let good = run.json().iter().filter(|event| event["verdict"] == "ok").count();
        assert!(run.code == 1 && good > least, "{blocks}: {} {good} {}", run.code, run.err);
    }
}

/// A bus on which nothing answers is no drive 31.
#[test]
fn a_bus_of_ones() {
    let bench = Bench::new();
    let text = [&*"f".repeat(32); 6].join("\n");
    let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!((run.code, run.verdicts()), (1, vec!["reserved".to_owned(); 6]));
    assert!(run.err.contains("nothing answers on this bus"), "{}", run.err);
    assert!(run.json().iter().all(|event| event["position"].is_null()), "{}", run.out);
}

/// Blocks of 32 bytes are recognised as such: their sub blocks are no drives.
#[test]
fn a_log_of_long_blocks() {
    let bench = Bench::new();
    let mut text = String::new();
    for (command, response) in exchanges() {
        for (block, sub) in [(command, 0x8a_u8), (response, 0x0a)] {
            writeln!(text, "{:032x}{sub:02x}{:030x}", u128::from_be_bytes(block), 0).unwrap();
        }
    }
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!(run.is_good().json().len(), 12);
    assert!(run.json().iter().all(|event| event["kind"].as_str().unwrap().ends_with('5')));
    assert!(run.err.contains("the log looks like blocks of 32 bytes"), "{}", run.err);
    // A block that is cut short, in a line of its own.
    let cut = format!("{}\n{text}", &text[..40]);
    let run = bench.decode("log.txt", cut, &["--protocol", "rtex", "--bytes", "--json"]);
    let first = &run.json()[0];
    assert_eq!((run.json().len(), &first["kind"], &first["verdict"]), (13, &"cmd 5".into(), &"truncated".into()));
    // Too little to tell by, in lines of half a block; but the size is given.
    let halves: String = text.lines().take(2).flat_map(|line| [&line[..32], "\n", &line[32..], "\n"]).collect();
    let run = bench.decode("log.txt", halves, &["--protocol", "rtex", "--bytes", "--json", "--block-size", "32"]);
    assert_eq!(run.is_good().json().len(), 2);
}

/// A log from power-up: seconds of NOPs, and then blocks with the bytes of each word in the other order, or of 32 bytes.
#[test]
fn a_log_from_power_up() {
    let bench = Bench::new();
    for (wide, turned) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut text = String::new();
        let mut put = |block: &[u8], sub: u8| {
            let mut bytes = block.to_vec();
            if wide {
                bytes.push(sub);
                bytes.extend([0; 15]);
            }
            let width = if turned { 4 } else { 1 };
            for byte in bytes.chunks(width).flat_map(|word| word.iter().rev()) {
                write!(text, "{byte:02x}").unwrap();
            }
            text.push('\n');
        };
        for _ in 0..2_000 {
            put(&[5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 0x80);
        }
        for (command, response) in exchanges() {
            put(&command, 0x80);
            put(&response, 0);
        }
        let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
        let said = format!("{wide} {turned}: {}", run.err);
        assert_eq!(run.code, i32::from(turned), "{said}");
        assert!(!turned || run.err.contains("pack with shifts"), "{said}");
        let drives = run.json().iter().filter(|event| event["kind"].as_str().unwrap().ends_with('5')).count();
        assert_eq!(drives, 2_012, "{said}");
    }
}

/// Eight drives from power-up, in blocks of 32 bytes: the first lines after the NOPs, one update period, do not tell the size, so they
/// wait for those that do.
#[test]
fn a_ring_from_power_up() {
    let bench = Bench::new();
    let mut text = String::new();
    for period in 0..90_u8 {
        let (counter, code) = if period < 40 { (0, 0) } else { (period % 4 * 32, 0x20) };
        for drive in 1..=8 {
            for (byte0, sub) in [(counter + drive, 0x80), (0x80 + counter + drive, 0_u8)] {
                let status = if byte0 < 0x80 { 0 } else { 0x40 };
                writeln!(text, "{byte0:02x}{code:02x}{status:02x}{:026x}{sub:02x}{:030x}", 0, 0).unwrap();
            }
        }
    }
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert!(run.code == 0 && !run.err.contains("from here on"), "{} {}", run.code, run.err);
    let kinds: std::collections::BTreeSet<_> = run
        .json()
        .iter()
        .map(|event| event["kind"].as_str().unwrap().to_owned())
        .filter(|kind| kind != "log")
        .collect();
    let want = (1..=8).flat_map(|drive| [format!("cmd {drive}"), format!("rsp {drive}")]).collect();
    assert_eq!(kinds, want);
}

/// Blocks of which the first is cut, and blocks of which five bytes are missing in the middle of the log: what is whole is shown, and the
/// log is said not to be what it was written as.
#[test]
fn a_log_that_begins_or_goes_on_in_the_middle_of_a_block() {
    let bench = Bench::new();
    let bytes: Vec<u8> = (0..40).flat_map(|_| exchanges()).flat_map(|(c, r)| [c, r]).flatten().collect();
    let dump = |bytes: &[u8]| {
        bytes
            .chunks(16)
            .map(|line| line.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}")) + "\n")
            .collect::<String>()
    };
    let of_5 = |run: &common::Run| {
        run.json().iter().filter(|it| it["kind"].as_str().unwrap().ends_with('5') && it["verdict"] == "ok").count()
    };
    for text in [dump(&bytes[5..]), dump(&bytes[..7_680 - 9][5..])] {
        let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
        assert_eq!(run.code, 1, "{}", run.err);
        assert!(run.err.contains("begins in the middle of a block: its first 11 bytes are left out"), "{}", run.err);
        assert!(run.err.contains("looks like blocks of 16 bytes, the first of which begins at byte 11"), "{}", run.err);
        assert!(
            of_5(&run) >= 478 && run.verdicts().iter().all(|it| *it == "ok" || *it == "truncated"),
            "{}",
            of_5(&run)
        );
    }
    let hole = [&bytes[..1_600], &bytes[1_605..]].concat();
    let run = bench.decode(
        "log.bin",
        &hole[..hole.len() / 16 * 16],
        &["--protocol", "rtex", "--record-size", "16", "--json"],
    );
    assert_eq!(run.code, 1);
    assert!(run.err.contains("from here on the log looks like blocks of 16 bytes"), "{}", run.err);
    // 100 blocks before it and what follows the blocks by which it was seen.
    assert!(of_5(&run) > 340, "{}", of_5(&run));
    assert!(!run.err.contains("did not answer"), "{}", run.err);
    // What was made of the 92 blocks from there to the end of the third window of 64 is no drive: its figures are not shown.
    let run = bench.decode("log.bin", &hole, &["--protocol", "rtex", "--record-size", "16", "--stats"]);
    for (drive, frames) in [(3, 52), (4, 40)] {
        let want = format!(
            "  address {drive}\n  misread       {frames} frames, not trusted\n  events        1\n    line       478  drive {drive} is only in \
             blocks that were misread, and is not trusted\n"
        );
        assert!(run.out.contains(&want), "{}", run.out);
    }
    assert!(!run.out.contains("never"), "{}", run.out);
    let run = bench.decode("log.bin", &hole, &["--protocol", "rtex", "--record-size", "16", "--stats", "--json"]);
    let misread: Vec<_> = run.json().iter().map(|it| (it["address"].as_u64(), it["misread"].as_bool())).collect();
    assert_eq!(misread, [(None, None), (Some(3), Some(true)), (Some(4), Some(true)), (Some(5), None)]);
}

/// The words of 32 bits are turned round, and the blocks are shown as they were meant.
#[test]
fn turned_words_are_read() {
    let bench = Bench::new();
    let log = hex_log(&exchanges());
    let turn = |line: &str| {
        line.as_bytes().chunks(8).flat_map(|w| w.chunks(2).rev()).flatten().map(|b| char::from(*b)).collect::<String>()
    };
    let text: String = log.lines().skip(1).map(|line| turn(line) + "\n").collect();
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let (turned, plain) = (bench.decode("log.txt", text, &options), bench.decode("log.txt", log, &options));
    let fields = |run: &common::Run| run.json().iter().map(|it| it["fields"].clone()).collect::<Vec<_>>();
    assert_eq!((turned.code, fields(&turned)), (1, fields(&plain)));
}
