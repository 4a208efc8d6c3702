//! `servowire explain`: one frame of a capture, bit by bit.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use servowire_decode::event::{Direction, Event, Field, Place, Verdict};
use servowire_decode::output::filter::{Choice, Filter};
use servowire_decode::output::text::{shown, verdict};
use servowire_decode::time::Time;

use crate::clip::Clip;
use crate::drawing::{Sheet, Wave};
use crate::overwrite::refusal;
use crate::reading::Reading;
use crate::scope::{Scope, Wanted};
use crate::terminal::say;
use crate::units::moment;

/// Bits of a line of text, in groups of ten.
const BITS: usize = 60;
/// How long after the given time a frame is looked for, in picoseconds.
const AFTER: i64 = 20_000_000_000;

/// Show one frame of a capture, bit by bit.
///
/// Shows the frame on the line at a time of the capture, or the nearest one: its levels, its bits, where each field lies, and
/// the bit or field that is wrong. Exit code 0: the frame holds; 1: it was refused, or nothing was found; 2: wrong use.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  servowire explain line.vcd --at 1.2345ms
  servowire explain line.vcd --at 710us --svg frame.svg")]
pub(crate) struct Arguments {
    /// The capture.
    file: PathBuf,
    /// The time, such as 1.2345ms.
    #[arg(long, value_name = "TIME", value_parser = moment, allow_hyphen_values = true)]
    at: Time,
    /// Draw the frame into this file.
    #[arg(long, value_name = "OUT")]
    svg: Option<PathBuf>,
    /// What to read, and how.
    #[command(flatten)]
    reading: Reading,
}

impl Arguments {
    pub(crate) fn run(&self) -> ExitCode {
        if let Some(what) = refusal(&[("the capture", &self.file)], &[("--svg", self.svg.as_deref())]) {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
        match self.explain() {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
        }
    }

    /// Returns whether the frame is good.
    fn explain(&self) -> Result<bool, Box<dyn Error>> {
        let mut scope = Scope::new(Wanted::At(self.at));
        let mut filter = Filter::new(Choice { to: Some(self.at + AFTER), ..Choice::default() });
        let name = self.file.display();
        let read = self.reading.decode(&self.file, &mut scope, Vec::new(), Some(&mut filter))?;
        let Some(clip) = scope.clips().next() else {
            let why = read.fault.unwrap_or_else(|| format!("{name}: no frame was found on a line"));
            return Err(why.into());
        };
        say(format_args!("{}", text(clip, self.at)))?;
        if let Some(path) = &self.svg {
            let wave = Wave::new(clip.clone());
            let mut sheet = Sheet::new(&format!("{name}: {}", heading(clip)), wave.width());
            sheet.panel(wave.height(), wave);
            fs::write(path, sheet.svg()?).map_err(|error| format!("{}: {error}", path.display()))?;
        }
        Ok(clip.event.verdict.is_ok())
    }
}

/// Describes the frame.
pub(crate) fn heading(clip: &Clip) -> String {
    let Event { direction, kind, .. } = &clip.event;
    let side = match direction {
        Some(Direction::Request) => "request ",
        Some(Direction::Answer) if kind != "answer" => "answer ",
        _ => "",
    };
    let (start, end) = clip.span();
    format!("{side}{kind}, {:.3} us to {:.3} us: {}", start.us(), end.us(), verdict(&clip.event.verdict))
}

/// Describes the frame in words and digits.
fn text(clip: &Clip, at: Time) -> String {
    let mut out = String::new();
    let (start, end) = clip.span();
    let lane = &clip.lane;
    let rate = f64::from(lane.rate) / 1e6;
    // A String takes everything.
    let _ = writeln!(out, "channel \"{}\", {} at {rate} Mbit/s", lane.channel, lane.protocol.title);
    if at < start || at >= end {
        let _ = writeln!(out, "no frame is on the line at {:.3} us; the nearest one:", at.us());
    }
    let _ = writeln!(out, "{}", heading(clip));
    bits(clip, &mut out);
    let place = |field: &Field| match field.span?.place {
        Place::Time { start, end } => Some((start, end)),
        Place::Line(_) => None,
    };
    for field in &clip.event.fields {
        let _ = match place(field) {
            Some((start, end)) => {
                writeln!(out, "  {:>11.3} us .. {:>11.3} us  {}", start.us(), end.us(), shown(field))
            }
            None => writeln!(out, "  {:32}{}", "", shown(field)),
        };
    }
    out
}

/// Shows levels and bits of the line, with the broken bit marked.
fn bits(clip: &Clip, out: &mut String) {
    let Some(bits) = clip.bits() else { return };
    let broken = clip.broken_bit();
    let stretch = clip.broken().filter(|_| broken.is_none());
    let is_broken = |bit: usize| {
        broken == Some(bit)
            || stretch.is_some_and(|(start, end)| bits.begin(bit + 1) > start + 1 && bits.begin(bit) + 1 < end)
    };
    for first in (0..bits.levels.len()).step_by(BITS) {
        let own = first..(first + BITS).min(bits.levels.len());
        let line = |character: &dyn Fn(usize) -> char| {
            let spaced = own.clone().flat_map(|bit| {
                let gap = (bit > first && (bit - first) % 10 == 0).then_some(' ');
                gap.into_iter().chain([character(bit)])
            });
            spaced.collect::<String>().trim_end().to_owned()
        };
        let level = |bit: usize| bits.levels.get(bit).copied().unwrap_or(true);
        let _ = writeln!(
            out,
            "  bit {first:>4}  {:>11.3} us  {}",
            bits.begin(first).us(),
            line(&|bit| if level(bit) { '-' } else { '_' })
        );
        let _ = writeln!(out, "{:28}{}", "", line(&|bit| if level(bit) { '1' } else { '0' }));
        let marks = line(&|bit| if is_broken(bit) { '^' } else { ' ' });
        if !marks.is_empty() {
            let _ = writeln!(out, "{:28}{marks} here", "");
        }
    }
    if let Verdict::Refused(refusal) = &clip.event.verdict {
        if let Some(cause) = &refusal.cause {
            let _ = writeln!(out, "  likely cause: {cause}");
        }
    }
}
