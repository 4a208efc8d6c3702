use crate::bus::Addresses;
use crate::expected::Expected;
use crate::layout::{FRAME_BITS, Layout};
use crate::number::EncoderAddress;
use crate::request::Request;
use crate::timing::{BitRate, FRAME_GAP_NS, REQUEST_GAP_NS};

/// How a controller is connected and how long it waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Line {
    /// Bit rate.
    pub rate: BitRate,
    /// Idle time between two frames of a request, in ns. Default [`FRAME_GAP_NS`].
    pub frame_gap_ns: u32,
    /// Shortest time from the end of the request to the *start bit* of the response, in ns: anything that begins earlier is
    /// not an answer. Default 0, because the turn-around time is not documented.
    pub turn_around_ns: u32,
    /// Longest time from the end of the request to the *start bit* of the response, in ns. Default 1000 bits, as in one maker's
    /// master. Others wait 3 ms and 35 ms.
    pub response_timeout_ns: u32,
    /// Longest idle time between two frames of a response, in ns. Default a quarter of [`BitRate::response_gap_ns`].
    pub idle_in_response_ns: u32,
    /// Longest idle time between two responses on a bus, in ns. Default twice [`BitRate::response_gap_ns`].
    pub idle_between_responses_ns: u32,
    /// Longest time from the end of a frame on the line to its hand-over to the master, if the hand-over is taken as its
    /// end, in ns: the [latency budget](Self::latency_budget_ns). A response that begins sooner than this after the request
    /// is not taken, because it may have begun before it.
    ///
    /// Default a quarter of [`BitRate::response_gap_ns`], 375 ns to 750 ns, which is below seven bits, the turn-around time of
    /// one vendor's simulated encoder.
    pub hand_over_ns: u32,
    /// Shortest time from the end of a transaction to the next request, in ns. Default [`REQUEST_GAP_NS`].
    pub request_gap_ns: u32,
    /// The highest address on the line, requested or not. The meaning of EA in a multi-response request is not documented, so
    /// encoders that were not requested may answer; the line is free when this address can no longer answer. Default 7.
    pub highest: EncoderAddress,
}

impl Line {
    /// Creates a line with the default time-outs.
    pub const fn new(rate: BitRate) -> Self {
        let gap_ns = rate.response_gap_ns();
        Self {
            rate,
            frame_gap_ns: FRAME_GAP_NS,
            turn_around_ns: 0,
            response_timeout_ns: rate.bits_ns(1000),
            idle_in_response_ns: gap_ns / 4,
            idle_between_responses_ns: gap_ns.saturating_mul(2),
            hand_over_ns: gap_ns / 4,
            request_gap_ns: REQUEST_GAP_NS,
            highest: EncoderAddress::MAX,
        }
    }

    servowire_core::builder! {
        with_frame_gap_ns: frame_gap_ns, u32;
        with_turn_around_ns: turn_around_ns, u32;
        with_response_timeout_ns: response_timeout_ns, u32;
        with_idle_in_response_ns: idle_in_response_ns, u32;
        with_idle_between_responses_ns: idle_between_responses_ns, u32;
        with_hand_over_ns: hand_over_ns, u32;
        with_request_gap_ns: request_gap_ns, u32;
        with_highest: highest, EncoderAddress;
    }

    /// By how much the end time passed to the master may lie after the end of a frame on the line, in ns. Frames may be handed
    /// over at any later time, as long as the master is told when they ended.
    pub const fn latency_budget_ns(&self) -> u32 {
        self.hand_over_ns
    }

    /// Line time of a request in ns, including its gaps.
    pub const fn request_ns(&self, request: Request) -> u32 {
        self.rate.bits_ns(request.emit().line_bits(self.rate.bits(self.frame_gap_ns)))
    }

    /// Longest line time of a response in ns, including idle time between its frames.
    pub const fn response_ns(&self, layout: Layout) -> u32 {
        let gaps = (layout.frames() as u32).saturating_sub(1);
        self.rate.response_ns(layout).saturating_add(self.idle_in_response_ns.saturating_mul(gaps))
    }

    /// Time from the end of a request until no answer to it can be on the line any more, in ns.
    ///
    /// For a multi-response request this covers the slots up to that of [`highest`](Self::highest), however many encoders are
    /// requested.
    pub const fn answered_ns(&self, expected: &Expected) -> u32 {
        let response = self.response_ns(expected.layout());
        let before = if expected.command().is_multi_response() { self.highest.get() as u32 } else { 0 };
        let others = response.saturating_add(self.idle_between_responses_ns).saturating_mul(before);
        self.response_timeout_ns
            .saturating_add(others)
            .saturating_add(response)
            .saturating_add(self.latency_budget_ns())
    }

    /// Returns when the last answer to a multi-response request will have ended, in ns, if these addresses have been heard, the
    /// last one until `end_ns`, and every other address up to [`highest`](Self::highest) may still have its turn.
    pub(super) const fn silent_ns(&self, expected: &Expected, heard: Addresses, end_ns: u64) -> u64 {
        let others = Addresses::first(self.highest.get().saturating_add(1)).without(heard).len();
        if others == 0 {
            return end_ns;
        }
        let turn_ns = self.response_ns(expected.layout()).saturating_add(self.idle_between_responses_ns);
        let turns_ns = turn_ns.saturating_mul(others as u32).saturating_add(self.latency_budget_ns());
        end_ns.saturating_add(turns_ns as u64)
    }

    /// Returns whether a response can be taken at all: it has to begin, by its time stamps, after the turn-around and before the
    /// time-out.
    pub(super) const fn leaves_time(&self) -> bool {
        self.early_ns() <= self.response_timeout_ns as u64
    }

    /// The time after which a transaction has ended in any case, in ns from its start.
    pub const fn longest_ns(&self, request: Request, expected: &Expected) -> u32 {
        self.request_ns(request).saturating_add(self.answered_ns(expected))
    }

    /// Shortest period in which a request can be repeated even if no encoder answers, in ns: the longest transaction plus
    /// [`request_gap_ns`](Self::request_gap_ns).
    pub const fn min_cycle_ns(&self, request: Request, expected: &Expected) -> u32 {
        self.longest_ns(request, expected).saturating_add(self.request_gap_ns)
    }

    /// Line time of a frame in ns, an integer at every rate.
    pub(super) const fn frame_ns(&self) -> u64 {
        self.rate.bits_ns(FRAME_BITS) as u64
    }

    /// How much later than the end of the request a frame has to begin, by its time stamp, to be certainly an answer, in ns.
    pub(super) const fn early_ns(&self) -> u64 {
        (if self.turn_around_ns > self.latency_budget_ns() { self.turn_around_ns } else { self.latency_budget_ns() })
            as u64
    }

    /// Idle time, by the time stamps, after which two frames do not belong together, in ns.
    pub(super) const fn pause_ns(&self) -> u64 {
        self.idle_in_response_ns.saturating_add(self.latency_budget_ns()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operation::Operation;
    use crate::resolution::Resolution;

    /// The numbers of the sources, and those of this crate that follow from them.
    #[test]
    fn defaults() {
        let line = |rate| Line::new(rate);
        let all = BitRate::ALL.map(line);
        assert_eq!(all.map(|line| line.frame_gap_ns), [1_000; 5]);
        assert_eq!(all.map(|line| line.response_timeout_ns), [400_000, 250_000, 150_000, 125_000, 62_500]);
        assert_eq!(all.map(|line| line.idle_between_responses_ns), [6_000, 4_000, 4_000, 3_000, 3_000]);
        assert_eq!(all.map(|line| line.hand_over_ns), [750, 500, 500, 375, 375]);
        assert_eq!(all.map(|line| line.idle_in_response_ns), [750, 500, 500, 375, 375]);
        assert_eq!(all.map(|line| (line.turn_around_ns, line.request_gap_ns, line.highest.get())), [(0, 10_000, 7); 5]);
    }

    /// Frames of one response and of two are told apart by their stamps, however late each is within the budget.
    #[test]
    fn the_budget_leaves_the_gap_of_a_bus_visible() {
        for line in BitRate::ALL.map(Line::new) {
            assert!(line.pause_ns() < u64::from(line.rate.response_gap_ns() - line.hand_over_ns));
            assert!(line.hand_over_ns < line.rate.bits_ns(7));
        }
    }

    /// 18 bits and the gaps of a request, 72 bits of a response, 1000 bits of waiting, at 16 Mbit/s.
    #[test]
    fn times_of_a_transaction() {
        let line = Line::new(BitRate::Mbit16).with_idle_in_response_ns(0).with_hand_over_ns(0);
        let of = |operation| Request::new(EncoderAddress::ZERO, operation);
        let (one, all) = (of(Operation::Abs40), of(Operation::Abs40Mt));
        let expected = |request: Request| request.expected(Resolution::default());
        assert_eq!(line.request_ns(one), 1_125);
        // Two frames and 16 bits between them.
        assert_eq!(line.request_ns(of(Operation::EepromRead { address: 0 })), 3_250);
        let gapless = line.with_frame_gap_ns(0);
        assert_eq!(gapless.request_ns(of(Operation::EepromRead { address: 0 })), 2_250);
        assert_eq!(line.longest_ns(one, &expected(one)), 1_125 + 62_500 + 4_500);
        assert_eq!(line.min_cycle_ns(one, &expected(one)), 1_125 + 62_500 + 4_500 + 10_000);
        assert_eq!(line.longest_ns(all, &expected(all)), 1_125 + 62_500 + 8 * 4_500 + 7 * 3_000);
        let two = line.with_highest(EncoderAddress::truncate(1));
        assert_eq!(two.longest_ns(all, &expected(all)), 1_125 + 62_500 + 2 * 4_500 + 3_000);
        let idle = line.with_idle_in_response_ns(100);
        assert_eq!(idle.longest_ns(one, &expected(one)), 1_125 + 62_500 + 4_800);
        assert_eq!(idle.with_hand_over_ns(50).longest_ns(one, &expected(one)), 1_125 + 62_500 + 4_850);
        assert_eq!((line.with_turn_around_ns(9).early_ns(), line.with_hand_over_ns(7).early_ns()), (9, 7));
    }
}
