//! One frame bit by bit, and a whole capture as a report.

use crate::common::{self, Bench, Wave, id3};

/// Good exchanges, one whose check is wrong, a request with a wrong parity bit, and one that nobody answers.
fn damaged() -> Wave {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..5 {
        wave.exchange(&[0x1a], &id3(1000 + k, 0, 0));
    }
    let mut bad = id3(1005, 0, 0);
    bad[5] ^= 1;
    // From 475 us on: the request, 4 us and a pause of 3 later the answer.
    wave.exchange(&[0x1a], &bad);
    // From 566 us on.
    wave.send(&[0x9a]).idle_us(100.0).exchange(&[0x1a], &id3(1007, 0, 0)).send(&[0x1a]).idle_us(100.0);
    wave
}

/// Which bits of the line are marked.
fn marked(text: &str) -> Vec<usize> {
    let row = text.lines().find(|line| line.contains('^')).unwrap_or_default();
    // Ten bits and a space, from column 28 on.
    row.match_indices('^').map(|(at, _)| (at - 28) / 11 * 10 + (at - 28) % 11).collect()
}

#[test]
fn a_frame_bit_by_bit() {
    let bench = Bench::new();
    let (file, svg) = (bench.file("a.vcd", damaged().vcd()), bench.path("a.svg"));
    let explain =
        |at: &str| common::servowire(&["explain", file.to_str().unwrap(), "--at", at, "--svg", svg.to_str().unwrap()]);
    // The second request: 1A, bit 0 first, between start and stop bit.
    let run = explain("112us");
    run.is_good();
    assert!(run.out.contains("channel \"line\", T-Format at 2.5 Mbit/s\nrequest ID 3, 111.000 us to 115.000 us: ok\n"));
    assert!(run.out.contains("__-_--___-\n") && run.out.contains(" 0010110001\n"), "{}", run.out);
    // Its answer, of 110 bits, with all its fields.
    let run = explain("0.13ms");
    run.is_good();
    for words in ["  bit   60  ", "  SF 0\n", "  ABS 1001\n", "  ENID 23\n", "  CRC "] {
        assert!(run.out.contains(words), "{words}: {}", run.out);
    }
    assert!(std::fs::read_to_string(&svg).unwrap().contains("ABS 1001"));
    // Of a parity bit that is wrong just this bit is marked; of a wrong check the field.
    let run = explain("567us");
    assert_eq!(run.code, 1);
    assert!(run.out.contains("REFUSED parity in CF bit 8 at "), "{}", run.out);
    assert_eq!(marked(&run.out), [8], "{}", run.out);
    let run = explain("500us");
    assert!(run.out.contains("REFUSED crc in CRC"), "{}", run.out);
    let check = run.out.lines().find(|line| line.contains('^')).unwrap();
    assert_eq!(check.matches('^').count(), 10, "{}", run.out);
    assert!(std::fs::read_to_string(&svg).unwrap().contains("opacity=\"0.25\" fill=\"#B00020\""));
    // Between two frames the nearest one is shown; before the first one too.
    assert!(
        explain("80us").out.contains("no frame is on the line at 80.000 us; the nearest one:\nanswer ID 3, 27.000 us")
    );
    assert_eq!(explain("soon").code, 2);
    bench.decode("a.txt", "1A\n", &["--bytes"]);
    let log = bench.path("a.txt");
    let run = common::servowire(&["explain", log.to_str().unwrap(), "--bytes", "--at", "1us"]);
    run.fails_with("no frame was found on a line");
}

#[test]
fn a_report_is_one_file_that_says_all() {
    let bench = Bench::new();
    let out = bench.path("report.html");
    let to = out.to_str().unwrap();
    let good = concat!(env!("CARGO_MANIFEST_DIR"), "/../servowire-decode/captures/hpm-sei-master-log.vcd");
    common::servowire(&["report", good, "-o", to]).is_good();
    let page = std::fs::read_to_string(&out).unwrap();
    for words in [
        // By sha256sum.
        "bb1f0821d08f70c0d9478991a34e362decfe09be1816c99f3ac53390a95ad1c6",
        "All frames hold.",
        "idles high, 2.5 Mbit/s",
        "9 requests, 9 answers, 0 others",
        "position ABM, ABS in turns",
        concat!("servowire ", env!("CARGO_PKG_VERSION")),
        "</html>",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // Nothing comes from elsewhere: the only addresses are names of the language of the pictures.
    assert_eq!(page.matches("http").count(), page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count());
    assert!(!page.contains("<script") && !page.contains("Each kind of damage"));
    let file = bench.file("a<b>.vcd", damaged().vcd());
    let run = common::servowire(&["report", file.to_str().unwrap(), "-o", to]);
    assert_eq!(run.code, 1);
    let page = std::fs::read_to_string(&out).unwrap();
    for words in [
        "Each kind of damage, once",
        "crc in CRC",
        "no_response",
        "parity in CF",
        "a&lt;b&gt;.vcd",
        "(single bits were disturbed)",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // Three kinds of damage, each with its picture, beside that of the whole.
    assert_eq!(page.matches("<svg").count(), 4);
    assert!(!page.contains("a<b>"));
    // The capture stays, and what cannot be read is said.
    let same = file.to_str().unwrap();
    assert_eq!(common::servowire(&["report", same, "-o", same]).code, 2);
    assert_eq!(common::servowire(&["report", "-", "-o", to]).code, 2);
    common::servowire(&["report", "/nowhere", "-o", to]).fails_with("cannot be opened");
}
