//! Bytes 16-31 of the 32-byte mode.

use super::Drive;
use super::execute::text;
use crate::device::literals::{SUB_MONITOR, SUB_NORMAL, SUB_SYSTEM_ID, WRONG_NON_CYCLIC};
use crate::device::parameters::{SUB_FEED_FORWARD, SUB_RESPONSE_DATA};
use crate::device::wire::Sub;

impl Drive {
    /// Takes a sub block with the verdict of [`check`](crate::device::check()). Bytes 24-31 are valid even if the code is
    /// not.
    pub(super) fn serve_sub(&mut self, sub: [u8; 16], error: Option<u16>) {
        let [byte16, type_code, low, high, _, _, _, _, feed @ ..] = sub;
        let (code, index) = (byte16 & 0x0f, u16::from_le_bytes([low, high]));
        let [a, b, c, d, e, f, g, h] = feed;
        let feed = [i32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h])];
        for ((held, new), select) in self.sub_feed_forward.iter_mut().zip(feed).zip(SUB_FEED_FORWARD) {
            if self.parameters.value(select) != 0 {
                *held = new;
            }
        }
        let [data, ..] = SUB_RESPONSE_DATA.map(|pr| self.selected(pr, 0));
        let result = match (error, code) {
            (Some(code), _) => Err(code),
            (None, SUB_NORMAL) => Ok(data),
            (None, SUB_SYSTEM_ID) => text(type_code.into(), index),
            (None, SUB_MONITOR) => self.monitor(type_code.into(), index),
            (None, _) => Err(WRONG_NON_CYCLIC),
        };
        self.sub = match result {
            Ok(data1) => Sub::Done(code, type_code, index, data1),
            Err(error) => Sub::Refused(code, error),
        };
    }
}
