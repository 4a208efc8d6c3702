//! The program `servowire`: its commands are in the library, module `cli`.

use std::process::ExitCode;

use clap::Parser;
use servowire::cli::Cli;

fn main() -> ExitCode {
    Cli::parse().run()
}
