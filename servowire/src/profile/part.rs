//! Shows the steps of a part program: as a table, one line per step, a drawing, or wires.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::error::Error;
use std::fs;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use step_motion::AxisPulse;
use step_profile::Direction;
use vcd::{IdCode, TimescaleUnit, Value, Writer};

use super::Arguments;
use crate::drawing::{Chart, Drawn, Sheet, Stroke};
use crate::files::{Written, create};
use crate::gcode::{AXES, Steps};

const NAMES: [&str; AXES] = ["X", "Y", "Z"];

/// Length of a STEP pulse in a VCD, in ns, unless the next step of the axis comes before twice that.
const PULSE_NS: u64 = 1000;

/// Time from DIR to STEP, in ns, unless the axis reverses faster than that.
const LEAD_NS: u64 = 1000;

/// Totals of an axis.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    steps: u64,
    position: i64,
    last: Option<u64>,
    /// The shortest time between two steps in one direction, in ns.
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

/// Shows the steps as the arguments request.
pub(super) fn write(
    arguments: &Arguments,
    lines: usize,
    steps: Steps,
    out: &mut dyn Write,
) -> Result<(), Box<dyn Error>> {
    if arguments.csv || arguments.json {
        return rows(arguments.json, lines, steps, out);
    }
    let mut wires = arguments.vcd.as_deref().map(Wires::new).transpose()?;
    let mut places = Places::new();
    let mut axes = [Axis::default(); AXES];
    let (mut steps, bar) = (steps, bar(lines));
    while let Some(pulse) = steps.next() {
        let Some(axis) = axes.get_mut(usize::from(pulse.axis)) else { continue };
        axis.add(&pulse);
        if let Some(wires) = &mut wires {
            wires.add(&pulse)?;
        }
        if arguments.svg.is_some() {
            places.push((pulse.tick as f64 / 1e9, axes.map(|axis| axis.position)));
        }
        bar.set_position(steps.lines());
    }
    bar.finish_and_clear();
    if let Some(fault) = steps.fault() {
        return Err(fault.clone().into());
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
        fs::write(path, draw(&places.all())?).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(out.flush()?)
}

/// Programs of more lines than this have a progress bar.
const LONG: usize = 100_000;

/// Shows the number of lines read, on a terminal.
fn bar(lines: usize) -> ProgressBar {
    if lines < LONG || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{pos}/{len} lines [{bar:40}] {per_sec}, {eta} left");
    ProgressBar::new(lines as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn rows(json: bool, lines: usize, mut steps: Steps, out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    if !json {
        writeln!(out, "time_ns,axis,position")?;
    }
    let (mut axes, bar) = ([Axis::default(); AXES], bar(lines));
    while let Some(pulse) = steps.next() {
        bar.set_position(steps.lines());
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
    bar.finish_and_clear();
    if let Some(fault) = steps.fault() {
        return Err(fault.clone().into());
    }
    Ok(out.flush()?)
}

/// The wires of an axis.
struct Wire {
    step: IdCode,
    dir: IdCode,
    direction: Direction,
    /// When the last pulse began, and whether its end is still open.
    last: u64,
    open: bool,
}

/// What happens to a wire, in the order in which it does at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Change {
    Step(bool),
    Dir(bool),
}

/// Writes STEP and DIR of each axis.
struct Wires {
    to: Writer<BufWriter<Written>>,
    axes: Vec<Wire>,
    /// Events not yet written: when, what, and on which axis.
    changes: BinaryHeap<Reverse<(u64, Change, usize)>>,
    /// The time written last.
    written: u64,
}

impl Wires {
    fn new(path: &Path) -> Result<Self, Box<dyn Error>> {
        let mut to = Writer::new(create(path)?);
        to.timescale(1, TimescaleUnit::NS)?;
        to.add_module("axes")?;
        let mut axes = Vec::new();
        for name in NAMES {
            let (step, dir) = (to.add_wire(1, &format!("{name}_step"))?, to.add_wire(1, &format!("{name}_dir"))?);
            axes.push(Wire { step, dir, direction: Direction::Forward, last: 0, open: false });
        }
        to.upscope()?;
        to.enddefinitions()?;
        to.timestamp(0)?;
        for wire in &axes {
            to.change_scalar(wire.step, Value::V0)?;
            to.change_scalar(wire.dir, Value::V0)?;
        }
        Ok(Self { to, axes, changes: BinaryHeap::new(), written: 0 })
    }

    /// Ends each pulse after which no step can come any more in less than twice its length.
    fn settle(&mut self, time: u64) {
        for (at, wire) in self.axes.iter_mut().enumerate().filter(|(_, wire)| wire.open) {
            if time.saturating_sub(wire.last) >= 2 * PULSE_NS {
                wire.open = false;
                self.changes.push(Reverse((wire.last.saturating_add(PULSE_NS), Change::Step(false), at)));
            }
        }
    }

    /// Nothing that comes later precedes this pulse by more than a lead of DIR, or ends one that began earlier than two
    /// lengths before it.
    fn add(&mut self, pulse: &AxisPulse) -> io::Result<()> {
        let (at, time) = (usize::from(pulse.axis), pulse.tick);
        self.settle(time);
        let Some(wire) = self.axes.get_mut(at) else { return Ok(()) };
        let half = wire.last.midpoint(time);
        if wire.open {
            self.changes.push(Reverse((half, Change::Step(false), at)));
        }
        if wire.direction != pulse.direction {
            wire.direction = pulse.direction;
            // In the middle of the rest where that is shorter than twice the lead.
            let turn = time.saturating_sub(LEAD_NS).max(half);
            self.changes.push(Reverse((turn, Change::Dir(pulse.direction.dir()), at)));
        }
        (wire.last, wire.open) = (time, true);
        self.changes.push(Reverse((time, Change::Step(true), at)));
        self.write(time.saturating_sub(LEAD_NS.max(2 * PULSE_NS)))
    }

    /// Writes all events before a time.
    fn write(&mut self, before: u64) -> io::Result<()> {
        while self.changes.peek().is_some_and(|Reverse((time, ..))| *time < before) {
            let Some(Reverse((time, change, at))) = self.changes.pop() else { break };
            let Some(wire) = self.axes.get(at) else { continue };
            if time != self.written {
                self.to.timestamp(time)?;
                self.written = time;
            }
            match change {
                Change::Step(high) => self.to.change_scalar(wire.step, Value::from(high))?,
                Change::Dir(high) => self.to.change_scalar(wire.dir, Value::from(high))?,
            }
        }
        Ok(())
    }

    fn finish(mut self) -> io::Result<()> {
        self.settle(u64::MAX);
        self.write(u64::MAX)?;
        self.to.flush()
    }
}

/// The positions of the axes at a time in s.
type Place = (f64, [i64; AXES]);

/// A limited number of positions along a path of any length.
struct Places {
    kept: Vec<Place>,
    last: Place,
    /// One in this many is kept.
    every: u64,
    seen: u64,
}

impl Places {
    /// More than a picture can show.
    const MOST: usize = 1 << 17;

    fn new() -> Self {
        Self { kept: vec![(0.0, [0; AXES])], last: (0.0, [0; AXES]), every: 1, seen: 0 }
    }

    fn push(&mut self, place: Place) {
        (self.last, self.seen) = (place, self.seen + 1);
        if self.seen % self.every != 0 {
            return;
        }
        self.kept.push(place);
        if self.kept.len() > Self::MOST {
            let mut odd = false;
            self.kept.retain(|_| {
                odd = !odd;
                odd
            });
            self.every *= 2;
        }
    }

    fn all(mut self) -> Vec<Place> {
        self.kept.push(self.last);
        self.kept
    }
}

/// Draws the path, with equal scales for X and Y, and the positions of the axes over time.
fn draw(places: &[Place]) -> Drawn<String> {
    // A point a pixel is enough.
    let every = (places.len() / 20_000).max(1);
    let thin = || places.iter().step_by(every).chain(places.last());
    let value = |place: &Place, axis: usize| place.1.get(axis).map_or(0.0, |steps| *steps as f64);
    let range = |axis: usize| {
        let values = || places.iter().map(|place| value(place, axis));
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let margin = (high - low).max(1.0) * 0.06;
        low - margin..high + margin
    };
    let points = |x: fn(&Place) -> f64, axis: usize| thin().map(|place| (x(place), value(place, axis))).collect();
    let mut sheet = Sheet::new("the path, and the axes over time", 1200);
    let plane = Chart { y: Some(range(1)), equal: true, ..Chart::new("Y in steps", "X in steps", range(0)) };
    let plane = plane.with(Stroke::ONLY, points(|place| place.1.first().map_or(0.0, |steps| *steps as f64), 1));
    sheet.panel(700, plane);
    let end = places.last().map_or(1.0, |(time, _)| time.max(1e-9));
    for (axis, name) in NAMES.iter().enumerate() {
        let chart = Chart { y: Some(range(axis)), ..Chart::new(format!("{name} in steps"), "time in s", 0.0..end) };
        sheet.panel(220, chart.with(Stroke::ONLY, points(|place| place.0, axis)));
    }
    sheet.svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;

    /// The changes in a VCD of these pulses after its header, each with its time.
    fn changes(pulses: &[(u8, u64, Direction)]) -> Vec<(u64, String)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.vcd");
        let mut wires = Wires::new(&path).unwrap();
        for (axis, tick, direction) in pulses.iter().copied() {
            wires.add(&AxisPulse { axis, tick, direction }).unwrap();
        }
        wires.finish().unwrap();
        let (mut changes, mut now) = (Vec::new(), None);
        for line in fs::read_to_string(path).unwrap().lines().skip_while(|line| !line.starts_with('#')) {
            match line.strip_prefix('#').map(|time| time.parse::<u64>().unwrap()) {
                Some(time) => {
                    assert!(now < Some(time), "{time} after {now:?}");
                    now = Some(time);
                }
                None => changes.push((now.unwrap(), line.to_owned())),
            }
        }
        changes
    }

    /// DIR leads STEP by a microsecond, or by half of the time since the pulse before; each axis by itself.
    #[test]
    fn dir_changes_between_pulses() {
        let (up, down) = (Direction::Forward, Direction::Reverse);
        let changes = changes(&[
            (0, 5000, down),
            (1, 5500, up),
            (0, 9000, down),
            (0, 10_400, up),
            (1, 10_500, down),
            (2, 10_500, up),
        ]);
        let mut times: Vec<u64> = changes.iter().map(|(time, _)| *time).collect();
        times.dedup();
        let want = [0, 4000, 5000, 5500, 6000, 6500, 9000, 9500, 9700, 10_400, 10_500, 11_400, 11_500];
        assert_eq!(times, want);
    }

    /// Intervals of 250 ns to 2 us: a pulse is 1 us long, or half of the time to the next one; the one at the end is 1 us.
    #[test]
    fn every_step_has_its_edge() {
        let up = Direction::Forward;
        let pulses = [5000, 5250, 6250, 7749, 9749, 11_750];
        let all: Vec<_> = pulses.iter().flat_map(|time| [(0, *time, up), (1, time + 100, up)]).collect();
        let changes = changes(&all);
        for (wire, late) in [('!', 0), ('#', 100)] {
            let of = |level: char| -> Vec<u64> {
                let text = format!("{level}{wire}");
                changes
                    .iter()
                    .filter(|(time, change)| *time > 0 && *change == text)
                    .map(|(time, _)| *time - late)
                    .collect()
            };
            assert_eq!(of('1'), pulses);
            assert_eq!(of('0'), [5125, 5750, 6999, 8749, 10_749, 12_750]);
        }
    }

    /// A long path keeps as much as a picture needs, and its end.
    #[test]
    fn a_long_path_keeps_some_of_its_places() {
        let mut places = Places::new();
        for k in 1..=1_000_000 {
            places.push((k as f64, [k; AXES]));
        }
        let kept = places.all();
        assert!((Places::MOST / 2..=Places::MOST + 2).contains(&kept.len()), "{}", kept.len());
        assert_eq!((kept[0].1[0], kept[kept.len() - 1].1[0]), (0, 1_000_000));
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0 && pair[1].0 - pair[0].0 <= 16.0));
    }

    #[test]
    fn labels_leave_the_curves_free() {
        let square = [[0, 0, 0], [80_000, 0, 0], [80_000, 80_000, -20_000], [0, 80_000, 0], [0, 0, 0]];
        let places: Vec<Place> = (0..).map(f64::from).zip(square).collect();
        let svg = draw(&places).unwrap();
        assert!(svg.contains("X in steps") && svg.contains("time in s"));
        nothing_is_covered(&svg);
        nothing_is_covered(&draw(&[(0.0, [0; AXES])]).unwrap());
    }
}
