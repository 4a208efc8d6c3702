//! Pending requests.

use crate::master::echo::TURN;
use crate::master::handshake::Handshake;
use crate::master::progress::Progress;
use crate::master::sub_handshake::SubHandshake;
use crate::noncyclic_response::NonCyclicResponse;
use crate::sub::SubResponse;

/// Number of blocks for which the echo has been the normal code. A whole turn of the counter lies between two requests, so an
/// old block cannot be mistaken for the answer to the next request: echoes distinguish requests of one kind by their index, not
/// by their data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Quiet(u8);

impl Quiet {
    /// Restarts the count at the end of a request or a motion.
    pub(super) const BROKEN: Self = Self(0);

    /// Whether the echo has been the normal code for a whole turn.
    #[inline]
    pub(super) const fn is_kept(self) -> bool {
        self.0 >= TURN
    }

    /// Takes a block that is on time, with the normal code or another one.
    #[inline]
    pub(super) const fn hear(&mut self, is_normal: bool) {
        self.0 = if is_normal { self.0.saturating_add(1) } else { 0 };
    }
}

/// A request in one half of the block: it is pending, or its outcome has not been taken yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Slot<H, T> {
    Empty,
    Asking(H),
    Ended(Progress<T>),
}

impl<H: Copy, T: Copy> Slot<H, T> {
    pub(super) const fn asking(&self) -> Option<&H> {
        match self {
            Self::Asking(handshake) => Some(handshake),
            Self::Empty | Self::Ended(_) => None,
        }
    }

    /// Returns the outcome, once.
    pub(super) const fn take(&mut self) -> Option<Progress<T>> {
        let Self::Ended(progress) = *self else { return None };
        *self = Self::Empty;
        Some(progress)
    }
}

/// The request in the main block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Main {
    pub(super) slot: Slot<Handshake, NonCyclicResponse>,
    /// It must have ended before the servo is switched on.
    pub(super) needs_servo_off: bool,
    pub(super) quiet: Quiet,
    /// Number of consecutive blocks that say that the motion has ended.
    pub(super) falls: u8,
}

/// The request in the sub block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Sub {
    pub(super) slot: Slot<SubHandshake, SubResponse>,
    pub(super) quiet: Quiet,
}

impl Main {
    pub(super) const NONE: Self = Self { slot: Slot::Empty, needs_servo_off: false, quiet: Quiet::BROKEN, falls: 0 };
}

impl Sub {
    pub(super) const NONE: Self = Self { slot: Slot::Empty, quiet: Quiet::BROKEN };
}
