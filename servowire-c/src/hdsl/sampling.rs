//! From samples to bits: eight samples a bit, a byte each, the first in bit 7.

use core::mem::MaybeUninit;

use hdsl::Error;
use hdsl::rssi::{Rssi, edges, longest_gap};
use hdsl::sampling::{Alignment, Delay, SampleIndex};

use super::error;
use super::names::dialect as dialect_of;
use crate::border::{OK, border, in_range, read, there};
use crate::result::sw_result_t;

/// What an encoder answers in START, LEARN and CHECK: 61 bits, the first of the line in bit 0.
pub const SW_HDSL_TEST_PATTERN: u64 = 0x1322_ccdf_ba88_1332;
const _: () = assert!(SW_HDSL_TEST_PATTERN == hdsl::sampling::TEST_PATTERN);

/// Where the bits of an answer are sampled.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_alignment_t {
    /// The sample of a bit, 0..7.
    pub index: u8,
    /// The delay of the cable, 0..11 bits.
    pub delay: u8,
}

/// Finds the test pattern of the start-up in a window of samples, by the edges that a dialect looks at. SW_E_HDSL_NO_EDGE, or
/// SW_E_HDSL_PATTERN_NOT_FOUND, which writes `index` as the first edge gave it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_learn(
    samples: *const u8,
    len: usize,
    dialect: u8,
    alignment: Option<&mut MaybeUninit<sw_hdsl_alignment_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (samples, rule, out) = (unsafe { read(samples, len)? }, dialect_of(dialect)?.edge, there(alignment)?);
        match Alignment::learn(rule, samples) {
            Ok(found) => {
                out.write(sw_hdsl_alignment_t { index: found.index.get(), delay: found.delay.get() });
                OK
            }
            Err(refusal) => {
                if let Error::PatternNotFound { index } = refusal {
                    out.write(sw_hdsl_alignment_t { index, delay: 0 });
                }
                Err(error(refusal))
            }
        }
    })
}

/// The 61 bits of an answer in its window of samples, the first of the line in bit 0, and their RSSI, 0..12 (may be NULL).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_sampled(
    alignment: Option<&sw_hdsl_alignment_t>,
    samples: *const u8,
    len: usize,
    bits: Option<&mut MaybeUninit<u64>>,
    rssi: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (it, samples, bits) = (there(alignment)?, unsafe { read(samples, len)? }, there(bits)?);
        let (index, delay) = (in_range(SampleIndex::new(it.index))?, in_range(Delay::new(it.delay))?);
        let alignment = Alignment { index, delay };
        let answer = alignment.bits(samples).map_err(error)?;
        if let Some(rssi) = rssi {
            rssi.write(alignment.rssi(samples).map_err(error)?.get());
        }
        bits.write(answer);
        OK
    })
}

/// The sample, 0..7, that lies in the middle of the bits of a line with a falling (or a rising) edge in these eight samples.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_sample_index(samples: u8, falling: bool) -> u8 {
    if falling { SampleIndex::after_falling_edge(samples).get() } else { SampleIndex::after_rising_edge(samples).get() }
}

/// Bit n is set if the line changes before sample n of these eight; `previous` is the sample before them.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_edges(previous: bool, samples: u8) -> u8 {
    edges(previous, samples)
}

/// RSSI of the places in a bit at which edges were seen, 0..12.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_rssi(edges: u8) -> u8 {
    Rssi::of_edges(edges).get()
}

/// The longest part of a bit without edges, 1..8 samples; 0 if no edge was seen.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_longest_gap(edges: u8) -> u8 {
    longest_gap(edges).unwrap_or(0)
}
