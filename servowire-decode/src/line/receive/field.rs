//! Reads fields on the grid of their speaker.

use super::super::spikes::Edge;
use super::reading::{Read, nearest};
use crate::time::Time;

/// The bit timing of a speaker.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speaker {
    /// Bits of a field, including start bit and delimiter.
    field_bits: u32,
    /// Picoseconds per bit, and bits per picosecond.
    bit: f64,
    per: f64,
    /// Picoseconds of a field, and from its first edge to the point after which a falling edge belongs to the next field.
    pub(super) field: i64,
    last: i64,
    /// The place in a field, in bits, after which an edge does not belong to its grid.
    inside: f64,
}

impl Speaker {
    /// Creates the timing of fields of `field_bits` bits of `bit` picoseconds.
    pub(super) fn new(field_bits: u32, bit: f64) -> Self {
        let whole = f64::from(field_bits);
        Self {
            field_bits,
            bit,
            per: 1.0 / bit,
            field: (whole * bit) as i64,
            last: ((whole - 0.6) * bit) as i64,
            inside: whole - 0.4,
        }
    }
}

/// Maximum distance, in bits, of an edge that counts as near its place, and of the start of a field from a bit of the line:
/// their sum is less than half a bit, at which the edge would belong to another bit of the line.
const NEAR: f64 = 0.2;
const ALIGNED: f64 = 0.25;

/// Reads the first field on its grid, and returns the edges of the next one. Its start bit begins with the first edge.
#[inline]
pub(super) fn read(edges: &[Edge], speaker: Speaker) -> Option<(Read, &[Edge])> {
    let Speaker { field_bits, bit, per, last, inside, .. } = speaker;
    let (first, rest) = edges.split_first()?;
    // The first edge is as uncertain as the others: the grid lies where all fit best.
    let (mut sum, mut count) = (0.0, 1.0);
    let mut own = 0;
    for edge in rest {
        let time = edge.time.after(first.time);
        if time > last && !edge.level {
            break;
        }
        own += 1;
        let at = time as f64 * per;
        if at < inside {
            sum += at - f64::from(nearest(at));
            count += 1.0;
        }
    }
    let (own, next) = rest.split_at(own.min(rest.len()));
    let shift: f64 = sum / count;
    let (mut bits, mut level, mut from) = (0_u32, false, 0_u32);
    let (mut spikes, mut off) = (first.spikes, shift.abs());
    for edge in own {
        let place = edge.time.after(first.time) as f64 * per - shift;
        let at = nearest(place).min(field_bits);
        off = off.max((place - f64::from(at)).abs());
        if level && at > from {
            bits |= (1 << at) - (1 << from);
        }
        (level, from) = (edge.level, at.max(from));
        spikes = spikes.saturating_add(edge.spikes);
    }
    if level {
        bits |= (1 << field_bits) - (1 << from);
    }
    Some((Read { bits, start: first.time + (shift * bit) as i64, spikes, is_even: level && off < NEAR }, next))
}

/// The bits of a line while one speaker sends, assembled from its fields.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    start: Option<Time>,
    bits: u128,
    /// Whether they are the same as the edges give.
    is_even: bool,
}

impl Line {
    pub(super) const IDLE: Self = Self { start: None, bits: u128::MAX, is_even: true };

    /// Adds the next field.
    #[inline]
    pub(super) fn add(&mut self, read: &Read, speaker: Speaker) {
        let start = *self.start.get_or_insert(read.start);
        let place = read.start.after(start) as f64 * speaker.per;
        let at = nearest(place);
        self.is_even &= read.is_even && read.bits & 1 == 0 && (place - f64::from(at)).abs() < ALIGNED;
        let zeros = u128::from(!read.bits & ((1 << speaker.field_bits) - 1));
        self.bits &= !zeros.checked_shl(at).unwrap_or(0);
    }

    /// Returns the bits of the line from the start of a field, the first in bit 0.
    pub(super) fn bits(self, edges: &[Edge], start: Time, speaker: Speaker) -> u128 {
        if self.is_even && self.start == Some(start) { self.bits } else { line_bits(edges, start, speaker.per) }
    }
}

/// Returns the bits of a line from `start`, with `per` bits per picosecond.
#[cold]
fn line_bits(edges: &[Edge], start: Time, per: f64) -> u128 {
    let place = |edge: &Edge| nearest(edge.time.after(start) as f64 * per);
    let from_on = |at: u32| u128::MAX.checked_shl(at).unwrap_or(0);
    let falls = edges.iter().enumerate().filter(|(_, edge)| !edge.level);
    falls.fold(u128::MAX, |bits, (at, fall)| {
        let until = edges.get(at + 1).map_or(u128::BITS, place);
        bits & (!from_on(place(fall)) | from_on(until))
    })
}
