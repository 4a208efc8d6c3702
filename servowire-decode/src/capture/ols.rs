//! Files of the OLS client and of `sigrok-cli -O ols`: a word for each sample number, or only for those at which a level
//! changes.

use super::input::Input;
use super::recording::{Change, Line};
use crate::fault::{At, Fault};
use crate::time::{self, Clock, Time};

/// Changes returned at once.
const BLOCK: usize = 4096;
/// A longer line cannot belong to this format.
const LONGEST: usize = 1 << 12;
/// Maximum number of channels.
const CHANNELS: u32 = 64;

/// An OLS file after its heading.
pub struct Ols {
    input: Input,
    line: u64,
    clock: Clock,
    channels: Vec<String>,
    last: Option<u64>,
    sample: u64,
    /// The first line of data, read to find the end of the heading.
    waiting: Option<String>,
}

impl Ols {
    /// Reads the heading.
    pub fn new(input: Input) -> Result<Self, Fault> {
        let clock = Clock::new(1);
        let mut file = Self { input, line: 0, clock, channels: Vec::new(), last: None, sample: 0, waiting: None };
        let (mut rate, mut channels) = (None, None);
        while let Some(line) = file.next_line()? {
            let Some(said) = line.strip_prefix(';') else {
                file.waiting = Some(line);
                break;
            };
            match said.split_once(':').map(|(key, value)| (key.trim(), value.trim())) {
                Some(("Rate", value)) => rate = time::frequency(value).filter(|rate| (1.0..=1e12).contains(rate)),
                Some(("Channels", value)) => channels = value.parse().ok().filter(|n| (1..=CHANNELS).contains(n)),
                _ => {}
            }
        }
        let Some(rate) = rate else {
            return Err(file.input.fault(At::Line(1), "no sample rate (\";Rate: 1000000\") is in the heading"));
        };
        file.clock = Clock::new(rate.round() as u64);
        let digits = file.waiting.as_deref().and_then(|line| line.find('@')).unwrap_or(8) as u32;
        let count = channels.unwrap_or((4 * digits).clamp(1, CHANNELS));
        file.channels = (0..count).map(|channel| channel.to_string()).collect();
        Ok(file)
    }

    fn next_line(&mut self) -> Result<Option<String>, Fault> {
        let mut text = Vec::new();
        let at = At::Line(self.line + 1);
        self.input.line(&mut text, at, LONGEST, || format!("a line of {LONGEST} characters"))?;
        self.line += 1;
        Ok((!text.is_empty()).then(|| String::from_utf8_lossy(&text).trim().to_owned()))
    }

    fn take(&mut self, line: &str, changes: &mut Vec<Change>) -> Result<(), Fault> {
        if line.is_empty() || line.starts_with(';') {
            return Ok(());
        }
        let read = line
            .split_once('@')
            .and_then(|(word, sample)| Some((u64::from_str_radix(word, 16).ok()?, sample.parse::<u64>().ok()?)));
        let Some((word, sample)) = read else {
            return Err(self
                .input
                .fault(At::Line(self.line), format!("{line:?} is not a word at a sample, such as 06@1")));
        };
        if sample < self.sample {
            let what = format!("sample {sample} comes after sample {}", self.sample);
            return Err(self.input.fault(At::Line(self.line), what));
        }
        self.sample = sample;
        let mut changed = self.last.map_or(u64::MAX, |last| last ^ word);
        self.last = Some(word);
        while changed != 0 {
            let bit = changed.trailing_zeros();
            if bit as usize >= self.channels.len() {
                break;
            }
            let level = word >> bit & 1 == 1;
            changes.push(Change { time: self.clock.time(sample), channel: bit as u16, level });
            changed &= changed - 1;
        }
        Ok(())
    }
}

impl Line for Ols {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        let mut rows = 0;
        while changes.len() < enough && rows < 16 * BLOCK && (rows == 0 || !self.input.pauses()) {
            let line = match self.waiting.take() {
                Some(line) => line,
                None => match self.next_line()? {
                    Some(line) => line,
                    None => return Ok(false),
                },
            };
            self.take(&line, changes)?;
            rows += 1;
        }
        Ok(true)
    }

    fn reached(&self) -> Time {
        self.clock.time(self.sample)
    }
}
