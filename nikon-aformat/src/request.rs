use nrz_line::{BitOrder, OutOfBounds, Window};

use crate::command::{Command, Version};
use crate::error::Error;
use crate::expected::{Echo, Expected};
use crate::frame::truncated;
use crate::frame::{FrameCode, RequestFrame};
use crate::layout::FRAME_BITS;
use crate::layout::Layout;
use crate::number::{EncoderAddress, EncoderId, U19, UserAddress};
use crate::operation::Operation;
use crate::resolution::Resolution;
use crate::units::Units;

#[cfg(test)]
pub(crate) mod tests;

/// A master's request to one encoder or, with a multi-response command, to several.
///
/// ```text
///  all others                      CDF
///  EepromRead                      CDF  MDF2 address
///  EepromWrite                     CDF  MDF0 data low  MDF1 data high  MDF2 address
///  IdWrite1, IdWrite2, SetAddress2 CDF  MDF0 id 0..=7  MDF1 id 8..=15  MDF2 id 16..=23
///  EepromReadBank                  CDF, frame code 3   MDF3 bank       MDF2 address              version 3.0
///  EepromWriteBank                 CDF, frame code 3   MDF0 data low   MDF1 data high  MDF3 bank  MDF2 address
///  CoefficientRead                 CDF, frame code 3
///  CoefficientWrite                CDF, frame code 3   MDF0 0..=7      MDF1 8..=15     MDF2 16..=18
/// ```
///
/// In a multi-response request EA is best read as the highest address that is asked to answer; no document says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Request {
    /// EA: the encoder; for [`Operation::SetAddress1`] and [`Operation::SetAddress2`] its new address.
    pub ea: EncoderAddress,
    /// What the encoder is to do.
    pub operation: Operation,
}

impl Request {
    /// Creates a request for `operation` to the encoder `ea`.
    pub const fn new(ea: EncoderAddress, operation: Operation) -> Self {
        Self { ea, operation }
    }

    /// The command.
    pub const fn command(self) -> Command {
        self.operation.command()
    }

    /// Returns the frames to send.
    ///
    /// ```
    /// use nikon_aformat::{BitOrder, EncoderAddress, Operation, Request};
    /// let request = Request::new(EncoderAddress::ZERO, Operation::EepromRead { address: 0xf6 });
    /// let frames = request.emit();
    /// let words = frames.as_slice().iter().map(|frame| frame.word(BitOrder::MsbFirst));
    /// assert!(words.eq([0x40b0, 0x5b78]));
    /// ```
    pub const fn emit(self) -> Frames {
        let cdf = RequestFrame::cdf(self.operation.frame_code(), self.ea, self.command().code());
        match self.operation {
            Operation::EepromRead { address } => Frames::of([cdf, mdf2(address), cdf, cdf, cdf], 2),
            Operation::EepromWrite { address, data } => {
                let [low, high] = data.to_le_bytes();
                Frames::of([cdf, mdf0(low), mdf1(high), mdf2(address.get()), cdf], 4)
            }
            Operation::EepromReadBank { bank, address } => Frames::of([cdf, mdf3(bank), mdf2(address), cdf, cdf], 3),
            Operation::EepromWriteBank { bank, address, data } => {
                let [low, high] = data.to_le_bytes();
                Frames::of([cdf, mdf0(low), mdf1(high), mdf3(bank), mdf2(address)], 5)
            }
            Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id } => {
                Frames::of_three_bytes(cdf, id.get())
            }
            Operation::CoefficientWrite { coefficient } => Frames::of_three_bytes(cdf, coefficient.get()),
            _ => Frames::of([cdf; 5], 1),
        }
    }

    /// Returns the number of frames in a request that begins with this command data frame.
    ///
    /// # Errors
    /// [`Error::FrameCode`] for a frame code with which no request for this command begins, [`Error::UnknownCommand`].
    pub fn expected_frames(cdf: RequestFrame) -> Result<u8, Error> {
        let command = Command::from_code(cdf.code());
        match (cdf.frame_code(), command) {
            (FrameCode::Fc0, Some(Command::EepromRead)) => Ok(2),
            (FrameCode::Fc0, Some(Command::EepromWrite | Command::IdWrite2 | Command::SetAddress2))
            | (FrameCode::Fc0 | FrameCode::Fc3, Some(Command::IdWrite1)) => Ok(4),
            (FrameCode::Fc3, Some(Command::EepromRead)) => Ok(3),
            (FrameCode::Fc3, Some(Command::EepromWrite)) => Ok(5),
            (FrameCode::Fc0, Some(_)) | (FrameCode::Fc3, Some(Command::IdRead1)) => Ok(1),
            (FrameCode::Fc0, None) => Err(Error::UnknownCommand { code: cdf.code() }),
            (got, _) => Err(Error::FrameCode { frame: 0, got: got.code(), want: 0 }),
        }
    }

    /// Decodes received frames, as an encoder does. Frames after the request are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::FrameCode`], [`Error::UnknownCommand`]; [`Error::AddressRange`] for a write to
    /// the maker's addresses, [`Error::DataRange`] for a coefficient above 19 bits.
    pub fn parse(frames: &[RequestFrame]) -> Result<Self, Error> {
        let Some(cdf) = frames.first() else { return Err(truncated(0, FRAME_BITS)) };
        let (ea, want) = (cdf.ea(), Self::expected_frames(*cdf)?);
        let command = Command::from_code(cdf.code()).ok_or(Error::UnknownCommand { code: cdf.code() })?;
        let Some(memory) = frames.get(1..usize::from(want)) else {
            let got = u32::try_from(frames.len()).unwrap_or(u32::MAX);
            return Err(truncated(got.saturating_mul(FRAME_BITS), u32::from(want).wrapping_mul(FRAME_BITS)));
        };
        let bank = cdf.frame_code() == FrameCode::Fc3;
        check_order(memory)?;
        let byte = |at| memory.get(at).copied().map_or(0, RequestFrame::byte);
        let data = u16::from_le_bytes([byte(0), byte(1)]);
        let three = u32::from_le_bytes([byte(0), byte(1), byte(2), 0]);
        let operation = match (command, bank) {
            (Command::EepromRead, false) => Operation::EepromRead { address: byte(0) },
            (Command::EepromRead, true) => Operation::EepromReadBank { bank: byte(0), address: byte(1) },
            (Command::EepromWrite, false) => {
                let got = u32::from(byte(2));
                Operation::EepromWrite { address: UserAddress::new(byte(2)).ok_or(Error::AddressRange { got })?, data }
            }
            (Command::EepromWrite, true) => Operation::EepromWriteBank { bank: byte(2), address: byte(3), data },
            (Command::IdWrite1, false) => Operation::IdWrite1 { id: EncoderId::truncate(three) },
            (Command::IdWrite1, true) => {
                Operation::CoefficientWrite { coefficient: U19::new(three).ok_or(Error::DataRange { got: three })? }
            }
            (Command::IdWrite2, _) => Operation::IdWrite2 { id: EncoderId::truncate(three) },
            (Command::SetAddress2, _) => Operation::SetAddress2 { id: EncoderId::truncate(three) },
            (Command::IdRead1, true) => Operation::CoefficientRead,
            (other, _) => Operation::without_arguments(other).ok_or(Error::UnknownCommand { code: other.code() })?,
        };
        Ok(Self { ea, operation })
    }

    /// Returns the layout of the response from an encoder of this resolution.
    ///
    /// The same request can have different responses: version 3.0 encoders may be set in the factory to answer commands 1
    /// and 5 with [`Layout::Abs40Vel`], and the resets with [`Layout::Abs24`]. The line does not say which.
    pub const fn layout(self, resolution: Resolution) -> Layout {
        match self.operation {
            Operation::Abs40 | Operation::Abs40Mt => Layout::Abs40,
            Operation::Abs24Low | Operation::Abs24LowMt => {
                if resolution.has_velocity_in_low() {
                    Layout::Abs40Vel
                } else {
                    Layout::Abs24
                }
            }
            Operation::Abs24High | Operation::Abs24HighMt => Layout::Abs24High,
            Operation::Status | Operation::StatusMt => Layout::Status,
            Operation::ClearStatus
            | Operation::ClearMultiturn
            | Operation::ClearStatusMultiturn
            | Operation::SetAddress1
            | Operation::ZeroPreset => {
                if resolution.has_position_in_resets() {
                    Layout::Abs24
                } else {
                    Layout::Status
                }
            }
            Operation::EepromRead { .. } | Operation::EepromWrite { .. } => Layout::Eeprom,
            Operation::EepromReadBank { .. } | Operation::EepromWriteBank { .. } => Layout::EepromBank,
            Operation::Temperature => Layout::Temperature,
            Operation::IdRead1
            | Operation::IdRead2
            | Operation::IdWrite1 { .. }
            | Operation::IdWrite2 { .. }
            | Operation::SetAddress2 { .. } => Layout::Id,
            Operation::CoefficientRead | Operation::CoefficientWrite { .. } => Layout::Coefficient,
            Operation::Abs17 | Operation::Abs17Mt => Layout::Abs17,
            Operation::Abs24Vel | Operation::Abs24VelMt => Layout::Abs24Vel,
            Operation::Abs24VelAcc | Operation::Abs24VelAccMt => Layout::Abs24VelAcc,
            Operation::Abs24Status | Operation::Abs24StatusMt => Layout::Abs24Status,
            Operation::Abs24Temp | Operation::Abs24TempMt => Layout::Abs24Temp,
        }
    }

    /// Returns what the response of an encoder of this resolution has to be.
    ///
    /// The address is checked if [`Command::answers_with_own_address`] says so.
    pub const fn expected(self, resolution: Resolution) -> Expected {
        let command = self.command();
        let expected = Expected::new(self.layout(resolution), command).echoing(Echo::of(self.operation));
        if command.answers_with_own_address() { expected.from_address(self.ea) } else { expected }
    }

    /// Returns the request itself, if encoders of this resolution understand it.
    ///
    /// # Errors
    /// [`Error::UnsupportedInVersion`].
    pub fn check(self, resolution: Resolution) -> Result<Self, Error> {
        let (command, version) = (self.command(), resolution.version());
        if version < Version::V3_0 && self.operation.needs_version_3() {
            return Err(Error::UnsupportedInVersion { command, version });
        }
        Ok(self)
    }
}

const fn mdf0(byte: u8) -> RequestFrame {
    RequestFrame::mdf(FrameCode::Fc1, byte)
}

const fn mdf1(byte: u8) -> RequestFrame {
    RequestFrame::mdf(FrameCode::Fc2, byte)
}

const fn mdf2(byte: u8) -> RequestFrame {
    RequestFrame::mdf(FrameCode::Fc3, byte)
}

const fn mdf3(byte: u8) -> RequestFrame {
    RequestFrame::mdf(FrameCode::Fc0, byte)
}

/// Checks that memory frames come in the order of a request: MDF0, MDF1, MDF3, MDF2, leaving out those that it does not have.
fn check_order(memory: &[RequestFrame]) -> Result<(), Error> {
    let order: &[FrameCode] = match memory.len() {
        1 => &[FrameCode::Fc3],
        2 => &[FrameCode::Fc0, FrameCode::Fc3],
        3 => &[FrameCode::Fc1, FrameCode::Fc2, FrameCode::Fc3],
        _ => &[FrameCode::Fc1, FrameCode::Fc2, FrameCode::Fc0, FrameCode::Fc3],
    };
    for (frame, (got, want)) in (1..).zip(memory.iter().zip(order)) {
        if got.frame_code() != *want {
            return Err(Error::FrameCode { frame, got: got.frame_code().code(), want: want.code() });
        }
    }
    Ok(())
}

/// The frames of one request, 1 to 5, in the order of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frames {
    frames: [RequestFrame; 5],
    len: u8,
}

impl Frames {
    /// Maximum number of frames of a request.
    pub const MAX: usize = 5;

    const fn of(frames: [RequestFrame; 5], len: u8) -> Self {
        Self { frames, len }
    }

    const fn of_three_bytes(cdf: RequestFrame, value: u32) -> Self {
        let [low, middle, high, _] = value.to_le_bytes();
        Self::of([cdf, mdf0(low), mdf1(middle), mdf2(high), cdf], 4)
    }

    /// The frames.
    pub fn as_slice(&self) -> &[RequestFrame] {
        self.frames.get(..usize::from(self.len)).unwrap_or(&self.frames)
    }

    /// The frames as a receiver delivers them.
    pub fn units(&self) -> Units {
        self.as_slice().iter().map(|frame| Some(frame.content())).collect()
    }

    /// Number of line bits from the first start bit to the last delimiter, with `gap_bits` idle bits between frames.
    pub const fn line_bits(self, gap_bits: u32) -> u32 {
        let gaps = (self.len as u32).saturating_sub(1);
        (self.len as u32).wrapping_mul(FRAME_BITS).saturating_add(gaps.saturating_mul(gap_bits))
    }

    /// Overwrites the bits of `bytes` that begin at bit `offset` with the line bits, with `gap_bits` idle bits between frames
    /// (see [`BitRate::bits`](crate::timing::BitRate::bits)); returns the number of bits.
    ///
    /// ```
    /// use nikon_aformat::{BitOrder, BitRate, EncoderAddress, FRAME_GAP_NS, Operation, Request};
    /// let request = Request::new(EncoderAddress::ZERO, Operation::EepromRead { address: 0xf6 });
    /// let gap = BitRate::Mbit2_5.bits(FRAME_GAP_NS);
    /// let mut line = [0xff; 6];
    /// let bits = request.emit().write_line(&mut line, 0, gap, BitOrder::MsbFirst)?;
    /// assert_eq!((gap, bits), (3, 39));
    /// assert_eq!(line, [0x20, 0x58, 0x79, 0x6d, 0xe3, 0xff]);
    /// # Ok::<(), nrz_line::OutOfBounds>(())
    /// ```
    ///
    /// # Errors
    /// [`OutOfBounds`] if `bytes` ends earlier; nothing is written then.
    pub fn write_line(
        self,
        bytes: &mut [u8],
        offset: usize,
        gap_bits: u32,
        order: BitOrder,
    ) -> Result<u32, OutOfBounds> {
        let len = self.line_bits(gap_bits);
        let available = bytes.len().saturating_mul(8).saturating_sub(offset);
        if len as usize > available {
            return Err(OutOfBounds { offset, len, available });
        }
        let mut at = offset;
        for (k, frame) in self.as_slice().iter().enumerate() {
            let mut idle = if k == 0 { 0 } else { gap_bits };
            while idle > 0 {
                let run = idle.min(Window::MAX_LEN);
                Window::from_bits(u128::MAX, run).unwrap_or(Window::EMPTY).write(bytes, at, order)?;
                at = at.saturating_add(run as usize);
                idle = idle.saturating_sub(run);
            }
            frame.line().write(bytes, at, order)?;
            at = at.saturating_add(FRAME_BITS as usize);
        }
        Ok(len)
    }
}

servowire_core::one_line!(Request { Self { ea, operation } => "to {}: {}", ea, operation; });

// As vendor documents print them, the first bit of the line in bit 15.
servowire_core::listed!(Frames { |frames| frames.as_slice().iter().map(|frame| frame.word(BitOrder::MsbFirst)) => "{:04X}" });
