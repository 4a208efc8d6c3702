//! Speed and position of the axes over time, and the sound of the motors.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use plotters::prelude::*;

/// Points of a curve.
const POINTS: usize = 2000;
/// Samples a second of the sound.
const SAMPLE_RATE: u32 = 44_100;
/// Steps of a full step at 1/256: what a motor sounds with.
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

    /// Draws the first `axes` axes into `path`.
    pub(super) fn draw(&self, axes: usize, path: &Path) -> Result<(), Box<dyn Error>> {
        let root = SVGBackend::new(path, (1000, 700)).into_drawing_area();
        root.fill(&WHITE)?;
        let (upper, lower) = root.split_vertically(350);
        let seconds = |cycle: u64| cycle as f64 * f64::from(self.cycle_ns) * 1e-9;
        let position = |axis: usize| {
            self.points.iter().map(move |(cycle, p)| (seconds(*cycle), p.get(axis).copied().unwrap_or(0) as f64))
        };
        let speed = |axis: usize| {
            self.points.windows(2).filter_map(move |pair| {
                let [(c0, p0), (c1, p1)] = pair else { return None };
                let steps = p1.get(axis)? - p0.get(axis)?;
                Some((seconds(*c1), steps as f64 / (seconds(*c1) - seconds(*c0)) / 1000.0))
            })
        };
        curves(&upper, "speed", "steps/ms", &(0..axes).map(|a| speed(a).collect()).collect::<Vec<_>>())?;
        curves(&lower, "position", "steps", &(0..axes).map(|a| position(a).collect()).collect::<Vec<_>>())?;
        root.present()?;
        Ok(())
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn curves(area: &Area<'_>, title: &str, unit: &str, curves: &[Vec<(f64, f64)>]) -> Result<(), Box<dyn Error>> {
    let all = || curves.iter().flatten();
    let end = all().map(|(x, _)| *x).fold(1e-6, f64::max);
    let (low, high) = all().fold((0.0, 1.0), |(low, high): (f64, f64), (_, y)| (low.min(*y), high.max(*y)));
    let room = (high - low) * 0.05;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(title, ("sans-serif", 18))
        .x_label_area_size(34)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..end, low - room..high + room)?;
    chart.configure_mesh().x_desc("time in s").y_desc(unit).light_line_style(WHITE).draw()?;
    for (axis, curve) in curves.iter().enumerate() {
        let color = Palette99::pick(axis).to_rgba();
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), color.stroke_width(2)))?
            .label(format!("axis {}", axis + 1))
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
    Ok(())
}

/// The sound of the motors, written while they run: each hums with its full steps.
pub(super) struct Sound {
    writer: hound::WavWriter<BufWriter<File>>,
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
        let writer = hound::WavWriter::create(path, spec)?;
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
