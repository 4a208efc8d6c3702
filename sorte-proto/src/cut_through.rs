//! DISCOVERY and SYNC rewritten byte by byte while they pass a device: a few bytes of state, no frame buffer.
//!
//! A device sends each byte on as soon as the next one has come, so it must know what to write before it has seen the
//! rest of the frame. Both rewriters take the frame from DA to FCS, give one byte for each byte, and compute a new
//! FCS on the way.
//!
//! If the incoming FCS turns out wrong, the last byte is sent inverted: the new FCS must not heal the error. (The
//! vendor's hardware does.) A frame of another TYPE or with another DA passes unchanged.

mod transit;

use crate::crc::RunningFcs;
use crate::discovery::{Assignment, Discovery, Entry, count_after, next_address};
use crate::error::Error;
use crate::frame_type::FrameType;
use crate::status::Status;
use crate::sync::{Sync, hop_ns};

pub(crate) use transit::Transit;

/// What both rewriters send: STATUS, FCS and the inverted last byte of a frame that came in wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Sender {
    transit: Transit,
    sent: RunningFcs,
    add: Status,
}

impl Sender {
    const fn new(add: Status) -> Self {
        Self { transit: Transit::START, sent: RunningFcs::START, add }
    }

    /// Takes a byte that passes as it is, if nobody has to look at it.
    #[inline]
    fn passes(&mut self, byte: u8) -> bool {
        let quiet = self.transit.passes(byte);
        if quiet {
            self.sent.push(byte);
        }
        quiet
    }

    /// The byte to send for byte `at` of the FCS, 0 to 3.
    #[inline(never)]
    fn trailer(&self, at: u16) -> u8 {
        let [out, ..] = (self.sent.value() >> (u32::from(at & 3) << 3)).to_le_bytes();
        if at == 3 && !self.transit.is_whole() { !out } else { out }
    }
}

/// A device's part of DISCOVERY, byte by byte: the same bytes as [`Discovery::pass`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiscoveryRewriter {
    sender: Sender,
    lengths: Entry,
    /// Devices before this one; the two offsets; all as far as they have come.
    before: u16,
    in_offset: u16,
    out_offset: u16,
    /// Where the own entry begins; `u16::MAX` for none.
    entry_at: u16,
    /// Carry of the 16-bit addition that is under way.
    carry: bool,
}

/// A DISCOVERY frame that has passed a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PassedDiscovery {
    /// STATUS as it was received.
    pub status: Status,
    /// What the device has learnt of itself.
    pub assignment: Assignment,
}

const DISCOVERY_LEN: u16 = 1030;
const DISCOVERY_FCS: u16 = DISCOVERY_LEN - 4;
/// Where the table of entries begins.
const TABLE: u16 = 10;
const _: () = assert!(DISCOVERY_LEN as usize == Discovery::LEN);

impl DiscoveryRewriter {
    /// `adds`: what the device sets in STATUS, LAST if it is the last one and ERROR if it has seen a wrong checksum since its
    /// previous STATUS byte.
    pub const fn new(lengths: Entry, adds: Status) -> Self {
        let sender = Sender::new(adds);
        Self { sender, lengths, before: 0, in_offset: 0, out_offset: 0, entry_at: u16::MAX, carry: false }
    }

    /// The byte to send for the byte received.
    #[inline]
    pub fn byte(&mut self, byte: u8) -> u8 {
        // Most bytes are entries of other devices.
        if self.sender.passes(byte) { byte } else { self.look(byte) }
    }

    #[inline(never)]
    fn look(&mut self, byte: u8) -> u8 {
        let at = self.sender.transit.take(byte);
        let out = self.special(at, byte);
        if at < DISCOVERY_FCS {
            self.sender.sent.push(out);
        }
        // Up to the own entry, then up to the FCS.
        let quiet = match at {
            0..=8 => 0,
            _ if !self.sender.transit.is_for_all(FrameType::Discovery) => u16::MAX,
            _ if at < self.entry_at => self.entry_at.min(DISCOVERY_FCS),
            _ if at.wrapping_sub(self.entry_at) < 3 => 0,
            _ => DISCOVERY_FCS,
        };
        self.sender.transit.quiet_until(quiet);
        out
    }

    /// Head, own entry, FCS, and what comes after the frame.
    fn special(&mut self, at: u16, byte: u8) -> u8 {
        let ([i0, i1], [o0, o1]) = (self.lengths.input.to_le_bytes(), self.lengths.output.to_le_bytes());
        if at >= 3 && !self.sender.transit.is_for_all(FrameType::Discovery) {
            return byte;
        }
        let full = next_address(self.before).is_none();
        match at {
            0..=2 => byte,
            3 => byte | self.sender.add.bits(),
            4 => {
                self.before = u16::from(byte);
                let [low, _] = count_after(self.before).to_le_bytes();
                low
            }
            5 => {
                self.before |= u16::from(byte) << 8;
                // At most 253 devices before one that has an entry.
                if let Some(address) = next_address(self.before) {
                    self.entry_at = TABLE.saturating_add(u16::from(address.hops_before()) << 2);
                }
                byte
            }
            6..=9 if full => byte,
            6 => low(&mut self.in_offset, &mut self.carry, byte, i0),
            7 => high(&mut self.in_offset, self.carry, byte, i1),
            8 => low(&mut self.out_offset, &mut self.carry, byte, o0),
            9 => high(&mut self.out_offset, self.carry, byte, o1),
            DISCOVERY_FCS..DISCOVERY_LEN => self.sender.trailer(at.wrapping_sub(DISCOVERY_FCS)),
            _ => match at.wrapping_sub(self.entry_at) {
                0 => i0,
                1 => i1,
                2 => o0,
                3 => o1,
                _ => byte,
            },
        }
    }

    /// What the frame was and what the device has learnt.
    ///
    /// # Errors
    /// As [`LongFrame::parse`](crate::LongFrame::parse); [`Error::UnexpectedType`] for a good frame that passed unchanged;
    /// [`Error::TooManyDevices`].
    pub fn finish(self) -> Result<PassedDiscovery, Error> {
        self.sender.transit.check_type(FrameType::Discovery)?;
        let count = self.before.saturating_add(1);
        let address = next_address(self.before).ok_or(Error::TooManyDevices { count })?;
        let assignment = Assignment { address, in_offset: self.in_offset, out_offset: self.out_offset };
        Ok(PassedDiscovery { status: self.sender.transit.status(), assignment })
    }

    pub(crate) const fn transit(&self) -> &Transit {
        &self.sender.transit
    }

    /// Output bytes of the line up to this device, as it has written them.
    pub(crate) const fn output_total(&self) -> u16 {
        self.out_offset.wrapping_add(self.lengths.output)
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
    sender: Sender,
    hop_ns: u32,
    time_stamp: u32,
    delay: u16,
    carry: bool,
}

const SYNC_LEN: u16 = 14;
const SYNC_FCS: u16 = SYNC_LEN - 4;
const _: () = assert!(SYNC_LEN as usize == Sync::LEN);

impl SyncRewriter {
    /// `line_delay_next_ns`: the line to the next device; `adds` as with [`DiscoveryRewriter::new`].
    pub const fn new(line_delay_next_ns: u16, adds: Status) -> Self {
        let sender = Sender::new(adds);
        Self { sender, hop_ns: hop_ns(line_delay_next_ns), time_stamp: 0, delay: 0, carry: false }
    }

    /// The byte to send for the byte received.
    pub fn byte(&mut self, byte: u8) -> u8 {
        let at = self.sender.transit.take(byte);
        let foreign = at >= 3 && !self.sender.transit.is_for_all(FrameType::Sync);
        let out = match at {
            _ if foreign => byte,
            3..SYNC_FCS => self.body(at, byte),
            SYNC_FCS..SYNC_LEN => self.sender.trailer(at.wrapping_sub(SYNC_FCS)),
            _ => byte,
        };
        if at < SYNC_FCS {
            self.sender.sent.push(out);
        }
        out
    }

    fn body(&mut self, at: u16, byte: u8) -> u8 {
        let [h0, h1, h2, h3] = self.hop_ns.to_le_bytes();
        match at {
            3 => return byte | self.sender.add.bits(),
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
    /// As [`LongFrame::parse`](crate::LongFrame::parse); [`Error::UnexpectedType`] for a good frame that passed unchanged.
    pub fn finish(self) -> Result<Sync, Error> {
        let transit = &self.sender.transit;
        transit.check_type(FrameType::Sync)?;
        let (source, status) = (transit.source(), transit.status());
        Ok(Sync { source, status, time_stamp_ns: self.time_stamp, delay_ns: self.delay })
    }

    pub(crate) const fn transit(&self) -> &Transit {
        &self.sender.transit
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;
    use crate::delay_req::DelayReq;
    use crate::place::Place;

    fn discovery(frame: &[u8], lengths: Entry, last: bool, error: bool) -> (Vec<u8>, DiscoveryRewriter) {
        let mut rewriter = DiscoveryRewriter::new(lengths, Status::of_device(last, error));
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    fn sync(frame: &[u8], line: u16, last: bool, error: bool) -> (Vec<u8>, SyncRewriter) {
        let mut rewriter = SyncRewriter::new(line, Status::of_device(last, error));
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    #[test]
    fn a_device_needs_a_few_bytes_and_not_a_frame() {
        assert!(size_of::<DiscoveryRewriter>() <= 48);
        assert!(size_of::<SyncRewriter>() <= 48);
    }

    #[test]
    fn a_line_of_300_devices_gives_the_bytes_of_the_buffered_form() {
        let mut buffered = Discovery::request(Place::Last);
        let mut passing = buffered.emit().to_vec();
        let devices = if cfg!(miri) { 2 } else { 300 };
        for k in 0..devices {
            let lengths = Entry { input: k, output: 300 - k };
            let (out, rewriter) = discovery(&passing, lengths, k + 1 == devices, k % 3 == 0);
            let assignment = buffered.pass(lengths, Status::of_device(k + 1 == devices, k % 3 == 0));
            assert_eq!(out, buffered.emit());
            assert_eq!(rewriter.finish().map(|passed| passed.assignment), assignment);
            assert_eq!(assignment.is_ok(), k < 254);
            passing = out;
        }
    }

    #[test]
    fn every_count_passes_as_in_the_buffered_form() {
        for count in (0..300).chain([0x1fe, 0x1ff, 0x7f00, 0xfffe, 0xffff]).step_by(crate::stride(300)) {
            let mut buffered = Discovery { count, input_total: 0xfffe, ..Discovery::request(Place::Inner) };
            let (out, rewriter) = discovery(&buffered.emit(), Entry::STOCK, true, false);
            let assignment = buffered.pass(Entry::STOCK, Status::LAST);
            assert_eq!(out, buffered.emit(), "{count}");
            assert_eq!(rewriter.finish().map(|passed| passed.assignment), assignment);
        }
    }

    #[test]
    fn no_flip_is_healed() {
        let good = Sync::of_master(500, 76, Place::Inner).emit();
        for bit in (0..14 * 8).step_by(crate::stride(7)) {
            let mut frame = good;
            frame[bit / 8] ^= 1 << (bit % 8);
            let (out, rewriter) = sync(&frame, 100, false, false);
            assert!(Sync::parse(&out).is_err());
            assert!(rewriter.finish().is_err());
        }
        let good = Discovery::request(Place::Inner).emit();
        for bit in (0..40 * 8).chain(1020 * 8..1030 * 8).step_by(crate::stride(199)) {
            let mut frame = good;
            frame[bit / 8] ^= 1 << (bit % 8);
            let (out, rewriter) = discovery(&frame, Entry::STOCK, true, false);
            assert!(Discovery::parse(&out).is_err());
            assert!(rewriter.finish().is_err());
        }
    }

    #[test]
    fn other_frames_pass_unchanged_and_short_ones_are_refused() {
        let other = DelayReq::of_master(Place::Last).emit();
        let (out, rewriter) = discovery(&other, Entry::STOCK, true, true);
        assert_eq!(out, other);
        assert_eq!(rewriter.finish(), Err(Error::UnexpectedType { got: 3, want: 1 }));
        let (out, rewriter) = sync(&other, 1, true, true);
        assert_eq!(out, other);
        assert_eq!(rewriter.finish(), Err(Error::UnexpectedType { got: 3, want: 5 }));

        let frame = Sync::of_master(500, 76, Place::Inner).emit();
        for len in 0..14 {
            let (_, rewriter) = sync(&frame[..len], 1, false, false);
            assert!(matches!(rewriter.finish(), Err(Error::Truncated { .. } | Error::BadFcs { .. })));
        }
        let mut long = frame.to_vec();
        long.push(0x77);
        let (out, rewriter) = sync(&long, 1, false, false);
        assert_eq!(out[14], 0x77);
        assert!(matches!(rewriter.finish(), Err(Error::BadFcs { .. })));
        crate::frame::refresh_fcs(&mut long);
        let (_, rewriter) = sync(&long, 1, false, false);
        assert_eq!(rewriter.finish(), Err(Error::TooLong { got: 15, want: 14 }));
    }

    proptest! {
        #[test]
        fn sync_gives_the_bytes_of_the_buffered_form(
            source: u8, status: u8, time_stamp_ns: u32, delay_ns: u16, line: u16, last: bool, error: bool,
        ) {
            let received = Sync { source, status: Status::from_bits_retain(status), time_stamp_ns, delay_ns };
            let (out, rewriter) = sync(&received.emit(), line, last, error);
            let mut buffered = received;
            buffered.pass(line, Status::of_device(last, error));
            prop_assert_eq!(out, buffered.emit());
            prop_assert_eq!(rewriter.finish(), Ok(received));
        }
    }
}
