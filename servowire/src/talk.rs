//! `servowire talk`: a T-Format encoder at a USB-RS485 adapter.

mod act;
pub mod fault;
pub mod link;
pub mod port;
pub mod relay;
pub mod simulate;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use tformat::BitRate;

use link::Link;

use crate::units::tformat_rate;

/// Talk to a T-Format encoder at a USB-RS485 adapter, or be one.
///
/// Exit code 0: it was done; 1: the encoder did not answer as it should, or the port failed; 2: wrong use.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The serial port, as /dev/ttyUSB0 or COM3.
    #[arg(long)]
    port: String,
    /// Bits a second, 2.5M or 5M.
    #[arg(long, value_name = "HZ", default_value = "2.5M", value_parser = tformat_rate)]
    rate: BitRate,
    /// Longest wait for an answer. USB adapters hold short answers back, up to 16 ms.
    #[arg(long, value_name = "MS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    timeout: u64,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Read position, turns and alarms once.
    Read,
    /// Read them again and again, live.
    Watch(Watch),
    /// Say what the encoder and the adapter are.
    Info,
    /// Clear latched alarms. Position and turns stay.
    ClearErrors,
    /// Read or write the EEPROM.
    #[command(subcommand)]
    Eeprom(Eeprom),
    /// Be an encoder, or pass everything on to a real one and log it.
    Simulate(Simulate),
}

#[derive(Debug, Args)]
struct Watch {
    /// Time from one reading to the next.
    #[arg(long, value_name = "MS", default_value_t = 20)]
    period: u64,
    /// End after this many readings.
    #[arg(long)]
    count: Option<u64>,
    /// Write every reading into this file as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Eeprom {
    /// Write all pages into a file of text, a line a page.
    Dump {
        /// The file; the standard output without it.
        file: Option<PathBuf>,
        /// Pages: six in Tamagawa's encoders, eight in a compatible one.
        #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(1..=8))]
        pages: u8,
    },
    /// Write the bytes of such a file that differ. Motor makers keep name plate and commutation data in this memory: a motor
    /// may not run any more with the data of another.
    Restore {
        /// The file.
        file: PathBuf,
        /// Has to be given: the memory is overwritten.
        #[arg(long, required = true)]
        overwrite_eeprom: bool,
        /// Do not ask.
        #[arg(long)]
        yes: bool,
    },
}

#[derive(Debug, Args)]
struct Simulate {
    /// Encoder ID, 0x17 for 23 bits a turn.
    #[arg(long, default_value = "0x17", value_parser = encoder_id)]
    id: u8,
    /// Turns of the shaft a minute.
    #[arg(long, default_value_t = 60.0, allow_negative_numbers = true)]
    rpm: f64,
    /// The adapter hears itself.
    #[arg(long)]
    echo: bool,
    /// The port of a second adapter with a real encoder: requests are passed on to it, answers back, and all of it is printed.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["id", "rpm"])]
    encoder: Option<String>,
    /// Write it into this file as CSV too.
    #[arg(long, value_name = "FILE", requires = "encoder")]
    csv: Option<PathBuf>,
}

fn encoder_id(text: &str) -> Result<u8, String> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.map_err(|_| format!("\"{text}\" is not a byte, as 0x17 or 23"))
}

impl Arguments {
    /// Does what was asked.
    pub fn run(&self) -> ExitCode {
        match self.perform() {
            Ok(code) => code,
            Err(fault) => {
                let name = if fault.names_itself() { String::new() } else { format!("{}: ", self.port) };
                eprintln!("{name}{fault}");
                ExitCode::FAILURE
            }
        }
    }

    /// The encoder at a port that is open.
    fn link<P: port::Port>(&self, port: P) -> Result<Link<P>, fault::Fault> {
        Link::open(port, Duration::from_millis(self.timeout)).map_err(|fault| match fault {
            fault::Fault::Encoder(error) => fault::Fault::Nobody(error, port::megabits(self.rate)),
            fault => fault,
        })
    }

    fn perform(&self) -> Result<ExitCode, fault::Fault> {
        let port = port::open(&self.port, self.rate)?;
        if let What::Simulate(simulate) = &self.what {
            let Simulate { id, rpm, echo, .. } = *simulate;
            let done = if let Some(encoder) = &simulate.encoder {
                let named = |fault: fault::Fault| match fault {
                    fault if fault.names_itself() => fault,
                    fault => fault::Fault::Port(format!("{encoder}: {fault}")),
                };
                let mut link = self.link(port::open(encoder, self.rate)?).map_err(named)?;
                act::relay(port, &mut link, echo, simulate.csv.as_deref())
            } else {
                simulate::run(port, simulate::Encoder { rate: self.rate, id, rpm, echo }, None)
            };
            return done.map(|()| ExitCode::SUCCESS);
        }
        let mut link = self.link(port)?;
        match &self.what {
            What::Read => act::read(&mut link),
            What::Watch(watch) => act::watch(&mut link, watch),
            What::Info => act::info(&mut link, &self.port, self.rate),
            What::ClearErrors => act::clear_errors(&mut link),
            What::Eeprom(Eeprom::Dump { file, pages }) => act::dump(&mut link, file.as_deref(), *pages),
            What::Eeprom(Eeprom::Restore { file, yes, .. }) => act::restore(&mut link, file, *yes),
            What::Simulate(_) => Ok(ExitCode::SUCCESS),
        }
    }
}
