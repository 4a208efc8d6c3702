//! The encoder's reception: finds the bits of a head on a sampled line, and the instant at which to take the position.

use nrz_line::Window;

/// SYNC 001011 and the two ones after it, at eight samples per bit, the first in bit 63.
const LOCK: u64 = 0x0000_ff00_ffff_ffff;
/// How many samples of [`LOCK`] may differ: two for each of its four edges would be eight, and so would one wrong bit.
const TOLERANCE: u32 = 7;

/// What an encoder receives of the head of an H-frame on a line with eight samples per bit.
///
/// It locks to the edges of SYNC, by majority; jitter of one sample and glitches of one sample do no harm. The sampling edge is
/// taken where it actually is, including jitter, because that is the instant of the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heard {
    /// The bits from SYNC to PARA, for [`Device::hear`](super::Device::hear).
    pub bits: Window,
    /// The sample at which SYNC begins according to the encoder's clock.
    pub start: u16,
    /// The first sample after the sampling edge.
    pub edge: u16,
}

impl Heard {
    /// Looks for a head in samples, one byte per bit time of the master, with the first sample in bit 7. The line is high
    /// before and after them. `None` if there is no readable head.
    pub fn on_line(samples: &[u8]) -> Option<Self> {
        // The shortest head has 26 bits.
        let last = samples.len().checked_sub(26)?.saturating_mul(8);
        let start = lock(samples, last)?;
        let edge = run(samples, start.saturating_add(60), false)?;
        let rise = run(samples, edge, true)?;
        // The zero after the ones, and up to seven eighths of a bit more in the bit before it.
        if !(5..=18).contains(&rise.saturating_sub(edge)) {
            return None;
        }
        // CYCLE RESET begins with this bit; before it is the zero, before that are ones.
        let reset = rise.saturating_sub(start).saturating_add(4) / 8;
        let zero = reset.checked_sub(1)?;
        // After SYNC and two ones at once, or after up to nine ones more.
        if !(8..=17).contains(&zero) {
            return None;
        }
        let mut bits = 0_u128;
        for at in 0..reset.saturating_add(17) {
            let middle = start.saturating_add(at.saturating_mul(8));
            let one = match at {
                ..8 => majority(samples, middle),
                _ if at < zero => true,
                _ => majority(samples, middle),
            };
            bits |= u128::from(one).checked_shl(u32::try_from(at).ok()?)?;
        }
        let bits = Window::from_bits(bits, u32::try_from(reset).ok()?.saturating_add(17))?;
        Some(Self { bits, start: u16::try_from(start).ok()?, edge: u16::try_from(edge).ok()? })
    }
}

/// Returns where SYNC begins: the best match among the first possible places. (PARA may end with the same bits.)
fn lock(samples: &[u8], last: usize) -> Option<usize> {
    let wrong = |place: &usize| (window(samples, *place) ^ LOCK).count_ones();
    let first = (0..=last).find(|place| wrong(place) <= TOLERANCE)?;
    (first..first.saturating_add(8)).min_by_key(wrong)
}

/// Returns 64 samples from `place`, the first in bit 63.
fn window(samples: &[u8], place: usize) -> u64 {
    let byte = |at| samples.get(at).copied().unwrap_or(0xff);
    let first = place / 8;
    let eight = u64::from_be_bytes([0, 1, 2, 3, 4, 5, 6, 7].map(|k: usize| byte(first.saturating_add(k))));
    match place % 8 {
        0 => eight,
        part => eight << part | u64::from(byte(first.saturating_add(8))) >> (8_usize.saturating_sub(part)),
    }
}

/// Returns a sample; the line is high before and after them.
fn sample(samples: &[u8], place: usize) -> bool {
    samples.get(place / 8).is_none_or(|byte| byte << (place % 8) & 0x80 != 0)
}

/// Returns the level in the middle of the bit that begins at `place`.
fn majority(samples: &[u8], place: usize) -> bool {
    [3, 4, 5].into_iter().filter(|k| sample(samples, place.saturating_add(*k))).count() >= 2
}

/// Returns where a stable level begins: three equal samples in a row.
fn run(samples: &[u8], from: usize, level: bool) -> Option<usize> {
    let lasts = |place: &usize| (0..3).all(|k| sample(samples, place.saturating_add(k)) == level);
    (from..samples.len().saturating_mul(8)).find(lasts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::code::parameter;
    use std::vec::Vec;

    /// The line as text, a character a sample, as bytes with the first sample in bit 7.
    fn pack(line: &str) -> Vec<u8> {
        let bits: Vec<u8> = line.bytes().map(|level| u8::from(level == b'1')).collect();
        bits.chunks(8).map(|byte| (0..8).fold(0, |sum, k| sum << 1 | byte.get(k).copied().unwrap_or(1))).collect()
    }

    /// The head with IDLE, FIRST, MSYNC as printed, with `extra` eighths of ones in the EXTRA window, after `delay` samples.
    fn head(extra: usize, delay: usize) -> std::string::String {
        let eight = |bits: &str| bits.chars().flat_map(|bit| [bit; 8]).collect::<std::string::String>();
        let low = if extra % 8 == 0 { 0 } else { 8 - extra % 8 };
        let parts = [
            "1".repeat(delay),
            eight("00101111"),
            "1".repeat(extra),
            "0".repeat(low),
            eight("0110"),
            eight("0000"),
            eight("1001000110"),
            "1".repeat(40),
        ];
        parts.concat()
    }

    /// Where the edge is, to the sample, free running and in a window of any size.
    #[test]
    fn the_instant_is_that_of_the_edge() {
        for extra in (24..=72).step_by(crate::thin(13)).chain([0]) {
            for delay in (0..=90).step_by(crate::thin(37)) {
                let heard = Heard::on_line(&pack(&head(extra, delay))).unwrap();
                assert_eq!((usize::from(heard.start), usize::from(heard.edge)), (delay, delay + 64 + extra));
                assert_eq!(heard.bits.len() as usize, 26 + extra.div_ceil(8));
                assert_eq!(parameter(heard.bits), Some(0xd0));
            }
        }
    }

    /// One glitch anywhere moves the edge by a sample back or three on at most, and harms nothing else.
    #[test]
    fn a_glitch() {
        for at in (20..20 + 26 * 8).step_by(crate::thin(31)) {
            let mut line = pack(&head(0, 20));
            line[at / 8] ^= 0x80 >> (at % 8);
            let heard = Heard::on_line(&line).unwrap();
            assert_eq!((heard.start, parameter(heard.bits)), (20, Some(0xd0)), "{at}");
            assert!((20 + 63..=20 + 67).contains(&heard.edge), "{at}: {}", heard.edge);
        }
    }

    /// Seven samples that are wrong are not enough to lose SYNC, eight are.
    #[test]
    fn how_much_is_too_much() {
        for start in (16..24).step_by(crate::thin(5)) {
            let mut line = pack(&head(0, start));
            for bit in 0..8 {
                let heard = Heard::on_line(&line).map(|heard| (usize::from(heard.start), parameter(heard.bits)));
                assert_eq!(heard, Some((start, Some(0xd0))), "{bit}");
                // Not one of the three in the middle.
                let place = start + 8 * bit + 6;
                line[place / 8] ^= 0x80 >> (place % 8);
            }
            assert_eq!(Heard::on_line(&line), None);
        }
    }

    #[test]
    fn what_is_no_head() {
        assert_eq!(Heard::on_line(&[0xff; 48]), None);
        assert_eq!(Heard::on_line(&[0x00; 48]), None);
        assert_eq!(Heard::on_line(&pack(&head(0, 0))[..25]), None);
        // A wrong bit of SYNC.
        for bit in 0..6 {
            let mut line = pack(&head(0, 16));
            line[2 + bit] ^= 0xff;
            assert!(Heard::on_line(&line).and_then(|heard| parameter(heard.bits)).is_none(), "{bit}");
        }
        // Ten ones more are no window.
        assert!(Heard::on_line(&pack(&head(72, 0))).is_some());
        assert_eq!(Heard::on_line(&pack(&head(80, 0))), None);
        // The level stays low for two bits more, or rises too early.
        let mut line = pack(&head(0, 0));
        line[9] = 0;
        line[10] = 0;
        assert_eq!(Heard::on_line(&line), None);
        let mut line = pack(&head(0, 0));
        line[8] = 0x1f;
        assert_eq!(Heard::on_line(&line), None);
    }
}
