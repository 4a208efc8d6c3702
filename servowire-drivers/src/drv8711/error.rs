servowire_core::errors! {
    /// Why a register or a chip was refused.
    pub enum Error {
        /// A register field holds a code that the data sheet reserves.
        #[error("code {code} of DRV8711 register {register} is reserved")]
        ReservedCode = 1 {
            /// Address of the register.
            register: u8,
            /// The code.
            code: u8,
        },
        /// A register does not read back as written.
        #[error("DRV8711 register {register} reads {got:#05x}, {want:#05x} was written")]
        ReadBack = 2 {
            /// Address of the register.
            register: u8,
            /// Value read, without bits that always read 0.
            got: u16,
            /// Value written, without the same bits.
            want: u16,
        },
        /// STATUS reads all ones and OFF does not read back: no supply, or no chip on the bus.
        #[error("no DRV8711 on the bus, or no supply")]
        NoChip = 3,
    }
}
