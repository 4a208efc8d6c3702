use core::fmt;

use nrz_line::{BitOrder, Window};

use crate::abs40::{Abs40, words};
use crate::command::Command;
use crate::data::Data;
use crate::error::Error;
use crate::expected::{Expected, SYNC_CODE};
use crate::layout::Layout;
use crate::number::{EncoderAddress, U17, U40};
use crate::raw_response::RawResponse;
use crate::status::{Alm, EncoderStatus};
use crate::temperature::Temperature;

#[cfg(test)]
pub(crate) mod tests;

/// What an encoder sends.
///
/// ```text
///  first frame of all but commands 21, 22: the information field (IF)
///    line, time →   0  0  1  | ea0 ea1 ea2 | cc0 cc1 cc2 cc3 cc4 |  0        | ES0 ES1 ES2 ES3
///                   sync 4   | address     | command, repeated   | fixed bit | encoder status
///
///  first frame of commands 21 and 22
///    line, time →   0  0  1  | ea0 ea1 ea2 | ES0 | ES1 | ES2 | ES3  in one bit | abs0 ... abs8
///
///  then the data of the layout, and in the last eight content bits the CRC-8
/// ```
///
/// Every field travels least significant bit first, the CRC-8 most significant bit first. Bits that a layout leaves
/// unused are ignored in reception and sent as 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Response {
    /// EA: who answers.
    pub ea: EncoderAddress,
    /// The rest.
    pub body: Body,
}

/// What stands behind the address of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Body {
    /// The short form of commands 21 and 22, without repetition of the command.
    Abs17 {
        /// Whether any of ES0 to ES3 is set.
        es_any: bool,
        /// Position bits 0..=16.
        abs: U17,
    },
    /// All others.
    Full {
        /// CC, the command that is answered.
        command: Command,
        /// ES.
        es: EncoderStatus,
        /// The data.
        data: Data,
    },
}

impl Response {
    /// Value of the sync code that begins a response.
    pub const SYNC_CODE: u8 = SYNC_CODE;

    /// A response with full information field.
    pub const fn new(ea: EncoderAddress, command: Command, es: EncoderStatus, data: Data) -> Self {
        Self { ea, body: Body::Full { command, es, data } }
    }

    /// The response to commands 21 and 22.
    pub const fn abs17(ea: EncoderAddress, es: EncoderStatus, abs: U17) -> Self {
        Self { ea, body: Body::Abs17 { es_any: !es.is_empty(), abs } }
    }

    /// Decodes a response whose frames are at hand.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`], [`Error::Crc`], [`Error::SyncCode`], [`Error::FixedBit`],
    /// [`Error::AddressMismatch`], [`Error::CommandMismatch`], [`Error::BankError`], [`Error::EchoMismatch`].
    pub fn parse(expected: &Expected, raw: &RawResponse) -> Result<Self, Error> {
        if !raw.is_sound() || !expected.fits(raw) {
            return Err(expected.refusal(raw));
        }
        let contents = raw.all_contents();
        let [first, second, ..] = contents;
        let ea = EncoderAddress::truncate(low_byte(first >> 3));
        let body = if let Some(data) = Data::from_contents(expected.layout(), contents) {
            expected.check_memory(data)?;
            let es = EncoderStatus::from_bits_truncate(low_byte(first >> 12));
            Body::Full { command: expected.command(), es, data }
        } else {
            let abs = U17::truncate(u32::from(first) >> 7 | u32::from(second) << 9);
            Body::Abs17 { es_any: first >> 6 & 1 == 1, abs }
        };
        Ok(Self { ea, body })
    }

    /// Decodes a response from 16-bit words, the content bits of one frame each; words behind it are left alone.
    ///
    /// ```
    /// use nikon_aformat::{BitOrder, Command, Expected, Layout, Response};
    /// // the response that the manual of a vendor's driver shows: encoder 0, command 4, 17 + 16 bits
    /// let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
    /// let raw = Response::parse_words(&expected, &[0x2085, 0xf64a, 0x8009, 0x80a1], BitOrder::MsbFirst)?;
    /// let abs = raw.abs40().map_or(0, |abs| abs.get());
    /// assert_eq!((abs & 0x1_ffff, abs >> 17), (86_639, 51_200));
    /// # Ok::<(), nikon_aformat::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_words(expected: &Expected, words: &[u16], order: BitOrder) -> Result<Self, Error> {
        if let (Layout::Abs40, Some(four)) = (expected.layout(), words.first_chunk::<4>()) {
            let contents = match order {
                BitOrder::LsbFirst => *four,
                BitOrder::MsbFirst => four.map(u16::reverse_bits),
            };
            if let Some(abs40) = Abs40::of_contents(expected, contents) {
                return Ok(Self::of_abs40(expected, abs40));
            }
        }
        Self::parse_any(expected, RawResponse::from_words(expected.layout(), words, order))
    }

    /// Decodes the response at the beginning of a piece of line, its frames back to back; bits behind it are left alone.
    ///
    /// Take the piece out of a packed buffer at any bit offset with [`Window::read`].
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`] and [`Error::Delimiter`] frame by frame, then as
    /// [`parse`](Self::parse).
    pub fn parse_line(expected: &Expected, line: Window) -> Result<Self, Error> {
        if expected.layout() == Layout::Abs40 && line.len() >= Layout::Abs40.line_bits() {
            if let Some(abs40) = Abs40::of_words(expected, words(line.bits())) {
                return Ok(Self::of_abs40(expected, abs40));
            }
        }
        Self::parse_any(expected, RawResponse::from_line(expected.layout(), line))
    }

    /// All other layouts, and what the kernel of ABS40 refuses.
    fn parse_any(expected: &Expected, raw: Result<RawResponse, Error>) -> Result<Self, Error> {
        Self::parse(expected, &raw?)
    }

    #[inline(always)]
    const fn of_abs40(expected: &Expected, Abs40 { ea, es, abs }: Abs40) -> Self {
        Self { ea, body: Body::Full { command: expected.command(), es, data: Data::Abs40 { abs } } }
    }

    /// The frames to send.
    pub fn emit(self) -> RawResponse {
        let head = u128::from(Self::SYNC_CODE) | u128::from(self.ea.get()) << 3;
        let (payload, layout) = match self.body {
            Body::Abs17 { es_any, abs } => (head | u128::from(es_any) << 6 | u128::from(abs.get()) << 7, Layout::Abs17),
            Body::Full { command, es, data } => {
                let head = head | u128::from(command.code()) << 6 | u128::from(es.bits() & 0xf) << 12;
                (head | data.bits() << 16, data.layout())
            }
        };
        RawResponse::of_payload(payload, layout)
    }

    /// The layout.
    pub const fn layout(self) -> Layout {
        match self.body {
            Body::Abs17 { .. } => Layout::Abs17,
            Body::Full { data, .. } => data.layout(),
        }
    }

    /// The command that is answered; `None` in the short form.
    pub const fn command(self) -> Option<Command> {
        match self.body {
            Body::Abs17 { .. } => None,
            Body::Full { command, .. } => Some(command),
        }
    }

    /// ES; `None` in the short form.
    pub const fn es(self) -> Option<EncoderStatus> {
        match self.body {
            Body::Abs17 { .. } => None,
            Body::Full { es, .. } => Some(es),
        }
    }

    /// Whether any status bit is set, in both forms.
    pub const fn has_status(self) -> bool {
        match self.body {
            Body::Abs17 { es_any, .. } => es_any,
            Body::Full { es, .. } => !es.is_empty(),
        }
    }

    /// The data; `None` in the short form.
    pub const fn data(self) -> Option<Data> {
        match self.body {
            Body::Abs17 { .. } => None,
            Body::Full { data, .. } => Some(data),
        }
    }

    /// The whole position, where the response carries it.
    pub const fn abs40(self) -> Option<U40> {
        match self.data() {
            Some(Data::Abs40 { abs } | Data::Abs40Vel { abs, .. }) => Some(abs),
            _ => None,
        }
    }

    /// The position from bit 0 up, as far as the response carries it: see [`Layout::abs_bits`].
    pub const fn abs(self) -> Option<u64> {
        match self.body {
            Body::Abs17 { abs, .. } => Some(abs.get() as u64),
            Body::Full { data, .. } => match data {
                Data::Abs40 { abs } | Data::Abs40Vel { abs, .. } => Some(abs.get()),
                Data::Abs24 { abs }
                | Data::Abs24Status { abs, .. }
                | Data::Abs24Temp { abs, .. }
                | Data::Abs24Vel { abs, .. }
                | Data::Abs24VelAcc { abs, .. } => Some(abs.get() as u64),
                _ => None,
            },
        }
    }

    /// The alarms, where the response carries them.
    pub const fn alm(self) -> Option<Alm> {
        match self.data() {
            Some(Data::Status { alm, .. } | Data::Abs24Status { alm, .. }) => Some(alm),
            _ => None,
        }
    }

    /// The temperature, where the response carries it.
    pub const fn temperature(self) -> Option<Temperature> {
        match self.data() {
            Some(Data::Temperature { temperature } | Data::Abs24Temp { temperature, .. }) => Some(temperature),
            _ => None,
        }
    }

    /// The velocity, where the response carries it.
    pub const fn velocity(self) -> Option<i32> {
        match self.data() {
            Some(
                Data::Abs24Vel { velocity, .. } | Data::Abs24VelAcc { velocity, .. } | Data::Abs40Vel { velocity, .. },
            ) => Some(velocity),
            _ => None,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the caller cuts its field off")]
const fn low_byte(bits: u16) -> u8 {
    bits as u8
}

impl fmt::Display for Response {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.body {
            Body::Abs17 { es_any, abs } => {
                write!(f, "from {}: ABS17 ES {} ABS {:#07x}", self.ea, if es_any { "any" } else { "-" }, abs.get())
            }
            Body::Full { command, es, data } => write!(f, "from {}: {command} ES {es} {data}", self.ea),
        }
    }
}

crate::text::format_as_displayed!(Response);
