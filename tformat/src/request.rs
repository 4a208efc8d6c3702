use crate::address::{Address, Adf};
use crate::crc::check;
use crate::data_id::{ControlField, DataId};
use crate::error::Error;
use crate::frame::{Frame, count};

/// What a master sends.
///
/// ```text
///  ID 0, 1, 2, 3, 7, 8, C    CF                        TIDM-1011, table 2-4
///  ID D   read EEPROM        CF  ADF  CRC
///  ID 6   write EEPROM       CF  ADF  EDF  CRC
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Request {
    /// ID 0: read single-turn data.
    ReadSingleTurn,
    /// ID 1: read multi-turn data.
    ReadMultiTurn,
    /// ID 2: read the encoder ID.
    ReadEncoderId,
    /// ID 3: read single-turn data, encoder ID, multi-turn data and error byte.
    ReadAll,
    /// ID 6: write a byte of the EEPROM.
    WriteEeprom {
        /// Address; the busy flag is sent as 0.
        adf: Adf,
        /// Data, all eight bits.
        edf: u8,
    },
    /// ID 7: clear all errors, one of ten.
    ResetErrors,
    /// ID 8: make the present position the single-turn zero, one of ten. **Shifts the commutation angle.**
    SetSingleTurnZero,
    /// ID C: clear turns and errors, one of ten. **The machine loses its multi-turn reference.**
    ResetTurnsAndErrors,
    /// ID D: read a byte of the EEPROM.
    ReadEeprom {
        /// Address; the busy flag is sent as 0.
        adf: Adf,
    },
}

impl Request {
    /// Reads the EEPROM byte at `address`.
    pub const fn read_eeprom(address: Address) -> Self {
        Self::ReadEeprom { adf: Adf::of(address) }
    }

    /// Writes `edf` to the EEPROM at `address`; at [`Address::PAGE_REGISTER`] it selects a page.
    ///
    /// Motor makers keep name plate and commutation data in this memory.
    pub const fn write_eeprom(address: Address, edf: u8) -> Self {
        Self::WriteEeprom { adf: Adf::of(address), edf }
    }

    /// Derives a request that would match the response, for tools that did not see the request.
    ///
    /// An EEPROM response repeats address and data; missing fields count as 0.
    ///
    /// # Errors
    /// The errors of the control field: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::UnknownDataId`].
    pub fn answered_by(answer: &[u8]) -> Result<Self, Error> {
        let Some(&cf) = answer.first() else { return Err(Error::Truncated { got: 0, want: 1 }) };
        let field = |at: usize| answer.get(at).copied().unwrap_or(0);
        let adf = Adf::of(Adf::from_bits(field(1)).address());
        Ok(Self::of(ControlField::parse(cf)?.data_id()?, adf, field(2)))
    }

    /// Creates the request with this data ID; `adf` and `edf` are used if it has them.
    pub const fn of(id: DataId, adf: Adf, edf: u8) -> Self {
        match id {
            DataId::ReadSingleTurn => Self::ReadSingleTurn,
            DataId::ReadMultiTurn => Self::ReadMultiTurn,
            DataId::ReadEncoderId => Self::ReadEncoderId,
            DataId::ReadAll => Self::ReadAll,
            DataId::WriteEeprom => Self::WriteEeprom { adf, edf },
            DataId::ResetErrors => Self::ResetErrors,
            DataId::SetSingleTurnZero => Self::SetSingleTurnZero,
            DataId::ResetTurnsAndErrors => Self::ResetTurnsAndErrors,
            DataId::ReadEeprom => Self::ReadEeprom { adf },
        }
    }

    /// The data ID.
    pub const fn data_id(self) -> DataId {
        match self {
            Self::ReadSingleTurn => DataId::ReadSingleTurn,
            Self::ReadMultiTurn => DataId::ReadMultiTurn,
            Self::ReadEncoderId => DataId::ReadEncoderId,
            Self::ReadAll => DataId::ReadAll,
            Self::WriteEeprom { .. } => DataId::WriteEeprom,
            Self::ResetErrors => DataId::ResetErrors,
            Self::SetSingleTurnZero => DataId::SetSingleTurnZero,
            Self::ResetTurnsAndErrors => DataId::ResetTurnsAndErrors,
            Self::ReadEeprom { .. } => DataId::ReadEeprom,
        }
    }

    /// Returns the fields to send.
    pub const fn emit(self) -> Frame {
        let cf = self.data_id().control_field().get();
        match self {
            Self::WriteEeprom { adf, edf } => Frame::of4([cf, adf.bits(), edf, cf ^ adf.bits() ^ edf]),
            Self::ReadEeprom { adf } => Frame::of3([cf, adf.bits(), cf ^ adf.bits()]),
            _ => Frame::of1(cf),
        }
    }

    /// Decodes received fields as an encoder does; fields after the request are ignored.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`] without any field, [`Error::SinkCode`], [`Error::Parity`],
    /// [`Error::UnknownDataId`], [`Error::Truncated`], [`Error::Crc`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let Some(&cf) = bytes.first() else { return Err(Error::Truncated { got: 0, want: 1 }) };
        let id = ControlField::parse(cf)?.data_id()?;
        let want = id.request_fields();
        let Some(fields) = bytes.get(..usize::from(want)) else {
            return Err(Error::Truncated { got: count(bytes), want: want.into() });
        };
        Ok(match fields {
            [_, adf, rest @ ..] => {
                check(fields)?;
                Self::of(id, Adf::from_bits(*adf), rest.first().copied().unwrap_or(0))
            }
            _ => Self::of(id, Adf::from_bits(0), 0),
        })
    }
}

servowire_core::one_line!(Request {
    Self::WriteEeprom { adf, edf } => "{} ADF {} EDF {:02X}h", DataId::WriteEeprom, adf, edf;
    Self::ReadEeprom { adf } => "{} ADF {}", DataId::ReadEeprom, adf;
    request => "{}", request.data_id();
});

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;
    use std::vec::Vec;

    pub(crate) fn requests() -> impl Strategy<Value = Request> {
        (0..9usize, any::<u8>(), any::<u8>()).prop_map(|(k, adf, edf)| every(adf, edf)[k])
    }

    /// One request of each kind.
    pub(crate) fn every(adf: u8, edf: u8) -> [Request; 9] {
        let adf = Adf::from_bits(adf);
        [
            Request::ReadSingleTurn,
            Request::ReadMultiTurn,
            Request::ReadEncoderId,
            Request::ReadAll,
            Request::WriteEeprom { adf, edf },
            Request::ResetErrors,
            Request::SetSingleTurnZero,
            Request::ResetTurnsAndErrors,
            Request::ReadEeprom { adf },
        ]
    }

    #[test]
    fn emits_the_documented_bytes() {
        let address = |a| Address::new(a).unwrap();
        assert_eq!(Request::ReadAll.emit().as_bytes(), [0x1a]);
        assert_eq!(Request::write_eeprom(Address::PAGE_REGISTER, 1).emit().as_bytes(), [0x32, 0x7f, 0x01, 0x4c]);
        assert_eq!(Request::write_eeprom(address(1), 0x5a).emit().as_bytes(), [0x32, 0x01, 0x5a, 0x69]);
        assert_eq!(Request::read_eeprom(address(1)).emit().as_bytes(), [0xea, 0x01, 0xeb]);
        assert_eq!(Request::read_eeprom(address(1)).to_string(), "ID D ADF 1");
        assert_eq!(Request::write_eeprom(address(5), 0x5a).to_string(), "ID 6 ADF 5 EDF 5Ah");
        assert_eq!(Request::ReadAll.to_string(), "ID 3");
    }

    #[test]
    fn round_trip_of_every_request() {
        // Interpreted, some of the pairs have to do.
        let stride = if cfg!(miri) { 51 } else { 1 };
        for adf in (0..=255).step_by(stride) {
            for edf in (0..=255).step_by(stride) {
                for request in every(adf, edf) {
                    let frame = request.emit();
                    assert_eq!(Request::parse(frame.as_bytes()), Ok(request));
                    assert_eq!(frame.fields(), request.data_id().request_fields());
                }
            }
        }
    }

    /// Every flipped bit is refused by the check that covers its field.
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
                let want = if short == 0 { 1 } else { good.len() as u16 };
                assert_eq!(Request::parse(&good[..short]), Err(Error::Truncated { got: short as u16, want }));
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
