//! Splits arcs of a part program into chords.

use std::collections::VecDeque;

use step_motion::{Arc, Turning};

use super::AXES;
use super::item::{Item, Line};
use super::modes::State;
use super::numbers::Numbers;

/// How far chords are from their arc at most, in um, or half a step if that is more; they are computed in 0.1 um.
pub(super) const CHORD_UM: u32 = 2;
/// No more than this, however coarse the steps are.
const COARSEST_UM: u32 = 50;

impl State {
    /// Returns a place in the axes of the plane.
    fn flat(&self, place: [f64; AXES]) -> [f64; 2] {
        let [a, b, _] = self.plane;
        [a, b].map(|axis| place.get(axis).copied().unwrap_or_default())
    }

    /// The center of an arc, in the plane.
    pub(super) fn center(&self, to: [f64; AXES], numbers: &Numbers, turning: Turning) -> Result<[f64; 2], String> {
        let (from, to) = (self.flat(self.at), self.flat(to));
        let [_, _, axis] = self.plane;
        if numbers.center.get(axis).copied().flatten().is_some() {
            return Err("a center of I and J in G17, I and K in G18, J and K in G19".to_owned());
        }
        let Some(radius) = numbers.radius.map(|radius| radius * self.unit) else {
            if numbers.center.iter().all(Option::is_none) {
                return Err("an arc needs its center (I, J, K, from where it begins) or its radius R".to_owned());
            }
            let [i, j] = self.flat(numbers.center.map(|away| away.unwrap_or(0.0) * self.unit));
            return Ok([from[0] + i, from[1] + j]);
        };
        if numbers.center.iter().any(Option::is_some) {
            return Err("R together with I, J or K: an arc takes one or the other".to_owned());
        }
        within_reach(radius)?;
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let chord = x.hypot(y);
        if chord < 1e-4 {
            return Err("R: an arc that ends where it begins needs I, J or K".to_owned());
        }
        // From the middle of the chord to the center, to the left for less than half a turn counter-clockwise.
        let square = radius * radius - chord * chord / 4.0;
        if chord / 2.0 > radius.abs() + 2e-3 {
            return Err(format!("R{radius}: two places {chord:.4} mm apart are on no circle of that radius"));
        }
        let left = (turning == Turning::Counterclockwise) == (radius > 0.0);
        let away = square.max(0.0).sqrt() / chord * if left { 1.0 } else { -1.0 };
        Ok([f64::midpoint(from[0], to[0]) - y * away, f64::midpoint(from[1], to[1]) + x * away])
    }

    /// Returns the chords; the third axis follows the angle, because chords differ in angle.
    pub(super) fn arc(
        &mut self,
        to: [f64; AXES],
        center: [f64; 2],
        turning: Turning,
        feed: Option<u32>,
        items: &mut VecDeque<Item>,
    ) -> Result<(), String> {
        let (from, end) = (self.flat(self.at), self.flat(to));
        for [x, y] in [from, end] {
            within_reach((x - center[0]).hypot(y - center[1]))?;
        }
        // The ends of finer chords would lie on few of the finer axis's steps, and their corners would be those of the rounding.
        let [a, b, _] = self.plane.map(|axis| self.half_steps.get(axis).copied().unwrap_or_default());
        let off = a.min(b).clamp(CHORD_UM * 10, COARSEST_UM * 10);
        let units = |place: [f64; 2]| place.map(|mm| (mm * 1e4).round() as i32);
        let chords: Vec<_> = Arc::new(units(from), units(end), units(center), turning, off)
            .map_err(|e| {
                format!("{e}, in 0.1 um: start and end are not on one circle around the center, or its radius is 0")
            })?
            .map(|chord| chord.map(|part| f64::from(part) / 1e4))
            .collect();
        let mut before = from;
        let angles: Vec<f64> =
            chords.iter().map(|chord| angle(std::mem::replace(&mut before, *chord), *chord, center)).collect();
        let (whole, mut swept) = (angles.iter().sum::<f64>(), 0.0);
        let (begin, mut bends) = (self.at, false);
        for (chord, angle) in chords.iter().zip(&angles).take(chords.len().saturating_sub(1)) {
            swept += angle;
            let mut place = begin;
            let [a, b, c] = self.plane;
            for (axis, place) in place.iter_mut().enumerate() {
                let (from, to) =
                    (begin.get(axis).copied().unwrap_or_default(), to.get(axis).copied().unwrap_or_default());
                if axis == a {
                    *place = chord[0];
                } else if axis == b {
                    *place = chord[1];
                } else if axis == c {
                    *place = from + (to - from) * swept / whole;
                }
            }
            items.push_back(Item::Line(Line { to: place, feed, bends }));
            bends = true;
        }
        self.end(Line { to, feed, bends }, items);
        Ok(())
    }
}

/// Refuses a radius that the chords cannot have.
fn within_reach(radius: f64) -> Result<(), String> {
    let most = f64::from(Arc::MAX_RADIUS) / 1e4;
    if radius.abs() <= most {
        return Ok(());
    }
    Err(format!("a radius of {radius:.0} mm is too large: at most {most:.0} mm"))
}

/// Returns the angle between two points, seen from a center.
fn angle(from: [f64; 2], to: [f64; 2], center: [f64; 2]) -> f64 {
    let [[x0, y0], [x1, y1]] = [from, to].map(|[x, y]| [x - center[0], y - center[1]]);
    (x0 * y1 - y0 * x1).atan2(x0 * x1 + y0 * y1).abs()
}
