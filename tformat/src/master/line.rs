use crate::timing::BitRate;

/// How a controller is connected and how long it waits.
///
/// The defaults come from known drivers and logs; see each field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Line {
    /// Bit rate.
    pub rate: BitRate,
    /// A hint that the receiver is enabled while the request is sent. It only makes failures more specific: an echo is
    /// recognised by its time and its content, regardless of this setting.
    pub echo: bool,
    /// Longest wait from the end of the request to the *start bit* of the response, in ns. Default 10 000: the nominal
    /// 3 us, 1 us for 100 m of cable, and margin.
    pub response_timeout_ns: u32,
    /// Longest time from the end of one field to the end of the next, in ns. Default one and a half field times.
    pub field_timeout_ns: u32,
    /// Shortest time from the end of the request to the start bit of the response, in ns: anything that begins earlier is not a
    /// response. Default four bits (1.6 or 0.8 us), the time for which one driver in use keeps the line driven after its
    /// request. It determines the [latency budget](Self::latency_budget_ns).
    pub turn_around_ns: u32,
    /// Longest time from the end of a byte on the line to its hand-over to the master, in ns: the interrupt latency, or the
    /// duration of a DMA block plus the time after which an idle line is reported. Default just below the turn-around plus one
    /// field, 5 599 or 2 799: an echo that comes so late is still recognised by its time.
    pub hand_over_ns: u32,
    /// Time for which the driver is enabled before the start bit of the request, in ns. Default 1 000, the minimum that one
    /// driver requires; TI's design manages with one bit.
    pub driver_lead_ns: u32,
    /// Time from the end of the request to the instant at which the encoder samples the position, in ns. No document says when
    /// that is; default 480, the instant that one driver assumes.
    pub sampling_ns: u32,
}

impl Line {
    /// A placeholder: the settings of a transaction that has not begun.
    pub(super) const NONE: Self = Self {
        rate: BitRate::Mbit2_5,
        echo: false,
        response_timeout_ns: 0,
        field_timeout_ns: 0,
        turn_around_ns: 0,
        hand_over_ns: 0,
        driver_lead_ns: 0,
        sampling_ns: 0,
    };

    /// Creates a line without echo and with the default times.
    pub const fn new(rate: BitRate) -> Self {
        let turn_around_ns = rate.bit_ns().saturating_mul(4);
        Self {
            rate,
            echo: false,
            response_timeout_ns: 10_000,
            field_timeout_ns: rate.bit_ns().saturating_mul(15),
            turn_around_ns,
            hand_over_ns: turn_around_ns.saturating_add(rate.fields_ns(1)).saturating_sub(1),
            driver_lead_ns: 1_000,
            sampling_ns: 480,
        }
    }

    servowire_core::builder! {
        with_echo: echo = true;
        with_response_timeout_ns: response_timeout_ns, u32;
        with_field_timeout_ns: field_timeout_ns, u32;
        with_turn_around_ns: turn_around_ns, u32;
        with_hand_over_ns: hand_over_ns, u32;
        with_driver_lead_ns: driver_lead_ns, u32;
        with_sampling_ns: sampling_ns, u32;
    }

    /// Returns whether a response is possible at all: it has to begin after the turn-around and before the time-out, and the
    /// time-out between fields must be no shorter than a field.
    pub const fn leaves_time(self) -> bool {
        self.turn_around_ns <= self.response_timeout_ns && self.field_timeout_ns >= self.rate.fields_ns(1)
    }

    /// By how much the end time passed to the master may lie after the end of the byte on the line, in ns: slightly less than
    /// the turn-around, 1.2 us at 2.5 Mbit/s and 0.6 us at 5 Mbit/s by default.
    ///
    /// If the end time is no later than that, no response is taken that began before the request had left the line or within
    /// one bit after it. A block may be handed over at any later time, as long as the master is told when it ended. The
    /// master's own request is recognised by its time until the turn-around and one field after its end.
    pub const fn latency_budget_ns(self) -> u32 {
        self.turn_around_ns.saturating_sub(self.rate.bit_ns())
    }
}
