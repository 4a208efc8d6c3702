//! What was received in an H-frame.

use super::{RestartReason, State};
use crate::acceleration::DeltaDelta;
use crate::encoder_id::EncoderId;
use crate::error::Error;
use crate::frame::{Stuffing, Tail, Trailer};
use crate::message::Finished;
use crate::quality::QualityMonitor;
use crate::rssi::Rssi;
use crate::sampling::Delay;
use crate::symbol::{Character, Control, Reading};
use crate::vframe::VFrame;

/// The measured quality of the line, in addition to the bits of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SignalQuality {
    /// RSSI of this answer. On a running link a receiver of samples examines a quarter of its bits, a different quarter in each
    /// frame.
    pub rssi: Rssi,
    /// The delay of the cable, as learned during start-up.
    pub delay: Delay,
    /// Bit n is set if an edge of the test pattern was seen in sample period n of the start-up.
    pub edges: u8,
}

/// What was received in an H-frame, and how the frame ends on the line.
///
/// Values that come once per V-frame or less often are present only in the frame to which they belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct HFrame {
    /// Number of the frame since the machine was created, from 0 on, modulo 2^32; it includes those reported by
    /// [`Master::skip`](super::Master::skip).
    pub number: u32,
    /// What to send after the answer.
    pub tail: Tail,
    /// State in which the frame was sent.
    pub was: State,
    /// State of the next frame.
    pub state: State,
    /// Set if the next frame begins a new start-up.
    pub restarted: Option<RestartReason>,
    /// Frames of the running link before this one were not heard, as reported by [`Master::skip`](super::Master::skip) or
    /// recognised by the time.
    pub gap: bool,
    /// The encoder identifier, in the frame in which it arrived.
    pub encoder: Option<EncoderId>,
    /// The quality of the line, if it was measured.
    pub signal: Option<SignalQuality>,
    /// The quality monitor, 0..=15.
    pub quality: u8,
    /// The acceleration, on a running link and if its word can be used.
    pub acceleration: Option<DeltaDelta>,
    /// Number of acceleration words in a row that could not be used.
    pub acceleration_errors: u32,
    /// The safe blocks, in the last H-frame of a V-frame.
    pub v_frame: Option<VFrame>,
    /// The word of the pipe channel, K30.7 included.
    pub pipe: Option<Reading>,
    /// The encoder sends INIT: it has dropped its messages.
    pub init: bool,
    /// Messages that have ended.
    pub finished: Finished,
    /// No long message is under way.
    pub long_free: bool,
    /// No short message is under way.
    pub short_free: bool,
}

servowire_core::one_line!(HFrame {
    Self { restarted: Some(reason), was, .. } => "{}, the link restarts: {}", was, reason;
    Self { was: State::Running, quality, acceleration: None, .. } => "RUNNING, quality {}, no acceleration", quality;
    Self { was, quality, .. } => "{}, quality {}", was, quality;
});

impl HFrame {
    /// Creates the value before the first frame.
    pub(super) const START: Self = Self {
        number: 0,
        tail: Tail { trailer: Trailer::Whole, stuffing: Stuffing::MIN },
        was: State::Reset,
        state: State::Reset,
        restarted: None,
        gap: false,
        encoder: None,
        signal: None,
        quality: QualityMonitor::START,
        acceleration: None,
        acceleration_errors: 0,
        v_frame: None,
        pipe: None,
        init: false,
        finished: Finished { short: None, long: None },
        long_free: false,
        short_free: false,
    };

    /// Clears the data of a link that has ended.
    pub(super) const fn clear(&mut self) {
        self.quality = QualityMonitor::START;
        self.acceleration = None;
        self.acceleration_errors = 0;
        self.pipe = None;
        self.init = false;
    }

    /// Clears what belongs to one frame.
    #[inline]
    pub(super) fn begin(&mut self, state: State, signal: Option<SignalQuality>) {
        self.was = state;
        self.signal = signal;
        self.v_frame = None;
        self.finished = Finished { short: None, long: None };
    }

    /// Returns the data of the pipe channel; `None` if it had none in this frame.
    ///
    /// ```
    /// use hdsl::device::Device;
    /// use hdsl::master::Master;
    /// use hdsl::{Dialect, EncoderId};
    ///
    /// let mut master = Master::new(Dialect::SICK);
    /// let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
    /// let mut data = Vec::new();
    /// for frame in 0..100 {
    ///     // A byte in every tenth frame.
    ///     encoder.set_pipe((frame % 10 == 0).then_some(frame));
    ///     let bits = encoder.set_position(0).hear(master.transmission().head.bits()).map_or(u64::MAX, |answer| answer.bits);
    ///     if let Some(character) = master.hear_bits(bits, None, 0).pipe_character() {
    ///         data.push(character?.byte());
    ///     }
    /// }
    /// // The link runs from frame 61 on.
    /// assert_eq!(data, [70, 80, 90]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::InvalidWord`].
    pub fn pipe_character(&self) -> Option<Result<Character, Error>> {
        let word = self.pipe.filter(|word| !word.is(Control::K30_7))?;
        Some(word.character())
    }
}

/// The counts since the machine was created.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Counters {
    /// Number of H-frames, heard or reported.
    pub frames: u64,
    /// Restarts.
    pub restarts: u32,
    /// Number of bad words in answers, in all channels.
    pub words: u32,
    /// Number of acceleration words that could not be used.
    pub acceleration: u32,
    /// Number of V-frames without a good safe channel 1.
    pub safe1: u32,
    /// Number of V-frames without a good safe channel 2.
    pub safe2: u32,
    /// Number of answers with a wrong switch bit.
    pub switch_bits: u32,
}

impl core::fmt::Display for Counters {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { frames, restarts, words, acceleration, safe1, safe2, switch_bits } = self;
        write!(f, "{frames} frames, {restarts} restarts; bad: {words} words, {acceleration} accelerations, ")?;
        write!(f, "{safe1} and {safe2} safe blocks, {switch_bits} switch bits")
    }
}
