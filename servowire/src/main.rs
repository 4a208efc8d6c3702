//! `servowire decode [FILES...]`

use std::process::ExitCode;

use clap::Parser;
use servowire::cli::Cli;

fn main() -> ExitCode {
    Cli::parse().run()
}
