//! `cargo run --release -p conformance -- [--protocol NAME] [DIR]`
#![allow(clippy::std_instead_of_core)]

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

/// Runs reference vectors against the servowire crates.
#[derive(Parser)]
struct Arguments {
    /// Take DIR itself as the vectors of this protocol (tformat, nikon, hdsl, rtex, sorte, step-profile).
    #[arg(long, value_name = "NAME")]
    protocol: Option<String>,
    /// How many failing rows of a file are shown.
    #[arg(long, value_name = "N", default_value_t = 3)]
    show: usize,
    /// Folder with a sub-folder a protocol; the project's own vectors by default.
    #[arg(default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/vectors"), hide_default_value = true)]
    dir: PathBuf,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let report = match &arguments.protocol {
        Some(name) => conformance::run_protocol(name, &arguments.dir),
        None => conformance::run_all(&arguments.dir),
    };
    for topic in &report.topics {
        println!("{topic}");
        for failure in topic.failures.iter().take(arguments.show) {
            println!("    {failure}");
        }
        if topic.failures.len() > arguments.show {
            println!("    ... and {} more", topic.failures.len().saturating_sub(arguments.show));
        }
    }
    for error in &report.errors {
        eprintln!("error: {error}");
    }
    if report.passed() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
