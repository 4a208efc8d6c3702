use servowire_core::ClockError;

use crate::PinTooSlow;

/// Why a call failed. `IO` is the error of the port (a UART, an SPI, the bus of an ASIC), `PIN` that of the direction pin, `P` that
/// of the protocol, and `D` its doubts about a position. A driver without one of these uses [`Infallible`] in its place.
///
/// [`Infallible`]: core::convert::Infallible
///
/// After any of these errors the next call begins with a clean line: it waits until no other station can still be transmitting
/// and discards what has arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Error<IO, PIN, P, D> {
    /// The port reports a fault: noise, framing or overrun on a UART, or an ASIC whose bus does not answer. The exchange
    /// is lost.
    #[error("the port reports a fault")]
    Io(IO),
    /// The direction pin reports a fault.
    #[error("the direction pin reports a fault")]
    Pin(PIN),
    /// The direction pin is too slow for the rate that a search for the encoder has reached; nothing was sent.
    #[error(transparent)]
    PinTooSlow(#[from] PinTooSlow),
    /// There was no sound answer, and the line driver may have been switched off after the encoder had begun to answer, later
    /// than [`Worst`](crate::Worst) allows.
    #[error("the line driver went off up to {by_ns} ns too late")]
    DriverLate {
        /// How much later in the worst case, in ns.
        by_ns: u64,
    },
    /// The port no longer takes or returns anything.
    #[error("the port is closed")]
    Closed,
    /// Another station is transmitting without a pause; nothing was sent.
    #[error("the line does not go quiet")]
    NeverQuiet,
    /// The clock has stopped, was set back or has jumped; it is not known whether a request that had begun took effect.
    #[error("{0}")]
    Clock(#[from] ClockError),
    /// No answer, or a refused one; for an RTEX master, the reason why its communication does not run.
    #[error("{0}")]
    Protocol(P),
    /// A good answer whose position must not be used.
    #[error("{0}")]
    Doubt(D),
}

#[cfg(test)]
mod tests {
    use super::Error;
    use core::convert::Infallible;
    use servowire_core::ClockError;
    use std::string::ToString;

    type Any = Error<(), (), &'static str, &'static str>;

    /// Of a UART, an SPI or an ASIC alike.
    #[test]
    fn texts_name_no_port_that_is_not_there() {
        let texts = [
            (Any::Io(()), "the port reports a fault"),
            (Any::Pin(()), "the direction pin reports a fault"),
            (Any::DriverLate { by_ns: 40 }, "the line driver went off up to 40 ns too late"),
            (Any::Closed, "the port is closed"),
            (Any::NeverQuiet, "the line does not go quiet"),
            (Any::Clock(ClockError::Backwards { by_ns: 40 }), "the clock went back by 40 ns"),
            (Any::Protocol("no answer"), "no answer"),
            (Any::Doubt("old"), "old"),
        ];
        for (error, text) in texts {
            assert_eq!(error.to_string(), text);
        }
    }

    #[test]
    fn errors_can_be_returned_by_main() {
        let error: &dyn core::error::Error = &Error::<(), Infallible, &str, Infallible>::NeverQuiet;
        assert_eq!(error.to_string(), "the line does not go quiet");
    }

    #[cfg(feature = "serde")]
    #[test]
    fn errors_are_data() {
        type Any = Error<u8, (), u16, u32>;
        for error in [Any::Io(1), Any::Closed, Any::Clock(ClockError::Stopped), Any::Protocol(2), Any::Doubt(3)] {
            let text = serde_json::to_string(&error).unwrap();
            assert_eq!(serde_json::from_str::<Any>(&text).unwrap(), error);
        }
    }
}
