//! The two 24-bit fields. They are types of their own, so that one is never taken for the other.

macro_rules! le_bytes {
    ($name:ident) => {
        impl $name {
            /// From the three fields, the low byte first.
            #[inline]
            pub const fn from_le_bytes([low, middle, high]: [u8; 3]) -> Self {
                Self::truncate(u32::from_le_bytes([low, middle, high, 0]))
            }

            /// As three fields, the low byte first.
            #[inline]
            pub const fn to_le_bytes(self) -> [u8; 3] {
                let [low, middle, high, _] = self.get().to_le_bytes();
                [low, middle, high]
            }
        }
    };
}

servowire_core::number! {
    /// ABS0..ABS2: the single-turn position as received, 24 bits. Its width is the encoder's, see
    /// [`Resolution`](crate::Resolution).
    pub struct Abs(u32, 24);
}
le_bytes!(Abs);

servowire_core::number! {
    /// ABM0..ABM2: the turns as received, 24 bits.
    pub struct Abm(u32, 24);
}
le_bytes!(Abm);
