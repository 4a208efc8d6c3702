use servowire_core::OutOfRange;

use crate::crc::{check, crc};
use crate::error::Error;
use crate::frame::{Frame, count};

/// The extension point for commands that are not Tamagawa's: encoders of other makers use private commands with the same
/// fields, some even with control fields that break the layout.
///
/// Only the first byte and the lengths of such a command are known, so only the repeated control field, the number of fields
/// and the check field are checked.
///
/// ```
/// use tformat::{ControlField, VendorCommand};
/// // data ID 5 is not documented; suppose an encoder answers it with five fields
/// let command = VendorCommand::new(ControlField::compose(5).get(), 5)?;
/// assert_eq!(command.parse(&[0x2a, 0x11, 0x22, 0x33, 0x2a]), Ok(&[0x11, 0x22, 0x33][..]));
/// # Ok::<(), tformat::OutOfRange>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Lengths", into = "Lengths")
)]
pub struct VendorCommand {
    cf: u8,
    response_fields: u8,
}

servowire_core::one_line!(VendorCommand {
    Self { cf, response_fields } => "CF {:02X}h, response of {} fields", cf, response_fields;
});

impl VendorCommand {
    /// Creates a command with this first field in the request and in the response (see
    /// [`ControlField::compose`](crate::ControlField::compose)), and a response of 2 to 11 fields, control and check field
    /// included.
    ///
    /// # Errors
    /// [`OutOfRange`] for another number of fields.
    pub const fn new(cf: u8, response_fields: u8) -> Result<Self, OutOfRange> {
        match response_fields {
            2..=11 => Ok(Self { cf, response_fields }),
            0 | 1 => Err(OutOfRange { got: response_fields as i64, max: 2 }),
            _ => Err(OutOfRange { got: response_fields as i64, max: 11 }),
        }
    }

    /// First field of the request and of the response.
    pub const fn cf(self) -> u8 {
        self.cf
    }

    /// Fields of the response, 2..=11.
    pub const fn response_fields(self) -> u8 {
        self.response_fields
    }

    /// Returns the request: the control field alone, or followed by `body` and the check field over both.
    ///
    /// `None` if `body` has more than nine bytes.
    pub fn emit(self, body: &[u8]) -> Option<Frame> {
        if body.is_empty() {
            return Frame::new(&[self.cf]);
        }
        let mut bytes = [0; Frame::MAX_FIELDS];
        let (cf, rest) = bytes.split_first_mut()?;
        *cf = self.cf;
        let (data, rest) = rest.split_at_mut_checked(body.len())?;
        data.copy_from_slice(body);
        *rest.first_mut()? = self.cf ^ crc(body);
        let len = body.len().saturating_add(2);
        Frame::new(bytes.get(..len)?)
    }

    /// Returns the fields of a response between its control field and its check field. It decodes the beginning of `bytes`;
    /// bytes after the response are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`] without any field, [`Error::CfMismatch`], [`Error::Truncated`], [`Error::Crc`].
    pub fn parse(self, bytes: &[u8]) -> Result<&[u8], Error> {
        let want = self.response_fields;
        let Some(&got) = bytes.first() else { return Err(Error::Truncated { got: 0, want: want.into() }) };
        if got != self.cf {
            return Err(Error::CfMismatch { got, want: self.cf });
        }
        match bytes.get(..usize::from(want)) {
            Some(fields @ [_, body @ .., _]) => check(fields).map(|()| body),
            _ => Err(Error::Truncated { got: count(bytes), want: want.into() }),
        }
    }
}

/// The serialised form of a command.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Lengths {
    cf: u8,
    response_fields: u8,
}

#[cfg(feature = "serde")]
impl TryFrom<Lengths> for VendorCommand {
    type Error = OutOfRange;

    fn try_from(Lengths { cf, response_fields }: Lengths) -> Result<Self, OutOfRange> {
        Self::new(cf, response_fields)
    }
}

#[cfg(feature = "serde")]
impl From<VendorCommand> for Lengths {
    fn from(VendorCommand { cf, response_fields }: VendorCommand) -> Self {
        Self { cf, response_fields }
    }
}

#[cfg(feature = "arbitrary")]
#[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
impl<'a> arbitrary::Arbitrary<'a> for VendorCommand {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self { cf: from.arbitrary()?, response_fields: from.int_in_range(2..=11)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRIVATE: VendorCommand = VendorCommand { cf: 0x14, response_fields: 4 };

    #[test]
    fn requests() {
        assert_eq!(PRIVATE.emit(&[]).unwrap().as_bytes(), [0x14]);
        assert_eq!(PRIVATE.emit(&[1, 2]).unwrap().as_bytes(), [0x14, 1, 2, 0x17]);
        assert_eq!(PRIVATE.emit(&[0x10, 2]).unwrap().as_bytes(), [0x14, 0x10, 2, 0x06]);
        assert_eq!(PRIVATE.emit(&[0; 9]).unwrap().fields(), 11);
        assert_eq!(PRIVATE.emit(&[0; 10]), None);
        assert_eq!(PRIVATE.emit(&[0; 11]), None);
    }

    #[test]
    fn responses_have_two_to_eleven_fields() {
        for fields in 0..=255 {
            assert_eq!(VendorCommand::new(0x14, fields).is_ok(), (2..=11).contains(&fields));
        }
        let limit = |fields| VendorCommand::new(0x14, fields).map_err(|error| error.max);
        assert_eq!([limit(0), limit(1), limit(12)], [Err(2), Err(2), Err(11)]);
        assert_eq!((PRIVATE.cf(), PRIVATE.response_fields()), (0x14, 4));
    }

    #[test]
    fn responses() {
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2, 0x17, 9]), Ok(&[1, 2][..]));
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2, 0x16]), Err(Error::Crc { got: 0x16, want: 0x17 }));
        assert_eq!(PRIVATE.parse(&[0x15]), Err(Error::CfMismatch { got: 0x15, want: 0x14 }));
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2]), Err(Error::Truncated { got: 3, want: 4 }));
        assert_eq!(PRIVATE.parse(&[]), Err(Error::Truncated { got: 0, want: 4 }));
    }
}
