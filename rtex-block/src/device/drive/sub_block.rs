//! Bytes 16-31 of the 32-byte mode.

use super::Drive;
use super::execute::text;
use crate::block::LEN;
use crate::device::parameters::SUB_RESPONSE_DATA;
use crate::error_code::ErrorCode;
use crate::sub::SubResponse;
use crate::type_code::Nibble;

impl Drive {
    pub(super) fn serve_sub(&mut self, sub: &[u8; LEN], error: Option<ErrorCode>) {
        if let Some(code) = error {
            return self.refuse_sub(sub, code);
        }
        let [byte16, type_code, low, high, ..] = *sub;
        let (code, index) = (byte16 & 0x0f, u16::from_le_bytes([low, high]));
        let [data, ..] = SUB_RESPONSE_DATA.map(|pr| self.selected(pr, 0));
        let result = match code {
            0 => Ok(data),
            2 => text(type_code.into(), index),
            _ => self.monitor(type_code.into(), index),
        };
        match result {
            Ok(data1) => {
                let code = Nibble::truncate(code);
                self.sub = SubResponse { cmd_error: false, code, type_code, index, data1, ..self.sub };
            }
            Err(code) => self.refuse_sub(sub, ErrorCode(code)),
        }
    }

    pub(super) fn refuse_sub(&mut self, sub: &[u8; LEN], code: ErrorCode) {
        let echo = Nibble::truncate(sub[0]);
        self.sub = SubResponse { cmd_error: true, code: echo, type_code: 0, index: code.0, data1: 0, ..self.sub };
    }
}
