//! The vendor's driver of release 9.2, quirks included. Only what the reply carries is compared; the rest of the driver's
//! state is left over from earlier replies. Undone here: ES and the identification code are mirrored, EEPROM data
//! are mirrored, temperatures are cut to whole degrees, a reset is sent nine times, `abs` of ABS40 is the single turn
//! alone, and `enc_cmd` is stale after commands 21 and 22.

use nikon_aformat::BitOrder::MsbFirst;
use nikon_aformat::{
    Body, Command, Data, EncoderId, Expected, Layout, Operation, Request, Resolution, Response, UserAddress,
};
use serde::Deserialize;

use super::reply::words;
use super::value::shown;
use super::{class, command, or_unreadable};
use crate::hex::Hex;
use crate::row::{Verdict, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriverRow {
    #[serde(rename = "rx_responses_n")]
    _rx_responses_n: usize,
    cmd: u8,
    words: Vec<Hex>,
    st_bits: u8,
    mt_bits: u8,
    driver: Driver,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Driver {
    abs: u64,
    multi_turn: u32,
    angle_f32_bits: Hex,
    temperature_int: u32,
    identification_code_raw: u32,
    enc_status_raw: u8,
    enc_cmd: u8,
    enc_addr: u8,
    crc_received: u8,
    crc_calculated: u8,
    requests_sent: u8,
    raw_data1: u16,
    raw_data2: u16,
    alm_flags: [u8; 11],
}

/// The layout of a version 2.1 reply to a command, whatever its arguments.
fn layout(command: Command, resolution: Resolution) -> Layout {
    let id = EncoderId::default();
    let with_arguments = match command {
        Command::EepromRead => Operation::EepromRead { address: 0 },
        Command::EepromWrite => Operation::EepromWrite { address: UserAddress::default(), data: 0 },
        Command::IdWrite1 => Operation::IdWrite1 { id },
        Command::IdWrite2 => Operation::IdWrite2 { id },
        _ => Operation::SetAddress2 { id },
    };
    let operation = Operation::without_arguments(command).unwrap_or(with_arguments);
    Request::new(nikon_aformat::EncoderAddress::ZERO, operation).layout(resolution)
}

pub(super) fn driver(_: &str, row: DriverRow) -> Verdict {
    let command = command(row.cmd)?;
    let resolution = or_unreadable(Resolution::new(row.st_bits, row.mt_bits))?;
    let expected = Expected::new(layout(command, resolution), command);
    let words = words(&row.words);
    let response = match Response::parse_words(&expected, &words, MsbFirst) {
        Ok(response) => response,
        Err(error) => return same("outcome", &"good", &class(error)),
    };
    let driver = row.driver;
    same("enc_addr", &driver.enc_addr, &response.ea.get())?;
    let crc = response.emit().crc().want;
    same("crc", &(driver.crc_received, driver.crc_calculated), &(crc, crc))?;
    let ninth = u8::from(command.is_reset());
    same("requests_sent", &driver.requests_sent, &(command.repeats() + ninth))?;
    match response.body {
        Body::Abs17 { es_any, .. } => same("enc_status_raw", &driver.enc_status_raw, &es_any.into())?,
        Body::Full { command, es, .. } => {
            same("enc_cmd", &driver.enc_cmd, &command.code())?;
            same("enc_status_raw", &driver.enc_status_raw, &(es.bits().reverse_bits() >> 4))?;
        }
    }
    position(&driver, response, resolution)?;
    data(&driver, response)?;
    raw(&driver, response, &words)
}

fn position(driver: &Driver, response: Response, resolution: Resolution) -> Verdict {
    if let Some(Data::Abs24High { abs }) = response.data() {
        return same("abs", &driver.abs, &abs.get().into());
    }
    let Some(abs) = response.abs() else { return Ok(()) };
    let position = shown(resolution, response);
    let whole = response.abs40().is_some();
    let single_turn = position.as_ref().map(|p| u64::from(p.single_turn));
    same("abs", &driver.abs, &single_turn.filter(|_| whole).unwrap_or(abs))?;
    let Some(position) = position else { return Ok(()) };
    same("multi_turn", &driver.multi_turn, &position.turns)?;
    let angle = u64::from(resolution.degrees_f32(position.single_turn).to_bits());
    same("angle_f32_bits", &driver.angle_f32_bits.0, &angle)
}

fn data(driver: &Driver, response: Response) -> Verdict {
    if let Some(temperature) = response.temperature() {
        same("temperature_int", &driver.temperature_int, &(temperature.milli_celsius() / 1000))?;
    }
    if let Some(alm) = response.alm() {
        same("alm_flags", &driver.alm_flags, &std::array::from_fn(|k| u8::from(alm.bits() >> k & 1 == 1)))?;
    }
    match response.data() {
        Some(Data::Id { id }) => {
            same("identification_code_raw", &driver.identification_code_raw, &(id.get().reverse_bits() >> 8))
        }
        Some(Data::Eeprom { data, address }) => {
            let mirrored = (data.reverse_bits(), u16::from(address));
            same("EEPROM data and address", &(driver.raw_data1, driver.raw_data2), &mirrored)
        }
        _ => Ok(()),
    }
}

/// The content bits as the driver keeps them: the second word, and the third without the CRC-8 if that is in it.
fn raw(driver: &Driver, response: Response, words: &[u16]) -> Verdict {
    let shown = match (response.layout(), words) {
        (Layout::Abs40 | Layout::Abs24Status | Layout::Abs24Temp, [_, second, third, _]) => (*second, *third),
        (Layout::Abs24 | Layout::Abs24High | Layout::Status | Layout::Temperature, [_, second, third]) => {
            (*second, third >> 8)
        }
        _ => return Ok(()),
    };
    same("raw data", &(driver.raw_data1, driver.raw_data2), &shown)
}
