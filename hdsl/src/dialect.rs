use crate::message::Limits;
use crate::position::PositionRule;
use crate::quality::QualityRule;
use crate::sampling::EdgeRule;
use crate::symbol::Rule;

/// What the register map shows, and when events are raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum RegisterRule {
    /// The SICK manual, p. 31-55.
    ///
    /// * Each safe channel shows its last valid block, regardless of the other; a bad word or a wrong CRC sets SCE. If the
    ///   encoder has no position, VPOS shows FDh five times.
    /// * An event is raised when its status arises, and again only after that status has gone. MIN alone is raised in every
    ///   frame.
    /// * The application cannot write registers that the receiver writes; ACC_ERR_CNT stops at 31; the error code of a long
    ///   message is in PC_BUFFER with its detail first, as on the line; the pipe has a FIFO.
    #[default]
    Sick,
    /// The firmware of the Motor Control SDK.
    ///
    /// * SUMMARY and VPOSCRC are shown as received; channel 2 is shown only with a good channel 1, and a bad word in it
    ///   leaves SCE2 as it was.
    /// * POS and QMLW are raised in every frame for as long as they last.
    /// * The map is memory: everything can be written. An error code is in PC_BUFFER with its class first.
    Ti,
}

/// The points in which receivers differ, and the rule to follow in each.
///
/// [`SICK`](Self::SICK) follows the manual and the code tables; [`TI`](Self::TI) does what the receiver firmware of
/// the Motor Control SDK (release 09.02) does, so that both can be compared frame by frame.
///
/// ```
/// use hdsl::Dialect;
/// use hdsl::master::Master;
///
/// let mut patient = Dialect::SICK;
/// patient.messages.short_tries = 5;
/// let master = Master::new(patient);
/// # let _ = master;
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Dialect {
    /// How 8b/10b words are judged.
    pub rule: Rule,
    /// How the first edge of the test pattern is read.
    pub edge: EdgeRule,
    /// Penalties of the quality monitor, and when the link is lost.
    pub quality: QualityRule,
    /// How position and velocity are calculated.
    pub position: PositionRule,
    /// What the register map shows, and when events are raised.
    pub registers: RegisterRule,
    /// A V-frame without a good safe position is aligned with the last good one. Otherwise such a V-frame makes the position
    /// unreliable and restarts the alignment.
    pub stale_position: bool,
    /// The flag POS is set from the lock until the first alignment succeeds. The register list requires this; the vendor's
    /// receiver does not do it.
    pub doubt_at_lock: bool,
    /// The link is restarted when an acceleration word cannot be used and ACC_ERR_CNT has reached its threshold.
    pub restart_on_acceleration_errors: bool,
    /// An acceleration word with a bad 8b/10b word and a correct CRC-5 is used. The vendor's firmware does so: it clears its
    /// error flag before it tests it (`datalink.asm`). Off in both dialects.
    pub damaged_acceleration: bool,
    /// The link restarts if there is no VSYNC after this many frames with INIT; 0 waits for ever.
    pub vsync_frames: u8,
    /// How many times and for how long messages are tried.
    pub messages: Limits,
}

impl Dialect {
    /// The manual of the link (SICK 8017595/ZTW6).
    pub const SICK: Self = Self {
        rule: Rule::Strict,
        edge: EdgeRule::Leading,
        quality: QualityRule::Sick,
        position: PositionRule::Sick,
        registers: RegisterRule::Sick,
        stale_position: false,
        doubt_at_lock: true,
        restart_on_acceleration_errors: false,
        damaged_acceleration: false,
        vsync_frames: 16,
        messages: Limits::DEFAULT,
    };

    /// The receiver of the Motor Control SDK, release 09.02.
    pub const TI: Self = Self {
        rule: Rule::Reduced,
        edge: EdgeRule::All,
        quality: QualityRule::Ti,
        position: PositionRule::Ti,
        registers: RegisterRule::Ti,
        stale_position: true,
        doubt_at_lock: false,
        restart_on_acceleration_errors: true,
        damaged_acceleration: false,
        vsync_frames: 0,
        messages: Limits::DEFAULT,
    };
}

impl Default for Dialect {
    fn default() -> Self {
        Self::SICK
    }
}
