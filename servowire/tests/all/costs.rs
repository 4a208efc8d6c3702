//! What decoding costs at most, however wide or hostile a file is: time of the processor and memory of the program.
//!
//! The figures are read from `/proc` while the program runs, so they are those of the program alone. The limits hold for
//! the slower build of the tests too.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::common;
use crate::common::{Bench, good_traffic};
use flate2::Compression;
use flate2::write::GzEncoder;

/// What a run took.
#[derive(Debug)]
struct Cost {
    code: i32,
    seconds: f64,
    megabytes: f64,
    out: String,
    err: String,
}

/// Runs the program and watches it.
#[expect(clippy::zombie_processes, reason = "it is waited for below, after its figures were read")]
fn cost(arguments: &[&str]) -> Cost {
    let mut child = Command::new(env!("CARGO_BIN_EXE_servowire"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let reading = |mut from: Box<dyn Read + Send>| {
        std::thread::spawn(move || {
            let mut text = String::new();
            from.read_to_string(&mut text).unwrap();
            text
        })
    };
    let out = reading(Box::new(child.stdout.take().unwrap()));
    let err = reading(Box::new(child.stderr.take().unwrap()));
    let folder = format!("/proc/{}", child.id());
    let (mut seconds, mut megabytes) = (0.0_f64, 0.0_f64);
    let code = loop {
        // Until somebody waits for it the figures of an ended program stay.
        let stat = std::fs::read_to_string(format!("{folder}/stat")).unwrap();
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        let ticks: f64 = [fields[11], fields[12]].iter().map(|ticks| ticks.parse::<f64>().unwrap()).sum();
        seconds = seconds.max(ticks / 100.0);
        let status = std::fs::read_to_string(format!("{folder}/status")).unwrap();
        if let Some(peak) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
            let kilobytes: f64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
            megabytes = megabytes.max(kilobytes / 1024.0);
        }
        if fields[0] == "Z" {
            break child.wait().unwrap().code().unwrap();
        }
        sleep(Duration::from_millis(2));
    };
    Cost { code, seconds, megabytes, out: out.join().unwrap(), err: err.join().unwrap() }
}

/// Decodes a file within the limits; prints what it took.
#[track_caller]
fn within(what: &str, path: &Path, options: &[&str], seconds: f64, megabytes: f64) -> Cost {
    let cost = cost(&[&["decode", path.to_str().unwrap()], options].concat());
    println!("{what}: {:.2} s, {:.1} MB", cost.seconds, cost.megabytes);
    assert!(cost.seconds < seconds && cost.megabytes < megabytes, "{what} took {cost:?}");
    cost
}

/// Slower builds may take longer.
const SLOW: f64 = if cfg!(debug_assertions) { 4.0 } else { 1.0 };

fn create(bench: &Bench, name: &str) -> BufWriter<File> {
    BufWriter::new(File::create(bench.path(name)).unwrap())
}

/// Five thousand signals that move all the time, and one line among them.
#[test]
fn five_thousand_signals() {
    let bench = Bench::new();
    let mut file = create(&bench, "wide.vcd");
    writeln!(file, "$timescale 1 ps $end").unwrap();
    for k in 0..5000 {
        writeln!(file, "$var wire 1 s{k} signal{k} $end").unwrap();
    }
    writeln!(file, "$var wire 1 line RS485 $end $enddefinitions $end").unwrap();
    let wave = good_traffic(2.5e6);
    let mut next = 0_i64;
    let mut seed = 1_u32;
    for (time, level) in &wave.edges {
        // Every 10 us all signals toggle or not.
        while next <= *time {
            writeln!(file, "#{next}").unwrap();
            for k in 0..5000 {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                if seed >> 30 != 0 {
                    writeln!(file, "{}s{k}", seed >> 29 & 1).unwrap();
                }
            }
            next += 10_000_000;
        }
        writeln!(file, "#{time}\n{}line", u8::from(*level)).unwrap();
    }
    writeln!(file, "#{}", wave.end + 100_000_000).unwrap();
    file.into_inner().unwrap();
    let cost = within("5,000 signals", &bench.path("wide.vcd"), &["--json"], SLOW, 64.0);
    assert_eq!((cost.code, cost.out.lines().count()), (0, common::GOOD_FRAMES), "{}", cost.err);
}

/// Rows a nanosecond apart hold runs of no protocol; where every channel moves each microsecond, every one may be a line.
#[test]
fn sixty_thousand_columns() {
    let bench = Bench::new();
    for (what, digits, every, few) in [("60,000 columns", 9, 5, 2), ("60,000 columns that may be lines", 6, 2, 1)] {
        let mut file = create(&bench, "wide.csv");
        let mut heading = "Time [s]".to_owned();
        (0..60_000).for_each(|k| write!(heading, ",c{k}").unwrap());
        writeln!(file, "{heading}").unwrap();
        for row in 0..20 {
            let cells: String = (0..60_000).map(|k| if (k * 7 + row) % every < few { ",1" } else { ",0" }).collect();
            writeln!(file, "0.{row:0digits$}{cells}").unwrap();
        }
        file.into_inner().unwrap();
        let cost = within(what, &bench.path("wide.csv"), &[], SLOW, 64.0);
        assert_eq!(cost.code, 1, "{}", cost.out);
    }
}

/// Lines without an end, packed zeros, edges without a pause, names without number.
#[test]
fn hostile_files_are_bounded() {
    let bench = Bench::new();
    for (name, begin) in [
        ("a.vcd", "$timescale 1 ps $end $var wire 1 ! a $end $enddefinitions $end\n#"),
        ("b.csv", "Time [s],Channel 0\n0.0,1\n0.1,0\n"),
        ("c.txt", "1A 20\n1A "),
        ("d.bits", "libsigrok 0.5.2\nAcquisition with 1/1 channels at 20 MHz\nD0:"),
        ("e.ols", ";Rate: 20000000\n;Channels: 1\n"),
    ] {
        let mut file = create(&bench, name);
        file.write_all(begin.as_bytes()).unwrap();
        let ones = vec![b'1'; 1 << 20];
        (0..64).for_each(|_| file.write_all(&ones).unwrap());
        file.into_inner().unwrap();
        let cost = within(&format!("{name}, a line of 64 MB"), &bench.path(name), &[], 2.0 * SLOW, 64.0);
        assert_eq!(cost.code, 1);
        std::fs::remove_file(bench.path(name)).unwrap();
    }
    // 256 MB of nothing in 250 kB.
    let mut packed = GzEncoder::new(create(&bench, "zeros.vcd.gz"), Compression::best());
    packed.write_all(b"$timescale 1 ps $end $var wire 1 ! a $end $enddefinitions $end\n").unwrap();
    let nothing = vec![b'\n'; 1 << 20];
    (0..256).for_each(|_| packed.write_all(&nothing).unwrap());
    packed.finish().unwrap();
    let cost = within("zeros.vcd.gz", &bench.path("zeros.vcd.gz"), &[], 4.0 * SLOW, 64.0);
    assert_eq!(cost.code, 1);
    // Four million edges a picosecond apart.
    let mut file = create(&bench, "noise.vcd");
    writeln!(file, "$timescale 1 ps $end $var wire 1 ! a $end $enddefinitions $end").unwrap();
    (0..4_000_000_u32).for_each(|k| writeln!(file, "#{k}\n{}!", k & 1).unwrap());
    file.into_inner().unwrap();
    assert_eq!(within("noise.vcd", &bench.path("noise.vcd"), &[], 4.0 * SLOW, 64.0).code, 1);
    // Variables without number.
    let mut file = create(&bench, "names.vcd");
    (0..2_000_000_u32).for_each(|k| writeln!(file, "$var wire 1 {k} n{k} $end").unwrap());
    file.into_inner().unwrap();
    assert_eq!(within("names.vcd", &bench.path("names.vcd"), &[], 4.0 * SLOW, 400.0).code, 1);
}

/// Files of some kilobytes that unpack to a quarter of a gigabyte.
#[test]
fn bombs_are_bounded() {
    const MEGABYTES: usize = 257;
    let bench = Bench::new();
    let zeros = vec![0; 1 << 20];
    let metadata = "[device 1]\ncapturefile=logic-1\ntotal probes=8\nsamplerate=20 MHz\nprobe1=D0\nunitsize=1\n";
    let header = "[version]\nversion = 3\n[header]\ndevice mode = 0\ntotal samples = 99999999999\ntotal probes = 1\n\
        samplerate = 20 MHz\nprobe0 = D0\n";
    for (name, small, large) in [
        ("bomb.sr", [("version", "2"), ("metadata", metadata)].as_slice(), "logic-1-1"),
        ("keys.sr", &[("version", "2")], "metadata"),
        ("bomb.dsl", &[("header", header)], "L-0/0"),
    ] {
        let mut zip = zip::ZipWriter::new(create(&bench, name));
        for (entry, text) in small {
            zip.start_file(*entry, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.start_file(large, zip::write::SimpleFileOptions::default()).unwrap();
        (0..MEGABYTES).for_each(|_| zip.write_all(&zeros).unwrap());
        zip.finish().unwrap();
        assert_eq!(within(name, &bench.path(name), &[], 4.0 * SLOW, 64.0).code, 1);
    }
    // Zstandard (RFC 8878): a window of 128 KiB, a raw block with the header, blocks of one byte 131,072 times.
    let mut file = create(&bench, "bomb.vcd.zst");
    let vcd = b"$timescale 1 ps $end $var wire 1 ! a $end $enddefinitions $end\n";
    file.write_all(&[0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3]).unwrap();
    file.write_all(&(vcd.len() as u32 * 8).to_le_bytes()[..3]).unwrap();
    file.write_all(vcd).unwrap();
    for left in (0..MEGABYTES * 8).rev() {
        file.write_all(&(131_072 * 8 + 2 + u32::from(left == 0)).to_le_bytes()[..3]).unwrap();
        file.write_all(b"\n").unwrap();
    }
    file.into_inner().unwrap();
    assert_eq!(within("bomb.vcd.zst", &bench.path("bomb.vcd.zst"), &[], 8.0 * SLOW, 64.0).code, 1);
    // FST packed as a whole: its block says how long it is, and lies.
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    (0..MEGABYTES).for_each(|_| packed.write_all(&zeros).unwrap());
    let packed = packed.finish().unwrap();
    for (name, length) in [("bomb.fst", (MEGABYTES << 20) as u64), ("liar.fst", u64::MAX / 2)] {
        let mut file = create(&bench, name);
        file.write_all(b"\xfe").unwrap();
        file.write_all(&(packed.len() as u64 + 16).to_be_bytes()).unwrap();
        file.write_all(&length.to_be_bytes()).unwrap();
        file.write_all(&packed).unwrap();
        file.into_inner().unwrap();
        // It is read backwards, so it is held in memory, up to 256 MB.
        let cost = within(name, &bench.path(name), &[], 4.0 * SLOW, 320.0);
        assert!(cost.code == 1 && cost.err.contains("more than 256 MB"), "{}", cost.err);
    }
}

/// A million rows that are not what they should be, or all at one time; a quotation mark that is never closed.
#[test]
fn bad_rows_are_bounded() {
    let bench = Bench::new();
    let analyzer = "name,type,start_time,duration,\"data\"\n\"A\",\"data\",0.0001,0.000004,0x1A\n\
        \"A\",\"data\",0.0002,4e-6,0x20\n";
    let sigrok = "libsigrok 0.5.2\nAcquisition with 1/1 channels at 20 MHz\n";
    let isf = ":WFMPRE:ENCDG ASCII;XINCR 1E-7;YMULT 1;:CURVE 1,2,1,2";
    for (name, begin, row) in [
        ("bad.csv", "Time [s],Channel 0\n0.0,1\n0.1,0\n", "oops,1\n"),
        ("back.csv", "Time [s],Channel 0\n0.0,1\n0.1,0\n", "-5,1\n"),
        ("quoted.csv", "Time [s],Channel 0\n0.0,1\n0.1,0\n", "\"0.2,1\n"),
        ("bad-bytes.csv", analyzer, "\"A\",\"data\",0.0003,4e-6,oops\n"),
        ("one-time.csv", analyzer, "\"A\",\"data\",0.0003,4e-6,0x55\n"),
        ("quoted-bytes.csv", analyzer, "\"A\",\"data\",\"0.0003\n"),
        ("many-names.csv", "start_time,\"data\",name\n0.1,0x1A,a\n0.2,0x1B,b\n", "0.3,0x1A,c\n"),
        ("log.txt", "1A 20 29\n1A 20 2A\n", "1A 20 zz\n"),
        ("bad.bits", sigrok, "D0:0101x101\n"),
        ("bad.ols", ";Rate: 20000000\n;Channels: 1\n0@0\n", "zz@5\n"),
        ("bad.isf", isf, ",,,,,,,,"),
        ("steps.isf", isf, ",1e300,-1e300"),
    ] {
        let mut file = create(&bench, name);
        file.write_all(begin.as_bytes()).unwrap();
        (0..1_000_000).for_each(|_| file.write_all(row.as_bytes()).unwrap());
        file.into_inner().unwrap();
        let cost = within(&format!("{name}, a million rows"), &bench.path(name), &[], 3.0 * SLOW, 64.0);
        assert!(cost.out.len() + cost.err.len() < 1 << 20, "{} says {}", name, cost.err.len());
        std::fs::remove_file(bench.path(name)).unwrap();
    }
    let mut file = create(&bench, "line-of-bytes.csv");
    file.write_all(analyzer.as_bytes()).unwrap();
    let ones = vec![b'1'; 1 << 20];
    (0..64).for_each(|_| file.write_all(&ones).unwrap());
    file.into_inner().unwrap();
    let cost = within("bytes, a line of 64 MB", &bench.path("line-of-bytes.csv"), &[], 2.0 * SLOW, 64.0);
    assert_eq!(cost.code, 1, "{}", cost.err);
}
