use super::reset::mismatch;
use super::{Line, Step};
use crate::error::Error;
use crate::message::AllData;
use crate::request::Request;
use crate::response::Response;
use crate::timing::BitRate;

/// Finds the encoder after power-on: waits, asks for ID 3 at 5 Mbit/s, and falls back to 2.5 Mbit/s.
///
/// The rate is not on the wire, and an encoder does not answer at the wrong one. Use [`line`](Self::line) for each transaction,
/// because the rate changes between them. The result is the first sound response; its rate is then that of `line`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Detection {
    /// The line that is tried first, and the other one.
    lines: [Line; 2],
    second: bool,
    tries: u8,
}

impl Detection {
    /// The time from power-on to the first request.
    pub const POWER_ON_WAIT_NS: u64 = 1_500_000_000;
    /// The number of requests at each rate.
    const TRIES: u8 = 3;

    /// Tries 5 Mbit/s, then 2.5 Mbit/s, with the defaults of [`Line::new`].
    pub const fn new() -> Self {
        Self::on([Line::new(BitRate::Mbit5), Line::new(BitRate::Mbit2_5)])
    }

    /// Tries these two lines, in this order, for a host that hands over in blocks, or for a longer cable.
    pub const fn on(lines: [Line; 2]) -> Self {
        Self { lines, second: false, tries: 0 }
    }

    /// Returns the line for the next transaction, and once the encoder has been found, its line.
    pub const fn line(&self) -> Line {
        let [first, second] = self.lines;
        if self.second { second } else { first }
    }

    /// Returns the first request. `power_on_ns` is when the supply was switched on, in ns.
    pub const fn start(&mut self, power_on_ns: u64) -> Step<AllData> {
        *self = Self::on(self.lines);
        let not_before_ns = power_on_ns.saturating_add(Self::POWER_ON_WAIT_NS);
        Step::Send { request: Request::ReadAll, not_before_ns }
    }

    /// Takes the outcome of a transaction; the line is free from `ready_ns`.
    pub fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<AllData> {
        let error = match outcome {
            Ok(Response::ReadAll(value)) => return Step::Done { value, ready_ns },
            Ok(other) => mismatch(other, Request::ReadAll),
            Err(error) => error,
        };
        // A slow encoder may take a fast request for a damaged one and answer at its own rate, in twice the time.
        let slow_ns = match self.line().rate {
            BitRate::Mbit5 => BitRate::Mbit5.fields_ns(11).into(),
            BitRate::Mbit2_5 => 0,
        };
        let ready_ns = ready_ns.saturating_add(slow_ns);
        self.tries = self.tries.saturating_add(1);
        if self.tries >= Self::TRIES {
            if self.second {
                return Step::Failed { error, ready_ns };
            }
            self.second = true;
            self.tries = 0;
        }
        Step::Send { request: Request::ReadAll, not_before_ns: ready_ns }
    }
}

impl Default for Detection {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const LOST: Result<Response, Error> = Err(Error::NoResponse { echo: false });

    /// 1.5 s after power-on, 5 Mbit/s first, then 2.5 Mbit/s.
    #[test]
    fn the_fast_rate_is_tried_first() {
        let mut detection = Detection::new();
        let mut step = detection.start(7);
        let mut seen = Vec::new();
        while let Step::Send { not_before_ns, .. } = step {
            seen.push((detection.line().rate, not_before_ns));
            step = detection.receive(LOST, not_before_ns + 100_000);
        }
        let (fast, slow, begin) = (BitRate::Mbit5, BitRate::Mbit2_5, 1_500_000_007);
        let want = [
            (fast, begin),
            (fast, begin + 122_000),
            (fast, begin + 244_000),
            (slow, begin + 366_000),
            (slow, begin + 466_000),
            (slow, begin + 566_000),
        ];
        assert_eq!(seen, want);
        assert!(matches!(step, Step::Failed { error: Error::NoResponse { .. }, .. }));
    }

    /// A host that hands over a block when the line has been idle for 20 us, and has 30 m more of cable.
    #[test]
    fn the_lines_are_those_of_the_host() {
        let [fast, slow] = [BitRate::Mbit5, BitRate::Mbit2_5]
            .map(|rate| Line::new(rate).with_hand_over_ns(90_000).with_turn_around_ns(500));
        let mut detection = Detection::on([slow, fast]);
        let mut seen = Vec::new();
        let mut step = detection.start(0);
        while let Step::Send { not_before_ns, .. } = step {
            seen.push(detection.line());
            step = detection.receive(LOST, not_before_ns);
        }
        assert_eq!(seen, [slow, slow, slow, fast, fast, fast]);
        let _ = detection.start(0);
        assert_eq!(detection.line(), slow);
    }

    #[test]
    fn the_rate_that_answers_stays() {
        let data = AllData::parse(&[0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37]).unwrap();
        for lost in 0..6 {
            let mut detection = Detection::default();
            let _ = detection.start(0);
            for _ in 0..lost {
                let _ = detection.receive(LOST, 0);
            }
            assert_eq!(detection.receive(Ok(Response::ReadAll(data)), 5), Step::Done { value: data, ready_ns: 5 });
            assert_eq!(detection.line().rate, if lost < 3 { BitRate::Mbit5 } else { BitRate::Mbit2_5 });
        }
    }
}
