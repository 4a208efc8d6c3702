//! Speed and position of the axes over time, and the sound of the motors.

use std::io::BufWriter;
use std::path::Path;

use crate::drawing::{Chart, Drawn, Share, Sheet, Stroke};
use crate::files::{Written, create};

/// Maximum number of points in a curve.
const POINTS: usize = 2000;
/// Minimum time over which a speed is counted, in ns: one step in a cycle is not yet a speed.
const SPAN: u64 = 250_000;
/// Samples per second of the sound.
const SAMPLE_RATE: u32 = 44_100;
/// Microsteps of a full step at 1/256, which is the pitch of a motor.
const MICROSTEPS: f64 = 256.0;

/// Positions of the axes, cycle by cycle, thinned out.
pub(super) struct Curves {
    cycle_ns: u32,
    /// Cycles between two points.
    every: u64,
    points: Vec<(u64, [i64; 4])>,
}

impl Curves {
    pub(super) fn new(cycle_ns: u32) -> Self {
        Self { cycle_ns, every: 1, points: Vec::new() }
    }

    pub(super) fn add(&mut self, cycle: u64, positions: [i64; 4]) {
        if cycle % self.every != 0 {
            return;
        }
        self.points.push((cycle, positions));
        if self.points.len() >= 2 * POINTS {
            self.every *= 2;
            let every = self.every;
            self.points.retain(|(cycle, _)| cycle % every == 0);
        }
    }

    /// The speed of an axis in steps/ms, in the middle of the time over which it was counted.
    fn speeds(&self, axis: usize) -> Vec<(f64, f64)> {
        let ms = |cycle: u64| cycle as f64 * f64::from(self.cycle_ns) * 1e-6;
        let apart = SPAN.div_ceil(u64::from(self.cycle_ns.max(1)) * self.every).max(1) as usize;
        let later = self.points.iter().skip(apart);
        let pairs = self.points.iter().zip(later);
        let speed = pairs.filter_map(|((c0, p0), (c1, p1))| {
            let steps = p1.get(axis)? - p0.get(axis)?;
            Some((f64::midpoint(ms(*c0), ms(*c1)) / 1000.0, steps as f64 / (ms(*c1) - ms(*c0))))
        });
        speed.collect()
    }

    /// Draws the first `axes` axes, each with its speed and its position.
    pub(super) fn draw(&self, axes: usize) -> Drawn<String> {
        let seconds = |cycle: u64| cycle as f64 * f64::from(self.cycle_ns) * 1e-9;
        let end = self.points.last().map_or(0.0, |(cycle, _)| seconds(*cycle)).max(1e-6);
        let mut sheet = Sheet::new("the axes of the machine", 1200);
        for axis in 0..axes {
            let position =
                self.points.iter().map(|(cycle, p)| (seconds(*cycle), p.get(axis).copied().unwrap_or(0) as f64));
            let panel = |what: &str, points: Vec<(f64, f64)>| -> Share {
                let title = format!("axis {}: {what}", axis + 1);
                (1, Box::new(Chart::new(title, "time in s", 0.0..end).with(Stroke::ONLY, points)))
            };
            let panels =
                vec![panel("speed in steps/ms", self.speeds(axis)), panel("position in steps", position.collect())];
            sheet.beside(240, panels);
        }
        sheet.svg()
    }
}

/// The sound of the motors, written while they run: each hums with its full steps.
pub(super) struct Sound {
    writer: hound::WavWriter<BufWriter<Written>>,
    cycle_ns: u32,
    written: u64,
    last: [i64; 4],
    /// Loudness of each motor: follows whether it moves.
    volume: [f64; 4],
}

impl Sound {
    pub(super) fn create(path: &Path, cycle_ns: u32) -> Result<Self, hound::Error> {
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: SAMPLE_RATE,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let writer = hound::WavWriter::new(create(path)?, spec)?;
        Ok(Self { writer, cycle_ns, written: 0, last: [0; 4], volume: [0.0; 4] })
    }

    pub(super) fn add(&mut self, cycle: u64, positions: [i64; 4]) -> Result<(), hound::Error> {
        let due = u128::from(cycle) * u128::from(self.cycle_ns) * u128::from(SAMPLE_RATE) / 1_000_000_000;
        while u128::from(self.written) < due {
            let mut sum = 0.0;
            for ((position, last), volume) in positions.iter().zip(&self.last).zip(&mut self.volume) {
                let target = if position == last { 0.0 } else { 1.0 };
                *volume += (target - *volume) * 0.005;
                let phase = *position as f64 / MICROSTEPS * core::f64::consts::TAU;
                // A hum with some overtones.
                sum += *volume * (phase.sin() + 0.4 * (2.0 * phase).sin() + 0.2 * (3.0 * phase).sin());
            }
            self.last = positions;
            self.written += 1;
            self.writer.write_sample(((sum / 8.0).clamp(-1.0, 1.0) * f64::from(i16::MAX)) as i16)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), hound::Error> {
        self.writer.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;

    #[test]
    fn every_axis_has_its_panels() {
        let mut curves = Curves::new(4000);
        for cycle in 0..5000 {
            let at = cycle as i64;
            curves.add(cycle, [at, -at, 1_000_000 * at, 0]);
        }
        let svg = curves.draw(4).unwrap();
        nothing_is_covered(&svg);
        assert!((1..=4).all(|axis| svg.contains(&format!("axis {axis}: speed in steps/ms"))), "{svg}");
        nothing_is_covered(&Curves::new(4000).draw(1).unwrap());
    }

    /// A step in every 16th cycle of 4 us: 15.6 steps/ms, and neither 250 nor 0.
    #[test]
    fn a_step_in_a_cycle_is_no_speed() {
        for cycles in [2_000, 100_000] {
            let mut curves = Curves::new(4000);
            (0..cycles).for_each(|cycle| curves.add(cycle, [cycle as i64 / 16, 0, 0, 0]));
            let speeds = curves.speeds(0);
            assert!(speeds.len() > 100 && speeds.iter().all(|(_, speed)| (speed - 15.625).abs() < 4.0), "{speeds:?}");
        }
    }
}
