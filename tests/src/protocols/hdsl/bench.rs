//! A receiver with its register map, fed with answers.

use hdsl::Dialect;
use hdsl::master::{HFrame, Master};
use hdsl::message::{Access, Offset, ShortRequest};
use hdsl::registers::{Register, Registers};
use hdsl::sampling::line;

use crate::row::Fault;

#[derive(Clone, Copy)]
pub(super) struct Bench {
    pub(super) master: Master,
    pub(super) map: Registers,
}

fn unreadable(error: hdsl::Error) -> Fault {
    Fault::Unreadable(error.to_string())
}

impl Bench {
    pub(super) fn new(dialect: Dialect) -> Self {
        Self { master: Master::new(dialect), map: Registers::new(&dialect) }
    }

    pub(super) fn hear(&mut self, samples: &[u8]) -> Result<HFrame, Fault> {
        let h_frame = *self.master.hear(samples, 0).map_err(unreadable)?;
        let _ = self.map.apply(&h_frame);
        Ok(h_frame)
    }

    /// An answer after one bit of delay.
    pub(super) fn feed(&mut self, bits: u64) -> Result<HFrame, Fault> {
        self.hear(&line(bits, 8))
    }

    pub(super) fn write(&mut self, address: u8, value: u8) -> Result<(), Fault> {
        self.map.write(&mut self.master, address, value).map_err(unreadable)
    }

    /// A short message as an application starts it.
    pub(super) fn short(&mut self, request: ShortRequest) -> Result<(), Fault> {
        // Bit 6 is not looked at; without it a write to 7Fh would be the idle mark.
        let index = request.register().address();
        match request {
            ShortRequest::Read(_) => self.write(Register::SlaveRegCtrl as u8, 0x80 | index),
            ShortRequest::Write(_, value) => {
                self.write(Register::SPcData as u8, value)?;
                self.write(Register::SlaveRegCtrl as u8, index)
            }
        }
    }

    /// A long message as an application starts it; `header` are the first two bytes of the request.
    pub(super) fn long(&mut self, header: [u8; 2], offset: Option<Offset>, access: &Access) -> Result<(), Fault> {
        if let Access::Write(data) = access {
            for (at, byte) in (Register::PcBuffer as u8..).zip(data.as_bytes()) {
                self.write(at, *byte)?;
            }
        }
        if let Some(offset) = offset {
            let [high, low] = offset.get().to_be_bytes();
            self.write(Register::PcOff as u8, 0x80 | high)?;
            self.write(Register::PcOff as u8 + 1, low)?;
        }
        self.write(Register::PcAdd as u8, header[0])?;
        self.write(Register::PcAdd as u8 + 1, header[1])?;
        self.write(Register::PcCtrl as u8, 1)
    }
}
