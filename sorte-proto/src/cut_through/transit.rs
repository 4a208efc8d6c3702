use crate::crc::RunningFcs;
use crate::error::Error;
use crate::frame::{MULTICAST, check};
use crate::frame_type::FrameType;
use crate::status::Status;

/// A frame that passes byte by byte: its progress, its head and its check. Sixteen bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Transit {
    /// Number of bytes so far.
    at: u16,
    /// Bytes before this one pass unchanged and need no inspection.
    quiet: u16,
    /// DA, SA, TYPE and STATUS as received.
    head: [u8; 4],
    /// The check over all bytes, including the FCS.
    received: RunningFcs,
    /// The last four bytes.
    trailer: u32,
}

impl Transit {
    pub(crate) const START: Self = Self { at: 0, quiet: 0, head: [0; 4], received: RunningFcs::START, trailer: 0 };

    /// Takes a byte that needs no inspection; returns `false` and takes nothing if the byte needs it.
    #[inline]
    pub(crate) fn passes(&mut self, byte: u8) -> bool {
        let quiet = self.at < self.quiet;
        if quiet {
            // Below `quiet`, so it does not wrap.
            self.at = self.at.wrapping_add(1);
            self.check_in(byte);
        }
        quiet
    }

    /// Marks the bytes from the next one up to `end` (exclusive) as needing no inspection.
    pub(crate) const fn quiet_until(&mut self, end: u16) {
        self.quiet = end;
    }

    #[inline]
    fn check_in(&mut self, byte: u8) {
        self.received.push(byte);
        self.trailer = self.trailer >> 8 | u32::from(byte) << 24;
    }

    /// Takes a byte and returns its place in the frame.
    pub(crate) fn take(&mut self, byte: u8) -> u16 {
        let at = self.at;
        self.at = at.saturating_add(1);
        self.check_in(byte);
        if let Some(place) = self.head.get_mut(usize::from(at)) {
            *place = byte;
        }
        at
    }

    /// Number of bytes so far.
    pub(crate) const fn len(&self) -> u16 {
        self.at
    }

    /// DA, SA, TYPE and STATUS as received, once four bytes are there.
    pub(crate) const fn head(&self) -> [u8; 4] {
        self.head
    }

    pub(crate) const fn source(&self) -> u8 {
        let [_, source, ..] = self.head;
        source
    }

    pub(crate) const fn status(&self) -> Status {
        let [.., status] = self.head;
        Status::from_bits_retain(status)
    }

    /// Whether a device rewrites a frame with this DA and TYPE. Known once the third byte has come.
    pub(crate) const fn is_for_all(&self, frame_type: FrameType) -> bool {
        let [da, _, code, _] = self.head;
        da == MULTICAST && code == frame_type.code()
    }

    /// Whether the last four bytes are the FCS of the bytes before them.
    #[inline]
    pub(crate) const fn is_whole(&self) -> bool {
        self.received.is_whole()
    }

    /// The checks of [`LongFrame::parse`](crate::frame::LongFrame::parse), made by the same function.
    pub(crate) fn check(&self) -> Result<FrameType, Error> {
        let want = if self.is_whole() { self.trailer } else { self.received.before(self.trailer) };
        check(self.at.into(), self.head, self.trailer, want)
    }
}
