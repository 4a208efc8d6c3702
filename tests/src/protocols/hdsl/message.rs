//! Short and long messages.

use hdsl::Error;
use hdsl::message::{
    Access, Data, Length, LongAnswer, LongRequest, Offset, RemoteRegister, ResourceAddress, ResourceError, ShortAnswer,
    ShortRequest,
};
use serde::Deserialize;

use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(tag = "kind", deny_unknown_fields)]
enum Short {
    #[serde(rename = "short_read")]
    Read { reg: Hex, value: Hex, request: Bytes, answer: Bytes },
    #[serde(rename = "short_write")]
    Write { reg: Hex, value: Hex, request: Bytes, answer: Bytes },
    #[serde(rename = "short_read_bad_answer")]
    ReadBadAnswer { reg: Hex, answer: Bytes, flip: usize, error: String },
    #[serde(rename = "short_write_bad_answer")]
    WriteBadAnswer { reg: Hex, answer: Bytes, flip: usize, error: String },
}

pub(super) fn register(reg: Hex) -> Result<RemoteRegister, Fault> {
    RemoteRegister::new(reg.0 as u8).ok_or_else(|| Fault::Unreadable(format!("no register {reg:?}")))
}

fn short_good(want: ShortRequest, data: Option<u8>, request: &Bytes, answer: &Bytes) -> Verdict {
    same("request", &request.0, &want.emit().as_bytes().to_vec())?;
    same("request parsed", &Ok(want), &ShortRequest::parse(&request.0))?;
    let sent = ShortAnswer { register: want.register(), data };
    same("answer", &answer.0, &sent.emit().as_bytes().to_vec())?;
    same("answer parsed", &Ok(sent), &want.parse_answer(&answer.0))
}

/// The class of the refusal, and that the answer was good before the flip.
fn short_bad(request: ShortRequest, answer: &Bytes, flip: usize, error: &str) -> Verdict {
    let class = match request.parse_answer(&answer.0) {
        Err(Error::LongMessageStart { .. }) => "long_message_start",
        Err(Error::Crc { .. }) => "crc",
        Err(_) => "unexpected",
        Ok(_) => "accepted",
    };
    same("error", &error, &class)?;
    same("good before the flip", &true, &request.parse_answer(&flipped(answer, flip)).is_ok())
}

/// Bit `flip` inverted, counted from the most significant bit of the first byte.
fn flipped(bytes: &Bytes, flip: usize) -> Vec<u8> {
    let mut bytes = bytes.0.clone();
    if let Some(byte) = bytes.get_mut(flip / 8) {
        *byte ^= 0x80 >> (flip % 8);
    }
    bytes
}

pub(super) fn short_message(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Short| match row {
        Short::Read { reg, value, request, answer } => {
            short_good(ShortRequest::Read(register(reg)?), Some(value.0 as u8), &request, &answer)
        }
        Short::Write { reg, value, request, answer } => {
            short_good(ShortRequest::Write(register(reg)?, value.0 as u8), None, &request, &answer)
        }
        Short::ReadBadAnswer { reg, answer, flip, error } => {
            short_bad(ShortRequest::Read(register(reg)?), &answer, flip, &error)
        }
        Short::WriteBadAnswer { reg, answer, flip, error } => {
            // The value written is not part of the answer.
            short_bad(ShortRequest::Write(register(reg)?, 0), &answer, flip, &error)
        }
    })
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Long {
    Long {
        addr: Hex,
        read: bool,
        indirect: bool,
        llen: u8,
        offset: Option<u16>,
        data: Bytes,
        request: Bytes,
        answer: Bytes,
        result: String,
        error_code: Option<Bytes>,
        pc_buffer: Bytes,
    },
    LongBadAnswer {
        addr: Hex,
        read: bool,
        answer: Bytes,
        flip: usize,
        error: String,
    },
}

pub(super) fn address(addr: Hex) -> Result<ResourceAddress, Fault> {
    ResourceAddress::new(addr.0 as u16).ok_or_else(|| Fault::Unreadable(format!("no resource {addr:?}")))
}

pub(super) fn data(bytes: &Bytes) -> Result<Data, Fault> {
    Data::new(&bytes.0).map_err(|e| Fault::Unreadable(e.to_string()))
}

pub(super) fn request(
    addr: Hex,
    read: bool,
    indirect: bool,
    llen: u8,
    offset: Option<u16>,
    written: &Bytes,
) -> Result<LongRequest, Fault> {
    let access = if read {
        Access::Read(Length::from_code(llen).ok_or_else(|| Fault::Unreadable(format!("LLEN {llen}")))?)
    } else {
        let data = data(written)?;
        same("llen", &llen, &data.length().code())?;
        Access::Write(data)
    };
    let offset = offset.map(|o| Offset::new(o).ok_or_else(|| Fault::Unreadable(format!("offset {o}")))).transpose()?;
    Ok(LongRequest { address: address(addr)?, indirect, offset, access })
}

pub(super) fn long_message(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Long| match row {
        Long::Long {
            addr,
            read,
            indirect,
            llen,
            offset,
            data: row_data,
            request: sent,
            answer,
            result,
            error_code,
            pc_buffer,
        } => {
            let want = request(addr, read, indirect, llen, offset, &row_data)?;
            same("request", &sent.0, &want.emit().as_bytes().to_vec())?;
            same("request parsed", &Ok(want), &LongRequest::parse(&sent.0))?;
            let error = match error_code.as_ref().map(|code| code.0.as_slice()) {
                Some([detail, class]) => Some(ResourceError::new(*class, *detail)),
                Some(_) => return Err(Fault::Unreadable("error_code has two bytes".to_owned())),
                None => None,
            };
            same("result", &result.as_str(), &if error.is_some() { "error" } else { "ok" })?;
            let delivered = match error {
                Some(error) => Err(error),
                None => Ok(if read { data(&row_data)? } else { Data::NONE }),
            };
            let reply = LongAnswer::to(&want, delivered);
            same("answer", &answer.0, &reply.emit().as_bytes().to_vec())?;
            same("answer parsed", &Ok(reply), &LongAnswer::parse(&answer.0))?;
            let got = match want.parse_answer(&answer.0) {
                Ok(data) => data.as_bytes().to_vec(),
                Err(Error::Resource { error }) => vec![error.detail(), error.class_code()],
                Err(e) => return Err(Fault::Unreadable(e.to_string())),
            };
            same("pc_buffer", &pc_buffer.0, &got)
        }
        Long::LongBadAnswer { addr, read, answer, flip, error } => {
            let class = match LongAnswer::parse(&answer.0) {
                Err(Error::Crc { .. }) => "crc",
                Err(_) => "unexpected",
                Ok(_) => "accepted",
            };
            same("error", &error.as_str(), &class)?;
            let good = LongAnswer::parse(&flipped(&answer, flip));
            let got = good.map(|a| (a.address, a.read));
            same("good before the flip", &Ok((address(addr)?, read)), &got)
        }
    })
}
