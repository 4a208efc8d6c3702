//! G-code: a part program as straight lines, and the steps that they are made of.

mod lines;
mod steps;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use step_motion::Limits;

pub(crate) use lines::Line;
use servowire_decode::fault::{At, Fault};
pub(crate) use steps::Steps;

/// Axes of a part program: X, Y and Z.
pub(crate) const AXES: usize = 3;

/// A part program, and the machine that it is for.
#[derive(Debug, Args)]
pub(crate) struct Part {
    /// Follow a part program: G0, G1, G2, G3 (X, Y, Z, I, J, F), G20, G21, G90, G91, and M2 or M30 at its end. Feeds are
    /// in mm/min; arcs are in the XY plane, as chords within 2 um.
    #[arg(long, value_name = "FILE")]
    pub(crate) gcode: Option<PathBuf>,
    /// Steps in a millimetre of each axis of a part program.
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    steps_per_mm: u32,
    /// How far a part program may round a corner, in um; 0 stops at each one.
    #[arg(long, value_name = "UM", default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    deviation: u32,
}

impl Part {
    /// Greatest step frequency and acceleration of an axis where nothing else is asked for.
    pub(crate) const SPEED: u32 = 100_000;
    pub(crate) const ACCELERATION: u32 = 400_000;

    /// The lines of a part program.
    pub(crate) fn read(path: &Path) -> Result<Vec<Line>, Fault> {
        let name = path.display().to_string();
        let text = fs::read(path).map_err(|e| Fault::new(&name, At::File, e.to_string()))?;
        lines::read(&name, &String::from_utf8_lossy(&text))
    }

    /// Its steps, with the same limits for all axes; ticks are ns.
    pub(crate) fn steps(&self, lines: Vec<Line>, limits: Limits) -> Result<Steps, step_motion::Error> {
        Steps::new(lines, limits, self.steps_per_mm, self.deviation)
    }
}
