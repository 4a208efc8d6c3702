//! Registers and words of the DRV8711.

use std::collections::BTreeMap;

use serde::Deserialize;
use servowire_drivers::drv8711::{IsGain, Register, Word, full_scale_microamps};

use super::Origin;
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

type Fields = BTreeMap<String, u16>;

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum Drv8711 {
    ReadCommand {
        #[serde(rename = "origin")]
        _origin: Origin,
        register: String,
        address: u8,
        spi_word: Hex,
    },
    Reset {
        #[serde(rename = "origin")]
        _origin: Origin,
        register: String,
        address: u8,
        value: u16,
        fields: Fields,
        write_word: Hex,
    },
    Write {
        #[serde(rename = "origin")]
        _origin: Origin,
        register: String,
        address: u8,
        fields: Fields,
        value: u16,
        write_word: Hex,
        spi_bytes: Bytes,
    },
    ReadResponse {
        #[serde(rename = "origin")]
        _origin: Origin,
        register: String,
        address: u8,
        miso_word: Hex,
        value: u16,
        fields: Fields,
    },
    TorqueReadback {
        #[serde(rename = "origin")]
        _origin: Origin,
        written: Hex,
        reads_back_data: Hex,
    },
    FullScaleCurrent {
        #[serde(rename = "origin")]
        _origin: Origin,
        isgain_code: u8,
        isgain: u8,
        torque: u8,
        rsense_milliohm: u16,
        i_fs_microamp_floor: u32,
    },
}

fn register(name: &str, address: u8) -> Result<Register, Fault> {
    let register = Register::from_code(address).ok_or_else(|| Fault::Unreadable(format!("address {address}")))?;
    same("register", &name, &register.name())?;
    Ok(register)
}

fn taken_apart(register: Register, value: u16) -> Fields {
    register.fields().iter().map(|field| (field.name.to_ascii_lowercase(), field.get(value))).collect()
}

fn put_together(register: Register, fields: &Fields) -> u16 {
    let code = |name: &str| fields.get(&name.to_ascii_lowercase()).copied().unwrap_or(0);
    register.fields().iter().fold(0, |value, field| field.set(value, code(field.name)))
}

pub(super) fn drv8711(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Drv8711| match row {
        Drv8711::ReadCommand { register: name, address, spi_word, .. } => {
            same("spi_word", &spi_word.0, &register(&name, address)?.read().bits().into())
        }
        Drv8711::Reset { register: name, address, value, fields, write_word, .. } => {
            let register = register(&name, address)?;
            same("value", &value, &register.reset_value())?;
            same("fields", &fields, &taken_apart(register, value))?;
            same("write_word", &write_word.0, &register.write(value).bits().into())
        }
        Drv8711::Write { register: name, address, fields, value, write_word, spi_bytes, .. } => {
            let register = register(&name, address)?;
            same("value", &value, &put_together(register, &fields))?;
            same("fields", &fields, &taken_apart(register, value))?;
            same("write_word", &write_word.0, &register.write(value).bits().into())?;
            same("spi_bytes", &spi_bytes.0, &register.write(value).to_bytes().to_vec())
        }
        Drv8711::ReadResponse { register: name, address, miso_word, value, fields, .. } => {
            let register = register(&name, address)?;
            same("value", &value, &Word::answer((miso_word.0 as u16).to_be_bytes()))?;
            same("fields", &fields, &taken_apart(register, value))
        }
        Drv8711::TorqueReadback { written, reads_back_data, .. } => {
            let (written, read) = (written.0 as u16, reads_back_data.0 as u16);
            same("written", &Register::Torque.write(written & 0xfff).bits(), &written)?;
            same("reads_back_data", &read, &(written & Register::Torque.read_back_mask()))?;
            same("verified", &Ok(()), &Register::Torque.verify(written & 0xfff, read))
        }
        Drv8711::FullScaleCurrent { isgain_code, isgain, torque, rsense_milliohm, i_fs_microamp_floor, .. } => {
            let gain = IsGain::from_code(isgain_code).ok_or_else(|| Fault::Unreadable("isgain_code".to_owned()))?;
            same("isgain", &isgain, &gain.factor())?;
            let microamps = full_scale_microamps(torque, gain, rsense_milliohm);
            same("i_fs_microamp_floor", &Some(i_fs_microamp_floor), &microamps)
        }
    })
}
