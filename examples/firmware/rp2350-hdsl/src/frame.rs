//! H-frames as the player takes them: a pair of DI and DE for each of the eight samples of a bit, two bits per word.
//!
//! ```text
//!  bit 0      26 27        99 100     102        108
//!      | head |  | window  |   TRAILER |          | 24 or 12 blocks of STUFFING
//!      driven  released for the answer  driven
//! ```
//!
//! A frame without an answer is driven from its first bit to its last.

use core::sync::atomic::{AtomicU32, Ordering};

use hdsl::frame::{FILLER, H_FRAME_BITS, Head, STUFFING_BITS, Stuffing, Tail, Trailer};

/// A frame while the link starts: what is sent next depends on the answer, so there is time for it. 26.88 us.
pub const STARTING: Length = Length::with_stuffing(24);
/// A frame of a running link, whose next head is known before the answer comes. 19.2 us, 52,083 positions a second.
pub const RUNNING: Length = Length::with_stuffing(12);

/// Words of the longest frame.
const WORDS: usize = STARTING.bits as usize / 2;

/// How long an H-frame is.
#[derive(Clone, Copy)]
pub struct Length {
    /// Even, because a word holds two bits; divisible by three, because that makes a whole number of nanoseconds.
    pub bits: u32,
}

impl Length {
    const fn with_stuffing(blocks: u32) -> Self {
        assert!(blocks <= Stuffing::MAX.get() as u32 && blocks % 2 == 0);
        Self { bits: H_FRAME_BITS + blocks * STUFFING_BITS }
    }

    /// The blocks of stuffing in it.
    pub const fn stuffing(self) -> Stuffing {
        Stuffing::new(((self.bits - H_FRAME_BITS) / STUFFING_BITS) as u8).expect("it was made of them")
    }

    /// In nanoseconds.
    pub const fn ns(self) -> u64 {
        self.bits as u64 * 320 / 3
    }
}

/// A frame in memory, from which DMA plays it. Everything except its head stays as it was drawn.
pub struct Frame([AtomicU32; WORDS]);

impl Frame {
    /// Creates a frame with nothing driven.
    pub const fn new() -> Self {
        Self([const { AtomicU32::new(0) }; WORDS])
    }

    /// Draws everything after the head, to the end of the longest frame.
    pub fn paint(&self, answered: bool) {
        let tail = |trailer| Tail { trailer, stuffing: Stuffing::MAX }.bits().map(Some);
        let released = core::iter::repeat_n(None, FILLER.len() as usize);
        let filler = (0..FILLER.len()).map(|at| FILLER.get(at));
        if answered {
            // The first two bits of TRAILER are left to the idle line.
            self.bits(released.chain([None, None]).chain(tail(Trailer::AfterAnswer)));
        } else {
            self.bits(filler.chain(tail(Trailer::Whole)));
        }
    }

    /// Bits after the head; `None`: released.
    fn bits(&self, mut bits: impl Iterator<Item = Option<bool>>) {
        let half = |bit: Option<bool>| match bit {
            None => 0,
            Some(false) => ZERO,
            Some(true) => ONE,
        };
        for word in &self.0[Head::BITS as usize / 2..] {
            let first = half(bits.next().flatten());
            word.store(first | half(bits.next().flatten()) << 16, Ordering::Relaxed);
        }
    }

    /// Writes the head.
    #[inline]
    pub fn set_head(&self, head: Head) {
        let bits = head.bits().bits() as u32;
        for (at, word) in self.0[..Head::BITS as usize / 2].iter().enumerate() {
            word.store(PAIRS[(bits >> (2 * at) & 3) as usize], Ordering::Relaxed);
        }
    }

    /// Where DMA finds it.
    pub fn address(&self) -> u32 {
        self.0.as_ptr() as u32
    }
}

/// A bit that is driven: eight pairs of DE and DI.
const ZERO: u32 = 0xaaaa;
const ONE: u32 = 0xffff;

/// Two bits, the first of them in bit 0.
static PAIRS: [u32; 4] = [ZERO | ZERO << 16, ONE | ZERO << 16, ZERO | ONE << 16, ONE | ONE << 16];
