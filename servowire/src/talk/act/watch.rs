//! `talk watch`: shows positions one after the other, with figures of the line.

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::{Done, Print, line, object, table};
use crate::interrupt;
use crate::talk::Watch;
use crate::talk::encoder::Encoder;
use crate::talk::fault::Fault;
use crate::talk::port::Port;

/// Minimum, maximum and mean of times.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Times {
    count: u32,
    least: f64,
    most: f64,
    sum: f64,
}

impl Times {
    fn add(&mut self, time: Duration) {
        let ms = time.as_secs_f64() * 1e3;
        (self.least, self.most) = if self.count == 0 { (ms, ms) } else { (self.least.min(ms), self.most.max(ms)) };
        self.count += 1;
        self.sum += ms;
    }

    fn mean(&self) -> f64 {
        self.sum / f64::from(self.count.max(1))
    }

    fn json(&self) -> Value {
        let all = json!({ "count": self.count, "min": self.least, "mean": self.mean(), "max": self.most });
        if self.count == 0 { Value::Null } else { all }
    }
}

/// The results of all readings.
#[derive(Debug, Default)]
struct Figures {
    good: u64,
    /// Keyed by class of error.
    bad: BTreeMap<&'static str, u64>,
    /// Times from the request to the answer, and from one request to the next.
    answers: Times,
    cycles: Times,
}

impl Figures {
    fn faults(&self) -> u64 {
        self.bad.values().sum()
    }

    /// Prints the figures in two lines; the first only if there is something to say.
    fn text(&self) -> String {
        let Self { good, bad, answers, cycles } = self;
        let mut said = Vec::new();
        if answers.count > 0 {
            let Times { least, most, .. } = answers;
            said.push(format!("answers took {least:.3} to {most:.3} ms, {:.3} ms on average", answers.mean()));
        }
        if cycles.count > 0 {
            said.push(format!("one reading every {:.3} ms, at most {:.3} ms", cycles.mean(), cycles.most));
        }
        said.extend(bad.iter().map(|(class, count)| format!("{class} {count}")));
        let first = if said.is_empty() { String::new() } else { format!("{}\n", said.join("; ")) };
        format!("{first}{good} good, {} refused or missing", self.faults())
    }

    fn json(&self) -> Value {
        json!({
            "good": self.good,
            "bad": self.faults(),
            "faults": self.bad,
            "answer_ms": self.answers.json(),
            "cycle_ms": self.cycles.json(),
        })
    }
}

/// Returns the class of what went wrong, as used in statistics.
fn class(fault: &Fault) -> &'static str {
    match fault {
        Fault::Encoder(error) => error.class().name(),
        Fault::OnlyEcho => "only_echo",
        _ => "other",
    }
}

/// Waits for the rest of a period; returns whether the user wants to end.
fn rest(period: Duration, begin: Instant) -> bool {
    while !interrupt::asked() {
        let left = period.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return false;
        }
        thread::sleep(left.min(Duration::from_millis(50)));
    }
    true
}

/// Reads until the count is reached, the port is gone, or the user ends it.
pub(in crate::talk) fn watch<P: Port>(encoder: &mut Encoder<P>, watch: &Watch, print: Print) -> Done {
    let mut csv = table(watch.csv.as_deref(), &["time_s", "abs", "abm", "almc", "fault"])?;
    let (mut figures, begin) = (Figures::default(), Instant::now());
    let (mut gone, mut out, mut last) = (None, io::stdout(), None);
    // Over the line before, to the end of the line; in a file or pipe a line each.
    let (from, to) = if out.is_terminal() { ("\r", "\x1b[K") } else { ("", "\n") };
    interrupt::note();
    while watch.count.is_none_or(|count| figures.good + figures.faults() < count) {
        let asked = Instant::now();
        if let Some(last) = last.replace(asked) {
            figures.cycles.add(asked - last);
        }
        let reading = match encoder.read() {
            Err(fault @ (Fault::Io(_) | Fault::Port(_))) => {
                gone = Some(fault);
                break;
            }
            reading => reading,
        };
        let took = asked.elapsed();
        let time = begin.elapsed().as_secs_f64();
        let (text, record) = match &reading {
            Ok(all) => {
                figures.good += 1;
                figures.answers.add(took);
                (
                    format!("{}  {:.3} ms", line(all), took.as_secs_f64() * 1e3),
                    [all.abs.to_string(), all.abm.to_string(), format!("{:#04x}", all.almc.bits()), String::new()],
                )
            }
            Err(fault) => {
                *figures.bad.entry(class(fault)).or_default() += 1;
                (fault.to_string(), [String::new(), String::new(), String::new(), fault.to_string()])
            }
        };
        if let Some((csv, path)) = &mut csv {
            let record = std::iter::once(format!("{time:.6}")).chain(record);
            csv.write_record(record).map_err(io::Error::from).map_err(Fault::file(path))?;
        }
        let errors = figures.faults() as f64 * 100.0 / (figures.good + figures.faults()) as f64;
        let written = match (print, &reading) {
            (Print::Text, _) => write!(out, "{from}{text}  {errors:.1} % errors{to}"),
            (Print::Json, Ok(all)) => writeln!(out, "{}", json!({ "time_s": time, "reading": object(all) })),
            (Print::Json, Err(fault)) => writeln!(out, "{}", json!({ "time_s": time, "fault": fault.to_string() })),
        };
        match written.and_then(|()| out.flush()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            written => written.map_err(Fault::Output)?,
        }
        if rest(Duration::from_millis(watch.period), Instant::now()) {
            break;
        }
    }
    print.say(format!("{}{}", if from.is_empty() { "" } else { "\n" }, figures.text()), || figures.json())?;
    if let Some((mut csv, path)) = csv {
        csv.flush().map_err(Fault::file(path))?;
    }
    match gone {
        Some(fault) => Err(fault),
        None if figures.faults() == 0 => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}
