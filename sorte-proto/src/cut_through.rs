//! DISCOVERY and SYNC rewritten byte by byte while they pass a device: a few bytes of state, no frame buffer.
//!
//! A device sends each byte on as soon as the next one has come, so it must know what to write before it has seen the
//! rest of the frame. Both rewriters take the frame from DA to FCS, give one byte for each byte, and compute a new
//! FCS on the way.
//!
//! If the incoming FCS turns out wrong, the last byte is sent inverted: the new FCS must not heal the error. (The
//! vendor's hardware does.) A frame of another TYPE or with another DA passes unchanged.

use crate::crc::RunningFcs;
use crate::discovery::{count_after, next_address};
use crate::frame::{FrameType, MULTICAST};
use crate::sync::hop_ns;
use crate::{Assignment, Discovery, Entry, Error, Status, Sync};

/// The part both share: where in the frame we are, and both checksums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Passage {
    at: u16,
    /// DA or TYPE is another, so nothing is touched.
    foreign: bool,
    destination: u8,
    source: u8,
    code: u8,
    status: Status,
    received: RunningFcs,
    sent: RunningFcs,
    /// FCS in the frame, byte by byte as it comes.
    trailer: u32,
}

impl Passage {
    const START: Self = Self {
        at: 0,
        foreign: false,
        destination: 0,
        source: 0,
        code: 0,
        status: Status(0),
        received: RunningFcs::START,
        sent: RunningFcs::START,
        trailer: 0,
    };

    /// Takes one byte of a frame of `len` bytes. `rewrite` gives the byte to send for a byte of the body.
    fn byte(&mut self, byte: u8, len: u16, frame_type: FrameType, rewrite: impl FnOnce(u16, u8) -> u8) -> u8 {
        let at = self.at;
        self.at = at.saturating_add(1);
        match at {
            0 => {
                self.destination = byte;
                self.foreign = byte != MULTICAST;
            }
            1 => self.source = byte,
            2 => {
                self.code = byte;
                self.foreign |= byte != frame_type.code();
            }
            3 => self.status = Status(byte),
            _ => {}
        }
        let body = len.saturating_sub(4);
        if self.foreign || at >= len {
            return byte;
        }
        if at < body {
            self.received.push(byte);
            let out = rewrite(at, byte);
            self.sent.push(out);
            return out;
        }
        self.trailer = self.trailer >> 8 | u32::from(byte) << 24;
        let [out, ..] = (self.sent.value() >> (u32::from(at.saturating_sub(body)) << 3)).to_le_bytes();
        out
    }

    /// Whether the last byte of the FCS has just passed and was wrong.
    fn is_bad(&self) -> bool {
        self.trailer != self.received.value()
    }

    /// The checks of a whole frame in their order, as far as a passing frame can be judged.
    fn finish(&self, len: u16, frame_type: FrameType) -> Result<(), Error> {
        if self.at < 8 {
            return Err(Error::Truncated { got: self.at, need: 8 });
        }
        if self.destination != MULTICAST {
            return Err(Error::WrongDestination { got: self.destination });
        }
        if self.code != frame_type.code() {
            return Err(Error::UnexpectedType { got: self.code, want: frame_type.code() });
        }
        if self.at != len {
            return Err(Error::LengthMismatch { got: self.at, want: len });
        }
        let (got, want) = (self.trailer, self.received.value());
        if got == want { Ok(()) } else { Err(Error::BadFcs { got, want }) }
    }
}

/// A device's part of DISCOVERY, byte by byte: the same bytes as [`Discovery::pass`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiscoveryRewriter {
    passage: Passage,
    lengths: Entry,
    add: Status,
    /// Devices before this one; the two offsets; all as far as they have come.
    before: u16,
    in_offset: u16,
    out_offset: u16,
    /// Carry of the 16-bit addition that is under way.
    carry: bool,
}

const DISCOVERY_LEN: u16 = 1030;
const _: () = assert!(DISCOVERY_LEN as usize == Discovery::LEN);

impl DiscoveryRewriter {
    /// `last`: the device is the last one; `error`: it has seen a wrong checksum since its previous STATUS byte.
    pub const fn new(lengths: Entry, last: bool, error: bool) -> Self {
        Self {
            passage: Passage::START,
            lengths,
            add: Status::of_device(last, error),
            before: 0,
            in_offset: 0,
            out_offset: 0,
            carry: false,
        }
    }

    /// The byte to send for the byte received.
    pub fn byte(&mut self, byte: u8) -> u8 {
        let mut passage = self.passage;
        let last_byte = passage.at == DISCOVERY_LEN.saturating_sub(1);
        let out = passage.byte(byte, DISCOVERY_LEN, FrameType::Discovery, |at, byte| self.body(at, byte));
        self.passage = passage;
        if last_byte && !passage.foreign && passage.is_bad() { !out } else { out }
    }

    fn body(&mut self, at: u16, byte: u8) -> u8 {
        let full = next_address(self.before).is_none();
        let ([i0, i1], [o0, o1]) = (self.lengths.input.to_le_bytes(), self.lengths.output.to_le_bytes());
        match at {
            0..=2 => byte,
            3 => byte | self.add.0,
            4 => {
                self.before = u16::from(byte);
                let [low, _] = count_after(self.before).to_le_bytes();
                low
            }
            5 => {
                self.before |= u16::from(byte) << 8;
                byte
            }
            6..=9 if full => byte,
            6 => low(&mut self.in_offset, &mut self.carry, byte, i0),
            7 => high(&mut self.in_offset, self.carry, byte, i1),
            8 => low(&mut self.out_offset, &mut self.carry, byte, o0),
            9 => high(&mut self.out_offset, self.carry, byte, o1),
            _ if full || at.saturating_sub(10) >> 2 != self.before => byte,
            _ => match at.saturating_sub(10) & 3 {
                0 => i0,
                1 => i1,
                2 => o0,
                _ => o1,
            },
        }
    }

    /// STATUS as it was received, and what the device has learnt.
    ///
    /// # Errors
    /// [`Error::Truncated`]; [`Error::WrongDestination`], [`Error::UnexpectedType`] for a frame that passed unchanged;
    /// [`Error::LengthMismatch`], [`Error::BadFcs`], [`Error::TooManyDevices`].
    pub fn finish(self) -> Result<(Status, Assignment), Error> {
        self.passage.finish(DISCOVERY_LEN, FrameType::Discovery)?;
        let count = self.before.saturating_add(1);
        let address = next_address(self.before).ok_or(Error::TooManyDevices { count })?;
        Ok((self.passage.status, Assignment { address, in_offset: self.in_offset, out_offset: self.out_offset }))
    }
}

fn low(offset: &mut u16, carry: &mut bool, byte: u8, add: u8) -> u8 {
    *offset = u16::from(byte);
    let (sum, over) = byte.overflowing_add(add);
    *carry = over;
    sum
}

fn high(offset: &mut u16, carry: bool, byte: u8, add: u8) -> u8 {
    *offset |= u16::from(byte) << 8;
    byte.wrapping_add(add).wrapping_add(u8::from(carry))
}

/// A device's part of SYNC, byte by byte: the same bytes as [`Sync::pass`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SyncRewriter {
    passage: Passage,
    hop_ns: u32,
    add: Status,
    time_stamp: u32,
    delay: u16,
    carry: bool,
}

const SYNC_LEN: u16 = 14;
const _: () = assert!(SYNC_LEN as usize == Sync::LEN);

impl SyncRewriter {
    /// `line_delay_next_ns`: the line to the next device; `last`, `error` as with [`DiscoveryRewriter::new`].
    pub const fn new(line_delay_next_ns: u16, last: bool, error: bool) -> Self {
        Self {
            passage: Passage::START,
            hop_ns: hop_ns(line_delay_next_ns),
            add: Status::of_device(last, error),
            time_stamp: 0,
            delay: 0,
            carry: false,
        }
    }

    /// The byte to send for the byte received.
    pub fn byte(&mut self, byte: u8) -> u8 {
        let mut passage = self.passage;
        let last_byte = passage.at == SYNC_LEN.saturating_sub(1);
        let out = passage.byte(byte, SYNC_LEN, FrameType::Sync, |at, byte| self.body(at, byte));
        self.passage = passage;
        if last_byte && !passage.foreign && passage.is_bad() { !out } else { out }
    }

    fn body(&mut self, at: u16, byte: u8) -> u8 {
        let [h0, h1, h2, h3] = self.hop_ns.to_le_bytes();
        match at {
            3 => return byte | self.add.0,
            4..=7 => self.time_stamp = self.time_stamp >> 8 | u32::from(byte) << 24,
            8 | 9 => self.delay = self.delay >> 8 | u16::from(byte) << 8,
            _ => {}
        }
        let (add, carry) = match at {
            4 | 8 => (h0, false),
            5 | 9 => (h1, self.carry),
            6 => (h2, self.carry),
            7 => (h3, self.carry),
            _ => return byte,
        };
        let (sum, over) = byte.overflowing_add(add);
        let (sum, more) = sum.overflowing_add(u8::from(carry));
        self.carry = over | more;
        sum
    }

    /// The frame as it was received.
    ///
    /// # Errors
    /// [`Error::Truncated`]; [`Error::WrongDestination`], [`Error::UnexpectedType`] for a frame that passed unchanged;
    /// [`Error::LengthMismatch`], [`Error::BadFcs`].
    pub fn finish(self) -> Result<Sync, Error> {
        self.passage.finish(SYNC_LEN, FrameType::Sync)?;
        let source = self.passage.source;
        Ok(Sync { source, status: self.passage.status, time_stamp_ns: self.time_stamp, delay_ns: self.delay })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;
    use crate::DelayReq;

    fn discovery(frame: &[u8], lengths: Entry, last: bool, error: bool) -> (Vec<u8>, DiscoveryRewriter) {
        let mut rewriter = DiscoveryRewriter::new(lengths, last, error);
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    fn sync(frame: &[u8], line: u16, last: bool, error: bool) -> (Vec<u8>, SyncRewriter) {
        let mut rewriter = SyncRewriter::new(line, last, error);
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    #[test]
    fn a_device_needs_a_few_bytes_and_not_a_frame() {
        assert!(size_of::<DiscoveryRewriter>() <= 48);
        assert!(size_of::<SyncRewriter>() <= 48);
    }

    #[test]
    fn a_line_of_300_devices_gives_the_bytes_of_the_buffered_form() {
        let mut buffered = Discovery::request(true);
        let mut passing = buffered.emit().to_vec();
        for k in 0..300u16 {
            let lengths = Entry { input: k, output: 300 - k };
            let (out, rewriter) = discovery(&passing, lengths, k == 299, k % 3 == 0);
            let assignment = buffered.pass(lengths, k == 299, k % 3 == 0);
            assert_eq!(out, buffered.emit());
            assert_eq!(rewriter.finish().map(|(_, a)| a), assignment);
            assert_eq!(assignment.is_ok(), k < 254);
            passing = out;
        }
    }

    #[test]
    fn every_count_passes_as_in_the_buffered_form() {
        for count in (0..300).chain([0x1fe, 0x1ff, 0x7f00, 0xfffe, 0xffff]) {
            let mut buffered = Discovery { count, input_total: 0xfffe, ..Discovery::request(false) };
            let (out, rewriter) = discovery(&buffered.emit(), Entry::STOCK, true, false);
            let assignment = buffered.pass(Entry::STOCK, true, false);
            assert_eq!(out, buffered.emit(), "{count}");
            assert_eq!(rewriter.finish().map(|(_, a)| a), assignment);
        }
    }

    #[test]
    fn no_flip_is_healed() {
        let good = Sync::of_master(500, 76, false).emit();
        for bit in 0..14 * 8 {
            let mut frame = good;
            frame[bit / 8] ^= 1 << (bit % 8);
            let (out, rewriter) = sync(&frame, 100, false, false);
            assert!(Sync::parse(&out).is_err());
            assert!(rewriter.finish().is_err());
        }
        let good = Discovery::request(false).emit();
        for bit in (0..40 * 8).chain(1020 * 8..1030 * 8) {
            let mut frame = good;
            frame[bit / 8] ^= 1 << (bit % 8);
            let (out, rewriter) = discovery(&frame, Entry::STOCK, true, false);
            assert!(Discovery::parse(&out).is_err());
            assert!(rewriter.finish().is_err());
        }
    }

    #[test]
    fn other_frames_pass_unchanged_and_short_ones_are_refused() {
        let other = DelayReq::of_master(true).emit();
        let (out, rewriter) = discovery(&other, Entry::STOCK, true, true);
        assert_eq!(out, other);
        assert_eq!(rewriter.finish(), Err(Error::UnexpectedType { got: 3, want: 1 }));
        let (out, rewriter) = sync(&other, 1, true, true);
        assert_eq!(out, other);
        assert_eq!(rewriter.finish(), Err(Error::UnexpectedType { got: 3, want: 5 }));

        let frame = Sync::of_master(500, 76, false).emit();
        for len in 0..14 {
            let (_, rewriter) = sync(&frame[..len], 1, false, false);
            assert!(matches!(rewriter.finish(), Err(Error::Truncated { .. } | Error::LengthMismatch { .. })));
        }
        let mut long = frame.to_vec();
        long.push(0x77);
        let (out, rewriter) = sync(&long, 1, false, false);
        assert_eq!(out[14], 0x77);
        assert_eq!(rewriter.finish(), Err(Error::LengthMismatch { got: 15, want: 14 }));
    }

    proptest! {
        #[test]
        fn sync_gives_the_bytes_of_the_buffered_form(
            source: u8, status: u8, time_stamp_ns: u32, delay_ns: u16, line: u16, last: bool, error: bool,
        ) {
            let received = Sync { source, status: Status(status), time_stamp_ns, delay_ns };
            let (out, rewriter) = sync(&received.emit(), line, last, error);
            let mut buffered = received;
            buffered.pass(line, last, error);
            prop_assert_eq!(out, buffered.emit());
            prop_assert_eq!(rewriter.finish(), Ok(received));
        }
    }
}
