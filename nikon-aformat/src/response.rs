use nrz_line::{BitOrder, Window};
use servowire_core::U24;

use crate::command::Command;
use crate::contents::{Contents, sound_line, sound_words};
use crate::data::Data;
use crate::error::Error;
use crate::expected::{Expected, SYNC_CODE};
use crate::layout::Layout;
use crate::number::{EncoderAddress, EncoderId, U17, U19, U40};
use crate::raw_response::RawResponse;
use crate::status::{Alm, EncoderStatus, PmAlm};
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
/// Every field is sent least significant bit first, the CRC-8 most significant bit first. Bits that a layout leaves unused are
/// ignored on reception and sent as 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Response {
    /// EA: the encoder that answers.
    pub ea: EncoderAddress,
    /// The rest.
    pub body: Body,
}

/// The part of a response after the address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Body {
    /// The short form of commands 21 and 22, which does not repeat the command.
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

    /// Creates a response with a full information field.
    pub const fn new(ea: EncoderAddress, command: Command, es: EncoderStatus, data: Data) -> Self {
        Self { ea, body: Body::Full { command, es, data } }
    }

    /// Creates the response to commands 21 and 22.
    pub const fn abs17(ea: EncoderAddress, es: EncoderStatus, abs: U17) -> Self {
        Self { ea, body: Body::Abs17 { es_any: !es.is_empty(), abs } }
    }

    /// Decodes a response from its frames.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`], [`Error::Crc`], [`Error::SyncCode`], [`Error::FixedBit`],
    /// [`Error::AddressMismatch`], [`Error::CommandMismatch`], [`Error::BankError`], [`Error::EchoMismatch`].
    pub fn parse(expected: &Expected, raw: &RawResponse) -> Result<Self, Error> {
        let contents = raw.all_contents();
        if !raw.is_sound() || !expected.fits(raw) {
            return Err(expected.refusal(raw));
        }
        Self::of_contents(expected, contents)
    }

    /// Decodes the content bits after the checks that do not depend on their meaning. On a 32-bit core each field takes one or
    /// two shifts.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "fields are cut out of words")]
    fn of_contents(expected: &Expected, [p0, p1, p2]: Contents) -> Result<Self, Error> {
        let (ea, es) = (EncoderAddress::truncate((p0 >> 3) as u8), EncoderStatus::from_bits_truncate((p0 >> 12) as u8));
        let full = |data| Ok(Self::new(ea, expected.command(), es, data));
        // Data bits from 0, from 16, from 24, from 32, from 40 and from 56: the information field is before them. Each layout
        // computes those that it has.
        let low = || p0 >> 16 | p1 << 16;
        let (word, from_16, from_24, from_32) =
            (|| low() as u16, || p1 as u8, || p1 >> 8 | p2 << 24, || (p1 >> 16) as u8);
        let (from_40, from_56) = (|| p1 >> 24 | p2 << 8, || (p2 >> 8) as u16);
        let abs = || U24::truncate(low());
        let abs40 = || U40::truncate(u64::from(low()) | u64::from(from_32()) << 32);
        match expected.layout() {
            Layout::Abs17 => {
                Ok(Self { ea, body: Body::Abs17 { es_any: p0 >> 6 & 1 == 1, abs: U17::truncate(p0 >> 7) } })
            }
            Layout::Abs40 => full(Data::Abs40 { abs: abs40() }),
            Layout::Abs24 => full(Data::Abs24 { abs: abs() }),
            Layout::Abs24High => full(Data::Abs24High { abs: abs() }),
            Layout::Status => {
                full(Data::Status { alm: Alm::from_bits_retain(word()), pm_alm: PmAlm::from_bits_retain(from_16()) })
            }
            Layout::Eeprom => {
                expected.check_eeprom(word(), None, from_16())?;
                full(Data::Eeprom { data: word(), address: from_16() })
            }
            Layout::EepromBank => {
                let (bank, address, bank_error) = (from_16(), from_24() as u8, from_32() & 1 == 1);
                if bank_error {
                    return Err(Error::BankError);
                }
                expected.check_eeprom(word(), Some(bank), address)?;
                full(Data::EepromBank { data: word(), bank, address, bank_error })
            }
            Layout::Temperature => full(Data::Temperature { temperature: Temperature::from_eeprom(word()) }),
            Layout::Id => {
                let id = EncoderId::truncate(low());
                expected.check_id(id)?;
                full(Data::Id { id })
            }
            Layout::Coefficient => {
                let coefficient = U19::truncate(low());
                expected.check_coefficient(coefficient)?;
                full(Data::Coefficient { coefficient })
            }
            Layout::Abs24Status => full(Data::Abs24Status { abs: abs(), alm: Alm::from_bits_retain(from_24() as u16) }),
            Layout::Abs24Temp => {
                full(Data::Abs24Temp { abs: abs(), temperature: Temperature::from_eeprom(from_24() as u16) })
            }
            Layout::Abs24Vel => full(Data::Abs24Vel { abs: abs(), velocity: from_24() as i32 }),
            Layout::Abs24VelAcc => {
                full(Data::Abs24VelAcc { abs: abs(), velocity: from_24() as i32, acceleration: from_56() as i16 })
            }
            Layout::Abs40Vel => full(Data::Abs40Vel { abs: abs40(), velocity: from_40() as i32 }),
        }
    }

    /// Decodes a response from 16-bit words, each with the content bits of one frame; words after it are ignored.
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
        let sound = sound_words(expected.frames(), words, order);
        let Some(contents) = sound.and_then(|(contents, crc)| expected.fitting(contents, crc)) else {
            return Err(refusal(expected, RawResponse::from_words(expected.layout(), words, order)));
        };
        Self::of_contents(expected, contents)
    }

    /// Decodes the response at the start of a piece of line, its frames back to back; bits after it are ignored.
    ///
    /// Use [`Window::read`] to take the piece from any bit offset of a packed buffer.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`] and [`Error::Delimiter`] frame by frame, then as
    /// [`parse`](Self::parse).
    pub fn parse_line(expected: &Expected, line: Window) -> Result<Self, Error> {
        let sound = sound_line(expected.frames(), &line);
        let Some(contents) = sound.and_then(|(contents, crc)| expected.fitting(contents, crc)) else {
            return Err(refusal(expected, RawResponse::from_line(expected.layout(), line)));
        };
        Self::of_contents(expected, contents)
    }

    /// Returns the frames to send.
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

    /// Returns whether any status bit is set, in both forms.
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

    /// The whole position, if the response carries it.
    pub const fn abs40(self) -> Option<U40> {
        match self.data() {
            Some(Data::Abs40 { abs } | Data::Abs40Vel { abs, .. }) => Some(abs),
            _ => None,
        }
    }

    /// The position from bit 0 up, as many bits as the response carries: see [`Layout::abs_bits`].
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

    /// The alarms, if the response carries them.
    pub const fn alm(self) -> Option<Alm> {
        match self.data() {
            Some(Data::Status { alm, .. } | Data::Abs24Status { alm, .. }) => Some(alm),
            _ => None,
        }
    }

    /// The temperature, if the response carries it.
    pub const fn temperature(self) -> Option<Temperature> {
        match self.data() {
            Some(Data::Temperature { temperature } | Data::Abs24Temp { temperature, .. }) => Some(temperature),
            _ => None,
        }
    }

    /// The velocity, if the response carries it.
    pub const fn velocity(self) -> Option<i32> {
        match self.data() {
            Some(
                Data::Abs24Vel { velocity, .. } | Data::Abs24VelAcc { velocity, .. } | Data::Abs40Vel { velocity, .. },
            ) => Some(velocity),
            _ => None,
        }
    }
}

/// Returns why a response is refused; kept off the hot path.
#[cold]
#[inline(never)]
pub(crate) fn refusal(expected: &Expected, raw: Result<RawResponse, Error>) -> Error {
    match raw {
        Ok(raw) => expected.refusal(&raw),
        Err(error) => error,
    }
}

servowire_core::one_line!(Response {
    Self { ea, body: Body::Abs17 { es_any: true, abs } } => "from {}: ABS17 ES any ABS {:#07x}", ea, abs.get();
    Self { ea, body: Body::Abs17 { es_any: false, abs } } => "from {}: ABS17 ES - ABS {:#07x}", ea, abs.get();
    Self { ea, body: Body::Full { command, es, data } } => "from {}: {} ES {} {}", ea, command, es, data;
});
