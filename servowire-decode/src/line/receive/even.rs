//! Reads fields whose edges are all near the grid of their speaker: bits and fit in one pass, in integers.

use super::super::spikes::Edge;
use super::super::start_stop::LineField;
use super::reading::{Fit, Read};
use crate::time::Time;

/// Fraction bits of places, in bits of the line, and of the distances whose squares are added up.
const PART: u32 = 48;
const COARSE: u32 = 20;
const ONE: i64 = 1 << PART;
/// How far from its place, in fractions of a bit, an edge may be to count as near. Even on the grid of the slightly
/// different bit length after this speech, the edge then belongs to the same bit.
const NEAR: i64 = ONE * 15 / 100;
/// An edge nearer than this counts as exactly in its place.
const EXACT: i64 = 1 << (EXACT_BIT - 1);
/// In a place to which this distance was added, the bits of a fraction are 0 from this one onwards.
const EXACT_BIT: u32 = PART - 11;
/// Bits without a field after which another speaker may follow.
pub(super) const OTHER_SPEAKER: u32 = 3;
/// Fields longer than this, in bits, are not read here, nor are bits of which a picosecond is a smaller fraction: these
/// would be counted too coarsely.
const LONGEST: u32 = 30;
const FEWEST: i64 = 1 << 20;
/// No bits of a line are kept beyond this many.
const LONGEST_LINE: f64 = 200.0;

/// A field on the grid by which it was read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Even {
    first: Time,
    bits: u32,
    /// The sum of the places of its edges, and of their distances from them, in bits.
    places: f64,
    off: f64,
    share: f64,
}

impl Even {
    /// Returns the same on the grid of bits of `bit` picoseconds; the one used for reading is `ratio` times that.
    #[inline]
    pub(super) fn read(self, bit: f64, ratio: f64) -> Read {
        let shift = ((self.places + self.off) * ratio - self.places) * self.share;
        Read { bits: self.bits, start: self.first + (shift * bit) as i64, spikes: 0, is_even: true }
    }
}

/// The sums over the edges of a field.
#[derive(Debug, Clone, Copy)]
struct Field {
    first: Time,
    /// Each edge inverts all bits from its place onwards.
    bits: u32,
    edges: u32,
    off: i64,
    squares: i64,
    places: i64,
    spread: i64,
    both: i64,
}

impl Field {
    const fn beginning_at(first: Time) -> Self {
        Self { first, bits: 0, edges: 1, off: 0, squares: 0, places: 0, spread: 0, both: 0 }
    }
}

/// How the edges of a speaker are interpreted.
#[derive(Debug, Clone, Copy)]
struct Grid {
    /// Fractions of a bit per picosecond.
    per: i64,
    /// Picoseconds of a field that is longer than any.
    longest: i64,
    /// The place from which a falling edge belongs to the next field, and the place from which it belongs to another speaker.
    last: i64,
    other: i64,
}

impl Grid {
    fn new(field_bits: u32, bit: f64) -> Option<Self> {
        let per = (ONE as f64 / bit) as i64;
        let longest = (f64::from(LONGEST) * bit) as i64;
        let last = i64::from(field_bits) * ONE - ONE * 6 / 10;
        let other = i64::from(field_bits + OTHER_SPEAKER) * ONE;
        (field_bits + OTHER_SPEAKER < LONGEST && per >= FEWEST).then_some(Self { per, longest, last, other })
    }

    /// Returns where an edge lies in a field that began at `first`, in fractions of a bit.
    #[inline]
    fn place(self, edge: &Edge, first: Time) -> i64 {
        let time = edge.time.after(first);
        // Beyond the longest one no edge is in the field, and the product would be too large.
        time.min(self.longest).wrapping_mul(self.per)
    }
}

/// Reads the fields of a speaker, of `field_bits` bits of `bit` picoseconds, and measures how they lie; `None` if an edge
/// is far from its place, or if there is a spike or low level where there should be none.
pub(super) fn read(edges: &[Edge], field_bits: u32, bit: f64, fields: &mut Vec<Even>) -> Option<Fit> {
    let grid = Grid::new(field_bits, bit)?;
    fields.clear();
    let (first, rest) = edges.split_first()?;
    let mut fit = Fit { misfit: 0.0, above: 0.0, below: 0.0 };
    let mut field = Field::beginning_at(first.time);
    let mut spikes = first.spikes;
    for edge in rest {
        let place = grid.place(edge, field.first);
        spikes |= edge.spikes;
        if place > grid.last && !edge.level {
            close(field, field_bits, &mut fit, fields)?;
            field = Field::beginning_at(edge.time);
            continue;
        }
        let whole = (place + ONE / 2) >> PART;
        let off = place - (whole << PART);
        if off.abs() > NEAR || whole >= i64::from(field_bits) {
            return None;
        }
        field.bits ^= u32::MAX << (whole & 31);
        field.edges += 1;
        field.off += off;
        let off = off >> (PART - COARSE);
        field.squares += off * off;
        field.places += whole;
        field.spread += whole * whole;
        field.both += whole * off;
    }
    close(field, field_bits, &mut fit, fields)?;
    let measured = edges.len() - fields.len();
    fit.misfit = if measured > 0 { fit.misfit / measured as f64 } else { 0.0 };
    (spikes == 0).then_some(fit)
}

/// Reads the fields of the next speaker if all edges are exactly in their places, so that nothing has to be measured, and
/// appends them; returns the number of edges. The first field holds the bits of the line.
pub(super) fn exact(edges: &[Edge], field_bits: u32, bit: f64, fields: &mut Vec<LineField>) -> Option<usize> {
    let begun = fields.len();
    let read = exact_fields(edges, Grid::new(field_bits, bit)?, field_bits, bit, fields);
    match (read, fields.get_mut(begun)) {
        (Some((_, line)), Some(first)) => first.bits = line,
        _ => fields.truncate(begun),
    }
    read.map(|(count, _)| count)
}

/// Does the same, and returns the bits of the line too.
#[inline]
fn exact_fields(
    edges: &[Edge],
    grid: Grid,
    field_bits: u32,
    bit: f64,
    fields: &mut Vec<LineField>,
) -> Option<(usize, u128)> {
    let is_exact = |place: i64| place >> EXACT_BIT & ((1 << (PART - EXACT_BIT)) - 1) == 0;
    // From here onwards an edge belongs to the next field, from here onwards to another speaker, in picoseconds.
    let [last, other] = [grid.last, grid.other].map(|place| (place - EXACT) / grid.per);
    let (length, longest) = ((f64::from(field_bits) * bit) as i64, (LONGEST_LINE * bit) as i64);
    let (content, all) = ((1 << (field_bits - 2)) - 1, (1 << field_bits) - 1);
    let start = edges.first()?;
    let (mut first, mut spikes, mut line) = (start.time, start.spikes, u128::MAX);
    let mut at = 1;
    loop {
        let (mut bits, mut next) = (0_u32, None);
        for edge in edges.get(at..)? {
            let time = edge.time.after(first);
            if time > last {
                next = Some(edge);
                break;
            }
            let place = time * grid.per + EXACT;
            if !is_exact(place) {
                return None;
            }
            bits ^= u32::MAX << (place >> PART & 31);
            spikes |= edge.spikes;
            at += 1;
        }
        let place = first.after(start.time).min(longest) * grid.per + EXACT;
        line &= !u128::from(!bits & all).checked_shl((place >> PART) as u32).unwrap_or(0);
        // A field begins low and ends high, and the line keeps its grid from field to field.
        if bits & 1 != 0 || bits >> (field_bits - 1) & 1 == 0 || !is_exact(place) {
            return None;
        }
        fields.push(LineField {
            content: (bits >> 1 & content) as u16,
            delimiter: true,
            start: first,
            end: first + length,
            spikes: 0,
            bits: 0,
        });
        let Some(edge) = next else { break };
        if edge.level {
            return None;
        }
        if edge.time.after(first) > other {
            break;
        }
        at += 1;
        first = edge.time;
        spikes |= edge.spikes;
    }
    (spikes == 0).then_some((at, line))
}

/// Ends a field that has no more edges. It ends high.
#[inline]
fn close(field: Field, field_bits: u32, fit: &mut Fit, fields: &mut Vec<Even>) -> Option<()> {
    let Field { first, bits, edges, off, squares, places, spread, both } = field;
    let all = (1 << field_bits) - 1;
    let share = 1.0 / f64::from(edges);
    if bits >> (field_bits - 1) & 1 == 0 {
        return None;
    }
    let part = 1.0 / (1_u64 << COARSE) as f64;
    let (places, off) = (places as f64, off as f64 / ONE as f64);
    fit.misfit += squares as f64 * part * part - off * off * share;
    fit.below += spread as f64 - places * places * share;
    fit.above += both as f64 * part - places * off * share;
    fields.push(Even { first, bits: bits & all, places, off, share });
    Some(())
}
