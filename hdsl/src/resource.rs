//! Addresses of resources, and why an encoder refuses access to one.

servowire_core::number! {
    /// Address of a resource, 10 bits (SICK manual, p. 86-133).
    pub struct ResourceAddress(u16, 10);
}

/// Declares the named addresses.
macro_rules! addresses {
    ($($(#[$doc:meta])* $name:ident = $address:literal,)*) => {
        impl ResourceAddress {
            $($(#[$doc])* pub const $name: Self = Self::truncate($address);)*

            /// Its name in the manual, if it has one there.
            pub const fn name(self) -> Option<&'static str> {
                match self.get() {
                    $($address => Some(stringify!($name)),)*
                    _ => None,
                }
            }
        }
    };
}

addresses! {
    /// Node of all resources.
    ROOT = 0x000,
    /// Node of the identification of the encoder.
    IDENT = 0x001,
    /// Node of monitoring.
    MONITOR = 0x002,
    /// Node of administration.
    ADMIN = 0x003,
    /// Node of the user counter.
    COUNTER = 0x004,
    /// Kind of encoder, 2 bytes: 0 rotary bipolar, 1 linear bipolar, 2 rotary unipolar, 3 linear unipolar.
    ENCTYPE = 0x080,
    /// Steps per turn, 4 bytes; for a linear encoder, the step in nm.
    RESOLUTN = 0x081,
    /// Number of coded turns, 4 bytes; for a linear encoder, the number of steps.
    RANGE = 0x082,
    /// Type code, 18 characters.
    TYPECODE = 0x083,
    /// Serial number, 10 characters.
    SERIALNO = 0x084,
    /// Firmware and hardware revision, 16 and 4 characters.
    FWREVNO = 0x085,
    /// Date of the firmware, 8 characters.
    FWDATE = 0x086,
    /// Size of the user memory in bytes, 2 bytes.
    EESIZE = 0x087,
    /// Lowest and highest temperature, 2 bytes each, in 0.1 °C.
    TEMPRNG = 0x0c0,
    /// Temperature, 2 bytes, in 0.1 °C, updated every second.
    TEMPRTUR = 0x0c1,
    /// Supply voltage, 2 bytes, in mV.
    SUPVOLT = 0x0c5,
    /// Highest speed, 2 bytes, in revolutions per minute.
    SPEEDRNG = 0x0c6,
    /// Speed, 2 bytes, in revolutions per minute, updated every second.
    SPEED = 0x0c7,
    /// Highest acceleration, 2 bytes, in 1000 rad/s².
    ACCRANGE = 0x0c8,
    /// Error log, 16 bytes per entry.
    ERRORLOG = 0x0cc,
    /// Usage histogram, 4 bytes per class.
    USAGEHIS = 0x0cd,
    /// **Reset or shut-down of the encoder**, see `LongRequest::reset_encoder` (feature `files`).
    RESET = 0x100,
    /// **Counting direction**; the encoder resets itself afterwards.
    COUNTDIR = 0x102,
    /// Access level and its key, 8 bytes.
    SETACCESS = 0x104,
    /// **Change of an access key**; a lost key cannot be recovered.
    CHANGEKEY = 0x105,
    /// User-defined warnings, 8 bytes each.
    UWARNING = 0x107,
    /// User-defined encoder index, shown in ENC_ID bits 15:12.
    ENCIDENT = 0x109,
    /// User counter, 4 bytes.
    READCNT = 0x120,
    /// Written without data: adds 1 to the user counter.
    INCCOUNT = 0x121,
    /// Written without data: **sets the user counter to 0**.
    RESETCNT = 0x122,
    /// Name of the user file to work with, 8 characters.
    LOADFILE = 0x130,
    /// Contents of the loaded file; the offset is the address within it.
    RWFILE = 0x131,
    /// Access rights and size of the loaded file, 4 bytes.
    FILESTAT = 0x132,
    /// Creates, changes and **deletes** user files.
    MAKEFILE = 0x133,
    /// Directory of the user files, 8 bytes.
    DIR = 0x134,
    /// Simple inputs and outputs, 4 bytes.
    ACCESSIO = 0x200,
}

/// Displays the address as the manual writes it, with its name: `081h RESOLUTN`.
#[derive(Clone, Copy)]
pub(crate) struct Named(pub(crate) ResourceAddress);

servowire_core::one_line!(Named {
    Self(address) if address.name().is_none() => "{:03X}h", address.get();
    Self(address) => "{:03X}h {}", address.get(), address.name().unwrap_or("");
});

servowire_core::number! {
    /// Offset within a resource, 15 bits.
    ///
    /// In direct reads it selects an attribute (SICK manual, p. 87): 0 name, 1 data size, 2 read level, 3 write level,
    /// 4 time-out in ms (255: more than 254), 5 data type.
    pub struct Offset(u16, 15);
}

/// Why an encoder refuses a long message (SICK manual, table 43). On the line the detail comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct ResourceError {
    class: u8,
    detail: u8,
}

/// The kind of fault. The class also appears in ENC_ST4: bit 0 for 40h to bit 3 for 43h.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum ResourceErrorClass {
    /// 40h: address, length, offset.
    Address,
    /// 41h: rights.
    Access,
    /// 42h: database and processing.
    Processing,
    /// 43h: user files.
    Files,
    /// A class that the manual does not list.
    Unknown(u8),
}

/// Declares the codes of the manual.
macro_rules! codes {
    ($($name:ident = $class:literal, $detail:literal, $text:literal;)*) => {
        impl ResourceError {
            $(
                #[doc = concat!("Class ", stringify!($class), ", detail ", stringify!($detail), ": ", $text, ".")]
                pub const $name: Self = Self::new($class, $detail);
            )*

            /// What the manual says about the code; `None` if it does not list it.
            pub const fn meaning(self) -> Option<&'static str> {
                match (self.class, self.detail) {
                    $(($class, $detail) => Some($text),)*
                    _ => None,
                }
            }
        }
    };
}

codes! {
    NOT_THERE = 0x40, 0x10, "the resource is not there";
    LENGTH = 0x40, 0x11, "wrong length";
    DIRECT_LENGTH = 0x40, 0x12, "wrong length of a direct access";
    OFFSET_TOO_HIGH = 0x40, 0x13, "the offset is too high";
    OFFSET_INVALID = 0x40, 0x14, "the offset is invalid";
    CHARACTERISTIC = 0x40, 0x15, "invalid message characteristic";
    OFFSET_MISSING = 0x40, 0x16, "the offset is missing";
    NOT_WRITABLE = 0x41, 0x10, "writing is not possible";
    NOT_READABLE = 0x41, 0x11, "reading is not possible";
    WRITE_DENIED = 0x41, 0x12, "writing is denied";
    READ_DENIED = 0x41, 0x13, "reading is denied";
    DEFINING_DENIED = 0x41, 0x14, "writing to defining values is denied";
    DATABASE = 0x42, 0x10, "the database entry is damaged";
    OVERRUN = 0x42, 0x11, "time overrun";
    INTERNAL = 0x42, 0x12, "internal processing error";
    FILE_NOT_FOUND = 0x43, 0x11, "the file is not found";
    FILE_ADDRESS = 0x43, 0x12, "invalid address in the file";
    FILE_SIZE = 0x43, 0x13, "the size of the file may not be altered";
    FILE_MEMORY = 0x43, 0x14, "the memory for files is full";
    FILE_TABLE = 0x43, 0x15, "the allocation table of the files is damaged";
    NO_FILE = 0x43, 0x16, "no file is loaded";
    FILE_EXISTS = 0x43, 0x17, "a file of this name exists";
}

impl ResourceError {
    /// Creates an error from any code.
    pub const fn new(class: u8, detail: u8) -> Self {
        Self { class, detail }
    }

    /// PC_BUFFER1 of the manual's register view.
    pub const fn class_code(self) -> u8 {
        self.class
    }

    /// PC_BUFFER0 of the manual's register view.
    pub const fn detail(self) -> u8 {
        self.detail
    }

    /// The kind of fault.
    pub const fn class(self) -> ResourceErrorClass {
        match self.class {
            0x40 => ResourceErrorClass::Address,
            0x41 => ResourceErrorClass::Access,
            0x42 => ResourceErrorClass::Processing,
            0x43 => ResourceErrorClass::Files,
            other => ResourceErrorClass::Unknown(other),
        }
    }
}

servowire_core::one_line!(ResourceError {
    error =>
        "{} (class {:02X}h, detail {:02X}h)", error.meaning().unwrap_or("undocumented"), error.class, error.detail;
});

impl core::error::Error for ResourceError {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn addresses_and_codes_of_the_manual() {
        assert_eq!((ResourceAddress::RESET.get(), ResourceAddress::RWFILE.get()), (0x100, 0x131));
        assert_eq!(ResourceAddress::new(0x134).and_then(ResourceAddress::name), Some("DIR"));
        assert_eq!(ResourceAddress::truncate(0x3ff).name(), None);
        let listed = (0..=255).flat_map(|class| (0..=255).map(move |detail| ResourceError::new(class, detail)));
        assert_eq!(listed.filter(|code| code.meaning().is_some()).count(), 7 + 5 + 3 + 7);
        assert_eq!(ResourceError::NOT_THERE.to_string(), "the resource is not there (class 40h, detail 10h)");
        assert_eq!(ResourceError::new(0x44, 1).to_string(), "undocumented (class 44h, detail 01h)");
        assert_eq!(ResourceError::FILE_EXISTS.class(), ResourceErrorClass::Files);
        assert_eq!(ResourceError::new(0x99, 0).class(), ResourceErrorClass::Unknown(0x99));
        assert_eq!(
            [0x40, 0x41, 0x42].map(|class| ResourceError::new(class, 0).class()),
            [ResourceErrorClass::Address, ResourceErrorClass::Access, ResourceErrorClass::Processing]
        );
    }
}
