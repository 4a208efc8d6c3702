//! `servowire talk`: a T-Format encoder at a USB-RS485 adapter.

mod act;
pub mod backup;
pub mod encoder;
pub mod fault;
pub mod link;
pub mod port;
pub mod record;
pub mod relay;
pub mod simulate;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use servowire_decode::fault::printable;
use tformat::BitRate;

use act::Print;
use encoder::Encoder;
use link::Link;
use record::Recorded;

use crate::overwrite::refusal;
use crate::units::tformat_rate;

/// Talk to a T-Format encoder through a USB-RS485 adapter, or act as one.
///
/// Exit code 0: done; 1: the encoder did not answer as it should, or the port failed; 2: wrong use.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The serial port, such as /dev/ttyUSB0 or COM3.
    #[arg(long)]
    port: String,
    /// Bits per second, 2.5M or 5M.
    #[arg(long, value_name = "HZ", default_value = "2.5M", value_parser = tformat_rate)]
    rate: BitRate,
    /// Longest wait for an answer. USB adapters may hold short answers back for up to 16 ms.
    #[arg(long, value_name = "MS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    timeout: u64,
    /// Print JSON, one object per line.
    #[arg(long, global = true)]
    json: bool,
    /// Write all bytes sent and received into this file, with their times; servowire decode reads it.
    #[arg(long, value_name = "FILE", global = true)]
    log: Option<PathBuf>,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Read position, turns and alarms once.
    Read,
    /// Read position, turns and alarms continuously.
    Watch(Watch),
    /// Identify the encoder and the adapter.
    Info,
    /// Clear latched alarms. Position and turns stay.
    ClearErrors,
    /// Set the turns to 0, clear all errors and read both back. The multi-turn reference of the machine is lost.
    ZeroTurns {
        /// Required: afterwards the machine no longer knows where it is.
        #[arg(long, required = true)]
        lose_multi_turn_reference: bool,
        /// Turns by which the count may differ from 0 afterwards: a shaft at the boundary of a turn may waver.
        #[arg(long, value_name = "TURNS", default_value_t = 1)]
        tolerance: u32,
        /// Do not ask for confirmation.
        #[arg(long)]
        yes: bool,
    },
    /// Make the present position the zero of the turn and read it back. This shifts the commutation angle: a motor whose drive
    /// commutates by this encoder puts its current into the wrong phases and may run away. The shaft has to stand still.
    ZeroSingleTurn {
        /// Required: this is for encoders that are being fitted, never for a motor in service.
        #[arg(long, required = true)]
        shift_commutation_angle: bool,
        /// Counts by which the position may differ from 0 afterwards.
        #[arg(long, value_name = "COUNTS")]
        tolerance: u32,
        /// Do not ask for confirmation.
        #[arg(long)]
        yes: bool,
    },
    /// Read or write the EEPROM.
    #[command(subcommand)]
    Eeprom(Eeprom),
    /// Act as an encoder, or pass everything on to a real one and log it.
    Simulate(Simulate),
}

#[derive(Debug, Args)]
struct Watch {
    /// Time from one reading to the next.
    #[arg(long, value_name = "MS", default_value_t = 20)]
    period: u64,
    /// Stop after this many readings.
    #[arg(long)]
    count: Option<u64>,
    /// Write every reading into this file as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Eeprom {
    /// Write all pages into a file, with encoder ID, widths, date and checksum. The page that was selected before is selected
    /// again.
    #[command(visible_alias = "dump")]
    Backup {
        /// The file, which must not exist yet; standard output by default.
        file: Option<PathBuf>,
        /// Pages: six in Tamagawa's encoders, eight in a compatible one.
        #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(1..=8))]
        pages: u8,
    },
    /// Write those bytes of a backup that differ into an encoder of the same kind. Motor makers keep name plate and commutation
    /// data in this memory: a motor may no longer run with the data of another.
    Restore {
        /// The backup.
        file: PathBuf,
        /// Required: the memory is overwritten.
        #[arg(long, required = true)]
        overwrite_eeprom: bool,
        /// Where to save the memory before it is overwritten; by default beside the backup, with the time in the file's name.
        #[arg(long, value_name = "FILE")]
        before: Option<PathBuf>,
        /// Do not ask for confirmation.
        #[arg(long)]
        yes: bool,
    },
}

#[derive(Debug, Args)]
struct Simulate {
    /// Encoder ID, such as 0x17 for 23 bits per turn.
    #[arg(long, default_value = "0x17", value_parser = encoder_id)]
    id: u8,
    /// Speed of the shaft in turns per minute.
    #[arg(long, default_value_t = 60.0, allow_negative_numbers = true)]
    rpm: f64,
    /// The adapter hears its own transmissions.
    #[arg(long)]
    echo: bool,
    /// The port of a second adapter with a real encoder: requests are passed on to it, its answers are passed back, and everything is printed.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["id", "rpm"])]
    encoder: Option<String>,
    /// Also write this log into a CSV file.
    #[arg(long, value_name = "FILE", requires = "encoder")]
    csv: Option<PathBuf>,
}

fn encoder_id(text: &str) -> Result<u8, String> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.map_err(|_| format!("\"{text}\" is not a byte, such as 0x17 or 23"))
}

impl Arguments {
    /// Runs the command.
    pub fn run(&self) -> ExitCode {
        if let Some(what) = self.overwrites() {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
        match self.perform() {
            Ok(code) => code,
            Err(fault) => {
                let name = if fault.names_itself() { String::new() } else { format!("{}: ", self.port) };
                eprintln!("error: {}", printable(&format!("{name}{fault}")));
                ExitCode::FAILURE
            }
        }
    }

    /// Returns what to say if an output is the backup, or the same file as another output.
    fn overwrites(&self) -> Option<String> {
        let (backup, output) = match &self.what {
            What::Watch(Watch { csv, .. }) | What::Simulate(Simulate { csv, .. }) => (None, ("--csv", csv.as_deref())),
            What::Eeprom(Eeprom::Backup { file, .. }) => (None, ("the backup", file.as_deref())),
            What::Eeprom(Eeprom::Restore { file, before, .. }) => (Some(file), ("--before", before.as_deref())),
            _ => (None, ("", None)),
        };
        let backup = backup.map(|file| ("the backup", file.as_path()));
        refusal(backup.as_slice(), &[("--log", self.log.as_deref()), output])
    }

    /// Returns the encoder at an open port.
    fn link<P: port::Port>(&self, port: P) -> Result<Link<P>, fault::Fault> {
        Link::open(port, Duration::from_millis(self.timeout)).map_err(|fault| match fault {
            fault::Fault::Encoder(error) => fault::Fault::Nobody(error, port::megabits(self.rate)),
            fault => fault,
        })
    }

    fn perform(&self) -> Result<ExitCode, fault::Fault> {
        let port = port::open(&self.port, self.rate)?;
        let print = if self.json { Print::Json } else { Print::Text };
        if let What::Simulate(simulate) = &self.what {
            let Simulate { id, rpm, echo, .. } = *simulate;
            let done = if let Some(encoder) = &simulate.encoder {
                let named = |fault: fault::Fault| match fault {
                    fault if fault.names_itself() => fault,
                    fault => fault::Fault::Port(format!("{encoder}: {fault}")),
                };
                let encoder = Recorded::new(port::open(encoder, self.rate)?, self.log.as_deref())?;
                let mut link = self.link(encoder).map_err(named)?;
                act::relay(port, &mut link, echo, simulate.csv.as_deref(), print)
            } else {
                let port = Recorded::new(port, self.log.as_deref())?;
                simulate::run(port, simulate::Simulated { rate: self.rate, id, rpm, echo }, None)
            };
            return done.map(|()| ExitCode::SUCCESS);
        }
        let encoder = &mut Encoder::from(self.link(Recorded::new(port, self.log.as_deref())?)?);
        match &self.what {
            What::Read => act::read(encoder, print),
            What::Watch(watch) => act::watch(encoder, watch, print),
            What::Info => act::info(encoder, &self.port, self.rate, print),
            What::ClearErrors => act::clear_errors(encoder, print),
            What::ZeroTurns { tolerance, yes, .. } => act::zero_turns(encoder, *yes, *tolerance, print),
            What::ZeroSingleTurn { tolerance, yes, .. } => act::zero_single_turn(encoder, *yes, *tolerance, print),
            What::Eeprom(Eeprom::Backup { file, pages }) => {
                act::memory::backup(encoder, file.as_deref(), *pages, print)
            }
            What::Eeprom(Eeprom::Restore { file, before, yes, .. }) => {
                act::memory::restore(encoder, file, before.as_deref(), *yes, print)
            }
            What::Simulate(_) => Ok(ExitCode::SUCCESS),
        }
    }
}
