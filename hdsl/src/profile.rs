use crate::message::Limits;
use crate::sampling::EdgeRule;
use crate::{PositionRule, QualityRule, Rule};

/// Where receivers differ, and which way to go.
///
/// [`SICK`](Self::SICK) follows the manual and the code tables; [`TI`](Self::TI) does what the receiver firmware of
/// the Motor Control SDK (release 09.02) does, so that both can be compared frame by frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Profile {
    /// How 8b/10b words are judged.
    pub rule: Rule,
    /// How the first edge of the test pattern is read.
    pub edge: EdgeRule,
    /// Penalties of the quality monitor, and when the link is lost.
    pub quality: QualityRule,
    /// What stands in for an acceleration word that cannot be used.
    pub position: PositionRule,
    /// A V-frame without a good safe position is aligned with the last good one. Otherwise it makes the position
    /// unreliable and starts the alignment anew.
    pub stale_position: bool,
    /// The flag POS is set from the lock until the first alignment succeeds. The register list asks for it, the
    /// vendor's receiver does not do it.
    pub doubt_at_lock: bool,
    /// The link is restarted when ACC_ERR_CNT reaches its threshold. Otherwise the counter stops at 31.
    pub restart_on_acceleration_errors: bool,
    /// Error bytes of a long message go into PC_BUFFER with the class first; on the line the detail is first.
    pub error_class_first: bool,
    /// An encoder without VSYNC is given up after this many frames with INIT; 0 waits for ever.
    pub vsync_frames: u8,
    /// How often and how long messages are tried.
    pub messages: Limits,
}

impl Profile {
    /// The manual of the link.
    pub const SICK: Self = Self {
        rule: Rule::Strict,
        edge: EdgeRule::Leading,
        quality: QualityRule::Sick,
        position: PositionRule::Sick,
        stale_position: false,
        doubt_at_lock: true,
        restart_on_acceleration_errors: false,
        error_class_first: false,
        vsync_frames: 16,
        messages: Limits::DEFAULT,
    };

    /// The receiver of the Motor Control SDK.
    pub const TI: Self = Self {
        rule: Rule::Reduced,
        edge: EdgeRule::All,
        quality: QualityRule::Ti,
        position: PositionRule::Ti,
        stale_position: true,
        doubt_at_lock: false,
        restart_on_acceleration_errors: true,
        error_class_first: true,
        vsync_frames: 0,
        messages: Limits::DEFAULT,
    };
}

impl Default for Profile {
    fn default() -> Self {
        Self::SICK
    }
}
