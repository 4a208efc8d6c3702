/// The state of a procedure.
///
/// `T` is its result, `E` the reason why it failed. Both `Done` and `Failed` say when the line is free for the next request:
/// until then an abandoned answer may still be arriving, or the encoder may still be busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Progress<T, E> {
    /// The procedure has not finished. Poll at this time if nothing is received earlier.
    Pending {
        /// When the wait ends, in ns.
        until_ns: u64,
    },
    /// Finished.
    Done {
        /// The result.
        value: T,
        /// When the line is free for the next request, in ns.
        ready_ns: u64,
    },
    /// Failed.
    Failed {
        /// Why.
        error: E,
        /// When the line is free for the next request, in ns.
        ready_ns: u64,
    },
}

/// What a procedure of several transactions (a reset, an EEPROM access or a detection by the master) asks for next.
///
/// `R` is the request, `T` the result of the procedure, `E` the reason why it failed. Hand the outcome of each transaction
/// to the procedure unchanged, refused answers included; the procedure decides whether to try again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Step<R, T, E> {
    /// Do this transaction and report its outcome.
    Send {
        /// What to send.
        request: R,
        /// Not before this time, in ns.
        not_before_ns: u64,
    },
    /// The procedure has succeeded.
    Done {
        /// The result.
        value: T,
        /// When the encoder is ready for other requests, in ns.
        ready_ns: u64,
    },
    /// The procedure has failed.
    Failed {
        /// Why.
        error: E,
        /// When the encoder is ready for other requests, in ns.
        ready_ns: u64,
    },
}

impl<R, T, E> Step<R, T, E> {
    /// Returns the next step of a procedure that is built on this one: `done` continues when this one has succeeded.
    pub fn and_then<U>(self, done: impl FnOnce(T, u64) -> Step<R, U, E>) -> Step<R, U, E> {
        match self {
            Self::Send { request, not_before_ns } => Step::Send { request, not_before_ns },
            Self::Done { value, ready_ns } => done(value, ready_ns),
            Self::Failed { error, ready_ns } => Step::Failed { error, ready_ns },
        }
    }
}

impl<R: Copy, T: Copy, E: Copy> Step<R, T, E> {
    /// Returns how the procedure ended, done or failed; `None` if there is still something to send.
    pub const fn ended(&self) -> Option<Self> {
        if matches!(self, Self::Send { .. }) { None } else { Some(*self) }
    }
}

/// How often a busy device is polled, and at most how many times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Polling {
    /// Time from the end of one answer to the next request, in ns.
    pub interval_ns: u32,
    /// Number of unsuccessful requests after which the access fails; 0 counts as 1.
    pub max_tries: u16,
}

#[cfg(test)]
mod tests {
    use super::Step;

    #[test]
    fn done_and_failed_are_ends_and_to_send_is_none() {
        type Any = Step<u8, u8, u8>;
        for end in [Any::Done { value: 1, ready_ns: 2 }, Any::Failed { error: 3, ready_ns: 4 }] {
            assert_eq!(end.ended(), Some(end));
        }
        assert_eq!(Any::Send { request: 5, not_before_ns: 6 }.ended(), None);
    }
}
