//! One port's handler: what the head of a frame does to its state.

use crate::frame::MULTICAST;
use crate::frame_type::FrameType;
use crate::status::Status;

servowire_core::codes! {
    /// State of a device, by the published codes.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum State: u8 {
        /// Waits for DISCOVERY.
        #[default]
        Idle = 0 => "IDLE",
        /// Waits for its address and offsets.
        Discovery = 1 => "DISCOVERY",
        /// Waits for the parameters.
        Param = 2 => "PARAM",
        /// Measures the line to the next device.
        LineDelay = 3 => "LINE_DELAY",
        /// Sets its clock.
        Sync = 4 => "SYNC",
        /// The IO exchange.
        Exchange = 5 => "IOEX",
        /// Diagnosis. The published firmware has the code but does nothing in this state; this crate never enters it.
        Diag = 6 => "DIAG",
        /// Out of service until the host resets the device, see [`Device::enter_error`](super::Device::enter_error).
        Error = 7 => "ERROR",
    }
}

impl State {
    /// Whether this is the head of a frame on which the state acts.
    pub(super) fn waits_for(self, [da, _, code, _]: [u8; 4]) -> bool {
        da == MULTICAST && self.frame_type().is_some_and(|t| t.code() == code)
    }

    const fn frame_type(self) -> Option<FrameType> {
        match self {
            Self::Idle | Self::Discovery => Some(FrameType::Discovery),
            Self::Param => Some(FrameType::Param),
            Self::LineDelay => Some(FrameType::DelayReq),
            Self::Sync => Some(FrameType::Sync),
            Self::Exchange | Self::Diag | Self::Error => None,
        }
    }
}

/// Flags of a port's handler, with the published names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PortFlags(u8);

bitflags::bitflags! {
    impl PortFlags: u8 {
        /// LAST_DEVICE: no other port is linked.
        const LAST_DEVICE = 1 << 0;
        /// MASTER_PORT: this port faces the master.
        const MASTER_PORT = 1 << 1;
        /// IGNORE_TO_EOF: the head has been examined; the rest of the frame is ignored.
        const IGNORE_TO_EOF = 1 << 2;
        /// SWITCH_PORT_CONFIG: the state has changed, so the forwarding has to change at the end of the frame.
        const SWITCH_PORT_CONFIG = 1 << 3;
        /// NEW_SYNC_FRAME: a SYNC frame for the clock.
        const NEW_SYNC_FRAME = 1 << 4;
    }
}

servowire_core::show_flags!(PortFlags);

servowire_core::codes! {
    /// The measurement on the other port that a delay request on the master port starts.
    #[derive(Default)]
    pub enum Trigger: u8 {
        /// None.
        #[default]
        None = 0 => "none",
        /// One of the sixteen requests.
        Normal = 1 => "normal",
        /// The last of them, which carries STATE_CHANGE.
        Last = 2 => "last",
    }
}

/// What a handler learned from the head of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Seen {
    /// The frame is sent on with changes.
    pub modifies: bool,
    /// The measurement to start.
    pub trigger: Trigger,
}

/// The handler of one port.
///
/// ```text
///  IDLE --DISCOVERY--> DISCOVERY --STATE_CHANGE--> PARAM --STATE_CHANGE--> LINE_DELAY
///                                                   IOEX <--STATE_CHANGE-- SYNC <--+ STATE_CHANGE
/// ```
///
/// The state changes with the head of the frame; forwarding changes at its end. A frame whose TYPE or DA is not the one that
/// the state waits for is ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Port {
    /// State.
    pub state: State,
    /// Flags.
    pub flags: PortFlags,
}

impl Port {
    /// Takes DA, SA, TYPE and STATUS of a frame.
    pub fn head(&mut self, head: [u8; 4]) -> Seen {
        if self.flags.contains(PortFlags::IGNORE_TO_EOF) {
            return Seen::default();
        }
        self.flags |= PortFlags::IGNORE_TO_EOF;
        let master = self.flags.contains(PortFlags::MASTER_PORT);
        // The reverse port does not see requests in LINE_DELAY, only its own one reflected.
        if !self.state.waits_for(head) || self.state == State::LineDelay && !master {
            return Seen::default();
        }
        let [_, _, _, status] = head.map(Status::from_bits_retain);
        let change = status.contains(Status::STATE_CHANGE);
        let seen = match self.state {
            State::Idle => return self.first(status),
            State::Discovery => Seen { modifies: master, ..Seen::default() },
            State::LineDelay if change => Seen { trigger: Trigger::Last, ..Seen::default() },
            State::LineDelay => Seen { trigger: Trigger::Normal, ..Seen::default() },
            State::Sync => {
                if master {
                    self.flags |= PortFlags::NEW_SYNC_FRAME;
                }
                Seen { modifies: master, ..Seen::default() }
            }
            State::Param | State::Exchange | State::Diag | State::Error => Seen::default(),
        };
        if change {
            self.enter(match self.state {
                State::Idle | State::Discovery => State::Param,
                State::Param => State::LineDelay,
                State::LineDelay => State::Sync,
                State::Sync | State::Exchange => State::Exchange,
                // Never: no frame is waited for.
                State::Diag | State::Error => self.state,
            });
        }
        seen
    }

    /// Learns from the first DISCOVERY in which direction the master is. The last device modifies even this frame.
    fn first(&mut self, status: Status) -> Seen {
        if !status.contains(Status::LAST) {
            self.flags |= PortFlags::MASTER_PORT;
        }
        self.enter(State::Discovery);
        Seen { modifies: self.flags.contains(PortFlags::LAST_DEVICE), ..Seen::default() }
    }

    pub(super) fn enter(&mut self, state: State) {
        self.state = state;
        self.flags |= PortFlags::SWITCH_PORT_CONFIG;
    }

    /// Ends the frame: the next one is examined again.
    pub(super) fn end_of_frame(&mut self) {
        self.flags.remove(PortFlags::IGNORE_TO_EOF | PortFlags::SWITCH_PORT_CONFIG | PortFlags::NEW_SYNC_FRAME);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What goes on changed: DISCOVERY (1) and SYNC (5) from the port of the master, and the first DISCOVERY at the last
    /// device.
    #[test]
    fn frames_that_go_on_changed() {
        let modifies = |state, flags, code| Port { state, flags }.head([255, 0, code, 0]).modifies;
        let (none, master, last) = (PortFlags::empty(), PortFlags::MASTER_PORT, PortFlags::LAST_DEVICE);
        for (state, code) in [(State::Discovery, 1), (State::Sync, 5)] {
            assert!(modifies(state, master, code) && !modifies(state, none, code) && !modifies(state, last, code));
        }
        assert!(modifies(State::Idle, last, 1) && !modifies(State::Idle, none, 1));
        assert!(!modifies(State::Param, master, 2) && !modifies(State::LineDelay, master, 3));
    }

    /// Every state, role, TYPE and STATUS: one step forward at most, and only for the frame the state waits for.
    #[test]
    fn every_head_moves_one_step_at_most() {
        let states = [State::Idle, State::Discovery, State::Param, State::LineDelay, State::Sync, State::Exchange];
        for state in states {
            for flags in (0..32).map(PortFlags::from_bits_retain) {
                for code in (0..=u8::MAX).step_by(crate::stride(51)) {
                    for status in (0..=u8::MAX).step_by(crate::stride(51)) {
                        let before = Port { state, flags };
                        let mut port = before;
                        let seen = port.head([255, 0, code, status]);
                        let step = port.state as u8 - before.state as u8;
                        assert!(step <= 1);
                        if step == 1 {
                            assert_eq!(code, if state as u8 == 0 { 1 } else { [1, 2, 3, 5][state as usize - 1] });
                            assert!(status & 8 != 0 || state == State::Idle);
                            assert!(port.flags.contains(PortFlags::SWITCH_PORT_CONFIG));
                        }
                        if flags.contains(PortFlags::IGNORE_TO_EOF) {
                            assert_eq!((port, seen), (before, Seen::default()));
                        }
                        let mut other = before;
                        assert_eq!(other.head([254, 0, code, status]), Seen::default());
                        assert_eq!(other.state, state);
                    }
                }
            }
        }
    }
}
