//! Start-stop fields from a sampled line.

use core::mem::MaybeUninit;

use nrz_line::{Field, Format, Receiver};

use crate::border::{OK, border, in_range, state, there};
use crate::result::{sw_code_t, sw_result_t};

/// A receiver of start-stop fields from an oversampled line. Its content is private.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_nrz_t {
    pub(crate) _private: [MaybeUninit<u64>; 9],
}
state!(sw_nrz_t, Receiver, 0x91);

/// A field that was received.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_nrz_field_t {
    /// The sample with which its start bit begins, from the first of the line.
    pub start: u64,
    /// Spikes that were dropped before it.
    pub spikes: u32,
    /// The data bits, first of the line in bit 0.
    pub content: u16,
    /// The level of its delimiter: 1 in a sound field.
    pub delimiter: u8,
}

/// Prepares a receiver: samples per bit, and data bits per field (8 for a UART).
#[unsafe(no_mangle)]
pub extern "C" fn sw_nrz_start(
    receiver: Option<&mut MaybeUninit<sw_nrz_t>>,
    samples_per_bit: u32,
    content_bits: u32,
) -> sw_result_t {
    border(|| {
        let format = in_range(Format::new(samples_per_bit, content_bits).ok())?;
        sw_nrz_t::start(receiver, Receiver::new(format))?;
        OK
    })
}

/// Takes `samples` samples of one level (0 or 1) at once; a run ends at most one field. SW_OK with a field,
/// SW_PENDING without.
#[unsafe(no_mangle)]
pub extern "C" fn sw_nrz_run(
    receiver: Option<&mut sw_nrz_t>,
    level: u8,
    samples: u64,
    field: Option<&mut MaybeUninit<sw_nrz_field_t>>,
) -> sw_result_t {
    border(|| {
        let (receiver, field) = (sw_nrz_t::get(receiver)?, there(field)?);
        let level = in_range((level < 2).then_some(level == 1))?;
        let Some(Field { content, delimiter, start, spikes }) = receiver.run(level, samples) else {
            return Ok(sw_code_t::SW_PENDING as sw_result_t);
        };
        field.write(sw_nrz_field_t { start, spikes, content, delimiter: delimiter.into() });
        OK
    })
}
