use crate::symbol::RunningDisparity;

/// What the documents leave to the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// What is sent for an acceleration beyond 11 bits.
    pub overload: Overload,
    /// Which complement the second safe position is.
    pub complement: Complement,
    /// Bits by which the second safe position is coarser, 0..=31.
    pub second_shift: u8,
    /// Whether the running disparity goes on from answer to answer.
    pub disparity: Disparity,
    /// Bits 6:5 of the parameter byte, 0..=3.
    pub reserved_bits: u8,
    /// SYNC frames that it needs after RESET before it answers; the receiver sends 16.
    pub sync_frames: u8,
    /// Place in the V-frame of the first normal answer, 0..=7: VSYNC comes 8 - n frames after the first INIT.
    pub first_place: u8,
    /// A frame whose head it could not read does not count in its V-frame.
    pub stalls_on_bad_head: bool,
    /// The acknowledgement of a write repeats LLEN, without data; otherwise LLEN is 0.
    pub acknowledges_with_length: bool,
    /// From the sampling edge at the encoder to the instant of its position, in eighths of a bit (13.333 ns). The manual promises
    /// less than 100 ns, so up to 7 (SICK manual, p. 12).
    pub sampling_lag: u8,
    /// H-frames between a request and the first symbol of its answer.
    pub latency: u16,
    /// Every n-th request is forgotten; 0 none.
    pub forgets_every: u16,
}

impl Behaviour {
    /// A polite encoder.
    pub const PLAIN: Self = Self {
        overload: Overload::Saturated,
        complement: Complement::Ones,
        second_shift: 0,
        disparity: Disparity::CarriedOn,
        reserved_bits: 0,
        sync_frames: 8,
        first_place: 0,
        stalls_on_bad_head: false,
        acknowledges_with_length: false,
        sampling_lag: 0,
        latency: 4,
        forgets_every: 0,
    };
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::PLAIN
    }
}

/// What is sent for an acceleration beyond 11 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Overload {
    /// The largest value; the following frames catch up. The fast position lags meanwhile, the safe one does not.
    #[default]
    Saturated,
    /// K29.7 K29.7: no value.
    NoValue,
}

/// Which complement the second safe position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Complement {
    /// All bits inverted.
    #[default]
    Ones,
    /// The negative.
    Twos,
}

/// With which running disparity an answer begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Disparity {
    /// That with which the one before ended.
    #[default]
    CarriedOn,
    /// Always this one.
    EachAnswer(RunningDisparity),
}

/// What an encoder can be made to do wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Faults {
    /// It does not answer.
    pub silent: bool,
    /// VSYNC is never set.
    pub no_vsync: bool,
    /// The acceleration channel carries K29.7 K29.7.
    pub no_acceleration: bool,
    /// Safe channel 1 carries K29.7 in the place of a position.
    pub no_position: bool,
    /// Safe channel 2 begins with K27.7.
    pub no_position_2: bool,
    /// The CRC of safe channel 1 is wrong.
    pub bad_crc: bool,
    /// The CRC of safe channel 2 is wrong.
    pub bad_crc_2: bool,
    /// STATUS2 has TEST2 set.
    pub test_2: bool,
    /// STATUS2 has ERR2 set.
    pub error_2: bool,
    /// TOG2 does not alternate.
    pub stuck_toggle: bool,
    /// Messages are received and not answered.
    pub mute: bool,
}

impl Faults {
    /// It does everything right.
    pub const NONE: Self = Self {
        silent: false,
        no_vsync: false,
        no_acceleration: false,
        no_position: false,
        no_position_2: false,
        bad_crc: false,
        bad_crc_2: false,
        test_2: false,
        error_2: false,
        stuck_toggle: false,
        mute: false,
    };
}
