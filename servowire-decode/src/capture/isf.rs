//! Waveforms of Tektronix oscilloscopes as they send them (`.isf`): a preamble in ASCII, then the samples of a channel.
//!
//! ```text
//! :WFMPRE:BYT_NR 1;BIT_NR 8;ENCDG BINARY;BN_FMT RI;...;NR_PT 2500;XINCR 5.0E-8;XZERO 0;PT_OFF 0;YMULT 4.0E-2;...
//! :CURVE #42500<2500 bytes>
//! ```
//! The keywords are long or short; volts = (sample - `YOFF`) `YMULT` + `YZERO`, time = `XZERO` + (number - `PT_OFF`)
//! `XINCR`.

use std::io::{BufRead, Read};

use super::input::Input;
use super::recording::{Change, Line};
use super::table::threshold::Threshold;
use crate::fault::{At, Fault};
use crate::time::Time;

/// The longest preamble.
const LONGEST: usize = 1 << 12;
/// Samples read at once, and samples examined for the levels.
const BLOCK: usize = 1 << 16;

/// A waveform after its preamble.
pub struct Isf {
    input: Input,
    channel: [String; 1],
    encoding: Encoding,
    /// Volts per step, and volts at step 0.
    scale: f64,
    zero: f64,
    /// Time of the first sample, and the interval from one sample to the next, in picoseconds.
    start: f64,
    period: f64,
    /// Remaining bytes of the curve; `None` if it extends to the end of the file.
    left: Option<u64>,
    threshold: Threshold,
    /// Samples that were read to determine the levels.
    waiting: Vec<f64>,
    level: Option<bool>,
    count: u64,
}

/// How a sample is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Binary { bytes: usize, signed: bool, big: bool },
    Ascii,
}

/// Returns whether a file begins with a preamble.
pub(super) fn looks_like(head: &[u8]) -> bool {
    let text = head.trim_ascii_start();
    let text = text.strip_prefix(b":").unwrap_or(text);
    let begins = |word: &[u8]| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    [&b"WFMPRE:"[..], b"WFMP:", b"WFMOUTPRE:", b"WFMO:"].iter().any(|word| begins(word))
        || (begins(b"BYT_N")
            && text.windows(6).any(|six| six.eq_ignore_ascii_case(b":CURV ") || six.eq_ignore_ascii_case(b":CURVE")))
}

/// Returns the items of a preamble: keywords in upper case and their values; a `;` in quotes is not a separator.
fn items(text: &str) -> Vec<(String, String)> {
    let (mut out, mut item, mut quoted) = (Vec::new(), String::new(), false);
    for letter in text.chars().chain([';']) {
        match letter {
            '"' => quoted = !quoted,
            ';' if !quoted => {
                let bare = item.trim().rsplit_once(':').map_or(item.trim(), |(_, bare)| bare).to_owned();
                let whole = item.trim().split_once(' ').map(|(word, value)| {
                    (word.rsplit(':').next().unwrap_or_default().to_ascii_uppercase(), value.trim().to_owned())
                });
                out.extend(whole.or_else(|| (!bare.is_empty()).then(|| (bare.to_ascii_uppercase(), String::new()))));
                item.clear();
            }
            letter => item.push(letter),
        }
    }
    out
}

impl Isf {
    /// Reads the preamble, and enough samples to determine the levels.
    pub fn new(mut input: Input, threshold: Option<f64>) -> Result<Self, Fault> {
        let preamble = preamble(&mut input)?;
        let items = items(&preamble);
        let said = |words: &[&str]| {
            items.iter().find(|(word, _)| words.contains(&word.as_str())).map(|(_, value)| value.as_str())
        };
        let number = |words: &[&str]| said(words).and_then(|text| text.parse::<f64>().ok()).filter(|n| n.is_finite());
        let fault = |what: String| input.fault(At::File, what);
        let Some(period) = number(&["XINCR", "XIN"]).filter(|period| *period > 0.0) else {
            return Err(fault("the preamble of the waveform does not say its sample interval (XINCR)".to_owned()));
        };
        let missing = |word: &str| fault(format!("the preamble of the waveform does not say {word}"));
        let encoding = match said(&["ENCDG", "ENC"]).map(str::to_ascii_uppercase).as_deref() {
            Some(ascii) if ascii.starts_with("ASC") => Encoding::Ascii,
            _ => {
                let bytes = number(&["BYT_NR", "BYT_N"]).ok_or_else(|| missing("the bytes of a sample (BYT_NR)"))?;
                if ![1.0, 2.0].contains(&bytes) {
                    return Err(fault(format!("samples of {bytes} bytes are not read, only of 1 or 2")));
                }
                let signed = !said(&["BN_FMT", "BN_F"]).is_some_and(|format| format.eq_ignore_ascii_case("RP"));
                let big = !said(&["BYT_OR", "BYT_O"]).is_some_and(|order| order.eq_ignore_ascii_case("LSB"));
                Encoding::Binary { bytes: bytes as usize, signed, big }
            }
        };
        if said(&["PT_FMT", "PT_F"]).is_some_and(|format| format.eq_ignore_ascii_case("ENV")) {
            return Err(fault(
                "pairs of least and most (PT_FMT ENV) have no edges: record without peak detect".to_owned(),
            ));
        }
        let left = if encoding == Encoding::Ascii { None } else { block(&mut input)? };
        let (scale, offset) = (number(&["YMULT", "YMU"]).unwrap_or(1.0), number(&["YOFF", "YOF"]).unwrap_or(0.0));
        let first = number(&["PT_OFF", "PT_O"]).unwrap_or(0.0);
        let name = said(&["WFID", "WFI"]).and_then(|name| name.split(',').next()).unwrap_or("waveform").trim();
        let mut waveform = Self {
            input,
            channel: [if name.is_empty() { "waveform".to_owned() } else { name.to_owned() }],
            encoding,
            scale,
            zero: number(&["YZERO", "YZE"]).unwrap_or(0.0) - offset * scale,
            start: (number(&["XZERO", "XZE"]).unwrap_or(0.0) - first * period) * 1e12,
            period: period * 1e12,
            left,
            threshold: Threshold::find(&mut [], threshold),
            waiting: Vec::new(),
            level: None,
            count: 0,
        };
        waveform.waiting = waveform.samples()?;
        if waveform.waiting.is_empty() {
            return Err(waveform.input.fault(At::File, "the waveform has no samples"));
        }
        waveform.threshold = Threshold::find(&mut waveform.waiting.clone(), threshold);
        Ok(waveform)
    }

    /// Returns the next samples in volts; none at the end.
    fn samples(&mut self) -> Result<Vec<f64>, Fault> {
        let volts = |raw: f64| raw * self.scale + self.zero;
        let Encoding::Binary { bytes, signed, big } = self.encoding else {
            let mut out = Vec::new();
            let mut text = Vec::new();
            while out.len() < BLOCK {
                text.clear();
                let got = self.input.by_ref().take(64).read_until(b',', &mut text);
                if got.map_err(|e| self.input.io_fault(At::File, &e))? == 0 {
                    break;
                }
                let bare = String::from_utf8_lossy(&text);
                let bare = bare.trim_matches(|c: char| c == ',' || c.is_whitespace());
                if !bare.is_empty() {
                    let raw: f64 = bare
                        .parse()
                        .map_err(|_| self.input.fault(At::File, format!("{bare:?} is not a sample of the waveform")))?;
                    out.push(volts(raw));
                }
            }
            return Ok(out);
        };
        let most = self.left.map_or(u64::MAX, |left| left).min((BLOCK * bytes) as u64);
        let mut block = vec![0; most as usize];
        let got = self.input.read_full(&mut block, bytes).map_err(|e| self.input.io_fault(At::File, &e))?;
        if let Some(left) = &mut self.left {
            *left -= got as u64;
            if got == 0 && *left > 0 {
                let what = format!("the waveform was cut off: {left} bytes of its samples are missing");
                return Err(self.input.fault(At::File, what));
            }
        }
        let raw = |sample: &[u8]| match (sample, signed, big) {
            (&[a], true, _) => f64::from(i8::from_ne_bytes([a])),
            (&[a], false, _) => f64::from(a),
            (&[a, b], true, true) => f64::from(i16::from_be_bytes([a, b])),
            (&[a, b], true, false) => f64::from(i16::from_le_bytes([a, b])),
            (&[a, b], false, true) => f64::from(u16::from_be_bytes([a, b])),
            (&[a, b], false, false) => f64::from(u16::from_le_bytes([a, b])),
            _ => 0.0,
        };
        Ok(block.get(..got).unwrap_or_default().chunks_exact(bytes).map(raw).map(volts).collect())
    }
}

/// Reads the preamble up to the curve.
fn preamble(input: &mut Input) -> Result<String, Fault> {
    let mut text = Vec::new();
    loop {
        let byte = match input.fill_buf() {
            Ok(buffer) => buffer.first().copied(),
            Err(e) => return Err(input.io_fault(At::File, &e)),
        };
        let Some(byte) = byte.filter(|_| text.len() < LONGEST) else {
            return Err(input.fault(At::File, "the preamble of the waveform has no :CURVE after it"));
        };
        input.consume(1);
        text.push(byte);
        // `:CURV `, `:CURVE `, `;CURVE `
        if matches!(byte, b' ' | b'#') {
            let word = text.trim_ascii_end().rsplit(|byte| matches!(byte, b':' | b';')).next().unwrap_or_default();
            if word.eq_ignore_ascii_case(b"CURV") || word.eq_ignore_ascii_case(b"CURVE") {
                // A file that begins with its curve has no sign before the word.
                let before = text.len().saturating_sub(word.len() + 1 + usize::from(byte == b' '));
                text.truncate(before);
                return Ok(String::from_utf8_lossy(&text).into_owned());
            }
        }
    }
}

/// `#`, the number of digits, the number of bytes; `#0`: to the end of the file.
fn block(input: &mut Input) -> Result<Option<u64>, Fault> {
    let mut byte = || {
        let mut one = [0];
        match input.read_full(&mut one, 1) {
            Ok(1) => Ok(one),
            Ok(_) => Err(input.fault(At::File, "the waveform ends before its samples: it was cut off")),
            Err(e) => Err(input.io_fault(At::File, &e)),
        }
    };
    let mut length = None;
    loop {
        match byte()? {
            [b' '] => {}
            [b'#'] => break,
            _ => return Err(input.fault(At::File, "the samples of the waveform do not begin with #")),
        }
    }
    let [digits] = byte()?;
    for _ in 0..digits.wrapping_sub(b'0').min(9) {
        let [digit] = byte()?;
        length = Some(length.unwrap_or(0) * 10 + u64::from(digit.wrapping_sub(b'0').min(9)));
    }
    Ok(length)
}

impl Line for Isf {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.input)
    }

    fn channels(&self) -> &[String] {
        &self.channel
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let mut samples = std::mem::take(&mut self.waiting);
        if samples.is_empty() {
            samples = self.samples()?;
        }
        for volts in &samples {
            let level = self.threshold.level(*volts, self.level);
            self.threshold.follow(*volts);
            if self.level != Some(level) {
                self.level = Some(level);
                changes.push(Change { time: self.reached(), channel: 0, level });
            }
            self.count += 1;
        }
        Ok(!samples.is_empty())
    }

    fn reached(&self) -> Time {
        Time::from_ps((self.start + self.count as f64 * self.period).round() as i128)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_begins_with_its_curve() {
        let open = |text: &'static [u8]| Isf::new(Input::over("curve", text), None).map(|_| ());
        let fault = open(b"CURV #14\0\x80\x0b\x43").unwrap_err().to_string();
        assert!(fault.contains("does not say its sample interval"), "{fault}");
    }
}
