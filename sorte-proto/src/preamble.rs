use crate::error::Error;

const PREAMBLE: u8 = 0x55;
const SFD: u8 = 0xd5;
const MOST: u8 = 7;

/// The preamble and start delimiter before a frame, as the published firmware sends them.
///
/// ```text
///  55 55 55 55 55 55 55 D5   DISCOVERY, PARAM, DELAY_REQ of the master
///              55 55 55 D5   SYNC; DELAY_REQ of a device
///                    55 D5   both frames of the IO exchange
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Preamble {
    /// Seven times 0x55: what an ordinary Ethernet capture needs.
    Long,
    /// Three times 0x55.
    Middle,
    /// Once 0x55: as short as the 4 us cycle needs.
    Short,
}

impl Preamble {
    /// The bytes, including 0xD5.
    pub const fn bytes(self) -> &'static [u8] {
        match self {
            Self::Long => &[0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0xd5],
            Self::Middle => &[0x55, 0x55, 0x55, 0xd5],
            Self::Short => &[0x55, 0xd5],
        }
    }

    /// Time from the first bit of the preamble, which is the trigger of the frame, to the capture of its start by the published
    /// ports, half a byte before the end of 0xD5: 600, 280 and 120 ns. All `sof_ns` of this crate are such captures. A port
    /// that captures at another point adds the difference.
    pub const fn capture_ns(self) -> u32 {
        match self {
            Self::Long => 600,
            Self::Middle => 280,
            Self::Short => 120,
        }
    }
}

/// Returns the bytes after preamble and start delimiter. PHYs may swallow part of a preamble, so any 1 to 7 bytes 0x55
/// followed by 0xD5 are accepted, whatever the frame.
///
/// # Errors
/// [`Error::BadPreamble`] with the index of the first wrong byte, or with the length if the bytes end before 0xD5.
pub fn strip_preamble(wire: &[u8]) -> Result<&[u8], Error> {
    match scan(wire) {
        Scan::Frame(frame) => Ok(frame),
        Scan::Bad { at } => Err(Error::BadPreamble { at }),
        Scan::Ended => Err(Error::BadPreamble { at: u8::try_from(wire.len()).unwrap_or(MOST) }),
    }
}

pub(crate) enum Scan<'a> {
    Frame(&'a [u8]),
    Bad { at: u8 },
    Ended,
}

pub(crate) fn scan(wire: &[u8]) -> Scan<'_> {
    let mut rest = wire;
    for at in 0..=MOST {
        rest = match (at, rest) {
            (0..MOST, [PREAMBLE, rest @ ..]) => rest,
            (1..=MOST, [SFD, frame @ ..]) => return Scan::Frame(frame),
            (_, []) => return Scan::Ended,
            _ => return Scan::Bad { at },
        };
    }
    Scan::Bad { at: MOST }
}

#[cfg(test)]
mod tests {
    use std::vec;

    use super::*;

    #[test]
    fn one_to_seven_preamble_bytes_are_taken() {
        for n in 0..12 {
            let mut wire = vec![0x55; n];
            wire.extend([0xd5, 1, 2, 3]);
            if (1..=7).contains(&n) {
                assert_eq!(strip_preamble(&wire), Ok(&[1, 2, 3][..]));
            } else {
                assert_eq!(strip_preamble(&wire), Err(Error::BadPreamble { at: n.min(7) as u8 }));
            }
        }
    }

    #[test]
    fn a_wrong_byte_and_an_early_end_are_named() {
        for preamble_bytes in 1..=7 {
            for at in 0..preamble_bytes {
                let mut wire = vec![0x55; preamble_bytes];
                wire.push(0xd5);
                wire[at] = 0x5d;
                assert_eq!(strip_preamble(&wire), Err(Error::BadPreamble { at: at as u8 }));
            }
            let wire = vec![0x55; preamble_bytes];
            assert_eq!(strip_preamble(&wire), Err(Error::BadPreamble { at: preamble_bytes as u8 }));
        }
        assert_eq!(strip_preamble(&[]), Err(Error::BadPreamble { at: 0 }));
    }

    #[test]
    fn the_sent_forms_are_accepted() {
        for form in [Preamble::Long, Preamble::Middle, Preamble::Short] {
            assert_eq!(strip_preamble(form.bytes()), Ok(&[][..]));
        }
    }
}
