//! The two 24-bit fields. They are separate types, so that one is never mistaken for the other.

macro_rules! le_bytes {
    ($name:ident) => {
        impl $name {
            /// Creates the value from its three fields, the low byte first.
            #[inline]
            pub const fn from_le_bytes([low, middle, high]: [u8; 3]) -> Self {
                Self::truncate(u32::from_le_bytes([low, middle, high, 0]))
            }

            /// Returns the value as three fields, the low byte first.
            #[inline]
            pub const fn to_le_bytes(self) -> [u8; 3] {
                let [low, middle, high, _] = self.get().to_le_bytes();
                [low, middle, high]
            }
        }
    };
}

servowire_core::number! {
    /// ABS0..ABS2: the single-turn position as received, 24 bits. Its width depends on the encoder, see
    /// [`Resolution`](crate::Resolution).
    pub struct Abs(u32, 24);
}
le_bytes!(Abs);

servowire_core::number! {
    /// ABM0..ABM2: the turns as received, 24 bits.
    pub struct Abm(u32, 24);
}
le_bytes!(Abm);
