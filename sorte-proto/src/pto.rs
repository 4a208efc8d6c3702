use servowire_core::OutOfRange;

use crate::error::Error;

servowire_core::codes! {
    /// Level of the DIR output of an axis, bit 15 of the PTO word.
    #[derive(Default)]
    pub enum Direction: u8 {
        /// DIR = 0.
        #[default]
        Low = 0 => "DIR 0",
        /// DIR = 1.
        High = 1 => "DIR 1",
    }
}

impl Direction {
    /// Returns whether DIR is high.
    pub const fn is_high(self) -> bool {
        matches!(self, Self::High)
    }

    const fn sign(self) -> &'static str {
        if self.is_high() { "-" } else { "+" }
    }

    const fn of(word: u16) -> Self {
        if word & DIR == 0 { Self::Low } else { Self::High }
    }

    const fn bit(self) -> u16 {
        match self {
            Self::Low => 0,
            Self::High => DIR,
        }
    }
}

/// When the pulse starts: nanoseconds after the start of the next cycle, 1..=3990.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u16", into = "u16"))]
pub struct StartTime(u16);

impl StartTime {
    /// The earliest start the wire can carry.
    pub const MIN: Self = Self(1);
    /// The latest start the wire can carry.
    pub const MAX: Self = Self(3990);

    /// Returns the start time, or `None` if `ns` is outside 1..=3990.
    pub const fn new(ns: u16) -> Option<Self> {
        if ns >= Self::MIN.0 && ns <= Self::MAX.0 { Some(Self(ns)) } else { None }
    }

    /// Returns the nearest start time that the wire can carry: 1 for 0, and 3990 for anything above it.
    pub const fn truncate(ns: u16) -> Self {
        match Self::new(ns) {
            Some(start) => start,
            None if ns == 0 => Self::MIN,
            None => Self::MAX,
        }
    }

    /// Nanoseconds after the start of the cycle.
    pub const fn ns(self) -> u16 {
        self.0
    }

    /// Whole 5 ns ticks in it, 0..=798: what the SYNC0 START register takes.
    pub const fn ticks(self) -> u16 {
        self.0 / 5
    }
}

impl TryFrom<u16> for StartTime {
    type Error = OutOfRange;

    fn try_from(ns: u16) -> Result<Self, OutOfRange> {
        let limit = if ns == 0 { Self::MIN } else { Self::MAX };
        Self::new(ns).ok_or_else(|| OutOfRange::above(ns.into(), limit.0.into()))
    }
}

impl From<StartTime> for u16 {
    fn from(start: StartTime) -> Self {
        start.0
    }
}

/// An undefined PTO word: 3991..=0x7FFE, the same with bit 15, or 0xFFFF.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Pto", into = "Pto"))]
pub struct Reserved(u16);

impl Reserved {
    /// Returns the word if it is undefined.
    pub const fn new(word: u16) -> Option<Self> {
        match Pto::from_word(word) {
            Pto::Reserved(reserved) => Some(reserved),
            _ => None,
        }
    }

    /// The word.
    pub const fn word(self) -> u16 {
        self.0
    }

    /// Its low 15 bits, 3991..=0x7FFF.
    pub const fn time(self) -> u16 {
        self.0 & TIME
    }

    /// Its bit 15.
    pub const fn direction(self) -> Direction {
        Direction::of(self.0)
    }
}

/// The last nanosecond of a cycle.
const LAST_NS: u32 = 3999;
const TIME: u16 = 0x7fff;
const DIR: u16 = 0x8000;
const DRIVER_OFF: u16 = 0x7fff;

/// The PTO word: what one axis does in the next cycle.
///
/// ```text
///  bit 15   14 ........................ 0
///      DIR  start time in ns, 1..=3990     a pulse
///      DIR  0                              no pulse
///      0    0x7FFF                         driver off; any other word keeps it on
///           3991..=0x7FFE, and 0xFFFF      reserved: driver on, no pulse
/// ```
///
/// Every 16-bit word is a `Pto` and converts back to itself. From the design guide of the 4-axis CNC router with 250-kHz
/// control loop (TIDEP-0061), section 2.4.2. A device holds its DIR level through a driver-off word.
///
/// The whole word applies to the next cycle, including DIR: a device that sets DIR as soon as it takes the word reverses
/// the direction of a pulse that is still to come. DIR has to change at the wrap at the start of that cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "u16", into = "u16"))]
pub enum Pto {
    /// No pulse in the next cycle.
    NoPulse {
        /// DIR level.
        direction: Direction,
    },
    /// One pulse in the next cycle.
    Pulse {
        /// When it starts.
        start: StartTime,
        /// DIR level.
        direction: Direction,
    },
    /// The motor driver is switched off to save power.
    DriverOff,
    /// An undefined word.
    Reserved(Reserved),
}

impl Default for Pto {
    fn default() -> Self {
        Self::NoPulse { direction: Direction::Low }
    }
}

impl Pto {
    /// Creates the value from a word; any word is one of the four.
    pub const fn from_word(word: u16) -> Self {
        let direction = Direction::of(word);
        match StartTime::new(word & TIME) {
            Some(start) => Self::Pulse { start, direction },
            None if word & TIME == 0 => Self::NoPulse { direction },
            None if word == DRIVER_OFF => Self::DriverOff,
            None => Self::Reserved(Reserved(word)),
        }
    }

    /// The word; low byte first on the wire.
    pub const fn word(self) -> u16 {
        match self {
            Self::NoPulse { direction } => direction.bit(),
            Self::Pulse { start, direction } => start.ns() | direction.bit(),
            Self::DriverOff => DRIVER_OFF,
            Self::Reserved(raw) => raw.word(),
        }
    }

    /// Creates the word for a step at `sync_ns` of a cycle (0..=3999), as exactly as the wire can carry it: 0 becomes 1
    /// because 0 means no pulse, and 3991..=3999 become 3990. The shift is between -9 ns and +1 ns; it does not accumulate as
    /// long as the caller keeps the exact time for its next step.
    ///
    /// # Errors
    /// [`OutOfRange`] above 3999.
    pub const fn from_step(sync_ns: u32, direction: Direction) -> Result<Self, OutOfRange> {
        if sync_ns > LAST_NS {
            return Err(OutOfRange::above(sync_ns as u64, LAST_NS as u64));
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most 3999")]
        Ok(Self::Pulse { start: StartTime::truncate(sync_ns as u16), direction })
    }

    /// Returns the word, unless it is reserved.
    ///
    /// # Errors
    /// [`Error::ReservedPtoValue`]
    pub const fn checked(word: u16) -> Result<Self, Error> {
        match Self::from_word(word) {
            Self::Reserved(_) => Err(Error::ReservedPtoValue { raw: word }),
            pto => Ok(pto),
        }
    }

    /// Returns the start of the pulse, if the word asks for one.
    pub const fn start(self) -> Option<StartTime> {
        match self {
            Self::Pulse { start, .. } => Some(start),
            _ => None,
        }
    }

    /// DIR level that the word asks for; `None` for driver off, which leaves DIR as it is.
    pub const fn direction(self) -> Option<Direction> {
        match self {
            Self::NoPulse { direction } | Self::Pulse { direction, .. } => Some(direction),
            Self::DriverOff => None,
            Self::Reserved(raw) => Some(raw.direction()),
        }
    }

    /// Whether the driver is on, which is so for every word but one.
    pub const fn driver_enabled(self) -> bool {
        !matches!(self, Self::DriverOff)
    }
}

impl TryFrom<Pto> for Reserved {
    type Error = OutOfRange;

    fn try_from(pto: Pto) -> Result<Self, OutOfRange> {
        match pto {
            Pto::Reserved(reserved) => Ok(reserved),
            pto => Err(OutOfRange { got: pto.word().into(), max: 3991 }),
        }
    }
}

impl From<Reserved> for Pto {
    fn from(reserved: Reserved) -> Self {
        Self::Reserved(reserved)
    }
}

impl From<u16> for Pto {
    fn from(word: u16) -> Self {
        Self::from_word(word)
    }
}

impl From<Pto> for u16 {
    fn from(pto: Pto) -> Self {
        pto.word()
    }
}

#[cfg(feature = "arbitrary")]
impl arbitrary::Arbitrary<'_> for StartTime {
    fn arbitrary(u: &mut arbitrary::Unstructured<'_>) -> arbitrary::Result<Self> {
        u16::arbitrary(u).map(|ns| Self::truncate(ns & 0xfff))
    }
}

#[cfg(feature = "arbitrary")]
impl arbitrary::Arbitrary<'_> for Pto {
    fn arbitrary(u: &mut arbitrary::Unstructured<'_>) -> arbitrary::Result<Self> {
        u16::arbitrary(u).map(Self::from_word)
    }
}

// `+1234`, `-1`: a pulse this many ns into the cycle, DIR 0 or 1; `+.`, `-.`: no pulse; `off`; `0FA0h?`: reserved.
servowire_core::one_line!(Pto {
    Self::NoPulse { direction } => "{}.", direction.sign();
    Self::Pulse { start, direction } => "{}{}", direction.sign(), start.ns();
    Self::DriverOff => "off";
    Self::Reserved(raw) => "{:04X}h?", raw.word();
});
servowire_core::one_line!(StartTime { Self(ns) => "{} ns", ns; });
servowire_core::one_line!(Reserved { Self(word) => "{:04X}h", word; });

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_word_gives_itself_back_and_falls_into_its_class() {
        for word in (0..=u16::MAX).step_by(crate::stride(199)) {
            let pto = Pto::from_word(word);
            assert_eq!(pto.word(), word);
            let direction = if word >= 0x8000 { Direction::High } else { Direction::Low };
            match word & 0x7fff {
                0 => assert_eq!(pto, Pto::NoPulse { direction }),
                1..=3990 => assert_eq!(pto.start().map(StartTime::ns), Some(word & 0x7fff)),
                _ if word == 0x7fff => assert_eq!(pto, Pto::DriverOff),
                time => assert!(matches!(pto, Pto::Reserved(r) if r.time() == time)),
            }
            assert_eq!(pto.driver_enabled(), word != 0x7fff);
            assert_eq!(pto.direction(), (word != 0x7fff).then_some(direction));
            assert_eq!(Pto::checked(word).is_err(), matches!(pto, Pto::Reserved(_)));
            assert_eq!(Reserved::new(word).map(Pto::Reserved), Pto::checked(word).is_err().then_some(pto));
            let time = word & 0x7fff;
            assert_eq!(StartTime::try_from(time).ok(), StartTime::new(time));
            assert_eq!(StartTime::truncate(time).ns(), time.clamp(1, 3990));
        }
    }

    #[test]
    fn a_step_moves_by_one_up_or_nine_down_at_most() {
        for ns in (0..4000).step_by(crate::stride(199)) {
            for direction in [Direction::Low, Direction::High] {
                let pto = Pto::from_step(ns, direction).unwrap();
                let sent = u32::from(pto.start().unwrap().ns());
                assert_eq!(sent, ns.clamp(1, 3990));
                assert_eq!(pto.direction(), Some(direction));
            }
        }
        for ns in [4000, 4001, 0x7fff, 0x8000, 0x1_0001, u32::MAX] {
            assert_eq!(Pto::from_step(ns, Direction::Low), Err(OutOfRange { got: ns.into(), max: 3999 }));
        }
    }

    #[test]
    fn a_log_shows_words_as_people_say_them() {
        for (word, text) in
            [(1234, "+1234"), (0x8001, "-1"), (0, "+."), (0x8000, "-."), (0x7fff, "off"), (4000, "0FA0h?")]
        {
            assert_eq!(Pto::from_word(word).to_string(), text);
        }
    }

    #[test]
    fn ticks_are_whole_five_nanoseconds() {
        for ns in (0..=u16::MAX).step_by(crate::stride(199)) {
            assert_eq!(StartTime::new(ns).map(StartTime::ticks), (1..=3990).contains(&ns).then(|| (ns + 5) / 5 - 1));
        }
    }
}
