//! Meaning of raw values, and durations.

use core::mem::MaybeUninit;

use nikon_aformat::{Alm, Battery, BitRate, EncoderStatus, FRAME_BITS, Temperature, TypeWord, U10, U24, U40, Version};

use super::codec::{layout_of, resolution, sw_aformat_encoder_t};
use crate::border::{OK, Refused, border, in_range, there};
use crate::result::{sw_code_t, sw_result_t};

/// The content of the type word of the EEPROM.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_type_t {
    /// Bits of the single turn; 255 for a code that is not defined.
    pub st_bits: u8,
    /// Bits of the turns; 255 for a code that is not defined.
    pub mt_bits: u8,
    /// Battery: 0 none, 1 separate, 2 common; 255 for a code that is not defined.
    pub battery: u8,
    /// The code of the resolution.
    pub resolution_code: u8,
}

/// How long a request and its responses take on the line, ns, without the time that an encoder takes to turn around.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_times_t {
    /// A frame.
    pub frame_ns: u32,
    /// A response.
    pub response_ns: u32,
    /// A request and one response.
    pub one_ns: u32,
    /// A request of one frame and the responses of all encoders asked.
    pub all_ns: u32,
    /// The gap between responses.
    pub gap_ns: u32,
    /// A bit, ps.
    pub bit_ps: u32,
}

/// ES as an encoder with these alarms shows it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_es_of_alarms(alm: u16) -> u8 {
    EncoderStatus::of_alarms(Alm::from_bits_retain(alm)).bits()
}

/// The alarms that a version has: `version_3` false for 2.1, true for 3.0.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_known_alarms(version_3: bool) -> u16 {
    Alm::known(if version_3 { Version::V3_0 } else { Version::V2_1 }).bits()
}

/// A temperature, 10 bits, in 0.001 °C, as the specification counts it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_milli_celsius(raw: u16, milli_celsius: Option<&mut MaybeUninit<u32>>) -> sw_result_t {
    border(|| {
        let out = there(milli_celsius)?;
        out.write(Temperature(in_range(U10::new(raw))?).milli_celsius());
        OK
    })
}

/// The same if the bits are in two's complement, which no document states.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_signed_milli_celsius(
    raw: u16,
    milli_celsius: Option<&mut MaybeUninit<i32>>,
) -> sw_result_t {
    border(|| {
        let out = there(milli_celsius)?;
        out.write(Temperature(in_range(U10::new(raw))?).signed_milli_celsius());
        OK
    })
}

/// A type word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_parse_type(word: u16, it: Option<&mut MaybeUninit<sw_aformat_type_t>>) -> sw_result_t {
    border(|| {
        let (word, out) = (TypeWord(word), there(it)?);
        out.write(sw_aformat_type_t {
            st_bits: word.st_bits().unwrap_or(u8::MAX),
            mt_bits: word.mt_bits().unwrap_or(u8::MAX),
            battery: match word.battery() {
                Battery::None => 0,
                Battery::Separate => 1,
                Battery::Common => 2,
                Battery::Unknown(_) => u8::MAX,
            },
            resolution_code: word.resolution_code(),
        });
        OK
    })
}

/// The angle of a single-turn position, 0.001 degrees, rounded down.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_milli_degrees(
    encoder: Option<&sw_aformat_encoder_t>,
    single_turn: u32,
    milli_degrees: Option<&mut MaybeUninit<u32>>,
) -> sw_result_t {
    border(|| {
        let (resolution, out) = (resolution(*there(encoder)?)?, there(milli_degrees)?);
        out.write(resolution.milli_degrees(single_turn));
        OK
    })
}

/// The 40 bits of a position, of turn and turns.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_compose(
    encoder: Option<&sw_aformat_encoder_t>,
    single_turn: u32,
    turns: u32,
    abs: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| {
        let (resolution, out) = (resolution(*there(encoder)?)?, there(abs)?);
        out.write(resolution.compose(single_turn, turns).get());
        OK
    })
}

/// The 40 bits of a position from its halves of 24 bits, which overlap by eight (ABS24 and ABS24H).
/// SW_E_NO_VALUE if the overlapping bits differ.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_join(low24: u32, high24: u32, abs: Option<&mut MaybeUninit<u64>>) -> sw_result_t {
    border(|| {
        let (low, high, out) = (in_range(U24::new(low24))?, in_range(U24::new(high24))?, there(abs)?);
        out.write(U40::from_halves(low, high).ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?.get());
        OK
    })
}

fn rate(bits_per_second: u32) -> Result<BitRate, Refused> {
    in_range(BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second))
}

/// How long responses of a layout (sw_aformat_layout_t) take at a rate of the specification, in bit/s, when 1..8 encoders are asked.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_times(
    bits_per_second: u32,
    layout: u8,
    encoders: u8,
    times: Option<&mut MaybeUninit<sw_aformat_times_t>>,
) -> sw_result_t {
    border(|| {
        let (rate, layout, out) = (rate(bits_per_second)?, layout_of(layout)?, there(times)?);
        in_range((1..=8).contains(&encoders).then_some(()))?;
        out.write(sw_aformat_times_t {
            frame_ns: rate.bits_ns(FRAME_BITS),
            response_ns: rate.response_ns(layout),
            one_ns: rate.transaction_ns(layout, 1),
            all_ns: rate.transaction_ns(layout, encoders),
            gap_ns: rate.response_gap_ns(),
            bit_ps: rate.bit_ps(),
        });
        OK
    })
}
