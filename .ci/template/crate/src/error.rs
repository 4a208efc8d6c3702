servowire_core::errors! {
    /// Why a frame was refused.
    ///
    /// Checks are made in the order of the variants; the first that fails is reported, and nothing is decoded then.
    pub enum Error {
        /// The slice is shorter than a frame.
        #[error("{got} of {want} bytes are there")]
        Truncated = 1 {
            /// Bytes that were there.
            got: u16,
            /// Bytes of a frame.
            want: u16,
        },
        /// The slice is longer than a frame: its end is the end of the frame.
        #[error("{got} bytes, a frame has {want}")]
        TooLong = 2 {
            /// Bytes that were there; 65535 for more.
            got: u16,
            /// Bytes of a frame.
            want: u16,
        },
        /// Byte 0 is not the header.
        #[error("byte 0 is {got:#04x}, a frame begins with 5Ah")]
        Header = 3 {
            /// Byte 0 as received.
            got: u8,
        },
        /// The check byte does not belong to the bytes before it.
        #[error("check byte {got:#04x}, computed {want:#04x}")]
        Crc = 4 {
            /// The byte in the frame.
            got: u8,
            /// The byte that belongs there.
            want: u8,
        },
        /// A `nom` combinator of the caller refused the input.
        #[error("a parser combinator refused the input")]
        Combinator = 5,
    }
}

servowire_core::nom_error!(Error);
