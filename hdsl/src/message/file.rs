//! User files in the memory of the encoder: resources 130h to 134h (SICK manual, p. 126-132).

use super::access::AccessLevel;
use super::long::{Access, Data, Length, LongRequest};
use crate::error::Error;
use crate::resource::{Offset, ResourceAddress};

/// Name of a user file: 1 to 8 characters 20h..=7Eh, padded with 00h. Case counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "[u8; 8]", into = "[u8; 8]")
)]
pub struct FileName([u8; 8]);

impl FileName {
    /// Creates a file name; `None` unless `name` has 1 to 8 characters 20h..=7Eh.
    pub fn new(name: &str) -> Option<Self> {
        let mut bytes = [0; 8];
        if name.is_empty() || name.len() > bytes.len() || !name.bytes().all(|byte| matches!(byte, 0x20..=0x7e)) {
            return None;
        }
        for (to, from) in bytes.iter_mut().zip(name.bytes()) {
            *to = from;
        }
        Some(Self(bytes))
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        let len = self.0.iter().position(|byte| *byte == 0).unwrap_or(self.0.len());
        // Never refused: the bytes are ASCII.
        self.0.get(..len).and_then(|name| core::str::from_utf8(name).ok()).unwrap_or("")
    }
}

impl TryFrom<[u8; 8]> for FileName {
    type Error = Error;

    /// The name as the encoder sends it: characters, then 00h.
    fn try_from(bytes: [u8; 8]) -> Result<Self, Error> {
        let len = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let (name, rest) = bytes.split_at_checked(len).unwrap_or((&bytes, &[]));
        let name = core::str::from_utf8(name).ok().and_then(Self::new);
        name.filter(|_| rest.iter().all(|byte| *byte == 0)).ok_or(Error::FileName)
    }
}

impl From<FileName> for [u8; 8] {
    fn from(name: FileName) -> Self {
        name.0
    }
}

servowire_core::one_line!(FileName {
    name => "{}", name.as_str();
});

/// Access rights and size of the loaded file, as returned by FILESTAT (132h).
///
/// ```
/// use hdsl::message::{AccessLevel, Data, FileStatus};
/// // What answers `LongRequest::file_status()`: written by maintenance, read by everybody, 53 bytes long.
/// let data = Data::new(&[0x20, 0x00, 0x00, 0x35]).unwrap();
/// let status = FileStatus::parse(&data)?;
/// assert_eq!((status.write, status.size), (Some(AccessLevel::Maintenance), 53));
/// # Ok::<(), hdsl::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FileStatus {
    /// The level that may write; `None` if the number is not defined.
    pub write: Option<AccessLevel>,
    /// The level that may read.
    pub read: Option<AccessLevel>,
    /// Number of bytes in the file.
    pub size: u16,
}

impl FileStatus {
    /// Decodes the answer to [`LongRequest::file_status`].
    ///
    /// # Errors
    /// [`Error::DataLength`] unless there are four bytes.
    pub fn parse(data: &Data) -> Result<Self, Error> {
        let [rights, _, high, low] = data.as_bytes() else {
            return Err(Error::DataLength { len: u8::try_from(data.as_bytes().len()).unwrap_or(u8::MAX) });
        };
        Ok(Self {
            write: AccessLevel::from_code(rights >> 4),
            read: AccessLevel::from_code(*rights & 15),
            size: u16::from_be_bytes([*high, *low]),
        })
    }
}

impl LongRequest {
    const fn write_file_resource(address: ResourceAddress, offset: u16, data: Data) -> Self {
        Self { address, indirect: true, offset: Some(Offset::truncate(offset)), access: Access::Write(data) }
    }

    /// Loads a file, to which the other file requests then refer. Its checksum is verified; only one file is loaded at a time.
    pub fn load_file(name: FileName) -> Self {
        Self::write_file_resource(ResourceAddress::LOADFILE, 0x00, Data::eight(name.0))
    }

    /// Loads a file even if its checksum is wrong.
    pub fn load_file_unverified(name: FileName) -> Self {
        Self::write_file_resource(ResourceAddress::LOADFILE, 0x10, Data::eight(name.0))
    }

    /// Reads 2, 4 or 8 bytes of the loaded file.
    pub const fn read_file(address: Offset, length: Length) -> Self {
        Self::read_at(ResourceAddress::RWFILE, address, length)
    }

    /// Writes 2, 4 or 8 bytes of the loaded file; writing past its end makes it longer.
    pub const fn write_file(address: Offset, data: Data) -> Self {
        Self { address: ResourceAddress::RWFILE, indirect: true, offset: Some(address), access: Access::Write(data) }
    }

    /// Reads the access rights and the size of the loaded file, see [`FileStatus`].
    pub const fn file_status() -> Self {
        Self::read(ResourceAddress::FILESTAT, Length::Four)
    }

    /// Creates a file.
    pub fn create_file(name: FileName, write: AccessLevel, read: AccessLevel) -> Self {
        Self::write_file_resource(ResourceAddress::MAKEFILE, 0x300 | rights(write, read), Data::eight(name.0))
    }

    /// Changes the access rights of the loaded file.
    pub fn change_file_rights(name: FileName, write: AccessLevel, read: AccessLevel) -> Self {
        Self::write_file_resource(ResourceAddress::MAKEFILE, 0x100 | rights(write, read), Data::eight(name.0))
    }

    /// Deletes the loaded file, **for good**.
    pub fn delete_loaded_file_for_good(name: FileName) -> Self {
        Self::write_file_resource(ResourceAddress::MAKEFILE, 0x000, Data::eight(name.0))
    }

    /// Reads the directory: byte 0 is the number of files, bytes 2 and 3 the free bytes, bytes 4 and 5 the used bytes.
    pub const fn directory() -> Self {
        Self::read_at(ResourceAddress::DIR, Offset::truncate(0), Length::Eight)
    }

    /// Reads the name of file `number`, from 1.
    pub const fn file_name(number: Offset) -> Self {
        Self::read_at(ResourceAddress::DIR, number, Length::Eight)
    }
}

/// Offset: write level in bits 7:4, read level in bits 3:0.
fn rights(write: AccessLevel, read: AccessLevel) -> u16 {
    u16::from(write.code() << 4 | read.code())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn names() {
        let name = FileName::new("Motor 1").unwrap();
        assert_eq!((name.as_str(), <[u8; 8]>::from(name)), ("Motor 1", *b"Motor 1\0"));
        assert_eq!(FileName::try_from(*b"Motor 1\0"), Ok(name));
        assert_eq!(FileName::new("ABCDEFGH").unwrap().to_string(), "ABCDEFGH");
        for wrong in ["", "ABCDEFGHI", "a\n", "Ä"] {
            assert_eq!(FileName::new(wrong), None);
        }
        for wrong in [[0; 8], *b"AB\0CDEFG", [0x80; 8]] {
            assert_eq!(FileName::try_from(wrong), Err(Error::FileName));
        }
    }

    /// Resources, offsets and data of the manual, p. 126-132.
    #[test]
    fn requests() {
        let name = FileName::new("DATA").unwrap();
        let parts = |request: LongRequest| {
            (request.address.get(), request.offset.map(Offset::get), request.emit().as_bytes()[0])
        };
        // 3D: write 8 bytes with offset, address 1xxh.
        assert_eq!(parts(LongRequest::load_file(name)), (0x130, Some(0), 0xbd));
        assert_eq!(parts(LongRequest::load_file_unverified(name)), (0x130, Some(0x10), 0xbd));
        let create = LongRequest::create_file(name, AccessLevel::Maintenance, AccessLevel::Public);
        assert_eq!(parts(create), (0x133, Some(0x320), 0xbd));
        let rights = LongRequest::change_file_rights(name, AccessLevel::Public, AccessLevel::Service);
        assert_eq!(parts(rights), (0x133, Some(0x104), 0xbd));
        let delete = LongRequest::delete_loaded_file_for_good(name);
        assert_eq!(parts(delete), (0x133, Some(0), 0xbd));
        assert!(delete.is_dangerous() && !create.is_dangerous() && !rights.is_dangerous());
        let data = Data::new(b"MOTOR 42").unwrap();
        assert_eq!(parts(LongRequest::write_file(Offset::truncate(8), data)), (0x131, Some(8), 0xbd));
        assert_eq!(parts(LongRequest::read_file(Offset::truncate(8), Length::Two)), (0x131, Some(8), 0xf5));
        assert_eq!(parts(LongRequest::file_status()), (0x132, None, 0xd9));
        assert_eq!(parts(LongRequest::directory()), (0x134, Some(0), 0xfd));
        assert_eq!(parts(LongRequest::file_name(Offset::truncate(3))), (0x134, Some(3), 0xfd));
        // 53 bytes, written by maintenance, read by everybody.
        let status = FileStatus::parse(&Data::new(&[0x20, 0, 0x00, 0x35]).unwrap()).unwrap();
        assert_eq!((status.write, status.read), (Some(AccessLevel::Maintenance), Some(AccessLevel::Public)));
        assert_eq!(status.size, 53);
        assert_eq!(FileStatus::parse(&Data::NONE), Err(Error::DataLength { len: 0 }));
    }
}
