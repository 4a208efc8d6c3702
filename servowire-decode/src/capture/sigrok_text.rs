//! `sigrok-cli -O bits`, `-O hex` and `-O ascii`: one line of samples for each channel, repeated in rounds.

use super::input::Input;
use super::recording::{Change, Line};
use crate::fault::{At, Fault};
use crate::time::{self, Clock, Time};

/// A longer line cannot belong to this format.
const LONGEST: usize = 1 << 20;
/// No device has more channels.
const CHANNELS: usize = 1024;

/// Takes the lines that `sigrok-cli` writes before any form of output when it reads a file itself (`-i` or `-I`), such as
/// `META samplerate: 20000000`; returns the rate in them. Samples of `-O binary` follow them too.
pub(super) fn announced(input: &mut Input) -> Result<Option<u64>, Fault> {
    let mut rate = None;
    while input.peek()?.starts_with(b"META ") {
        let mut line = Vec::new();
        input.line(&mut line, At::Line(1), LONGEST, || format!("a line of more than {LONGEST} characters"))?;
        let line = String::from_utf8_lossy(&line);
        let hertz = line.trim_end().strip_prefix("META samplerate: ").and_then(|hertz| hertz.parse().ok());
        rate = hertz.filter(|hertz| (1..=1_000_000_000_000).contains(hertz)).or(rate);
    }
    Ok(rate)
}

/// A text of samples after its two lines of heading.
pub struct SigrokText {
    input: Input,
    line: u64,
    clock: Clock,
    channels: Vec<String>,
    last: Vec<Option<bool>>,
    /// Samples of each channel so far.
    samples: Vec<u64>,
    /// The first round of lines, read to determine the channels.
    waiting: Vec<(String, Vec<bool>)>,
}

impl SigrokText {
    /// Reads the heading and the first round.
    pub fn new(input: Input) -> Result<Self, Fault> {
        let mut file = Self {
            input,
            line: 0,
            clock: Clock::new(1),
            channels: Vec::new(),
            last: Vec::new(),
            samples: Vec::new(),
            waiting: Vec::new(),
        };
        let first = file.next_line()?.unwrap_or_default();
        let second = file.next_line()?.unwrap_or_default();
        let rate = second.rsplit_once(" at ").and_then(|(_, rate)| time::frequency(rate));
        let Some(rate) = rate.filter(|rate| first.starts_with("libsigrok") && (1.0..=1e12).contains(rate)) else {
            let what =
                "the heading of sigrok-cli (\"Acquisition with 3/4 channels at 1 MHz\") is missing or has no rate";
            return Err(file.input.fault(At::Line(2), what));
        };
        file.clock = Clock::new(rate.round() as u64);
        while let Some(line) = file.next_line()? {
            if line.trim().is_empty() {
                continue;
            }
            let (name, samples) = file.samples_of(&line)?;
            let again = file.channels.contains(&name);
            if !again {
                if file.channels.len() == CHANNELS {
                    return Err(file.input.fault(At::Line(file.line), format!("more than {CHANNELS} channels")));
                }
                file.channels.push(name.clone());
            }
            file.waiting.push((name, samples));
            if again {
                break;
            }
        }
        file.last = vec![None; file.channels.len()];
        file.samples = vec![0; file.channels.len()];
        Ok(file)
    }

    fn next_line(&mut self) -> Result<Option<String>, Fault> {
        let mut text = Vec::new();
        let at = At::Line(self.line + 1);
        let got = self.input.line(&mut text, at, LONGEST, || format!("a line of more than {LONGEST} characters"))?;
        self.line += 1;
        Ok((got > 0).then(|| String::from_utf8_lossy(&text).trim_end_matches(['\n', '\r']).to_owned()))
    }

    /// Reads `NAME:` and samples: groups of eight characters are bits, groups of two are hex digits, with the oldest sample
    /// first.
    fn samples_of(&self, line: &str) -> Result<(String, Vec<bool>), Fault> {
        let only = |rest: &str, digits: fn(char) -> bool| rest.chars().all(|c| c == ' ' || digits(c));
        // Drawn: a high level, a low one, and either one after an edge.
        let drawn = |c: char| matches!(c, '"' | '.' | '/' | '\\');
        if let Some((name, drawing)) = line.rsplit_once(':').filter(|(_, rest)| !rest.is_empty() && only(rest, drawn)) {
            let high = |c: char| matches!(c, '"' | '/');
            return Ok((name.to_owned(), drawing.chars().filter(|c| *c != ' ').map(high).collect()));
        }
        // A name may hold a colon: the digits begin after the first one that only digits follow.
        let place =
            line.match_indices(':').find(|(at, _)| only(line.get(at + 1..).unwrap_or(""), |c| c.is_ascii_hexdigit()));
        let Some((name, rest)) = place.and_then(|(at, _)| Some((line.get(..at)?, line.get(at + 1..)?))) else {
            return Err(self.input.fault(At::Line(self.line), format!("{line:?} is not a line of samples")));
        };
        let mut samples = Vec::with_capacity(rest.len());
        for group in rest.split_ascii_whitespace() {
            if group.len() == 2 && rest.trim().len() != 2 || !only(group, |c| matches!(c, '0' | '1')) {
                let byte = u8::from_str_radix(group, 16);
                let byte =
                    byte.map_err(|_| self.input.fault(At::Line(self.line), format!("{group:?} is not a byte")))?;
                samples.extend((0..8).rev().map(|bit| byte >> bit & 1 == 1));
            } else {
                samples.extend(group.bytes().map(|digit| digit == b'1'));
            }
        }
        Ok((name.to_owned(), samples))
    }

    fn take(&mut self, name: &str, samples: &[bool], changes: &mut Vec<Change>) -> Result<(), Fault> {
        let Some(channel) = self.channels.iter().position(|known| known == name) else {
            return Err(self.input.fault(At::Line(self.line), format!("channel {name:?} was not there before")));
        };
        if let (Some(count), Some(last)) = (self.samples.get_mut(channel), self.last.get_mut(channel)) {
            for (index, level) in (*count..).zip(samples) {
                if *last != Some(*level) {
                    *last = Some(*level);
                    changes.push(Change { time: self.clock.time(index), channel: channel as u16, level: *level });
                }
            }
            *count += samples.len() as u64;
        }
        Ok(())
    }

    /// Takes lines, round after round; on a fault, the lines before it have been taken.
    fn rounds(&mut self, lines: &[(String, Vec<bool>)], changes: &mut Vec<Change>) -> Result<(), Fault> {
        for round in lines.chunks(self.channels.len().max(1)) {
            let twice = |(at, (name, _)): (usize, &(String, _))| round.iter().take(at).any(|(known, _)| known == name);
            if round.iter().enumerate().any(twice) {
                return Err(self.input.fault(At::Line(self.line), "a channel occurs twice in one round of lines"));
            }
            // All channels have the same samples; where not, those that all of them have are good.
            let least = round.iter().map(|(_, samples)| samples.len()).min().unwrap_or(0);
            for (name, samples) in round {
                self.take(name, samples.get(..least).unwrap_or_default(), changes)?;
            }
            if round.iter().any(|(_, samples)| samples.len() != least) {
                let what = "the lines of a round have different numbers of samples: the file was cut off or is damaged";
                return Err(self.input.fault(At::Line(self.line), what));
            }
        }
        Ok(())
    }
}

impl Line for SigrokText {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    /// A round: one line of every channel.
    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let first = changes.len();
        let mut more = true;
        let mut lines = std::mem::take(&mut self.waiting);
        // The line that showed the second round belongs to that one.
        while more && (lines.is_empty() || lines.len() % self.channels.len().max(1) != 0) {
            match self.next_line()? {
                None => more = false,
                Some(line) if line.trim().is_empty() => {}
                Some(line) => lines.push(self.samples_of(&line)?),
            }
        }
        let taken = self.rounds(&lines, changes);
        if let Some(new) = changes.get_mut(first..) {
            new.sort_by_key(|change| change.time);
        }
        taken?;
        Ok(more)
    }

    fn reached(&self) -> Time {
        self.clock.time(self.samples.iter().copied().min().unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_after_round() {
        let text =
            b"libsigrok 0.5.2\nAcquisition with 2/2 channels at 1 MHz\nD0:10\nD1:11\nD0:01\nD1:00\n\nD0:11\nD1:01\n";
        let mut file = SigrokText::new(Input::over("rounds", text.as_slice())).unwrap();
        let mut changes = Vec::new();
        while file.read(&mut changes).unwrap() {}
        let of = |channel| changes.iter().filter(move |change| change.channel == channel);
        let said = |channel| of(channel).map(|change| (change.time.ps() / 1_000_000, change.level)).collect::<Vec<_>>();
        assert_eq!(said(0), [(0, true), (1, false), (3, true)]);
        assert_eq!(said(1), [(0, true), (2, false), (5, true)]);
        assert_eq!(file.reached().ps(), 6_000_000);
    }
}
