//! Starting a crystal that may be missing.

/// Registers of an oscillator.
pub trait Oscillator {
    /// Switches the crystal on.
    fn start(&mut self);
    /// Whether it runs.
    fn is_ready(&self) -> bool;
    /// Switches it off.
    fn stop(&mut self);
}

/// From what a core runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The crystal: the rates are exact.
    Crystal,
    /// The internal oscillator, some 1 % off: the crystal does not start.
    Internal,
}

/// Starts the crystal, looks at it `looks` times at the most, and says from what the core can run. A crystal that does not start is
/// switched off again.
pub fn start(oscillator: &mut impl Oscillator, looks: u32) -> Source {
    oscillator.start();
    if (0..looks).any(|_| oscillator.is_ready()) {
        return Source::Crystal;
    }
    oscillator.stop();
    Source::Internal
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// A register that is ready at the look with this number, counted from 1.
    struct Mock {
        ready_at: u32,
        looks: Cell<u32>,
        on: bool,
    }

    impl Oscillator for Mock {
        fn start(&mut self) {
            self.on = true;
        }

        fn is_ready(&self) -> bool {
            self.looks.set(self.looks.get() + 1);
            self.on && self.looks.get() >= self.ready_at
        }

        fn stop(&mut self) {
            self.on = false;
        }
    }

    #[test]
    fn a_crystal_is_waited_for_and_not_for_ever() {
        for (ready_at, source, looks) in [
            (1, Source::Crystal, 1),
            (100, Source::Crystal, 100),
            (101, Source::Internal, 100),
            (u32::MAX, Source::Internal, 100),
        ] {
            let mut mock = Mock { ready_at, looks: Cell::new(0), on: false };
            assert_eq!(start(&mut mock, 100), source);
            assert_eq!((mock.looks.get(), mock.on), (looks, source == Source::Crystal), "{ready_at}");
        }
    }
}
