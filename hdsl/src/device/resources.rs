use crate::message::{
    Access, Data, Length, LongRequest, Offset, RemoteRegister, ResourceAddress, ResourceError, ShortAnswer,
    ShortRequest,
};

/// A resource: a name, its attributes and up to eight bytes of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resource {
    /// Its address.
    pub address: ResourceAddress,
    /// Its name, filled up with spaces.
    pub name: [u8; 8],
    /// Bytes of data.
    pub size: u8,
    /// Access level needed to read.
    pub read_level: u8,
    /// Access level needed to write; 15 is nobody.
    pub write_level: u8,
    /// Time-out that the encoder states, in ms.
    pub timeout_ms: u8,
    /// Data type.
    pub data_type: u8,
    /// The data, as many bytes as `size` says.
    pub data: [u8; 8],
}

/// Registers and resources of a simulated encoder.
///
/// * direct read: the name without an offset or with offset 0, attributes 1..=5 as two bytes;
/// * indirect read and write: the data, from the offset on.
///
/// Refusals: 40h/10h unknown resource, 41h/10h no right to write, 40h/13h offset after the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resources {
    registers: [u8; 64],
    /// The resources.
    pub all: [Resource; 4],
}

impl Default for Resources {
    fn default() -> Self {
        Self::new()
    }
}

/// Nobody may write.
const READ_ONLY: u8 = 15;

impl Resources {
    /// ROOT, RESOLUTN (8388608 steps a turn), EESIZE, and a user file of eight bytes at 131h. SRSSI is 7, PING 1.
    pub const fn new() -> Self {
        let mut registers = [0; 64];
        let [.., srssi, _, _, ping] = &mut registers;
        *srssi = 7;
        *ping = 1;
        Self {
            registers,
            all: [
                resource(ResourceAddress::ROOT, *b"ROOT    ", 0, READ_ONLY, [0; 8]),
                resource(ResourceAddress::RESOLUTN, *b"RESOLUTN", 4, READ_ONLY, [0, 0x80, 0, 0, 0, 0, 0, 0]),
                resource(ResourceAddress::EESIZE, *b"EESIZE  ", 2, READ_ONLY, [0x20, 0, 0, 0, 0, 0, 0, 0]),
                resource(ResourceAddress::RWFILE, *b"RWFILE  ", 8, 0, [0; 8]),
            ],
        }
    }

    /// SUMMARY: bit n is set while ENC_STn is not 0.
    pub fn summary(&self) -> u8 {
        let status = self.registers.iter().take(8);
        status.rev().fold(0, |summary, st| summary << 1 | u8::from(*st != 0))
    }

    /// A register.
    pub fn register(&self, register: RemoteRegister) -> u8 {
        self.registers.get(usize::from(register.index())).copied().unwrap_or(0)
    }

    /// Sets a register from inside the encoder.
    pub fn set_register(&mut self, register: RemoteRegister, value: u8) {
        if let Some(place) = self.registers.get_mut(usize::from(register.index())) {
            *place = value;
        }
    }

    /// What a short message does. Writing a status register clears it, reading SRSSI sets it to 7.
    pub fn short(&mut self, request: ShortRequest) -> ShortAnswer {
        let register = request.register();
        let data = match request {
            ShortRequest::Read(_) => {
                let value = self.register(register);
                if register == RemoteRegister::SRSSI {
                    self.set_register(register, 7);
                }
                Some(value)
            }
            ShortRequest::Write(_, value) => {
                let value = if register.index() < 8 { 0 } else { value };
                self.set_register(register, value);
                None
            }
        };
        ShortAnswer { register, data }
    }

    /// What a long message does.
    ///
    /// # Errors
    /// The refusal to be sent.
    pub fn long(&mut self, request: &LongRequest) -> Result<Data, ResourceError> {
        let unknown = ResourceError::NOT_THERE;
        let found = self.all.iter_mut().find(|resource| resource.address == request.address).ok_or(unknown)?;
        let offset = request.offset.map_or(0, Offset::get);
        match request.access {
            Access::Read(length) if request.indirect => found.read(offset, length),
            Access::Read(length) => found.attribute(offset, length),
            Access::Write(data) => found.write(request.indirect, offset, &data),
        }
    }
}

const fn resource(address: ResourceAddress, name: [u8; 8], size: u8, write_level: u8, data: [u8; 8]) -> Resource {
    Resource { address, name, size, read_level: 0, write_level, timeout_ms: 70, data_type: 0, data }
}

impl Resource {
    /// Up to `length` bytes of `bytes` from `offset` on, zeros behind them.
    fn cut(bytes: &[u8], offset: u16, length: Length) -> Data {
        let mut out = [0; 8];
        for (to, from) in out.iter_mut().zip(bytes.iter().skip(usize::from(offset))) {
            *to = *from;
        }
        Data::new(out.get(..length.bytes()).unwrap_or(&[])).unwrap_or(Data::NONE)
    }

    fn attribute(&self, offset: u16, length: Length) -> Result<Data, ResourceError> {
        let value = match offset {
            0 => return Ok(Self::cut(&self.name, 0, length)),
            1 => self.size,
            2 => self.read_level,
            3 => self.write_level,
            4 => self.timeout_ms,
            5 => self.data_type,
            _ => return Err(ResourceError::OFFSET_TOO_HIGH),
        };
        Ok(Self::cut(&[0, value], 0, length))
    }

    fn read(&self, offset: u16, length: Length) -> Result<Data, ResourceError> {
        if offset > u16::from(self.size) {
            return Err(ResourceError::OFFSET_TOO_HIGH);
        }
        Ok(Self::cut(&self.data, offset, length))
    }

    fn write(&mut self, indirect: bool, offset: u16, data: &Data) -> Result<Data, ResourceError> {
        if !indirect || self.write_level >= READ_ONLY {
            return Err(ResourceError::NOT_WRITABLE);
        }
        let end = usize::from(offset).saturating_add(data.as_bytes().len());
        if end > usize::from(self.size) {
            return Err(ResourceError::OFFSET_TOO_HIGH);
        }
        for (to, from) in self.data.iter_mut().skip(usize::from(offset)).zip(data.as_bytes()) {
            *to = *from;
        }
        Ok(Data::NONE)
    }
}
