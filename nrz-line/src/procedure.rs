/// What a procedure of several transactions wants next: a master's reset, EEPROM access or detection.
///
/// `R` is the request, `T` what the procedure is made for, `E` why it fails. A refused answer is handed to the procedure
/// as it is; the procedure decides whether to try again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Step<R, T, E> {
    /// Do this transaction and report its outcome.
    Send {
        /// What to send.
        request: R,
        /// Not before this time.
        not_before_ns: u64,
    },
    /// The procedure has succeeded.
    Done {
        /// What it was made for.
        value: T,
        /// The encoder is ready for other requests from this time on.
        not_before_ns: u64,
    },
    /// The procedure has failed.
    Failed {
        /// Why.
        error: E,
        /// The encoder is ready for other requests from this time on.
        not_before_ns: u64,
    },
}

/// How often something that is busy is asked, and how many times at the most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Polling {
    /// Time from the end of one answer to the next request, in ns.
    pub interval_ns: u32,
    /// Requests without success after which the access fails; 0 counts as 1.
    pub max_tries: u16,
}

impl Default for Polling {
    /// Every millisecond, 40 times: twice the 18 ms that an encoder takes to write its EEPROM.
    fn default() -> Self {
        Self { interval_ns: 1_000_000, max_tries: 40 }
    }
}
