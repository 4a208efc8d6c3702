//! The part of a drive's answers that a control loop may use, judged at the moment of use.

use servowire_core::{Feedback, Tolerance, Words};

use crate::doubt::Doubt;
use crate::error::ErrorClass;
use crate::response::Response;
use crate::status::StatusFlags;

/// Up to what age, and despite which Status_Flags, a position may be used.
pub type Policy = servowire_core::Policy<Tolerated>;

/// Despite which Status_Flags a position may be used. Only [`ALARM`](StatusFlags::ALARM) causes a doubt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tolerated {
    status: StatusFlags,
}

impl Tolerated {
    /// Tolerates no flags: an alarm is a doubt.
    pub const NOTHING: Self = Self { status: StatusFlags::empty() };
    /// Tolerates an alarm, for displaying the position of a stopped axis.
    pub const ALARM: Self = Self::NOTHING.status(StatusFlags::ALARM);

    /// Tolerates these flags, replacing those set before.
    #[must_use]
    pub const fn status(mut self, status: StatusFlags) -> Self {
        self.status = status;
        self
    }
}

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// Speed and torque of an answer to the normal command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Rates {
    speed: i32,
    torque: i32,
}

/// An actual position that may be used, and what came with it.
///
/// Pr7.29 to Pr7.31 of the drive must be 0: otherwise it sends other values in these places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sample {
    position: i32,
    rates: Option<Rates>,
    sampled_ns: u64,
}

impl Sample {
    /// Actual position, command units; it wraps.
    pub const fn position(&self) -> i32 {
        self.position
    }

    /// Actual speed, unit by Pr7.25; `None` while the answer to a request takes its place in the block.
    pub const fn speed(&self) -> Option<i32> {
        match self.rates {
            Some(rates) => Some(rates.speed),
            None => None,
        }
    }

    /// Torque, 0.1 % of rated; `None` while the answer to a request takes its place in the block.
    pub const fn torque(&self) -> Option<i32> {
        match self.rates {
            Some(rates) => Some(rates.torque),
            None => None,
        }
    }

    /// When the block was heard, in ns. How long before that the drive measured the position is not documented. SX-DSV02310,
    /// "Update timing".
    pub const fn sampled_ns(&self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(Sample {
    Self { position, rates: Some(rates), sampled_ns } =>
        "position {}, speed {}, torque {} at {} ns", position, rates.speed, rates.torque, sampled_ns;
    Self { position, rates: None, sampled_ns } => "position {} at {} ns", position, sampled_ns;
});

/// What is known about the actual position of a drive. The position is judged at the moment of use, because it ages until then.
///
/// ```
/// use rtex_block::{Doubt, Evidence, Policy, Response};
///
/// let block = [0xc5, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];
/// let evidence = Evidence::of(&Response::parse(&block)?, 1_000_000);
/// let policy = Policy::new(1_000_000); // two update periods of 0.5 ms
/// let sample = evidence.at(1_500_000, policy).unwrap();
/// assert_eq!((sample.position(), sample.speed(), sample.torque()), (998, Some(10_000), Some(-100)));
/// assert_eq!(evidence.at(2_500_000, policy), Err(Doubt::Old { age_ns: 1_500_000 }));
/// # Ok::<(), rtex_block::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Evidence {
    sample: Option<Sample>,
    status: StatusFlags,
    /// Why the last block was refused, if it was.
    refused: Option<ErrorClass>,
}

impl Evidence {
    /// The evidence before the first good block.
    pub const NEVER: Self = Self { sample: None, status: StatusFlags::empty(), refused: None };

    /// Creates the evidence of a response whose counter echo was first heard at `sampled_ns`. A master gets it from
    /// [`Axis::evidence`](crate::master::Axis::evidence); this is for tools.
    pub const fn of(response: &Response, sampled_ns: u64) -> Self {
        let rates = if response.code.noncyclic_bits() == 0 && !response.cmd_error {
            Some(Rates { speed: response.response_data2, torque: response.response_data3 })
        } else {
            None
        };
        let sample = Sample { position: response.response_data1, rates, sampled_ns };
        Self { sample: Some(sample), status: response.status, refused: None }
    }

    /// Status_Flags of the last good block.
    pub(crate) const fn status(&self) -> StatusFlags {
        self.status
    }

    /// The position, regardless of its age and of alarms; 0 before the first good block.
    pub(crate) const fn last(&self) -> Sample {
        match self.sample {
            Some(sample) => sample,
            None => Sample { position: 0, rates: None, sampled_ns: 0 },
        }
    }

    /// Adds the alarm of a block that was not on time, if it reports one.
    pub(crate) const fn alarmed(self, status: StatusFlags) -> Self {
        Self { status: self.status.union(status.intersection(StatusFlags::ALARM)), ..self }
    }

    /// Adds the reason why the last block was refused.
    pub(crate) const fn refused(self, refused: Option<ErrorClass>) -> Self {
        Self { refused, ..self }
    }

    /// Returns the actual position, if it may be used at this time.
    ///
    /// # Errors
    /// [`Doubt::Never`], then [`Doubt::Refused`] or [`Doubt::Old`], then [`Doubt::Alarm`].
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        let Some(sample) = self.sample else { return Err(Doubt::Never) };
        if let Err(age_ns) = policy.check_age(now_ns, sample.sampled_ns) {
            return Err(match self.refused {
                Some(class) => Doubt::Refused { class, age_ns },
                None => Doubt::Old { age_ns },
            });
        }
        let doubts = StatusFlags::ALARM.difference(policy.tolerated().status);
        if self.status.intersects(doubts) {
            return Err(Doubt::Alarm);
        }
        Ok(sample)
    }
}

impl Feedback for Evidence {
    type Tolerated = Tolerated;
    type Sample = Sample;
    type Doubt = Doubt;
    const NEVER: Self = Self::NEVER;

    fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        self.at(now_ns, policy)
    }
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 6>;

/// For an [`EvidenceCell`]: position, speed, torque, the instant in two words, and a last one: Status_Flags in bits 15-0, whether there is a sample in
/// bit 16, whether it has speed and torque in bit 17, the number of the refusal in bits 31-24.
impl Words<6> for Evidence {
    #[expect(clippy::cast_possible_truncation, reason = "an instant is cut into its halves")]
    #[inline]
    fn to_words(&self) -> [u32; 6] {
        let Sample { position, rates, sampled_ns } = self.last();
        let Rates { speed, torque } = rates.unwrap_or(Rates { speed: 0, torque: 0 });
        let refused = u32::from(self.refused.map_or(0, ErrorClass::number));
        let known = u32::from(self.sample.is_some()) << 16 | u32::from(rates.is_some()) << 17;
        let last = u32::from(self.status.bits()) | known | refused << 24;
        let [position, speed, torque] = [position, speed, torque].map(|value| u32::from_le_bytes(value.to_le_bytes()));
        [position, speed, torque, sampled_ns as u32, (sampled_ns >> 32) as u32, last]
    }

    #[inline]
    fn from_words([position, speed, torque, low, high, last]: [u32; 6]) -> Self {
        let [status_low, status_high, known, refused] = last.to_le_bytes();
        let [position, speed, torque] = [position, speed, torque].map(|word| i32::from_le_bytes(word.to_le_bytes()));
        let rates = (known & 2 != 0).then_some(Rates { speed, torque });
        let sample = Sample { position, rates, sampled_ns: u64::from(high) << 32 | u64::from(low) };
        Self {
            sample: (known & 1 != 0).then_some(sample),
            status: StatusFlags::from_bytes([status_low, status_high]),
            refused: ErrorClass::from_number(refused),
        }
    }
}

servowire_core::one_line!(Evidence {
    Self { sample: Some(sample), status, refused: None } => "{} [{}]", sample, status;
    Self { sample: Some(sample), status, refused: Some(class) } => "{} [{}], then refused: {}", sample, status, class.name();
    Self { sample: None, .. } => "no good block has been received yet";
});

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_evidence_comes_back_from_its_words() {
        let classes = ErrorClass::ALL.iter().map(|class| Some(*class)).chain([None]);
        for refused in classes {
            for byte1 in [0x20, 0x2a] {
                for status in 0..=u8::MAX {
                    let told = Evidence::of(&response(byte1, status), 0x1234_5678_9abc_def0).refused(refused);
                    assert_eq!(Evidence::from_words(told.to_words()), told);
                }
            }
            let never = Evidence::NEVER.refused(refused);
            assert_eq!(Evidence::from_words(never.to_words()), never);
        }
        let words = Evidence::of(&response(0x20, 0x60), (3 << 32) + 7).refused(Some(ErrorClass::MacId)).to_words();
        assert_eq!(words, [77, 8, 9, 7, 3, 0x0403_0060]);
        assert_eq!(Evidence::from_words([0; 6]), Evidence::NEVER);
        assert_eq!(Evidence::from_words([u32::MAX; 6]).at(u64::MAX, Policy::new(0)), Err(Doubt::Alarm));
    }

    fn response(byte1: u8, status: u8) -> Response {
        Response::parse(&[0xc5, byte1, status, 0, 77, 0, 0, 0, 8, 0, 0, 0, 9, 0, 0, 0]).unwrap()
    }

    #[test]
    fn speed_and_torque_are_there_with_the_normal_command_alone() {
        // CP normal, PP normal, CP monitor, and a refused normal command.
        for (byte1, rates) in [(0x20, true), (0x10, true), (0x2a, false), (0xa0, false)] {
            let sample = Evidence::of(&response(byte1, 0x40), 5).at(5, Policy::new(0)).unwrap();
            assert_eq!((sample.position(), sample.sampled_ns()), (77, 5));
            assert_eq!((sample.speed(), sample.torque()), (rates.then_some(8), rates.then_some(9)), "{byte1:x}");
        }
    }

    #[test]
    fn doubts_in_their_order() {
        let policy = Policy::new(100);
        assert_eq!(Evidence::NEVER.at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
        let alarmed = Evidence::of(&response(0x20, 0x60), 1_000);
        assert_eq!(alarmed.at(1_101, policy), Err(Doubt::Old { age_ns: 101 }));
        assert_eq!(alarmed.at(1_100, policy), Err(Doubt::Alarm));
        assert_eq!(alarmed.at(1_100, policy.tolerating(Tolerated::ALARM)).map(|sample| sample.position()), Ok(77));
        let refused = Evidence::of(&response(0x20, 0x40), 1_000).refused(Some(ErrorClass::MacId));
        assert_eq!(refused.at(1_100, policy).map(|sample| sample.position()), Ok(77));
        assert_eq!(refused.at(1_200, policy), Err(Doubt::Refused { class: ErrorClass::MacId, age_ns: 200 }));
    }

    #[test]
    fn through_a_cell() {
        let old = Evidence::of(&response(0x20, 0x60), 0x1234_5678_9abc_def0).refused(Some(ErrorClass::Combinator));
        assert_eq!(old.to_words(), [77, 8, 9, 0x9abc_def0, 0x1234_5678, 0x0b03_0060]);
        let busy = Evidence::of(&response(0x2a, 0xff), 7);
        assert_eq!(busy.to_words(), [77, 0, 0, 7, 0, 0x0001_00ff]);
        for evidence in [Evidence::NEVER, old, busy] {
            assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        }
    }

    #[test]
    fn in_one_line() {
        let evidence = Evidence::of(&response(0x2a, 0x60), 9);
        assert_eq!(evidence.to_string(), "position 77 at 9 ns [SERVO_READY ALARM]");
        assert_eq!(Evidence::NEVER.to_string(), "no good block has been received yet");
        let refused = Evidence::of(&response(0x20, 0), 9).refused(Some(ErrorClass::TooLong));
        assert_eq!(refused.to_string(), "position 77, speed 8, torque 9 at 9 ns [-], then refused: too_long");
        let doubt = Doubt::Refused { class: ErrorClass::Direction, age_ns: 3 };
        assert_eq!(doubt.to_string(), "the position is 3 ns old, the last block was refused: direction");
    }
}
