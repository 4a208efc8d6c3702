//! `servowire timing`: who is on the line when, how short a cycle can be, and what the worst fault costs.

mod drawing;
mod nikon;
mod tformat;

use std::error::Error;
use std::fmt;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use crate::overwrite::refusal;
use crate::terminal::say;

/// Show the timing of a line with encoders: who sends when, the shortest cycle and the worst fault of an exchange.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    protocol: Protocol,
    /// Draw the cycle into this file.
    #[arg(long, global = true, value_name = "OUT")]
    svg: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Protocol {
    /// One Tamagawa T-Format encoder.
    Tformat(tformat::Arguments),
    /// Nikon A-format encoders, one or several on a bus.
    Nikon(nikon::Arguments),
}

impl Arguments {
    /// Prints the plan, or draws it. 1: it could not be written; 2: it could not be made.
    pub fn run(&self) -> ExitCode {
        if let Some(what) = refusal(&[], &[("--svg", self.svg.as_deref())]) {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
        let plan = match &self.protocol {
            Protocol::Tformat(arguments) => arguments.plan(),
            Protocol::Nikon(arguments) => arguments.plan(),
        };
        match plan.map(|plan| self.write(&plan)) {
            Ok(Ok(())) => ExitCode::SUCCESS,
            Ok(Err(error)) => {
                eprintln!("error: cannot write: {error}");
                ExitCode::FAILURE
            }
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::from(2)
            }
        }
    }

    fn write(&self, plan: &Plan) -> Result<(), Box<dyn Error>> {
        if let Some(path) = &self.svg {
            fs::write(path, drawing::svg(plan)?).map_err(|error| format!("{}: {error}", path.display()))?;
        } else {
            say(format_args!("{plan}"))?;
        }
        Ok(())
    }
}

/// Why there is no cycle: the controller takes no response that begins then.
const SOON: &str = "the response begins so soon after the request that the controller does not accept it as an answer";
const LATE: &str = "the response begins so late that the controller has stopped waiting for it";

/// An action of one party, in ns from the start of the request.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Bar {
    who: &'static str,
    what: String,
    start_ns: i64,
    end_ns: i64,
}

/// One cycle of an exchange.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Plan {
    title: String,
    bars: Vec<Bar>,
    /// Shortest time from the start of one request to the start of the next.
    cycle_ns: u64,
    /// Longest time from the start of a request that fails to the start of the next.
    fault_ns: u64,
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = |ns: i64| ns as f64 / 1000.0;
        writeln!(f, "{}", self.title)?;
        for Bar { who, what, start_ns, end_ns } in &self.bars {
            writeln!(f, "  {who:<10}  {:>7.2} .. {:>6.2} us  {what}", us(*start_ns), us(*end_ns))?;
        }
        let (cycle, fault) = (us(self.cycle_ns as i64), us(self.fault_ns as i64));
        writeln!(f, "shortest cycle {cycle:.2} us, {:.1} kHz", 1000.0 / cycle)?;
        writeln!(f, "after the worst fault the line is free {fault:.2} us after the start of the request")
    }
}
