//! Torque and current.

use super::codes::IsGain;

/// Returns the full-scale current of a winding in µA, rounded down: 2.75 V x TORQUE / (256 x ISGAIN x R). `sense_milliohm`
/// is the sense resistor. `None` for 0 mOhm.
///
/// ```
/// use servowire_drivers::drv8711::{IsGain, full_scale_microamps};
/// assert_eq!(full_scale_microamps(255, IsGain::X10, 50), Some(5_478_515));
/// ```
pub const fn full_scale_microamps(torque: u8, gain: IsGain, sense_milliohm: u16) -> Option<u32> {
    // 2.75 V in nV, so that µA x mOhm = nV.
    let nanovolts = 2_750_000_000_u64.saturating_mul(torque as u64);
    match nanovolts.checked_div(divisor(gain, sense_milliohm)) {
        // At most 2.75e9 * 255 / (256 * 5) = 547 851 562.
        #[expect(clippy::cast_possible_truncation, reason = "below 2^30")]
        Some(microamps) => Some(microamps as u32),
        None => None,
    }
}

/// Returns the largest TORQUE whose full-scale current does not exceed `microamps`: 0 if even 1 is too much, 255 at most. `None`
/// for 0 mOhm.
pub const fn torque_for_microamps(microamps: u32, gain: IsGain, sense_milliohm: u16) -> Option<u8> {
    if sense_milliohm == 0 {
        return None;
    }
    // One more than asked, less a nanovolt: the current itself is rounded down.
    let nanovolts =
        (microamps as u64).saturating_add(1).saturating_mul(divisor(gain, sense_milliohm)).saturating_sub(1);
    let torque = nanovolts / 2_750_000_000;
    #[expect(clippy::cast_possible_truncation, reason = "at most 255")]
    Some(if torque > 255 { 255 } else { torque as u8 })
}

const fn divisor(gain: IsGain, sense_milliohm: u16) -> u64 {
    256_u64.saturating_mul(gain.factor() as u64).saturating_mul(sense_milliohm as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_and_current_are_inverse() {
        for gain in [IsGain::X5, IsGain::X10, IsGain::X20, IsGain::X40] {
            for sense in [1, 10, 15, 20, 30, 50, 100, 1000, u16::MAX] {
                for torque in (0..=255).step_by(if cfg!(miri) { 17 } else { 1 }) {
                    let microamps = full_scale_microamps(torque, gain, sense).unwrap();
                    // Where the steps are finer than a microamp, a higher torque has the same current.
                    let back = torque_for_microamps(microamps, gain, sense).unwrap();
                    assert!(back >= torque);
                    assert_eq!(full_scale_microamps(back, gain, sense), Some(microamps));
                    if torque > 0 && full_scale_microamps(torque - 1, gain, sense) < Some(microamps) {
                        assert!(torque_for_microamps(microamps - 1, gain, sense).unwrap() < torque);
                    }
                }
            }
            assert_eq!(full_scale_microamps(255, gain, 0), None);
            assert_eq!(torque_for_microamps(1, gain, 0), None);
        }
        assert_eq!(torque_for_microamps(u32::MAX, IsGain::X5, 1), Some(255));
    }
}
