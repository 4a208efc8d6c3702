//! `servowire cnc`: the reference machine, from discovery to the steps of its motors.

mod axis;
mod clock;
mod driver;
mod feed;
mod host;
#[cfg(test)]
mod landing;
mod line;
mod node;
mod noise;
mod periods;
mod plot;
mod power;
mod program;
mod queue;
mod record;
mod report;
mod scaling;
mod setup;
mod wires;

use std::error::Error;
use std::fmt;
use std::fs;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sorte_proto::sync0::Variant;
use step_motion::Limits;
use step_profile::{Frequency, Motors, Parameters, Profile, Speed};

use crate::drawing::Drawn;
use crate::gcode::{AXES, Part};
use crate::overwrite::refusal;
use crate::units::{acceleration, jerk, of_frequency};
use servowire_decode::time;

use axis::Build;
use driver::Fault;
use host::Host;
use line::{Line, Progress};
use plot::{Curves, Sound};
use power::Power;
use program::Program;
use record::Recorder;
use setup::Setup;
use wires::{LONGEST_CABLE_NS, Physics};

/// Steps/s of an axis: one in each cycle of 4 us.
const MOST_STEPS: u32 = 250_000;

/// Steps of a move: a turn at 1/256.
const STEPS: u32 = 51_200;

/// Cycles in a recording, if nothing else is asked for.
const RECORDED: u64 = 5000;

/// Runs of more cycles than this have a progress bar.
const LONG: u64 = 2_000_000;

/// Run the reference machine: a master, up to 254 devices, stepper motors at up to 250 kHz.
///
/// Master and devices start up over simulated cables, then exchange data every 4 us, or at the shortest cycle that the line
/// allows: the motion of the axes goes through PTO words and frames into the devices' SYNC0 generators and from there into the
/// motors.
/// Each device runs on its own crystal; frames, slots, data and pulses are where its counter puts them. Prints the
/// start-up, what fits into the cycle, and what became of every step. The same seed gives the same run. With --gcode the
/// first three axes follow a part program, each within the first --freq (100000), --accel and --jerk.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Devices in the line, with one motor each.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=254))]
    devices: u8,
    /// Delay of the cables in ns, 500 at most (100 m), starting at the master; the last one stands for all that follow.
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "85")]
    cables: Vec<u16>,
    /// Cycle of the IO exchange in ns, a multiple of 4000; by default the shortest that the line allows.
    #[arg(long, value_name = "NS", value_parser = cycle_time)]
    cycle_time: Option<u32>,
    /// Print cycle time against devices, cable and payload, and stop; with --svg, draw it.
    #[arg(long, conflicts_with_all = ["dance", "independent", "vcd", "pcapng", "wav"])]
    scaling: bool,
    /// Length of a move in steps; 51200 steps are one turn at 1/256.
    #[arg(long, value_name = "N", conflicts_with = "dance", default_value_t = STEPS, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Step frequencies in Hz; they take turns from move to move. 250000, or 249000 with --published-sync0: at 250 kHz
    /// all steps have the same phase, which suits that machine. In a longer cycle motion is slower in proportion.
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = hertz, conflicts_with = "dance")]
    freq: Vec<u32>,
    /// Steps that each of the 32 ramp entries lasts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    k: u32,
    /// Number of moves, each back from the one before.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["cycles", "dance"])]
    moves: u64,
    /// Move there and back for this many cycles, then come to rest.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    cycles: Option<u64>,
    /// Give each axis its own move: different lengths, and the frequencies in turn.
    #[arg(long, conflicts_with = "dance")]
    independent: bool,
    /// Play a tune instead.
    #[arg(long)]
    dance: bool,
    #[command(flatten)]
    part: Part,
    /// Greatest acceleration of an axis of a part program, in steps/s².
    #[arg(long, value_name = "A", requires = "gcode", default_value_t = Part::ACCELERATION, value_parser = acceleration)]
    accel: u32,
    /// Its greatest jerk, in steps/s³; without it the profile is a trapezoid.
    #[arg(long, value_name = "J", requires = "gcode", value_parser = jerk)]
    jerk: Option<u64>,
    /// Use the devices as published: their SYNC0 generator loses steps, and they repeat the last word when a frame is lost.
    #[arg(long)]
    published_sync0: bool,
    /// Leave the command words free, as the reference design does; by default they carry positions, so that an axis that missed
    /// a frame catches up (an extension of this project).
    #[arg(long)]
    no_positions: bool,
    /// Steps by which an axis may lag before the motion is stopped.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u16).range(1..=16_000))]
    max_lag: u16,
    /// From an event of the devices' timers to its handler, in ns. Latency and seven writes below 600 ns lose nothing.
    #[arg(long, value_name = "NS", default_value_t = 300, value_parser = clap::value_parser!(u16).range(0..=2000))]
    latency: u16,
    /// Time of each register write of the handler, in ns.
    #[arg(long, value_name = "NS", default_value_t = 20, value_parser = clap::value_parser!(u16).range(0..=200))]
    write_time: u16,
    /// Largest error of the devices' crystals, in ppm either way.
    #[arg(long, value_name = "PPM", default_value_t = 50.0, value_parser = amount)]
    crystal: f64,
    /// Largest growth of a crystal's error in a second, in ppm.
    #[arg(long, value_name = "PPM", default_value_t = 1.0, value_parser = amount)]
    drift: f64,
    /// Largest error of the capture of a frame's start, in ns either way.
    #[arg(long, value_name = "NS", default_value_t = 5.0, value_parser = amount)]
    jitter: f64,
    /// Rms of what each port adds to a frame that passes it, in ns. 1.443 is a port that samples at 200 MHz, 11.547 one that
    /// re-times to 25 MHz; six sigma of all ports must fit into the gap between two device frames.
    #[arg(long, value_name = "NS", default_value_t = 1.443, value_parser = amount)]
    hop_jitter: f64,
    /// Ns by which the way back over each cable is longer than the way out: half of it is an error of the clocks.
    #[arg(long, value_name = "NS", default_value_t = 0.0, value_parser = amount)]
    asymmetry: f64,
    /// A pulse further from its time is late, in ns; 100, and 2 more for each device.
    #[arg(long, value_name = "NS", value_parser = amount)]
    tolerance: Option<f64>,
    /// Probability that a bit flips on a cable.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    bit_error_rate: f64,
    /// Probability that a frame of the exchange is lost on a cable.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    loss: f64,
    /// Probability that a frame of the exchange comes twice, the second time 6 us later.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability)]
    duplicates: f64,
    /// Send a damaged DISCOVERY again instead of starting again (an extension of this project).
    #[arg(long)]
    patient_discovery: bool,
    /// Pull the cable in front of a device in a cycle.
    #[arg(long, value_name = "DEVICE@CYCLE", value_parser = incident)]
    unplug: Option<(usize, u64)>,
    /// The motor driver of a device shuts down in a cycle: over-current, or the fault named, such as 2@500=BPDF, =unpowered
    /// or =reset.
    #[arg(long, value_name = "DEVICE@CYCLE", value_parser = driver_fault)]
    driver_fault: Option<(usize, u64, Fault)>,
    /// Switch a motor driver off when its axis has had no step for this many cycles; waking it takes 1 ms.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(20..))]
    power_save: Option<u32>,
    /// Seed of bit errors, crystals and counters.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write frames, SYNC0, DIR and positions as a VCD.
    #[arg(long, value_name = "OUT")]
    vcd: Option<PathBuf>,
    /// Write the frames at the master for Wireshark.
    #[arg(long, value_name = "OUT")]
    pcapng: Option<PathBuf>,
    /// Cycles that --vcd and --pcapng record, after the start-up; 5000 by default.
    #[arg(long, value_name = "N")]
    record_cycles: Option<u64>,
    /// Draw speed and position of the first four axes, or the scaling.
    #[arg(long, value_name = "OUT")]
    svg: Option<PathBuf>,
    /// Write the motors' sound.
    #[arg(long, value_name = "OUT")]
    wav: Option<PathBuf>,
}

/// A frequency that fits into 32 bits.
fn hertz(text: &str) -> Result<u32, String> {
    match time::frequency(text).map(f64::round) {
        Some(hertz) if (1.0..=f64::from(u32::MAX)).contains(&hertz) => Ok(hertz as u32),
        _ => Err(format!("\"{text}\" is not a frequency from 1 Hz to 4 GHz, such as 100k or 250000")),
    }
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if (0.0..1.0).contains(&p) => Ok(p),
        _ => Err(format!("\"{text}\" is not a probability from 0 to below 1, such as 1e-6")),
    }
}

fn amount(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(amount) if (0.0..=10_000.0).contains(&amount) => Ok(amount),
        _ => Err(format!("\"{text}\" is not a number from 0 to 10000")),
    }
}

fn cycle_time(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(ns @ 4000..=4_000_000) if ns % 4000 == 0 => Ok(ns),
        _ => Err(format!("\"{text}\" is not a multiple of 4000 ns up to 4 ms")),
    }
}

fn incident(text: &str) -> Result<(usize, u64), String> {
    let parts = text.split_once('@').and_then(|(device, cycle)| Some((device.parse().ok()?, cycle.parse().ok()?)));
    match parts {
        Some((device @ 1..=254, cycle)) => Ok((device, cycle)),
        _ => Err(format!("\"{text}\" is not a device from 1 to 254 and a cycle, such as 3@10000")),
    }
}

fn driver_fault(text: &str) -> Result<(usize, u64, Fault), String> {
    let (place, name) = text.split_once('=').unwrap_or((text, "AOCP"));
    let (device, cycle) = incident(place)?;
    let fault = Fault::parse(name);
    let names = "OTS, AOCP, BOCP, APDF, BPDF, UVLO, STD, STDLAT, unpowered, reset";
    fault.map(|fault| (device, cycle, fault)).ok_or_else(|| format!("\"{name}\" is not one of {names}"))
}

impl Arguments {
    /// Does it. 0: every step that was asked for was made at its time; 1: not so, and one line says what was wrong; 2: wrong
    /// use.
    pub(crate) fn run(&self) -> ExitCode {
        let mut out = BufWriter::new(io::stdout().lock());
        let scaling = (self.scaling && self.part.gcode.is_some()).then(|| "--scaling runs no part program".to_owned());
        if let Some(what) = scaling.or_else(|| self.overwrites()) {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
        if self.scaling {
            let drawn = self.svg.as_deref().map_or(Ok(()), |path| draw(path, scaling::draw));
            let table = scaling::table(&mut out).and_then(|()| out.flush());
            return match table.map_err(Into::into).and(drawn) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => failed(error.as_ref()),
            };
        }
        let program = match self.program() {
            Ok(program) => program,
            Err(error) => {
                eprintln!("error: {error}");
                return ExitCode::from(2);
            }
        };
        match self.simulate(program, &mut out) {
            Ok(None) => ExitCode::SUCCESS,
            Ok(Some(why)) => {
                // The report comes first.
                let _: io::Result<()> = out.flush();
                eprintln!("failed: {why}");
                ExitCode::FAILURE
            }
            Err(error) => failed(error.as_ref()),
        }
    }

    /// Returns what to say if an output is the part program, or the same file as another output.
    fn overwrites(&self) -> Option<String> {
        let outputs = [("--vcd", &self.vcd), ("--pcapng", &self.pcapng), ("--svg", &self.svg), ("--wav", &self.wav)];
        refusal(self.part.source().as_slice(), &outputs.map(|(option, path)| (option, path.as_deref())))
    }

    fn program(&self) -> Result<Program, Box<dyn Error>> {
        let devices = self.driver_fault.map(|(device, ..)| device);
        for device in self.unplug.map(|(device, _)| device).into_iter().chain(devices) {
            if device > usize::from(self.devices) {
                return Err(format!("there is no device {device}: the line has {} (--devices)", self.devices).into());
            }
        }
        if self.record_cycles.is_some() && self.vcd.is_none() && self.pcapng.is_none() {
            return Err("--record-cycles is for --vcd and --pcapng".into());
        }
        if let Some((k, ns)) = self.cables.iter().enumerate().find(|(_, ns)| **ns > LONGEST_CABLE_NS) {
            return Err(format!(
                "the cable in front of device {} delays by {ns} ns: 100BASE-TX ends at 100 m, which are {LONGEST_CABLE_NS} ns",
                k + 1
            )
            .into());
        }
        if let Some(path) = &self.part.gcode {
            if usize::from(self.devices) < AXES || self.dance || self.independent || self.cycles.is_some() {
                return Err("--gcode moves X, Y and Z, and nothing else: it needs three devices, and no --dance, --independent or --cycles".into());
            }
            if self.steps != STEPS || self.moves != 1 || self.k != 1 {
                return Err("--steps, --moves and --k are for moves, and not for --gcode".into());
            }
            if self.freq.len() > 1 {
                return Err("a part program has one --freq, the greatest of each axis".into());
            }
            self.part.check(path)?;
            let limits = Limits::new(self.freq.first().copied().unwrap_or(Part::SPEED), self.accel)?;
            let limits = self.jerk.map_or(Ok(limits), |jerk| limits.with_jerk(jerk))?;
            self.part.within(limits, MOST_STEPS).map_err(|what| format!("{what}: a step in each cycle of 4 us"))?;
            return Ok(Program::part(self.part.steps(path, limits)?));
        }
        // Programs of four motors repeat them for the axes after the fourth.
        let motors = Motors::new((1 << self.devices.min(4)) - 1).unwrap_or_default();
        let parameters = |speed| Parameters::at(speed).with_steps_per_entry(self.k);
        if self.dance {
            return Ok(Program::dance(motors, parameters(Speed::KHZ_100))?);
        }
        let default = if self.published_sync0 { 249_000 } else { 250_000 };
        let freq = if self.freq.is_empty() { core::slice::from_ref(&default) } else { self.freq.as_slice() };
        let profile = |hz: &u32| {
            let speed = Speed::from_frequency(Frequency::from_hz(*hz));
            speed.and_then(|speed| Profile::new(parameters(speed))).map_err(|error| of_frequency(error, (*hz).into()))
        };
        let profiles: Result<Vec<_>, _> = freq.iter().map(profile).collect();
        let moves = if self.cycles.is_some() { u64::MAX } else { self.moves };
        if self.independent {
            return Ok(Program::independent(self.devices.into(), &profiles?, self.steps, moves));
        }
        Ok(Program::turns(motors, profiles?, self.steps, moves))
    }

    fn setup(&self) -> Setup {
        let last = self.cables.last().copied().unwrap_or_default();
        let cables_ns = (0..usize::from(self.devices)).map(|k| self.cables.get(k).copied().unwrap_or(last)).collect();
        let build = Build {
            variant: if self.published_sync0 { Variant::Published } else { Variant::Lossless },
            latency_ns: self.latency,
            write_ns: self.write_time,
            tolerance_ns: self.tolerance.unwrap_or(100.0 + 2.0 * f64::from(self.devices)),
        };
        Setup {
            cables_ns,
            cycle_ns: self.cycle_time,
            build,
            physics: Physics {
                asymmetry_ns: self.asymmetry,
                hop_jitter_ns: self.hop_jitter,
                capture_jitter_ns: self.jitter,
                bit_error_rate: self.bit_error_rate,
                loss: self.loss,
                duplicates: self.duplicates,
            },
            crystal_ppm: self.crystal,
            drift_ppm: self.drift,
            unplug: self.unplug,
            driver_fault: self.driver_fault,
            positions: !(self.no_positions || self.published_sync0),
            patient: self.patient_discovery,
            max_lag: self.max_lag,
            seed: self.seed,
        }
    }

    /// What was wrong, if anything was.
    fn simulate(&self, program: Program, out: &mut dyn Write) -> Result<Option<String>, Box<dyn Error>> {
        let mut line = Line::new(self.setup());
        let axes = line.nodes.len();
        let cycle_ns = line.setup.cycle_ns();
        let program = Power::new(program, axes, self.power_save, cycle_ns);
        let mut host = Host::new(program, axes, self.cycles, self.max_lag);
        let (vcd, pcapng) = (self.vcd.as_deref(), self.pcapng.as_deref());
        let mut record = Recorder::new(axes, vcd, pcapng, self.record_cycles.unwrap_or(RECORDED), cycle_ns)?;
        let mut curves = self.svg.is_some().then(|| Curves::new(cycle_ns));
        let mut sound = self.wav.as_deref().map(|path| Sound::create(path, cycle_ns)).transpose()?;
        let bar = self.bar();
        let mut cycle = 0;
        while let Some(progress) = line.step(&mut host, &mut record) {
            if matches!(progress, Progress::StartUp) {
                continue;
            }
            if cycle == 0 {
                report::start_up(out, &line)?;
                out.flush()?;
            }
            cycle += 1;
            if curves.is_some() || sound.is_some() {
                let positions = [0, 1, 2, 3].map(|k| line.nodes.get(k).map_or(0, |node| node.axis.position));
                if let Some(curves) = &mut curves {
                    curves.add(cycle, positions);
                }
                if let Some(sound) = &mut sound {
                    sound.add(cycle, positions)?;
                }
            }
            if cycle % 65_536 == 0 {
                bar.set_position(cycle);
            }
            if host.is_done() {
                break;
            }
        }
        bar.finish_and_clear();
        record.finish()?;
        report::end(out, &line, &host)?;
        out.flush()?;
        if let (Some(curves), Some(path)) = (&curves, &self.svg) {
            draw(path, || curves.draw(axes))?;
        }
        if let Some(sound) = sound {
            sound.finish()?;
        }
        Ok(report::verdict(&line, &host))
    }

    fn bar(&self) -> ProgressBar {
        if self.part.gcode.is_some() && io::stderr().is_terminal() {
            let style = ProgressStyle::with_template("{pos} cycles {spinner} {per_sec}, {elapsed}");
            return ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        }
        let cycles = self.cycles.unwrap_or(0);
        if cycles < LONG || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{pos}/{len} cycles [{bar:40}] {per_sec}, {eta} left");
        ProgressBar::new(cycles).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
    }
}

/// Writes a picture into a file.
fn draw(path: &Path, picture: impl FnOnce() -> Drawn<String>) -> Drawn {
    named(path, picture().and_then(|svg| Ok(fs::write(path, svg)?)))
}

/// The error with the file that it is about.
fn named<T>(path: &Path, result: Result<T, impl fmt::Display>) -> Result<T, Box<dyn Error>> {
    result.map_err(|error| format!("{}: {error}", path.display()).into())
}

fn failed(error: &(dyn Error + 'static)) -> ExitCode {
    // The reader has seen enough.
    if error.downcast_ref().is_some_and(|e: &io::Error| e.kind() == io::ErrorKind::BrokenPipe) {
        return ExitCode::SUCCESS;
    }
    eprintln!("error: {error}");
    ExitCode::FAILURE
}
