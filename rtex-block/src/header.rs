use core::fmt;

servowire_core::number! {
    /// Address of a drive on the ring, 0..=31 (MAC-ID).
    ///
    /// A drive reads it from its rotary switches when it powers up. SX-DSV02310, "Command header".
    pub struct MacId(u8, 5);
}

impl MacId {
    /// Number of addresses, and so the largest number of drives on a ring.
    pub const COUNT: usize = 32;
}

servowire_core::number! {
    /// Update_Counter, 0..=3: the master adds 1 modulo 4 in every update period.
    pub struct UpdateCounter(u8, 2);
}

impl UpdateCounter {
    /// The counter sent with the invalid data (00h) before the first valid block.
    pub const ZERO: Self = Self::truncate(0);

    /// Returns the counter of the next update period; 0 follows 3.
    #[must_use]
    pub const fn next(self) -> Self {
        Self::truncate(self.get().wrapping_add(1))
    }
}

/// Byte 0 of either block.
///
/// ```text
///   7    6     5    4    3    2    1    0
/// ┌─────┬──────────┬────────────────────────┐
/// │ C/R │  counter │         MAC-ID         │   C/R: 0 command, 1 response
/// └─────┴──────────┴────────────────────────┘
/// ```
/// In a response the counter is Update_Counter_Echo, and the MAC-ID is Actual_MAC-ID: not an echo but the address that the
/// drive read from its switches. System Design Guide for Master, "Data structure"; SX-DSV02310, "Command header" and
/// "Response header".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Header {
    /// C/R: `true` in a response.
    pub response: bool,
    /// Update_Counter or its echo.
    pub update_counter: UpdateCounter,
    /// MAC-ID or Actual_MAC-ID.
    pub mac_id: MacId,
}

impl Header {
    /// Decodes byte 0; every value is a header.
    pub const fn parse(byte0: u8) -> Self {
        Self {
            response: byte0 & 0x80 != 0,
            update_counter: UpdateCounter::truncate(byte0 >> 5),
            mac_id: MacId::truncate(byte0),
        }
    }

    /// Byte 0.
    pub const fn emit(self) -> u8 {
        (self.response as u8) << 7 | self.update_counter.get() << 5 | self.mac_id.get()
    }
}

impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} #{}", if self.response { "from" } else { "to" }, self.mac_id, self.update_counter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte() {
        for byte in 0..=255 {
            let header = Header::parse(byte);
            assert_eq!(header.emit(), byte);
            assert_eq!(header.response, byte >= 0x80);
            assert_eq!(
                u32::from(header.update_counter.get()) * 32 + u32::from(header.mac_id.get()),
                u32::from(byte % 128)
            );
        }
    }

    #[test]
    fn narrow_numbers() {
        assert_eq!((0..=255).filter_map(MacId::new).count(), MacId::COUNT);
        assert_eq!((0..=255).filter_map(UpdateCounter::new).count(), 4);
        let walk = core::iter::successors(Some(UpdateCounter::ZERO), |c| Some(c.next()));
        assert!(walk.take(9).map(UpdateCounter::get).eq([0, 1, 2, 3, 0, 1, 2, 3, 0]));
    }
}
