//! Lines drawn for the tests, written as every capture format, and the program run on them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

/// A line as the times, in picoseconds, at which it takes a level.
#[derive(Debug, Clone)]
pub struct Wave {
    pub edges: Vec<(i64, bool)>,
    pub end: i64,
    bit: f64,
    now: f64,
}

impl Wave {
    /// A line that idles high, at a bit rate.
    pub fn new(rate: f64) -> Self {
        Self { edges: vec![(0, true)], end: 0, bit: 1e12 / rate, now: 0.0 }
    }

    pub fn level(&mut self, level: bool, picoseconds: f64) -> &mut Self {
        if self.edges.last().unwrap().1 != level {
            self.edges.push((self.now.round() as i64, level));
        }
        self.now += picoseconds;
        self.end = self.now.round() as i64;
        self
    }

    pub fn idle_us(&mut self, us: f64) -> &mut Self {
        self.level(true, us * 1e6)
    }

    pub fn bits(&mut self, bits: &[bool]) -> &mut Self {
        for &bit in bits {
            self.level(bit, self.bit);
        }
        self
    }

    /// Fields back to back.
    pub fn send(&mut self, bytes: &[u8]) -> &mut Self {
        for byte in bytes {
            self.bits(&field(*byte));
        }
        self
    }

    /// A request, 3 us, its answer, 40 us.
    pub fn exchange(&mut self, request: &[u8], answer: &[u8]) -> &mut Self {
        self.send(request).idle_us(3.0).send(answer).idle_us(40.0)
    }

    /// The other way up.
    pub fn inverted(&self) -> Self {
        let edges = self.edges.iter().map(|(time, level)| (*time, !level)).collect();
        Self { edges, ..self.clone() }
    }

    pub fn vcd(&self) -> String {
        let mut text = "$timescale 1 ps $end\n$scope module m $end\n$var wire 1 ! line $end\n$upscope $end\n\
            $enddefinitions $end\n"
            .to_owned();
        for (time, level) in &self.edges {
            writeln!(text, "#{time}\n{}!", u8::from(*level)).unwrap();
        }
        writeln!(text, "#{}", self.end).unwrap();
        text
    }

    pub fn saleae_csv(&self) -> String {
        let mut text = "Time [s],Channel 0\n".to_owned();
        for (time, level) in self.edges.iter().chain([&(self.end, self.edges.last().unwrap().1)]) {
            writeln!(text, "{}.{:012},{}", time / 1_000_000_000_000, time % 1_000_000_000_000, u8::from(*level))
                .unwrap();
        }
        text
    }

    pub fn saleae_binary(&self) -> Vec<u8> {
        let seconds = |time: i64| (time as f64 / 1e12).to_le_bytes();
        let mut out = b"<SALEAE>".to_vec();
        out.extend(0_i32.to_le_bytes());
        out.extend(0_i32.to_le_bytes());
        out.extend(u32::from(self.edges[0].1).to_le_bytes());
        out.extend(seconds(self.edges[0].0));
        out.extend(seconds(self.end));
        out.extend((self.edges.len() as u64 - 1).to_le_bytes());
        out.extend(self.edges[1..].iter().flat_map(|(time, _)| seconds(*time)));
        out
    }

    pub fn samples(&self, rate: f64) -> Vec<bool> {
        let mut next = self.edges.iter().peekable();
        let mut level = true;
        let count = (self.end as f64 * rate / 1e12) as u64;
        let mut sample = |k: u64| {
            while let Some((_, l)) = next.next_if(|(time, _)| *time as f64 <= k as f64 * 1e12 / rate) {
                level = *l;
            }
            level
        };
        (0..count).map(&mut sample).collect()
    }

    /// One byte a sample, the line in bit `channel`, the others moving in step with each other.
    pub fn raw(&self, rate: f64, channel: u32) -> Vec<u8> {
        let other = |k: usize| if k / 5000 % 2 == 1 { !(1_u8 << channel) } else { 0 };
        self.samples(rate).iter().enumerate().map(|(k, &s)| other(k) | u8::from(s) << channel).collect()
    }

    pub fn packed(&self, rate: f64) -> Vec<u8> {
        self.samples(rate).chunks(8).map(|c| c.iter().rev().fold(0, |byte, &s| byte << 1 | u8::from(s))).collect()
    }
}

pub fn field(byte: u8) -> Vec<bool> {
    [false].into_iter().chain((0..8).map(|k| byte >> k & 1 == 1)).chain([true]).collect()
}

/// Bytes, followed by their XOR.
pub fn sealed(bytes: &[u8]) -> Vec<u8> {
    let crc = bytes.iter().fold(0, |crc, byte| crc ^ byte);
    [bytes, &[crc]].concat()
}

/// ID 3 of a 23-bit encoder.
pub fn id3(abs: u32, abm: u32, almc: u8) -> Vec<u8> {
    let ([a0, a1, a2, _], [m0, m1, m2, _]) = (abs.to_le_bytes(), abm.to_le_bytes());
    sealed(&[0x1a, if almc & 0xf0 == 0 { 0 } else { 0x20 }, a0, a1, a2, 0x17, m0, m1, m2, almc])
}

pub fn id0(abs: u32) -> Vec<u8> {
    let [a0, a1, a2, _] = abs.to_le_bytes();
    sealed(&[0x02, 0, a0, a1, a2])
}

/// Some transactions of all kinds, all good.
pub fn good_traffic(rate: f64) -> Wave {
    let mut wave = Wave::new(rate);
    wave.idle_us(30.0);
    wave.exchange(&[0x92], &sealed(&[0x92, 0, 0x17]));
    for k in 0..6 {
        wave.exchange(&[0x1a], &id3(1000 + 50_000 * k, 7, 0));
    }
    wave.exchange(&[0x02], &id0(4_194_304));
    wave.exchange(&[0x8a], &sealed(&[0x8a, 0, 7, 0, 0]));
    wave.exchange(&[0xba], &sealed(&[0xba, 0, 1, 2, 3]));
    wave.exchange(&sealed(&[0xea, 0x01]), &sealed(&[0xea, 0x01, 0x5a]));
    wave.exchange(&sealed(&[0x32, 0x01, 0x5a]), &sealed(&[0x32, 0x01, 0x5a]));
    wave
}

/// Frames of [`good_traffic`]: a request and an answer each.
pub const GOOD_FRAMES: usize = 24;

/// What a run of the program left.
pub struct Run {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Run {
    pub fn json(&self) -> Vec<Value> {
        self.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// The verdicts of all frames.
    pub fn verdicts(&self) -> Vec<String> {
        self.json().iter().map(|event| event["verdict"].as_str().unwrap().to_owned()).collect()
    }

    #[track_caller]
    pub fn fails_with(&self, sentence: &str) -> &Self {
        assert_eq!(self.code, 1, "{}", self.err);
        assert!(self.err.contains(sentence), "{:?} not in {:?}", sentence, self.err);
        self
    }

    #[track_caller]
    pub fn is_good(&self) -> &Self {
        assert_eq!(self.code, 0, "{}\n{}", self.err, self.out);
        self
    }
}

/// Files for the program, deleted when the test ends.
pub struct Bench(TempDir);

impl Bench {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// `servowire decode` on content under a name, with options.
    pub fn decode(&self, name: &str, content: impl AsRef<[u8]>, options: &[&str]) -> Run {
        decode(&self.file(name, content), options)
    }
}

pub fn decode(path: &Path, options: &[&str]) -> Run {
    servowire(&[&["decode", path.to_str().unwrap()], options].concat())
}

pub fn servowire(arguments: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_servowire")).args(arguments).output().unwrap();
    Run {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}
