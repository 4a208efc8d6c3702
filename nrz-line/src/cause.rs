use crate::Window;

/// The most likely cause of damage to a refused message, insofar as the line alone can show it.
///
/// [`Search::find`] returns it; a protocol crate adds the causes that only its protocol can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// Every level is inverted: A and B are swapped, or the receiver's polarity is wrong.
    LineInverted,
    /// The response was taken `bits` bits too early (negative: too late), for example after a glitch at the turn-around.
    Shifted {
        /// Idle bits before the response; negative: bits of the response that are missing.
        bits: i8,
    },
    /// Bits are packed most significant first and were read least significant first, or the other way round.
    WrongBitOrder,
    /// The master's own request came back, followed by the response.
    OwnEcho,
    /// Only the master's own request came back: no encoder is connected, or A and B are swapped on a half-duplex line.
    OnlyEcho,
    /// The line was sampled twice per bit: the real rate is half of the assumed one.
    HalfRate,
    /// The line stays at 0: short circuit, driver stuck, or no supply.
    StuckLow,
    /// The line stays at 1: no encoder answers.
    StuckHigh,
    /// Only a check fails: single bits were disturbed.
    Disturbed,
}

servowire_core::one_line!(Cause {
    Self::LineInverted => "the line is inverted: exchange A and B, or the polarity of the input";
    Self::Shifted { bits } if *bits > 0 => "the response begins {} bit(s) later than it was taken", bits;
    Self::Shifted { bits } => "{} bit(s) at the beginning of the response are missing", bits.unsigned_abs();
    Self::WrongBitOrder => "the bits of each byte are in the other order";
    Self::OwnEcho => "our own request came back before the response: remove the echo";
    Self::OnlyEcho => "only our own request came back: no encoder, or A and B are exchanged";
    Self::HalfRate => "the line runs at half the assumed bit rate";
    Self::StuckLow => "the line stays at 0";
    Self::StuckHigh => "the line stays at 1: nobody answers";
    Self::Disturbed => "single bits were disturbed";
});

impl Cause {
    /// Returns whether the line never changed its level. A line without bits counts as silent.
    pub const fn stuck(line: Window) -> Option<Self> {
        if line.inverted().bits() == 0 {
            Some(Self::StuckHigh)
        } else if line.bits() == 0 {
            Some(Self::StuckLow)
        } else {
            None
        }
    }
}

/// Undoes the usual mistakes one by one, to find the one whose removal makes a refused message valid.
///
/// ```
/// use nrz_line::{Cause, Search, Window};
///
/// // a message of a start bit, four bits and a delimiter, which begins two bits late
/// let line = Window::from_bits(0b1_0110_0_11, 8).unwrap_or(Window::EMPTY);
/// let decode = |line: Window| (line.bits() & 0b10_0001 == 0b10_0000).then(|| line.bits() >> 1 & 0xf);
/// assert_eq!(decode(line), None);
/// let found = Search::new().with_late_bits(3).find(line, decode);
/// assert_eq!(found.map(|found| (found.cause, found.message)), Some((Cause::Shifted { bits: 2 }, Some(0b0110))));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Search {
    /// The master's own request, if it can come back.
    pub sent: Option<Window>,
    /// The maximum number of idle bits to look for before a message. Default 0.
    pub late_bits: u8,
    /// The maximum number of missing bits to look for at the beginning of a message; they are filled with 0. Default 0.
    pub early_bits: u8,
    /// A message that begins late is extended to this length with idle line. Default 0: it is not extended.
    pub complete_to: u32,
}

/// The result of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Found<T> {
    /// What is wrong with the line.
    pub cause: Cause,
    /// The message as it would be without that fault; `None` if the line carries no message.
    pub message: Option<T>,
}

impl Search {
    /// Creates a search for the mistakes that need no settings.
    pub const fn new() -> Self {
        Self { sent: None, late_bits: 0, early_bits: 0, complete_to: 0 }
    }

    servowire_core::builder! {
        with_sent: sent, Option<Window>;
        with_late_bits: late_bits, u8;
        with_early_bits: early_bits, u8;
        with_complete_to: complete_to, u32;
    }

    /// Returns the first mistake whose removal makes `decode` accept the line, in this order: inverted, other bit order, own
    /// echo, half the rate, late, early, and finally an echo followed by nothing.
    pub fn find<T>(&self, line: Window, decode: impl Fn(Window) -> Option<T>) -> Option<Found<T>> {
        let after_echo = self.after_echo(line);
        let attempts = [
            (Cause::LineInverted, Some(line.inverted())),
            (Cause::WrongBitOrder, Some(line.reordered())),
            (Cause::OwnEcho, after_echo),
            (Cause::HalfRate, halved(line)),
        ];
        for (cause, undone) in attempts {
            if let Some(message) = undone.and_then(&decode) {
                return Some(Found { cause, message: Some(message) });
            }
        }
        if let Some(found) = self.shifted(line, decode) {
            return Some(found);
        }
        after_echo.filter(|rest| rest.is_empty()).map(|_| Found { cause: Cause::OnlyEcho, message: None })
    }

    /// Returns what follows the master's own request and the idle line after it; nothing is left if no encoder answers.
    fn after_echo(&self, line: Window) -> Option<Window> {
        let sent = self.sent?;
        let rest = line.skip(sent.len())?;
        let same = Window::from_bits(line.bits(), sent.len()) == Some(sent);
        // The first 0 is the start bit of the response.
        if same { rest.skip(rest.bits().trailing_ones().min(rest.len())) } else { None }
    }

    /// Returns the message starting some bits later, or with the missing bits at its start filled in.
    fn shifted<T>(&self, line: Window, decode: impl Fn(Window) -> Option<T>) -> Option<Found<T>> {
        let found = |bits: i8, message| Found { cause: Cause::Shifted { bits }, message: Some(message) };
        for bits in 1..=self.late_bits.min(i8::MAX.unsigned_abs()) {
            let late = line.skip(bits.into()).and_then(|late| late.padded(self.complete_to));
            if let (Some(message), Ok(bits)) = (late.and_then(&decode), i8::try_from(bits)) {
                return Some(found(bits, message));
            }
        }
        for bits in 1..=self.early_bits.min(i8::MAX.unsigned_abs()) {
            let len = line.len().saturating_add(bits.into()).min(Window::MAX_LEN);
            let early = line.bits().checked_shl(bits.into()).and_then(|all| Window::from_bits(all, len));
            if let (Some(message), Ok(bits)) = (early.and_then(&decode), i8::try_from(bits)) {
                return Some(found(bits.wrapping_neg(), message));
            }
        }
        None
    }
}

impl Default for Search {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns every second bit, if the line shows each bit twice.
fn halved(line: Window) -> Option<Window> {
    let pairs = line.len() / 2;
    let first = Window::from_bits(line.decimated().bits(), pairs)?;
    let second = Window::from_bits(line.skip(1)?.decimated().bits(), pairs)?;
    if first == second { Some(first) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    /// A message of the tests: start bit 0, 18 bits that have to be these, delimiter 1.
    const CONTENT: u128 = 0b10_1100_1110_0001_0011;
    const LEN: u32 = 20;

    fn message() -> Window {
        Window::from_bits(CONTENT << 1 | 1 << 19, LEN).unwrap()
    }

    fn decode(line: Window) -> Option<u128> {
        (line.len() >= LEN && line.bits() & 0xf_ffff == message().bits()).then_some(CONTENT)
    }

    fn find(search: Search, line: Window) -> Option<(Cause, Option<u128>)> {
        search.find(line, decode).map(|found| (found.cause, found.message))
    }

    fn window(bits: u128, len: u32) -> Window {
        Window::from_bits(bits, len).unwrap()
    }

    #[test]
    fn each_mistake_is_undone() {
        let (line, bits) = (message(), message().bits());
        let doubled = (0..LEN).fold(0, |all, at| all | ((bits >> at & 1) * 3) << (2 * at));
        let whole = Some(CONTENT);
        assert_eq!(find(Search::new(), line.inverted()), Some((Cause::LineInverted, whole)));
        let reordered = window(bits | 0xf << 20, 24).reordered();
        assert_eq!(find(Search::new(), reordered), Some((Cause::WrongBitOrder, whole)));
        assert_eq!(find(Search::new(), window(doubled, 2 * LEN)), Some((Cause::HalfRate, whole)));
        assert_eq!(find(Search::new(), window(doubled ^ 1, 2 * LEN)), None);
        assert_eq!(find(Search::new(), Window::EMPTY), None);
        assert_eq!(find(Search::default(), line.inverted()), Some((Cause::LineInverted, whole)));
    }

    #[test]
    fn shifts_are_found_as_far_as_is_asked() {
        let bits = message().bits();
        let search = Search::new().with_late_bits(3).with_early_bits(1);
        for late in 1..=4_u32 {
            let want = (late < 4).then_some((Cause::Shifted { bits: late as i8 }, Some(CONTENT)));
            assert_eq!(find(search, window(bits << late | ((1 << late) - 1), LEN + late)), want);
        }
        assert_eq!(find(search, message().skip(1).unwrap()), Some((Cause::Shifted { bits: -1 }, Some(CONTENT))));
        assert_eq!(find(search, message().skip(2).unwrap()), None);
        // Without a limit of one's own as far as the number goes.
        let far = Search::new().with_late_bits(u8::MAX).with_early_bits(u8::MAX);
        let late = window(bits << 100 | ((1 << 100) - 1), LEN + 100);
        assert_eq!(find(far, late), Some((Cause::Shifted { bits: 100 }, Some(CONTENT))));
        let none = Search::new();
        assert_eq!(find(none, window(bits << 1 | 1, LEN + 1)), None);
        assert_eq!(find(none, message().skip(1).unwrap()), None);
        // Its delimiter is beyond the end of what was taken.
        let cut = window(bits << 1 | 1, LEN);
        assert_eq!(find(search, cut), None);
        assert_eq!(find(search.with_complete_to(LEN), cut), Some((Cause::Shifted { bits: 1 }, Some(CONTENT))));
    }

    #[test]
    fn an_echo_with_and_without_an_answer() {
        let sent = window(0b10_0110, 6);
        let search = Search::new().with_sent(Some(sent));
        for idle in [0, 1, 7] {
            let front = sent.bits() | ((1 << idle) - 1) << 6;
            let line = window(front | message().bits() << (6 + idle), 6 + idle + LEN);
            assert_eq!(find(search, line), Some((Cause::OwnEcho, Some(CONTENT))));
            assert_eq!(find(search, window(front, 6 + idle)), Some((Cause::OnlyEcho, None)));
        }
        assert_eq!(find(search, window(sent.bits() ^ 2, 6)), None);
        assert_eq!(find(search, sent.skip(1).unwrap()), None);
    }

    #[test]
    fn a_line_that_does_not_move() {
        assert_eq!(Cause::stuck(window(0, 30)), Some(Cause::StuckLow));
        assert_eq!(Cause::stuck(window(u128::MAX, 30)), Some(Cause::StuckHigh));
        assert_eq!(Cause::stuck(Window::EMPTY), Some(Cause::StuckHigh));
        assert_eq!(Cause::stuck(message()), None);
    }

    #[test]
    fn causes_are_sentences() {
        let text = Cause::Shifted { bits: 3 }.to_string();
        assert_eq!(text, "the response begins 3 bit(s) later than it was taken");
        let text = Cause::Shifted { bits: -2 }.to_string();
        assert_eq!(text, "2 bit(s) at the beginning of the response are missing");
    }

    proptest! {
        /// Whatever is on the line, the search ends, and a message in it is one that was decoded.
        #[test]
        fn any_line(bits: u128, len in 0..=128_u32, late: u8, early: u8, complete: u32, sent: u128, sent_len in 0..=128_u32) {
            let search = Search::new().with_late_bits(late).with_early_bits(early).with_complete_to(complete)
                .with_sent(Some(window(sent, sent_len)));
            if let Some((cause, message)) = find(search, window(bits, len)) {
                prop_assert_eq!(message.is_none(), cause == Cause::OnlyEcho);
            }
        }
    }
}
