use crate::{ControlField, DataId, Error, Frame, crc};

/// An EEPROM address, 0..=127: 0..=126 are data of the selected page, 127 is the page register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct Address(u8);

/// A number that is no EEPROM address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} is no EEPROM address: 0 to 126 are data, 127 is the page register")]
pub struct NotAnAddress(pub u8);

impl Address {
    /// The page register: writing selects the page, reading gives it.
    pub const PAGE_REGISTER: Self = Self(127);

    /// `None` above 127.
    pub const fn new(address: u8) -> Option<Self> {
        if address > 127 { None } else { Some(Self(address)) }
    }

    /// The number, 0..=127.
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl TryFrom<u8> for Address {
    type Error = NotAnAddress;

    fn try_from(address: u8) -> Result<Self, NotAnAddress> {
        Self::new(address).ok_or(NotAnAddress(address))
    }
}

impl From<Address> for u8 {
    fn from(address: Address) -> Self {
        address.get()
    }
}

/// The address field (ADF) of EEPROM access: address in bits 0..=6, busy flag in bit 7 (TIDM-1011, table 2-7).
///
/// A master sends the busy flag as 0, an encoder ignores it; in a response 1 means that the memory was still busy,
/// the operation was not done, and the data byte says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Adf(u8);

impl Adf {
    const BUSY: u8 = 0x80;

    /// Any byte is an address field.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// The field of an address and a busy flag.
    pub const fn of(address: Address, busy: bool) -> Self {
        Self(address.0 | if busy { Self::BUSY } else { 0 })
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// The address.
    pub const fn address(self) -> Address {
        Address(self.0 & !Self::BUSY)
    }

    /// The busy flag.
    pub const fn busy(self) -> bool {
        self.0 & Self::BUSY != 0
    }
}

/// What a master sends.
///
/// ```text
///  ID 0, 1, 2, 3, 7, 8, C    CF                        TIDM-1011, table 2-4
///  ID D   read EEPROM        CF  ADF  CRC
///  ID 6   write EEPROM       CF  ADF  EDF  CRC
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Request {
    /// Read single-turn data.
    Id0,
    /// Read multi-turn data.
    Id1,
    /// Read the encoder ID.
    Id2,
    /// Read single-turn data, encoder ID, multi-turn data and error byte.
    Id3,
    /// Write a byte of the EEPROM.
    Id6 {
        /// Address; the busy flag is sent as 0.
        adf: Adf,
        /// Data, all eight bits.
        edf: u8,
    },
    /// Clear all errors, one of ten.
    Id7,
    /// Make the present position the single-turn zero, one of ten. **Shifts the commutation angle.**
    Id8,
    /// Clear turns and errors, one of ten.
    IdC,
    /// Read a byte of the EEPROM.
    IdD {
        /// Address; the busy flag is sent as 0.
        adf: Adf,
    },
}

impl Request {
    /// Reads the EEPROM byte at `address`.
    pub const fn read_eeprom(address: Address) -> Self {
        Self::IdD { adf: Adf::of(address, false) }
    }

    /// Writes `edf` to the EEPROM at `address`; at [`Address::PAGE_REGISTER`] it selects a page.
    ///
    /// Motor makers keep name plate and commutation data in this memory.
    pub const fn write_eeprom(address: Address, edf: u8) -> Self {
        Self::Id6 { adf: Adf::of(address, false), edf }
    }

    /// A request that an answer would fit, from the answer itself: for tools that did not see the request.
    ///
    /// An EEPROM answer repeats address and data; fields that are missing count as 0.
    ///
    /// # Errors
    /// Those of the control field: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::UnknownDataId`].
    pub fn answered_by(answer: &[u8]) -> Result<Self, Error> {
        let Some(&cf) = answer.first() else { return Err(Error::Truncated { got: 0, want: 1 }) };
        let field = |at: usize| answer.get(at).copied().unwrap_or(0);
        let adf = Adf::of(Adf(field(1)).address(), false);
        Ok(match ControlField::parse(cf)?.data_id()? {
            DataId::Id0 => Self::Id0,
            DataId::Id1 => Self::Id1,
            DataId::Id2 => Self::Id2,
            DataId::Id3 => Self::Id3,
            DataId::Id6 => Self::Id6 { adf, edf: field(2) },
            DataId::Id7 => Self::Id7,
            DataId::Id8 => Self::Id8,
            DataId::IdC => Self::IdC,
            DataId::IdD => Self::IdD { adf },
        })
    }

    /// The data ID.
    pub const fn data_id(self) -> DataId {
        match self {
            Self::Id0 => DataId::Id0,
            Self::Id1 => DataId::Id1,
            Self::Id2 => DataId::Id2,
            Self::Id3 => DataId::Id3,
            Self::Id6 { .. } => DataId::Id6,
            Self::Id7 => DataId::Id7,
            Self::Id8 => DataId::Id8,
            Self::IdC => DataId::IdC,
            Self::IdD { .. } => DataId::IdD,
        }
    }

    /// The fields to send.
    pub const fn emit(self) -> Frame {
        let cf = self.data_id().control_field().get();
        match self {
            Self::Id6 { adf, edf } => Frame::of4([cf, adf.raw(), edf, cf ^ adf.raw() ^ edf]),
            Self::IdD { adf } => Frame::of3([cf, adf.raw(), cf ^ adf.raw()]),
            _ => Frame::of1(cf),
        }
    }

    /// What an encoder makes of received fields. Fields behind the request are left alone.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::UnknownDataId`], [`Error::Truncated`], [`Error::Crc`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let Some(&cf) = bytes.first() else { return Err(Error::Truncated { got: 0, want: 1 }) };
        let id = ControlField::parse(cf)?.data_id()?;
        let want = id.request_fields();
        let Some(fields) = bytes.get(..usize::from(want)) else {
            return Err(Error::Truncated { got: count(bytes), want });
        };
        Ok(match (id, fields) {
            (DataId::Id0, _) => Self::Id0,
            (DataId::Id1, _) => Self::Id1,
            (DataId::Id2, _) => Self::Id2,
            (DataId::Id3, _) => Self::Id3,
            (DataId::Id7, _) => Self::Id7,
            (DataId::Id8, _) => Self::Id8,
            (DataId::IdC, _) => Self::IdC,
            (DataId::Id6, &[_, adf, edf, _]) => {
                check_crc(fields)?;
                Self::Id6 { adf: Adf::new(adf), edf }
            }
            (DataId::IdD, &[_, adf, ..]) => {
                check_crc(fields)?;
                Self::IdD { adf: Adf::new(adf) }
            }
            // Never: the slice has the length of the request.
            (DataId::Id6 | DataId::IdD, _) => return Err(Error::Truncated { got: count(bytes), want }),
        })
    }
}

/// How many fields there are, as an error tells it.
pub(crate) fn count(bytes: &[u8]) -> u8 {
    u8::try_from(bytes.len()).unwrap_or(u8::MAX)
}

/// Checks the last field against the ones before it.
pub(crate) fn check_crc(fields: &[u8]) -> Result<(), Error> {
    match (crc(fields), fields) {
        (0, _) | (_, []) => Ok(()),
        (sum, [.., got]) => Err(Error::Crc { got: *got, want: sum ^ got }),
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for Address {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(u8::arbitrary(from)? & 127))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    pub(crate) fn requests() -> impl Strategy<Value = Request> {
        (0..9usize, any::<u8>(), any::<u8>()).prop_map(|(k, adf, edf)| every(adf, edf)[k])
    }

    /// One request of each kind.
    pub(crate) fn every(adf: u8, edf: u8) -> [Request; 9] {
        let adf = Adf::new(adf);
        [
            Request::Id0,
            Request::Id1,
            Request::Id2,
            Request::Id3,
            Request::Id6 { adf, edf },
            Request::Id7,
            Request::Id8,
            Request::IdC,
            Request::IdD { adf },
        ]
    }

    #[test]
    fn emits_the_documented_bytes() {
        let address = |a| Address::new(a).unwrap();
        assert_eq!(Request::Id3.emit().as_bytes(), [0x1a]);
        assert_eq!(Request::write_eeprom(Address::PAGE_REGISTER, 1).emit().as_bytes(), [0x32, 0x7f, 0x01, 0x4c]);
        assert_eq!(Request::write_eeprom(address(1), 0x5a).emit().as_bytes(), [0x32, 0x01, 0x5a, 0x69]);
        assert_eq!(Request::read_eeprom(address(1)).emit().as_bytes(), [0xea, 0x01, 0xeb]);
        assert_eq!(Address::new(128), None);
    }

    #[test]
    fn round_trip_of_every_request() {
        for adf in 0..=255 {
            for edf in 0..=255 {
                for request in every(adf, edf) {
                    let frame = request.emit();
                    assert_eq!(Request::parse(frame.as_bytes()), Ok(request));
                    assert_eq!(frame.fields(), request.data_id().request_fields());
                }
            }
        }
    }

    /// Every single-bit flip is refused, by the check that covers the field it is in.
    #[test]
    fn single_flips_and_truncations() {
        for request in every(0x35, 0xc6) {
            let good: Vec<u8> = request.emit().as_bytes().to_vec();
            for bit in 0..good.len() * 8 {
                let mut bad = good.clone();
                bad[bit / 8] ^= 1 << (bit % 8);
                let error = Request::parse(&bad).unwrap_err();
                match bit {
                    0..3 => assert_eq!(error, Error::SinkCode { cf: bad[0] }),
                    3..8 => assert_eq!(error, Error::Parity { cf: bad[0] }),
                    _ => assert!(matches!(error, Error::Crc { .. }), "{error}"),
                }
            }
            for short in 0..good.len() {
                let want = if short == 0 { 1 } else { good.len() as u8 };
                assert_eq!(Request::parse(&good[..short]), Err(Error::Truncated { got: short as u8, want }));
            }
        }
    }

    proptest! {
        #[test]
        fn accepted_bytes_are_what_it_would_emit(bytes in prop::collection::vec(any::<u8>(), 0..6)) {
            if let Ok(request) = Request::parse(&bytes) {
                let frame = request.emit();
                prop_assert_eq!(frame.as_bytes(), &bytes[..frame.as_bytes().len()]);
            }
        }
    }
}
