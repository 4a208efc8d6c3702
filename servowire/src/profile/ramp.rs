//! Shows the published ramp step by step: as records, in figures, and as stretches at the same ramp entry.

use std::io::{self, Write};
use std::ops::Range;

use serde::Serialize;
use step_profile::{Arithmetic, Profile, RampStep};

/// End of the step's interval, where its pulse is, in ns after the start of cycle 0.
pub(super) fn pulse_ns(step: RampStep) -> u64 {
    step.cycle * u64::from(step_profile::CYCLE_NS) + u64::from(step.sync_time)
}

/// A step as written to CSV and JSON.
#[derive(Serialize)]
pub(super) struct Record {
    step: u32,
    state: String,
    entry: u8,
    t_step_ns: u32,
    cycle: u64,
    sync_time_ns: u32,
    time_ns: u64,
}

impl From<RampStep> for Record {
    fn from(step: RampStep) -> Self {
        Self {
            step: step.index,
            state: step.state.to_string(),
            entry: step.entry,
            t_step_ns: step.t_step,
            cycle: step.cycle,
            sync_time_ns: step.sync_time,
            time_ns: pulse_ns(step),
        }
    }
}

pub(super) fn summary(profile: Profile<'_>, steps: u32, out: &mut dyn Write) -> io::Result<()> {
    let parameters = profile.parameters();
    let full = f64::from(profile.step_time_ns(31));
    let exact = f64::from(parameters.speed.raw()) * 1000.0 / 65536.0;
    let (mut zero, mut late) = (0_u32, 0_u32);
    for step in profile.steps(steps) {
        zero += u32::from(step.sync_time == 0);
        late += u32::from(step.sync_time > 3990);
    }
    let shape = profile.shape(steps);
    let proved = if profile.pru_is_exact() { "exact" } else { "outside its proved domain (68.045 kHz and above)" };
    writeln!(out, "speed constant  {}, a step every {exact:.3} ns ({:.3} kHz)", parameters.speed.raw(), 1e6 / exact)?;
    match parameters.arithmetic {
        Arithmetic::Carried => {
            writeln!(out, "full speed      on average as asked, fractions of a ns are carried over")?;
        }
        _ => writeln!(out, "full speed      a step every {full} ns, {:.1} ppm fast", (exact - full) / full * 1e6)?,
    }
    writeln!(
        out,
        "move            {steps} steps in {:.6} ms: {} up, {} at full speed, {} down",
        profile.duration_ns(steps) as f64 / 1e6,
        shape.accelerating,
        shape.constant,
        shape.decelerating
    )?;
    writeln!(out, "PRU arithmetic  {proved}")?;
    writeln!(out, "on the wire     {zero} pulses at sync_time 0 (sent as 1 ns), {late} above 3990 ns (sent as 3990 ns)")
}

/// Steps at the same ramp entry.
pub(super) struct Stretch {
    pub(super) first: RampStep,
    pub(super) last: RampStep,
    /// Start of the first interval and end of the last one.
    pub(super) ms: Range<f64>,
}

impl Stretch {
    pub(super) fn khz(&self) -> f64 {
        1e6 / f64::from(self.first.t_step)
    }

    /// Numbers of the steps.
    pub(super) fn steps(&self) -> Range<f64> {
        f64::from(self.first.index)..f64::from(self.last.index) + 1.0
    }
}

pub(super) fn stretches(profile: Profile<'_>, steps: u32) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = Vec::new();
    let mut now = 0.0;
    for step in profile.steps(steps) {
        let end = now + f64::from(step.t_step) / 1e6;
        match all.last_mut() {
            Some(stretch) if (stretch.first.entry, stretch.first.state) == (step.entry, step.state) => {
                stretch.last = step;
                stretch.ms.end = end;
            }
            _ => all.push(Stretch { first: step, last: step, ms: now..end }),
        }
        now = end;
    }
    all
}

pub(super) fn table(profile: Profile<'_>, steps: u32, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "\n  first    last  state      entry   t_step/ns   rate/kHz  ends in cycle  at ns        ms")?;
    for stretch in stretches(profile, steps) {
        let Stretch { first, last, .. } = stretch;
        writeln!(
            out,
            "{:>7} {:>7}  {:<9} {:>6} {:>11} {:>10.3} {:>14} {:>6} {:>9.3}",
            first.index,
            last.index,
            first.state,
            first.entry,
            first.t_step,
            stretch.khz(),
            last.cycle,
            last.sync_time,
            pulse_ns(last) as f64 / 1e6
        )?;
    }
    Ok(())
}
