//! Broken files end in a sentence and exit code 1, with what came before the break decoded.

use crate::common;
use crate::common::{Bench, GOOD_FRAMES, good_traffic};

#[test]
fn no_file_and_no_content() {
    let bench = Bench::new();
    common::decode(&bench.path("missing.vcd"), &[]).fails_with("cannot be opened: no such file or directory");
    common::decode(&bench.path(""), &[]).fails_with("is a folder");
    for options in [&[][..], &["--rate", "24M"], &["--bytes"], &["--format", "vcd"]] {
        bench.decode("empty.vcd", "", options).fails_with("empty.vcd: the file is empty");
    }
}

#[test]
fn unknown_formats() {
    let bench = Bench::new();
    let run = bench.decode("noise.dat", [0xaa; 100], &[]);
    run.fails_with("begins with the bytes AA AA AA AA AA AA AA AA: no format that is known").fails_with("give --rate");
    let words = "Dear all,\nplease find attached\n";
    bench.decode("letter.doc", words, &[]).fails_with("begins with \"Dear all,\": no format that is known");
    bench.decode("session.sr", b"PK\x03\x04....", &[]).fails_with("not a whole zip file");
    bench.decode("a.csv.xz", b"\xfd7zXZ\0....", &[]).fails_with("packed by xz: unpack it first");
    bench.decode("a.raw", [0; 100], &["--format", "packed"]).fails_with("give it with --rate");
}

#[test]
fn a_sample_rate_for_a_file_that_has_times() {
    let bench = Bench::new();
    let run = bench.decode("a.vcd", good_traffic(2.5e6).vcd(), &["--rate", "5M"]);
    run.fails_with("--rate is for raw samples, --bit-rate for the rate of the line");
}

#[test]
fn vcd_cut_off() {
    let bench = Bench::new();
    let text = good_traffic(2.5e6).vcd();
    let header = &text[..60];
    bench.decode("header.vcd", header, &[]).fails_with("line 3: the file ends in the header: it was cut off");
    bench.decode("header.vcd", &text[..text.find("$enddef").unwrap()], &[]).fails_with("before $enddefinitions");
    // After the value of a change, before its code.
    let middle = text.rfind("1!").unwrap() + 1;
    let run = bench.decode("change.vcd", &text[..middle], &["--json"]);
    run.fails_with("the file ends in the middle of a value change");
    assert!(run.json().len() >= GOOD_FRAMES - 2, "{}", run.out);
    // Between two changes the file is sound, but not the frame.
    let half = text[..text.len() / 2].rfind('#').unwrap();
    bench
        .decode("half.vcd", &text[..half], &["--json"])
        .fails_with("truncated 1 (the file was cut off, or recording stopped there)");
}

#[test]
fn vcd_damaged() {
    let bench = Bench::new();
    let text = good_traffic(2.5e6).vcd();
    let run = bench.decode("a.vcd", text.replacen("1!\n#", "Q!\n#", 5), &[]);
    run.fails_with("not VCD in the middle of a value change: unexpected character");
    let back = text.replace("#49000000\n", "#5\n");
    assert!(back != text);
    bench.decode("back.vcd", back, &["--json"]).fails_with("time goes back from #");
    bench.decode("a.vcd", text.replace("$var wire 1", "$var real 1"), &[]).fails_with("no variable of one bit");
    bench
        .decode("a.vcd", text.replace("$enddefinitions $end", ""), &[])
        .fails_with("value changes before $enddefinitions");
    bench
        .decode("a.vcd", text.replace("$timescale 1 ps", "$timescale 1 parsec"), &[])
        .fails_with("not VCD in the header");
    let deep = format!("{}{}", "$scope module m $end\n".repeat(200_000), "$enddefinitions $end\n");
    bench.decode("deep.vcd", deep, &[]).fails_with("no variable of one bit");
    bench.decode("a.vcd", text.replace("#30000000\n", "#99999999999999999999\n"), &[]).fails_with("not VCD");
    bench.decode("a.vcd", text.replace("1 ps", "1 s"), &[]).fails_with("runs at about 0.000000 Mbit/s");
}

#[test]
fn channels_that_are_not_there() {
    let bench = Bench::new();
    let run = bench.decode("a.vcd", good_traffic(2.5e6).vcd(), &["--channel", "RX"]);
    run.fails_with("no channel \"RX\"; the file has \"line\"");
    let run = bench.decode("a.csv", good_traffic(2.5e6).saleae_csv(), &["--channel", "5"]);
    run.fails_with("no channel \"5\"; the file has \"Channel 0\"");
}

#[test]
fn csv_damaged() {
    let bench = Bench::new();
    let text = good_traffic(2.5e6).saleae_csv();
    let rows: Vec<&str> = text.lines().collect();
    let with = |k: usize, row: &str| {
        let mut rows = rows.clone();
        rows[k] = row;
        rows.join("\n")
    };
    for (row, sentence) in [
        ("oops,1", "line 300: \"oops\" is not a time; this row was left out"),
        ("0.001,y", "line 300: \"y\", where a level is 0 or 1"),
        ("0.001", "line 300: the row has 1 columns, the heading 2"),
        ("0.0000001,1", "line 300: time goes back from"),
    ] {
        let run = bench.decode("a.csv", with(299, row), &["--json"]);
        run.fails_with(sentence);
        assert!(run.json().len() > 5, "what came before is decoded: {}", run.out);
    }
    // Without a name the column that grows is the time; where none does, there is no time.
    bench.decode("a.csv", with(0, "a,b"), &[]).is_good();
    bench.decode("a.csv", "a,b\n1,0\n1,1\n1,0\n", &[]).fails_with("no table with times or a sample rate");
    bench.decode("a.csv", "Time [s],Channel 0\n", &[]).fails_with("no column of levels");
    bench.decode("a.csv", with(5, "2024-01-01T00:00:00,1"), &[]).fails_with("is not a time; this row was left out");
    // Two rows are two rows, and all others are read.
    let two = with(5, "oops,1").replacen(rows[9], "oops,0", 1);
    bench.decode("a.csv", two, &[]).fails_with("line 6: \"oops\" is not a time; 2 rows were left out");
}

#[test]
fn saleae_binary_damaged() {
    let bench = Bench::new();
    let good = good_traffic(2.5e6).saleae_binary();
    let run = bench.decode("a.bin", &good[..good.len() - 100], &["--json"]);
    run.fails_with("it was cut off");
    assert!(run.json().len() > 10);
    bench
        .decode("a.bin", &good[..30], &[])
        .fails_with("byte 30: ends in the header of its transitions: it was cut off");
    let with = |at: usize, bytes: &[u8]| {
        let mut out = good.clone();
        out[at..at + bytes.len()].copy_from_slice(bytes);
        out
    };
    bench.decode("a.bin", with(8, &[2, 0, 0, 0]), &[]).fails_with("is of version 2: only 0 and 1 are known");
    bench.decode("a.bin", with(12, &[100, 0, 0, 0]), &[]).fails_with("is the inside of a .sal capture");
    bench.decode("a.bin", with(12, &[1, 0, 0, 0]), &[]).fails_with("is not a digital channel");
    bench.decode("a.bin", with(20, &f64::NAN.to_le_bytes()), &[]).fails_with("begin or end is not a time");
    bench.decode("a.bin", with(44 + 80, &f64::INFINITY.to_le_bytes()), &[]).fails_with("byte 124: transition is not");
    bench.decode("a.bin", with(44 + 80, &0_f64.to_le_bytes()), &[]).fails_with("byte 124: time goes back");
}

#[test]
fn raw_damaged() {
    let bench = Bench::new();
    let raw = good_traffic(2.5e6).raw(20e6, 0);
    let odd = &raw[..raw.len() / 2 * 2 - 1];
    bench
        .decode("a.raw", odd, &["--rate", "20M", "--unit-size", "2"])
        .fails_with("1 bytes are left over, but a sample has 2");
    let slow = good_traffic(2.5e6).raw(8e6, 0);
    bench.decode("slow.raw", slow, &["--rate", "8M"]).fails_with("3.2 samples per bit are too few");
    bench
        .decode("flat.raw", [0xff; 5000], &["--rate", "20M"])
        .fails_with("no traffic: at most 0 edges on any of 8 channels");
}

#[test]
fn hex_damaged() {
    let bench = Bench::new();
    let run = bench.decode("a.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n1G\n", &["--bytes", "--json"]);
    // A wrong digit costs its line.
    assert_eq!((run.code, run.json().len()), (1, 3));
    assert_eq!(run.verdicts().last().map(String::as_str), Some("hex"));
    assert!(run.out.contains("\\\"1G\\\" is not bytes in hex"), "{}", run.out);
    // Where no line before was one of bytes, the file is no log.
    bench.decode("a.txt", "time\n1A\n", &["--bytes"]).fails_with("line 1: \"time\" is not bytes in hex");
    bench.decode("a.txt", "A".repeat(100_000), &["--bytes"]).fails_with("a line of more than 65536 characters");
    bench.decode("a.txt", "# nothing\n", &["--bytes"]).fails_with("no frame in it");
}

#[test]
fn wrong_use() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    for options in [
        &["--rate", "fast"][..],
        &["--jump", "10"],
        &["--unit-size", "9"],
        &["--nonsense"],
        &["--bytes", "--rate", "1M"],
        &["--protocol", "morse"],
    ] {
        assert_eq!(bench.decode("a.vcd", wave.vcd(), options).code, 2, "{options:?}");
    }
    assert_eq!(common::servowire(&["decode", "--vcd", "out.vcd"]).code, 2);
}

#[test]
fn sigrok_text_whose_channels_differ() {
    let bench = Bench::new();
    let head = "libsigrok 0.5.2\nAcquisition with 2/2 channels at 1 MHz\n";
    let run = bench.decode("a.bits", format!("{head}D0:11111111 0000\nD1:1111\nD0:1111\nD1:0000\n"), &[]);
    run.fails_with("the lines of a round have different numbers of samples");
    let run = bench.decode("a.bits", format!("{head}D0:1111\nD1:1111\nD0:1111\nD0:0000\n"), &[]);
    run.fails_with("line 6: a channel occurs twice in one round of lines");
    let many = (0..2000).map(|k| format!("D{k}:1111\n")).collect::<Vec<_>>().concat();
    bench.decode("a.bits", format!("{head}{many}"), &[]).fails_with("more than 1024 channels");
}

#[test]
fn fst_whose_lengths_lie() {
    let bench = Bench::new();
    let mut header = vec![0; 330];
    header[7..9].copy_from_slice(&329_u16.to_be_bytes());
    let with = |block: &[u8]| [&header, block].concat();
    // A block without a length would be read again and again.
    bench.decode("a.fst", with(&[1, 0, 0, 0, 0, 0, 0, 0, 0]), &[]).fails_with("incomplete: a block ends beyond");
    bench.decode("a.fst", with(&[1, 0, 0, 0, 0, 0, 0, 1, 0]), &[]).fails_with("incomplete: a block ends beyond");
    let number = |n: u64| n.to_be_bytes();
    let variables = [&[3][..], &number(24), &number(1 << 60), &number(1 << 60)].concat();
    bench.decode("a.fst", with(&variables), &[]).fails_with("a list of variables is longer than its block can hold");
    let times = [&[1][..], &number(8 + 24 + 24), &[0; 24], &number(1), &number(1), &number(1 << 60)].concat();
    bench.decode("a.fst", with(&times), &[]).fails_with("a table of times is longer than its block can hold");
}

#[test]
fn a_log_of_a_can_bus() {
    let bench = Bench::new();
    for text in ["  can0  123   [8]  11 22 33 44 55 66 77 88\n", "(1436509052.249713) can0 123#1122334455\n"] {
        bench.decode("can.log", text, &[]).fails_with("a log of a CAN bus (candump): none of the protocols");
    }
}

/// Packed files that are not whole: what can be unpacked is decoded, and the cut is told.
#[test]
fn packed_files_cut_off() {
    use std::io::Write as _;
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    for k in 0..2000 {
        wave.exchange(&[0x1a], &common::id3(77_777 * k, k, 0));
    }
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(wave.vcd().as_bytes()).unwrap();
    let packed = packer.finish().unwrap();
    let run = bench.decode("a.vcd.gz", &packed[..packed.len() / 2], &["--json"]);
    run.fails_with("its packed content ends too early: it was cut off");
    assert!(run.json().len() > 1000, "{}", run.json().len());
    bench.decode("b.vcd.gz", &packed[..60], &[]).fails_with("it was cut off");
    let zstd = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/samples/hpm-uart.vcd.zst")).unwrap();
    bench.decode("c.vcd.zst", &zstd[..zstd.len() / 2], &[]).fails_with("it was cut off");
}
