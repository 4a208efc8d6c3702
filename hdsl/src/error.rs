use crate::resource::ResourceError;

servowire_core::errors! {
    /// Why received data were refused, or why a requested operation cannot be done.
    ///
    /// An answer is judged channel by channel, each in this order, and the first check that fails is the one reported:
    ///
    /// 1. length: [`Truncated`](Self::Truncated);
    /// 2. the 8b/10b words of the channel: [`InvalidWord`](Self::InvalidWord);
    /// 3. the mark for "the encoder has no value": [`EncoderError`](Self::EncoderError) in the acceleration channel, then
    ///    other special characters there: [`WrongKind`](Self::WrongKind);
    /// 4. the check bits: [`AccelerationCrc`](Self::AccelerationCrc), [`Crc`](Self::Crc);
    /// 5. the contents: [`PositionInvalid`](Self::PositionInvalid), [`UndefinedSymbol`](Self::UndefinedSymbol),
    ///    [`Header`](Self::Header) and the like.
    pub enum Error {
        /// Fewer bits, samples or bytes than the unit has.
        #[error("{got} of {want} are there")]
        Truncated = 1 {
            /// How many were received.
            got: u16,
            /// How many the unit takes.
            want: u16,
        },
        /// A 10-bit word is in neither column of the 8b/10b tables.
        #[error("{word:#05x} (a in bit 0) is not an 8b/10b word")]
        InvalidWord = 2 {
            /// The word, first line bit in bit 0.
            word: u16,
        },
        /// A special character came where only data are allowed, or data where a special character is required.
        #[error("character {byte:#04x} is of the wrong kind here")]
        WrongKind = 3 {
            /// Value of the character.
            byte: u8,
        },
        /// The acceleration channel carries K29.7 K29.7: the encoder has no value for this frame.
        #[error("the encoder reports that it has no acceleration value")]
        EncoderError = 4,
        /// The CRC-5 of the acceleration word is wrong.
        #[error("the acceleration word has check bits {got:#04x}, computed {want:#04x}")]
        AccelerationCrc = 5 {
            /// Received.
            got: u8,
            /// Computed.
            want: u8,
        },
        /// The CRC-16 of a safe position or a message is wrong.
        #[error("the CRC is {got:#06x}, computed {want:#06x}")]
        Crc = 6 {
            /// Received.
            got: u16,
            /// The CRC computed over the received bytes.
            want: u16,
        },
        /// The block is sound, but the encoder cannot deliver a position.
        #[error("the encoder cannot deliver a position (mark {mark:#04x})")]
        PositionInvalid = 7 {
            /// FDh in safe channel 1, FBh in safe channel 2.
            mark: u8,
        },
        /// The five symbol bits of a parameter byte have no meaning in this direction.
        #[error("{symbol:#04x} is not a symbol of the parameters channel in this direction")]
        UndefinedSymbol = 8 {
            /// Bits 4:0 of the byte.
            symbol: u8,
        },
        /// The line stayed high: no encoder answered.
        #[error("no falling edge: nobody answered")]
        NoEdge = 9,
        /// The test pattern of the start-up was found at none of the delays.
        #[error("the test pattern is at none of the delays, sampled at index {index}")]
        PatternNotFound = 10 {
            /// Sampling index derived from the first edge, 0..=7.
            index: u8,
        },
        /// The answer is not the test pattern of the start-up.
        #[error("the answer is not the test pattern")]
        Pattern = 11,
        /// The bits on the line are not the beginning of an H-frame.
        #[error("no SYNC, SAMPLE and CYCLE RESET at the beginning of the frame")]
        Framing = 12,
        /// The two copies of the encoder identifier differ.
        #[error("the identifier came as {first:#07x} and as {second:#07x}")]
        EncoderIdMismatch = 13 {
            /// The copy from the vertical, parameter and pipe words.
            first: u32,
            /// The copy from the acceleration words and the other nibble of the pipe word.
            second: u32,
        },
        /// The identifier requires something that this receiver does not support.
        #[error("encoder identifier {id:#07x} is not supported")]
        UnsupportedEncoder = 14 {
            /// The 20 bits.
            id: u32,
        },
        /// The answer to a short message begins like a long one.
        #[error("first byte {first:#04x} begins a long message")]
        LongMessageStart = 15 {
            /// First byte of the answer.
            first: u8,
        },
        /// The answer to a long message begins like a short one, or a header byte lacks its marker bit.
        #[error("first byte {first:#04x} begins a short message")]
        ShortMessageStart = 16 {
            /// The byte.
            first: u8,
        },
        /// A sound message is for another register or address, or for the other direction.
        #[error("the answer begins with {got:#06x}, expected {want:#06x}")]
        Header = 17 {
            /// Received header.
            got: u16,
            /// Header that belongs to the request.
            want: u16,
        },
        /// The encoder answered a long message with an error.
        #[error("the encoder refused the long message: {error}")]
        Resource = 18 {
            /// Why.
            error: ResourceError,
        },
        /// The encoder did not accept the message (SNAK or LNAK) in any of the tries.
        #[error("the encoder did not accept the message, {tries} tries")]
        NotAccepted = 19 {
            /// How many times the message was sent.
            tries: u8,
        },
        /// No sound answer within the time-out in any of the tries.
        #[error("no answer to the message, {tries} tries")]
        NoAnswer = 20 {
            /// How many times the message was sent.
            tries: u8,
        },
        /// The message was dropped by a message reset or a restart of the link.
        #[error("the message was dropped by a reset")]
        Dropped = 21,
        /// A message of this kind is already under way.
        #[error("a message of this kind is under way")]
        Busy = 22,
        /// The link is not in the state that the operation needs.
        #[error("the link is not up")]
        NotLocked = 23,
        /// The number of data bytes is not 0, 2, 4 or 8.
        #[error("{len} data bytes: a long message carries 0, 2, 4 or 8")]
        DataLength = 24 {
            /// Bytes given.
            len: u8,
        },
        /// The period is shorter than the frames that have to fit into it.
        #[error("the period lacks {missing} line bits for the shortest frames")]
        PeriodTooShort = 25 {
            /// Number of missing bits, rounded up.
            missing: u32,
        },
        /// The name of a user file is invalid: it has 1 to 8 characters 20h..=7Eh, then 00h.
        #[error("this is not the name of a user file")]
        FileName = 26,
        /// No pulse period is known with which the frames could be synchronised.
        #[error("no pulse period was given")]
        NoPulse = 27,
        /// The register map has no register at this address.
        #[error("there is no register {address:#04x}")]
        NoRegister = 28 {
            /// The address.
            address: u8,
        },
        /// The EXTRA window of the start-up arithmetic is outside 4..=9 bits.
        #[error("the EXTRA window would be {extra} bits, 4 to 9 are allowed")]
        ExtraOutOfRange = 29 {
            /// The whole bits of the window in each frame.
            extra: u32,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn messages_are_sentences_for_a_person() {
        assert_eq!(Error::Crc { got: 0x1234, want: 0x5678 }.to_string(), "the CRC is 0x1234, computed 0x5678");
        assert_eq!(Error::InvalidWord { word: 0x3ff }.to_string(), "0x3ff (a in bit 0) is not an 8b/10b word");
    }
}
