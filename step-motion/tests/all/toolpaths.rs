//! Ten toolpaths beside the time-optimal run of the same lines in floating point: forwards and back over the speeds at the corners.

use core::f64::consts::PI;
use step_motion::{AxisSetup, Clock, Limits, Path};

const N: usize = 3;

/// Steps/s, steps/s², steps/mm of each axis; deviation at corners in mm.
const SPEED: [f64; N] = [20_000.0, 16_000.0, 12_000.0];
const ACCELERATION: [f64; N] = [120_000.0, 100_000.0, 200_000.0];
const SCALE: [f64; N] = [80.0, 100.0, 400.0];
const DEVIATION: f64 = 0.02;

type Lines = Vec<([f64; N], f64)>;

/// Ends of the lines in mm, and their feeds in mm/s.
fn toolpaths() -> Vec<(&'static str, Lines)> {
    let turn = |n: usize, of: usize| 2.0 * PI * n as f64 / of as f64;
    let round = |r: f64, angle: f64, z: f64| [r * angle.cos(), r * angle.sin(), z];
    let mut all = vec![
        ("one line", vec![([200.0, 30.0, 4.0], 120.0)]),
        (
            "a square",
            (0..8).map(|n| ([40.0 * f64::from(n % 4 / 2), 40.0 * f64::from((n + 1) % 4 / 2), 0.0], 90.0)).collect(),
        ),
        ("a zigzag", (1..40).map(|n| ([f64::from(n) * 2.0, f64::from(n % 2) * 3.0, 0.0], 150.0)).collect()),
        ("a circle of 10 mm", (1..=180).map(|n| (round(10.0, turn(n, 180), 0.0), 100.0)).collect()),
        ("a circle of 1 mm", (1..=60).map(|n| (round(1.0, turn(n, 60), 0.0), 100.0)).collect()),
        ("a spiral", (1..=300).map(|n| (round(n as f64 * 0.1, turn(n, 60), 0.0), 60.0)).collect()),
        ("a helix", (1..=240).map(|n| (round(15.0, turn(n, 80), n as f64 * 0.02), 80.0)).collect()),
        ("a star", (1..=20).map(|n| (round(if n % 2 == 0 { 30.0 } else { 10.0 }, turn(n, 20), 0.0), 110.0)).collect()),
    ];
    let mut raster: Lines = Vec::new();
    for row in 0..12 {
        let (y, x) = (f64::from(row), if row % 2 == 0 { 50.0 } else { 0.0 });
        raster.extend([([50.0 - x, y, 0.0], 20.0), ([x, y, 0.0], 140.0)]);
    }
    all.push(("a raster", raster));
    // Lines of any length and direction.
    let (mut state, mut at) = (0x2545_f491_4f6c_dd1d_u64, [0.0; N]);
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let any = (0..150).map(|_| {
        let far = random() * random() * 20.0;
        for x in &mut at {
            *x += (random() - 0.5) * far;
        }
        (at, 20.0 + random() * 180.0)
    });
    all.push(("any lines", any.collect()));
    all
}

/// Whole steps, as the path has them; lines that have none are left out.
fn steps(lines: &Lines) -> Vec<([i64; N], f64)> {
    let mut before = [0; N];
    let mut all = Vec::new();
    for (end, feed) in lines {
        let end: [i64; N] = core::array::from_fn(|axis| (end[axis] * SCALE[axis]).round() as i64);
        if end != before {
            all.push((end, *feed));
        }
        before = end;
    }
    all
}

/// A line: its length in mm, its direction, and the greatest speed and acceleration along it.
struct Line {
    length: f64,
    way: [f64; N],
    v: f64,
    a: f64,
}

fn line(from: [i64; N], to: [i64; N], feed: f64) -> Line {
    let mm: [f64; N] = core::array::from_fn(|axis| (to[axis] - from[axis]) as f64 / SCALE[axis]);
    let length = mm.iter().map(|x| x * x).sum::<f64>().sqrt();
    let way = mm.map(|x| x / length);
    let least = |limits: [f64; N]| {
        (0..N)
            .filter(|axis| way[*axis] != 0.0)
            .map(|axis| limits[axis] / SCALE[axis] / way[axis].abs())
            .fold(f64::MAX, f64::min)
    };
    Line { length, way, v: least(SPEED).min(feed), a: least(ACCELERATION) }
}

/// The greatest speed at the corner between two lines: as if it were rounded with the deviation, or lay on a circle through the middle of
/// the shorter line; with what each axis can do along the change of direction.
fn corner(from: &Line, to: &Line) -> f64 {
    let cos: f64 = (0..N).map(|axis| from.way[axis] * to.way[axis]).sum();
    let [s, c] = [cos, -cos].map(|x| f64::midpoint(1.0, x).max(0.0).sqrt());
    if c < 1e-7 {
        return f64::MAX;
    }
    let turn = 2.0 * c;
    let own = (0..N).map(|axis| {
        let part = (to.way[axis] - from.way[axis]).abs();
        if part < 1e-12 { f64::MAX } else { ACCELERATION[axis] / SCALE[axis] * turn / part }
    });
    let a = own.fold(to.a, f64::min);
    let round = DEVIATION * s / (1.0 - s).max(1e-12);
    (a * round.min(from.length.min(to.length) / 2.0 * s / c)).sqrt()
}

/// The least time from rest to rest.
fn least_time(lines: &[([i64; N], f64)]) -> f64 {
    let mut at = [0; N];
    let lines: Vec<Line> = lines
        .iter()
        .map(|(end, feed)| {
            let own = line(at, *end, *feed);
            at = *end;
            own
        })
        .collect();
    let mut speeds = vec![0.0];
    for pair in lines.windows(2) {
        speeds.push(corner(&pair[0], &pair[1]).min(pair[0].v).min(pair[1].v));
    }
    speeds.push(0.0);
    for (at, line) in lines.iter().enumerate().rev() {
        speeds[at] = f64::min(speeds[at], (speeds[at + 1].powi(2) + 2.0 * line.a * line.length).sqrt());
    }
    let mut time = 0.0;
    for (at, line) in lines.iter().enumerate() {
        speeds[at + 1] = f64::min(speeds[at + 1], (speeds[at].powi(2) + 2.0 * line.a * line.length).sqrt());
        let (from, to) = (speeds[at], speeds[at + 1]);
        let peak = (f64::midpoint(from.powi(2), to.powi(2)) + line.a * line.length).sqrt().min(line.v);
        let ramps = (2.0 * peak.powi(2) - from.powi(2) - to.powi(2)) / (2.0 * line.a);
        time += (2.0 * peak - from - to) / line.a + (line.length - ramps) / peak;
    }
    time
}

/// The time that the path takes, all lines in its queue.
fn time(lines: &[([i64; N], f64)], jerk: Option<u64>) -> f64 {
    let axes = core::array::from_fn(|axis| {
        let limits = Limits::new(SPEED[axis] as u32, ACCELERATION[axis] as u32).unwrap();
        let limits = jerk.map_or(limits, |jerk| limits.with_jerk(jerk).unwrap());
        AxisSetup::new(limits, (SCALE[axis] * 1000.0) as u32)
    });
    let clock = Clock::new(10_000_000).unwrap();
    let mut path = Path::<N, 320>::new(clock, axes, (DEVIATION * 1000.0) as u32).unwrap();
    for (end, feed) in lines {
        path.push(*end, (feed * 1000.0) as u32).unwrap();
    }
    let mut end = 0;
    while let Some(line) = path.next_line() {
        end = line.end();
    }
    end as f64 / 1e7
}

#[test]
fn no_toolpath_takes_more_than_the_least_time() {
    let all = toolpaths();
    assert_eq!(all.len(), 10);
    for (name, lines) in all {
        let lines = steps(&lines);
        let least = least_time(&lines);
        let own = time(&lines, None);
        assert!((0.999..1.005).contains(&(own / least)), "{name}: {own} s, {least} s are the least");
        // With a limit of jerk that hardly matters: the acceleration is reached within 50 us.
        let jerked = time(&lines, Some(4_000_000_000));
        assert!((0.999..1.05).contains(&(jerked / least)), "{name}: {jerked} s with jerk, {least} s are the least");
    }
}
