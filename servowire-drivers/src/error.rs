use servowire_core::ClockError;

/// Why a call failed. `IO` is the error of the port (a UART, an SPI, the bus of an ASIC), `PIN` that of the direction pin, `P` that of the protocol, and
/// `D` its doubts about a position.
///
/// After any of them the next call begins with a clean line: it waits until nobody can be talking any more and throws away
/// what has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Error<IO, PIN, P, D> {
    /// The port reports a fault: of a UART noise, framing or overrun. The exchange is lost.
    #[error("the port reports a fault")]
    Io(IO),
    /// The direction pin does.
    #[error("the direction pin reports a fault")]
    Pin(PIN),
    /// The UART takes or gives no bytes any more.
    #[error("the UART is closed")]
    Closed,
    /// Somebody talks without a pause; nothing was sent.
    #[error("the line does not become quiet")]
    NeverQuiet,
    /// The clock stands, or was set back; whether a request that had begun had its effect is not known.
    #[error("{0}")]
    Clock(#[from] ClockError),
    /// No answer, or one that was refused.
    #[error("{0}")]
    Protocol(P),
    /// A good answer whose position must not be used.
    #[error("{0}")]
    Doubt(D),
}
