/// The state of a procedure.
///
/// `T` is what it was made for, `E` why it failed. Both ends say from when on the line is free for the next request:
/// until then an answer that was given up may still be talking, or the encoder is at work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Progress<T, E> {
    /// Not finished. Poll at this time if nothing is received earlier.
    Pending {
        /// When the wait is over, in ns.
        until_ns: u64,
    },
    /// Finished.
    Done {
        /// What it was made for.
        value: T,
        /// The line is free for the next request from this time on, in ns.
        ready_ns: u64,
    },
    /// Failed.
    Failed {
        /// Why.
        error: E,
        /// The line is free for the next request from this time on, in ns.
        ready_ns: u64,
    },
}

/// What a procedure of several transactions wants next: a master's reset, EEPROM access or detection.
///
/// `R` is the request, `T` what the procedure is made for, `E` why it fails. The outcome of each transaction, refused
/// answers included, is handed to the procedure as it is; the procedure decides whether to try again.
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
        /// What it was made for.
        value: T,
        /// The encoder is ready for other requests from this time on, in ns.
        ready_ns: u64,
    },
    /// The procedure has failed.
    Failed {
        /// Why.
        error: E,
        /// The encoder is ready for other requests from this time on, in ns.
        ready_ns: u64,
    },
}

impl<R, T, E> Step<R, T, E> {
    /// The next step of a procedure that is built on this one: `done` continues when this one has succeeded.
    pub fn and_then<U>(self, done: impl FnOnce(T, u64) -> Step<R, U, E>) -> Step<R, U, E> {
        match self {
            Self::Send { request, not_before_ns } => Step::Send { request, not_before_ns },
            Self::Done { value, ready_ns } => done(value, ready_ns),
            Self::Failed { error, ready_ns } => Step::Failed { error, ready_ns },
        }
    }
}

impl<R: Copy, T: Copy, E: Copy> Step<R, T, E> {
    /// How the procedure ended, done or failed; `None` if there is something to send.
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
    /// Requests without success after which the access fails; 0 counts as 1.
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
