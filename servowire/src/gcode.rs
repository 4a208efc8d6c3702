//! G-code: turns a part program into straight lines, and these into steps.

mod arcs;
mod item;
mod limit;
mod modes;
mod numbers;
mod program;
#[cfg(test)]
mod programs;
mod setup;
mod steps;
mod words;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use clap::Args;
use servowire_decode::fault::{At, Fault};
use step_motion::{AxisSetup, Limits};

use crate::files;
use crate::overwrite::Source;
use item::Item;
use program::Program;
pub(crate) use steps::Steps;

/// Axes of a part program: X, Y and Z.
pub(crate) const AXES: usize = 3;

/// A part program, and the machine that it is for.
#[derive(Debug, Args)]
pub(crate) struct Part {
    /// Run a part program: lines and arcs in three planes (G0 to G3, G17 to G21, I, J, K or R), dwells (G4), references (G28, G30), G53 to
    /// G59, G61 and G64, G90 to G92; a tool of length 0 (G43), offsets of 0 (G54 to G59). Feeds are in mm/min, to the nearest
    /// um/s; arcs are chords within 2 um, or half a step of the finer axis. M0, M1, M6 and M60 come to rest, M2, M30, a second percent
    /// sign and ^Z end it, and spindle, coolant and tool words move nothing. Anything else is refused with its line.
    #[arg(long, value_name = "FILE")]
    pub(crate) gcode: Option<PathBuf>,
    /// Steps per millimetre of each axis of a part program.
    #[arg(long, value_name = "N", requires = "gcode", default_value_t = 80, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    steps_per_mm: u32,
    /// An axis of its own: X:steps-per-mm=80,speed=6000,acceleration=500,jerk=10000,low=0,high=300,pause=0.5, in mm/min, mm/s²,
    /// mm/s³, soft limits in mm, and ms of rest before each change of direction; repeat it for each axis. Its speed,
    /// acceleration and jerk are rounded down to whole steps, at least 1.
    #[arg(long, value_name = "AXIS", requires = "gcode")]
    axis: Vec<setup::Setup>,
    /// How far a part program may round a corner, in um; 0 stops at each one. An arc has none. G61 and G64 P override it.
    #[arg(long, value_name = "UM", requires = "gcode", default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    deviation: u32,
    /// Leave out the lines of a part program that begin with a slash, whatever follows it.
    #[arg(long, requires = "gcode")]
    block_delete: bool,
}

impl Part {
    /// Greatest step frequency and acceleration of an axis where nothing else is asked for.
    pub(crate) const SPEED: u32 = 100_000;
    pub(crate) const ACCELERATION: u32 = 400_000;

    /// The part program among the files of a command.
    pub(crate) fn source(&self) -> Option<Source<'_>> {
        self.gcode.as_deref().map(|path| ("the part program", path))
    }

    /// Reads all of a part program for faults, and for lines beyond the soft limits of an axis; how many straight lines it has.
    /// Says on standard error where the file goes on after the end of its program.
    pub(crate) fn check(&self, path: &Path) -> Result<usize, Box<dyn std::error::Error>> {
        let (mut lines, mut program) = (0, self.open(path)?);
        // Their speeds play no part.
        let axes = self.axes(Limits::new(Self::SPEED, Self::ACCELERATION)?)?;
        while let Some(item) = program.next() {
            let Item::Line(line) = item? else { continue };
            if let Some(what) = setup::outside(line.to, &axes) {
                return Err(program.refuse(what).into());
            }
            lines += 1;
        }
        if let Some(note) = program.behind_the_end()? {
            eprintln!("{note}");
        }
        if lines == 0 {
            let what = "no motion in it: a line with G0 or G1 and X, Y or Z begins one";
            return Err(Fault::new(&path.display().to_string(), At::File, what).into());
        }
        Ok(lines)
    }

    /// Its steps, within limits of each axis that has none of its own; ticks are ns.
    pub(crate) fn steps(&self, path: &Path, limits: Limits) -> Result<Steps, Box<dyn std::error::Error>> {
        Ok(Steps::new(self.open(path)?, path.display().to_string(), self.axes(limits)?, self.deviation)?)
    }

    /// The axes of the machine.
    pub(crate) fn axes(&self, limits: Limits) -> Result<[AxisSetup; AXES], String> {
        let mut axes = [AxisSetup::new(limits, self.steps_per_mm * 1000); AXES];
        for (axis, setup) in axes.iter_mut().zip(self.setups()?) {
            *axis = setup.over(*axis)?;
        }
        Ok(axes)
    }

    /// Refuses an axis of more than this many steps/s.
    pub(crate) fn within(&self, limits: Limits, most: u32) -> Result<(), String> {
        for (axis, setup) in self.axes(limits)?.iter().zip(self.setups()?) {
            setup.within(axis, most)?;
            if axis.limits.speed() > most {
                return Err(format!("--freq {} is above {most}, the greatest", axis.limits.speed()));
            }
        }
        Ok(())
    }

    /// What all options say of each axis.
    fn setups(&self) -> Result<[setup::Setup; AXES], String> {
        let mut setups = [0, 1, 2].map(setup::Setup::new);
        for setup in &self.axis {
            if let Some(place) = setups.get_mut(setup.axis) {
                *place = place.join(*setup)?;
            }
        }
        Ok(setups)
    }

    fn open(&self, path: &Path) -> Result<Program<BufReader<File>>, Fault> {
        let name = path.display().to_string();
        let once =
            |name| Fault::new(name, At::File, "cannot be read twice, to be checked and to be run: copy it into a file");
        if path.as_os_str() == "-" {
            return Err(once(files::STDIN));
        }
        let file = files::open_file(path)?;
        if !file.metadata().is_ok_and(|data| data.is_file()) {
            return Err(once(&name));
        }
        Ok(Program::new(&name, BufReader::new(file), self.block_delete))
    }
}
