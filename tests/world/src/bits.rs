use std::fmt;

/// Bits in the order of the line.
#[derive(Clone, PartialEq, Eq, Hash, Default)]
pub struct Bits {
    bytes: Vec<u8>,
    len: usize,
}

impl Bits {
    /// No bits.
    pub const fn new() -> Self {
        Self { bytes: Vec::new(), len: 0 }
    }

    /// All bits of a block, the first of the line in bit 0 of byte 0.
    pub fn of_block(bytes: &[u8]) -> Self {
        Self { bytes: bytes.to_vec(), len: bytes.len() * 8 }
    }

    /// A start bit 0, the low `width` bits of `content` from bit 0 on, and a stop bit 1.
    pub fn start_stop(content: u64, width: u32) -> Self {
        let mut bits = Self::new();
        bits.push(false);
        (0..width).for_each(|k| bits.push(content >> k & 1 == 1));
        bits.push(true);
        bits
    }

    /// How many.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bit `at`; an idle line, which is 1, after the end.
    pub fn get(&self, at: usize) -> bool {
        at >= self.len || self.bytes[at / 8] >> (at % 8) & 1 == 1
    }

    /// Appends a bit.
    pub fn push(&mut self, bit: bool) {
        if self.len % 8 == 0 {
            self.bytes.push(0);
        }
        self.bytes[self.len / 8] |= u8::from(bit) << (self.len % 8);
        self.len += 1;
    }

    /// Appends `count` ones.
    pub fn idle(&mut self, count: usize) {
        (0..count).for_each(|_| self.push(true));
    }

    /// Appends others.
    pub fn extend(&mut self, other: &Self) {
        (0..other.len).for_each(|k| self.push(other.get(k)));
    }

    /// Turns bit `at % len` round.
    pub fn flip(&mut self, at: usize) {
        if self.len > 0 {
            let at = at % self.len;
            self.bytes[at / 8] ^= 1 << (at % 8);
        }
    }

    /// The `len` bits from `at` on, idle after the end.
    pub fn slice(&self, at: usize, len: usize) -> Self {
        let mut bits = Self::new();
        (at..at + len).for_each(|k| bits.push(self.get(k)));
        bits
    }

    /// Cuts all bits from `len` on.
    pub fn truncate(&mut self, len: usize) {
        *self = self.slice(0, len.min(self.len));
    }

    /// What a start-stop receiver makes of a unit: the bits between the first and the last, and whether the last, the
    /// stop bit, is 1. For a byte of a UART this is the byte and "no framing error".
    pub fn content(&self) -> (u64, bool) {
        let inner = (1..self.len.saturating_sub(1)).fold(0, |sum, k| sum | u64::from(self.get(k)) << ((k - 1) % 64));
        (inner, self.len > 0 && self.get(self.len - 1))
    }

    /// The bits as bytes, the first of the line in bit 0 of byte 0: what [`Self::of_block`] was given.
    pub fn block(&self) -> &[u8] {
        &self.bytes
    }
}

impl fmt::Debug for Bits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (0..self.len.min(64)).try_for_each(|k| write!(f, "{}", u8::from(self.get(k))))?;
        if self.len > 64 { write!(f, "... {} bits", self.len) } else { Ok(()) }
    }
}

/// How receivers find units on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Framing {
    /// A start bit 0, `width` bits, a stop bit 1; found by the falling edge, as a UART or a frame receiver does. A damaged
    /// start or stop bit makes it find other units than were sent.
    StartStop {
        /// Bits between start and stop: 8 for a UART, 16 for a frame of 18 bits.
        width: u32,
    },
    /// Whole blocks of any length, found by other means: they arrive where they were sent, or not at all.
    Block,
}

/// What a speaker sends in one go.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Message {
    pub(crate) units: Vec<Bits>,
    pub(crate) gap_bits: usize,
    pub(crate) tag: Option<u64>,
}

impl Message {
    /// These units back to back.
    pub fn new(units: Vec<Bits>) -> Self {
        Self { units, ..Self::default() }
    }

    /// Bytes as a UART sends them: 8 bits, no parity, one stop bit.
    pub fn bytes(bytes: &[u8]) -> Self {
        Self::frames(8, bytes.iter().map(|byte| u64::from(*byte)))
    }

    /// Frames of `width` bits between start and stop bit.
    pub fn frames(width: u32, contents: impl IntoIterator<Item = u64>) -> Self {
        Self::new(contents.into_iter().map(|content| Bits::start_stop(content, width)).collect())
    }

    /// One block as a single unit.
    pub fn block(bytes: &[u8]) -> Self {
        Self::new(vec![Bits::of_block(bytes)])
    }

    /// The same with `bits` idle bits between two units.
    #[must_use]
    pub const fn with_gap_bits(mut self, bits: usize) -> Self {
        self.gap_bits = bits;
        self
    }

    /// The same with the value that it carries. Give each answer a value of its own, for example a position that moves with
    /// every request; then [`Truth::verdict`](crate::Truth::verdict) knows which answer a master believed.
    #[must_use]
    pub const fn tagged(mut self, value: u64) -> Self {
        self.tag = Some(value);
        self
    }
}
