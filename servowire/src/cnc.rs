//! `servowire cnc`: the reference machine, from discovery to the steps of four motors.

mod axis;
mod line;
mod noise;
mod plot;
mod program;
mod record;
mod report;

use std::error::Error;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sorte_proto::sync0::{MAX_LATENCY_NS, Variant};
use step_profile::{Frequency, Motors, Parameters, Profile, Speed};

use line::{Line, Progress, Setup};
use plot::{Curves, Sound};
use program::Program;
use record::Recorder;

/// Runs of more cycles than this have a progress bar.
const LONG: u64 = 2_000_000;
/// Cycles from the end of the motion until its last pulse is over.
const DRAIN: u32 = 5;

/// Run the reference machine: a master, four devices, four stepper motors at 250 kHz.
///
/// Master and devices start up over simulated cables, then exchange data every 4 us: the motion of the axes goes through
/// PTO words and frames into the devices' SYNC0 generators and from there into the motors. Prints the start-up, what the
/// cycle has room for, and what became of every step. The same seed gives the same run.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Devices in the line, a motor each.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=4))]
    devices: u8,
    /// Delay of the cables in ns, the one at the master first; the last stands for those behind it.
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "85")]
    cables: Vec<u16>,
    /// Length of a move in steps; 51200 are a turn at 1/256.
    #[arg(long, value_name = "N", default_value_t = 51_200)]
    steps: u32,
    /// Step frequencies in Hz; they take turns from move to move. 250000, or 249000 with --published-sync0: at 250 kHz
    /// all steps have the same phase, and that machine is at home there.
    #[arg(long, value_name = "HZ", value_delimiter = ',')]
    freq: Vec<u32>,
    /// Steps that each of the 32 ramp entries lasts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    k: u32,
    /// Moves, each back from the one before.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with_all = ["cycles", "dance"])]
    moves: u64,
    /// Move there and back for so many cycles.
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,
    /// Play a tune instead.
    #[arg(long)]
    dance: bool,
    /// The SYNC0 generator of the published device, which loses steps.
    #[arg(long)]
    published_sync0: bool,
    /// From an event of the devices' timers to its handler, in ns.
    #[arg(long, value_name = "NS", default_value_t = 300, value_parser = clap::value_parser!(u16).range(0..=i64::from(MAX_LATENCY_NS)))]
    latency: u16,
    /// Probability that a bit flips on a cable.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    bit_error_rate: f64,
    /// Pull the cable in front of a device in a cycle.
    #[arg(long, value_name = "DEVICE@CYCLE", value_parser = unplug)]
    unplug: Option<(usize, u64)>,
    /// Seed of bit errors, crystals and counters.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write frames, SYNC0, DIR and positions as a VCD.
    #[arg(long, value_name = "OUT")]
    vcd: Option<PathBuf>,
    /// Write the frames at the master for Wireshark.
    #[arg(long, value_name = "OUT")]
    pcapng: Option<PathBuf>,
    /// Cycles that --vcd and --pcapng record, behind the start-up.
    #[arg(long, value_name = "N", default_value_t = 5000)]
    record_cycles: u64,
    /// Draw speed and position of the axes.
    #[arg(long, value_name = "OUT")]
    svg: Option<PathBuf>,
    /// Write the motors' sound.
    #[arg(long, value_name = "OUT")]
    wav: Option<PathBuf>,
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if (0.0..1.0).contains(&p) => Ok(p),
        _ => Err(format!("\"{text}\" is not a probability from 0 to below 1, as 1e-6")),
    }
}

fn unplug(text: &str) -> Result<(usize, u64), String> {
    let parts = text.split_once('@').and_then(|(device, cycle)| Some((device.parse().ok()?, cycle.parse().ok()?)));
    match parts {
        Some((device @ 1..=4, cycle)) => Ok((device, cycle)),
        _ => Err(format!("\"{text}\" is not a device from 1 to 4 and a cycle, as 3@10000")),
    }
}

impl Arguments {
    /// Does it. 0: every step that a good frame carried was made at its time; 1: not so; 2: wrong use.
    pub(crate) fn run(&self) -> ExitCode {
        let program = match self.program() {
            Ok(program) => program,
            Err(error) => {
                eprintln!("error: {error}");
                return ExitCode::from(2);
            }
        };
        match self.simulate(program, &mut BufWriter::new(io::stdout().lock())) {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
        }
    }

    fn motors(&self) -> Motors {
        Motors::new((1 << self.devices) - 1).unwrap_or(Motors::NONE)
    }

    fn program(&self) -> Result<Program, step_profile::Error> {
        let parameters = |speed| Parameters::at(speed).with_steps_per_entry(self.k);
        if self.dance {
            return Program::dance(self.motors(), parameters(Speed::KHZ_100));
        }
        let default = if self.published_sync0 { 249_000 } else { 250_000 };
        let freq = if self.freq.is_empty() { core::slice::from_ref(&default) } else { self.freq.as_slice() };
        let speeds = freq.iter().map(|hz| Speed::from_frequency(Frequency::from_hz(*hz)));
        let profiles: Result<Vec<_>, _> = speeds.map(|speed| Profile::new(parameters(speed?))).collect();
        let moves = if self.cycles.is_some() { u64::MAX } else { self.moves };
        Ok(Program::turns(self.motors(), profiles?, self.steps, moves))
    }

    fn setup(&self) -> Setup {
        let last = self.cables.last().copied().unwrap_or_default();
        let cables_ns = (0..usize::from(self.devices)).map(|k| self.cables.get(k).copied().unwrap_or(last)).collect();
        Setup {
            cables_ns,
            variant: if self.published_sync0 { Variant::Published } else { Variant::Lossless },
            latency_ns: self.latency,
            bit_error_rate: self.bit_error_rate,
            unplug: self.unplug,
            seed: self.seed,
        }
    }

    /// Whether no step was late or lost.
    fn simulate(&self, mut program: Program, out: &mut dyn Write) -> Result<bool, Box<dyn Error>> {
        let setup = self.setup();
        let cables_ns = setup.cables_ns.clone();
        let mut line = Line::new(setup);
        let mut record =
            Recorder::new(line.nodes.len(), self.vcd.as_deref(), self.pcapng.as_deref(), self.record_cycles)?;
        let (mut curves, mut sound) =
            (self.svg.is_some().then(Curves::default), self.wav.is_some().then(Sound::default));
        let bar = self.bar();
        let (mut cycle, mut behind) = (0, 0);
        loop {
            let progress = line.step(&mut || program.next(), &mut record);
            match progress {
                None => break,
                Some(Progress::StartUp) => continue,
                Some(Progress::Cycle) => {}
            }
            if cycle == 0 {
                report::start_up(out, &line, &cables_ns)?;
                out.flush()?;
            }
            cycle += 1;
            if curves.is_some() || sound.is_some() {
                let positions = [0, 1, 2, 3].map(|k| line.nodes.get(k).map_or(0, |node| node.axis.position));
                if let Some(curves) = &mut curves {
                    curves.add(cycle, positions);
                }
                if let Some(sound) = &mut sound {
                    sound.add(cycle, positions);
                }
            }
            if cycle % 65_536 == 0 {
                bar.set_position(cycle);
            }
            behind = if program.is_over() { behind + 1 } else { 0 };
            if self.cycles.map_or(behind > DRAIN, |cycles| cycle >= cycles) {
                break;
            }
        }
        bar.finish_and_clear();
        record.finish()?;
        report::end(out, &line)?;
        out.flush()?;
        if let (Some(curves), Some(path)) = (&curves, &self.svg) {
            curves.draw(line.nodes.len(), path)?;
        }
        if let (Some(sound), Some(path)) = (&sound, &self.wav) {
            sound.write(path)?;
        }
        Ok(line.nodes.iter().all(|node| node.axis.tally.late == 0 && node.axis.tally.lost == 0))
    }

    fn bar(&self) -> ProgressBar {
        let cycles = self.cycles.unwrap_or(0);
        if cycles < LONG || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{pos}/{len} cycles [{bar:40}] {per_sec}, {eta} left");
        ProgressBar::new(cycles).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
    }
}
