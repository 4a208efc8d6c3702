//! Synchronising the H-frames with an external pulse.
//!
//! The rising edge of the pulse and the falling edge inside the EXTRA window should coincide in every ES-th frame. The master
//! achieves this with eighths of a bit in the window and, if those do not suffice, with stuffing blocks of six bits.
//!
//! ```text
//!                     b eighths
//!           |<------------------>|
//!  ... 1 1  | 1   1   1   1   1  1___ 0 | 1 1 0 ...
//!           |<------ E + 1 bits ------->|
//! ```
//!
//! * [`ExtraWindow`] is the step from one frame to the next (HDSL Protocol Design);
//! * [`Synchroniser`] combines both for any ES and corrects by the measured time between pulse and edge.

use crate::error::Error;
use crate::frame::{Extra, H_FRAME_BITS, STUFFING_BITS, Stuffing};
use crate::ranged::ranged;

/// Eighths of a bit in a stuffing block.
const BLOCK: i32 = 48;
/// Eighths of a bit in a frame without EXTRA and stuffing.
const FRAME: u32 = H_FRAME_BITS * 8;
const _: () = assert!(STUFFING_BITS == 6 && FRAME == 864);

/// The EXTRA window and the stuffing of the next frame, and how they follow from the present ones.
///
/// Let b be the position of the edge in eighths, t = b reduced to 1..=8, and W the constant TIME_EXTRA_WINDOW; the next edge is
/// then at W - (8 - t). If that is outside 24..=71 eighths, six bits are moved between the window and the stuffing.
///
/// 48 N + W never changes, and the time from edge to edge is 864 + 48 N + W eighths. For this, the limiter has to act before the
/// stuffing of the present frame is sent; see [`Synchroniser::next`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ExtraWindow {
    edge: Extra,
    stuffing: Stuffing,
    window: i16,
}

impl ExtraWindow {
    /// Creates the state. `window` is TIME_EXTRA_WINDOW in eighths; `edge` is the position of the edge in the window of the
    /// first frame.
    pub const fn new(edge: Extra, stuffing: Stuffing, window: i16) -> Self {
        Self { edge, stuffing, window }
    }

    /// The window of the frame.
    pub const fn extra(self) -> Extra {
        self.edge
    }

    /// NUM_STUFFING: number of blocks after the frame before this window.
    pub const fn stuffing(self) -> Stuffing {
        self.stuffing
    }

    /// TIME_EXTRA_WINDOW in eighths.
    pub const fn window(self) -> i16 {
        self.window
    }

    /// Returns edge and stuffing after a step of `adjust` eighths, before any check of the range.
    const fn raw_step(self, adjust: i16) -> (i32, i32, i32) {
        let t = (self.edge.get().saturating_sub(1) % 8) as i32;
        let window = self.window as i32;
        // t counts from 0 here, so 1 is added to it.
        let edge = window.saturating_sub(7).saturating_add(t).saturating_add(adjust as i32);
        let stuffing = self.stuffing.get() as i32;
        match edge.div_euclid(8) {
            ..3 => (edge.saturating_add(BLOCK), stuffing.saturating_sub(1), window.saturating_add(BLOCK)),
            3..=8 => (edge, stuffing, window),
            9.. => (edge.saturating_sub(BLOCK), stuffing.saturating_add(1), window.saturating_sub(BLOCK)),
        }
    }

    /// Advances to the next frame, whose edge comes `adjust` eighths later than it otherwise would.
    ///
    /// # Errors
    /// [`Error::ExtraOutOfRange`] if one stuffing block does not bring the window into its range, or if there is none to remove
    /// or no room for another. The state stays as it was.
    pub fn step(&mut self, adjust: i16) -> Result<(), Error> {
        let (edge, stuffing, window) = self.raw_step(adjust);
        let refuse = || Error::ExtraOutOfRange { extra: edge.unsigned_abs() / 8 };
        let extra = u8::try_from(edge).ok().and_then(Extra::new).ok_or_else(refuse)?;
        let stuffing = u8::try_from(stuffing).ok().and_then(Stuffing::new).ok_or_else(refuse)?;
        let window = i16::try_from(window).map_err(|_| refuse())?;
        *self = Self { edge: extra, stuffing, window };
        Ok(())
    }
}

ranged! {
    /// ES: number of H-frames per pulse, 1..=10.
    pub struct Es(1..=10);
}

impl Es {
    /// A frame for every pulse.
    pub const ONE: Self = Self::MIN;
}

/// What to send next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Next {
    /// Stuffing blocks after the present frame.
    pub stuffing: Stuffing,
    /// EXTRA window of the next frame.
    pub extra: Extra,
}

/// Keeps the sampling edge of every ES-th frame on the pulse.
///
/// The period of the pulse need not be a multiple of anything: whole eighths are spread evenly over the frames of a pulse,
/// and the correction takes care of fractions of an eighth. It learns by how much the real period differs from the given
/// one, so the edges stay in place even if some pulses are not seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Synchroniser {
    /// Eighths from pulse to pulse.
    period: u32,
    state: ExtraWindow,
    es: Es,
    /// Eighths to spread over the frames of a pulse; less than ES.
    remainder: u8,
    /// Number of the present frame in its pulse group, 0 for the one on the pulse.
    frame: u8,
    /// The eighths that are due, times ES; starts in the middle, so that the edges are at most half an eighth off.
    spread: u8,
    /// How much later each pulse comes than the nominal period, in 1/256 of an eighth, and how much of this is due when a pulse
    /// is not seen.
    learned: i16,
    due: i16,
    /// How much later the next edge has to come because the window of the present frame had no room for it.
    owed: i16,
    /// Number of pulses in a row that were close to their edges, and number in a row that were not seen.
    close: u8,
    unseen: u8,
}

impl Synchroniser {
    /// Largest correction in one frame, in eighths, as in the vendor's receiver.
    const MAX_CORRECTION: i16 = 6;
    /// How much earlier or later an edge may come than the one before it; later by one more, for the eighths to spread.
    const STEP: [i16; 2] = [-6, 7];

    /// The largest deviation that later frames make up for.
    const MAX_OWED: i16 = 64;

    /// How close to its edge a pulse has to come to be in step, in eighths: 93 ns. The vendor's receiver allows 100 ns.
    const CLOSE: i16 = 7;
    /// Number of pulses in a row that have to be this close.
    const PULSES: u8 = 4;
    /// Number of pulses that may be missing before it is unknown where the edges are.
    const UNSEEN: u8 = 8;
    /// Time from the beginning of a frame to the end of the shortest EXTRA window from which every edge of the next frame
    /// can be reached, including a correction in either direction; and the same for the longest window.
    const FRAMES: [u32; 2] = [FRAME + 32, FRAME + 26 * 48 + 69];

    /// Creates the synchroniser for a pulse every `period` eighths of a bit (13.333 ns each) with `es` frames per pulse: frames
    /// of 896 to 2181 eighths.
    ///
    /// # Errors
    /// [`Error::PeriodTooShort`], [`Error::ExtraOutOfRange`] for more than 26 stuffing blocks.
    #[expect(clippy::arithmetic_side_effects, reason = "an ES is not 0")]
    pub fn new(period: u32, es: Es) -> Result<Self, Error> {
        // An ES is not 0; that is said where it divides, so that no panic is reachable.
        let divisor = u32::from(es.get()).max(1);
        let (frame, remainder) = (period / divisor, period % divisor);
        let [shortest, longest] = Self::FRAMES;
        if frame < shortest {
            return Err(Error::PeriodTooShort { missing: shortest.abs_diff(frame).div_ceil(8) });
        }
        // Windows of 25..=72 eighths: 4..=9 bits; the longest frames have all the stuffing there is.
        let left = frame.saturating_sub(FRAME + 25);
        let refuse = Error::ExtraOutOfRange { extra: left / 8 };
        if frame.saturating_add(u32::from(remainder != 0)) > longest {
            return Err(refuse);
        }
        let window = 25_u8.saturating_add((left % 48).to_le_bytes()[0]);
        let stuffing = u8::try_from(left / 48).ok().and_then(Stuffing::new).ok_or(refuse)?;
        let edge = Extra::new(window).ok_or(refuse)?;
        let state = ExtraWindow::new(edge, stuffing, i16::from(window));
        let spread = es.get() / 2;
        let remainder = remainder.to_le_bytes()[0];
        Ok(Self { period, state, es, remainder, frame: 0, spread, learned: 0, due: 128, owed: 0, close: 0, unseen: 0 })
    }

    /// Returns whether the frames are in step with the pulse: the last four pulses came within 93 ns of their edges, and since
    /// then at most eight were not seen.
    pub const fn is_in_step(&self) -> bool {
        self.close >= Self::PULSES && self.unseen <= Self::UNSEEN
    }

    /// Eighths of a bit from pulse to pulse.
    pub const fn period(&self) -> u32 {
        self.period
    }

    /// Eighths from the start of the first frame to its sampling edge; start this long before a pulse.
    ///
    /// ```
    /// use hdsl::sync::{Es, Synchroniser};
    /// // A control cycle of 40 us, a frame in each: the edge comes 8 bits and 5 of EXTRA's into the first frame.
    /// let synchroniser = Synchroniser::new(3_000, Es::new(3).unwrap())?;
    /// assert_eq!((synchroniser.lead() - 64) / 8, 5);
    /// # Ok::<(), hdsl::Error>(())
    /// ```
    pub fn lead(&self) -> u32 {
        // SYNC, the two ones of SAMPLE, then the window.
        u32::from(self.state.edge.get()).saturating_add(64)
    }

    /// The window of the present frame.
    pub const fn extra(&self) -> Extra {
        self.state.edge
    }

    /// Returns whether the edge of the present frame belongs to a pulse.
    pub const fn is_on_pulse(&self) -> bool {
        self.frame == 0
    }

    /// Returns the stuffing after the present frame and the window of the next one. Call this before the stuffing is sent, so
    /// that moving bits between the two does not move the edge.
    ///
    /// `late` is time(pulse) - time(edge) in eighths, rounded, if the present frame is on a pulse and the pulse was
    /// seen: a later pulse makes the next edge later, by six eighths at most. Without a pulse, the frames continue with the
    /// given period and what was learned about it.
    pub fn next(&mut self, late: Option<i16>) -> Next {
        self.spread = self.spread.saturating_add(self.remainder);
        let mut adjust = 0;
        if self.spread >= self.es.get() {
            self.spread = self.spread.saturating_sub(self.es.get());
            adjust = 1;
        }
        if self.frame == 0 {
            adjust = self.correction(late).saturating_add(adjust);
        }
        let wanted = adjust.saturating_add(self.owed);
        let [least, most] = Self::STEP;
        if (least..=most).contains(&wanted) && self.state.step(wanted).is_ok() {
            self.owed = 0;
        } else {
            self.step_as_far_as_possible(wanted);
        }
        self.frame = if self.frame.saturating_add(1) >= self.es.get() { 0 } else { self.frame.saturating_add(1) };
        Next { stuffing: self.state.stuffing, extra: self.state.edge }
    }

    /// At the shortest and longest frames there is no block to give or take: the window stays within its range, and the rest
    /// comes with the next frames.
    #[cold]
    fn step_as_far_as_possible(&mut self, wanted: i16) {
        let [least, most] = Self::STEP;
        let mut adjust = wanted.clamp(least, most);
        while self.state.step(adjust).is_err() && adjust != 0 {
            adjust = adjust.saturating_sub(adjust.signum());
        }
        self.owed = wanted.saturating_sub(adjust).clamp(Self::MAX_OWED.saturating_neg(), Self::MAX_OWED);
    }

    /// Returns how many eighths later the next edge on a pulse has to come: as measured, or as learned if nothing was measured.
    fn correction(&mut self, late: Option<i16>) -> i16 {
        let limit = Self::MAX_CORRECTION;
        if let Some(late) = late {
            let correction = late.clamp(limit.saturating_neg(), limit);
            self.unseen = 0;
            self.close =
                if late.unsigned_abs() > Self::CLOSE.unsigned_abs() { 0 } else { self.close.saturating_add(1) };
            // The mean at first, of the last 64 later on.
            let shift = self.close.checked_ilog2().unwrap_or(0).min(6);
            if shift > 0 {
                let half = 1_i16.wrapping_shl(shift.wrapping_sub(1));
                let change = correction.saturating_mul(256).saturating_sub(self.learned).saturating_add(half);
                self.learned = self.learned.saturating_add(change.wrapping_shr(shift));
            }
            (self.due, self.owed) = (128, 0);
            return correction;
        }
        self.unseen = self.unseen.saturating_add(1);
        self.due = self.due.saturating_add(self.learned);
        let correction = self.due >> 8;
        self.due &= 0xff;
        correction
    }
}

#[cfg(test)]
mod tests;
