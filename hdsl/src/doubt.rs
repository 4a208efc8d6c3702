/// Why a position must not be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Doubt {
    /// There has been no H-frame yet.
    Never,
    /// The link is not up, or was lost.
    NoLink,
    /// The last acceleration word could not be used: the fast position is estimated.
    Estimated,
    /// The fast position does not yet agree with the safe one, or no longer does.
    Alignment,
    /// The velocity exceeds a sixteenth of the range per frame, but it is known only modulo an eighth of the range.
    Speed,
    /// No V-frame is complete yet.
    NoVFrame,
    /// The last V-frame brought no sound safe block, so the registers hold older data.
    Stale,
    /// The encoder reports that it has no position.
    Withheld,
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    Old {
        /// Distance to the instant of sampling, in ns.
        age_ns: u64,
    },
}

servowire_core::one_line!(Doubt {
    Self::Never => "there was no H-frame yet";
    Self::NoLink => "the link is down";
    Self::Estimated => "the fast position is estimated";
    Self::Alignment => "the fast position is not aligned with the safe one";
    Self::Speed => "the speed is beyond a sixteenth of the range a frame";
    Self::NoVFrame => "no V-frame is complete yet";
    Self::Stale => "the last V-frame brought no sound safe position";
    Self::Withheld => "the encoder has no position";
    Self::Old { age_ns } => "the position is {} ns old", age_ns;
});

impl core::error::Error for Doubt {}
