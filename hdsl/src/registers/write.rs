//! The application's side of the map: the effect of writing and reading a register.

use super::{Register, RegisterRule, Registers};
use crate::error::Error;
use crate::master::Master;
use crate::message::{Access, Data, Length, LongRequest, Offset, RemoteRegister, ResourceAddress, ShortRequest};
use crate::sync::Es;

const SYS_CTRL: u8 = Register::SysCtrl as u8;
const SYNC_CTRL: u8 = Register::SyncCtrl as u8;
const EVENT_H: u8 = Register::EventH as u8;
const EVENT_L: u8 = Register::EventL as u8;
const MASK_H: u8 = Register::MaskH as u8;
const MASK_SUM: u8 = Register::MaskSum as u8;
/// Bit 6 of MASK_H: all bits of MASK_SUM ORed (SICK manual, p. 41).
const MSUM: u8 = 0x40;
const PC_ADD: u8 = Register::PcAdd as u8;
const PC_CTRL: u8 = Register::PcCtrl as u8;
const PIPE_S: u8 = Register::PipeS as u8;
const SAFE_CTRL: u8 = Register::SafeCtrl as u8;
const EVENT_S: u8 = Register::EventS as u8;
const SLAVE_REG_CTRL: u8 = Register::SlaveRegCtrl as u8;
const ACC_ERR_CNT: u8 = Register::AccErrCnt as u8;
const ACC_ERR_CNT_THRESH: u8 = Register::AccErrCntThresh as u8;

/// Returns whether only the receiver writes a register (SICK manual, p. 41-54); S_PC_DATA is written by the application
/// before a short write.
const fn is_read_only(address: u8) -> bool {
    matches!(address, 0x03 | 0x09..=0x1f | 0x2d..=0x2f | 0x36 | 0x44..=0x55)
}

impl Registers {
    /// Reads a register as an application does over the bus: reading PIPE_S takes the oldest entry from the FIFO and holds it
    /// for PIPE_D. `None` after the end of the map.
    pub fn read(&mut self, address: u8) -> Option<u8> {
        if address == PIPE_S && self.dialect.registers == RegisterRule::Sick {
            let entry = self.pipe.take();
            self.put(Register::PipeS, [entry.status, entry.data]);
        }
        self.byte(address)
    }

    /// Writes a register as an application does over the bus.
    ///
    /// Writing 0 to a bit of an event register clears it; 1 changes nothing with [`RegisterRule::Sick`], and sets the event
    /// in the memory of the SDK. PRST and MRST in SYS_CTRL or SAFE_CTRL, SYNC_CTRL, SLAVE_REG_CTRL and LSTA in PC_CTRL
    /// trigger their actions. With [`RegisterRule::Sick`], registers that the receiver writes cannot be written; all other
    /// registers take the value.
    ///
    /// # Errors
    /// [`Error::NotLocked`] and [`Error::Busy`] for messages that cannot be started; [`Error::NoPulse`],
    /// [`Error::PeriodTooShort`] and [`Error::ExtraOutOfRange`] for an ES that does not fit the pulse;
    /// [`Error::NoRegister`] after the end of the map. The register then keeps its value.
    pub fn write(&mut self, master: &mut Master, address: u8, value: u8) -> Result<(), Error> {
        let Some(present) = self.byte(address) else { return Err(Error::NoRegister { address }) };
        if self.dialect.registers == RegisterRule::Sick && is_read_only(address) {
            return Ok(());
        }
        match address {
            SYS_CTRL | SAFE_CTRL => self.control(master, address, value),
            EVENT_H | EVENT_L | EVENT_S if self.dialect.registers == RegisterRule::Sick => {
                self.set_byte(address, present & value);
            }
            SYNC_CTRL => {
                let es = Es::new(value);
                if value != 0 && es.is_none() {
                    return Err(Error::ExtraOutOfRange { extra: value.into() });
                }
                master.set_frames_per_pulse(es)?;
                self.set_byte(address, value);
            }
            SLAVE_REG_CTRL if value == 0x3f => {}
            SLAVE_REG_CTRL => {
                let register = RemoteRegister::of_index(value);
                let [data] = self.get(Register::SPcData);
                let read = value & 0x80 != 0;
                master.start_short(if read {
                    ShortRequest::Read(register)
                } else {
                    ShortRequest::Write(register, data)
                })?;
                self.set_byte(address, value);
                self.free(Register::OnlineStatus1, 1);
            }
            PC_CTRL if value & 1 != 0 => {
                master.start_long(self.request_in_registers()?)?;
                self.set_byte(address, 1);
                self.free(Register::OnlineStatusD, 2);
            }
            // In the SICK core a write to the counter sets its threshold.
            ACC_ERR_CNT | ACC_ERR_CNT_THRESH if self.dialect.registers == RegisterRule::Sick => {
                self.threshold(master, value.min(31));
            }
            ACC_ERR_CNT_THRESH => self.threshold(master, value),
            MASK_SUM if self.dialect.registers == RegisterRule::Sick => {
                self.set_byte(address, value);
                let [mask, _] = self.get(Register::MaskH);
                self.put(Register::MaskH, [if value == 0 { mask & !MSUM } else { mask | MSUM }]);
            }
            MASK_H if self.dialect.registers == RegisterRule::Sick => {
                self.set_byte(address, value & !MSUM | present & MSUM);
            }
            PC_ADD if self.dialect.registers == RegisterRule::Sick => self.set_byte(address, value | 0x80),
            _ => self.set_byte(address, value),
        }
        Ok(())
    }

    /// Handles PRST and MRST. Before the link is up, there is no message to drop.
    fn control(&mut self, master: &mut Master, address: u8, value: u8) {
        if value & 0x40 != 0 && master.reset_messages().is_ok() {
            self.put(Register::SlaveRegCtrl, [0x3f]);
            self.put(Register::PcCtrl, [0]);
        }
        if value & 0x80 != 0 {
            master.request_restart();
            self.set_byte(address, 0x80);
        }
    }

    fn threshold(&mut self, master: &mut Master, value: u8) {
        self.set_byte(ACC_ERR_CNT_THRESH, value);
        master.set_acceleration_threshold(value);
    }

    /// Clears FREL or FRES.
    fn free(&mut self, status: Register, flag: u8) {
        let [high, low] = self.get(status);
        self.put(status, [high, low & !flag]);
    }

    /// Returns the long message that PC_ADD, PC_OFF and PC_BUFFER describe.
    fn request_in_registers(&self) -> Result<LongRequest, Error> {
        let [high, low] = self.get(Register::PcAdd);
        let length = Length::in_header(high);
        let buffer: [u8; 8] = self.get(Register::PcBuffer);
        let access = if high & 0x40 != 0 {
            Access::Read(length)
        } else {
            Access::Write(Data::new(buffer.get(..length.bytes()).unwrap_or(&[]))?)
        };
        let offset = Offset::truncate(u16::from_be_bytes(self.get(Register::PcOff)));
        Ok(LongRequest {
            address: ResourceAddress::truncate(u16::from_be_bytes([high, low])),
            indirect: high & 0x10 != 0,
            offset: (high & 0x20 != 0).then_some(offset),
            access,
        })
    }
}
