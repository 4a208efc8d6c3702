//! Saleae Logic 2 binary export, version 0: one digital channel a file, little endian.
//!
//! ```text
//! 0   "<SALEAE>"
//! 8   i32 version (0)      12  i32 type (0 = digital)
//! 16  u32 first level      20  f64 begin     28  f64 end     36  u64 number of transitions
//! 44  f64 time of each transition, in seconds
//! ```

use std::path::Path;

use super::{Change, Input, Line, time};
use crate::fault::{At, Fault};

/// Changes given at once.
const BLOCK: usize = 4096;
const HEADER: usize = 44;

/// A binary export behind its header.
pub struct SaleaeBinary {
    input: Input,
    channel: [String; 1],
    level: bool,
    begin: i64,
    end: i64,
    now: i64,
    announced: u64,
    read: u64,
    started: bool,
    over: bool,
}

impl SaleaeBinary {
    /// Reads the header.
    pub fn new(mut input: Input) -> Result<Self, Fault> {
        let mut header = [0; HEADER];
        let got = input.read_full(&mut header).map_err(|e| input.io_fault(At::Byte(0), &e))?;
        if !header.starts_with(b"<SALEAE>") {
            return Err(input.fault(At::Byte(0), "does not begin with <SALEAE>: not a Saleae binary export"));
        }
        if got < HEADER {
            return Err(
                input.fault(At::Byte(got as u64), format!("ends in its header of {HEADER} bytes: it was cut off"))
            );
        }
        let mut rest = header.as_slice();
        let _identifier: [u8; 8] = take(&mut rest);
        let version = i32::from_le_bytes(take(&mut rest));
        if version != 0 {
            let what = format!("is of version {version}, and only 0 is known; export as CSV or VCD");
            return Err(input.fault(At::Byte(8), what));
        }
        if i32::from_le_bytes(take(&mut rest)) != 0 {
            return Err(input.fault(At::Byte(12), "is not a digital channel; export the digital channels"));
        }
        let level = u32::from_le_bytes(take(&mut rest)) != 0;
        let mut second = || time::from_seconds(f64::from_le_bytes(take(&mut rest)));
        let (Some(begin), Some(end)) = (second(), second()) else {
            return Err(input.fault(At::Byte(20), "begin or end is not a time"));
        };
        let announced = u64::from_le_bytes(take(&mut rest));
        let name =
            Path::new(input.name()).file_stem().map_or_else(|| "line".into(), |s| s.to_string_lossy().into_owned());
        let channel = [name];
        Ok(Self { input, channel, level, begin, end, now: begin, announced, read: 0, started: false, over: false })
    }

    fn step(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        if !self.started {
            self.started = true;
            changes.push(Change { time: self.begin, channel: 0, level: self.level });
        }
        if self.read == self.announced {
            return Ok(false);
        }
        let at = At::Byte(HEADER as u64 + 8 * self.read);
        let mut raw = [0; 8];
        let got = self.input.read_full(&mut raw).map_err(|e| self.input.io_fault(at, &e))?;
        if got < 8 {
            let (announced, read) = (self.announced, self.read);
            let what = format!("announces {announced} transitions but ends after {read}: it was cut off");
            return Err(self.input.fault(at, what));
        }
        let Some(now) = time::from_seconds(f64::from_le_bytes(raw)) else {
            return Err(self.input.fault(at, "transition is not at a time"));
        };
        if now < self.now {
            let what = format!("time goes back from {} s to {} s", self.now as f64 / 1e12, now as f64 / 1e12);
            return Err(self.input.fault(at, what));
        }
        self.read += 1;
        self.now = now;
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
            let more = self.step(changes);
            self.over = !matches!(more, Ok(true));
            more?;
        }
        Ok(!self.over)
    }

    fn reached(&self) -> i64 {
        if self.over && self.read == self.announced { self.end.max(self.now) } else { self.now }
    }
}

/// The next N bytes; zeros where they are missing, which the length check before rules out.
fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    let Some((first, behind)) = rest.split_first_chunk::<N>() else { return [0; N] };
    *rest = behind;
    *first
}
