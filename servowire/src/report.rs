//! `servowire report`: everything that a capture shows, in one file that can be printed and sent.

mod html;

use std::error::Error;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use servowire_decode::event::{Event, Verdict};
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::output::stats::{Gathered, Table};
use servowire_decode::time::Time;
use sha2::{Digest, Sha256};

use crate::overwrite::refusal;
use crate::picture::Picture;
use crate::reading::{Read, Reading};
use crate::scope::{Scope, Wanted};

/// Maximum number of refused frames listed.
const LISTED: usize = 500;

/// Write a report on a capture: one file, for a browser or a printer.
///
/// What was found and how, the settings, figures of each encoder, its position, delays and errors over time, each kind of
/// damage once as it looks on the line, a list of the refused frames, and the SHA-256 of the capture. Exit code 0: all frames
/// good; 1: a frame was refused, or the capture is incomplete (the report is still written); 2: wrong use.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  servowire report line.vcd -o report.html
  servowire report --rate 24M --channel 3 samples.bin -o report.html")]
pub(crate) struct Arguments {
    /// The capture.
    file: PathBuf,
    /// The report.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// What to read, and how.
    #[command(flatten)]
    reading: Reading,
}

/// The content of a report.
struct Report {
    file: String,
    bytes: u64,
    sha256: String,
    /// How the program was called.
    call: String,
    read: Read,
    /// The speakers and their figures.
    tables: Vec<Table>,
    lines: Vec<(&'static str, String)>,
    picture: String,
    scope: Scope,
    listed: Vec<Listed>,
    refused: usize,
    extent: Option<(Time, Time)>,
}

/// A refused frame.
struct Listed {
    encoder: String,
    event: Event,
}

/// Collects what no other printer collects.
struct Gatherer {
    figures: Gathered,
    tables: Vec<Table>,
    lines: Vec<(&'static str, String)>,
    listed: Vec<Listed>,
    refused: usize,
}

impl Printer for Gatherer {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        self.figures.add(origin, event);
        if let Verdict::Refused(_) = event.verdict {
            self.refused += 1;
            if self.listed.len() < LISTED {
                self.listed.push(Listed { encoder: origin.name(origin.speaker(event)), event: event.clone() });
            }
        }
        Ok(())
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        self.tables = self.figures.tables(origin);
        let line = |lane: &servowire_decode::output::printer::Lane| {
            let rate = f64::from(lane.rate) / 1e6;
            (lane.protocol.title, format!("channel {}, {rate} Mbit/s", lane.channel))
        };
        self.lines = origin.lanes.iter().map(line).collect();
        Ok(())
    }
}

impl Arguments {
    pub(crate) fn run(&self) -> ExitCode {
        if let Some(what) = refusal(&[("the capture", &self.file)], &[("--output", Some(&self.output))]) {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
        if self.file.as_os_str() == "-" {
            eprintln!("error: a report needs a file, which it identifies by its SHA-256");
            return ExitCode::from(2);
        }
        match self.report() {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
        }
    }

    /// Returns whether all frames are good.
    fn report(&self) -> Result<bool, Box<dyn Error>> {
        let file = self.file.display().to_string();
        let mut gatherer = Gatherer {
            figures: Gathered::new(None),
            tables: Vec::new(),
            lines: Vec::new(),
            listed: Vec::new(),
            refused: 0,
        };
        let (mut picture, mut scope) = (Picture::new(&file), Scope::new(Wanted::Errors));
        let read = self.reading.decode(&self.file, &mut gatherer, vec![&mut picture, &mut scope], None)?;
        if gatherer.tables.is_empty() {
            return Err(read.fault.unwrap_or_else(|| format!("{file}: no frame in it")).into());
        }
        if let Some(fault) = &read.fault {
            eprintln!("error: {fault}");
        }
        if let Some(refusals) = &read.refusals {
            eprintln!("error: {file}: {refusals}");
        }
        let good = read.fault.is_none() && gatherer.refused == 0;
        let (bytes, sha256) = hash(&self.file)?;
        let report = Report {
            bytes,
            sha256,
            call: ["servowire".to_owned()].into_iter().chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" "),
            read,
            tables: gatherer.tables,
            lines: gatherer.lines,
            picture: picture.draw()?,
            extent: picture.extent(),
            scope,
            listed: gatherer.listed,
            refused: gatherer.refused,
            file,
        };
        let page = html::page(&report)?;
        fs::write(&self.output, page).map_err(|error| format!("{}: {error}", self.output.display()))?;
        Ok(good)
    }
}

/// Returns the size of a file and its SHA-256 in hex.
fn hash(path: &Path) -> io::Result<(u64, String)> {
    let (mut file, mut hasher) = (File::open(path)?, Sha256::new());
    let bytes = io::copy(&mut file, &mut hasher)?;
    Ok((bytes, format!("{:x}", hasher.finalize())))
}
