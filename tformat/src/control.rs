use crate::Error;

/// What a request asks for: the nine documented data IDs.
///
/// IDs 7, 8 and C are described differently in TIDM-1011 table 2-2 (7 single-turn, 8 multi-turn, C errors). Six
/// drivers and their documents, among them TI's own later ones, agree on the effects given here, and a servo
/// drive that trusts the table would shift its commutation angle when it means to clear an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum DataId {
    /// Reads single-turn data: ABS.
    Id0,
    /// Reads multi-turn data: ABM.
    Id1,
    /// Reads the encoder ID: ENID.
    Id2,
    /// Reads everything: ABS, ENID, ABM, ALMC.
    Id3,
    /// Writes a byte of the EEPROM.
    Id6,
    /// Clears all latched errors.
    Id7,
    /// Makes the present position the single-turn zero. **Shifts the commutation angle of the motor.**
    Id8,
    /// Clears the multi-turn count and all errors.
    IdC,
    /// Reads a byte of the EEPROM.
    IdD,
}

impl DataId {
    /// All nine, in the order of their codes.
    pub const ALL: [Self; 9] =
        [Self::Id0, Self::Id1, Self::Id2, Self::Id3, Self::Id6, Self::Id7, Self::Id8, Self::IdC, Self::IdD];

    /// The four bits cc0..cc3 as a number, 0..=15.
    pub const fn code(self) -> u8 {
        match self {
            Self::Id0 => 0x0,
            Self::Id1 => 0x1,
            Self::Id2 => 0x2,
            Self::Id3 => 0x3,
            Self::Id6 => 0x6,
            Self::Id7 => 0x7,
            Self::Id8 => 0x8,
            Self::IdC => 0xc,
            Self::IdD => 0xd,
        }
    }

    /// The data ID with this code.
    ///
    /// # Errors
    /// [`Error::UnknownDataId`] for the codes that no document describes.
    pub const fn from_code(code: u8) -> Result<Self, Error> {
        Ok(match code {
            0x0 => Self::Id0,
            0x1 => Self::Id1,
            0x2 => Self::Id2,
            0x3 => Self::Id3,
            0x6 => Self::Id6,
            0x7 => Self::Id7,
            0x8 => Self::Id8,
            0xc => Self::IdC,
            0xd => Self::IdD,
            _ => return Err(Error::UnknownDataId { code }),
        })
    }

    /// The control field that carries this data ID.
    pub const fn control_field(self) -> ControlField {
        ControlField::compose(self.code())
    }

    /// Fields of the request, 1, 3 or 4 (TIDM-1011, table 2-4).
    pub const fn request_fields(self) -> u8 {
        match self {
            Self::Id6 => 4,
            Self::IdD => 3,
            _ => 1,
        }
    }

    /// Fields of the response, 4, 6 or 11 (TIDM-1011, tables 2-5 and 2-7).
    pub const fn response_fields(self) -> u8 {
        match self {
            Self::Id0 | Self::Id1 | Self::Id7 | Self::Id8 | Self::IdC => 6,
            Self::Id2 | Self::Id6 | Self::IdD => 4,
            Self::Id3 => 11,
        }
    }
}

/// A well-formed control field (CF): its sink code and parity are right. The data ID may be any of the sixteen.
///
/// ```text
///  line, time →   0 | 0   1   0 | cc0 cc1 cc2 cc3 | cc4 | 1          TIDM-1011, table 2-3
///             start | sink code |    data ID      | par | delimiter
///  bit of byte        0   1   2    3   4   5   6     7
/// ```
///
/// The parity is even over cc0..cc4, so CF = 0x02 | ID << 3 | parity(ID) << 7, and no single wrong bit turns one
/// control field into another.
///
/// Vendors' own commands come in through here: [`ControlField::compose`] gives the control field of any code, and
/// [`VendorCommand`](crate::VendorCommand) carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct ControlField(u8);

impl ControlField {
    /// The control field of a data ID code; only the four low bits of `code` count.
    pub const fn compose(code: u8) -> Self {
        let id = code & 0xf;
        let parity = (id ^ id >> 1 ^ id >> 2 ^ id >> 3) & 1;
        Self(0x02 | id << 3 | parity << 7)
    }

    /// Checks sink code and parity, in this order.
    ///
    /// # Errors
    /// [`Error::SinkCode`], [`Error::Parity`].
    pub const fn parse(cf: u8) -> Result<Self, Error> {
        if cf & 0x07 != 0x02 {
            return Err(Error::SinkCode { cf });
        }
        if (cf >> 3).count_ones() & 1 != 0 {
            return Err(Error::Parity { cf });
        }
        Ok(Self(cf))
    }

    /// The byte.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// The code of the data ID, 0..=15.
    pub const fn code(self) -> u8 {
        self.0 >> 3 & 0xf
    }

    /// The data ID.
    ///
    /// # Errors
    /// [`Error::UnknownDataId`] for the seven codes that no document describes.
    pub const fn data_id(self) -> Result<DataId, Error> {
        DataId::from_code(self.code())
    }
}

impl TryFrom<u8> for ControlField {
    type Error = Error;

    fn try_from(cf: u8) -> Result<Self, Error> {
        Self::parse(cf)
    }
}

impl From<ControlField> for u8 {
    fn from(cf: ControlField) -> Self {
        cf.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nine_documented_control_fields() {
        let bytes = [0x02, 0x8a, 0x92, 0x1a, 0x32, 0xba, 0xc2, 0x62, 0xea];
        for (id, byte) in DataId::ALL.into_iter().zip(bytes) {
            assert_eq!(id.control_field().get(), byte);
            assert_eq!(ControlField::parse(byte).and_then(ControlField::data_id), Ok(id));
        }
    }

    #[test]
    fn the_other_seven_are_composed_but_not_known() {
        let bytes = [(0x4, 0xa2), (0x5, 0x2a), (0x9, 0x4a), (0xa, 0x52), (0xb, 0xda), (0xe, 0xf2), (0xf, 0x7a)];
        for (code, byte) in bytes {
            let cf = ControlField::compose(code);
            assert_eq!((cf.get(), cf.data_id()), (byte, Err(Error::UnknownDataId { code })));
        }
    }

    #[test]
    fn all_256_bytes_are_classified() {
        for cf in 0..=255_u8 {
            let want = if cf & 7 != 2 {
                Err(Error::SinkCode { cf })
            } else if (cf & 0xf8).count_ones() % 2 == 1 {
                Err(Error::Parity { cf })
            } else {
                Ok(ControlField::compose(cf >> 3 & 0xf))
            };
            assert_eq!(ControlField::parse(cf), want);
        }
    }

    #[test]
    fn a_single_wrong_bit_never_gives_another_control_field() {
        for code in 0..16 {
            for bit in 0..8 {
                assert!(ControlField::parse(ControlField::compose(code).get() ^ 1 << bit).is_err());
            }
        }
    }
}
