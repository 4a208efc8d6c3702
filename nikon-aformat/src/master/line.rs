use crate::expected::Expected;
use crate::request::Request;
use crate::timing::{BitRate, FRAME_GAP_NS, REQUEST_GAP_NS};

/// How a controller is connected, and how long it waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Line {
    /// Bit rate.
    pub rate: BitRate,
    /// Idle time between two frames of a request, in ns. Default [`FRAME_GAP_NS`].
    pub frame_gap_ns: u32,
    /// Longest wait from the end of the request to the *start bit* of the response, in ns. The turn-around time is not
    /// documented; the default is 1000 bits, as one maker's master has it. Others wait 3 ms and 35 ms.
    pub response_timeout_ns: u32,
    /// Longest idle time between two frames of a response, in ns. Default four bits.
    pub idle_in_response_ns: u32,
    /// Longest idle time between two responses on a bus, in ns. Default twice [`BitRate::response_gap_ns`].
    pub idle_between_responses_ns: u32,
}

impl Line {
    /// A line with the default time-outs.
    pub const fn new(rate: BitRate) -> Self {
        Self {
            rate,
            frame_gap_ns: FRAME_GAP_NS,
            response_timeout_ns: rate.bits_ns(1000),
            idle_in_response_ns: rate.bits_ns(4),
            idle_between_responses_ns: rate.response_gap_ns().saturating_mul(2),
        }
    }

    /// The same with another wait for the response.
    pub const fn with_response_timeout_ns(self, response_timeout_ns: u32) -> Self {
        Self { response_timeout_ns, ..self }
    }

    /// Line time of a request in ns, its gaps included.
    pub fn request_ns(&self, request: Request) -> u32 {
        self.rate.bits_ns(request.emit().line_bits(self.rate.bits(self.frame_gap_ns)))
    }

    /// The time after which a transaction with `encoders` encoders is over in any case, in ns from its start.
    pub fn longest_ns(&self, request: Request, expected: &Expected, encoders: u8) -> u32 {
        let raw = self.rate.response_ns(expected.layout()).saturating_add(self.idle_in_response_ns);
        let raws = raw.saturating_add(self.idle_between_responses_ns).saturating_mul(encoders.into());
        self.request_ns(request).saturating_add(self.response_timeout_ns).saturating_add(raws)
    }

    /// Shortest period in which a request to `encoders` encoders can be repeated even if nobody answers, in ns: the
    /// longest transaction and [`REQUEST_GAP_NS`].
    pub fn min_cycle_ns(&self, request: Request, expected: &Expected, encoders: u8) -> u32 {
        self.longest_ns(request, expected, encoders).saturating_add(REQUEST_GAP_NS)
    }
}
