//! What has been asked of a motion, and what becomes of it: the same for an axis and for a path.

use crate::error::Error;
use crate::real::Real;

/// The requests in force. What the motion is to reach, a target or the lines of a path, is kept beside them.
///
/// | request | no stop under way | in a stop | in a quick stop, until rest |
/// |---|---|---|---|
/// | a motion | goes there | an axis goes there at once, a path from where the stop ends | [`Error::Moving`] |
/// | hold, an override of 0 | to rest; what was to be reached is kept | recorded, the stop stays the same | recorded |
/// | resume, another override | goes on | recorded, the stop stays the same | recorded |
/// | stop | to rest; what was to be reached is forgotten | the same stop | the same stop |
/// | quick stop | to rest, quicker | from now on a quick one | quicker, or the same |
/// | halt | at once; a hold is over, an override stays | the stop is over too | the same |
///
/// A motion asked for on hold begins with the resume. The first motion after a halt ends the state of being halted; another
/// halt, at rest, does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Requests {
    percent: u16,
    held: bool,
    stop: Stop,
    halted: bool,
    /// Of the last motion, stop or halt.
    number: u32,
}

/// The stop that is under way, if it was asked for as such.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Stop {
    None,
    Plain,
    Quick,
}

impl Requests {
    /// None yet.
    pub(crate) const NONE: Self = Self { percent: 100, held: false, stop: Stop::None, halted: false, number: 0 };

    /// Refuses a motion during a quick stop.
    pub(crate) const fn ready(self, at_rest: bool) -> Result<(), Error> {
        if self.is_quick() && !at_rest { Err(Error::Moving) } else { Ok(()) }
    }

    /// Takes a motion that leaves a stop under way.
    pub(crate) const fn go(&mut self) {
        (self.stop, self.halted) = (Stop::None, false);
        self.count();
    }

    /// Takes a motion that begins where a stop under way ends.
    pub(crate) const fn go_later(&mut self) {
        if self.is_quick() {
            // It is over, or this motion would have been refused.
            self.stop = Stop::None;
        }
        self.halted = false;
        self.count();
    }

    pub(crate) const fn set_override(&mut self, percent: u16) {
        self.percent = percent;
    }

    pub(crate) const fn hold(&mut self) {
        self.held = true;
    }

    pub(crate) const fn resume(&mut self) {
        self.held = false;
    }

    /// A stop, which does not soften a quick one.
    pub(crate) const fn stop(&mut self) {
        if !self.is_quick() {
            self.stop = Stop::Plain;
        }
        self.count();
    }

    pub(crate) const fn quick_stop(&mut self) {
        self.stop = Stop::Quick;
        self.count();
    }

    /// A stop has come to its end. After a quick one motion is taken again once all is at rest.
    pub(crate) const fn stopped(&mut self) {
        if !self.is_quick() {
            self.stop = Stop::None;
        }
    }

    /// A halt: a hold before it is over, one after it counts.
    pub(crate) const fn halt(&mut self) {
        self.held = false;
        self.count();
    }

    const fn count(&mut self) {
        self.number = self.number.wrapping_add(1);
    }

    /// No further step is made because of a halt, which has stopped a motion or has come at rest.
    pub(crate) const fn halted(&mut self, was_moving: bool) {
        (self.stop, self.halted) = (Stop::None, self.halted || was_moving);
    }

    /// Holds, or goes on, as others do, to which the same has been asked.
    pub(crate) const fn hold_as(&mut self, other: Self) {
        (self.held, self.percent, self.number) = (other.held, other.percent, other.number);
    }

    /// A number that changes with each motion, stop and halt, so that whoever asked for the last one knows whether it still counts.
    pub(crate) const fn number(self) -> u32 {
        self.number
    }

    /// Returns whether another request has changed nothing.
    pub(crate) fn are_as(self, other: Self) -> bool {
        Self { number: other.number, ..self } == other
    }

    pub(crate) const fn is_halted(self) -> bool {
        self.halted
    }

    /// Returns whether a stop is under way.
    pub(crate) const fn is_stopping(self) -> bool {
        !matches!(self.stop, Stop::None)
    }

    pub(crate) const fn is_quick(self) -> bool {
        matches!(self.stop, Stop::Quick)
    }

    /// Returns whether what was asked for is to wait.
    pub(crate) const fn holds(self) -> bool {
        self.held || self.percent == 0
    }

    /// Returns whether the motion is to come to rest, or to stay there.
    pub(crate) const fn brakes(self) -> bool {
        self.holds() || self.is_stopping()
    }

    /// Fraction of the speeds that were asked for; `None` to brake.
    pub(crate) fn part(self) -> Option<Real> {
        (!self.brakes()).then(|| Real::new(self.percent.into()) / Real::new(100))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKS: [fn(&mut Requests); 8] = [
        |requests| requests.go(),
        |requests| requests.go_later(),
        Requests::hold,
        Requests::resume,
        |requests| requests.set_override(50),
        Requests::stop,
        Requests::quick_stop,
        |requests| {
            requests.halt();
            requests.halted(true);
        },
    ];

    fn after(asks: &[fn(&mut Requests)]) -> Requests {
        let mut requests = Requests::NONE;
        for ask in asks {
            ask(&mut requests);
        }
        requests
    }

    /// From each state by each request: whether a stop is under way, whether motion is refused before rest, whether it brakes, and
    /// whether it is halted.
    #[test]
    fn what_each_request_does_in_each_state() {
        let [go, later, hold, resume, slow, stop, quick, halt] = ASKS;
        let none = [
            (go, "----"),
            (later, "----"),
            (hold, "--b-"),
            (resume, "----"),
            (slow, "----"),
            (stop, "s-b-"),
            (quick, "srb-"),
            (halt, "---h"),
        ];
        let held = [
            (go, "--b-"),
            (later, "--b-"),
            (hold, "--b-"),
            (resume, "----"),
            (slow, "--b-"),
            (stop, "s-b-"),
            (quick, "srb-"),
            (halt, "---h"),
        ];
        let stopping = [
            (go, "----"),
            (later, "s-b-"),
            (hold, "s-b-"),
            (resume, "s-b-"),
            (slow, "s-b-"),
            (stop, "s-b-"),
            (quick, "srb-"),
            (halt, "---h"),
        ];
        let quickly = [
            (go, "----"),
            (later, "----"),
            (hold, "srb-"),
            (resume, "srb-"),
            (slow, "srb-"),
            (stop, "srb-"),
            (quick, "srb-"),
            (halt, "---h"),
        ];
        let halted = [
            (go, "----"),
            (later, "----"),
            (hold, "--bh"),
            (resume, "---h"),
            (slow, "---h"),
            (stop, "s-bh"),
            (quick, "srbh"),
            (halt, "---h"),
        ];
        for (state, row) in [(resume, none), (hold, held), (stop, stopping), (quick, quickly), (halt, halted)] {
            for (at, (ask, want)) in row.into_iter().enumerate() {
                let got = after(&[state, ask]);
                let flag = |is: bool, name| if is { name } else { '-' };
                let flags = [
                    flag(got.is_stopping(), 's'),
                    flag(got.ready(false) == Err(Error::Moving), 'r'),
                    flag(got.brakes() && got.part().is_none(), 'b'),
                    flag(got.is_halted(), 'h'),
                ];
                assert!(flags.into_iter().eq(want.chars()), "{want}, not {flags:?}: {at} after {:?}", after(&[state]));
                assert_eq!(got.ready(true), Ok(()));
            }
        }
    }

    #[test]
    fn an_override_is_a_fraction_and_0_is_a_hold() {
        let part = |percent| {
            let mut requests = Requests::NONE;
            requests.set_override(percent);
            requests.part().map(|part| (part * Real::new(1000) + Real::ONE.half()).to_fixed(0))
        };
        assert_eq!([1, 100, 250].map(part), [10, 1000, 2500].map(Some));
        assert_eq!(part(0), None);
        let slow = |requests: &mut Requests| requests.set_override(0);
        assert!(after(&[slow, Requests::resume, |requests| requests.halt()]).brakes(), "a halt keeps it");
        assert!(!after(&[Requests::hold, |requests| requests.halt()]).brakes(), "it ends a hold");
    }

    /// What was asked of a copy in another order, or not at all, counts as it does for the other one.
    #[test]
    fn a_copy_holds_as_the_other_one_does() {
        let other = after(&[Requests::stop, Requests::hold, |requests| requests.set_override(50)]);
        let mut copy = after(&[|requests| requests.go(), Requests::quick_stop]);
        copy.hold_as(other);
        assert!(copy.number() == other.number() && copy.is_quick());
        assert_eq!((copy.held, copy.percent), (true, 50));
    }

    /// A halt at rest after one of a motion, and others the same.
    #[test]
    fn what_lasts_until_another_motion() {
        let halt: fn(&mut Requests) = |requests| requests.halted(true);
        let again: fn(&mut Requests) = |requests| requests.halted(false);
        assert!(after(&[halt, again]).is_halted() && !after(&[again]).is_halted());
        assert!(!after(&[Requests::stop, Requests::stopped]).is_stopping());
        assert!(after(&[Requests::quick_stop, Requests::stopped]).is_quick());
    }
}
