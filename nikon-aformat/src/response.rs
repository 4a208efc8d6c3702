use nrz_line::{BitOrder, Window};

use crate::frame::MAX_FRAMES;
use crate::{
    Alm, Command, EncoderAddress, EncoderStatus, Error, Expected, Layout, PmAlm, Reply, Temperature, U17, U19, U24, U40,
};

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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Response {
    /// EA: who answers.
    pub ea: EncoderAddress,
    /// The rest.
    pub body: Body,
}

/// What stands behind the address of a reply.
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

/// The data of a reply, by its layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[allow(missing_docs, reason = "the fields that need words have them")]
pub enum Data {
    /// The whole position.
    Abs40 { abs: U40 },
    /// Position bits 0..=23.
    Abs24 { abs: U24 },
    /// Position bits 16..=39.
    Abs24High { abs: U24 },
    /// Alarms.
    Status { alm: Alm, pm_alm: PmAlm },
    /// An EEPROM word and its address. Says nothing while ES0 is set.
    Eeprom { data: u16, address: u8 },
    /// An EEPROM word of a bank. With `bank_error` the encoder has no such bank.
    EepromBank { data: u16, bank: u8, address: u8, bank_error: bool },
    /// Temperature.
    Temperature { temperature: Temperature },
    /// Identification code.
    Id { id: U24 },
    /// Velocity coefficient; its unit and use are not documented.
    Coefficient { coefficient: U19 },
    /// Position bits 0..=23 and alarms.
    Abs24Status { abs: U24, alm: Alm },
    /// Position bits 0..=23 and temperature.
    Abs24Temp { abs: U24, temperature: Temperature },
    /// Position bits 0..=23 and velocity, two's complement; its unit is not documented.
    Abs24Vel { abs: U24, velocity: i32 },
    /// Position bits 0..=23, velocity and acceleration, two's complement; their units are not documented.
    Abs24VelAcc { abs: U24, velocity: i32, acceleration: i16 },
    /// The whole position and velocity.
    Abs40Vel { abs: U40, velocity: i32 },
}

impl Data {
    /// The layout that carries this data.
    pub const fn layout(self) -> Layout {
        match self {
            Self::Abs40 { .. } => Layout::Abs40,
            Self::Abs24 { .. } => Layout::Abs24,
            Self::Abs24High { .. } => Layout::Abs24High,
            Self::Status { .. } => Layout::Status,
            Self::Eeprom { .. } => Layout::Eeprom,
            Self::EepromBank { .. } => Layout::EepromBank,
            Self::Temperature { .. } => Layout::Temperature,
            Self::Id { .. } => Layout::Id,
            Self::Coefficient { .. } => Layout::Coefficient,
            Self::Abs24Status { .. } => Layout::Abs24Status,
            Self::Abs24Temp { .. } => Layout::Abs24Temp,
            Self::Abs24Vel { .. } => Layout::Abs24Vel,
            Self::Abs24VelAcc { .. } => Layout::Abs24VelAcc,
            Self::Abs40Vel { .. } => Layout::Abs40Vel,
        }
    }

    /// The data bits of a layout, the first of the line in bit 0; `None` for [`Layout::Abs17`].
    #[expect(clippy::cast_possible_truncation, reason = "each shift brings a field to the low bits")]
    #[expect(clippy::cast_possible_wrap, reason = "two's complement on the line")]
    const fn from_bits(layout: Layout, bits: u128) -> Option<Self> {
        let low = bits as u64;
        let abs = U24::truncate(low as u32);
        let velocity = (low >> 24) as u32 as i32;
        Some(match layout {
            Layout::Abs17 => return None,
            Layout::Abs40 => Self::Abs40 { abs: U40::truncate(low) },
            Layout::Abs24 => Self::Abs24 { abs },
            Layout::Abs24High => Self::Abs24High { abs },
            Layout::Status => Self::Status { alm: Alm::new(low as u16), pm_alm: PmAlm::new((low >> 16) as u8) },
            Layout::Eeprom => Self::Eeprom { data: low as u16, address: (low >> 16) as u8 },
            Layout::EepromBank => Self::EepromBank {
                data: low as u16,
                bank: (low >> 16) as u8,
                address: (low >> 24) as u8,
                bank_error: low >> 32 & 1 == 1,
            },
            Layout::Temperature => Self::Temperature { temperature: Temperature::from_eeprom(low as u16) },
            Layout::Id => Self::Id { id: abs },
            Layout::Coefficient => Self::Coefficient { coefficient: U19::truncate(low as u32) },
            Layout::Abs24Status => Self::Abs24Status { abs, alm: Alm::new((low >> 24) as u16) },
            Layout::Abs24Temp => Self::Abs24Temp { abs, temperature: Temperature::from_eeprom((low >> 24) as u16) },
            Layout::Abs24Vel => Self::Abs24Vel { abs, velocity },
            Layout::Abs24VelAcc => Self::Abs24VelAcc { abs, velocity, acceleration: (bits >> 56) as u16 as i16 },
            Layout::Abs40Vel => Self::Abs40Vel { abs: U40::truncate(low), velocity: (bits >> 40) as u32 as i32 },
        })
    }

    /// The data bits, the first of the line in bit 0; unused ones are 0.
    #[expect(clippy::cast_sign_loss, reason = "two's complement on the line")]
    const fn bits(self) -> u128 {
        match self {
            Self::Abs40 { abs } => abs.get() as u128,
            Self::Abs24 { abs } | Self::Abs24High { abs } | Self::Id { id: abs } => abs.get() as u128,
            Self::Status { alm, pm_alm } => alm.raw() as u128 | (pm_alm.raw() as u128) << 16,
            Self::Eeprom { data, address } => data as u128 | (address as u128) << 16,
            Self::EepromBank { data, bank, address, bank_error } => {
                data as u128 | (bank as u128) << 16 | (address as u128) << 24 | (bank_error as u128) << 32
            }
            Self::Temperature { temperature } => temperature.raw() as u128,
            Self::Coefficient { coefficient } => coefficient.get() as u128,
            Self::Abs24Status { abs, alm } => abs.get() as u128 | (alm.raw() as u128) << 24,
            Self::Abs24Temp { abs, temperature } => abs.get() as u128 | (temperature.raw() as u128) << 24,
            Self::Abs24Vel { abs, velocity } => abs.get() as u128 | (velocity as u32 as u128) << 24,
            Self::Abs24VelAcc { abs, velocity, acceleration } => {
                abs.get() as u128 | (velocity as u32 as u128) << 24 | (acceleration as u16 as u128) << 56
            }
            Self::Abs40Vel { abs, velocity } => abs.get() as u128 | (velocity as u32 as u128) << 40,
        }
    }
}

impl Response {
    /// Value of the sync code that begins a reply.
    pub const SYNC_CODE: u8 = 4;

    /// A reply with full information field.
    pub const fn new(ea: EncoderAddress, command: Command, es: EncoderStatus, data: Data) -> Self {
        Self { ea, body: Body::Full { command, es, data } }
    }

    /// The reply to commands 21 and 22.
    pub const fn abs17(ea: EncoderAddress, es: EncoderStatus, abs: U17) -> Self {
        Self { ea, body: Body::Abs17 { es_any: es.any(), abs } }
    }

    /// Decodes a reply whose frames are at hand.
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`], [`Error::Crc`], [`Error::SyncCode`], [`Error::FixedBit`],
    /// [`Error::AddressMismatch`], [`Error::CommandMismatch`], [`Error::BankError`], [`Error::EchoMismatch`].
    pub fn parse(reply: &Reply, expected: &Expected) -> Result<Self, Error> {
        if !reply.is_sound() || !expected.fits(reply) {
            return Err(expected.refusal(reply));
        }
        let payload = reply.payload();
        let ea = EncoderAddress::truncate(nibbles(payload >> 3));
        let body = match Data::from_bits(expected.layout(), payload >> 16) {
            Some(data) => {
                expected.check_memory(data)?;
                Body::Full { command: expected.command(), es: EncoderStatus::new(nibbles(payload >> 12)), data }
            }
            None => Body::Abs17 { es_any: payload >> 6 & 1 == 1, abs: abs17(payload) },
        };
        Ok(Self { ea, body })
    }

    /// Decodes a reply from 16-bit words, the content bits of one frame each; words behind it are left alone.
    ///
    /// ```
    /// use nikon_aformat::{BitOrder, Command, Expected, Layout, Response};
    /// // the reply that the manual of a vendor's driver shows: encoder 0, command 4, 17 + 16 bits
    /// let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
    /// let reply = Response::parse_words(&[0x2085, 0xf64a, 0x8009, 0x80a1], BitOrder::MsbFirst, &expected)?;
    /// let abs = reply.abs40().map_or(0, |abs| abs.get());
    /// assert_eq!((abs & 0x1_ffff, abs >> 17), (86_639, 51_200));
    /// # Ok::<(), nikon_aformat::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_words(words: &[u16], order: BitOrder, expected: &Expected) -> Result<Self, Error> {
        Self::parse(&Reply::from_words(words, order, expected.layout())?, expected)
    }

    /// Decodes the reply at the beginning of a piece of line, its frames back to back; bits behind it are left alone.
    ///
    /// Take the piece out of a packed buffer at any bit offset with [`Window::read`].
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::StartBit`] and [`Error::Delimiter`] frame by frame, then as
    /// [`parse`](Self::parse).
    pub fn parse_line(line: Window, expected: &Expected) -> Result<Self, Error> {
        Self::parse(&Reply::from_line(line, expected.layout())?, expected)
    }

    /// The frames to send.
    #[expect(clippy::cast_possible_truncation, reason = "each shift brings a frame to the low bits")]
    pub fn emit(self) -> Reply {
        let head = u128::from(Self::SYNC_CODE) | u128::from(self.ea.get()) << 3;
        let (payload, layout) = match self.body {
            Body::Abs17 { es_any, abs } => (head | u128::from(es_any) << 6 | u128::from(abs.get()) << 7, Layout::Abs17),
            Body::Full { command, es, data } => {
                let head = head | u128::from(command.code()) << 6 | u128::from(es.raw()) << 12;
                (head | data.bits() << 16, data.layout())
            }
        };
        let mut contents = [0; MAX_FRAMES as usize];
        for (content, at) in contents.iter_mut().zip((0_u32..).step_by(16)) {
            *content = payload.wrapping_shr(at) as u16;
        }
        Reply::of(contents, layout).sealed()
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
            Body::Full { es, .. } => es.any(),
        }
    }

    /// The data; `None` in the short form.
    pub const fn data(self) -> Option<Data> {
        match self.body {
            Body::Abs17 { .. } => None,
            Body::Full { data, .. } => Some(data),
        }
    }

    /// The whole position, where the reply carries it.
    pub const fn abs40(self) -> Option<U40> {
        match self.data() {
            Some(Data::Abs40 { abs } | Data::Abs40Vel { abs, .. }) => Some(abs),
            _ => None,
        }
    }

    /// The position from bit 0 up, as far as the reply carries it: see [`Layout::abs_bits`].
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

    /// The alarms, where the reply carries them.
    pub const fn alm(self) -> Option<Alm> {
        match self.data() {
            Some(Data::Status { alm, .. } | Data::Abs24Status { alm, .. }) => Some(alm),
            _ => None,
        }
    }

    /// The temperature, where the reply carries it.
    pub const fn temperature(self) -> Option<Temperature> {
        match self.data() {
            Some(Data::Temperature { temperature } | Data::Abs24Temp { temperature, .. }) => Some(temperature),
            _ => None,
        }
    }

    /// The velocity, where the reply carries it.
    pub const fn velocity(self) -> Option<i32> {
        match self.data() {
            Some(
                Data::Abs24Vel { velocity, .. } | Data::Abs24VelAcc { velocity, .. } | Data::Abs40Vel { velocity, .. },
            ) => Some(velocity),
            _ => None,
        }
    }
}

/// The low bits of a shifted payload, for fields of up to eight bits.
#[expect(clippy::cast_possible_truncation, reason = "the caller cuts its field off")]
const fn nibbles(payload: u128) -> u8 {
    payload as u8
}

#[expect(clippy::cast_possible_truncation, reason = "17 bits")]
const fn abs17(payload: u128) -> U17 {
    U17::truncate((payload >> 7) as u32)
}
