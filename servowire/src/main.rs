//! The program `servowire`: its commands are in the library, module `cli`.

use std::io;
use std::process::ExitCode;

use clap::Parser;
use servowire::cli::Cli;

fn main() -> ExitCode {
    match Cli::try_parse() {
        Ok(cli) => cli.run(),
        // Help and version come this way too.
        Err(said) => match said.print() {
            Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
                eprintln!("error: cannot write: {e}");
                ExitCode::FAILURE
            }
            _ => ExitCode::from(if said.use_stderr() { 2 } else { 0 }),
        },
    }
}
