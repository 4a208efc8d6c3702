use servowire_core::OutOfRange;

/// Address of a device, 1..=254: its place in the line, given by DISCOVERY.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
pub struct DeviceAddress(u8);

impl DeviceAddress {
    /// The device next to the master.
    pub const FIRST: Self = Self(1);
    /// The highest possible address.
    pub const MAX: Self = Self(254);

    /// Returns the address, or `None` outside 1..=254.
    pub const fn new(address: u8) -> Option<Self> {
        if address == 0 || address > Self::MAX.0 { None } else { Some(Self(address)) }
    }

    /// Returns the nearest address: 1 for 0, 254 for 255.
    pub const fn truncate(address: u8) -> Self {
        match address {
            0 => Self::FIRST,
            u8::MAX => Self::MAX,
            address => Self(address),
        }
    }

    /// The number.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Number of devices between the master and this one, 0..=253.
    pub(crate) const fn hops_before(self) -> u8 {
        self.0.saturating_sub(1)
    }
}

impl TryFrom<u8> for DeviceAddress {
    type Error = OutOfRange;

    fn try_from(address: u8) -> Result<Self, OutOfRange> {
        let limit = if address == 0 { Self::FIRST } else { Self::MAX };
        Self::new(address).ok_or_else(|| OutOfRange::above(address.into(), limit.0.into()))
    }
}

impl From<DeviceAddress> for u8 {
    fn from(address: DeviceAddress) -> Self {
        address.0
    }
}

impl core::fmt::Display for DeviceAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(feature = "arbitrary")]
impl arbitrary::Arbitrary<'_> for DeviceAddress {
    fn arbitrary(u: &mut arbitrary::Unstructured<'_>) -> arbitrary::Result<Self> {
        u8::arbitrary(u).map(Self::truncate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_1_to_254() {
        for address in 0..=u8::MAX {
            let legal = (1..=254).contains(&address);
            assert_eq!(DeviceAddress::new(address).map(DeviceAddress::get), legal.then_some(address));
            assert_eq!(DeviceAddress::try_from(address).ok(), DeviceAddress::new(address));
            assert_eq!(DeviceAddress::truncate(address).get(), address.clamp(1, 254));
        }
        assert_eq!(DeviceAddress::try_from(0), Err(OutOfRange { got: 0, max: 1 }));
        assert_eq!(DeviceAddress::try_from(255), Err(OutOfRange { got: 255, max: 254 }));
    }
}
