//! What the edges of a failed frame show about its cause: two drivers at once have two clocks.

use super::receive::EdgeReceiver;
use super::spikes::Edge;
use super::trial::is_failed;
use crate::event::{Event, Place, Verdict};
use crate::time::Time;

/// Minimum number of edges on the second grid, and minimum share: one in this many.
const FEWEST_OFF: usize = 6;
const SHARE_OFF: usize = 6;
/// An edge further than this from the grid of the others, in bits, belongs to another grid, however bad the line is; and
/// the minimum number of such edges that two drivers leave.
const OFF_GRID: f64 = 0.27;
const FEWEST_FAR: usize = 4;
/// Minimum number of times that the edges of a frame change from one grid to the other. Two speakers taking turns change
/// the grid once, and each dip between them changes it twice.
const FEWEST_TURNS: usize = 6;
/// Minimum number of edges of each direction on each of the two grids: if only one direction is late, a driver is slow.
const FEWEST_EACH: usize = 2;
/// How far an edge may be from its grid, in standard deviations of edges on this line, with its minimum and maximum in
/// bits: nothing can be concluded on a worse line.
const DEVIATIONS: f64 = 4.0;
const NEAR: [f64; 2] = [0.04, 0.1];
/// One in this many of the edges near the first grid may lie beside it.
const BESIDE: usize = 8;
/// Number of bit lengths tried to each side, and the step between them: one part in this many.
const STEPS: i32 = 20;
const STEP: f64 = 1000.0;

/// Names the cause of failed frames as shown by their edges, if two drivers are on at once. Two speakers at once give
/// several failed frames, so the edges of all of them count.
pub(super) fn blame(events: &mut [Event], receiver: &EdgeReceiver) {
    let (edges, bit) = (receiver.past(), receiver.bit_before());
    let Some(spread) = receiver.spread() else { return };
    let mut places = events.iter().filter(|event| is_failed(event)).filter_map(place);
    let Some((start, end)) = places.next() else { return };
    let own = between(edges, start, places.fold(end, |end, (_, next)| end.max(next)), bit);
    let all = two_grids(own, bit, spread).map(|second| said(own, &second));
    for event in events.iter_mut().filter(|event| is_failed(event)) {
        let alone = || {
            let (start, end) = place(event)?;
            let own = between(edges, start, end, bit);
            Some(said(own, &two_clocks(own, bit)?))
        };
        let Some((at, cause)) = all.clone().or_else(alone) else { continue };
        if let Verdict::Refused(refusal) = &mut event.verdict {
            refusal.cause = Some(cause);
            refusal.time = refusal.time.or(Some(at));
        }
    }
}

fn place(event: &Event) -> Option<(Time, Time)> {
    match event.place {
        Place::Time { start, end } => Some((start, end)),
        Place::Line(_) => None,
    }
}

/// Returns the edges of a frame, including those with which its drivers release the line.
fn between(edges: &[Edge], start: Time, end: Time, bit: f64) -> &[Edge] {
    let first = edges.partition_point(|edge| edge.time < start - (0.5 * bit) as i64);
    let last = edges.partition_point(|edge| edge.time < end + (3.0 * bit) as i64);
    edges.get(first..last).unwrap_or_default()
}

/// Returns when the second driver is first seen, and the remark about it.
fn said(edges: &[Edge], second: &[bool]) -> (Time, String) {
    let count = second.iter().filter(|second| **second).count();
    let at = edges.iter().zip(second).find(|(_, second)| **second).map_or(Time::ZERO, |(edge, _)| edge.time);
    let (at_us, all) = (at.us(), edges.len());
    (at, format!("two drive at once: from {at_us:.3} us on, {count} of {all} edges are off the grid of the others"))
}

/// Returns where edges lie between the bits of a grid that begins at `begin`, from 0 to 1.
fn phases<'a>(edges: impl Iterator<Item = &'a Edge>, begin: Time, bit: f64) -> Vec<f64> {
    edges.map(|edge| ((edge.time - begin) as f64 / bit).rem_euclid(1.0)).collect()
}

/// Returns the bit lengths to try, the likelier ones first.
fn bits(nominal: f64) -> impl Iterator<Item = f64> {
    (0..=STEPS).flat_map(|k| [k, -k]).skip(1).map(move |k| nominal * (1.0 + f64::from(k) / STEP))
}

/// Returns the distance of two places on the circle of a bit.
fn distance(a: f64, b: f64) -> f64 {
    let apart = (a - b).rem_euclid(1.0);
    apart.min(1.0 - apart)
}

/// Returns for each edge whether it lies on the grid of a second driver, if there is one: most edges lie on one grid, and
/// all others on another.
/// `spread`: the mean square distance of edges from their grid on this line, in bits.
fn two_grids(edges: &[Edge], nominal: f64, spread: f64) -> Option<Vec<bool>> {
    let [least, most] = NEAR;
    let near = (DEVIATIONS * spread.sqrt()).max(least);
    let begin = edges.first()?.time;
    if near > most || edges.len() < 2 * FEWEST_OFF {
        return None;
    }
    let densest = bits(nominal).map(|bit| {
        let phases = phases(edges.iter(), begin, bit);
        let count = |center: f64| phases.iter().filter(|phase| distance(**phase, center) <= near).count();
        let center = phases.iter().copied().max_by_key(|center| count(*center)).unwrap_or_default();
        (count(center), center, phases)
    });
    // The first of the best.
    let (count, center, phases) = densest.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    let second: Vec<bool> = phases.iter().map(|phase| distance(*phase, center) > near).collect();
    let beside = phases.iter().filter(|phase| (near..2.0 * near).contains(&distance(**phase, center))).count();
    let turns = second.windows(2).filter(|pair| matches!(pair, [a, b] if a != b)).count();
    let others = edges.len() - count;
    if others < FEWEST_OFF || others * SHARE_OFF < edges.len() || turns < FEWEST_TURNS || beside * BESIDE > edges.len()
    {
        return None;
    }
    let all = [(false, false), (false, true), (true, false), (true, true)].iter().all(|(on, level)| {
        let of = |(edge, second): &(&Edge, &bool)| **second == *on && edge.level == *level;
        edges.iter().zip(&second).filter(of).count() >= FEWEST_EACH
    });
    // The shortest part of the circle that holds all others.
    let arc = bits(nominal).map(|bit| {
        let mut phases =
            self::phases(edges.iter().zip(&second).filter(|(_, second)| **second).map(|it| it.0), begin, bit);
        phases.sort_by(f64::total_cmp);
        let around = phases.iter().skip(1).copied().chain(phases.first().map(|first| first + 1.0));
        1.0 - phases.iter().zip(around).map(|(from, to)| to - from).fold(0.0, f64::max)
    });
    (all && arc.fold(1.0, f64::min) <= 2.0 * near).then_some(second)
}

/// Does the same for one frame, however much the clocks differ: many edges lie far from the grid that holds most of them.
fn two_clocks(edges: &[Edge], nominal: f64) -> Option<Vec<bool>> {
    let begin = edges.first()?.time;
    let off = |phase: &f64| *phase > OFF_GRID && *phase < 1.0 - OFF_GRID;
    let count = |phases: &Vec<f64>| phases.iter().filter(|phase| off(phase)).count();
    let phases = bits(nominal).map(|bit| phases(edges.iter(), begin, bit)).min_by_key(count)?;
    let second: Vec<bool> = phases.iter().map(off).collect();
    let turns = second.windows(2).filter(|pair| matches!(pair, [a, b] if a != b)).count();
    let enough = count(&phases) >= FEWEST_FAR && count(&phases) * SHARE_OFF >= edges.len();
    (enough && turns >= FEWEST_TURNS).then_some(second)
}
