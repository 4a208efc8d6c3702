//! The command line.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::decode::Decode;
use crate::terminal::say;
use crate::{cnc, decode, explain, profile, registers, report, talk, timing};

/// Decodes what servo drives, controllers and encoders say to each other.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Commands whose arguments are a type are described there: a comment here would take the place of their description.
#[derive(Debug, Subcommand)]
enum Command {
    Decode(Decode),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Profile(profile::Arguments),
    Cnc(cnc::Arguments),
    Talk(talk::Arguments),
    Timing(timing::Arguments),
    Registers(registers::Arguments),
    /// Print completions for a shell; save them where the shell looks for them.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page of the program or of a command: `servowire man decode | man -l -`.
    Man {
        /// The command.
        command: Option<String>,
    },
}

impl Cli {
    /// Does what was asked. 0: all frames good; 1: a frame was refused, or a file could not be decoded.
    pub fn run(self) -> ExitCode {
        match self.command {
            Command::Decode(arguments) => decode::run(&arguments),
            Command::Report(arguments) => arguments.run(),
            Command::Explain(arguments) => arguments.run(),
            Command::Profile(arguments) => arguments.run(),
            Command::Cnc(arguments) => arguments.run(),
            Command::Talk(arguments) => arguments.run(),
            Command::Timing(arguments) => arguments.run(),
            Command::Registers(arguments) => arguments.run(),
            Command::Completions { shell } => {
                let mut text = Vec::new();
                clap_complete::generate(shell, &mut Self::command(), "servowire", &mut text);
                print(&text)
            }
            Command::Man { command } => man(command.as_deref()),
        }
    }
}

fn print(text: &[u8]) -> ExitCode {
    match say(format_args!("{}", String::from_utf8_lossy(text))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: cannot write: {e}");
            ExitCode::FAILURE
        }
    }
}

fn man(command: Option<&str>) -> ExitCode {
    let mut whole = Cli::command();
    whole.build();
    let page = match command {
        None => Some(whole),
        Some(name) => whole.find_subcommand(name).cloned(),
    };
    let Some(page) = page else {
        eprintln!("error: there is no command {:?}", command.unwrap_or_default());
        return ExitCode::from(2);
    };
    let mut text = Vec::new();
    match clap_mangen::Man::new(page).render(&mut text) {
        Ok(()) => print(sections(&String::from_utf8_lossy(&text), command == Some("decode")).as_bytes()),
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// With the names that manual pages have for examples and exit codes. `drives`: a drive may need attention.
fn sections(page: &str, drives: bool) -> String {
    let page = page.replace(".SH EXTRA\nExamples:\n", ".SH EXAMPLES\n.nf\n");
    let status = ".fi\n.SH \"EXIT STATUS\"\n.TP\n0\nEverything is good.\n.TP\n1\nA frame was refused, or a file could not be \
                  read or written.\n.TP\n2\nWrong use.\n";
    let more =
        if drives { ".TP\n4\nAll frames are good, but a drive needs attention.\n.TP\n5\nBoth 1 and 4.\n" } else { "" };
    format!("{}\n{status}{more}", page.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manual_pages_have_examples_and_exit_codes() {
        let mut whole = Cli::command();
        whole.build();
        for name in ["decode", "report", "explain"] {
            let mut text = Vec::new();
            clap_mangen::Man::new(whole.find_subcommand(name).unwrap().clone()).render(&mut text).unwrap();
            let page = sections(&String::from_utf8(text).unwrap(), name == "decode");
            assert_eq!(page.ends_with("\n.TP\n5\nBoth 1 and 4.\n"), name == "decode", "{page}");
            assert!(page.contains(&format!(".SH EXAMPLES\n.nf\n  servowire {name} ")), "{page}");
            assert!(page.contains("\n.fi\n.SH \"EXIT STATUS\"\n") && !page.contains("EXTRA"), "{page}");
        }
    }

    /// The description of a command is longer than its line in the list of commands, with --help and in its manual page.
    #[test]
    fn commands_describe_themselves() {
        let mut whole = Cli::command();
        whole.build();
        for (name, want) in [
            ("decode", "Prints one transaction per line"),
            ("report", "SHA-256 of the capture"),
            ("explain", "Exit code 0: the frame holds"),
            ("profile", "(100 kHz, 400000 steps/s² and none)"),
            ("cnc", "The same seed gives the same run"),
            ("talk", "Exit code 0: done"),
            ("registers", "Exit code 0: the map could be read"),
        ] {
            let command = whole.find_subcommand_mut(name).unwrap();
            let mut text = Vec::new();
            clap_mangen::Man::new(command.clone()).render(&mut text).unwrap();
            let page = String::from_utf8(text).unwrap().replace('\n', " ").replace("\\-", "-");
            let help = command.render_long_help().to_string().replace('\n', " ");
            assert!(help.contains(want) && page.contains(want), "{help}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
