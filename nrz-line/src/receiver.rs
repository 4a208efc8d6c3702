use crate::{Format, Samples};

/// One field as received from the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Field {
    /// The 8 or 16 content bits, the first on the line in bit 0.
    pub content: u16,
    /// Whether the delimiter read 1. A field with `delimiter: false` is a framing error: nothing in it can be trusted.
    pub delimiter: bool,
    /// Index of the first low sample of the start bit, counted from the receiver's first sample.
    pub start: u64,
    /// Start bits that were dropped since the previous field because their middle read 1.
    pub spikes: u32,
}

/// Start-stop reception of a sampled line, with the clock recovered from every edge.
///
/// A falling edge on an idle line starts a field. A counter of N samples restarts at *every* edge, and a bit is sampled when
/// it reaches N / 2. A start bit that reads 1 at that point was a spike and is dropped; a delimiter that reads 0 is a
/// framing error. After the delimiter the receiver looks for the next falling edge, so fields may follow each other with or
/// without a pause.
///
/// The line may be fed sample by sample ([`push`](Self::push)), as runs of equal samples ([`run`](Self::run)) or
/// as packed words ([`feed`](Self::feed)); the results are identical, and the three may be mixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Receiver {
    format: Format,
    /// Level of the last sample: 0 or 1.
    level: u32,
    /// The content bits taken so far, shifted in from the top after a mark that reaches bit 0 when only the delimiter is left;
    /// or [`IDLE`], or [`START`].
    bits: u32,
    /// Number of samples until the middle of the next bit, 1 or more; on an idle line, until the origin is moved next.
    left: u32,
    /// Index of the sample after that middle, counted from the origin.
    next: u32,
    /// Index of a recent sample, so that everything else is counted in 32 bits.
    origin: u64,
    /// Index of the first low sample of the start bit.
    start: u64,
    spikes: u32,
}

/// The [bits](Receiver::bits) while no field is on the line. It is odd, like [`START`] and like complete content with its mark,
/// so a single test detects everything that is not an ordinary bit. Bits 1 and 2 are 0 in complete content.
const IDLE: u32 = 0b101;

/// The [bits](Receiver::bits) before the middle of the start bit.
const START: u32 = 0b011;

/// Number of samples after which the origin is moved on an idle line.
const LONG: u32 = 0x4000_0000;

/// Number of samples after which the origin is moved if a field does not end, for example on a line that carries something
/// else.
const NEAR: u32 = 0x7fff_ffff;

impl Receiver {
    /// Creates a receiver on an idle (high) line.
    pub const fn new(format: Format) -> Self {
        Self { format, level: 1, bits: IDLE, left: LONG, next: LONG, origin: 0, start: 0, spikes: 0 }
    }

    /// The format it was created for.
    pub const fn format(&self) -> Format {
        self.format
    }

    /// Number of samples taken so far, which is the index of the next one.
    pub const fn position(&self) -> u64 {
        self.origin.wrapping_add(self.here() as u64)
    }

    /// Returns whether a field has begun and not ended; at the end of a capture, whether the last field was cut off.
    pub const fn is_receiving(&self) -> bool {
        self.bits != IDLE
    }

    /// Takes one sample; returns a field when its delimiter has been sampled.
    #[inline]
    pub const fn push(&mut self, sample: bool) -> Option<Field> {
        if sample as u32 != self.level {
            self.edge(sample as u32);
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 { self.take() } else { None }
    }

    /// Takes `len` samples of the same level at once: the stretch between two edges of a capture, or a part of it.
    ///
    /// At most one field ends in a run, because every field contains both levels.
    #[inline]
    pub const fn run(&mut self, level: bool, len: u64) -> Option<Field> {
        if len == 0 {
            return None;
        }
        if level as u32 != self.level {
            self.edge(level as u32);
        }
        let mut rest = len;
        let mut field = None;
        while rest >= self.left as u64 {
            if !self.is_receiving() {
                self.origin = self.origin.wrapping_add(rest);
                return field;
            }
            rest = rest.wrapping_sub(self.left as u64);
            field = self.take();
        }
        self.left = self.left.wrapping_sub((rest & 0xffff_ffff) as u32);
        field
    }

    /// Takes samples from the front of `samples` until a field is complete or none are left.
    ///
    /// ```
    /// use nrz_line::{Format, Receiver, Samples};
    /// # use nrz_line::FormatError;
    /// # fn main() -> Result<(), FormatError> {
    /// let mut receiver = Receiver::new(Format::new(4, 8)?);
    /// // idle, start, 0x0f LSB first, delimiter: four samples each
    /// let mut samples = Samples::partial(0xf_0000_ffff_0fff, 52);
    /// let mut got = None;
    /// while let Some(field) = receiver.feed(&mut samples) {
    ///     got = Some((field.start, field.content, field.delimiter));
    /// }
    /// assert_eq!(got, Some((12, 0x0f, true)));
    /// # Ok(())
    /// # }
    /// ```
    // Inlined, so that the state stays in registers from word to word.
    #[inline(always)]
    pub const fn feed(&mut self, samples: &mut Samples) -> Option<Field> {
        while !samples.is_empty() {
            let (word, len) = samples.front();
            samples.skip(self.scan(word, len));
            if self.left == 0 {
                let field = self.end();
                if field.is_some() {
                    return field;
                }
            }
        }
        None
    }

    /// Takes up to `len` samples of `word`, from bit 0 upwards. It stops at the middle of anything but an ordinary bit, where
    /// `left` is 0. Returns how many it took.
    #[inline]
    const fn scan(&mut self, word: u32, len: u32) -> u32 {
        let (half, period) = (self.format.middle(), self.format.samples_per_bit());
        // Bit k: sample k differs from the one before. After the last sample there are none.
        let mut edges = word ^ (word << 1 | self.level);
        let mut level = self.level << 31;
        let mut bits = self.bits;
        // The index of the first sample from the origin, and of the middle in the word.
        let (first, mut middle);
        if bits == IDLE {
            let falls = edges & !word;
            if falls == 0 {
                self.level |= (edges != 0) as u32;
                self.origin = self.origin.wrapping_add(len as u64);
                return len;
            }
            let edge = falls.trailing_zeros();
            edges &= (u32::MAX << 1).wrapping_shl(edge);
            self.origin = self.origin.wrapping_add(self.here() as u64).wrapping_add(edge as u64);
            self.start = self.origin;
            first = edge.wrapping_neg();
            level = 0;
            middle = edge.wrapping_add(half);
            bits = START;
            if middle < len && middle < edges.trailing_zeros() {
                bits = self.format.mark();
                middle = middle.wrapping_add(period);
            }
        } else {
            self.move_origin();
            first = 0;
            middle = self.left.wrapping_sub(1);
        }
        let end = 'line: {
            while edges != 0 {
                let edge = edges.trailing_zeros();
                while middle < edge {
                    if bits & 1 != 0 {
                        break 'line middle.wrapping_add(1);
                    }
                    bits = bits >> 1 | level;
                    middle = middle.wrapping_add(period);
                }
                edges &= edges.wrapping_sub(1);
                middle = edge.wrapping_add(half);
                level ^= 1 << 31;
            }
            while middle < len {
                if bits & 1 != 0 {
                    break 'line middle.wrapping_add(1);
                }
                bits = bits >> 1 | level;
                middle = middle.wrapping_add(period);
            }
            len
        };
        self.level = level >> 31;
        self.bits = bits;
        self.next = first.wrapping_add(middle).wrapping_add(1);
        self.left = middle.wrapping_add(1).wrapping_sub(end);
        end
    }

    /// Index of the next sample, counted from the origin.
    const fn here(&self) -> u32 {
        self.next.wrapping_sub(self.left)
    }

    /// Handles a change of level at the next sample: a field begins, or the clock restarts.
    #[inline]
    const fn edge(&mut self, level: u32) {
        self.level = level;
        if self.bits == IDLE {
            if level != 0 {
                return;
            }
            self.bits = START;
            self.move_origin();
            self.start = self.origin;
        } else if self.here() > NEAR {
            self.move_origin();
        }
        let up_to_middle = self.format.middle().wrapping_add(1);
        self.next = self.here().wrapping_add(up_to_middle);
        self.left = up_to_middle;
    }

    /// The middle of a bit was reached; the sample there is taken with it.
    #[inline]
    const fn take(&mut self) -> Option<Field> {
        if self.bits & 1 == 1 {
            return self.end();
        }
        self.bits = self.bits >> 1 | self.level << 31;
        self.left = self.format.samples_per_bit();
        self.next = self.next.wrapping_add(self.left);
        None
    }

    /// The middle of a delimiter or of a spike was reached, or the line was idle for a long time.
    #[inline]
    const fn end(&mut self) -> Option<Field> {
        let bits = self.bits;
        if bits == START && self.level == 0 {
            self.bits = self.format.mark();
            self.left = self.format.samples_per_bit();
            self.next = self.next.wrapping_add(self.left);
            return None;
        }
        self.bits = IDLE;
        self.origin = self.origin.wrapping_add(self.next as u64);
        self.next = LONG;
        self.left = LONG;
        if bits == IDLE {
            return None;
        }
        if bits == START {
            self.spikes = self.spikes.saturating_add(1);
            return None;
        }
        let content = bits.wrapping_shr(32_u32.wrapping_sub(self.format.content_bits()));
        let (content, delimiter) = ((content & 0xffff) as u16, self.level != 0);
        let spikes = core::mem::replace(&mut self.spikes, 0);
        Some(Field { content, delimiter, start: self.start, spikes })
    }

    /// Starts counting at the next sample.
    #[inline]
    const fn move_origin(&mut self) {
        let here = self.here();
        self.origin = self.origin.wrapping_add(here as u64);
        self.next = self.left;
    }
}

#[cfg(test)]
mod tests;
