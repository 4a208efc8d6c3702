use crate::request::{check_crc, count};
use crate::{Error, Frame};

/// The extension point for commands that are not Tamagawa's: encoders of other makers use private ones over the
/// same fields, some even with control fields that break the layout.
///
/// Nothing is known of such a command but its first byte and its lengths, so nothing else is checked: the
/// repeated control field, the number of fields, and the check field.
///
/// ```
/// use tformat::{ControlField, VendorCommand};
/// // data ID 5 is not documented; suppose an encoder answers it with five fields
/// let command = VendorCommand { cf: ControlField::compose(5).get(), response_fields: 5 };
/// assert_eq!(command.parse(&[0x2a, 0x11, 0x22, 0x33, 0x2a]), Ok(&[0x11, 0x22, 0x33][..]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct VendorCommand {
    /// First field of the request and of the answer; see [`ControlField::compose`](crate::ControlField::compose).
    pub cf: u8,
    /// Fields of the answer, with the control and check fields, 2 to 11.
    pub response_fields: u8,
}

impl VendorCommand {
    /// The request: the control field alone, or followed by `body` and the check field over both.
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
        *rest.first_mut()? = self.cf ^ crate::crc(body);
        let len = body.len().saturating_add(2);
        Frame::new(bytes.get(..len)?)
    }

    /// The fields of an answer between control field and check field.
    ///
    /// # Errors
    /// [`Error::Truncated`] without any field, [`Error::CfMismatch`], [`Error::Truncated`], [`Error::Crc`].
    pub fn parse(self, bytes: &[u8]) -> Result<&[u8], Error> {
        let want = self.response_fields;
        let Some(&got) = bytes.first() else { return Err(Error::Truncated { got: 0, want }) };
        if got != self.cf {
            return Err(Error::CfMismatch { got, want: self.cf });
        }
        match bytes.get(..usize::from(want)) {
            Some(fields @ [_, body @ .., _]) => check_crc(fields).map(|()| body),
            _ => Err(Error::Truncated { got: count(bytes), want }),
        }
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
        assert_eq!(PRIVATE.emit(&[0; 9]).unwrap().fields(), 11);
        assert_eq!(PRIVATE.emit(&[0; 10]), None);
        assert_eq!(PRIVATE.emit(&[0; 11]), None);
    }

    #[test]
    fn answers() {
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2, 0x17, 9]), Ok(&[1, 2][..]));
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2, 0x16]), Err(Error::Crc { got: 0x16, want: 0x17 }));
        assert_eq!(PRIVATE.parse(&[0x15]), Err(Error::CfMismatch { got: 0x15, want: 0x14 }));
        assert_eq!(PRIVATE.parse(&[0x14, 1, 2]), Err(Error::Truncated { got: 3, want: 4 }));
        assert_eq!(PRIVATE.parse(&[]), Err(Error::Truncated { got: 0, want: 4 }));
    }
}
