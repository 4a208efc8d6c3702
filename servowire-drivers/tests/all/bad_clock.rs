//! A clock that stands, was set back, jumps, or wraps after 32 bits, at any of its looks, and what calls have to do then.

use std::cell::Cell;
use std::fmt::Debug;

use servowire_drivers::{ClockError, Error};

/// Looks from the fault on after which three calls must have ended: several times what those take that poll an EEPROM.
const PATIENCE: u32 = 2_000_000;
/// Time from look to look, ns.
pub const STEP_NS: u64 = 2_000;

/// What is wrong with the clock, from one of its looks on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    Nothing,
    Stands,
    /// It begins at 0 again.
    Reset,
    /// It has 32 bits, which are over at that look.
    Wraps,
    /// It is five seconds ahead at once.
    Jumps,
}

/// A clock that goes on with every look, until something is wrong.
pub struct Bad {
    looks: Cell<u32>,
    wrong: Wrong,
    at: u32,
    /// The fault came between two calls, so nobody can tell whether it was one.
    between: Cell<bool>,
}

impl Bad {
    pub fn new(wrong: Wrong, at: u32) -> Self {
        Self { looks: Cell::new(0), wrong, at, between: Cell::new(false) }
    }

    /// A call begins: any time may have passed before its first look.
    pub fn call<T>(&self, call: impl FnOnce() -> T) -> T {
        if self.looks.get() == self.at {
            self.between.set(true);
        }
        call()
    }

    pub fn look(&self) -> u64 {
        let look = self.looks.get();
        self.looks.set(look + 1);
        assert!(look < self.at.saturating_add(PATIENCE), "{:?} from look {} on: for ever", self.wrong, self.at);
        let past_ns = |looks: u32| u64::from(looks) * STEP_NS;
        let begin_ns = (1 << 32) - past_ns(self.at);
        match self.wrong {
            Wrong::Stands => begin_ns + past_ns(look.min(self.at)),
            Wrong::Reset if look >= self.at => past_ns(look - self.at),
            Wrong::Wraps => (begin_ns + past_ns(look)) & 0xffff_ffff,
            Wrong::Jumps if look >= self.at => begin_ns + past_ns(look) + 5_000_000_000,
            Wrong::Nothing | Wrong::Reset | Wrong::Jumps => begin_ns + past_ns(look),
        }
    }
}

/// Three calls end without fault of the clock if nothing is wrong with it. If it fails in one of the first two, that is told, once if it
/// goes on, and no call is for ever.
pub fn holds<IO: Debug, PIN: Debug, P: Debug, D: Debug>(
    name: &str,
    calls: impl Fn(&Bad) -> [Option<Error<IO, PIN, P, D>>; 3],
) {
    holds_against(&[Wrong::Stands, Wrong::Reset, Wrong::Wraps, Wrong::Jumps], name, calls);
}

/// The same against these faults alone.
pub fn holds_against<IO: Debug, PIN: Debug, P: Debug, D: Debug>(
    wrongs: &[Wrong],
    name: &str,
    calls: impl Fn(&Bad) -> [Option<Error<IO, PIN, P, D>>; 3],
) {
    let good = Bad::new(Wrong::Nothing, 0);
    for error in calls(&good) {
        assert!(!matches!(error, Some(Error::Clock(_))), "{name}: {error:?}");
    }
    let looks = good.looks.get() * 2 / 3;
    for wrong in wrongs.iter().copied() {
        let mut at = 1;
        while at < looks {
            let bad = Bad::new(wrong, at);
            let errors = calls(&bad).map(|error| match error {
                Some(Error::Clock(error)) => Some(error),
                _ => None,
            });
            let told = if wrong == Wrong::Stands {
                // And it goes on standing.
                errors[2] == Some(ClockError::Stopped)
            } else if wrong == Wrong::Jumps {
                let mut told = errors.iter().flatten();
                match (told.next(), told.next()) {
                    // Between two calls five seconds may have passed.
                    (None, None) => bad.between.get(),
                    (Some(ClockError::Ahead { by_ns: 5_000_000_000.. }), None) => true,
                    _ => false,
                }
            } else {
                let mut told = errors.iter().flatten();
                matches!((told.next(), told.next()), (Some(ClockError::Backwards { .. }), None))
            };
            assert!(told, "{name}, {wrong:?} from look {at} of {looks} on: {errors:?}");
            at += 1 + at / if wrong == Wrong::Jumps { 40 } else { 9 };
        }
    }
}
