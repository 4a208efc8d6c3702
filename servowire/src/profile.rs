//! `servowire profile`: a move of a stepper axis, step by step.

mod curves;
mod drawing;
mod motion;
mod part;
mod ramp;

use std::error::Error;
use std::fmt::Display;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use motion::Move;
use ramp::Record;
use step_motion::Limits;
use step_profile::{Arithmetic, Frequency, Parameters, Profile, Speed, Tone};

use crate::gcode::Part;
use crate::overwrite::refusal;
use crate::units::{acceleration, jerk, of_frequency};
use servowire_decode::fault::Fault;
use servowire_decode::time;

/// Compute the times of the steps of a move or a part program.
///
/// The sin² ramp and the integers of the 250 kHz motion controller of TIDEP0061: for every step the cycle of its pulse
/// and the start of the pulse in that cycle. Without an output option, prints a summary and a table of the ramp.
///
/// With --shape trapezoid or s-curve, computes the fastest move within --accel and --jerk; --compare shows all shapes side by
/// side, at the same speed and peak acceleration. With --gcode the steps of three axes along the path of a part program, each
/// axis within --freq, --accel and --jerk (100 kHz, 400000 steps/s² and none).
#[derive(Debug, Args)]
pub struct Arguments {
    /// Step frequency at full speed, such as 94570 or 94.57kHz.
    #[arg(long, value_name = "HZ", value_parser = frequency, required_unless_present_any = ["tone", "gcode"])]
    freq: Option<Frequency>,
    /// A note of Table 3 instead of a frequency: cis, E, fis, G, gis, A, H, cis2, D2, fis2.
    #[arg(long, value_name = "NAME", value_parser = tone, conflicts_with = "freq")]
    tone: Option<Tone>,
    /// Length of the move.
    #[arg(long, value_name = "N", required_unless_present = "gcode", default_value_t = 0)]
    steps: u32,
    /// Steps that each of the 32 ramp entries lasts; 1 by default, or what --accel allows.
    #[arg(long, value_name = "N", conflicts_with = "accel")]
    k: Option<u32>,
    /// Shape of the move.
    #[arg(long, value_enum, default_value_t = Shape::Sin2)]
    shape: Shape,
    /// Greatest acceleration in steps/s².
    #[arg(long, value_name = "A", value_parser = acceleration)]
    accel: Option<u32>,
    /// Greatest jerk in steps/s³, for the S-curve; by default ten times A² / V.
    #[arg(long, value_name = "J", requires = "accel", value_parser = jerk)]
    jerk: Option<u64>,
    /// Show all shapes side by side, within --accel and --jerk.
    #[arg(long, requires = "accel", conflicts_with_all = ["csv", "json"])]
    compare: bool,
    /// sync_time before the first step in ns, 0 to 3999.
    #[arg(long, value_name = "NS", default_value_t = Parameters::INIT_SYNC)]
    init_sync: u32,
    /// How cycles and sync_times are computed.
    #[arg(long, value_enum, default_value_t = Mode::Corrected)]
    arithmetic: Mode,
    #[command(flatten)]
    part: Part,
    /// CSV, one line per step, with a header.
    #[arg(long, group = "output")]
    csv: bool,
    /// JSON Lines, one object per step.
    #[arg(long, group = "output")]
    json: bool,
    /// Draw speed, acceleration and step time over time into this file.
    #[arg(long, group = "output", value_name = "OUT")]
    svg: Option<PathBuf>,
    /// Write STEP and DIR of each axis of a part program as a VCD.
    #[arg(long, group = "output", value_name = "OUT", requires = "gcode")]
    vcd: Option<PathBuf>,
}

/// How the speed rises and falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Shape {
    /// The published ramp: sin² over the steps, in 32 levels.
    Sin2,
    /// Constant acceleration.
    Trapezoid,
    /// Limited jerk.
    SCurve,
}

/// [`Arithmetic`] as the command line spells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// By true division.
    Corrected,
    /// Bit for bit as on the PRU, wrap-arounds included.
    PruExact,
    /// By true division, carrying fractions of a nanosecond over.
    Carried,
}

impl Arguments {
    /// Runs the command. 0: done; 1: it ended early, or the output cannot be written; 2: the move is not possible.
    pub(crate) fn run(&self) -> ExitCode {
        let out = &mut BufWriter::new(io::stdout().lock());
        if let Some(what) = self.misplaced().or_else(|| self.overwrites()) {
            return wrong_use(&what);
        }
        if let Some(path) = &self.part.gcode {
            return self.follow(path, out);
        }
        let done = if self.compare || self.shape != Shape::Sin2 {
            match self.moves() {
                Ok(moves) => self.write_moves(&moves, out),
                Err(e) => return wrong_use(&e),
            }
        } else {
            match self.profile() {
                Ok(profile) => self.write(profile, out),
                Err(e) => return wrong_use(&e),
            }
        };
        written(done)
    }

    /// Returns what to say of an option that the motion has no use for. Clap would let a conflict outweigh what an option requires.
    fn misplaced(&self) -> Option<String> {
        let ramp = self.compare || self.shape == Shape::Sin2;
        let of_moves = [
            (self.tone.is_some(), "--tone"),
            (self.steps != 0, "--steps"),
            (self.k.is_some(), "--k"),
            (self.shape != Shape::Sin2, "--shape"),
            (self.compare, "--compare"),
        ];
        let of_the_ramp = [
            (self.init_sync != Parameters::INIT_SYNC, "--init-sync"),
            (self.arithmetic != Mode::Corrected, "--arithmetic"),
        ];
        let first = |options: &[(bool, &'static str)]| options.iter().find(|(is, _)| *is).map(|(_, option)| *option);
        if self.part.gcode.is_some() {
            let option = first(&of_moves).or(first(&of_the_ramp));
            return option.map(|option| format!("{option} is for a single move, and not for --gcode"));
        }
        if self.jerk.is_some() && !(self.compare || self.shape == Shape::SCurve) {
            return Some("--jerk is for --shape s-curve, --compare and --gcode".to_owned());
        }
        first(&of_the_ramp).filter(|_| !ramp).map(|option| format!("{option} is for the published ramp, --shape sin2"))
    }

    /// Returns what to say if an output is the part program.
    fn overwrites(&self) -> Option<String> {
        let outputs = [("--svg", self.svg.as_deref()), ("--vcd", self.vcd.as_deref())];
        refusal(self.part.source().as_slice(), &outputs)
    }

    /// A part program.
    fn follow(&self, path: &Path, out: &mut dyn Write) -> ExitCode {
        let planned = || -> Result<_, Box<dyn Error>> {
            let lines = self.part.check(path)?;
            let speed = self.freq.map_or(Ok(Part::SPEED), whole)?;
            let limits = Limits::new(speed, self.accel.unwrap_or(Part::ACCELERATION))?;
            let limits = self.jerk.map_or(Ok(limits), |jerk| limits.with_jerk(jerk))?;
            Ok((lines, self.part.steps(path, limits)?))
        };
        match planned() {
            Ok((lines, steps)) => written(part::write(self, lines, steps, out)),
            Err(e) => wrong_use(&e),
        }
    }

    fn profile(&self) -> Result<Profile<'static>, String> {
        let hertz = self.freq.map_or(0.0, |freq| f64::from(freq.numerator()) / f64::from(freq.denominator()));
        self.ramp().map_err(|error| of_frequency(error, hertz))
    }

    fn ramp(&self) -> Result<Profile<'static>, step_profile::Error> {
        let speed = match (self.tone, self.freq) {
            (Some(tone), _) => tone.speed(),
            (None, frequency) => Speed::from_frequency(frequency.unwrap_or(Frequency::from_hz(0)))?,
        };
        let arithmetic = match self.arithmetic {
            Mode::Corrected => Arithmetic::Corrected,
            Mode::PruExact => Arithmetic::PruExact,
            Mode::Carried => Arithmetic::Carried,
        };
        let parameters = Parameters::at(speed).with_init_sync(self.init_sync).with_arithmetic(arithmetic);
        Profile::new(match (self.k, self.accel) {
            (None, Some(acceleration)) => parameters.with_acceleration(acceleration),
            (k, _) => parameters.with_steps_per_entry(k.unwrap_or(1)),
        })
    }

    /// Returns the requested shape, or all shapes.
    fn moves(&self) -> Result<Vec<Move>, Box<dyn Error>> {
        let speed = match (self.tone.map(Tone::frequency), self.freq) {
            (Some(tone), _) => tone.numerator() / u32::from(tone.denominator()),
            (None, frequency) => whole(frequency.unwrap_or(Frequency::from_hz(1)))?,
        };
        let acceleration = self.accel.ok_or("--shape trapezoid and s-curve need --accel")?;
        let flat = Limits::new(speed, acceleration)?;
        let jerk = self.jerk.unwrap_or(u64::from(acceleration).pow(2) / u64::from(speed) * 10);
        let smooth = || flat.with_jerk(jerk.clamp(1, Limits::MAX_JERK));
        Ok(match self.shape {
            _ if self.compare => vec![
                Move::sin2(self.profile()?, self.steps),
                Move::planned(flat, self.steps)?,
                Move::planned(smooth()?, self.steps)?,
            ],
            Shape::Trapezoid => vec![Move::planned(flat, self.steps)?],
            Shape::SCurve => vec![Move::planned(smooth()?, self.steps)?],
            Shape::Sin2 => vec![Move::sin2(self.profile()?, self.steps)],
        })
    }

    fn write_moves(&self, moves: &[Move], out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
        if self.csv || self.json {
            for made in moves {
                write_ticks(made, self.json, out)?;
            }
        } else {
            motion::table(moves, out)?;
            if let Some(path) = &self.svg {
                let title = format!("{} steps", self.steps);
                fs::write(path, curves::svg(&title, moves)?).map_err(|e| format!("{}: {e}", path.display()))?;
            }
        }
        Ok(out.flush()?)
    }

    fn write(&self, profile: Profile<'_>, out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
        let steps = self.steps;
        if self.csv {
            let mut csv = csv::Writer::from_writer(&mut *out);
            profile.steps(steps).try_for_each(|step| csv.serialize(Record::from(step)))?;
            csv.flush()?;
        } else if self.json {
            for step in profile.steps(steps) {
                serde_json::to_writer(&mut *out, &Record::from(step))?;
                writeln!(out)?;
            }
        } else {
            ramp::summary(profile, steps, out)?;
            match &self.svg {
                Some(path) => {
                    fs::write(path, drawing::svg(profile, steps)?).map_err(|e| format!("{}: {e}", path.display()))?;
                }
                None => ramp::table(profile, steps, out)?,
            }
        }
        Ok(out.flush()?)
    }
}

fn written(done: Result<(), Box<dyn Error>>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        // The reader has seen enough.
        Err(e) if is_broken_pipe(e.as_ref()) => ExitCode::SUCCESS,
        Err(e) if e.is::<Fault>() => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
        Err(e) => {
            eprintln!("error: cannot write: {e}");
            ExitCode::FAILURE
        }
    }
}

fn wrong_use(error: &dyn Display) -> ExitCode {
    eprintln!("error: {error}");
    ExitCode::from(2)
}

/// Writes number and time of every step, in ns from the start.
fn write_ticks(made: &Move, json: bool, out: &mut dyn Write) -> io::Result<()> {
    if !json {
        writeln!(out, "step,time_ns")?;
    }
    for (step, time) in made.steps.iter().enumerate() {
        if json {
            writeln!(out, "{{\"step\":{step},\"time_ns\":{time}}}")?;
        } else {
            writeln!(out, "{step},{time}")?;
        }
    }
    Ok(())
}

fn is_broken_pipe(error: &(dyn Error + 'static)) -> bool {
    let io = error.downcast_ref::<io::Error>().map(io::Error::kind);
    let json = error.downcast_ref::<serde_json::Error>().and_then(serde_json::Error::io_error_kind);
    let csv = error.downcast_ref::<csv::Error>().and_then(|e| match e.kind() {
        csv::ErrorKind::Io(e) => Some(e.kind()),
        _ => None,
    });
    io.or(json).or(csv) == Some(io::ErrorKind::BrokenPipe)
}

/// The limit of an axis.
fn whole(frequency: Frequency) -> Result<u32, &'static str> {
    let (hz, of) = (frequency.numerator(), u32::from(frequency.denominator()));
    let speed = hz.checked_div(of).filter(|speed| *speed > 0 && hz % of == 0);
    speed.ok_or("--freq is the limit of an axis here: whole steps/s, at least 1")
}

/// Whole millihertz: finer than the speed constant anywhere in its range.
fn frequency(text: &str) -> Result<Frequency, String> {
    let millihertz = time::frequency(text).map_or(0.0, |hz| (hz * 1e3).round());
    let step = (1.0..=f64::from(u32::MAX)).contains(&millihertz);
    let ratio = step.then(|| Frequency::from_ratio(millihertz as u32, 1000)).flatten();
    ratio.ok_or_else(|| format!("\"{text}\" is not a step frequency from 1 mHz to 4.29 MHz, such as 94570 or 94.57kHz"))
}

fn tone(text: &str) -> Result<Tone, String> {
    Tone::from_name(text).ok_or_else(|| {
        let names: Vec<_> = Tone::ALL.iter().map(|tone| tone.name()).collect();
        format!("\"{text}\" is not one of {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use serde_json::json;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        arguments: Arguments,
    }

    fn arguments(line: &str) -> Arguments {
        Line::try_parse_from(line.split(' ')).unwrap().arguments
    }

    fn output(line: &str) -> String {
        let arguments = arguments(line);
        let mut out = Vec::new();
        arguments.write(arguments.profile().unwrap(), &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn frequencies() {
        for (text, want) in [
            ("94.57kHz", 94_570_000),
            ("250k", 250_000_000),
            ("112935.83", 112_935_830),
            ("1 Hz", 1000),
            ("1MHz", 1_000_000_000),
            ("0.25 MHz", 250_000_000),
            ("0.001", 1),
        ] {
            assert_eq!(frequency(text), Ok(Frequency::from_ratio(want, 1000).unwrap()), "{text}");
        }
        for text in ["", "k", "fast", "-1", "0", "5MHz", "5e9", "NaN", "inf"] {
            assert!(frequency(text).is_err(), "{text}");
        }
    }

    /// A tone of Table 3 whose steps are known from the PRU.
    #[test]
    fn csv_and_json_of_a_tone() {
        let line = "profile --tone cis --steps 8781 --init-sync 0 --arithmetic pru-exact";
        let csv = output(&format!("{line} --csv"));
        let rows: Vec<_> = csv.lines().collect();
        assert_eq!(rows[0], "step,state,entry,t_step_ns,cycle,sync_time_ns,time_ns");
        assert_eq!(rows[2], "1,ramp-up,1,1481648,1848,1963,7393963");
        assert_eq!(rows[8781], "8780,ramp-down,0,5912315,35880,2362,143522362");
        let json = output(&format!("{line} --json"));
        let second: serde_json::Value = serde_json::from_str(json.lines().nth(1).unwrap()).unwrap();
        assert_eq!(
            (&second["cycle"], &second["sync_time_ns"], &second["state"]),
            (&json!(1848), &json!(1963), &json!("ramp-up"))
        );
        assert_eq!(json.lines().count(), 8781);
    }

    #[test]
    fn the_summary_shows_the_trap_of_phase_0() {
        let text = output("profile --freq 250kHz --steps 51200 --init-sync 0");
        assert!(text.contains("51200 steps in 210.008000 ms: 32 up, 51136 at full speed, 32 down"), "{text}");
        assert!(text.contains("51140 pulses at sync_time 0"), "{text}");
        assert_eq!(text.lines().count(), 5 + 2 + 65);
        assert!(output("profile --freq 20k --steps 5").contains("outside its proved domain"));
        assert!(output("profile --freq 20k --steps 5 --arithmetic carried").contains("on average as asked"));
        assert!(output("profile --freq 20k --steps 0").contains("0 steps in 0.000000 ms"));
    }

    #[test]
    fn a_drawing_goes_into_its_file() {
        let path = tempfile::tempdir().unwrap().keep().join("move.svg");
        let line = format!("profile --freq 1k --steps 9 --svg {}", path.display());
        assert!(output(&line).contains("9 steps in"));
        assert!(fs::read_to_string(&path).unwrap().contains("1.000 kHz"));
        fs::remove_dir_all(path.parent().unwrap()).unwrap();
        let arguments = arguments(&line);
        let error = arguments.write(arguments.profile().unwrap(), &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("move.svg"), "{error}");
    }

    fn shapes(line: &str) -> Result<String, Box<dyn Error>> {
        let arguments = arguments(&format!("profile {line}"));
        let mut out = Vec::new();
        arguments.write_moves(&arguments.moves()?, &mut out)?;
        Ok(String::from_utf8(out)?)
    }

    /// A trapezoid at the same peak acceleration is many times as fast over 64 steps.
    #[test]
    fn shapes_beside_one_another() {
        let text = shapes("--freq 100k --steps 64 --accel 1000000 --jerk 100000000 --compare").unwrap();
        let duration = |name: &str| -> f64 {
            let line = text.lines().find(|line| line.starts_with(name)).unwrap();
            line.split_whitespace().nth(1).unwrap().parse().unwrap()
        };
        // 2 sqrt(n/a), and 4 (n/2j)^(1/3)
        assert!((duration("trapezoid") - 16.0).abs() < 0.001 && (duration("s-curve") - 27.36).abs() < 0.01, "{text}");
        assert!(duration("sin2") > 100.0, "{text}");
        let csv = shapes("--freq 1k --steps 3 --shape trapezoid --accel 10000 --csv").unwrap();
        assert_eq!(csv.lines().next(), Some("step,time_ns"));
        assert_eq!(csv.lines().count(), 4);
        let json = shapes("--freq 1k --steps 1 --shape s-curve --accel 10000 --jerk 1000000 --json").unwrap();
        assert_eq!(json, "{\"step\":0,\"time_ns\":15874011}\n");
        assert!(shapes("--freq 1k --steps 3 --shape trapezoid").is_err());
        for frequency in ["0.2", "999.5"] {
            let error = shapes(&format!("--freq {frequency} --steps 3 --shape trapezoid --accel 10000")).unwrap_err();
            assert!(error.to_string().contains("whole steps/s"), "{error}");
        }
        assert!(shapes("--freq 0.999k --steps 3 --shape trapezoid --accel 10000").is_ok());
    }

    #[test]
    fn refusals() {
        assert!(Line::try_parse_from(["profile", "--steps", "5"]).is_err());
        assert!(Line::try_parse_from(["profile", "--steps", "5", "--tone", "h"]).is_err());
        assert!(Line::try_parse_from("profile --freq 1k --steps 5 --csv --json".split(' ')).is_err());
        for (line, want) in [
            ("--freq 250001 --steps 5", "250001 Hz is above 250 kHz"),
            ("--freq 96.7 --steps 5", "at 96.7 Hz the first step of the ramp is longer than 2^32 ns"),
            ("--freq 10 --steps 5", "below 15.26 Hz"),
            ("--freq 1k --steps 5 --k 0", "at least 1"),
            ("--freq 1k --steps 5 --init-sync 4000", "at most 3999"),
        ] {
            let error = arguments(&format!("profile {line}")).profile().unwrap_err();
            assert!(error.contains(want), "{line}: {error}");
        }
    }
}
