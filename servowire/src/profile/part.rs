//! The steps of a part program: as a table, a line a step, a drawing, and wires.

use std::error::Error;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use plotters::prelude::*;
use step_profile::Direction;
use step_profile::motion::AxisPulse;
use vcd::{IdCode, TimescaleUnit, Value, Writer};

use super::Arguments;
use crate::gcode::{AXES, Steps};

const NAMES: [&str; AXES] = ["X", "Y", "Z"];

/// Length of a STEP pulse in a VCD, in ns.
const PULSE_NS: u64 = 1000;

/// What an axis has done.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    steps: u64,
    position: i64,
    last: Option<u64>,
    /// The shortest time from step to step in one direction, in ns.
    shortest: Option<u64>,
}

impl Axis {
    fn add(&mut self, pulse: &AxisPulse) {
        self.steps += 1;
        self.position += if pulse.direction == Direction::Forward { 1 } else { -1 };
        if let Some(last) = self.last {
            let interval = pulse.tick - last;
            self.shortest = Some(self.shortest.map_or(interval, |shortest| shortest.min(interval)));
        }
        self.last = Some(pulse.tick);
    }
}

/// As the arguments ask for it.
pub(super) fn write(
    arguments: &Arguments,
    lines: usize,
    steps: Steps,
    out: &mut dyn Write,
) -> Result<(), Box<dyn Error>> {
    if arguments.csv || arguments.json {
        return rows(arguments.json, steps, out).map_err(Into::into);
    }
    let mut wires = arguments.vcd.as_deref().map(Wires::new).transpose()?;
    let mut places = vec![[0; AXES]];
    let mut times = vec![0];
    let mut axes = [Axis::default(); AXES];
    let mut steps = steps;
    for pulse in steps.by_ref() {
        let Some(axis) = axes.get_mut(usize::from(pulse.axis)) else { continue };
        axis.add(&pulse);
        if let Some(wires) = &mut wires {
            wires.add(&pulse)?;
        }
        if arguments.svg.is_some() {
            places.push(axes.map(|axis| axis.position));
            times.push(pulse.tick);
        }
    }
    writeln!(out, "path    {lines} straight lines in {:.6} s", steps.end() as f64 / 1e9)?;
    for (name, axis) in NAMES.iter().zip(&axes).filter(|(_, axis)| axis.steps > 0) {
        let fastest = axis.shortest.map_or(0.0, |ns| 1e6 / ns as f64);
        writeln!(out, "axis {name}  {} steps, at {} in the end, fastest {fastest:.3} kHz", axis.steps, axis.position)?;
    }
    if let Some(wires) = wires {
        wires.finish()?;
    }
    if let Some(path) = &arguments.svg {
        draw(path, &places, &times).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(out.flush()?)
}

fn rows(json: bool, steps: Steps, out: &mut dyn Write) -> io::Result<()> {
    if !json {
        writeln!(out, "time_ns,axis,position")?;
    }
    let mut axes = [Axis::default(); AXES];
    for pulse in steps {
        let at = usize::from(pulse.axis);
        let (Some(axis), Some(name)) = (axes.get_mut(at), NAMES.get(at)) else { continue };
        axis.add(&pulse);
        let (time, position) = (pulse.tick, axis.position);
        if json {
            writeln!(out, "{{\"time_ns\":{time},\"axis\":\"{name}\",\"position\":{position}}}")?;
        } else {
            writeln!(out, "{time},{name},{position}")?;
        }
    }
    out.flush()
}

/// STEP and DIR of each axis.
struct Wires {
    to: Writer<BufWriter<File>>,
    axes: [(IdCode, IdCode); AXES],
    direction: [Option<Direction>; AXES],
    /// When the last pulse of each axis is over.
    falls: [Option<u64>; AXES],
}

impl Wires {
    fn new(path: &Path) -> Result<Self, Box<dyn Error>> {
        let file = File::create(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut to = Writer::new(BufWriter::new(file));
        to.timescale(1, TimescaleUnit::NS)?;
        to.add_module("axes")?;
        let mut wire = |name: &str, kind: &str| to.add_wire(1, &format!("{name}_{kind}"));
        let [x, y, z] = NAMES.map(|name| Ok::<_, io::Error>((wire(name, "step")?, wire(name, "dir")?)));
        let axes = [x?, y?, z?];
        to.upscope()?;
        to.enddefinitions()?;
        to.timestamp(0)?;
        for (step, dir) in axes {
            to.change_scalar(step, Value::V0)?;
            to.change_scalar(dir, Value::V0)?;
        }
        Ok(Self { to, axes, direction: [None; AXES], falls: [None; AXES] })
    }

    /// Lets pulses end that are over before a time.
    fn until(&mut self, time: u64) -> io::Result<()> {
        while let Some((at, falls)) = (0..AXES).filter_map(|at| self.falls[at].map(|t| (at, t))).min_by_key(|(_, t)| *t)
        {
            if falls > time {
                break;
            }
            self.to.timestamp(falls)?;
            self.to.change_scalar(self.axes[at].0, Value::V0)?;
            self.falls[at] = None;
        }
        Ok(())
    }

    fn add(&mut self, pulse: &AxisPulse) -> io::Result<()> {
        self.until(pulse.tick)?;
        let at = usize::from(pulse.axis).min(AXES - 1);
        let (step, dir) = self.axes[at];
        self.to.timestamp(pulse.tick)?;
        if self.direction[at] != Some(pulse.direction) {
            self.direction[at] = Some(pulse.direction);
            self.to.change_scalar(dir, Value::from(pulse.direction.dir()))?;
        }
        self.to.change_scalar(step, Value::V1)?;
        self.falls[at] = Some(pulse.tick + PULSE_NS);
        Ok(())
    }

    fn finish(mut self) -> io::Result<()> {
        self.until(u64::MAX)?;
        self.to.flush()
    }
}

/// The path on the left, the positions of the axes over time on the right.
fn draw(path: &Path, places: &[[i64; AXES]], times: &[u64]) -> Result<(), Box<dyn Error>> {
    // A point a pixel is enough.
    let every = (places.len() / 20_000).max(1);
    let mut thin: Vec<usize> = (0..places.len()).step_by(every).collect();
    thin.extend(places.len().checked_sub(1));
    let at = |k: usize, axis: usize| places[k][axis] as f64;
    let range = |axis: usize| {
        let values = || places.iter().map(|place| place[axis] as f64);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let margin = (high - low).max(1.0) * 0.06;
        low - margin..high + margin
    };
    let root = SVGBackend::new(path, (1200, 600)).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(600);
    let mut plane = ChartBuilder::on(&left);
    let mut plane =
        plane.margin(12).x_label_area_size(42).y_label_area_size(70).build_cartesian_2d(range(0), range(1))?;
    plane.configure_mesh().max_light_lines(0).x_desc("X [steps]").y_desc("Y [steps]").draw()?;
    plane.draw_series(LineSeries::new(thin.iter().map(|&k| (at(k, 0), at(k, 1))), BLUE.stroke_width(2)))?;
    let end = times.last().map_or(1.0, |ns| (*ns as f64 / 1e9).max(1e-9));
    let areas = right.split_evenly((AXES, 1));
    for (axis, area) in areas.iter().enumerate() {
        let mut chart = ChartBuilder::on(area);
        let mut chart =
            chart.margin(12).x_label_area_size(42).y_label_area_size(70).build_cartesian_2d(0.0..end, range(axis))?;
        let name = NAMES.get(axis).copied().unwrap_or_default();
        chart.configure_mesh().max_light_lines(0).x_desc("time [s]").y_desc(format!("{name} [steps]")).draw()?;
        chart.draw_series(LineSeries::new(
            thin.iter().map(|&k| (times[k] as f64 / 1e9, at(k, axis))),
            BLUE.stroke_width(2),
        ))?;
    }
    Ok(root.present()?)
}
