//! Lines that are not like the others, in logs whose shape has to be found.

use crate::common::{Bench, Run};

const OPTIONS: [&str; 4] = ["--protocol", "rtex", "--bytes", "--json"];

/// Drive 5 in cyclic position: command and response of an update period in which the motor turns.
fn period(k: u16) -> [[u8; 16]; 2] {
    let counter = (k % 4 * 32) as u8;
    let [l, ml, mh, h] = (i32::from(k) * 70_000).to_le_bytes();
    [
        [counter + 5, 0x20, 0x80, 0, l, ml, mh, h, 0, 0, 0, 0, 0, 0, 0, 0],
        [counter + 0x85, 0x20, 0xc1, 0, l, ml, mh, h, 0, 0, 0, 0, 0, 0, 0, 0],
    ]
}

/// A log of a line a block, with the bytes of each word of so many in the other order.
fn lines(word: usize, blocks: impl IntoIterator<Item = Vec<u8>>) -> Vec<String> {
    let digits = |block: Vec<u8>| {
        block
            .chunks(word)
            .flat_map(|word| word.iter().rev())
            .fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
    };
    blocks.into_iter().map(digits).collect()
}

fn turning(periods: u16) -> impl Iterator<Item = Vec<u8>> {
    (1..=periods).flat_map(period).map(Vec::from)
}

fn of_5(run: &Run) -> usize {
    run.json().iter().filter(|it| it["kind"].as_str().unwrap().ends_with(" 5") && it["verdict"] == "ok").count()
}

/// A line that is cut short or spoilt, in a log of turned words: the shape of the others is found all the same, and they are shown.
#[test]
fn a_short_line_does_not_hide_the_shape() {
    let bench = Bench::new();
    for at in [0, 1, 7] {
        let mut log = lines(4, turning(30));
        log[at].truncate(14);
        let run = bench.decode("log.txt", log.join("\n"), &OPTIONS);
        assert!(run.err.contains("pack with shifts"), "{at}: {}", run.err);
        assert_eq!(of_5(&run), 59, "{at}: {:?}", run.verdicts());
    }
}

/// Long after the beginning a block of a log of a line a block is cut short: its drive is named.
#[test]
fn a_cut_block_names_its_drive() {
    let bench = Bench::new();
    let mut log = lines(1, turning(1_500));
    log[2_900].truncate(20);
    let run = bench.decode("log.txt", log.join("\n"), &OPTIONS);
    let bad: Vec<_> = run.json().into_iter().filter(|event| event["verdict"] != "ok").collect();
    assert_eq!((bad.len(), &bad[0]["kind"], &bad[0]["verdict"]), (1, &"cmd 5".into(), &"truncated".into()), "{bad:?}");
}

/// One longer line in a log that begins inside a block: it alone is of another length than the others.
#[test]
fn a_longer_line_is_one_line() {
    let bench = Bench::new();
    let bytes = turning(40).flatten().skip(5).collect::<Vec<_>>();
    let mut log = lines(1, bytes.chunks_exact(16).map(Vec::from));
    log[9].push_str("00000000");
    let run = bench.decode("log.txt", log.join("\n"), &OPTIONS);
    let stray: Vec<_> = run.json().into_iter().filter(|event| event["kind"] == "line").collect();
    assert!(stray.len() == 1 && stray[0]["verdict"] == "too_long", "{stray:?}");
    assert!(of_5(&run) > 74 && run.err.contains("begins in the middle of a block"), "{} {}", of_5(&run), run.err);
}

/// After the NOPs of power-up four blocks are left, which a look at the log in pieces of 2,048 bytes from its beginning sees two and
/// two.
#[test]
fn the_few_blocks_after_the_nops_are_seen_together() {
    let bench = Bench::new();
    let nops = (0..126).map(|_| [&[5][..], &[0; 15]].concat());
    let log = lines(4, nops.chain(turning(2)));
    let run = bench.decode("log.txt", log.join("\n"), &OPTIONS);
    assert!(run.err.contains("pack with shifts") && of_5(&run) == 130, "{} {}", of_5(&run), run.err);
}

/// Blocks of 16 bytes, and then of 32, of which every second half is no block: from there on they are read as such. If the size was
/// given, it stays.
#[test]
fn blocks_that_become_longer() {
    let bench = Bench::new();
    let wide = (1..=200).flat_map(period).flat_map(|block| {
        let sub = [&[if block[0] < 0x80 { 0x80 } else { 0 }][..], &[0; 15]].concat();
        [Vec::from(block), sub]
    });
    let log = lines(1, turning(100).chain(wide)).join("\n");
    let run = bench.decode("log.txt", &log, &OPTIONS);
    assert!(run.err.contains("from here on the log looks like blocks of 32 bytes (line 320)"), "{}", run.err);
    // Nobody says so: it is no frame.
    let figures = bench.decode("log.txt", &log, &[&OPTIONS[..], &["--stats"]].concat()).json();
    let [nobodys, drives @ ..] = &figures[..] else { panic!() };
    assert!(nobodys["events"][0]["what"].as_str().unwrap().starts_with("from here on"), "{nobodys}");
    assert_eq!(["requests", "answers", "others"].map(|frames| nobodys[frames].as_u64()), [Some(0); 3]);
    assert!(!drives.is_empty() && drives.iter().all(|own| own["address"].is_number()), "{figures:?}");
    let given = bench.decode("log.txt", &log, &[&OPTIONS[..], &["--block-size", "16"]].concat());
    assert!(!given.err.contains("from here on"), "{}", given.err);
    assert_eq!(given.json().iter().filter(|event| event["kind"] != "log").count(), 1_000);
}

/// Numbers of two and of four digits, as they are shown.
#[test]
fn type_codes_and_indices() {
    let bench = Bench::new();
    // A parameter write of Pr7.20, and a monitor command of APOS.
    let log = "25260000000000001100140705000000\n252a0000000000000700000000000000\n45260000000000001100ff0005000000\n\
               65260000000000001100000105000000\n";
    let run = bench.decode("log.txt", log, &["--protocol", "rtex", "--bytes"]);
    assert!(run.out.contains("Type_Code 11  Index 0714"), "{}", run.out);
    assert!(run.out.contains("Type_Code 07  Index 00 "), "{}", run.out);
    assert!(run.out.contains("Index FF ") && run.out.contains("Index 0100"), "{}", run.out);
    // The code comes first, then the control bits, then the data.
    let places = ["Command_Code ", "Control_Bits ", "Type_Code 11"].map(|name| run.out.find(name).unwrap());
    assert!(places.is_sorted(), "{}", run.out);
}
