//! Several encoders answering one request.
//!
//! ```text
//!  line, time →   request | response of encoder 0 | gap | response of encoder 1 | gap | ...
//! ```
//!
//! The encoders send their responses one after the other, each with its own CRC-8. All known masters assume ascending order, but
//! no document says so; a response is therefore assigned to the encoder that its information field names. A response that is
//! missing, damaged, duplicated or unrequested is reported and affects no other response.
//!
//! ```
//! use nikon_aformat::bus::{Addresses, Outcome, Bus};
//! use nikon_aformat::{Command, Data, EncoderAddress, EncoderStatus, Expected, Layout, Response, U24};
//!
//! let [first, second, ..] = EncoderAddress::ALL;
//! let mut bus = Bus::new(Expected::new(Layout::Abs24, Command::Abs24LowMt), Addresses::first(2));
//! let data = Data::Abs24 { abs: U24::truncate(77) };
//! let raw = Response::new(first, Command::Abs24LowMt, EncoderStatus::empty(), data);
//! bus.push(Ok(raw.emit()));
//! assert_eq!(bus.of(first), Outcome::Good(raw));
//! assert_eq!(bus.of(second), Outcome::Missing);
//! ```

use nrz_line::BitOrder;

use crate::abs40::Abs40;
use crate::data::Data;
use crate::error::Error;
use crate::expected::Expected;
use crate::number::EncoderAddress;
use crate::raw_response::RawResponse;
use crate::response::Response;

/// A set of encoder addresses. It is displayed as a list: `0 2 7`, or `-` for the empty set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Addresses(u8);

impl Addresses {
    /// No address.
    pub const NONE: Self = Self(0);

    /// All eight.
    pub const ALL: Self = Self(0xff);

    /// Creates a set from its bits, address 0 in bit 0.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Returns the bits, address 0 in bit 0.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Creates a set of the `count` lowest addresses; all eight if `count` is above 7.
    pub const fn first(count: u8) -> Self {
        match 1_u8.checked_shl(count as u32) {
            Some(bit) => Self(bit.wrapping_sub(1)),
            None => Self::ALL,
        }
    }

    /// Returns whether the address is in the set.
    pub const fn contains(self, ea: EncoderAddress) -> bool {
        self.0 >> ea.get() & 1 == 1
    }

    /// Adds an address.
    pub const fn with(self, ea: EncoderAddress) -> Self {
        Self(self.0 | 1_u8.wrapping_shl(ea.get() as u32))
    }

    /// Removes the addresses of another set.
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// The number of addresses.
    #[expect(clippy::cast_possible_truncation, reason = "at most 8")]
    pub const fn len(self) -> u8 {
        self.0.count_ones() as u8
    }

    /// Returns whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The highest address.
    #[expect(clippy::cast_possible_truncation, reason = "at most 7")]
    pub const fn highest(self) -> Option<EncoderAddress> {
        match self.0.checked_ilog2() {
            Some(bit) => EncoderAddress::new(bit as u8),
            None => None,
        }
    }

    /// Iterates over the addresses in ascending order.
    pub fn iter(self) -> impl Iterator<Item = EncoderAddress> {
        EncoderAddress::ALL.into_iter().filter(move |ea| self.contains(*ea))
    }
}

servowire_core::listed!(Addresses { |addresses| addresses.iter() => "{}" });

/// What arrived from one address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Outcome {
    /// No good response came, and none was requested.
    NotAsked,
    /// One good response came.
    Good(Response),
    /// A good response came from an address that was not requested.
    Extra(Response),
    /// Two or more good responses came: two encoders have the same address, or one has been given the wrong address.
    Duplicate {
        /// The first of them.
        first: Response,
    },
    /// No good response came. If damaged responses came, one of them may have come from this encoder: see [`Bus::damaged`].
    Missing,
}

servowire_core::one_line!(Outcome {
    Self::NotAsked => "not asked";
    Self::Good(response) => "{}", response;
    Self::Extra(response) => "not asked: {}", response;
    Self::Duplicate { first } => "more than one: {}", first;
    Self::Missing => "missing";
});

/// How one response was judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Verdict {
    /// The response with all checks passed, or why it was refused.
    pub outcome: Result<Response, Error>,
    /// Whether a good response from this address came before.
    pub duplicate: bool,
    /// Whether this address was not requested.
    pub extra: bool,
}

/// The responses to one multi-response request, as they arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bus {
    expected: Expected,
    asked: Addresses,
    good: [Option<Response>; 8],
    heard: Addresses,
    doubled: Addresses,
    /// Number of good responses from addresses that had already been heard.
    repeated: u8,
    damaged: u8,
}

impl Bus {
    /// What is expected of each response.
    pub const fn expected(&self) -> &Expected {
        &self.expected
    }

    /// Expects responses of this kind from these addresses.
    pub const fn new(expected: Expected, asked: Addresses) -> Self {
        let expected = expected.any_address();
        Self {
            expected,
            asked,
            good: [None; 8],
            heard: Addresses::NONE,
            doubled: Addresses::NONE,
            repeated: 0,
            damaged: 0,
        }
    }

    /// Takes a response that has arrived, or the fault of one that was cut off or broken.
    pub fn push(&mut self, raw: Result<RawResponse, Error>) -> Verdict {
        self.take(raw.and_then(|raw| Response::parse(&self.expected, &raw)))
    }

    /// Takes a response as words, each with the content bits of one frame.
    #[inline(always)]
    pub fn push_words(&mut self, words: &[u16], order: BitOrder) -> Verdict {
        self.take(Response::parse_words(&self.expected, words, order))
    }

    /// Takes the words of a response that [`Abs40`] decodes, for a bus on which only positions are requested: it takes less
    /// flash than [`push_words`](Self::push_words), which knows all layouts.
    #[inline(always)]
    pub fn push_abs40(&mut self, words: &[u16], order: BitOrder) -> Verdict {
        let outcome = Abs40::parse_words(&self.expected, words, order);
        let command = self.expected.command();
        self.take(outcome.map(|Abs40 { ea, es, abs }| Response::new(ea, command, es, Data::Abs40 { abs })))
    }

    /// Takes a response that has already been judged.
    #[inline(always)]
    pub(crate) fn take(&mut self, outcome: Result<Response, Error>) -> Verdict {
        let (mut duplicate, mut extra) = (false, false);
        match outcome {
            Ok(response) => {
                extra = !self.asked.contains(response.ea);
                duplicate = self.heard.contains(response.ea);
                if duplicate {
                    self.repeated = self.repeated.saturating_add(1);
                    self.doubled = self.doubled.with(response.ea);
                } else if let Some(place) = self.good.get_mut(usize::from(response.ea.get() & 7)) {
                    *place = Some(response);
                    self.heard = self.heard.with(response.ea);
                }
            }
            Err(_) => self.damaged = self.damaged.saturating_add(1),
        }
        Verdict { outcome, duplicate, extra }
    }

    /// Withdraws the good response of this address: it was made up of frames of two responses, with a CRC-8 that was right by
    /// chance.
    pub(crate) fn withdraw(&mut self, ea: EncoderAddress) {
        if let Some(place) = self.good.get_mut(usize::from(ea.get() & 7)) {
            *place = None;
            self.heard = self.heard.without(Addresses::NONE.with(ea));
            self.damaged = self.damaged.saturating_add(1);
        }
    }

    /// What arrived from this address.
    pub fn of(&self, ea: EncoderAddress) -> Outcome {
        match self.good.get(usize::from(ea.get())).copied().flatten() {
            Some(first) if self.doubled.contains(ea) => Outcome::Duplicate { first },
            Some(response) if self.asked.contains(ea) => Outcome::Good(response),
            Some(response) => Outcome::Extra(response),
            None if self.asked.contains(ea) => Outcome::Missing,
            None => Outcome::NotAsked,
        }
    }

    /// Returns the good response of this address, if there is exactly one and it was requested.
    pub fn response(&self, ea: EncoderAddress) -> Option<Response> {
        match self.of(ea) {
            Outcome::Good(response) => Some(response),
            _ => None,
        }
    }

    /// The addresses that were requested.
    pub const fn asked(&self) -> Addresses {
        self.asked
    }

    /// The addresses that sent a good response, requested or not.
    pub(crate) const fn heard(&self) -> Addresses {
        self.heard
    }

    /// The addresses that were requested and sent no good response.
    pub const fn missing(&self) -> Addresses {
        self.asked.without(self.heard)
    }

    /// The addresses that sent two or more good responses.
    pub const fn duplicates(&self) -> Addresses {
        self.doubled
    }

    /// The addresses that sent a good response but were not requested.
    pub const fn extra(&self) -> Addresses {
        self.heard.without(self.asked)
    }

    /// Number of responses that arrived, good or not.
    pub const fn arrived(&self) -> u8 {
        self.heard.len().saturating_add(self.repeated).saturating_add(self.damaged)
    }

    /// Number of responses that were refused; their addresses cannot be trusted.
    pub const fn damaged(&self) -> u8 {
        self.damaged
    }

    /// The number of requested responses minus the number that arrived, good or not: this many never started.
    pub const fn not_started(&self) -> u8 {
        self.asked.len().saturating_sub(self.arrived())
    }

    /// Returns whether every requested address has sent a good response.
    pub(crate) const fn heard_all(&self) -> bool {
        self.missing().is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::data::Data;
    use crate::layout::Layout;
    use crate::status::EncoderStatus;
    use proptest::prelude::*;
    use servowire_core::U24;
    use std::string::ToString;

    const COMMAND: Command = Command::Abs24LowMt;

    fn response(ea: u8, abs: u32) -> Response {
        let data = Data::Abs24 { abs: U24::truncate(abs) };
        Response::new(EncoderAddress::truncate(ea), COMMAND, EncoderStatus::empty(), data)
    }

    fn bus(asked: Addresses) -> Bus {
        Bus::new(Expected::new(Layout::Abs24, COMMAND), asked)
    }

    #[test]
    fn address_sets() {
        assert_eq!(Addresses::first(0), Addresses::NONE);
        assert_eq!(
            (Addresses::first(3).bits(), Addresses::first(8), Addresses::first(9)),
            (7, Addresses::ALL, Addresses::ALL)
        );
        assert_eq!(Addresses::first(3).with(EncoderAddress::truncate(1)), Addresses::first(3));
        assert_eq!(Addresses::from_bits(0b1000_0101).to_string(), "0 2 7");
        assert_eq!(Addresses::NONE.to_string(), "-");
        assert_eq!((Addresses::NONE.highest(), Addresses::first(5).highest()), (None, EncoderAddress::new(4)));
    }

    #[test]
    fn missing_doubled_damaged_and_uncalled_for() {
        let mut bus = bus(Addresses::first(4));
        let [a0, a1, a2, _, _, a5, a6, _] = EncoderAddress::ALL;
        assert_eq!(bus.push(Ok(response(0, 1).emit())).outcome, Ok(response(0, 1)));
        assert!(bus.push(Ok(response(5, 2).emit())).extra);
        assert!(!bus.heard_all());
        let mut damaged = response(1, 3).emit().words(crate::BitOrder::LsbFirst).collect::<std::vec::Vec<_>>();
        damaged[1] ^= 1;
        let damaged = RawResponse::from_words(Layout::Abs24, &damaged, crate::BitOrder::LsbFirst);
        assert!(matches!(bus.push(damaged).outcome, Err(Error::Crc { .. })));
        let twice = bus.push(Ok(response(0, 9).emit()));
        assert!(twice.duplicate && twice.outcome == Ok(response(0, 9)));
        // As many responses as were asked for, and two of them are still missing.
        assert!(!bus.heard_all());
        assert_eq!(bus.of(a0), Outcome::Duplicate { first: response(0, 1) });
        assert_eq!((bus.response(a0), bus.of(a1), bus.of(a2)), (None, Outcome::Missing, Outcome::Missing));
        assert_eq!((bus.of(a5), bus.of(a6)), (Outcome::Extra(response(5, 2)), Outcome::NotAsked));
        assert_eq!(bus.missing().bits(), 0b1110);
        assert_eq!((bus.duplicates().bits(), bus.extra().bits()), (1, 0b10_0000));
        assert_eq!((bus.arrived(), bus.damaged(), bus.not_started()), (4, 1, 0));
    }

    proptest! {
        /// In whatever order responses come, each is found under its own address.
        #[test]
        fn order_does_not_matter(asked: u8, order in Just([0_u8, 1, 2, 3, 4, 5, 6, 7]).prop_shuffle()) {
            let mut bus = bus(Addresses::from_bits(asked));
            for (turn, ea) in order.into_iter().filter(|ea| asked >> ea & 1 == 1).enumerate() {
                prop_assert!(!bus.heard_all());
                let raw = response(ea, u32::from(ea) * 1000).emit();
                if turn % 2 == 0 {
                    bus.push(Ok(raw));
                } else {
                    bus.push_words(raw.contents(), BitOrder::LsbFirst);
                }
            }
            prop_assert!(bus.heard_all() && bus.missing().is_empty() && bus.extra().is_empty());
            for ea in bus.asked().iter() {
                prop_assert_eq!(bus.response(ea), Some(response(ea.get(), u32::from(ea.get()) * 1000)));
            }
        }
    }
}
