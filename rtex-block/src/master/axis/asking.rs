//! Requests on their way.

use crate::master::echo::TURN;
use crate::master::handshake::Handshake;
use crate::master::progress::Progress;
use crate::master::sub_handshake::SubHandshake;
use crate::noncyclic_response::NonCyclicResponse;
use crate::sub::SubResponse;

/// For how many blocks the normal code has come back. A whole turn of the counter lies between two requests, so what an old block
/// says is no answer to the next one: the echoes tell requests of one kind apart by their index, and not by their data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Quiet(u8);

impl Quiet {
    /// From the end of a request or a motion on.
    pub(super) const BROKEN: Self = Self(0);

    /// Whether the normal code has come back for a turn.
    #[inline]
    pub(super) const fn is_kept(self) -> bool {
        self.0 >= TURN
    }

    /// A block on time, with the normal code or another one.
    #[inline]
    pub(super) const fn hear(&mut self, is_normal: bool) {
        if !self.is_kept() {
            self.0 = if is_normal { self.0.saturating_add(1) } else { 0 };
        }
    }
}

/// The request in the main block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Main {
    pub(super) asking: Option<Handshake>,
    /// It must be over before the servo is switched on.
    pub(super) needs_servo_off: bool,
    pub(super) quiet: Quiet,
    pub(super) outcome: Option<Progress<NonCyclicResponse>>,
    /// In_Progress was 0 in the last block of a motion.
    pub(super) fell: bool,
}

/// The request in the sub block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Sub {
    pub(super) asking: Option<SubHandshake>,
    pub(super) quiet: Quiet,
    pub(super) outcome: Option<Progress<SubResponse>>,
}

impl Main {
    pub(super) const NONE: Self =
        Self { asking: None, needs_servo_off: false, quiet: Quiet::BROKEN, outcome: None, fell: false };
}

impl Sub {
    pub(super) const NONE: Self = Self { asking: None, quiet: Quiet::BROKEN, outcome: None };
}
