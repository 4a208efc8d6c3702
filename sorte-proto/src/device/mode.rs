//! What the ports do with frames in each state, and the state that only the host can end.

use super::heard::PortId;
use super::machine::Device;
use super::port::{PortFlags, State};

/// What a port of the published hardware does with the frames that come in. The mode changes at the end of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Forwarding {
    /// Auto-forward: the hardware forwards them by itself, 320 ns after they begin.
    Auto,
    /// Cut-through: byte by byte through a [`Passage`](super::Passage), which rewrites.
    Rewrite,
    /// Reflection: the hardware sends the frames back through the port at which they came in.
    Reflect,
    /// Nothing passes; the host sends its delay requests through this port.
    HostSend,
    /// The device sends its own frame at its time, [`Device::send_time_ns`]; then auto-forward until the cycle is over.
    TimeTriggered,
}

impl Device {
    /// Returns what happens to the frames that come in at `port`, as the published device configures its hardware.
    ///
    /// | state | at the master port | at the other port | at the port of a last device |
    /// |---|---|---|---|
    /// | IDLE | auto | auto | rewrite |
    /// | DISCOVERY, SYNC | rewrite | auto | rewrite |
    /// | PARAM | auto | auto | reflect |
    /// | LINE_DELAY | reflect | host sends | reflect |
    /// | IOEX | auto | time-triggered, then auto | time-triggered |
    /// | DIAG, ERROR | auto | auto | reflect |
    ///
    /// The last device sends what it rewrites back out of the same port, see [`Passage::path`](super::Passage::path).
    pub fn forwarding(&self, port: PortId) -> Forwarding {
        let handler = self.port(port);
        let last = handler.flags.contains(PortFlags::LAST_DEVICE);
        let master = handler.flags.contains(PortFlags::MASTER_PORT);
        match handler.state {
            State::Discovery | State::Sync if master => Forwarding::Rewrite,
            State::Idle if last => Forwarding::Rewrite,
            State::LineDelay if master => Forwarding::Reflect,
            State::LineDelay => Forwarding::HostSend,
            State::Exchange if last || !master => Forwarding::TimeTriggered,
            State::Param | State::Diag | State::Error if last => Forwarding::Reflect,
            _ => Forwarding::Auto,
        }
    }

    /// Takes the device out of service: in [`State::Error`] it lets frames pass and sends nothing itself until
    /// [`reset`](Self::reset). The published device has this state but never enters it.
    pub fn enter_error(&mut self) {
        for port in [PortId::A, PortId::B] {
            self.port_mut(port).enter(State::Error);
        }
    }

    /// Goes back to IDLE from any state; counts as a retrain.
    pub fn reset(&mut self) {
        self.restart();
    }
}

servowire_core::one_line!(Forwarding {
    Self::Auto => "auto-forward";
    Self::Rewrite => "rewrite";
    Self::Reflect => "reflect";
    Self::HostSend => "host sends";
    Self::TimeTriggered => "time-triggered";
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Action, Config, FrameTimes, Path};
    use crate::discovery::Discovery;
    use crate::error::Error;
    use crate::link::Link;
    use crate::place::Place;

    const STATES: [State; 8] = [
        State::Idle,
        State::Discovery,
        State::Param,
        State::LineDelay,
        State::Sync,
        State::Exchange,
        State::Diag,
        State::Error,
    ];

    /// The table of the published firmware's macros, state by state: master port, other port, only port.
    #[test]
    fn each_state_has_its_modes() {
        use Forwarding::{Auto, HostSend, Reflect, Rewrite, TimeTriggered};
        let modes = [
            [Auto, Auto, Rewrite],
            [Rewrite, Auto, Rewrite],
            [Auto, Auto, Reflect],
            [Reflect, HostSend, Reflect],
            [Rewrite, Auto, Rewrite],
            [Auto, TimeTriggered, TimeTriggered],
            [Auto, Auto, Reflect],
            [Auto, Auto, Reflect],
        ];
        for (code, (state, modes)) in (0..).zip(STATES.into_iter().zip(modes)) {
            assert_eq!((state.code(), State::from_code(code)), (code, Some(state)));
            let mut device = Device::new(Config::new());
            device.set_links(Link::Up, Link::Up);
            device.a.flags |= PortFlags::MASTER_PORT;
            (device.a.state, device.b.state) = (state, state);
            assert_eq!([device.forwarding(PortId::A), device.forwarding(PortId::B)], [modes[0], modes[1]], "{state:?}");
            let mut last = Device::new(Config::new());
            last.set_links(Link::Down, Link::Up);
            last.b.state = state;
            assert_eq!(last.forwarding(PortId::B), modes[2], "{state:?}");
        }
        assert_eq!(State::from_code(8), None);
    }

    #[test]
    fn a_device_in_error_lets_frames_pass_and_says_nothing_until_it_is_reset() {
        for last in [false, true] {
            let mut device = Device::new(Config::new());
            device.set_links(Link::Up, if last { Link::Down } else { Link::Up });
            let mut frame = Discovery::request(Place::Inner).emit();
            let arrival = FrameTimes { sof_ns: 0, counter_ns: 0, now_ns: 0 };
            assert_eq!(device.hear(PortId::A, &mut frame, arrival).result, Ok(()));
            device.enter_error();
            let mut frame = Discovery::request(Place::Last).emit();
            let handled = device.hear(PortId::A, &mut frame, arrival);
            assert_eq!(handled.path, if last { Path::Reflect } else { Path::Forward });
            assert_eq!((frame, device.state()), (Discovery::request(Place::Last).emit(), State::Error));
            assert!(matches!(device.poll(0, u64::MAX), Action::Wait { .. }) && device.answer([0; 3]).is_none());
            assert_eq!(device.hear_exchange(&[0; 21], arrival).map(|_| ()), Err(Error::WrongState));
            // A link that comes and goes does not end it.
            device.set_links(Link::Down, Link::Up);
            device.set_links(Link::Up, if last { Link::Down } else { Link::Up });
            assert_eq!(device.state(), State::Error);
            device.reset();
            assert_eq!((device.state(), device.counters().retrains), (State::Idle, 1));
            assert_eq!(device.hear(PortId::A, &mut frame, arrival).result, Ok(()));
            assert_eq!(device.state(), State::Discovery);
        }
    }
}
