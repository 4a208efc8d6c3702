//! Binary records of one size: a host's copies of its reception memory, one after another.

use super::hexlog::Burst;
use super::input::Input;
use crate::fault::{At, Fault};

/// A log of records.
pub struct Records {
    input: Input,
    size: usize,
    record: u64,
}

impl Records {
    /// Reads a log from its beginning; `size` in bytes.
    pub fn new(input: Input, size: usize) -> Self {
        Self { input, size: size.max(1), record: 0 }
    }

    /// Returns the file being read.
    pub(super) fn input(&mut self) -> &mut Input {
        &mut self.input
    }

    /// Returns the next record, numbered from 1; `None` at the end.
    pub fn burst(&mut self) -> Result<Option<Burst>, Fault> {
        let mut bytes = vec![0; self.size];
        self.record += 1;
        let at = At::Byte(self.record.saturating_sub(1).saturating_mul(self.size as u64));
        match self.input.read_full(&mut bytes, self.size) {
            Ok(0) => Ok(None),
            Ok(got) if got == self.size => Ok(Some(Burst::new(self.record, bytes))),
            Ok(got) => {
                let what = format!("the last record has {got} of {} bytes: it was cut off", self.size);
                Err(self.input.fault(at, what))
            }
            Err(e) => Err(self.input.io_fault(at, &e)),
        }
    }
}
