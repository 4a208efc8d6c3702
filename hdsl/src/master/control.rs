//! The application's side of the receiver: messages and writable registers.

use super::{Master, State};
use crate::Error;
use crate::message::{
    Access, Data, Finished, Length, LongAnswer, LongRequest, Offset, RemoteRegister, ResourceAddress, ResourceError,
    ShortRequest,
};
use crate::registers::{Event, EventS, Online1, OnlineD, Register};

impl Master {
    /// Starts the link anew at the end of the present frame (PRST).
    pub const fn request_restart(&mut self) {
        self.restart = true;
    }

    /// Drops all messages and tells the encoder so (MRST). What was under way ends with [`Error::Dropped`].
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete.
    pub fn reset_messages(&mut self) -> Result<Finished, Error> {
        self.check_link()?;
        for control in [Register::SysCtrl, Register::SafeCtrl] {
            self.registers.put(control, [0]);
        }
        self.registers.put(Register::SlaveRegCtrl, [0x3f]);
        self.registers.put(Register::PcCtrl, [0]);
        self.registers.set_d(OnlineD::FREL, true);
        self.registers.set_1(Online1::FRES, true);
        Ok(self.requester.reset())
    }

    /// Starts a short message; its end is in [`Report::finished`](super::Report::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_short(request)?;
        let (read, value) = match request {
            ShortRequest::Read(_) => (0x80, None),
            ShortRequest::Write(_, value) => (0, Some(value)),
        };
        self.registers.put(Register::SlaveRegCtrl, [read | request.register().index()]);
        if let Some(value) = value {
            self.registers.put(Register::SPcData, [value]);
        }
        self.registers.set_1(Online1::FRES, false);
        Ok(())
    }

    /// Starts a long message; its end is in [`Report::finished`](super::Report::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_long(&mut self, request: LongRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_long(request)?;
        let bytes = request.emit();
        if let Some(header) = bytes.as_bytes().first_chunk::<2>() {
            self.registers.put(Register::PcAdd, *header);
        }
        if let Some(offset) = request.offset {
            self.registers.put(Register::PcOff, (offset.get() | 0x8000).to_be_bytes());
        }
        if let Access::Write(data) = &request.access {
            self.put_buffer(data.as_bytes());
        }
        self.registers.put(Register::PcCtrl, [1]);
        self.registers.set_d(OnlineD::FREL.with(OnlineD::ANS), false);
        Ok(())
    }

    fn check_link(&self) -> Result<(), Error> {
        if self.state == State::Running && self.link.is_settled() { Ok(()) } else { Err(Error::NotLocked) }
    }

    /// Sets the first bytes of PC_BUFFER; the others keep their value.
    fn put_buffer(&mut self, bytes: &[u8]) {
        for (at, byte) in (Register::PcBuffer as u8..).zip(bytes) {
            self.registers.set_byte(at, *byte);
        }
    }

    pub(super) fn show_long(&mut self, result: &Result<LongAnswer, Error>) {
        if let Ok(answer) = result {
            if let Some(header) = answer.emit().as_bytes().first_chunk::<2>() {
                self.registers.put(Register::PcAdd, *header);
            }
            match answer.result {
                Ok(data) => self.put_buffer(data.as_bytes()),
                Err(ResourceError { class, detail }) if self.profile.error_class_first => {
                    self.put_buffer(&[class, detail]);
                }
                Err(ResourceError { class, detail }) => self.put_buffer(&[detail, class]),
            }
        } else {
            self.registers.set_d(OnlineD::ANS, true);
            self.registers.raise(Event::ANS);
        }
        self.registers.put(Register::PcCtrl, [0]);
        self.registers.set_d(OnlineD::FREL, true);
        self.registers.raise(Event::FREL);
    }

    /// Writes a register as an application does over the bus.
    ///
    /// Writing 0 to a bit of an event register clears it; PRST and MRST in SYS_CTRL or SAFE_CTRL, SLAVE_REG_CTRL and
    /// LSTA in PC_CTRL start what they stand for; all other registers take the value.
    ///
    /// # Errors
    /// [`Error::NotLocked`] and [`Error::Busy`] for what cannot be started; [`Error::Header`] behind the end of the map.
    /// The register keeps its value then.
    pub fn write(&mut self, address: u8, value: u8) -> Result<(), Error> {
        const SYS_CTRL: u8 = Register::SysCtrl as u8;
        const SAFE_CTRL: u8 = Register::SafeCtrl as u8;
        const EVENT_H: u8 = Register::EventH as u8;
        const EVENT_L: u8 = Register::EventL as u8;
        const EVENT_S: u8 = Register::EventS as u8;
        const SLAVE_REG_CTRL: u8 = Register::SlaveRegCtrl as u8;
        const PC_CTRL: u8 = Register::PcCtrl as u8;
        let Some(present) = self.registers.byte(address) else {
            return Err(Error::Header { got: u16::from(address), want: 0x55 });
        };
        match address {
            SYS_CTRL | SAFE_CTRL => {
                if value & 0x40 != 0 {
                    self.reset_messages()?;
                }
                if value & 0x80 != 0 {
                    self.request_restart();
                    self.registers.set_byte(address, value);
                }
                Ok(())
            }
            EVENT_H | EVENT_L | EVENT_S => {
                self.registers.set_byte(address, present & value);
                Ok(())
            }
            SLAVE_REG_CTRL if value == 0x3f => Ok(()),
            SLAVE_REG_CTRL => {
                let register = RemoteRegister::of_index(value);
                let [data] = self.registers.get(Register::SPcData);
                let write = value & 0x80 == 0;
                self.start_short(if write { ShortRequest::Write(register, data) } else { ShortRequest::Read(register) })
            }
            PC_CTRL if value & 1 != 0 => self.start_long(self.request_in_registers()?),
            _ => {
                self.registers.set_byte(address, value);
                Ok(())
            }
        }
    }

    /// The long message that PC_ADD, PC_OFF and PC_BUFFER describe.
    fn request_in_registers(&self) -> Result<LongRequest, Error> {
        let [high, low] = self.registers.get(Register::PcAdd);
        let address = ResourceAddress::try_from(u16::from_be_bytes([high & 3, low]))?;
        let length = Length::from_code(high >> 2);
        let buffer: [u8; 8] = self.registers.get(Register::PcBuffer);
        let access = if high & 0x40 != 0 {
            Access::Read(length)
        } else {
            Access::Write(Data::new(buffer.get(..length.bytes()).unwrap_or(&[]))?)
        };
        let [off_high, off_low] = self.registers.get(Register::PcOff);
        let offset = Offset::new(u16::from_be_bytes([off_high & 0x7f, off_low])).filter(|_| high & 0x20 != 0);
        Ok(LongRequest { address, indirect: high & 0x10 != 0, offset, access })
    }

    /// Takes the events that happened and clears them.
    pub fn take_events(&mut self) -> (Event, EventS) {
        let events = (self.registers.event(), self.registers.event_s());
        self.registers.put(Register::EventH, [0, 0]);
        self.registers.put(Register::EventS, [0]);
        events
    }
}
