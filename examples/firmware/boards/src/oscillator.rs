//! Starting a crystal that may be missing.

/// The clock source of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The crystal: the rates are exact.
    Crystal,
    /// The internal oscillator, about 1 % off, because the crystal does not start.
    Internal,
}

/// Starts the crystal, checks it at most `looks` times, and returns the clock source for the core. `set` switches it on and
/// off. A
/// crystal that does not start is switched off again.
pub fn start(mut set: impl FnMut(bool), is_ready: impl FnMut() -> bool, looks: u32) -> Source {
    set(true);
    if waited(is_ready, looks) {
        return Source::Crystal;
    }
    set(false);
    Source::Internal
}

/// Polls something at most `looks` times. Returns whether it became ready.
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
            // A register that is ready when it is polled for the n-th time, counted from 1.
            let is_ready = || {
                seen.set(seen.get() + 1);
                on.get() && seen.get() >= ready_at
            };
            assert_eq!(start(|set| on.set(set), is_ready, 100), source);
            assert_eq!((seen.get(), on.get()), (looks, source == Source::Crystal), "{ready_at}");
        }
    }
}
