//! Turns lines into steps as firmware does: planned and cut into segments by the background, and added up by the interrupt.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufReader;

use servowire_decode::fault::{At, Fault};
use step_motion::{Axes, AxesQueue, AxesTimer, AxisPulse, AxisSetup, Clock, Direction, Path, Work};

use super::AXES;
use super::arcs::CHORD_UM;
use super::item::{Item, Line};
use super::program::Program;
use super::setup;

/// Number of lines in the look-ahead.
const AHEAD: usize = 64;
/// Slots per axis in the queue.
const SLOTS: usize = 2049;
/// Motion in each half of the queue, in ns: this much later the machine knows that it has come to rest.
const REACH_NS: u32 = 1_000_000;

/// The steps of all axes in the order of time, in ns. A line of the program is read when there is room for it.
pub(crate) struct Steps {
    program: Program<BufReader<File>>,
    name: String,
    axes: Box<Axes<'static, AXES, AHEAD, SLOTS>>,
    timer: AxesTimer<'static, AXES, SLOTS>,
    setups: [AxisSetup; AXES],
    deviation: u32,
    /// How far corners may be rounded at present, in um.
    present: u32,
    /// How far off the chords of an arc may be where they meet, in um: they are rounded there to half a step of the coarsest axis.
    chord: u32,
    /// A chord of the present arc has steps: what follows begins at a joint of the arc.
    bent: bool,
    /// Nothing moves before a rest of this many ns has ended.
    rest: Option<u64>,
    /// The program has ended.
    over: bool,
    /// Lines that were read.
    lines: u64,
    /// When the interrupt comes next, if it does, and when it last came, in ns.
    next: Option<u64>,
    now: u64,
    /// Steps made in one interrupt.
    pulses: VecDeque<AxisPulse>,
    fault: Option<Fault>,
}

impl Steps {
    pub(super) fn new(
        program: Program<BufReader<File>>,
        name: String,
        axes: [AxisSetup; AXES],
        deviation: u32,
    ) -> Result<Self, step_motion::Error> {
        let setups = axes;
        let half_step = setups.iter().map(|axis| 500_000_u32.div_ceil(axis.steps_per_m.max(1))).max().unwrap_or(0);
        // As long-lived as a machine; a run has one.
        let queue: &'static AxesQueue<AXES, SLOTS> = Box::leak(Box::new(AxesQueue::new()));
        let (axes, timer) = Axes::new(queue, Path::new(Clock::NANOSECONDS, axes, deviation)?);
        let axes = Box::new(axes.with_reach(REACH_NS));
        Ok(Self {
            program: program.with_scales(setups.map(|axis| axis.steps_per_m)),
            name,
            axes,
            timer,
            setups,
            deviation,
            present: deviation,
            chord: CHORD_UM.max(half_step).saturating_add(half_step),
            bent: false,
            rest: None,
            over: false,
            lines: 0,
            next: None,
            now: 0,
            pulses: VecDeque::new(),
            fault: None,
        })
    }

    /// When the motion so far has ended, in ns.
    pub(crate) const fn end(&self) -> u64 {
        self.now
    }

    /// Lines that were read so far.
    pub(crate) const fn lines(&self) -> u64 {
        self.lines
    }

    /// Why it ended early.
    pub(crate) const fn fault(&self) -> Option<&Fault> {
        self.fault.as_ref()
    }

    /// Reads on until the path is full, or has to come to rest.
    fn fill(&mut self) {
        while !self.over && self.rest.is_none() && !self.axes.is_full() {
            match self.program.next() {
                Some(Ok(Item::Line(line))) => self.push(line),
                Some(Ok(Item::Rest(ns))) => self.rest = Some(ns),
                Some(Ok(Item::Deviation(um))) => self.present = um.unwrap_or(self.deviation),
                Some(Err(fault)) => (self.fault, self.over) = (Some(fault), true),
                None => self.over = true,
            }
        }
    }

    /// Between the chords of an arc is no corner: the machine may pass where they meet as far off as they are anyway.
    fn push(&mut self, Line { to, feed, bends }: Line) {
        let mut target = [0; AXES];
        for ((target, mm), axis) in target.iter_mut().zip(to).zip(&self.setups) {
            *target = setup::in_steps(mm, axis);
        }
        self.lines += 1;
        self.bent &= bends;
        self.axes.set_deviation(if self.bent { self.present.max(self.chord) } else { self.present });
        self.bent |= self.axes.target() != target;
        // It is not full, and 100 m of 10000 steps/mm are fewer than 2^31.
        if self.axes.push(target, feed.unwrap_or(u32::MAX)).is_err() {
            let what = setup::outside(to, &self.setups).unwrap_or_default();
            (self.fault, self.over) = (Some(self.program.refuse(what)), true);
        }
    }

    /// Does all work of the background until it has to wait; returns `false` if it is at rest and nothing is to come.
    fn plan(&mut self) -> bool {
        loop {
            self.fill();
            match self.axes.poll() {
                Work::More => {}
                Work::Start => {
                    self.next = self.next.or(Some(self.now));
                    return true;
                }
                Work::Later => return true,
                Work::Rest => match self.rest.take() {
                    Some(ns) => self.now = self.now.saturating_add(ns),
                    None => return !self.over,
                },
                Work::TooFewSlots => {
                    let what = "the stop after a part of the path needs more segments than the queue has";
                    // It comes to rest first.
                    (self.fault, self.over) = (Some(Fault::new(&self.name, At::File, what)), true);
                }
            }
        }
    }

    /// Does what the interrupt does.
    fn fire(&mut self, now: u64) {
        self.now = now;
        let fired = self.timer.fire();
        for axis in (0..AXES as u8).filter(|axis| fired.steps() >> axis & 1 == 1) {
            let direction = if fired.reverse() >> axis & 1 == 1 { Direction::Reverse } else { Direction::Forward };
            self.pulses.push_back(AxisPulse { axis, tick: now, direction });
        }
        self.next = (fired.wait() > 0).then(|| now.saturating_add(fired.wait().into()));
    }
}

impl Iterator for Steps {
    type Item = AxisPulse;

    fn next(&mut self) -> Option<AxisPulse> {
        loop {
            if let Some(pulse) = self.pulses.pop_front() {
                return Some(pulse);
            }
            if !self.plan() {
                return None;
            }
            if let Some(now) = self.next {
                self.fire(now);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use step_motion::Limits;

    use super::*;

    fn program(text: &str) -> Program<BufReader<File>> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        std::io::Seek::rewind(&mut file).unwrap();
        Program::new("part.nc", BufReader::new(file), false)
    }

    fn axes() -> [AxisSetup; AXES] {
        let limits = Limits::new(100_000, 400_000).unwrap();
        [limits, limits, limits.with_jerk(8_000_000).unwrap()].map(|limits| AxisSetup::new(limits, 80_000))
    }

    fn steps(text: &str) -> Steps {
        Steps::new(program(text), "part.nc".to_owned(), axes(), 20).unwrap()
    }

    /// The steps of each axis, as the exact search of `Path` has them.
    fn searched(text: &str) -> [Vec<(u64, Direction)>; AXES] {
        let mut path = Path::<AXES, 1024>::new(Clock::NANOSECONDS, axes(), 20).unwrap();
        for item in program(text).with_scales(axes().map(|axis| axis.steps_per_m)) {
            let Ok(Item::Line(Line { to, feed, .. })) = item else { panic!("{item:?}") };
            path.push(to.map(|mm| (mm * 80.0).round() as i64), feed.unwrap_or(u32::MAX)).unwrap();
        }
        let mut found = [const { Vec::new() }; AXES];
        while let Some(line) = path.next_line() {
            for pulse in line {
                found[usize::from(pulse.axis)].push((pulse.tick, pulse.direction));
            }
        }
        found
    }

    /// Every step is where the exact search has it, to the 25 ns that a segment may be off; in the stop after the last
    /// block, to a sixteenth of its interval.
    #[test]
    fn segments_make_the_steps_of_the_exact_search() {
        let text =
            "G1 X20 Y10 F6000\nX30 Y10\nG3 X30 Y30 J10\nG1 X-5 Y20 Z-3\nX0 Y0 Z0\nX3\nX3.5 Y0.4\nX4 Y1\nG0 X0 Y0\n";
        let mut found = [const { Vec::new() }; AXES];
        let mut steps = steps(text);
        for pulse in steps.by_ref() {
            found[usize::from(pulse.axis)].push((pulse.tick, pulse.direction));
        }
        assert!(steps.fault().is_none());
        for (found, searched) in found.iter().zip(&searched(text)) {
            assert!(found.len() == searched.len() && found.len() > 200, "{} of {}", found.len(), searched.len());
            let mut before = 0;
            for ((tick, way), (want, want_way)) in found.iter().zip(searched) {
                let off = tick.abs_diff(*want);
                let ends = steps.end() - want < 2 * u64::from(REACH_NS) + 5_000_000;
                let allowed = if ends { 25.max((want - before) / 16) } else { 26 };
                assert!(way == want_way && off <= allowed, "{off} ns at {want} of {}", steps.end());
                before = *want;
            }
        }
    }

    /// Rests begin where the machine rests, and last as long as they say.
    #[test]
    fn rests_last_as_long_as_they_say() {
        let still = |text: &str| {
            let times: Vec<u64> = steps(text).map(|pulse| pulse.tick).collect();
            times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap()
        };
        // Half a step at 400000 steps/s² takes 1.58 ms: from the last step to rest, and from there to the first.
        let rest = still("G1 X1 F6000\nG4 P0.5\nX2\n");
        assert!((503_000_000..506_000_000).contains(&rest), "{rest}");
        assert!(still("G1 X1 F6000\nX2\n") < 2_000_000);
        assert!(still("G1 X1 F6000\nM0\nX2\n") > 3_000_000);
        assert!(still("G61 G1 X1 F6000\nX1 Y1\n") > still("G64 P0.5 G1 X1 F6000\nX1 Y1\n"));
    }

    /// How long a program takes, in s, on axes of this many steps/mm and mm/s².
    fn seconds(text: &str, (scale, acceleration): (u32, u32), deviation: u32) -> f64 {
        let limits = Limits::new(scale * 1250, scale * acceleration).unwrap();
        let axes = [AxisSetup::new(limits, scale * 1000); AXES];
        let mut steps = Steps::new(program(text), "part.nc".to_owned(), axes, deviation).unwrap();
        steps.by_ref().for_each(drop);
        assert!(steps.fault().is_none());
        steps.end() as f64 / 1e9
    }

    /// A half circle of 20 mm at 100 mm/s and 5 m/s², with a corner at either end: as if it said G4 P0 there. A stop at each
    /// of its chords would take twice as long.
    #[test]
    fn an_arc_stops_at_its_ends_only() {
        let text = "G1 X20 F6000\nG3 X-20 I-20 J0\nG1 X-40\n";
        let rests = seconds(&text.replace('\n', "\nG4 P0\n"), (80, 5000), 20);
        for mode in ["G61", "G61.1", "G64 P0", "G64 P0.001"] {
            let took = seconds(&format!("{mode}\n{text}"), (80, 5000), 20);
            assert!((took - rests).abs() < 0.010, "{mode}: {took} s, {rests} s");
        }
        assert!((seconds(text, (80, 5000), 0) - rests).abs() < 0.010);
    }

    /// On coarse axes as well, where the ends of chords are rounded to steps of 0.2 mm: as fast as with G64, and no more than a tenth slower
    /// than on fine axes.
    #[test]
    fn an_arc_of_coarse_steps_is_no_slower() {
        let text = "G1 X20 F6000\nG3 X-20 I-20 J0\nG1 X-40\n";
        let fine = seconds(&format!("G61\n{text}"), (80, 5000), 20);
        for scale in [5, 10, 20] {
            let took = ["G61", "G64"].map(|mode| seconds(&format!("{mode}\n{text}"), (scale, 5000), 20));
            assert!(took[0] < fine * 1.1 && took[0] < took[1] + 0.060, "{scale} steps/mm: {took:?} s, {fine} s");
        }
    }

    /// A circle of 200 mm at 316 mm/s, where all of 500 mm/s² is needed to stay on it, at 25 steps/mm: chords so fine that their corners are
    /// those of rounding would take twice the time of a straight line.
    #[test]
    fn a_circle_of_coarse_steps_is_cut_coarsely() {
        let (a, r) = (500.0, 200.0_f64);
        let v = (a * r).sqrt();
        let least = v / a + std::f64::consts::TAU * r / v;
        for feed in [v, 10.0 * v] {
            let took = seconds(&format!("G1 F{}\nG3 X0 Y0 I{r}\n", feed * 60.0), (25, 500), 20);
            assert!(took < least * 1.15, "{took} s, {least} s at {feed} mm/s");
        }
    }

    /// The first chord of an arc may have no steps: the corner before it stays one. At 50 mm/s² a corner of 2 um costs 10 ms
    /// less than a stop.
    #[test]
    fn a_corner_before_an_arc_stays_one() {
        let text = "G61 G1 X20 F6000\nG3 X19 I-0.5 J0\n";
        let rests = seconds(&text.replacen('\n', "\nG4 P0\n", 1), (5, 50), 20);
        let stops = seconds(text, (5, 50), 20);
        assert!((stops - rests).abs() < 0.004, "{stops} s, {rests} s");
    }

    /// A line beyond a soft limit ends the program before it, at rest; an axis that turns has its pause.
    #[test]
    fn soft_limits_and_pauses_of_an_axis() {
        let mut axes = axes();
        axes[1] = axes[1].with_soft_limits(-80, 160).with_reversal_pause(5_000_000);
        let run = |text: &str| Steps::new(program(text), "part.nc".to_owned(), axes, 2000).unwrap();
        let mut steps = run("G1 Y2 F6000\nX1 Y1.5\nX2 Y2.1\nX0 Y0\n");
        assert_eq!(steps.by_ref().count(), 160 + 80 + 40);
        let fault = steps.fault().unwrap().to_string();
        assert!(fault.contains("line 3") && fault.contains("Y2.100 is above the high soft limit, 2.000 mm"), "{fault}");
        let turns: Vec<u64> =
            run("G1 Y1 F6000\nX1 Y0.5\n").filter(|pulse| pulse.axis == 1).map(|pulse| pulse.tick).collect();
        assert!(turns[80] - turns[79] >= 5_000_000, "{}", turns[80] - turns[79]);
    }

    /// What is wrong in the middle of a program ends it there, at rest.
    #[test]
    fn a_fault_ends_the_program_at_rest() {
        let mut steps = steps("G1 X1 F6000\nX2\nG99\nX3\n");
        assert_eq!(steps.by_ref().count(), 160);
        assert!(steps.fault().unwrap().to_string().contains("line 3"));
    }
}
