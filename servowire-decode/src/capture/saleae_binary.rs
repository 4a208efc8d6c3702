//! Saleae Logic 2 binary export, versions 0 and 1: one digital channel per file, little endian.
//!
//! ```text
//! 0   "<SALEAE>"
//! 8   i32 version          12  i32 type (0 = digital)
//! 0:  16  u32 first level  20  f64 begin  28  f64 end  36  u64 number of transitions  44  f64 times in seconds
//! 1:  16  u64 number of chunks, each: u32 first level, f64 sample rate, f64 begin, f64 end, u64 number, f64 times
//! ```
//! Time between two chunks was not recorded.

use std::path::Path;

use super::input::Input;
use super::recording::{Change, Hole, Line};
use crate::fault::{At, Fault};
use crate::time::{self, Time};

/// Changes returned at once.
const BLOCK: usize = 4096;
/// Bytes of the header before the first chunk, and of the header of a chunk.
const HEADER: usize = 16;
const CHUNK: usize = 28;

/// A binary export after its header.
pub struct SaleaeBinary {
    input: Input,
    channel: [String; 1],
    /// Whether chunks give their sample rate.
    rates: bool,
    chunks: u64,
    level: bool,
    end: Time,
    now: Option<Time>,
    announced: u64,
    read: u64,
    at: u64,
    hole: Option<Hole>,
    over: bool,
}

impl SaleaeBinary {
    /// Reads the header.
    pub fn new(mut input: Input) -> Result<Self, Fault> {
        let mut header = [0; HEADER];
        let got = input.read_full(&mut header, HEADER).map_err(|e| input.io_fault(At::Byte(0), &e))?;
        if !header.starts_with(b"<SALEAE>") {
            return Err(input.fault(At::Byte(0), "does not begin with <SALEAE>: not a Saleae binary export"));
        }
        if got < HEADER {
            return Err(input.fault(At::Byte(got as u64), "ends in its header: it was cut off"));
        }
        let mut rest = header.as_slice();
        let _identifier: [u8; 8] = take(&mut rest);
        let version = i32::from_le_bytes(take(&mut rest));
        let kind = i32::from_le_bytes(take(&mut rest));
        if !(0..=1).contains(&version) {
            let what = format!("is of version {version}: only 0 and 1 are known; export as CSV or VCD");
            return Err(input.fault(At::Byte(8), what));
        }
        match kind {
            0 => {}
            100 | 101 => {
                let what = "is the inside of a .sal capture, which is not published: export raw data as CSV or binary";
                return Err(input.fault(At::Byte(12), what));
            }
            _ => {
                return Err(input.fault(
                    At::Byte(12),
                    "is not a digital channel: export the digital ones, or the analog ones as CSV",
                ));
            }
        }
        let name =
            Path::new(input.name()).file_stem().map_or_else(|| "line".into(), |s| s.to_string_lossy().into_owned());
        let mut file = Self {
            input,
            channel: [name],
            rates: version == 1,
            chunks: 1,
            level: true,
            end: Time::ZERO,
            now: None,
            announced: 0,
            read: 0,
            at: HEADER as u64,
            hole: None,
            over: false,
        };
        if version == 1 {
            file.chunks = u64::from_le_bytes(file.bytes("ends in its header")?);
        }
        Ok(file)
    }

    /// Returns the next bytes of the file.
    fn bytes<const N: usize>(&mut self, missing: &str) -> Result<[u8; N], Fault> {
        let mut raw = [0; N];
        let at = At::Byte(self.at);
        let got = self.input.read_full(&mut raw, N).map_err(|e| self.input.io_fault(at, &e))?;
        if got < N {
            let at = At::Byte(self.at + got as u64);
            return Err(self.input.fault(at, format!("{missing}: it was cut off")));
        }
        self.at += N as u64;
        Ok(raw)
    }

    /// Reads the header of the next chunk.
    fn chunk(&mut self, changes: &mut Vec<Change>) -> Result<(), Fault> {
        self.chunks -= 1;
        let missing = "ends in the header of its transitions";
        let level = u32::from_le_bytes(self.bytes(missing)?) != 0;
        if self.rates {
            let _rate: [u8; 8] = self.bytes(missing)?;
        }
        let at = At::Byte(self.at);
        let header: [u8; CHUNK - 4] = self.bytes(missing)?;
        let mut rest = header.as_slice();
        let mut second = || time::from_seconds(f64::from_le_bytes(take(&mut rest)));
        let (Some(begin), Some(end)) = (second(), second()) else {
            return Err(self.input.fault(at, "begin or end is not a time"));
        };
        self.announced = u64::from_le_bytes(take(&mut rest));
        self.read = 0;
        if let Some(before) = self.now {
            let to = begin.max(before);
            self.hole = Some(Hole { from: self.end.clamp(before, to), to });
        }
        (self.level, self.end) = (level, end);
        let begin = begin.max(self.now.unwrap_or(begin));
        self.now = Some(begin);
        changes.push(Change { time: begin, channel: 0, level });
        Ok(())
    }

    fn step(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        if self.read == self.announced {
            if self.chunks == 0 {
                return Ok(false);
            }
            self.chunk(changes)?;
            return Ok(true);
        }
        let at = At::Byte(self.at);
        let (announced, read) = (self.announced, self.read);
        let raw = self.bytes(&format!("announces {announced} transitions but ends after {read}"))?;
        let Some(now) = time::from_seconds(f64::from_le_bytes(raw)) else {
            return Err(self.input.fault(at, "transition is not at a time"));
        };
        if let Some(before) = self.now.filter(|before| now < *before) {
            let what = format!("time goes back from {} s to {} s", before.ps() as f64 / 1e12, now.ps() as f64 / 1e12);
            return Err(self.input.fault(at, what));
        }
        self.read += 1;
        self.now = Some(now);
        self.level = !self.level;
        changes.push(Change { time: now, channel: 0, level: self.level });
        Ok(true)
    }
}

impl Line for SaleaeBinary {
    fn channels(&self) -> &[String] {
        &self.channel
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        while !self.over && changes.len() < enough {
            // What a chunk begins with comes after the hole before it.
            if self.read == self.announced && self.chunks > 0 && self.now.is_some() && changes.len() + BLOCK > enough {
                break;
            }
            let more = self.step(changes);
            self.over = !matches!(more, Ok(true));
            more?;
        }
        Ok(!self.over)
    }

    fn reached(&self) -> Time {
        let now = self.now.unwrap_or_default();
        if self.over && self.read == self.announced { self.end.max(now) } else { now }
    }

    fn hole(&mut self) -> Option<Hole> {
        self.hole.take()
    }
}

/// Returns the next N bytes; zeros if they are missing, which an earlier length check rules out.
fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    let Some((first, after)) = rest.split_first_chunk::<N>() else { return [0; N] };
    *rest = after;
    *first
}
