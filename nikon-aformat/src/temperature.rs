use crate::number::U10;

/// A temperature, 10 bits of 0.25 degrees Celsius.
///
/// The vendor's drivers read it as unsigned. It is not documented whether encoders send negative numbers below 0, so the two
/// readings are separate and the caller chooses. The same ten bits are the lowest ten of EEPROM word 0xf9.
///
/// ```
/// use nikon_aformat::{Temperature, U10};
/// let temperature = Temperature(U10::truncate(310));
/// assert_eq!(temperature.milli_celsius(), 77_500);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Temperature(pub U10);

impl Temperature {
    /// EEPROM address of the temperature.
    pub const EEPROM_ADDRESS: u8 = 0xf9;

    /// Creates the temperature from EEPROM word 0xf9.
    pub(crate) const fn from_eeprom(word: u16) -> Self {
        Self(U10::truncate(word))
    }

    /// The ten bits, 0..=1023.
    pub const fn raw(self) -> u16 {
        self.0.get()
    }

    /// Thousandths of a degree Celsius with the ten bits as an unsigned number, 0..=255 750.
    pub const fn milli_celsius(self) -> u32 {
        (self.raw() as u32).wrapping_mul(250)
    }

    /// Thousandths of a degree Celsius with the ten bits as two's complement, -128 000..=127 750.
    pub const fn signed_milli_celsius(self) -> i32 {
        let raw = self.raw() as i32;
        let signed = if raw > 511 { raw.wrapping_sub(1024) } else { raw };
        signed.wrapping_mul(250)
    }
}

// The unsigned reading in degrees Celsius, `77.50 C`.
servowire_core::one_line!(Temperature {
    temperature => "{}.{:02} C", temperature.raw() >> 2, (temperature.raw() & 3).wrapping_mul(25);
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_1024() {
        for raw in 0..1024_u16 {
            let temperature = Temperature::from_eeprom(raw | 0xfc00);
            assert_eq!(temperature.raw(), raw);
            assert_eq!(temperature.milli_celsius(), u32::from(raw) * 1000 / 4);
            let wrapped = temperature.signed_milli_celsius();
            assert_eq!(i64::from(wrapped).rem_euclid(256_000), i64::from(temperature.milli_celsius()));
            assert!((-128_000..128_000).contains(&wrapped));
        }
    }
}
