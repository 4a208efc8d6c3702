//! Messages for the state machine: the bits of the line as samples.

use hdsl::Window;
use hdsl::frame::{FILLER, Stuffing, Tail, Trailer};
use hdsl::sampling::WINDOW;

use crate::program::{HELD, SAMPLES_PER_BIT};

/// Blocks of stuffing between two frames: 13 us in which the next head is worked out. With them an H-frame lasts
/// 26 + 1 + 72 + 3 + 6 + 126 bits or 25 us.
pub const STUFFING: u8 = 21;
/// Words of samples of an answer.
pub const SAMPLE_WORDS: usize = WINDOW / 4;
/// Words of the longest message: the whole TRAILER and the stuffing.
pub const WORDS: usize = 1 + 34 + 1;

const _: () = assert!(WINDOW % 4 == 0);

/// A message: how many samples, the samples, and how many to take afterwards.
#[derive(Clone, Copy)]
pub struct Message {
    pub words: [u32; WORDS],
    pub len: usize,
}

impl Message {
    /// These bits; what does not fit is left out. `listen`: an answer is taken afterwards.
    fn new(bits: impl Iterator<Item = bool>, listen: bool) -> Self {
        let mut words = [0; WORDS];
        let mut count = 0_u32;
        for (at, bit) in bits.take((WORDS - 2) * 4).enumerate() {
            words[1 + at / 4] |= if bit { 0xff << (at % 4 * 8) } else { 0 };
            count += 1;
        }
        words[0] = (count * SAMPLES_PER_BIT).saturating_sub(HELD + 1);
        let len = 2 + count.div_ceil(4) as usize;
        words[len - 1] = if listen { WINDOW as u32 * SAMPLES_PER_BIT - 1 } else { 0 };
        Self { words, len }
    }

    /// The end of a frame with or without an answer.
    pub fn tail(answered: bool) -> Self {
        let trailer = if answered { Trailer::AfterAnswer } else { Trailer::Whole };
        let stuffing = Stuffing::new(STUFFING).unwrap_or(Stuffing::MIN);
        Self::new(Tail { trailer, stuffing }.bits(), false)
    }

    /// The head of a frame; where nobody answers, FILLER too.
    pub fn head(head: Window, answered: bool) -> Self {
        let bits = |window: Window| (0..window.len()).map(move |at| window.get(at).unwrap_or(false));
        let filler = if answered { Window::EMPTY } else { FILLER };
        Self::new(bits(head).chain(bits(filler)), answered)
    }
}
