//! The ten toolpaths, and the machine that they are for.
//!
//! The images that count instructions take them from here too (`tests/bare-metal/build.rs`).

use core::f64::consts::TAU;

pub(crate) const N: usize = 3;
/// Lines that are looked ahead, as many as grbl has blocks.
pub(crate) const AHEAD: usize = 16;
/// In mm.
pub(crate) const DEVIATION: f64 = 0.02;
/// Of each axis: steps/mm, mm/s, mm/s², mm/s³.
pub(crate) const AXES: [[f64; 4]; N] =
    [[80.0, 200.0, 2000.0, 60_000.0], [80.0, 150.0, 1500.0, 60_000.0], [400.0, 20.0, 200.0, 10_000.0]];

pub(crate) type Place = [f64; N];

/// Lines, each with its end in mm and its feed in mm/s.
pub(crate) struct Toolpath {
    pub(crate) name: &'static str,
    pub(crate) lines: Vec<(Place, f64)>,
    /// With a limit of jerk, how many percent it may take longer than the optimum without one: somewhat more than when this was last
    /// recorded.
    pub(crate) smooth: f64,
}

/// Where a line really ends: on a step.
pub(crate) fn on_steps(place: Place) -> [i64; N] {
    core::array::from_fn(|axis| (place[axis] * AXES[axis][0]).round() as i64)
}

/// Chords of a curve, `step` of its parameter apart.
fn curve(feed: f64, until: f64, step: f64, place: impl Fn(f64) -> Place) -> Vec<(Place, f64)> {
    let count = (until / step).round() as u32;
    (0..=count).map(|k| (place(f64::from(k) * step), feed)).collect()
}

/// Numbers from 0 to below 1, always the same.
fn draws() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

pub(crate) fn toolpaths() -> [Toolpath; 10] {
    let path = |name, lines, smooth| Toolpath { name, lines, smooth };
    let rectangle = [[100.0, 0.0, 0.0], [100.0, 60.0, 0.0], [0.0, 60.0, 0.0], [0.0; 3]];
    let raster = (0..20).flat_map(|row| {
        let (y, end) = (f64::from(row) * 2.0, if row % 2 == 0 { 50.0 } else { 0.0 });
        [([50.0 - end, y, 0.0], 100.0), ([end, y, 0.0], 100.0)]
    });
    let relief = (0..8).flat_map(|row| {
        (0..=100).map(move |k| {
            let x = 0.3 * f64::from(if row % 2 == 0 { k } else { 100 - k });
            ([x, f64::from(row), 0.5 * (x / 2.0).sin()], 60.0)
        })
    });
    let star = (0..=14).map(|k| {
        let (radius, angle) = (if k % 2 == 0 { 30.0 } else { 10.0 }, f64::from(k) * TAU / 14.0);
        ([radius * angle.cos(), radius * angle.sin(), 0.0], 150.0)
    });
    let drilling = (0..12).flat_map(|k| {
        let (x, y) = (f64::from(k % 4) * 15.0, f64::from(k / 4) * 15.0);
        [([x, y, 2.0], 1000.0), ([x, y, -3.0], 5.0), ([x, y, 2.0], 1000.0)]
    });
    let mut draw = draws();
    let mut at = [0.0; N];
    let engraving = (0..400).map(|_| {
        for part in at.iter_mut().take(2) {
            *part += 1.6 * draw() - 0.8;
        }
        (at, 80.0)
    });
    [
        path("rectangle", rectangle.map(|place| (place, 120.0)).to_vec(), 4.3),
        path("raster", raster.collect(), 9.4),
        path("circle", curve(120.0, TAU, 0.02, |t| [20.0 - 20.0 * t.cos(), 20.0 * t.sin(), 0.0]), 20.3),
        path("small circles", curve(60.0, 5.0 * TAU, 0.09, |t| [1.0 - t.cos(), t.sin(), 0.0]), 65.6),
        path("spiral", curve(100.0, 40.0, 0.05, |t| [0.5 * t * t.cos(), 0.5 * t * t.sin(), 0.0]), 13.4),
        path("trochoid", curve(80.0, 60.0, 0.1, |t| [0.3 * t + 2.0 * t.sin(), 2.0 - 2.0 * t.cos(), 0.0]), 63.8),
        path("star", star.collect(), 13.5),
        path("engraving", engraving.collect(), 66.0),
        path("relief", relief.collect(), 27.1),
        path("drilling", drilling.collect(), 4.7),
    ]
}
