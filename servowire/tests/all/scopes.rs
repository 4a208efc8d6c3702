//! Tables of oscilloscopes and analysers, written by hand after the layouts that their makers' programs have.

use std::fmt::Write as _;

use crate::common;
use crate::common::{Bench, GOOD_FRAMES, Wave, good_traffic, id3};

/// Samples a second, and the time of the first.
const RATE: f64 = 20e6;
const START: f64 = -1e-4;

/// Voltages of a line with noise, overshoot after its edges, and slow edges.
fn volts() -> Vec<f64> {
    let mut wave = good_traffic(2.5e6);
    wave.idle_us(20.0);
    let (mut out, mut last, mut seed) = (Vec::new(), 3.2_f64, 1_u32);
    for level in wave.samples(RATE) {
        let due = if level { 3.2 } else { 0.1 };
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(seed >> 16) / 65_536.0 * 0.2 - 0.1;
        let overshoot = (due - last) * 0.15;
        last = due;
        out.push(due + overshoot + noise);
    }
    out
}

fn time(k: usize) -> f64 {
    START + k as f64 / RATE
}

/// A heading and a row for each voltage.
fn table(heading: &str, row: impl Fn(usize, f64) -> String) -> String {
    let mut text = heading.to_owned();
    for (k, volts) in volts().into_iter().enumerate() {
        text.push_str(&row(k, volts));
        text.push('\n');
    }
    text
}

#[track_caller]
fn is_read(name: &str, text: &str) {
    let run = Bench::new().decode("scope.csv", text, &["--json"]);
    assert_eq!(run.code, 0, "{name}: {}", run.err);
    assert_eq!(run.json().len(), GOOD_FRAMES, "{name}: {}\n{}", run.err, run.out);
}

#[test]
fn rigol() {
    let heading = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.000000e-04,5.000000e-08\n";
    is_read("DS1000Z", &table(heading, |k, v| format!("{k},{v:.2e},{:.2e},", 0.01)));
    let heading = "Time,X(CH2),\nSecond,Volt,\n";
    is_read("DS1000E", &table(heading, |k, v| format!("{:.4e},{v:.1e},", time(k))));
    is_read("MSO5000 screen", &table("Time(s),CH1(V)\n", |k, v| format!("{:.9e},{v:.3}", time(k))));
    is_read("MSO5000 screen, old", &table("Time(s),CH1V,CH2V\n", |k, v| format!("{:.9e},{v:.3},0.01", time(k))));
    is_read("MSO5000 memory", &table("CH1(V),t0 = -0.0001s, tInc = 5e-08s,\n", |_, v| format!("{v:.4},,,")));
    is_read("DHO memory", &table("CH1V,CH4V,t0=-0.0001,tInc=5e-08\n", |_, v| format!("{v:.4},0.02,,")));
}

/// Stamps of so few digits that most of them repeat.
#[test]
fn times_with_too_few_digits() {
    is_read("five digits", &table("Time(s),CH1(V)\n", |k, v| format!("{:.4e},{v:.3}", 1.0 + time(k))));
}

#[test]
fn siglent() {
    let heading = "Record Length,Analog:14000\nSample Interval,Analog:5.0E-08\nVertical Units,CH1:V CH2:V,,\n\
        Vertical Scale,CH1:1.00 CH2:1.00\nVertical Offset,CH1:0.00 CH2:0.00\nHorizontal Units,s\nHorizontal Scale,5.0E-05\n\
        Model Number,SDS1104X-E\nSerial Number,SDS000000\nSoftware Version,7.1.6.1.33\n\nSource,CH1,CH2\nSecond,Value,Value\n";
    is_read("menu save", &table(heading, |k, v| format!("{:+.7E},{v:+.2E},+4.0E-02", time(k))));
    let heading = "iRecord Length,Analog:14000\nSample Rate,2e7\nVertical Scale,CH1: 0.05\nVertical Offset,CH1: 0.0\n\
        Horizontal Scale,5e-05\nSecond,Volt\n";
    is_read("bin2csv", &table(heading, |k, v| format!("{:.11},{v:.5}", time(k))));
}

#[test]
fn tektronix() {
    let keys = [
        "Record Length,2.500000e+03",
        "Sample Interval,5.000000e-08",
        "Trigger Point,1.250000000000e+03",
        "Trigger Time,0.0",
        ",",
        "Source,CH1",
        "Vertical Units,V",
        "Vertical Scale,1.000000e+00",
        "Vertical Offset,0.0",
        "Horizontal Units,s",
        "Horizontal Scale,2.500000e-04",
        "Pt Fmt,Y",
        "Yzero,0.0",
        "Probe Atten,1.000000e+01",
        "Model Number,TDS2024B",
        "Serial Number,C000000",
        "Firmware Version,FV:v22.01",
    ];
    let row = |k: usize, v: f64| format!("{},,{:.9},  {v:.5},", keys.get(k).unwrap_or(&","), time(k));
    is_read("TDS2000", &table("", row));
    let heading = "Model,MSO2014\nFirmware Version,1.20\n\nWaveform Type,ANALOG,,Waveform Type,DIGITAL\nPoint Format,Y,,Point Format,Y\n\
        Horizontal Units,s,,Horizontal Units,s\nHorizontal Scale,4e-05,,Horizontal Scale,4e-05\nSample Interval,5e-08,,Sample Interval,5e-08\n\
        Record Length,1e+07,,Record Length,1e+07\nGating,0.0% to 100.0%,,Gating,0.0% to 100.0%\nProbe Attenuation,10,,,\n\
        Vertical Units,V,,Threshold Used,1.65\n,,,,\nLabel,line,,Label,,\nTIME,CH1,,TIME,D1,D0\n";
    is_read(
        "MSO2000, two blocks",
        &table(heading, |k, v| format!("{0:.9e},{v:.3},,{0:.9e},{1},0", time(k), u8::from(v > 1.6))),
    );
    is_read("TDS3000, without heading", &table("", |k, v| format!("{:.9},{v:.4}\r", time(k))));
}

#[test]
fn keysight_and_pico() {
    is_read(
        "InfiniiVision",
        &table("x-axis,1,2\nsecond,Volt,Volt\n", |k, v| format!("{:.9E},{v:+.5E},-402.010E-06", time(k))),
    );
    let heading = "Time,Channel A,Channel B\n(us),(V),(V)\n\n";
    is_read("PicoScope", &table(heading, |k, v| format!("{:.8},{v:.8},0.00100000", time(k) * 1e6)));
    let heading = "Zeit;Kanal A\n(μs);(V)\n\n";
    is_read(
        "PicoScope, German",
        &table(heading, |k, v| {
            let volts = if v > 3.7 { "∞".to_owned() } else { format!("{v:.8}") };
            format!("{:.8};{volts}", time(k) * 1e6).replace('.', ",")
        }),
    );
}

#[test]
fn waveforms_and_analysers() {
    let heading = "#Digilent WaveForms Oscilloscope Acquisition\n#Device Name: Discovery2\n#Serial Number: SN:210321000000\n\
        #Date Time: 2025-03-05 15:48:44.807.213.070\n#Sample rate: 2e+07Hz\n#Samples: 20000\n#Trigger: Source: Channel 1\n\n\
        Time (s),Channel 1 (V),Channel 2 (V)\n";
    is_read("WaveForms", &table(heading, |k, v| format!("{:e},{v},0.001", time(k))));
    let heading = "#Digilent WaveForms Logic Analyzer Acquisition\n#Sample rate: 2e+07Hz\n\nTime (s)\tDIO 0\tDIO 1\n";
    is_read("WaveForms logic, tabs", &table(heading, |k, v| format!("{:.9}\t{}\t0", time(k), u8::from(v > 1.6))));
    is_read("Logic 2 analog", &table("Time [s],Channel 1\n", |k, v| format!("{:.9},{v:.3}", time(k))));
    is_read(
        "Logic 2 analog, MSO",
        &table("Trigger [s],Time [s],Ch0,Ch1\n", |k, v| format!("{:.12},{:.12},{v:.6},", time(k), time(k))),
    );
    let heading = "Time[s], Channel 0, Channel 1\n";
    is_read("Kingst", &table(heading, |k, v| format!("{:.15}, {}, 0", time(k), u8::from(v > 1.6))));
    let heading = "; CSV, generated by DSView, sampled on Tue Mar  4 10:00:00 2025\n; Channels (2/16)\n; Sample rate: 20 MHz\n\
        ; Sample count: 20 K Samples\nTime(s), CH0, CH1\n";
    is_read("DSView", &table(heading, |k, v| format!("{:.9},{},0", k as f64 / RATE, u8::from(v > 1.6))));
}

#[test]
fn lecroy_owon_and_rohde() {
    let heading = "LECROYWS424,1234\nSegments,1,SegmentSize,20002\nSegment,TrigTime,TimeSinceSegment1\n\
        #1,04-Mar-2025 10:00:00,0\nTime,Ampl\n";
    is_read("LeCroy", &table(heading, |k, v| format!("{:.9e},{v:.5}", time(k))));
    let mut heading = String::new();
    for key in 0..22 {
        let _ = writeln!(heading, "Key {key};{key}.5");
    }
    is_read("RTH", &table(&heading, |k, v| format!("{:.9e};{v:.4}", time(k)).replace('.', ",")));
    is_read("RTH, with points", &table(&heading, |k, v| format!("{:.9e};{v:.4}", time(k))));
    is_read("RTM", &table("in s,C1 in V\n", |k, v| format!("{:.9e},{v:.4}", time(k))));
    // The last sample comes first.
    let last = volts().len() - 1;
    let rows: Vec<String> = volts()
        .iter()
        .enumerate()
        .map(|(k, v)| format!("{},{:.7},{:.2}\n", last - k, time(k) * 1e3, v * 1e3))
        .collect();
    let text: String = ["#,Time(ms),CH1(mV)\n".to_owned()].into_iter().chain(rows.into_iter().rev()).collect();
    is_read("OWON", &text);
    let run = Bench::new().decode("owon.csv", "Unit:(mV)\n,CH1\nFrequency,1000\n1,3200.0\n2,3201.0\n3,12.0\n", &[]);
    run.fails_with("no table with times or a sample rate");
}

/// A waveform with long words in binary and short ones in ASCII, as the programmer manuals have them.
#[test]
fn tektronix_waveforms() {
    let bench = Bench::new();
    // 40 mV a step around 1.6 V.
    let steps: Vec<i16> = volts().iter().map(|volts| ((volts - 1.6) / 0.04).round() as i16).collect();
    let count = steps.len();
    let preamble = |encoding: &str, bytes: usize| {
        format!(
            ":WFMPRE:BYT_NR {bytes};BIT_NR {};ENCDG {encoding};BN_FMT RI;BYT_OR MSB;NR_PT {count};WFID \"Ch1, DC coupling, \
            1.0E0 V/div; 2500 points\";PT_FMT Y;XINCR 5.0E-8;PT_OFF 0;XZERO -1.0E-4;XUNIT \"s\";YMULT 4.0E-2;YZERO 1.6E0;\
            YOFF 0.0E0;YUNIT \"Volts\"",
            8 * bytes
        )
    };
    let block =
        |data: &[u8]| [format!("#{}{}", data.len().to_string().len(), data.len()).as_bytes(), data, b"\n"].concat();
    let byte: Vec<u8> = steps.iter().map(|step| *step as i8 as u8).collect();
    let word: Vec<u8> = steps.iter().flat_map(|step| step.to_be_bytes()).collect();
    let text = steps.iter().map(i16::to_string).collect::<Vec<_>>().join(",");
    let long = preamble("BINARY", 1);
    let short = long
        .replace("BYT_NR", "BYT_N")
        .replace("ENCDG BINARY", "ENC BIN")
        .replace("XINCR", "XIN")
        .replace("XZERO", "XZE")
        .replace("YMULT", "YMU")
        .replace("YZERO", "YZE")
        .replace("YOFF", "YOF")
        .replace("WFID", "WFI")
        .replace(":WFMPRE:", "");
    for (name, file) in [
        ("long.isf", [format!("{long};:CURVE ").into_bytes(), block(&byte)].concat()),
        ("words.isf", [format!("{};:CURVE ", preamble("BINARY", 2)).into_bytes(), block(&word)].concat()),
        ("short.isf", [format!("{short};:CURV ").into_bytes(), block(&byte)].concat()),
        ("ascii.isf", format!("{};:CURVE {text}\n", preamble("ASCII", 1)).into_bytes()),
    ] {
        let run = bench.decode(name, &file, &["--json"]);
        assert_eq!((run.code, run.json().len()), (0, GOOD_FRAMES), "{name}: {}", run.err);
        assert_eq!(run.json()[0]["channel"], "Ch1");
        // The first request begins 30 us after the first sample.
        let start = run.json()[0]["start_ps"].as_i64().unwrap();
        assert!((start + 70_000_000).abs() < 100_000, "{start}");
        let cut = bench.decode("cut.isf", &file[..file.len() - 5000], &["--json"]);
        assert!(cut.code == 1 && cut.json().len() >= GOOD_FRAMES - 8, "{name}: {}", cut.err);
        assert!(name == "ascii.isf" || cut.err.contains("the waveform was cut off: "), "{name}: {}", cut.err);
    }
    bench.decode("a.isf", format!("{long};"), &[]).fails_with("has no :CURVE after it");
    bench.decode("a.isf", long.replace("XINCR", "X"), &[]).fails_with("has no :CURVE after it");
    bench.decode("a.isf", long.replace("XINCR", "X") + ";:CURVE #15aaaaa", &[]).fails_with("sample interval (XINCR)");
    let pairs = long.replace("PT_FMT Y", "PT_FMT ENV") + ";:CURVE #15aaaaa";
    bench.decode("a.isf", pairs, &[]).fails_with("record without peak detect");
}

/// Bytes of the analysers of Logic 2, with their times: requests and answers of one, or of two for both directions.
#[test]
fn tables_of_analysers() {
    let bench = Bench::new();
    let bit = 0.4e-6;
    let (request, answer) = ([0x1a_u8], common::id3(1000, 7, 0));
    let (mut table, mut pair, mut single, mut dates) = (
        "name,type,start_time,duration,\"data\"\n".to_owned(),
        "name,type,start_time,duration,\"data\",\"error\"\n".to_owned(),
        "Time [s],Value,Parity Error,Framing Error\n".to_owned(),
        "start_time,\"data\"\n".to_owned(),
    );
    for k in 0..20 {
        let begin = 0.5 + 1e-4 * f64::from(k);
        let asked = request.iter().map(|byte| (begin, *byte, "TX"));
        let from = begin + 10.0 * bit + 3e-6;
        let said = answer.iter().enumerate().map(|(k, byte)| (from + 10.0 * bit * k as f64, *byte, "RX"));
        for (time, byte, name) in asked.chain(said) {
            let _ = writeln!(table, "\"Async Serial\",\"data\",{time:.9},{:.9},0x{byte:02X}", 9.5 * bit);
            let _ = writeln!(pair, "\"{name}\",\"data\",{time:e},{:e},0b{byte:08b},", 9.5 * bit);
            let _ = writeln!(single, "{time:.15},0x{byte:02X},,");
            let _ = writeln!(dates, "2025-03-04T10:00:{:012.9}+00:00,{byte:03}", 7.0 + time);
        }
    }
    for (name, text, channel) in [
        ("table.csv", &table, "Async Serial"),
        ("pair.csv", &pair, "TX + RX"),
        ("single.csv", &single, "bytes"),
        ("dates.csv", &dates, "bytes"),
    ] {
        let run = bench.decode(name, text, &["--json"]);
        assert_eq!((run.code, run.json().len()), (0, 40), "{name}: {}", run.err);
        assert!(run.json().iter().all(|event| event["verdict"] == "ok" && event["channel"] == channel), "{}", run.out);
        assert_eq!(run.json()[1]["delay_ps"].as_i64().map(|delay| (delay + 50_000) / 100_000), Some(30), "{name}");
    }
    // What the analyser says of a delimiter is kept; a row that is not one costs a row.
    let lines: Vec<&str> = single.lines().collect();
    let framed = single.replacen(",0xE8,,", ",0xE8,,Error", 1);
    bench.decode("framing.csv", &framed, &[]).fails_with("1 of 40 frames refused: delimiter 1");
    let spoilt = [&lines[..30], &["oops,0x00,,"], &lines[30..]].concat().join("\n");
    let run = bench.decode("spoilt.csv", &spoilt, &["--json"]);
    run.fails_with("line 31: \"oops\" is not a time; 1 row was left out");
    assert_eq!(run.json().len(), 40, "{}", run.err);
    let letters = "Time [s],Value,Parity Error,Framing Error\n0.1,H,,\n0.2,e,,\n";
    bench.decode("ascii.csv", letters, &[]).fails_with("export the table with hexadecimal values");
}

/// The threshold may be said; a wrong one finds nothing.
#[test]
fn a_threshold_of_ones_own() {
    let text = table("Time(s),CH1(V)\n", |k, v| format!("{:.9},{v:.3}", time(k)));
    let bench = Bench::new();
    assert_eq!(bench.decode("a.csv", &text, &["--json", "--threshold", "1.0"]).json().len(), GOOD_FRAMES);
    assert_eq!(bench.decode("a.csv", &text, &["--threshold", "9"]).code, 1);
    let mut rows = String::new();
    let _ = writeln!(rows, "{text}oops,1");
    bench.decode("a.csv", &rows, &[]).fails_with("\"oops\" is not a time; this row was left out");
}

/// Eight lines a column.
#[test]
fn pods() {
    let heading = "X,D7-D0,D15-D8,Start,Increment,\nSequence,Hex,Hex,-1.000000e-04,5.000000e-08\n";
    let text = table(heading, |k, v| format!("{k},0x{:02X},0x3F,", if v > 1.65 { 0x47 } else { 0x07 }));
    is_read("MSO1000Z", &text);
    let run = Bench::new().decode("pod.csv", &text, &["--json", "--channel", "D6"]);
    assert_eq!(run.is_good().json().len(), GOOD_FRAMES);
    Bench::new().decode("pod.csv", &text, &["--channel", "D8"]).fails_with("no traffic on channel \"D8\"");
}

/// Where the line leaves the instrument's range the cell says so, as often as it likes.
#[test]
fn beyond_the_range() {
    let heading = "Zeit;Kanal A\n(\u{3bc}s);(V)\n\n";
    let text = table(heading, |k, v| {
        let volts = if v > 3.1 { "\u{221e}".to_owned() } else { format!("{v:.5}").replace('.', ",") };
        format!("{};{volts}", format!("{:.5}", time(k) * 1e6).replace('.', ","))
    });
    assert!(text.matches('\u{221e}').count() > 1000);
    is_read("PicoScope", &text);
}

/// A line that drifts by three times its swing, as an input coupled by a capacitor does; what a person has said stays.
#[test]
fn a_line_that_drifts() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(200.0);
    for k in 0..400 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
        if k % 50 == 0 {
            wave.idle_us(300.0);
        }
    }
    let samples = wave.samples(25e6);
    let mut text = "Time(s),CH1(V)\n".to_owned();
    for (k, level) in samples.iter().enumerate() {
        let drift = 6.0 * k as f64 / samples.len() as f64;
        writeln!(text, "{:.8},{:.3}", k as f64 / 25e6, f64::from(u8::from(*level)) * 2.0 - drift).unwrap();
    }
    let bench = Bench::new();
    let run = bench.decode("drift.csv", &text, &["--json"]);
    run.is_good();
    assert_eq!(run.json().len(), 800);
    let said = bench.decode("drift.csv", &text, &["--json", "--threshold", "1"]);
    assert!(said.json().len() < 700, "{}", said.json().len());
}
