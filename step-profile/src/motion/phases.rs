//! A curve in the integers that steps are made of.

use super::curve::{Bend, Curve, Piece};
use super::real::{Real, THIRD};

/// Fraction bits of a position.
pub(super) const P: i32 = 32;
/// Fraction bits of a speed, in steps a moment.
pub(super) const V: i32 = 57;
/// Fraction bits of an acceleration, in steps a moment².
pub(super) const A: i32 = 89;
/// Fraction bits of a sixth of a jerk, in steps a moment³.
pub(super) const J: i32 = 121;

/// A polynomial of the position, around a whole moment.
///
/// A piece of a curve begins anywhere between two moments; its polynomial is the same around the moment before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Phase {
    /// Moment that the numbers are of: the last half tick before the phase.
    pub(super) begin: u64,
    /// Moment at which the phase begins.
    pub(super) since: u64,
    /// Position.
    pub(super) p: i64,
    /// Speed, and the word below.
    pub(super) v: i64,
    pub(super) v_low: u32,
    pub(super) kind: Kind,
    /// Steps made when the phase is over, counted from the origin of the positions.
    pub(super) until: u32,
}

/// What a phase does with its speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Kind {
    /// It changes.
    Slope {
        /// Acceleration, and the word below.
        a: i64,
        a_low: u32,
        /// A sixth of the jerk.
        j6: i64,
    },
    /// It is kept.
    Cruise {
        /// Moments from step to step.
        interval: u64,
        /// The same below a moment, in 2^-64.
        part: u64,
    },
}

/// A state between two phases or within one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct State {
    pub(super) p: i64,
    pub(super) v: i64,
    pub(super) a: i64,
    pub(super) j6: i64,
}

impl Phase {
    const NONE: Self =
        Self { begin: 0, since: 0, p: 0, v: 0, v_low: 0, kind: Kind::Slope { a: 0, a_low: 0, j6: 0 }, until: 0 };

    /// The state `t` moments after the begin.
    fn after(&self, t: u64) -> State {
        let wide = |x: i64| i128::from(x);
        let (a, a_low, j6) = match self.kind {
            Kind::Slope { a, a_low, j6 } => (a, a_low, j6),
            Kind::Cruise { interval, part } => {
                let period = u128::from(interval) << 32 | u128::from(part >> 32);
                let dp = (u128::from(t) << 64).checked_div(period).and_then(|dp| i64::try_from(dp).ok());
                let p = self.p.saturating_add(dp.unwrap_or(i64::MAX));
                return State { p, v: self.v, a: 0, j6: 0 };
            }
        };
        let t = i128::from(t);
        // 16 bits more than the numbers have.
        let da = wide(j6).wrapping_mul(t) >> 16;
        let mean = wide(a) << 16 | i128::from(a_low >> 16);
        let bow = mean.wrapping_add(da << 1).wrapping_mul(t) >> 32;
        let dv = mean.wrapping_add(da.wrapping_mul(3)).wrapping_mul(t) >> 48;
        let low = i128::from(self.v_low).wrapping_mul(t) >> 32;
        let dp = wide(self.v).wrapping_mul(t).wrapping_add(low).wrapping_add(bow.wrapping_mul(t) >> 17) >> (V - P);
        State {
            p: narrow(wide(self.p).wrapping_add(dp)),
            v: narrow(wide(self.v).wrapping_add(dv)),
            a: narrow(wide(a).wrapping_add(da.wrapping_mul(6) >> 16)),
            j6,
        }
    }
}

/// The nearest that 64 bits hold.
fn narrow(x: i128) -> i64 {
    i64::try_from(x).unwrap_or(if x < 0 { i64::MIN } else { i64::MAX })
}

/// The phases of a move.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Phases {
    list: [Phase; Curve::MAX],
    len: u8,
    /// Moments at which it begins and is over.
    begin: u64,
    end: u64,
    /// Position at the end.
    last: i64,
    endless: bool,
}

/// How a curve becomes phases.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Moment at which it begins.
    pub(super) begin: u64,
    /// Position at which it begins.
    pub(super) from: i64,
    /// Position at which it ends, if that is known; else where the curve leads.
    pub(super) to: Option<i64>,
    /// Phases begin at multiples of this many moments.
    pub(super) grid: u32,
    /// What the curve begins later than `begin`, less than half a tick.
    pub(super) offset: Real,
    /// Steps of an axis in a unit of the curve.
    pub(super) scale: Real,
    /// The last piece has no end.
    pub(super) endless: bool,
}

impl Phases {
    /// At rest.
    pub(super) const fn rest(moment: u64, at: i64) -> Self {
        Self { list: [Phase::NONE; Curve::MAX], len: 0, begin: moment, end: moment, last: at, endless: false }
    }

    pub(super) fn new(curve: &Curve, frame: &Frame) -> Self {
        let (over, behind) = curve.skipped;
        let mut new = Self::rest(frame.begin, frame.from);
        new.endless = frame.endless;
        let origin = frame.from.saturating_sub(signed((behind * frame.scale).to_fixed(P)));
        let position = |p: Real| origin.saturating_add(signed((p * frame.scale).to_fixed(P)));
        let pieces = curve.pieces();
        let mut ends = pieces.iter().skip(1).map(|next| (next.time, next.p)).chain([(curve.time, curve.p)]);
        for piece in pieces {
            let Some((end, end_p)) = ends.next() else { break };
            if end <= over {
                continue;
            }
            let piece = if piece.time < over { piece.after(over - piece.time) } else { *piece };
            new.push(phase(&piece, frame.offset + (piece.time - over), &position, frame, steps(position(end_p))));
        }
        new.end = frame.begin.saturating_add((frame.offset + (curve.time - over)).to_fixed(0));
        new.last = frame.to.unwrap_or_else(|| position(curve.p));
        new.close();
        new
    }

    fn push(&mut self, phase: Phase) {
        if let Some(place) = self.list.get_mut(usize::from(self.len)) {
            *place = phase;
            self.len = self.len.saturating_add(1);
        }
    }

    /// The last phase ends where the move does.
    fn close(&mut self) {
        let until = if self.endless { u32::MAX } else { steps(self.last) };
        let last = usize::from(self.len).checked_sub(1).and_then(|at| self.list.get_mut(at));
        if let Some(last) = last {
            last.until = until;
        }
        for phase in &mut self.list {
            phase.until = phase.until.min(until);
        }
    }

    pub(super) fn get(&self, at: u8) -> Option<&Phase> {
        self.all().get(usize::from(at))
    }

    pub(super) fn all(&self) -> &[Phase] {
        self.list.get(..usize::from(self.len)).unwrap_or(&[])
    }

    /// Begin of the phase after `at`, or the end of the last one.
    pub(super) fn end_of(&self, at: u8) -> u64 {
        self.get(at.saturating_add(1)).map_or(self.end, |next| next.since)
    }

    pub(super) const fn begin(&self) -> u64 {
        self.begin
    }

    pub(super) const fn end(&self) -> u64 {
        self.end
    }

    pub(super) const fn last(&self) -> i64 {
        self.last
    }

    pub(super) const fn is_endless(&self) -> bool {
        self.endless
    }

    /// The state at a moment; at rest after the end.
    pub(super) fn at(&self, moment: u64) -> State {
        let phase = self.all().iter().rev().find(|phase| phase.since <= moment);
        match phase.or(self.all().first()) {
            Some(phase) if self.endless || moment < self.end => phase.after(moment.saturating_sub(phase.begin)),
            _ => State { p: self.last, v: 0, a: 0, j6: 0 },
        }
    }
}

/// A piece that begins at `time`, around the moment before.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the low word")]
fn phase(piece: &Piece, time: Real, position: &impl Fn(Real) -> i64, frame: &Frame, until: u32) -> Phase {
    let begin = time.to_fixed(0) & !u64::from(frame.grid.saturating_sub(1));
    let rest = time - Real::new(begin);
    let (v, p) = piece.before(rest);
    let (v, a, j) = (v * frame.scale, piece.a * frame.scale, piece.j * frame.scale);
    let growing = piece.bend != Bend::Fading;
    let before = signed((p * frame.scale).to_fixed(P));
    let kind = if a.is_zero() && j.is_zero() {
        let period = Real::new(1) / v;
        Kind::Cruise { interval: period.to_fixed(0), part: period.fraction().to_fixed(64) }
    } else {
        // A moment's part before it grows, it has the other sign.
        let a = exact(a, piece.up).wrapping_sub(exact(j * rest, piece.up == growing));
        let j6 = signed((j.half() * THIRD).to_fixed(J));
        let j6 = if piece.up == growing { j6 } else { j6.wrapping_neg() };
        Kind::Slope { a: narrow(a >> 32), a_low: a as u32, j6 }
    };
    let speed = v;
    Phase {
        begin: frame.begin.saturating_add(begin),
        since: frame.begin.saturating_add(time.to_fixed(0)),
        p: position(piece.p).saturating_sub(before),
        v: signed(speed.to_fixed(V)),
        v_low: below(speed, V),
        kind,
        until,
    }
}

/// The word below the last of `bits`.
fn below(x: Real, bits: i32) -> u32 {
    u32::try_from((x - Real::fixed(x.to_fixed(bits), bits)).to_fixed(bits.saturating_add(32))).unwrap_or(0)
}

/// An acceleration with the word below.
fn exact(a: Real, positive: bool) -> i128 {
    let size = i128::from(a.to_fixed(A)) << 32 | i128::from(below(a, A));
    if positive { size } else { size.wrapping_neg() }
}

fn signed(x: u64) -> i64 {
    i64::try_from(x).unwrap_or(i64::MAX)
}

/// Steps made at a position: step k falls where the position is k - 1/2.
pub(super) fn steps(p: i64) -> u32 {
    u32::try_from(p.saturating_add(1 << 31) >> P).unwrap_or(if p < 0 { 0 } else { u32::MAX })
}
