use crate::error::Error;

/// Computes the check field over `bytes`: the data bits of all fields before it, in line order.
///
/// Generator x^8 + 1, width 8, initial value 0, no final XOR (TIDM-1011, section 2.3.1). Because x^8 = 1 modulo the
/// generator, the remainder is the **XOR of the bytes**; bit order and reflection make no difference. Over a whole frame
/// including its check field, the result is 0.
///
/// It detects every odd number of wrong bits and every burst of up to eight data bits. It does not detect:
///
/// * an even number of errors in the same bit column, such as the same bit wrong in two fields. Of all 2-bit
///   errors in the data bits, 9.7 % of a 4-field frame, 10.6 % of a 6-field frame and 11.5 % of an 11-field
///   frame pass;
/// * swapped fields; * a line stuck at 0 and, in frames of 4 or 6 fields, at 1.
///
/// That is why a response also has to pass the framing, sink code, parity and echo of its control field.
///
/// ```
/// assert_eq!(tformat::crc(b"123456789"), 0x31);
/// assert_eq!(tformat::crc(&[0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37]), 0);
/// ```
pub const fn crc(mut bytes: &[u8]) -> u8 {
    let mut sum = 0;
    while let [first, rest @ ..] = bytes {
        sum ^= *first;
        bytes = rest;
    }
    sum
}

/// Checks the last field against the fields before it.
pub(crate) fn check(fields: &[u8]) -> Result<(), Error> {
    match (crc(fields), fields) {
        (0, _) | (_, []) => Ok(()),
        (sum, [.., got]) => Err(Error::Crc { got: *got, want: sum ^ got }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Long division by `poly` (without its top term), most significant bit first.
    fn division(bits: impl Iterator<Item = bool>, poly: u8) -> u8 {
        bits.fold(0_u8, |r, bit| {
            let out = r >> 7 == 1;
            (r << 1) ^ if out ^ bit { poly } else { 0 }
        })
    }

    #[test]
    fn check_value() {
        assert_eq!(crc(b"123456789"), 0x31);
        assert_eq!(crc(b""), 0);
    }

    proptest! {
        #[test]
        fn equals_division_by_x8_plus_1_in_either_bit_order(bytes: [u8; 10]) {
            let msb = bytes.iter().flat_map(|b| (0..8).rev().map(move |k| b >> k & 1 == 1));
            prop_assert_eq!(division(msb, 0x01), crc(&bytes));
            let lsb = bytes.iter().flat_map(|b| (0..8).map(move |k| b >> k & 1 == 1));
            prop_assert_eq!(division(lsb, 0x01).reverse_bits(), crc(&bytes));
        }
    }

    #[test]
    fn what_the_check_field_should_have_been_is_told() {
        assert_eq!(check(&[0x1a, 0x70, 0x0f]), Err(Error::Crc { got: 0x0f, want: 0x6a }));
        assert_eq!((check(&[0x1a, 0x70, 0x6a]), check(&[])), (Ok(()), Ok(())));
    }

    /// The undetected share of 2-bit errors that the documentation states, counted pair by pair.
    #[test]
    fn what_it_cannot_see() {
        for (fields, undetected, pairs) in [(4, 48, 496), (6, 120, 1128), (11, 440, 3828)] {
            let bits = fields * 8;
            let mut missed = 0;
            for a in 0..bits {
                for b in a + 1..bits {
                    let mut frame = [0_u8; 11];
                    frame[a / 8] ^= 1 << (a % 8);
                    frame[b / 8] ^= 1 << (b % 8);
                    missed += usize::from(crc(&frame) == 0);
                }
            }
            assert_eq!((missed, bits * (bits - 1) / 2), (undetected, pairs));
        }
        assert_eq!((crc(&[0xff; 4]), crc(&[0xff; 6]), crc(&[0xff; 11])), (0, 0, 0xff));
    }
}
