//! Starting a crystal that may be missing.

/// From what a core runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The crystal: the rates are exact.
    Crystal,
    /// The internal oscillator, some 1 % off: the crystal does not start.
    Internal,
}

/// Starts the crystal, looks at it `looks` times at the most, and says from what the core can run. `set` switches it on and off. A
/// crystal that does not start is switched off again.
pub fn start(mut set: impl FnMut(bool), is_ready: impl FnMut() -> bool, looks: u32) -> Source {
    set(true);
    if waited(is_ready, looks) {
        return Source::Crystal;
    }
    set(false);
    Source::Internal
}

/// Looks at something `looks` times at the most. Whether it got ready.
pub fn waited(mut is_ready: impl FnMut() -> bool, looks: u32) -> bool {
    (0..looks).any(|_| is_ready())
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_crystal_is_waited_for_and_not_for_ever() {
        for (ready_at, source, looks) in [
            (1, Source::Crystal, 1),
            (100, Source::Crystal, 100),
            (101, Source::Internal, 100),
            (u32::MAX, Source::Internal, 100),
        ] {
            let (on, seen) = (Cell::new(false), Cell::new(0));
            // A register that is ready at the look with this number, counted from 1.
            let is_ready = || {
                seen.set(seen.get() + 1);
                on.get() && seen.get() >= ready_at
            };
            assert_eq!(start(|set| on.set(set), is_ready, 100), source);
            assert_eq!((seen.get(), on.get()), (looks, source == Source::Crystal), "{ready_at}");
        }
    }
}
