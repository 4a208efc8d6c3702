//! The registers and resources that messages reach in the encoder, with their own constants.

use super::behaviour::Acknowledgement;
use super::channel::Message;
use crate::message::RemoteRegister;

/// A resource: a name, its attributes and up to eight bytes of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resource {
    /// Its address, 10 bits.
    pub address: u16,
    /// Its name, filled up with spaces.
    pub name: [u8; 8],
    /// Number of data bytes, 0..=8.
    pub size: u8,
    /// Access level needed to read.
    pub read_level: u8,
    /// Access level needed to write; 15 means that nobody may.
    pub write_level: u8,
    /// The time-out stated by the encoder, in ms.
    pub timeout_ms: u8,
    /// Data type.
    pub data_type: u8,
    /// The data; `size` says how many bytes.
    pub data: [u8; 8],
}

/// Registers and resources of a simulated encoder.
///
/// * direct read: the name without an offset or with offset 0, attributes 1..=5 as two bytes;
/// * indirect read and write: the data, from the offset onwards;
/// * writing a status register clears it, reading SRSSI sets it to 7.
///
/// Refusals (class, detail): 40h, 10h unknown resource; 41h, 10h no right to write; 40h, 13h offset after the data.
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

/// The level at which nobody may write.
const READ_ONLY: u8 = 15;
/// The index of SRSSI among the 64 registers, and the value to which reading resets it.
const SRSSI: usize = 0x3c;
const SRSSI_BEST: u8 = 7;

/// Class and detail of a refusal.
const NOT_THERE: [u8; 2] = [0x40, 0x10];
const OFFSET_TOO_HIGH: [u8; 2] = [0x40, 0x13];
const NOT_WRITABLE: [u8; 2] = [0x41, 0x10];

impl Resources {
    /// Creates ROOT, RESOLUTN (8388608 steps per turn), EESIZE, and a user file of eight bytes at 131h. SRSSI is 7, PING 1.
    pub const fn new() -> Self {
        let mut registers = [0; 64];
        let [.., srssi, _, _, ping] = &mut registers;
        *srssi = SRSSI_BEST;
        *ping = 1;
        Self {
            registers,
            all: [
                resource(0x000, *b"ROOT    ", 0, READ_ONLY, [0; 8]),
                resource(0x081, *b"RESOLUTN", 4, READ_ONLY, [0, 0x80, 0, 0, 0, 0, 0, 0]),
                resource(0x087, *b"EESIZE  ", 2, READ_ONLY, [0x20, 0, 0, 0, 0, 0, 0, 0]),
                resource(0x131, *b"RWFILE  ", 8, 0, [0; 8]),
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
        self.registers.get(usize::from(register.address() & 0x3f)).copied().unwrap_or(0)
    }

    /// Sets a register from inside the encoder.
    ///
    /// ```
    /// use hdsl::EncoderId;
    /// use hdsl::device::Device;
    /// use hdsl::message::RemoteRegister;
    /// let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
    /// // Bit 0 of ENC_ST0: the encoder was reset. SUMMARY shows it in every V-frame.
    /// encoder.resources_mut().set_register(RemoteRegister::ENC_ST0, 0x01);
    /// assert_eq!(encoder.resources().summary(), 0x01);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_register(&mut self, register: RemoteRegister, value: u8) {
        if let Some(place) = self.registers.get_mut(usize::from(register.address() & 0x3f)) {
            *place = value;
        }
    }

    /// Executes a sound request and returns its answer; writes are acknowledged as `acknowledgement` says.
    pub(super) fn answer(&mut self, request: &Message, acknowledgement: Acknowledgement) -> Message {
        match request.bytes() {
            [first @ 0x80..=0xff, low, rest @ ..] => self.long(*first, *low, rest, acknowledgement),
            [first, rest @ ..] => self.short(*first, rest.first().copied()),
            // Never: a request has a byte.
            [] => Message::new(&[]),
        }
    }

    fn short(&mut self, first: u8, value: Option<u8>) -> Message {
        let at = usize::from(first & 0x3f);
        let Some(register) = self.registers.get_mut(at) else { return Message::new(&[]) };
        if let Some(value) = value {
            *register = if at < 8 { 0 } else { value };
            return Message::new(&[&[first]]);
        }
        let value = *register;
        if at == SRSSI {
            *register = SRSSI_BEST;
        }
        Message::new(&[&[first, value]])
    }

    /// ADD_H: 1, read, offset, indirect, two bits of length, two of the address.
    fn long(&mut self, first: u8, low: u8, rest: &[u8], acknowledgement: Acknowledgement) -> Message {
        let (read, with_offset, indirect) = (first & 0x40 != 0, first & 0x20 != 0, first & 0x10 != 0);
        let (offset, data) = match rest {
            [high, low, data @ ..] if with_offset => (u16::from_be_bytes([high & 0x7f, *low]), data),
            data => (0, data),
        };
        let address = u16::from_be_bytes([first & 3, low]);
        let result = match self.all.iter_mut().find(|resource| resource.address == address) {
            None => Err(NOT_THERE),
            Some(resource) if read && indirect => resource.read(offset),
            Some(resource) if read => resource.attribute(offset),
            Some(resource) => resource.write(indirect, offset, data).map(|()| [0; 8]),
        };
        let length = match first >> 2 & 3 {
            0 => 0,
            1 => 2,
            2 => 4,
            _ => 8,
        };
        match result {
            Ok(data) if read => Message::new(&[&[first & !0x20, low], data.get(..length).unwrap_or(&[])]),
            Ok(_) if acknowledgement == Acknowledgement::RepeatsLength => Message::new(&[&[first & !0x20, low]]),
            Ok(_) => Message::new(&[&[first & !0x2c, low]]),
            // An error is marked where requests have their offset, and has two bytes.
            Err([class, detail]) => Message::new(&[&[first & !0x0c | 0x24, low], &[detail, class]]),
        }
    }
}

const fn resource(address: u16, name: [u8; 8], size: u8, write_level: u8, data: [u8; 8]) -> Resource {
    Resource { address, name, size, read_level: 0, write_level, timeout_ms: 70, data_type: 0, data }
}

impl Resource {
    fn attribute(&self, offset: u16) -> Result<[u8; 8], [u8; 2]> {
        let value = match offset {
            0 => return Ok(self.name),
            1 => self.size,
            2 => self.read_level,
            3 => self.write_level,
            4 => self.timeout_ms,
            5 => self.data_type,
            _ => return Err(OFFSET_TOO_HIGH),
        };
        Ok([0, value, 0, 0, 0, 0, 0, 0])
    }

    /// Returns the bytes from `offset`, followed by zeros.
    fn read(&self, offset: u16) -> Result<[u8; 8], [u8; 2]> {
        if offset > u16::from(self.size) {
            return Err(OFFSET_TOO_HIGH);
        }
        let mut out = [0; 8];
        for (to, from) in out.iter_mut().zip(self.data.iter().skip(usize::from(offset))) {
            *to = *from;
        }
        Ok(out)
    }

    fn write(&mut self, indirect: bool, offset: u16, data: &[u8]) -> Result<(), [u8; 2]> {
        if !indirect || self.write_level >= READ_ONLY {
            return Err(NOT_WRITABLE);
        }
        let end = usize::from(offset).saturating_add(data.len());
        if end > usize::from(self.size) {
            return Err(OFFSET_TOO_HIGH);
        }
        for (to, from) in self.data.iter_mut().skip(usize::from(offset)).zip(data) {
            *to = *from;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(resources: &mut Resources, request: &[u8]) -> std::vec::Vec<u8> {
        resources.answer(&Message::new(&[request]), Acknowledgement::Empty).bytes().to_vec()
    }

    /// SICK manual, p. 57: SRSSI keeps the worst value until it is read; writing a status register clears it (p. 79).
    #[test]
    fn registers() {
        let mut resources = Resources::new();
        resources.set_register(RemoteRegister::SRSSI, 3);
        assert_eq!((ask(&mut resources, &[0x7c]), ask(&mut resources, &[0x7c])), ([0x7c, 3].into(), [0x7c, 7].into()));
        for (at, summary) in (0x40..).zip([0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80]) {
            let status = RemoteRegister::new(at).unwrap();
            resources.set_register(status, 0x10);
            assert_eq!(resources.summary(), summary);
            assert_eq!(ask(&mut resources, &[at]), [at, 0x10]);
            assert_eq!(ask(&mut resources, &[at - 0x40, 0xff]), [at - 0x40]);
            assert_eq!((resources.register(status), resources.summary()), (0, 0));
        }
        // The first register that keeps what is written.
        assert_eq!(ask(&mut resources, &[0x08, 0xff]), [0x08]);
        assert_eq!(ask(&mut resources, &[0x48]), [0x48, 0xff]);
    }

    /// Attributes (SICK manual, p. 87), contents, and the refusals of table 43.
    #[test]
    fn contents_and_refusals() {
        let mut resources = Resources::new();
        let [.., file] = &mut resources.all;
        (file.read_level, file.data_type) = (1, 0x0b);
        // Direct reads of 131h with offsets 0 to 6.
        assert_eq!(ask(&mut resources, &[0xfd & !0x10, 0x31, 0x80, 0]), *b"\xcd\x31RWFILE  ");
        for (offset, value) in [(1, 8), (2, 1), (3, 0), (4, 70), (5, 0x0b)] {
            assert_eq!(ask(&mut resources, &[0xe5, 0x31, 0x80, offset]), [0xc5, 0x31, 0, value]);
        }
        assert_eq!(ask(&mut resources, &[0xe5, 0x31, 0x80, 6]), [0xe5, 0x31, 0x13, 0x40]);
        // Indirect write of four bytes at offset 4, the last place; with and without the length in the acknowledgement.
        let write = [0xb9, 0x31, 0x80, 4, 1, 2, 3, 4];
        assert_eq!(ask(&mut resources, &write), [0x91, 0x31]);
        assert_eq!(resources.answer(&Message::new(&[&write]), Acknowledgement::RepeatsLength).bytes(), [0x99, 0x31]);
        assert_eq!(ask(&mut resources, &[0xb9, 0x31, 0x80, 5, 1, 2, 3, 4]), [0xb5, 0x31, 0x13, 0x40]);
        assert_eq!(ask(&mut resources, &[0xdd, 0x31]), [0xdd, 0x31, 0, 0, 0, 0, 1, 2, 3, 4]);
        assert_eq!(ask(&mut resources, &[0xf5, 0x31, 0x80, 6]), [0xd5, 0x31, 3, 4]);
        assert_eq!(ask(&mut resources, &[0xf5, 0x31, 0x80, 8]), [0xd5, 0x31, 0, 0]);
        assert_eq!(ask(&mut resources, &[0xf5, 0x31, 0x80, 9]), [0xf5, 0x31, 0x13, 0x40]);
        // Without an offset the first two bytes are data; without a length nothing is asked for.
        assert_eq!(ask(&mut resources, &[0x99, 0x31, 0x80, 1, 0x80, 2]), [0x91, 0x31]);
        assert_eq!(ask(&mut resources, &[0xdd, 0x31]), [0xdd, 0x31, 0x80, 1, 0x80, 2, 1, 2, 3, 4]);
        assert_eq!(ask(&mut resources, &[0xd1, 0x31]), [0xd1, 0x31]);
        // 081h cannot be written, a name neither; 0FFh is not there.
        assert_eq!(ask(&mut resources, &[0x94, 0x81, 0, 1]), [0xb4, 0x81, 0x10, 0x41]);
        assert_eq!(ask(&mut resources, &[0x85, 0x31, 0, 1]), [0xa5, 0x31, 0x10, 0x41]);
        assert_eq!(ask(&mut resources, &[0xd4, 0xff]), [0xf4, 0xff, 0x10, 0x40]);
        // 8,388,608 steps a turn, the highest byte first.
        assert_eq!(ask(&mut resources, &[0xd8, 0x81]), [0xd8, 0x81, 0x00, 0x80, 0x00, 0x00]);
    }
}
