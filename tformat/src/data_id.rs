use crate::error::Error;

servowire_core::codes! {
/// The nine documented data IDs, which say what a request asks for.
///
/// | ID | name | request | response |
/// |---|---|---|---|
/// | 0 | [`ReadSingleTurn`](Self::ReadSingleTurn) | `CF` | `CF SF ABS0 ABS1 ABS2 CRC` |
/// | 1 | [`ReadMultiTurn`](Self::ReadMultiTurn) | `CF` | `CF SF ABM0 ABM1 ABM2 CRC` |
/// | 2 | [`ReadEncoderId`](Self::ReadEncoderId) | `CF` | `CF SF ENID CRC` |
/// | 3 | [`ReadAll`](Self::ReadAll) | `CF` | `CF SF ABS0 ABS1 ABS2 ENID ABM0 ABM1 ABM2 ALMC CRC` |
/// | 6 | [`WriteEeprom`](Self::WriteEeprom) | `CF ADF EDF CRC` | `CF ADF EDF CRC` |
/// | 7 | [`ResetErrors`](Self::ResetErrors) | `CF` | `CF SF ABS0 ABS1 ABS2 CRC` |
/// | 8 | [`SetSingleTurnZero`](Self::SetSingleTurnZero) | `CF` | `CF SF ABS0 ABS1 ABS2 CRC` |
/// | C | [`ResetTurnsAndErrors`](Self::ResetTurnsAndErrors) | `CF` | `CF SF ABS0 ABS1 ABS2 CRC` |
/// | D | [`ReadEeprom`](Self::ReadEeprom) | `CF ADF CRC` | `CF ADF EDF CRC` |
///
/// Requests follow TIDM-1011, table 2-4; responses follow tables 2-5 and 2-7.
///
/// TIDM-1011 table 2-2 describes IDs 7, 8 and C differently (7 single-turn, 8 multi-turn, C errors). Six drivers and
/// their documents, among them TI's own later ones, agree on the effects given here. A servo drive that trusts the table shifts
/// its commutation angle when it is meant to clear an alarm.
///
/// The code of a data ID is its four bits cc0..cc3 as a number, 0..=15. It prints as `ID C`.
pub enum DataId: u8 {
    /// ID 0: reads single-turn data, ABS.
    ReadSingleTurn = 0x0 => "ID 0",
    /// ID 1: reads multi-turn data, ABM.
    ReadMultiTurn = 0x1 => "ID 1",
    /// ID 2: reads the encoder ID, ENID.
    ReadEncoderId = 0x2 => "ID 2",
    /// ID 3: reads ABS, ENID, ABM and ALMC.
    ReadAll = 0x3 => "ID 3",
    /// ID 6: writes a byte of the EEPROM.
    WriteEeprom = 0x6 => "ID 6",
    /// ID 7, ten times: clears all latched errors.
    ResetErrors = 0x7 => "ID 7",
    /// ID 8, ten times: makes the present position the single-turn zero. **Shifts the commutation angle of the motor.**
    SetSingleTurnZero = 0x8 => "ID 8",
    /// ID C, ten times: clears the multi-turn count and all errors. **The machine loses its multi-turn reference.**
    ResetTurnsAndErrors = 0xc => "ID C",
    /// ID D: reads a byte of the EEPROM.
    ReadEeprom = 0xd => "ID D",
}
}

/// The fields of a request and of its response, by name in the order of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Layout {
    /// The fields of the request.
    pub request: &'static [&'static str],
    /// The fields of the response.
    pub response: &'static [&'static str],
}

impl DataId {
    /// The fields of the request and of the response.
    pub const fn layout(self) -> Layout {
        const CF: &[&str] = &["CF"];
        const SINGLE: &[&str] = &["CF", "SF", "ABS0", "ABS1", "ABS2", "CRC"];
        const MEMORY: &[&str] = &["CF", "ADF", "EDF", "CRC"];
        let (request, response): (_, &[&str]) = match self {
            Self::ReadSingleTurn | Self::ResetErrors | Self::SetSingleTurnZero | Self::ResetTurnsAndErrors => {
                (CF, SINGLE)
            }
            Self::ReadMultiTurn => (CF, &["CF", "SF", "ABM0", "ABM1", "ABM2", "CRC"]),
            Self::ReadEncoderId => (CF, &["CF", "SF", "ENID", "CRC"]),
            Self::ReadAll => (CF, &["CF", "SF", "ABS0", "ABS1", "ABS2", "ENID", "ABM0", "ABM1", "ABM2", "ALMC", "CRC"]),
            Self::WriteEeprom => (MEMORY, MEMORY),
            Self::ReadEeprom => (&["CF", "ADF", "CRC"], MEMORY),
        };
        Layout { request, response }
    }

    /// How many times the request is sent for one operation: 10 for resets, otherwise 1.
    pub const fn repeats(self) -> u8 {
        if self.effect().is_some() { 10 } else { 1 }
    }

    /// Describes what a reset does to the encoder, for a log.
    pub const fn effect(self) -> Option<&'static str> {
        match self {
            Self::ResetErrors => Some("clears errors"),
            Self::SetSingleTurnZero => Some("sets the single-turn zero"),
            Self::ResetTurnsAndErrors => Some("clears turns and errors"),
            _ => None,
        }
    }

    /// The control field that carries this data ID.
    pub const fn control_field(self) -> ControlField {
        // What `compose` gives for the code: a short table in place of the arithmetic.
        ControlField(match self {
            Self::ReadSingleTurn => 0x02,
            Self::ReadMultiTurn => 0x8a,
            Self::ReadEncoderId => 0x92,
            Self::ReadAll => 0x1a,
            Self::WriteEeprom => 0x32,
            Self::ResetErrors => 0xba,
            Self::SetSingleTurnZero => 0xc2,
            Self::ResetTurnsAndErrors => 0x62,
            Self::ReadEeprom => 0xea,
        })
    }

    /// Number of fields of the request: 1, 3 or 4.
    #[expect(clippy::cast_possible_truncation, reason = "4 at the most")]
    pub const fn request_fields(self) -> u8 {
        self.layout().request.len() as u8
    }

    /// Number of fields of the response: 4, 6 or 11.
    pub const fn response_fields(self) -> u8 {
        match self {
            Self::ReadAll => 11,
            Self::ReadEncoderId | Self::WriteEeprom | Self::ReadEeprom => 4,
            // All of them named: the compiler makes a table of it.
            Self::ReadSingleTurn
            | Self::ReadMultiTurn
            | Self::ResetErrors
            | Self::SetSingleTurnZero
            | Self::ResetTurnsAndErrors => 6,
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
/// Vendors' own commands start here: [`ControlField::compose`] returns the control field of any code, and
/// [`VendorCommand`](crate::VendorCommand) carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct ControlField(u8);

servowire_core::one_line!(ControlField { Self(cf) => "CF {:02X}h", cf; });

impl ControlField {
    /// Returns the control field of a data ID code; only the four low bits of `code` are used.
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
        match DataId::from_code(self.code()) {
            Some(id) => Ok(id),
            None => Err(Error::UnknownDataId { code: self.code() }),
        }
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
    use std::string::ToString;

    #[test]
    fn the_nine_documented_control_fields() {
        let bytes = [0x02, 0x8a, 0x92, 0x1a, 0x32, 0xba, 0xc2, 0x62, 0xea];
        for (id, byte) in DataId::ALL.into_iter().zip(bytes) {
            assert_eq!(id.control_field().get(), byte);
            assert_eq!(ControlField::compose(id.code()), id.control_field());
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
        assert_eq!((DataId::from_code(0xc), DataId::from_code(16)), (Some(DataId::ResetTurnsAndErrors), None));
    }

    /// TIDM-1011, tables 2-4, 2-5 and 2-7.
    #[test]
    fn fields_of_requests_and_responses() {
        assert_eq!(DataId::ALL.map(DataId::request_fields), [1, 1, 1, 1, 4, 1, 1, 1, 3]);
        assert_eq!(DataId::ALL.map(DataId::response_fields), [6, 6, 4, 11, 4, 6, 6, 6, 4]);
        assert!(DataId::ALL.iter().all(|id| id.layout().response.len() == usize::from(id.response_fields())));
        assert_eq!(DataId::ALL.map(DataId::code), [0, 1, 2, 3, 6, 7, 8, 12, 13]);
        assert_eq!(DataId::ResetTurnsAndErrors.to_string(), "ID C");
        assert_eq!(DataId::ReadAll.control_field().to_string(), "CF 1Ah");
    }

    /// IDs 7, 8 and C are sent ten times.
    #[test]
    fn what_cannot_be_undone_is_said() {
        assert_eq!(DataId::ALL.map(DataId::repeats), [1, 1, 1, 1, 1, 10, 10, 10, 1]);
        let said: std::vec::Vec<_> = DataId::ALL.into_iter().filter_map(DataId::effect).collect();
        assert_eq!(said, ["clears errors", "sets the single-turn zero", "clears turns and errors"]);
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
