//! Rewrites start-up frames on their way through a device, byte by byte: a few bytes of state, no frame buffer.
//!
//! A device forwards each byte as soon as the next one has come, so it must know what to write before it has seen the rest of
//! the frame. The rewriter takes the frame from DA to FCS, returns one byte for each byte, and computes a new FCS
//! as it goes.
//!
//! If the incoming FCS turns out wrong, the last byte is sent inverted: the new FCS must not hide the error. (The
//! vendor's hardware does.) A frame of another TYPE or with another DA passes unchanged.

mod transit;

use crate::crc::RunningFcs;
use crate::discovery::{Assignment, Discovery, Entry, count_after, next_address};
use crate::error::Error;
use crate::frame_type::FrameType;
use crate::param::Parameters;
use crate::status::Status;
use crate::sync::{Sync, hop_ns};

pub(crate) use transit::Transit;

/// A frame that has passed through a device, and what the device learned from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Passed {
    /// DISCOVERY, rewritten.
    Discovery {
        /// STATUS as it was received.
        status: Status,
        /// What the device has learned about itself.
        assignment: Assignment,
    },
    /// SYNC, rewritten; the content is as received.
    Sync(Sync),
    /// PARAM: its parameters.
    Param([u8; Parameters::LEN]),
    /// Any other frame; it passed unchanged.
    Unchanged(FrameType),
}

/// Does a device's part of DISCOVERY or SYNC, byte by byte; for a frame in a buffer, see [`pass`](Self::pass).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rewriter {
    transit: Transit,
    sent: RunningFcs,
    /// The type of frame to rewrite; `None` if nothing is rewritten.
    frame_type: Option<FrameType>,
    /// Where the FCS of that frame begins.
    fcs_at: u16,
    add: Status,
    /// What is added to the numbers in bytes 4 to 9, how many bytes each of these numbers has, and the carry of the addition in
    /// progress.
    addends: [u8; 6],
    width: u16,
    carry: bool,
    /// The device's own entry in DISCOVERY, and where it begins; `u16::MAX` for none.
    entry: [u8; 4],
    entry_at: u16,
    /// The bytes after STATUS as received: the numbers of DISCOVERY and SYNC, or the parameters.
    came: [u8; Parameters::LEN],
}

const DISCOVERY_FCS: u16 = 1026;
const SYNC_FCS: u16 = 10;
/// Where the table of entries begins.
const TABLE: u16 = 10;
/// DA, SA, TYPE, STATUS.
const HEAD: u16 = 4;
const _: () = assert!(DISCOVERY_FCS as usize + 4 == Discovery::LEN && SYNC_FCS as usize + 4 == Sync::LEN);

impl Rewriter {
    /// Creates the state for a frame that passes unchanged.
    pub const fn unchanged() -> Self {
        Self {
            transit: Transit::START,
            sent: RunningFcs::START,
            frame_type: None,
            fcs_at: 0,
            add: Status::empty(),
            addends: [0; 6],
            width: 2,
            carry: false,
            entry: [0; 4],
            entry_at: u16::MAX,
            came: [0; Parameters::LEN],
        }
    }

    /// For DISCOVERY: the device takes the next address and the present totals as its offsets, and adds its lengths.
    /// `adds`: the bits that it sets in STATUS, LAST if it is the last device and ERROR if it has seen a wrong checksum since
    /// its previous STATUS byte.
    ///
    /// A device that finds 254 or more devices before it sets the count to 255 and takes no address: the master then refuses
    /// the network.
    pub const fn discovery(lengths: Entry, adds: Status) -> Self {
        let ([i0, i1], [o0, o1]) = (lengths.input.to_le_bytes(), lengths.output.to_le_bytes());
        Self {
            frame_type: Some(FrameType::Discovery),
            fcs_at: DISCOVERY_FCS,
            add: adds,
            // The count is one of its own.
            addends: [0, 0, i0, i1, o0, o1],
            entry: [i0, i1, o0, o1],
            ..Self::unchanged()
        }
    }

    /// For SYNC: the device's own transit, 355 ns, and the line to the next device are added to both times, which wrap.
    /// `line_delay_next_ns`: that line, in ns; `adds` as with [`discovery`](Self::discovery).
    pub const fn sync(line_delay_next_ns: u16, adds: Status) -> Self {
        let [h0, h1, h2, h3] = hop_ns(line_delay_next_ns).to_le_bytes();
        Self {
            frame_type: Some(FrameType::Sync),
            fcs_at: SYNC_FCS,
            add: adds,
            addends: [h0, h1, h2, h3, h0, h1],
            width: 4,
            ..Self::unchanged()
        }
    }

    /// Takes the byte received and returns the byte to send.
    #[inline]
    pub fn byte(&mut self, byte: u8) -> u8 {
        // Most bytes are entries of other devices.
        if self.transit.passes(byte) {
            self.sent.push(byte);
            byte
        } else {
            self.look(byte)
        }
    }

    /// Rewrites a whole frame in a buffer.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn pass(mut self, frame: &mut [u8]) -> Result<Passed, Error> {
        for byte in frame {
            *byte = self.byte(*byte);
        }
        self.finish()
    }

    /// Whether DA and TYPE are those of the frame to be rewritten. Known once the third byte has come.
    const fn rewrites(&self) -> bool {
        match self.frame_type {
            Some(frame_type) => self.transit.is_for_all(frame_type),
            None => false,
        }
    }

    #[inline(never)]
    fn look(&mut self, byte: u8) -> u8 {
        let at = self.transit.take(byte);
        if let Some(place) = self.came.get_mut(usize::from(at.wrapping_sub(HEAD))) {
            *place = byte;
        }
        let rewrites = at > 2 && self.rewrites();
        let out = if rewrites { self.rewritten(at, byte) } else { byte };
        if at < self.fcs_at {
            self.sent.push(out);
        }
        // Up to the own entry, then up to the FCS; of a foreign frame the parameters, if it has any.
        let quiet = match at {
            0..=8 => 0,
            _ if !rewrites => {
                if usize::from(at.wrapping_sub(HEAD)) < Parameters::LEN {
                    0
                } else {
                    u16::MAX
                }
            }
            _ if at < self.entry_at => self.entry_at.min(self.fcs_at),
            _ if at.wrapping_sub(self.entry_at) < 3 => 0,
            _ => self.fcs_at,
        };
        self.transit.quiet_until(quiet);
        out
    }

    /// Rewrites STATUS, the numbers, the device's own entry, the FCS, and anything after the frame.
    fn rewritten(&mut self, at: u16, byte: u8) -> u8 {
        match at {
            3 => byte | self.add.bits(),
            4 | 5 if self.frame_type == Some(FrameType::Discovery) => self.count(at, byte),
            4..=9 => self.sum(at, byte),
            _ if at >= self.fcs_at => self.trailer(at.wrapping_sub(self.fcs_at), byte),
            _ => self.entry.get(usize::from(at.wrapping_sub(self.entry_at))).copied().unwrap_or(byte),
        }
    }

    /// Rewrites the count of DISCOVERY, low byte first. A device that has no address adds nothing.
    fn count(&mut self, at: u16, byte: u8) -> u8 {
        if at == HEAD {
            let [low, _] = count_after(byte.into()).to_le_bytes();
            return low;
        }
        match next_address(self.number(0)) {
            // At most 253 devices before one that has an entry.
            Some(address) => self.entry_at = TABLE.saturating_add(u16::from(address.hops_before()) << 2),
            None => self.addends = [0; 6],
        }
        byte
    }

    /// Rewrites a byte of a number that is increased.
    fn sum(&mut self, at: u16, byte: u8) -> u8 {
        let add = self.addends.get(usize::from(at.wrapping_sub(HEAD))).copied().unwrap_or(0);
        let begins = at & self.width.wrapping_sub(1) == 0;
        let (sum, over) = byte.overflowing_add(add);
        let (sum, more) = sum.overflowing_add(u8::from(self.carry && !begins));
        self.carry = over | more;
        sum
    }

    /// Returns byte `at` of the FCS, or of anything after it.
    #[inline(never)]
    fn trailer(&self, at: u16, byte: u8) -> u8 {
        let [out, ..] = (self.sent.value() >> (u32::from(at & 3) << 3)).to_le_bytes();
        match at {
            3 if !self.transit.is_whole() => !out,
            0..=3 => out,
            _ => byte,
        }
    }

    /// Returns two bytes after STATUS as received.
    fn number(&self, at: usize) -> u16 {
        let bytes = self.came.get(at..).and_then(|rest| rest.first_chunk().copied());
        bytes.map_or(0, u16::from_le_bytes)
    }

    /// Returns what the frame was and what the device learned from it.
    ///
    /// # Errors
    /// As [`LongFrame::parse`](crate::LongFrame::parse); [`Error::TooManyDevices`].
    pub fn finish(self) -> Result<Passed, Error> {
        let transit = &self.transit;
        let (source, status) = (transit.source(), transit.status());
        Ok(match transit.check()? {
            FrameType::Param => Passed::Param(self.came),
            other if self.frame_type != Some(other) => Passed::Unchanged(other),
            FrameType::Sync => {
                let time_stamp_ns = u32::from(self.number(2)) << 16 | u32::from(self.number(0));
                Passed::Sync(Sync { source, status, time_stamp_ns, delay_ns: self.number(4) })
            }
            _ => {
                let count = self.number(0).saturating_add(1);
                let address = next_address(self.number(0)).ok_or(Error::TooManyDevices { count })?;
                let assignment = Assignment { address, in_offset: self.number(2), out_offset: self.number(4) };
                Passed::Discovery { status, assignment }
            }
        })
    }

    pub(crate) const fn transit(&self) -> &Transit {
        &self.transit
    }

    /// Whether the device added bits to STATUS.
    pub(crate) const fn has_written_status(&self) -> bool {
        self.transit.len() > 3 && self.rewrites()
    }

    /// Number of output bytes counted in the frame as it leaves the device; `None` unless it is DISCOVERY.
    pub(crate) fn output_total(&self) -> Option<u16> {
        let [_, _, o0, o1] = self.entry;
        let own = if self.rewrites() { u16::from_le_bytes([o0, o1]) } else { 0 };
        self.transit.is_for_all(FrameType::Discovery).then(|| self.number(4).wrapping_add(own))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;
    use crate::delay_req::DelayReq;
    use crate::param::Param;
    use crate::place::Place;

    fn discovery(frame: &[u8], lengths: Entry, last: bool, error: bool) -> (Vec<u8>, Rewriter) {
        let mut rewriter = Rewriter::discovery(lengths, Status::of_device(last, error));
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    fn sync(frame: &[u8], line: u16, last: bool, error: bool) -> (Vec<u8>, Rewriter) {
        let mut rewriter = Rewriter::sync(line, Status::of_device(last, error));
        (frame.iter().map(|&byte| rewriter.byte(byte)).collect(), rewriter)
    }

    fn assignment(rewriter: Rewriter) -> Result<Assignment, Error> {
        match rewriter.finish()? {
            Passed::Discovery { assignment, .. } => Ok(assignment),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_device_needs_a_few_bytes_and_not_a_frame() {
        assert!(size_of::<Rewriter>() <= 84);
    }

    /// What a device has to make of DISCOVERY, by arithmetic on the numbers of the frame, and what it takes: address and offsets.
    fn by_hand(before: &Discovery, lengths: Entry, adds: Status) -> (Option<[u16; 3]>, Discovery) {
        let mut after = *before;
        after.status |= adds;
        // A passing frame shows its low byte first, so nothing is carried into the high one.
        let [low, high] = before.count.to_le_bytes();
        after.count = u16::from_le_bytes([if low == 255 { 255 } else { low + 1 }, high]);
        if before.count >= 254 {
            return (None, after);
        }
        after.entries[usize::from(before.count)] = lengths;
        after.input_total = (u32::from(before.input_total) + u32::from(lengths.input)) as u16;
        after.output_total = (u32::from(before.output_total) + u32::from(lengths.output)) as u16;
        (Some([before.count + 1, before.input_total, before.output_total]), after)
    }

    fn told(rewriter: Rewriter) -> Result<[u16; 3], Error> {
        assignment(rewriter).map(|told| [told.address.get().into(), told.in_offset, told.out_offset])
    }

    #[test]
    fn a_line_of_300_devices_gives_the_bytes_made_by_hand() {
        let mut sent = Discovery::request(Place::Last);
        let mut passing = sent.emit().to_vec();
        let devices = if cfg!(miri) { 2 } else { 300 };
        for k in 0..devices {
            let lengths = Entry { input: k, output: 300 - k };
            let (out, rewriter) = discovery(&passing, lengths, k + 1 == devices, k % 3 == 0);
            let (want, after) = by_hand(&sent, lengths, Status::of_device(k + 1 == devices, k % 3 == 0));
            assert_eq!(told(rewriter), want.ok_or(Error::TooManyDevices { count: sent.count + 1 }));
            assert_eq!((out.as_slice(), want.is_some()), (&after.emit()[..], k < 254));
            (passing, sent) = (out, after);
        }
    }

    #[test]
    fn every_count_passes_as_by_hand() {
        for count in (0..300).chain([0x1fe, 0x1ff, 0x7f00, 0xfffe, 0xffff]).step_by(crate::stride(300)) {
            let sent = Discovery { count, input_total: 0xfffe, ..Discovery::request(Place::Inner) };
            let (out, rewriter) = discovery(&sent.emit(), Entry::STOCK, true, false);
            let (want, after) = by_hand(&sent, Entry::STOCK, Status::LAST);
            assert_eq!(out, after.emit(), "{count}");
            assert_eq!(told(rewriter), want.ok_or(Error::TooManyDevices { count: count.saturating_add(1) }));
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
        assert_eq!(rewriter.finish(), Ok(Passed::Unchanged(FrameType::DelayReq)));
        let (out, rewriter) = sync(&other, 1, true, true);
        assert_eq!(out, other);
        assert_eq!(rewriter.finish(), Ok(Passed::Unchanged(FrameType::DelayReq)));
        let mut param = Param::request(Parameters::STOCK, Place::Inner).emit();
        let sent = param;
        let told = Passed::Param(*sent[4..].first_chunk().unwrap());
        for rewriter in
            [Rewriter::discovery(Entry::STOCK, Status::LAST), Rewriter::sync(1, Status::LAST), Rewriter::unchanged()]
        {
            assert_eq!((rewriter.pass(&mut param), param), (Ok(told), sent));
        }

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
        fn both_times_of_sync_grow_by_the_hop(
            source: u8, status: u8, time_stamp_ns: u32, delay_ns: u16, line: u16, last: bool, error: bool,
        ) {
            let received = Sync { source, status: Status::from_bits_retain(status), time_stamp_ns, delay_ns };
            let (out, rewriter) = sync(&received.emit(), line, last, error);
            let status = received.status | Status::of_device(last, error);
            let time_stamp_ns = (u64::from(time_stamp_ns) + u64::from(line) + 355) as u32;
            let delay_ns = (u64::from(delay_ns) + u64::from(line) + 355) as u16;
            let after = Sync { status, time_stamp_ns, delay_ns, ..received };
            prop_assert_eq!(out, after.emit());
            prop_assert_eq!(rewriter.finish(), Ok(Passed::Sync(received)));
        }
    }
}
