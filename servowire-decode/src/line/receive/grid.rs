//! How edges lie on grids of bits: the bit length of a speaker.

use super::super::spikes::Edge;
use super::even::{self, Even};
use super::reading::{Fit, nearest};

/// How far a speaker's bit may be from the nominal one: one part in this many.
const OFF: f64 = 0.065;
/// Steps of the search for a bit length, to each side.
const STEPS: i32 = 26;
/// Mean square distance from the grid, in bits, up to which a known bit length is kept.
const GOOD_FIT: f64 = 0.02;
/// Mean square distance up to which the most recent bit length is used without examining the others.
const PERFECT_FIT: f64 = 2e-4;
/// Penalty per edge for a bit length far from the nominal one, as a fraction of the squared deviation in nominal bits:
/// clocks are off by 2 %, and edges of a coarse or shaky recording by 0.07 of a bit. This matters because three edges fit
/// many grids.
const UNLIKELY: f64 = (0.07 * 0.07) / (0.02 * 0.02);
/// Number of speakers whose bit lengths are remembered.
const SPEAKERS: usize = 4;

/// Adds up the edges of a field, whose first edge lies at 0.
#[derive(Debug, Clone, Copy)]
struct Sums {
    count: f64,
    off: f64,
    squares: f64,
    places: f64,
    spread: f64,
    both: f64,
}

impl Sums {
    const FIRST: Self = Self { count: 1.0, off: 0.0, squares: 0.0, places: 0.0, spread: 0.0, both: 0.0 };

    #[inline]
    fn add(&mut self, place: f64) {
        let whole = f64::from(nearest(place));
        let distance = place - whole;
        self.off += distance;
        self.squares += distance * distance;
        self.places += whole;
        self.spread += whole * whole;
        self.both += whole * distance;
        self.count += 1.0;
    }
}

/// Measures how the edges lie on the grids of their fields of `field_bits`, with bits of `bit` picoseconds; each field has
/// its own offset.
fn measure(edges: &[Edge], field_bits: u32, bit: f64) -> Fit {
    let mut fit = Fit { misfit: 0.0, above: 0.0, below: 0.0 };
    let Some((first, rest)) = edges.split_first() else { return fit };
    let last = f64::from(field_bits) - 0.6;
    let beyond = last + 0.2;
    let per = 1.0 / bit;
    let mut start = first.time;
    let (mut all, mut edges_in_all) = (0.0, 0.0);
    let mut sums = Sums::FIRST;
    let mut begins = false;
    let mut close = |sums: Sums| {
        let per = 1.0 / sums.count;
        all += sums.squares - sums.off * sums.off * per;
        fit.below += sums.spread - sums.places * sums.places * per;
        fit.above += sums.both - sums.places * sums.off * per;
    };
    for edge in rest {
        let place = edge.time.after(start) as f64 * per;
        if place > last && !edge.level {
            start = edge.time;
            begins = true;
        } else if place < beyond {
            if begins {
                close(sums);
                sums = Sums::FIRST;
                begins = false;
            }
            sums.add(place);
            edges_in_all += 1.0;
        }
    }
    close(sums);
    fit.misfit = if edges_in_all > 0.0 { all / edges_in_all } else { 0.0 };
    fit
}

/// The bit length that fits the edges of a speaker.
pub(super) struct Found {
    /// In picoseconds.
    pub(super) bit: f64,
    /// Whether it was measured, rather than only the best of those tried.
    pub(super) is_sure: bool,
    /// The bit length by these edges alone, in picoseconds, if they determine it.
    pub(super) alone: Option<f64>,
    /// Mean square distance of the edges from the grid, in bits.
    pub(super) misfit: f64,
    /// The bit length by which the fields have already been read, if they have.
    pub(super) read_by: Option<f64>,
}

/// Fields read while bit lengths are tried: by the best one so far, and by the next one.
#[derive(Debug, Clone, Default)]
pub(super) struct Tried {
    pub(super) best: Vec<Even>,
    next: Vec<Even>,
}

/// Returns the bit length that fits the edges: a known one if it does, otherwise the best around `nominal`. In `heard`, the
/// last speaker's comes first.
pub(super) fn fit(edges: &[Edge], field_bits: u32, nominal: f64, heard: &mut Vec<f64>, tried: &mut Tried) -> Found {
    let mut best: Option<(Fit, usize)> = None;
    let mut read_by = None;
    for (at, bit) in heard.iter().enumerate() {
        let even = even::read(edges, field_bits, *bit, &mut tried.next);
        let fit = even.unwrap_or_else(|| measure(edges, field_bits, *bit));
        if fit.misfit < GOOD_FIT && best.is_none_or(|(least, _)| fit.misfit < least.misfit) {
            best = Some((fit, at));
            read_by = even.map(|_| *bit);
            std::mem::swap(&mut tried.best, &mut tried.next);
            if at == 0 && fit.misfit < PERFECT_FIT {
                break;
            }
        }
    }
    if let Some((fit, at)) = best {
        // The most recent one comes first.
        if let Some(before) = heard.get_mut(..=at).filter(|before| before.len() > 1) {
            before.rotate_right(1);
        }
        let Some(bit) = heard.first_mut() else {
            return Found { bit: nominal, is_sure: false, alone: None, misfit: fit.misfit, read_by: None };
        };
        let alone = fit.alone(*bit);
        *bit += 0.2 * (fit.slope(*bit) - *bit);
        return Found { bit: *bit, is_sure: true, alone, misfit: fit.misfit, read_by };
    }
    let found = search(edges, field_bits, nominal);
    if found.is_sure {
        heard.insert(0, found.bit);
        heard.truncate(SPEAKERS);
    }
    found
}

/// Returns the best of all bit lengths around `nominal`.
fn search(edges: &[Edge], field_bits: u32, nominal: f64) -> Found {
    let step = OFF / f64::from(STEPS);
    let against = UNLIKELY / edges.len().max(1) as f64;
    let mut found = (measure(edges, field_bits, nominal), nominal, 0.0);
    for k in 1..=STEPS {
        for side in [-1.0, 1.0] {
            let off = f64::from(k) * step;
            let bit = nominal * (1.0 + side * off);
            let fit = measure(edges, field_bits, bit);
            let unlikely = against * off * off;
            if fit.misfit + unlikely < found.0.misfit + found.2 {
                found = (fit, bit, unlikely);
            }
        }
    }
    let is_sure = found.0.misfit < GOOD_FIT && edges.len() > 3;
    let (fit, bit, _) = found;
    Found { bit: fit.slope(bit), is_sure, alone: fit.alone(bit), misfit: fit.misfit, read_by: None }
}
