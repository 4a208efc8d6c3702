servowire_core::errors! {
    /// The reason why a block was refused.
    ///
    /// Checks are made in the order of the variants; the first that fails is reported, and nothing is decoded.
    /// `strict` decoding goes through all of them, lenient decoding stops before [`CodePair`](Self::CodePair).
    pub enum Error {
        /// The slice is shorter than a block.
        #[error("{got} bytes, a block has {want}")]
        Truncated = 1 {
            /// Number of bytes received.
            got: u16,
            /// Number of bytes that a block has: 16 or 32.
            want: u16,
        },
        /// The slice is longer than a block; it must be exactly one block.
        #[error("{got} bytes, a block has {want}")]
        TooLong = 2 {
            /// Number of bytes received; 65535 for more.
            got: u16,
            /// Number of bytes that a block has: 16 or 32.
            want: u16,
        },
        /// C/R (bit 7 of byte 0) says command where a response was expected, or the other way round.
        #[error("byte 0 is {byte0:#04x}: the C/R bit tells the wrong direction")]
        Direction = 3 {
            /// Byte 0 as received.
            byte0: u8,
        },
        /// The block belongs to another drive.
        #[error("MAC-ID {got}, expected {want}")]
        MacId = 4 {
            /// The MAC-ID in the block.
            got: u8,
            /// The MAC-ID that was expected.
            want: u8,
        },
        /// Bits 6-4 of byte 1 are 5, 6 or 7. A drive answers 0021h.
        #[error("cyclic code {code} is not defined")]
        CyclicCode = 5 {
            /// The code, 5..=7.
            code: u8,
        },
        /// Bits 3-0 of byte 1 are 3, 8, 9 or Bh to Fh. A drive answers 0022h.
        #[error("non-cyclic code {code:x}h is not defined")]
        NonCyclicCode = 6 {
            /// The code, 0..=15.
            code: u8,
        },
        /// Sub_Chk (bit 7 of byte 16) is 0. A drive answers 0012h in the sub block and executes nothing.
        #[error("byte 16 is {byte16:#04x}: Sub_Chk is not set")]
        SubChk = 7 {
            /// Byte 16 as received.
            byte16: u8,
        },
        /// Bits 3-0 of byte 16 of a command are not 0, 2 or Ah. A drive answers 0022h in the sub block.
        #[error("sub-command code {code:x}h is not defined")]
        SubCommandCode = 8 {
            /// The code, 0..=15.
            code: u8,
        },
        /// Both codes are defined but must not be used together (strict decoding only).
        #[error("cyclic and non-cyclic code of {code:02x}h cannot be combined")]
        CodePair = 9 {
            /// Bits 6-0 of byte 1.
            code: u8,
        },
        /// A bit is 1 that the layout defines as 0 (strict decoding only).
        #[error("byte {byte} has reserved bits {bits:#04x} set")]
        Reserved = 10 {
            /// Index of the first faulty byte in the block, 0..=31.
            byte: u8,
            /// The reserved bits of this byte that are 1.
            bits: u8,
        },
        /// A `nom` combinator of the caller refused the input.
        #[error("a parser combinator refused the input")]
        Combinator = 11,
    }
}

servowire_core::nom_error!(Error);

/// It is kept out of the good path, where its stores would otherwise be executed, to no effect, for every good block.
#[cold]
#[inline(never)]
pub(crate) const fn wrong_direction(byte0: u8) -> Error {
    Error::Direction { byte0 }
}

/// Returns the error for `got` bytes where a block has `want`.
#[cold]
#[expect(clippy::cast_possible_truncation, reason = "compared before")]
pub(crate) const fn wrong_length(got: usize, want: u16) -> Error {
    let got = if got > u16::MAX as usize { u16::MAX } else { got as u16 };
    if got < want { Error::Truncated { got, want } } else { Error::TooLong { got, want } }
}
