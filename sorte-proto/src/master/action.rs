//! What the master asks the caller to do.

use crate::delay_req::DelayReq;
use crate::discovery::Discovery;
use crate::discovery::room;
use crate::error::Error;
use crate::param::Param;
use crate::place::Place;
use crate::preamble::Preamble;
use crate::sync::Sync;

/// A start-up frame to send.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Outgoing {
    /// DISCOVERY; see [`Discovery::request`].
    Discovery {
        /// Whether it is the last frame of its phase.
        place: Place,
    },
    /// PARAM
    Param(Param),
    /// DELAY_REQ
    DelayReq(DelayReq),
    /// SYNC
    Sync(Sync),
}

impl Outgoing {
    /// The preamble before it.
    pub const fn preamble(&self) -> Preamble {
        match self {
            Self::Sync(_) => Preamble::Middle,
            _ => Preamble::Long,
        }
    }

    /// Writes the frame from DA to FCS and returns its length.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]; [`Discovery::LEN`] is always enough.
    pub fn emit_into(&self, into: &mut [u8]) -> Result<usize, Error> {
        match self {
            Self::Discovery { place } => Discovery::emit_request_into(*place, into),
            Self::Param(frame) => put(into, &frame.emit()),
            Self::DelayReq(frame) => put(into, &frame.emit()),
            Self::Sync(frame) => put(into, &frame.emit()),
        }
    }
}

fn put(into: &mut [u8], frame: &[u8]) -> Result<usize, Error> {
    room(into, frame.len())?.iter_mut().zip(frame).for_each(|(to, from)| *to = *from);
    Ok(frame.len())
}

/// What to do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Action {
    /// Nothing to do before `until_ns`, unless something comes.
    Wait {
        /// `u64::MAX` until link and enable are present.
        until_ns: u64,
    },
    /// Send a start-up frame.
    Send {
        /// When to trigger it; never before the time of the poll.
        at_ns: u64,
        /// Which.
        frame: Outgoing,
    },
    /// Send the master frame of a cycle, see [`Master::emit_into`](super::Master::emit_into).
    Exchange {
        /// When to trigger it; never before the time of the poll.
        at_ns: u64,
        /// Low 16 bits of the master's time at the trigger.
        time_stamp: u16,
        /// Number of the cycle, from 0.
        cycle: u64,
        /// The master is about to restart, so the axes must come to rest: see
        /// [`Config::stop_cycles`](super::Config::stop_cycles). Then call [`Master::halted`](super::Master::halted).
        stop: bool,
    },
    /// The master has gone back to IDLE.
    Restart {
        /// Why.
        error: Error,
    },
}

servowire_core::one_line!(Outgoing {
    Self::Discovery { place: Place::Last } => "last DISCOVERY";
    Self::Discovery { place: Place::Inner } => "DISCOVERY";
    Self::Param(frame) => "{}", frame;
    Self::DelayReq(frame) => "{}", frame;
    Self::Sync(frame) => "{}", frame;
});
servowire_core::one_line!(Action {
    Self::Wait { until_ns: u64::MAX } => "wait for link and enable";
    Self::Wait { until_ns } => "wait until {} ns", until_ns;
    Self::Send { at_ns, frame } => "send {} at {} ns", frame, at_ns;
    Self::Exchange { at_ns, cycle, stop: false, .. } => "cycle {} at {} ns", cycle, at_ns;
    Self::Exchange { at_ns, cycle, stop: true, .. } => "cycle {} at {} ns, stopping", cycle, at_ns;
    Self::Restart { error } => "restart: {}", error;
});
