use crate::status::StatusField;

servowire_core::errors! {
    /// Why a frame was refused, a transaction failed, or a number does not fit.
    ///
    /// Frames are checked in this order, and the first check that fails is the one reported:
    ///
    /// 1. framing of every field in the order of the line: [`StartBit`](Self::StartBit),
    ///    [`Delimiter`](Self::Delimiter), [`Truncated`](Self::Truncated);
    /// 2. the control field: [`SinkCode`](Self::SinkCode), [`Parity`](Self::Parity),
    ///    [`UnknownDataId`](Self::UnknownDataId) in a request; [`CfMismatch`](Self::CfMismatch) or, at the end of all
    ///    checks, [`Rejected`](Self::Rejected) in a response;
    /// 3. the number of fields: [`Truncated`](Self::Truncated);
    /// 4. the check field: [`Crc`](Self::Crc);
    /// 5. the EEPROM echo: [`AddressMismatch`](Self::AddressMismatch), [`DataMismatch`](Self::DataMismatch).
    ///
    /// Fields count from 0, the control field.
    pub enum Error {
        /// A start bit reads 1.
        #[error("field {field}: the start bit is 1")]
        StartBit = 1 {
            /// The first field with this fault.
            field: u8,
        },
        /// A delimiter reads 0.
        #[error("field {field}: the delimiter is 0")]
        Delimiter = 2 {
            /// The first field with this fault.
            field: u8,
        },
        /// The frame ends too early, or the next field did not arrive in time.
        #[error("the frame ends after {got} of {want} fields")]
        Truncated = 3 {
            /// Number of whole fields received.
            got: u16,
            /// Number of fields of the whole frame.
            want: u16,
        },
        /// The control field does not begin with the sink code 0, 1, 0.
        #[error("control field {cf:#04x}: the sink code is not 010")]
        SinkCode = 4 {
            /// The control field.
            cf: u8,
        },
        /// The parity of the control field is odd.
        #[error("control field {cf:#04x}: the parity is wrong")]
        Parity = 5 {
            /// The control field.
            cf: u8,
        },
        /// The control field is well formed, but its data ID is not one of the nine documented ones.
        #[error("data ID {code:X} is not documented")]
        UnknownDataId = 6 {
            /// The four bits of the data ID.
            code: u8,
        },
        /// The response answers a different data ID from the one requested.
        #[error("the response has control field {got:#04x}, the request had {want:#04x}")]
        CfMismatch = 7 {
            /// Control field of the response.
            got: u8,
            /// Control field of the request.
            want: u8,
        },
        /// The encoder refused the request: it answered with a sound ID 3 frame that was not requested.
        #[error("the encoder refused the request: ID 3 response with status [{sf}]")]
        Rejected = 8 {
            /// Status of that frame; CA0 and CA1 say what was damaged.
            sf: StatusField,
        },
        /// The check field is not the XOR of the fields before it.
        #[error("the check field is {got:#04x}, computed {want:#04x}")]
        Crc = 9 {
            /// Received.
            got: u8,
            /// The check field computed over the received fields.
            want: u8,
        },
        /// An EEPROM response is for another address.
        #[error("the response is for EEPROM address {got:#04x}, expected {want:#04x}")]
        AddressMismatch = 10 {
            /// Address in the response.
            got: u8,
            /// Address in the request.
            want: u8,
        },
        /// The response to an EEPROM write repeats another data byte, or the page register does not take the page.
        #[error("the EEPROM data is {got:#04x}, {want:#04x} was written")]
        DataMismatch = 11 {
            /// Data in the response.
            got: u8,
            /// Data in the request.
            want: u8,
        },
        /// On a half-duplex line the request did not come back as it was sent.
        #[error("byte {at} of the echo is {got:#04x}, {want:#04x} was sent")]
        EchoMismatch = 12 {
            /// Index of the byte in the request.
            at: u8,
            /// Received.
            got: u8,
            /// Sent.
            want: u8,
        },
        /// No response within the time-out.
        #[error("{}", if *.echo { "only our own request came back: no encoder, or the wires A and B are exchanged" } else { "no response" })]
        NoResponse = 13 {
            /// Whether the master's own request was received, in which case the line works but no encoder answers.
            echo: bool,
        },
        /// The EEPROM stayed busy or the encoder did not accept a value, after all tries.
        #[error("the EEPROM was still busy after {tries} requests")]
        Busy = 14 {
            /// Number of requests sent.
            tries: u16,
        },
        /// The operation was not done: reading back twice shows it, or nothing was sent because no two readings before agreed.
        #[error("not done, after {sent} requests: {because}")]
        NotDone = 15 {
            /// Number of requests sent.
            sent: u8,
            /// How the operation failed.
            because: ErrorClass,
        },
        /// It is not known whether the operation was done. Read back what can be read before trying again.
        #[error("it is not known whether it was done: {because}")]
        EffectUnknown = 16 {
            /// How the operation failed.
            because: ErrorClass,
        },
        /// A data field has bits set above the width of the encoder: the wrong resolution, or a damaged frame.
        #[error("data field {value:#08x} has bits set that this encoder keeps at 0: {excess:#08x}")]
        UpperBits = 17 {
            /// The 24-bit field.
            value: u32,
            /// The bits of the field that are set but must be 0.
            excess: u32,
        },
        /// A `nom` combinator of the caller refused the input.
        #[error("a parser combinator refused the input")]
        Combinator = 18,
        /// Two sound responses came in one block, and it is not known which one answers the request.
        #[error("two responses came to one request")]
        TwoResponses = 19,
        /// The settings of the line leave no time for a response: nothing may be sent.
        #[error("the settings of the line leave no time for a response")]
        Line = 20,
    }
}

impl Error {
    /// The field in which the fault shows, 0 for the control field. `None` if the fault is not in one field, or if its field
    /// depends on the length of the frame, as for the check field, which is the last.
    pub const fn field(self) -> Option<u8> {
        match self {
            Self::StartBit { field } | Self::Delimiter { field } => Some(field),
            // Frames have at most eleven fields.
            Self::Truncated { got, .. } => Some(got.to_le_bytes()[0]),
            Self::SinkCode { .. } | Self::Parity { .. } | Self::UnknownDataId { .. } | Self::CfMismatch { .. } => {
                Some(0)
            }
            Self::AddressMismatch { .. } => Some(1),
            Self::DataMismatch { .. } => Some(2),
            _ => None,
        }
    }

    /// The first wrong bit of that [`field`](Self::field) in the order of the line, if it is known: 0 is the start
    /// bit, 1 to 8 are the data bits, 9 is the delimiter.
    pub const fn bit(self) -> Option<u8> {
        match self {
            Self::StartBit { .. } => Some(0),
            Self::Delimiter { .. } => Some(9),
            Self::SinkCode { cf } => data_bit(cf & 0b111, 0b010),
            Self::Parity { .. } => Some(8),
            Self::CfMismatch { got, want } | Self::AddressMismatch { got, want } | Self::DataMismatch { got, want } => {
                data_bit(got, want)
            }
            _ => None,
        }
    }
}

/// Returns the first data bit that differs, 1 to 8.
const fn data_bit(got: u8, want: u8) -> Option<u8> {
    match (got ^ want).trailing_zeros().to_le_bytes() {
        [8, ..] => None,
        [equal, ..] => Some(equal.wrapping_add(1)),
    }
}

servowire_core::nom_error!(Error);

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// TIDM-1011, table 2-3: a start bit, eight data bits from the least significant, a delimiter; the control field is
    /// first, its sink code 0 1 0 comes first in it, its parity last.
    #[test]
    fn a_fault_is_where_it_shows_on_the_line() {
        let at = |error: Error| (error.field(), error.bit());
        assert_eq!(at(Error::StartBit { field: 3 }), (Some(3), Some(0)));
        assert_eq!(at(Error::Delimiter { field: 10 }), (Some(10), Some(9)));
        assert_eq!(at(Error::Truncated { got: 5, want: 11 }), (Some(5), None));
        for (cf, bit) in [(0x1b, 1), (0x18, 2), (0x1e, 3)] {
            assert_eq!(at(Error::SinkCode { cf }), (Some(0), Some(bit)));
        }
        assert_eq!(at(Error::Parity { cf: 0x9a }), (Some(0), Some(8)));
        assert_eq!(at(Error::UnknownDataId { code: 4 }), (Some(0), None));
        assert_eq!(at(Error::CfMismatch { got: 0x8a, want: 0x1a }), (Some(0), Some(5)));
        assert_eq!(at(Error::AddressMismatch { got: 0x12, want: 0x13 }), (Some(1), Some(1)));
        assert_eq!(at(Error::DataMismatch { got: 0x80, want: 0 }), (Some(2), Some(8)));
        assert_eq!(at(Error::DataMismatch { got: 7, want: 7 }), (Some(2), None));
        assert_eq!(at(Error::Crc { got: 1, want: 2 }), (None, None));
        assert_eq!(at(Error::NoResponse { echo: false }), (None, None));
    }

    #[test]
    fn messages_are_sentences_for_a_person() {
        assert_eq!(Error::Crc { got: 0x12, want: 0x34 }.to_string(), "the check field is 0x12, computed 0x34");
        assert!(Error::NoResponse { echo: true }.to_string().contains("A and B"));
        assert_eq!(Error::NoResponse { echo: false }.to_string(), "no response");
        let rejected = Error::Rejected { sf: StatusField::CA0 };
        assert_eq!(rejected.to_string(), "the encoder refused the request: ID 3 response with status [CA0]");
    }
}
