use crate::address::DeviceAddress;
use crate::crc::crc8_step;
use crate::crc::crc8_update;
use crate::discovery::room;
use crate::error::Error;
use crate::frame::{count, wrong_length};
use crate::hex::Hex;
use crate::status::Status;

/// Number of output bytes of the published master: four devices with four bytes each.
pub(crate) const STOCK_OUTPUT: usize = 16;
/// Payload of a device frame: the DRV8711 STATUS byte and two reserved bytes.
pub(crate) const STOCK_INPUT: usize = 3;

/// The master frame of the IO exchange in a buffer, from SA to the time stamp.
///
/// ```text
///  byte 0   1       2 ............ 2+S    3+S
///       SA  STATUS  S output bytes CRC-8  time stamp
///       0   0x30                   of all u16: low half of the master's
///                                  before time at the start of this frame
/// ```
///
/// Device `a` owns the bytes `2 + offset ..`, as assigned by DISCOVERY. The time stamp is inserted while the frame is being
/// sent, and no check covers it: see [`check_time_stamp`](Self::check_time_stamp).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MasterFrameView<'a> {
    status: Status,
    output: &'a [u8],
    time_stamp: u16,
}

impl<'a> MasterFrameView<'a> {
    /// Number of bytes in addition to the output bytes.
    pub const OVERHEAD: usize = 5;

    /// Checks, in this order: length (too short, too long), CRC-8, SA. The bytes must be exactly one frame.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::BadCrc8`], [`Error::WrongSource`]
    #[inline]
    pub fn parse(output_len: usize, bytes: &'a [u8]) -> Result<Self, Error> {
        let want = output_len.saturating_add(Self::OVERHEAD);
        if bytes.len() != want {
            return Err(wrong_length(bytes.len(), want));
        }
        let &[source, status, ref output @ .., crc, t0, t1] = bytes else {
            return Err(wrong_length(bytes.len(), want));
        };
        check(source, status, output, crc)?;
        if source != 0 {
            return Err(Error::WrongSource { got: source });
        }
        Ok(Self { status: Status::from_bits_retain(status), output, time_stamp: u16::from_le_bytes([t0, t1]) })
    }

    /// STATUS; 0x30 in everything that the published master sends.
    pub const fn status(self) -> Status {
        self.status
    }

    /// Returns all output bytes.
    pub const fn output(self) -> &'a [u8] {
        self.output
    }

    /// Returns the output bytes of one device.
    ///
    /// # Errors
    /// [`Error::OutsideOutput`]
    pub fn slice(self, offset: u16, len: u16) -> Result<&'a [u8], Error> {
        let start = usize::from(offset);
        let end = start.saturating_add(usize::from(len));
        self.output.get(start..end).ok_or(Error::OutsideOutput { offset, len })
    }

    /// Low 16 bits of the master's time in ns at the start of this frame.
    pub const fn time_stamp(self) -> u16 {
        self.time_stamp
    }

    /// Returns the master's time at the start of the frame as seen by a device at a distance of `delay_ns`.
    pub const fn reference_ns(self, delay_ns: u32) -> u32 {
        (self.time_stamp as u32).saturating_add(delay_ns)
    }

    /// Returns whether the time stamp is at most `window_ns` from `expected` (both wrap): the only check it can have.
    ///
    /// # Errors
    /// [`Error::ImplausibleTimeStamp`]
    pub const fn check_time_stamp(self, expected: u16, window_ns: u16) -> Result<(), Error> {
        let ahead = self.time_stamp.wrapping_sub(expected);
        let distance = if ahead < 0x8000 { ahead } else { ahead.wrapping_neg() };
        if distance <= window_ns {
            return Ok(());
        }
        Err(Error::ImplausibleTimeStamp { got: self.time_stamp, want: expected })
    }
}

/// Writes a master frame and returns its length, `output.len() + 5`.
///
/// # Errors
/// [`Error::BufferTooSmall`]
#[inline]
pub fn emit_master_frame_into(output: &[u8], time_stamp: u16, into: &mut [u8]) -> Result<usize, Error> {
    write(Status::EXCHANGE, output, time_stamp, into)
}

#[inline]
pub(crate) fn write(status: Status, output: &[u8], time_stamp: u16, into: &mut [u8]) -> Result<usize, Error> {
    let want = output.len().saturating_add(MasterFrameView::OVERHEAD);
    if let Some((body, stamp)) = room(into, want)?.split_last_chunk_mut() {
        seal(body, 0, status, output);
        *stamp = time_stamp.to_le_bytes();
    }
    Ok(want)
}

/// The values of a master frame with `S` output bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MasterFrame<const S: usize = STOCK_OUTPUT> {
    /// STATUS.
    pub status: Status,
    /// The output bytes of all devices.
    pub output: [u8; S],
    /// Low 16 bits of the master's time in ns at the start of this frame.
    pub time_stamp: u16,
}

impl<const S: usize> MasterFrame<S> {
    /// Number of bytes from SA to the time stamp.
    pub const LEN: usize = S.saturating_add(MasterFrameView::OVERHEAD);

    const fn view(&self) -> MasterFrameView<'_> {
        MasterFrameView { status: self.status, output: &self.output, time_stamp: self.time_stamp }
    }

    /// Checks as [`MasterFrameView::parse`].
    ///
    /// # Errors
    /// As [`MasterFrameView::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let view = MasterFrameView::parse(S, bytes)?;
        let want = count(Self::LEN);
        let output = view.output().first_chunk().ok_or(Error::Truncated { got: count(bytes.len()), want })?;
        Ok(Self { status: view.status(), output: *output, time_stamp: view.time_stamp() })
    }

    /// Writes the frame from SA to the time stamp and returns its length.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]
    pub fn emit_into(&self, into: &mut [u8]) -> Result<usize, Error> {
        write(self.status, &self.output, self.time_stamp, into)
    }
}

/// The device frame of the IO exchange in a buffer, from SA to the CRC.
///
/// ```text
///  byte 0        1                2 ...... 2+p
///       address  LAST | ERROR     payload  CRC-8 of all before
///       1..=254                   p bytes
/// ```
///
/// The published firmware contradicts itself here: its comment and its send times describe this frame with p = 3,
/// its code sends a different one, see [`PublishedDeviceFrame`]. This crate uses the designed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct DeviceFrameView<'a> {
    address: DeviceAddress,
    status: Status,
    payload: &'a [u8],
}

impl<'a> DeviceFrameView<'a> {
    /// Number of bytes in addition to the payload.
    pub const OVERHEAD: usize = 3;

    /// Checks, in this order: length (too short, too long), CRC-8, SA. The bytes must be exactly one frame.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::BadCrc8`], [`Error::WrongSource`]
    #[inline]
    pub fn parse(payload_len: usize, bytes: &'a [u8]) -> Result<Self, Error> {
        let want = payload_len.saturating_add(Self::OVERHEAD);
        if bytes.len() != want {
            return Err(wrong_length(bytes.len(), want));
        }
        let &[source, status, ref payload @ .., crc] = bytes else {
            return Err(wrong_length(bytes.len(), want));
        };
        check(source, status, payload, crc)?;
        let address = DeviceAddress::new(source).ok_or(Error::WrongSource { got: source })?;
        Ok(Self { address, status: Status::from_bits_retain(status), payload })
    }

    /// Who sent it.
    pub const fn address(self) -> DeviceAddress {
        self.address
    }

    /// STATUS: LAST and ERROR.
    pub const fn status(self) -> Status {
        self.status
    }

    /// The payload; byte 0 is the low byte of the DRV8711 STATUS register in the CNC application.
    pub const fn payload(self) -> &'a [u8] {
        self.payload
    }
}

/// The values of a device frame with `P` payload bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DeviceFrame<const P: usize = STOCK_INPUT> {
    /// Address of the sender.
    pub address: DeviceAddress,
    /// STATUS: LAST and ERROR.
    pub status: Status,
    /// The payload.
    pub payload: [u8; P],
}

impl<const P: usize> DeviceFrame<P> {
    /// Number of bytes from SA to the CRC.
    pub const LEN: usize = P.saturating_add(DeviceFrameView::OVERHEAD);

    const fn view(&self) -> DeviceFrameView<'_> {
        DeviceFrameView { address: self.address, status: self.status, payload: &self.payload }
    }

    /// Checks as [`DeviceFrameView::parse`].
    ///
    /// # Errors
    /// As [`DeviceFrameView::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let view = DeviceFrameView::parse(P, bytes)?;
        let want = count(Self::LEN);
        let payload = view.payload().first_chunk().ok_or(Error::Truncated { got: count(bytes.len()), want })?;
        Ok(Self { address: view.address(), status: view.status(), payload: *payload })
    }

    /// Writes the frame from SA to the CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]
    pub fn emit_into(&self, into: &mut [u8]) -> Result<usize, Error> {
        let frame = room(into, Self::LEN)?;
        seal(frame, self.address.get(), self.status, &self.payload);
        Ok(Self::LEN)
    }
}

/// The device frame as the published image builds it: two payload bytes and a CRC byte that covers registers which
/// were never set, so nothing can be checked. The call to that routine is commented out, so the published firmware never sends
/// such a frame.
///
/// ```text
///  byte 0        1             2               3  4
///       address  LAST | ERROR  DRV8711 STATUS  0  unusable
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PublishedDeviceFrame {
    /// Address of the sender.
    pub address: DeviceAddress,
    /// STATUS: LAST and ERROR.
    pub status: Status,
    /// Low byte of the DRV8711 STATUS register.
    pub drv8711_status: u8,
}

impl PublishedDeviceFrame {
    /// Number of bytes from SA to the CRC byte.
    pub const LEN: usize = 5;

    /// Checks length and SA; nothing covers the contents.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::WrongSource`]
    pub fn parse_unchecked(bytes: &[u8]) -> Result<Self, Error> {
        let &[source, status, drv8711_status, _, _] = bytes else {
            return Err(wrong_length(bytes.len(), Self::LEN));
        };
        let address = DeviceAddress::new(source).ok_or(Error::WrongSource { got: source })?;
        Ok(Self { address, status: Status::from_bits_retain(status), drv8711_status })
    }

    /// The bytes before the unusable CRC byte.
    pub const fn emit_without_crc(&self) -> [u8; 4] {
        [self.address.get(), self.status.bits(), self.drv8711_status, 0]
    }
}

#[inline]
fn check(source: u8, status: u8, data: &[u8], got: u8) -> Result<(), Error> {
    let want = crc8_update(crc8_step(crc8_step(0, source), status), data);
    if got == want { Ok(()) } else { Err(Error::BadCrc8 { got, want }) }
}

/// Fills `SA, STATUS, data, CRC-8`.
#[inline]
fn seal(frame: &mut [u8], source: u8, status: Status, data: &[u8]) {
    if let [sa, flags, rest @ .., crc] = frame {
        (*sa, *flags) = (source, status.bits());
        let mut check = crc8_step(crc8_step(0, source), status.bits());
        for (to, from) in rest.iter_mut().zip(data) {
            *to = *from;
            check = crc8_step(check, *from);
        }
        *crc = check;
    }
}

servowire_core::one_line!(MasterFrameView<'_> {
    Self { status, output, time_stamp } => "master, {} output bytes at {}, STATUS {}", output.len(), time_stamp, status;
});
servowire_core::one_line!(DeviceFrameView<'_> {
    Self { address, status, payload } => "device {}, {}, STATUS {}", address, Hex(payload), status;
});
servowire_core::one_line!(PublishedDeviceFrame {
    Self { address, status, drv8711_status } => "device {}, DRV8711 {:02X}h, STATUS {}", address, drv8711_status, status;
});

/// Everything that the views offer also works for values of any length.
macro_rules! as_view {
    ($frame:ident) => {
        impl<const N: usize> core::fmt::Display for $frame<N> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                self.view().fmt(f)
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl<const N: usize> defmt::Format for $frame<N> {
            fn format(&self, f: defmt::Formatter<'_>) {
                self.view().format(f);
            }
        }

        #[cfg(feature = "serde")]
        #[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
        impl<const N: usize> serde::Serialize for $frame<N> {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                self.view().serialize(serializer)
            }
        }
    };
}

as_view!(MasterFrame);
as_view!(DeviceFrame);

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    use super::*;
    use crate::crc::crc8;

    fn master(output: &[u8], time_stamp: u16) -> Vec<u8> {
        let mut bytes = vec![0; output.len() + 5];
        assert_eq!(emit_master_frame_into(output, time_stamp, &mut bytes), Ok(output.len() + 5));
        bytes
    }

    #[test]
    fn every_flip_is_found_but_in_the_time_stamp() {
        let good = master(&[0x5a; 16], 0x1234);
        for bit in 0..21 * 8 {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let class = MasterFrameView::parse(16, &bytes).map_err(Error::class);
            if bit < 19 * 8 {
                assert_eq!(class, Err(crate::error::ErrorClass::BadCrc8));
            } else {
                assert!(class.is_ok());
            }
        }
    }

    #[test]
    fn every_other_length_is_refused() {
        let good = master(&[1; 16], 0);
        for len in 0..21 {
            let error = Error::Truncated { got: len as u16, want: 21 };
            assert_eq!(MasterFrameView::parse(16, &good[..len]), Err(error));
        }
        for output in 0..16 {
            let error = Error::TooLong { got: 21, want: output as u16 + 5 };
            assert_eq!(MasterFrameView::parse(output, &good), Err(error));
        }
    }

    #[test]
    fn sources_are_told_apart() {
        for source in 0..=u8::MAX {
            let crc = crc8(&[source, 0]);
            let device = DeviceFrameView::parse(0, &[source, 0, crc]).map(|_| ());
            let master = MasterFrameView::parse(0, &[source, 0, crc, 0, 0]).map(|_| ());
            let wrong = Err(Error::WrongSource { got: source });
            assert_eq!(device, if (1..=254).contains(&source) { Ok(()) } else { wrong });
            assert_eq!(master, if source == 0 { Ok(()) } else { wrong });
        }
    }

    #[test]
    fn a_slice_lies_in_the_output() {
        let bytes = master(&[10, 11, 12, 13], 0);
        let view = MasterFrameView::parse(4, &bytes).unwrap();
        assert_eq!(view.slice(1, 2), Ok(&[11, 12][..]));
        assert_eq!(view.slice(4, 0), Ok(&[][..]));
        assert_eq!(view.slice(3, 2), Err(Error::OutsideOutput { offset: 3, len: 2 }));
        assert_eq!(view.slice(u16::MAX, u16::MAX), Err(Error::OutsideOutput { offset: u16::MAX, len: u16::MAX }));
    }

    #[test]
    fn a_time_stamp_far_off_is_refused() {
        for (stamp, expected, window) in
            [(100, 90, 10), (90, 100, 10), (5, 65535, 6), (65535, 5, 6), (0, 0x8000, 0x8000)]
        {
            let bytes = master(&[], stamp);
            let view = MasterFrameView::parse(0, &bytes).unwrap();
            assert_eq!(view.check_time_stamp(expected, window), Ok(()));
            let error = Error::ImplausibleTimeStamp { got: stamp, want: expected };
            assert_eq!(view.check_time_stamp(expected, window - 1), Err(error));
        }
    }

    #[test]
    fn a_small_buffer_is_refused_and_left_alone() {
        let mut bytes = [7; 20];
        let error = Err(Error::BufferTooSmall { got: 20, want: 21 });
        assert_eq!(emit_master_frame_into(&[0; 16], 0, &mut bytes), error);
        assert_eq!(bytes, [7; 20]);
    }

    proptest! {
        #[test]
        fn master_frames_come_back(status: u8, output: [u8; 16], time_stamp: u16) {
            let frame = MasterFrame { status: Status::from_bits_retain(status), output, time_stamp };
            let mut bytes = [0; 21];
            prop_assert_eq!(frame.emit_into(&mut bytes), Ok(21));
            prop_assert_eq!(MasterFrame::<16>::parse(&bytes), Ok(frame));
        }

        #[test]
        fn device_frames_come_back(address in 1u8..=254, status: u8, payload: [u8; 3]) {
            let frame = DeviceFrame { address: DeviceAddress::new(address).unwrap(), status: Status::from_bits_retain(status), payload };
            let mut bytes = [0; 6];
            prop_assert_eq!(frame.emit_into(&mut bytes), Ok(6));
            prop_assert_eq!(DeviceFrame::<3>::parse(&bytes), Ok(frame));
            for bit in 0..48 {
                let mut wrong = bytes;
                wrong[bit / 8] ^= 1 << (bit % 8);
                let class = DeviceFrameView::parse(3, &wrong).map_err(Error::class);
                prop_assert_eq!(class.err(), Some(crate::error::ErrorClass::BadCrc8));
            }
        }
    }
}
