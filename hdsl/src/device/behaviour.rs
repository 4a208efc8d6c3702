use crate::symbol::RunningDisparity;

/// The points that the documents leave to the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// What is sent for an acceleration beyond 11 bits.
    pub overload: Overload,
    /// Which complement the second safe position uses.
    pub complement: Complement,
    /// Number of bits by which the second safe position is coarser, 0..=31.
    pub second_shift: u8,
    /// Whether the running disparity continues from answer to answer.
    pub disparity: Disparity,
    /// Bits 6:5 of the parameter byte, 0..=3.
    pub reserved_bits: u8,
    /// Number of SYNC frames that the encoder needs after RESET before it answers; the receiver sends 16.
    pub sync_frames: u8,
    /// Place n of the first normal answer in the V-frame, 0..=7: VSYNC comes 8 - n frames after the first INIT.
    pub first_place: u8,
    /// How it treats a frame whose head it could not read.
    pub bad_head: BadHead,
    /// The acknowledgement of a long write.
    pub acknowledgement: Acknowledgement,
    /// Time from the sampling edge at the encoder to the instant of its position, in eighths of a bit (13.333 ns). The manual
    /// promises less than 100 ns, so this is at most 7 (SICK manual, p. 12).
    pub sampling_lag: u8,
    /// Number of H-frames between a request and the first symbol of its answer.
    pub latency_frames: u16,
    /// Every n-th request is forgotten; 0 forgets none.
    pub forgets_every: u16,
}

impl Behaviour {
    /// Creates the behaviour of a well-behaved encoder.
    pub const fn new() -> Self {
        Self {
            overload: Overload::Saturated,
            complement: Complement::Ones,
            second_shift: 0,
            disparity: Disparity::CarriedOn,
            reserved_bits: 0,
            sync_frames: 8,
            first_place: 0,
            bad_head: BadHead::Counts,
            acknowledgement: Acknowledgement::Empty,
            sampling_lag: 0,
            latency_frames: 4,
            forgets_every: 0,
        }
    }

    servowire_core::builder! {
        with_overload: overload, Overload;
        with_complement: complement, Complement;
        with_second_shift: second_shift, u8;
        with_disparity: disparity, Disparity;
        with_reserved_bits: reserved_bits, u8;
        with_sync_frames: sync_frames, u8;
        with_first_place: first_place, u8;
        with_bad_head: bad_head, BadHead;
        with_acknowledgement: acknowledgement, Acknowledgement;
        with_sampling_lag: sampling_lag, u8;
        with_latency_frames: latency_frames, u16;
        with_forgets_every: forgets_every, u16;
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::new()
    }
}

/// What is sent for an acceleration beyond 11 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Overload {
    /// The largest value; the following frames catch up. The fast position lags meanwhile; the safe one does not.
    #[default]
    Saturated,
    /// K29.7 K29.7: no value.
    NoValue,
}

/// Which complement the second safe position uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Complement {
    /// All bits inverted.
    #[default]
    Ones,
    /// The negative value (two's complement).
    Twos,
}

/// The running disparity with which an answer begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Disparity {
    /// The one with which the previous answer ended.
    #[default]
    CarriedOn,
    /// Always the same.
    EachAnswer(RunningDisparity),
}

/// How the encoder treats a frame whose head it could not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BadHead {
    /// The frame counts in the V-frame.
    #[default]
    Counts,
    /// The frame does not count: VSYNC comes a frame later.
    Stalls,
}

/// The acknowledgement of a long write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Acknowledgement {
    /// LLEN is 0.
    #[default]
    Empty,
    /// LLEN is that of the request, although no data follow.
    RepeatsLength,
}

/// A fault that an encoder can be made to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Fault {
    /// The encoder works correctly.
    #[default]
    None,
    /// The encoder does not answer.
    Silent,
    /// VSYNC is never set.
    NoVsync,
    /// The acceleration channel carries K29.7 K29.7.
    NoAcceleration,
    /// Safe channel 1 carries K29.7 in place of a position.
    NoPosition,
    /// Safe channel 2 begins with K27.7.
    NoPosition2,
    /// The CRC of safe channel 1 is wrong.
    BadCrc,
    /// The CRC of safe channel 2 is wrong.
    BadCrc2,
    /// STATUS2 has TEST2 set.
    Test2,
    /// STATUS2 has ERR2 set.
    Error2,
    /// TOG2 does not alternate.
    StuckToggle,
    /// Messages are received and not answered.
    Mute,
}
