//! Check values, positions, alarms, temperatures, times.

use nikon_aformat::{
    Alm, Battery, BitRate, Command, Crc3, Crc8, Data, EncoderAddress, EncoderStatus, Evidence, PmAlm, Policy,
    Resolution, Response, Temperature, Tolerated, TypeWord, U10, U40, Version, crc3,
};
use serde::Deserialize;

use super::{RowVersion, layout, or_unreadable};
use crate::hex::{Bits, Hex};
use crate::row::{Fault, Verdict, same};

/// The rows' names of the alarms, from bit 0 up.
const ALARMS: [&str; 16] = [
    "batt",
    "mt_err",
    "ov_flow",
    "ov_spd",
    "mem_err",
    "st_err",
    "ps_err",
    "busy",
    "mem_busy",
    "ov_temp",
    "inc_err",
    "ov_spd_s",
    "st_err_s",
    "ps_err_s",
    "busy_s",
    "inc_err_s",
];

/// The rows' names of the maintenance notices, by their flag.
const NOTICES: [(PmAlm, &str); 4] =
    [(PmAlm::INCW1, "incw_1"), (PmAlm::INCW2, "incw_2"), (PmAlm::IFW1, "ifw_1"), (PmAlm::IFW2, "ifw_2")];

/// The rows' names of the alarms that are set and that `version` has. That the crate's names stand at the same bits is
/// checked on the way: the rows write them with underscores.
pub(super) fn alarm_names(alm: Alm, version: Version) -> Vec<String> {
    let plain = |name: &str| name.replace('_', "").to_uppercase();
    let known = alm & Alm::known(version);
    known
        .iter_names()
        .map(|(name, flag)| {
            let row = ALARMS.get(flag.bits().trailing_zeros() as usize).copied().unwrap_or("none");
            if plain(row) == plain(name) { row.to_owned() } else { format!("{name} at the bit of {row}") }
        })
        .collect()
}

/// The rows' names of the maintenance notices that are set.
pub(super) fn notice_names(pm_alm: PmAlm) -> Vec<String> {
    NOTICES.into_iter().filter(|(flag, _)| pm_alm.contains(*flag)).map(|(_, name)| name.to_owned()).collect()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlarmRow {
    alm: u16,
    version: RowVersion,
    set: Vec<String>,
    summary_es: u8,
    wire_order_bits: Bits,
}

pub(super) fn alarm(_: &str, row: AlarmRow) -> Verdict {
    let alm = Alm::from_bits_retain(row.alm);
    same("set", &row.set, &alarm_names(alm, row.version.0))?;
    same("summary_es", &row.summary_es, &EncoderStatus::of_alarms(alm).bits())?;
    same("wire_order_bits", &row.wire_order_bits.0, &(0..16).map(|k| alm.bits() >> k & 1 == 1).collect())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CrcRow {
    crc: String,
    input_ascii: Option<String>,
    bit_order: Option<String>,
    wire_bits: Option<Bits>,
    expect: String,
}

/// The CRC-3 of the rows is written in binary, or in hex for the check value.
pub(super) fn crc(_: &str, row: CrcRow) -> Verdict {
    let bits = match (&row.wire_bits, &row.input_ascii, row.bit_order.as_deref()) {
        (Some(bits), None, None) => bits.0.clone(),
        (None, Some(text), Some(order)) => {
            let bit = |byte: u8, k: u8| byte >> if order == "msb_first_per_byte" { 7 - k } else { k } & 1 == 1;
            text.bytes().flat_map(|byte| (0..8).map(move |k| (byte, k))).map(|(byte, k)| bit(byte, k)).collect()
        }
        _ => return Err(Fault::Unreadable("neither bits nor a text with an order".to_owned())),
    };
    match row.crc.as_str() {
        "crc8" => {
            let whole = bits.iter().fold(Crc8::new(), |crc, bit| crc.bit(*bit)).get();
            same("crc8", &row.expect, &format!("{whole:02x}"))?;
            let packed = |bits: &[bool]| bits.iter().fold(0_u16, |word, bit| word << 1 | u16::from(*bit));
            let (bytes, words) = (bits.chunks_exact(8), bits.chunks_exact(16));
            if bytes.remainder().is_empty() {
                let bytes: Vec<u8> = bytes.map(|bits| packed(bits) as u8).collect();
                same("crc8 of bytes", &whole, &nikon_aformat::crc8(&bytes))?;
            }
            if words.remainder().is_empty() {
                same("crc8 by words", &whole, &words.fold(Crc8::new(), |crc, bits| crc.word(packed(bits))).get())?;
            }
            Ok(())
        }
        "crc3" => {
            let serial = bits.iter().fold(Crc3::new(), |crc, bit| crc.bit(*bit)).get();
            let want = match row.input_ascii {
                Some(_) => or_unreadable(u8::from_str_radix(&row.expect, 16))?,
                None => or_unreadable(u8::from_str_radix(&row.expect, 2))?,
            };
            same("crc3", &want, &serial)?;
            if bits.len() == 10 {
                let word = bits.iter().rev().fold(0, |word, bit| word << 1 | u16::from(*bit));
                same("crc3 of ten bits", &want, &crc3(word))?;
            }
            Ok(())
        }
        other => Err(Fault::Unreadable(format!("no check {other:?}"))),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MathRow {
    st_bits: u8,
    mt_bits: u8,
    abs40: u64,
    abs24_low: u32,
    abs24_high: u32,
    abs17: u32,
    single_turn: u32,
    turns: u32,
    turns_signed: Option<i16>,
    angle_deg_f64: f64,
    angle_deg_f32_bits: Hex,
    angle_milli_deg_floor: u32,
    abs40_from_high_and_low: u64,
}

/// The position of a response as the rows have it: of the turns whatever bits the response holds, with a sign only where there
/// are 16. The crate gives them whole or not at all.
pub(super) struct Shown {
    pub(super) single_turn: u32,
    pub(super) turns_bits: u8,
    pub(super) turns: u32,
    pub(super) signed: Option<i16>,
}

pub(super) fn shown(resolution: Resolution, response: Response) -> Option<Shown> {
    let at = |tolerated: Tolerated| {
        let tolerated = tolerated.status(EncoderStatus::all()).alarms(Alm::all());
        Evidence::of(response, resolution, 0).at(0, Policy::new(0).tolerating(tolerated)).ok()
    };
    let single_turn = at(Tolerated::SINGLE_TURN)?.single_turn();
    let turns_bits = response.layout().abs_bits().saturating_sub(resolution.st_bits()).min(resolution.mt_bits());
    let turns = response.abs()? >> resolution.st_bits() & ((1 << turns_bits) - 1);
    let signed = at(Tolerated::NOTHING).and_then(nikon_aformat::Sample::turns).filter(|_| turns_bits == 16);
    Some(Shown { single_turn, turns_bits, turns: turns as u32, signed: signed.and_then(|turns| turns.try_into().ok()) })
}

pub(super) fn decode_math(_: &str, row: MathRow) -> Verdict {
    let resolution = or_unreadable(Resolution::new(row.st_bits, row.mt_bits))?;
    let abs = or_unreadable(U40::try_from(row.abs40))?;
    same("abs24_low", &row.abs24_low, &abs.low24().get())?;
    same("abs24_high", &row.abs24_high, &abs.high24().get())?;
    same("abs17", &row.abs17, &abs.low17().get())?;
    let joined = U40::from_halves(abs.low24(), abs.high24()).map(U40::get);
    same("abs40_from_high_and_low", &Some(row.abs40_from_high_and_low), &joined)?;
    let whole = Response::new(EncoderAddress::ZERO, Command::Abs40, EncoderStatus::empty(), Data::Abs40 { abs });
    let position = or_unreadable(shown(resolution, whole).ok_or("a position with bits above the widths"))?;
    same("single_turn", &row.single_turn, &position.single_turn)?;
    same("turns", &row.turns, &position.turns)?;
    same("turns_signed", &row.turns_signed, &position.signed)?;
    same("angle_deg_f64", &row.angle_deg_f64, &resolution.degrees(position.single_turn))?;
    let single = u64::from(resolution.degrees_f32(position.single_turn).to_bits());
    same("angle_deg_f32_bits", &row.angle_deg_f32_bits.0, &single)?;
    same("angle_milli_deg_floor", &row.angle_milli_deg_floor, &resolution.milli_degrees(position.single_turn))?;
    same("composed", &abs, &resolution.compose(position.single_turn, position.turns))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypeWordRow {
    word: u16,
    resolution_code: u8,
    st_bits: Option<u8>,
    multi_turn_code: u16,
    mt_bits: Option<u8>,
    battery_code: u16,
    battery: Option<String>,
}

pub(super) fn type_word(_: &str, row: TypeWordRow) -> Verdict {
    let word = TypeWord(row.word);
    same("resolution_code", &row.resolution_code, &word.resolution_code())?;
    same("st_bits", &row.st_bits, &word.st_bits())?;
    same("multi_turn_code", &row.multi_turn_code, &(row.word >> 3 & 3))?;
    same("mt_bits", &row.mt_bits, &word.mt_bits())?;
    same("battery_code", &row.battery_code, &(row.word >> 5 & 3))?;
    let battery = match word.battery() {
        Battery::None => Some("none"),
        Battery::Separate => Some("separate"),
        Battery::Common => Some("common"),
        Battery::Unknown(_) => None,
    };
    same("battery", &row.battery.as_deref(), &battery)?;
    same("resolution", &(row.st_bits.is_some() && row.mt_bits.is_some()), &word.resolution().is_some())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TemperatureRow {
    temp_raw: u16,
    milli_celsius_unsigned: u32,
    whole_celsius_truncated: u32,
    milli_celsius_if_twos_complement: i32,
}

pub(super) fn temperature(_: &str, row: TemperatureRow) -> Verdict {
    let temperature = Temperature(or_unreadable(U10::try_from(row.temp_raw))?);
    same("milli_celsius_unsigned", &row.milli_celsius_unsigned, &temperature.milli_celsius())?;
    same("whole_celsius_truncated", &row.whole_celsius_truncated, &(temperature.milli_celsius() / 1000))?;
    let signed = temperature.signed_milli_celsius();
    same("milli_celsius_if_twos_complement", &row.milli_celsius_if_twos_complement, &signed)
}

/// The crate counts in whole nanoseconds and rounds up.
#[expect(clippy::cast_sign_loss, reason = "no time is negative")]
fn whole(ns: f64) -> u32 {
    ns.ceil() as u32
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TimingRow {
    mbps: String,
    bit_ns: f64,
    layout: String,
    response_frames: u8,
    response_bits: u32,
    response_ns: f64,
    one_frame_ns: f64,
    request_plus_response_ns_without_turnaround: f64,
    bus_gap_ns: u32,
    eight_encoders_ns_without_turnaround: f64,
}

pub(super) fn timing(_: &str, row: TimingRow) -> Verdict {
    let layout = layout(&row.layout)?;
    let rate = match row.mbps.as_str() {
        "2.5" => BitRate::Mbit2_5,
        "4" => BitRate::Mbit4,
        "6.67" => BitRate::Mbit6_67,
        "8" => BitRate::Mbit8,
        "16" => BitRate::Mbit16,
        other => return Err(Fault::Unreadable(format!("no rate {other:?}"))),
    };
    same("bit_ns", &row.bit_ns, &(f64::from(rate.bit_ps()) / 1000.0))?;
    same("response size", &(row.response_frames, row.response_bits), &(layout.frames(), layout.line_bits()))?;
    same("response_ns", &whole(row.response_ns), &rate.response_ns(layout))?;
    same("one_frame_ns", &whole(row.one_frame_ns), &rate.bits_ns(nikon_aformat::FRAME_BITS))?;
    let one = whole(row.request_plus_response_ns_without_turnaround);
    same("request_plus_response_ns_without_turnaround", &one, &rate.transaction_ns(layout, 1))?;
    same("bus_gap_ns", &row.bus_gap_ns, &rate.response_gap_ns())?;
    let eight = whole(row.eight_encoders_ns_without_turnaround);
    same("eight_encoders_ns_without_turnaround", &eight, &rate.transaction_ns(layout, 8))
}
