servowire_core::number! {
    /// An EEPROM address, 0..=127: 0..=126 are data of the selected page, 127 is the page register.
    pub struct Address(u8, 7);
}

impl Address {
    /// The page register: writing it selects the page, reading it returns the page.
    pub const PAGE_REGISTER: Self = Self::truncate(127);
}

servowire_core::number! {
    /// A page of the EEPROM, 0..=7.
    ///
    /// ```text
    ///  address   0 ............ 126 | 127
    ///            data of the page   | page register
    /// ```
    ///
    /// Tamagawa's encoders have six pages of 127 bytes (762 in all); one compatible encoder has eight. The number of pages is
    /// part of the encoder's [`Resolution`](crate::Resolution).
    pub struct Page(u8, 3);
}

impl Page {
    /// Data bytes in a page.
    pub const LEN: u16 = 127;
    /// Pages of Tamagawa's encoders.
    pub const COUNT: u8 = 6;

    /// Returns the page and address of byte `index` in a memory of `pages` pages; `None` after its end.
    pub const fn locate(index: u16, pages: u8) -> Option<(Self, Address)> {
        let [page, above] = (index / Self::LEN).to_le_bytes();
        let [offset, _] = (index % Self::LEN).to_le_bytes();
        if above != 0 || page >= pages {
            return None;
        }
        match (Self::new(page), Address::new(offset)) {
            (Some(page), Some(address)) => Some((page, address)),
            _ => None,
        }
    }
}

/// The address field (ADF) of an EEPROM access: address in bits 0..=6, busy flag in bit 7 (TIDM-1011, table 2-7).
///
/// A master sends the busy flag as 0, and an encoder ignores it. In a response, 1 means that the memory was still busy, the
/// operation was not done, and the data byte is meaningless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Adf(u8);

impl Adf {
    const BUSY: u8 = 0x80;

    /// Creates the field from a byte; every byte is a valid address field.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Creates the field for an address with the busy flag 0, as a master sends it.
    pub const fn of(address: Address) -> Self {
        Self(address.get())
    }

    /// Sets the busy flag, as an encoder answers while its memory is busy.
    #[must_use]
    pub(crate) const fn with_busy(self) -> Self {
        Self(self.0 | Self::BUSY)
    }

    /// Sets the busy flag to `busy`, as an encoder answers.
    pub(crate) const fn answered(address: Address, busy: bool) -> Self {
        let adf = Self::of(address);
        if busy { adf.with_busy() } else { adf }
    }

    /// The byte.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The address.
    pub const fn address(self) -> Address {
        Address::truncate(self.0)
    }

    /// The busy flag.
    pub const fn busy(self) -> bool {
        self.0 & Self::BUSY != 0
    }
}

servowire_core::one_line!(Adf {
    adf if adf.busy() => "{} busy", adf.address();
    adf => "{}", adf.address();
});

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_byte_is_an_address_field() {
        for bits in 0..=255 {
            let adf = Adf::from_bits(bits);
            assert_eq!((adf.bits(), adf.address().get(), adf.busy()), (bits, bits % 128, bits > 127));
            assert_eq!(adf.with_busy().bits(), bits % 128 + 128);
            assert_eq!(Adf::answered(adf.address(), bits > 127), adf);
        }
        assert_eq!(Adf::from_bits(0x85).to_string(), "5 busy");
        assert_eq!((Address::PAGE_REGISTER.get(), Address::new(128)), (127, None));
    }

    /// Six pages of 127 bytes, 762 in all; a compatible encoder has eight.
    #[test]
    fn the_whole_memory_is_located() {
        let at = |page, address| Some((Page::new(page).unwrap(), Address::new(address).unwrap()));
        assert_eq!(Page::locate(0, 6), at(0, 0));
        assert_eq!(Page::locate(761, 6), at(5, 126));
        assert_eq!(Page::locate(762, 6), None);
        assert_eq!(Page::locate(762, 8), at(6, 0));
        assert_eq!(Page::locate(1016, 9), None);
        assert_eq!(Page::locate(u16::MAX, 255), None);
    }
}
