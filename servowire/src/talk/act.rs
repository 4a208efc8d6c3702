//! The commands.

pub(super) mod memory;
mod watch;

use std::fmt::Display;
use std::fs;
use std::io::{self, BufRead};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use serde_json::{Value, json};
use tformat::{AllData, Almc, BitRate, Evidence, Hint, Policy, Resolution, Response, Sample, Tolerated};

use super::encoder::{Changed, Encoder};
use super::fault::Fault;
use super::link::Link;
use super::port::{self, Port};
use super::relay::{self, Said};
use crate::terminal;

pub(super) use watch::watch;

type Done = Result<ExitCode, Fault>;

/// How results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Print {
    Text,
    /// One object per line.
    Json,
}

impl Print {
    /// Prints something to the user. If the reader closes the pipe, it has read enough.
    fn say(self, text: impl Display, value: impl FnOnce() -> Value) -> Result<(), Fault> {
        match self {
            Self::Text => terminal::say(format_args!("{text}\n")),
            Self::Json => terminal::say(format_args!("{}\n", value())),
        }
        .map_err(Fault::Output)
    }
}

/// Asks before something that cannot be undone.
fn confirm(yes: bool, what: &str) -> Result<(), Fault> {
    if yes {
        return Ok(());
    }
    eprint!("{what} Type yes: ");
    let mut answer = String::new();
    let read = io::stdin().lock().read_line(&mut answer);
    read.map_err(|error| Fault::Input(format!("no answer can be read: {error}")))?;
    if answer.trim() == "yes" { Ok(()) } else { Err(Fault::Input("nothing was written".to_owned())) }
}

pub(super) fn read<P: Port>(encoder: &mut Encoder<P>, print: Print) -> Done {
    let all = encoder.read()?;
    print.say(line(&all), || object(&all))?;
    Ok(ExitCode::SUCCESS)
}

/// The position was read just now, and the alarms are shown beside it.
const SHOWN: Policy = Policy::new(0).tolerating(Tolerated::NOTHING.alarms(Almc::all()));

/// Returns the position and its degrees, if it may be shown; otherwise the reason.
fn place(all: &AllData) -> Result<(Sample, f64), String> {
    let Some(Hint { resolution, .. }) = Resolution::from_enid(all.enid) else {
        return Err(format!(" (encoder ID {:#04x} does not tell their widths)", all.enid));
    };
    let judged = Evidence::of(Response::ReadAll(*all), resolution, 0).at(0, SHOWN);
    let sample = judged.map_err(|doubt| format!(": {doubt}"))?;
    Ok((sample, f64::from(sample.single_turn()) * 360.0 / f64::from(resolution.counts_per_turn())))
}

/// Describes position, turns and alarms in words.
fn line(all: &AllData) -> String {
    let place = match place(all) {
        Ok((sample, degrees)) => {
            let (counts, turns) = (sample.single_turn(), sample.turns().unwrap_or(0));
            format!("{degrees:>10.5} deg  {counts:>8} counts  turn {turns}")
        }
        Err(why) => format!("ABS {} ABM {}{why}", all.abs, all.abm),
    };
    let alarms = if all.almc.is_empty() { "no alarms".to_owned() } else { format!("alarms {}", all.almc) };
    format!("{place}  {alarms}")
}

/// Returns the same as an object, without a position that must not be used.
fn object(all: &AllData) -> Value {
    let place = place(all).ok();
    json!({
        "encoder_id": all.enid,
        "abs": all.abs.get(),
        "abm": all.abm.get(),
        "counts": place.map(|(sample, _)| sample.single_turn()),
        "degrees": place.map(|(_, degrees)| degrees),
        "turns": place.and_then(|(sample, _)| sample.turns()),
        "alarms": names(all.almc),
    })
}

fn names(almc: Almc) -> Vec<&'static str> {
    almc.iter_names().map(|(name, _)| name).collect()
}

/// Creates a table in this file, if one is given.
fn table<'p>(path: Option<&'p Path>, head: &[&str]) -> Result<Option<(csv::Writer<fs::File>, &'p Path)>, Fault> {
    let Some(path) = path else { return Ok(None) };
    let mut csv = csv::Writer::from_writer(fs::File::create(path).map_err(Fault::file(path))?);
    csv.write_record(head).map_err(io::Error::from).map_err(Fault::file(path))?;
    Ok(Some((csv, path)))
}

/// Relays between a master and its encoder without end.
pub(super) fn relay<M: Port, E: Port>(
    master: M,
    encoder: &mut Link<E>,
    hears_itself: bool,
    csv: Option<&Path>,
    print: Print,
) -> Result<(), Fault> {
    let mut csv = table(csv, &["time_s", "request", "answer", "fault"])?;
    let begin = Instant::now();
    let log = |said: &Said| {
        let (request, answer, fault) = match said {
            Said::Request(request, Ok(answer)) => (request.to_string(), answer.to_string(), String::new()),
            Said::Request(request, Err(fault)) => (request.to_string(), String::new(), fault.to_string()),
            Said::Junk(bytes) => (String::new(), String::new(), format!("no request: {bytes:02x?}")),
        };
        let time = format!("{:.6}", begin.elapsed().as_secs_f64());
        let said = || json!({ "time_s": time, "request": request, "answer": answer, "fault": fault });
        print.say(format_args!("{time}  {request}  {answer}{fault}"), said)?;
        if let Some((csv, path)) = &mut csv {
            csv.write_record([time, request, answer, fault]).map_err(io::Error::from).map_err(Fault::file(path))?;
            csv.flush().map_err(Fault::file(path))?;
        }
        Ok(())
    };
    relay::run(master, encoder, hears_itself, log, None)
}

pub(super) fn info<P: Port>(encoder: &mut Encoder<P>, name: &str, rate: BitRate, print: Print) -> Done {
    let all = encoder.read()?;
    let hint = Resolution::from_enid(all.enid);
    let widths = hint.map_or_else(
        || "not documented".to_owned(),
        |Hint { resolution, documented }| {
            let probably = if documented { "" } else { "probably " };
            format!("{probably}{} bits a turn, {} of turns", resolution.abs_bits(), resolution.abm_bits())
        },
    );
    let (echo, about) = (encoder.echo(), port::about(name, rate));
    let hears = if echo { "hears itself" } else { "does not hear itself" };
    let lines = [format!("encoder ID {:#04x}: {widths}", all.enid), line(&all), format!("the adapter {hears}")];
    let lines: Vec<_> = lines.into_iter().chain(about.iter().cloned()).collect();
    print.say(lines.join("\n"), || {
        json!({
            "reading": object(&all),
            "abs_bits": hint.map(|hint| hint.resolution.abs_bits()),
            "abm_bits": hint.map(|hint| hint.resolution.abm_bits()),
            "documented": hint.is_some_and(|hint| hint.documented),
            "hears_itself": echo,
            "adapter": about,
        })
    })?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn clear_errors<P: Port>(encoder: &mut Encoder<P>, print: Print) -> Done {
    let changed = encoder.clear_errors()?;
    let Changed { before, after } = changed;
    let named = |almc: Almc| if almc.is_empty() { "none".to_owned() } else { almc.to_string() };
    let said = format!("alarms before: {}; after: {}", named(before.almc), named(after.almc));
    print.say(said, || change(&changed))?;
    Ok(if after.almc.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

pub(super) fn zero_turns<P: Port>(encoder: &mut Encoder<P>, yes: bool, tolerance: u32, print: Print) -> Done {
    confirm(yes, "The turns will be 0, and the machine's multi-turn reference is lost.")?;
    said(&encoder.zero_turns_and_lose_multi_turn_reference(tolerance)?, print)
}

pub(super) fn zero_single_turn<P: Port>(encoder: &mut Encoder<P>, yes: bool, tolerance: u32, print: Print) -> Done {
    confirm(
        yes,
        "The present position will be the zero of the turn. This shifts the commutation angle: a drive that commutates by this \
         encoder puts its current into the wrong phases, and the motor may run away.",
    )?;
    said(&encoder.zero_single_turn_and_shift_commutation_angle(tolerance)?, print)
}

/// The values read before and after.
fn said(changed: &Changed, print: Print) -> Done {
    let text = format!("before: {}\nafter:  {}", line(&changed.before), line(&changed.after));
    print.say(text, || change(changed))?;
    Ok(ExitCode::SUCCESS)
}

fn change(changed: &Changed) -> Value {
    json!({ "before": object(&changed.before), "after": object(&changed.after) })
}
