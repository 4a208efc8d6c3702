//! A decoder of answers as one would write it from the text: bit by bit, check by check.

use tformat::{
    Abm, Abs, Adf, AllData, Almc, DataId, Error, Identification, Memory, MultiTurn, Request, Response, SingleTurn,
    StatusField,
};

/// The control field of ID 3, with which an encoder answers a damaged request too.
const CF3: u8 = 0x1a;

pub(crate) fn response(request: Request, bits: &[bool]) -> Result<Response, Error> {
    let id = request.data_id();
    let refusal_length = bits.len() >= 10 && data_bits(&bits[1..9]) == CF3;
    let want = if refusal_length { 11 } else { usize::from(id.response_fields()) };
    let fields = framed(bits, want)?;
    let cf = fields[0];
    if cf & 0x07 != 0x02 {
        return Err(Error::SinkCode { cf });
    }
    if (3..8).filter(|bit| cf >> bit & 1 == 1).count() % 2 == 1 {
        return Err(Error::Parity { cf });
    }
    let asked = id.control_field().get();
    if cf != asked && cf != CF3 {
        return Err(Error::CfMismatch { got: cf, want: asked });
    }
    let (got, before) = fields.split_last().expect("three fields at least");
    let sum = before.iter().fold(0, |sum, byte| sum ^ byte);
    if *got != sum {
        return Err(Error::Crc { got: *got, want: sum });
    }
    if cf != asked {
        return Err(Error::Rejected { sf: StatusField::from_bits_retain(fields[1]) });
    }
    let response = values(id, &fields);
    echoed(request, response)?;
    Ok(response)
}

/// `want` fields of ten bits, or the first fault of their framing.
fn framed(bits: &[bool], want: usize) -> Result<Vec<u8>, Error> {
    let mut fields = Vec::new();
    for field in 0..want {
        let truncated = Error::Truncated { got: field as u16, want: want as u16 };
        let field = field as u8;
        let bit = |at: usize| bits.get(usize::from(field) * 10 + at).copied();
        if bit(0) == Some(true) {
            return Err(Error::StartBit { field });
        }
        if bit(9) == Some(false) {
            return Err(Error::Delimiter { field });
        }
        let data: Option<Vec<bool>> = (1..9).map(bit).collect();
        match (bit(0), data, bit(9)) {
            (Some(_), Some(data), Some(_)) => fields.push(data_bits(&data)),
            _ => return Err(truncated),
        }
    }
    Ok(fields)
}

/// Eight bits, the first of the line the least significant.
fn data_bits(bits: &[bool]) -> u8 {
    bits.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit))
}

fn values(id: DataId, f: &[u8]) -> Response {
    let number = |at: usize| u32::from(f[at]) + 256 * u32::from(f[at + 1]) + 65536 * u32::from(f[at + 2]);
    let sf = StatusField::from_bits_retain(f[1]);
    let single = || SingleTurn { sf, abs: Abs::truncate(number(2)) };
    let memory = || Memory { adf: Adf::from_bits(f[1]), edf: f[2] };
    match id {
        DataId::ReadSingleTurn => Response::ReadSingleTurn(single()),
        DataId::ReadMultiTurn => Response::ReadMultiTurn(MultiTurn { sf, abm: Abm::truncate(number(2)) }),
        DataId::ReadEncoderId => Response::ReadEncoderId(Identification { sf, enid: f[2] }),
        DataId::ReadAll => Response::ReadAll(AllData {
            sf,
            abs: Abs::truncate(number(2)),
            enid: f[5],
            abm: Abm::truncate(number(6)),
            almc: Almc::from_bits_retain(f[9]),
        }),
        DataId::WriteEeprom => Response::WriteEeprom(memory()),
        DataId::ResetErrors => Response::ResetErrors(single()),
        DataId::SetSingleTurnZero => Response::SetSingleTurnZero(single()),
        DataId::ResetTurnsAndErrors => Response::ResetTurnsAndErrors(single()),
        DataId::ReadEeprom => Response::ReadEeprom(memory()),
    }
}

/// EEPROM answers repeat the address and, after a write that was done, the data.
fn echoed(request: Request, response: Response) -> Result<(), Error> {
    let (Response::WriteEeprom(memory) | Response::ReadEeprom(memory)) = response else { return Ok(()) };
    let (asked, written) = match request {
        Request::WriteEeprom { adf, edf } => (adf, Some(edf)),
        Request::ReadEeprom { adf } => (adf, None),
        _ => return Ok(()),
    };
    let (got, want) = (memory.adf.bits() & 0x7f, asked.bits() & 0x7f);
    if got != want {
        return Err(Error::AddressMismatch { got, want });
    }
    match written {
        Some(want) if memory.adf.bits() & 0x80 == 0 && memory.edf != want => {
            Err(Error::DataMismatch { got: memory.edf, want })
        }
        _ => Ok(()),
    }
}
