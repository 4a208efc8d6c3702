//! Cuts the lines or records of a log into blocks: their size, the order of their bytes, and where they begin.

use std::collections::HashMap;

use rtex_block::inspect::{LogShape, ShapeDoubt};
use rtex_block::{BlockSize, LEN, LEN32};

use crate::capture::hexlog::Burst;

/// Number of blocks after which the shape is checked again.
const WINDOW: usize = 64;
/// Number of bytes from which size and byte order are recognised.
const SAMPLE: usize = WINDOW * LEN32;

/// Collects the bytes of a log into blocks.
pub(super) struct Blocks {
    /// The size given by the user.
    said: Option<usize>,
    shape: Option<LogShape>,
    /// Two shapes of which either may be the right one; blocks are cut in the first.
    doubt: Option<(LogShape, LogShape)>,
    /// Nothing tells the shape from its twin yet, but that the log begins with a block in it.
    leaning: bool,
    size: usize,
    /// Bytes of most lines or records.
    line: usize,
    /// Blocks continue from one line to the next, because the lines do not hold whole blocks.
    flow: bool,
    /// Bytes still to be skipped before the first block.
    skip: usize,
    /// The bytes read but not cut yet, from `at` onwards, and the line in which the present block begins.
    rest: Vec<u8>,
    at: usize,
    began: Burst,
    /// Whether part of the present block is lost.
    lost: bool,
    /// The last blocks as they were read, and how many of them no drive or master would write, or are NOPs.
    window: Vec<u8>,
    seen: usize,
    unsound: usize,
    /// The first of them from which on they may have another shape.
    from: Option<usize>,
}

/// What the last blocks say about the shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Check {
    /// There are too few of them, or they say nothing.
    Nothing,
    /// It still holds.
    Holds,
    /// The log continues in another one.
    Changes(LogShape),
}

/// A block as it is in the log, with the line in which it begins.
pub(super) type Piece = Burst;

impl Blocks {
    pub(super) fn new(said: Option<usize>) -> Self {
        Self {
            said,
            shape: None,
            doubt: None,
            leaning: false,
            size: said.unwrap_or(LEN),
            line: 0,
            flow: false,
            skip: 0,
            rest: Vec::new(),
            at: 0,
            began: Burst::new(0, Vec::new()),
            lost: false,
            window: Vec::new(),
            seen: 0,
            unsound: 0,
            from: None,
        }
    }

    /// Returns the shape that was found, and the size in use.
    pub(super) fn shape(&self) -> (Option<LogShape>, usize) {
        (self.shape, self.size)
    }

    /// Returns the two shapes of which nothing tells which is the right one.
    pub(super) fn doubt(&self) -> Option<(LogShape, LogShape)> {
        self.doubt
    }

    /// Returns the length of a line or record, if most have the same.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Returns whether the end of these lines says what shape they have.
    pub(super) fn tells(lines: &[Burst]) -> bool {
        let bytes: Vec<u8> = lines.iter().flat_map(|burst| &burst.bytes).copied().collect();
        let end = bytes.rchunks(SAMPLE).next().unwrap_or_default();
        LogShape::guess(end).is_ok_and(|shape| !leans(shape) || certain(end).is_some())
    }

    /// Returns whether the log ends inside a block.
    pub(super) fn is_open(&self) -> bool {
        self.flow && self.rest.len() > self.at && self.skip == 0
    }

    /// Finds the shape in this piece of the log, from its beginning.
    pub(super) fn look_at(&mut self, sample: &[Burst]) {
        let read = || sample.iter().filter(|burst| burst.spoilt.is_none()).map(|burst| &burst.bytes);
        self.line = most_common(read().map(Vec::len));
        // The content of a line that is damaged, or too short or long, does not matter, but its place does.
        let line = vec![0; self.line];
        let is_whole = |burst: &Burst| burst.spoilt.is_none() && burst.bytes.len() == line.len();
        let lines = sample.iter().map(|burst| if is_whole(burst) { &burst.bytes } else { &line });
        let bytes: Vec<u8> = lines.flatten().copied().collect();
        // The first piece that says something counts. NOPs from before the start do not; what comes after them may begin at the end
        // of a piece, and then it is in the middle of another.
        let later = bytes.get(SAMPLE / 2..).unwrap_or_default();
        let pieces = || bytes.chunks(SAMPLE).chain(later.chunks(SAMPLE));
        let guesses = || pieces().map(LogShape::guess);
        let known = guesses().find_map(Result::ok);
        // A shape that is only preferred gives way to what a later piece is certain of.
        let sure = known.filter(|known| leans(*known)).and_then(|known| pieces().find_map(|piece| twin(piece, known)));
        self.leaning = known.is_some_and(leans) && sure.is_none();
        let known = sure.or(known);
        let either = |guess| match guess {
            Err(ShapeDoubt::Either(a, b)) => Some((a, b)),
            _ => None,
        };
        self.doubt = if known.is_none() { guesses().find_map(either) } else { None };
        let shape = known.or(self.doubt.map(|(shape, _)| shape));
        self.take(shape, shape.map_or(0, |shape| shape.skip));
        let halves = self.size == LEN32 && !line.is_empty() && read().all(|it| it.len() == LEN);
        self.flow |= halves;
    }

    /// Cuts blocks of this shape from now on, after skipping this many bytes.
    fn take(&mut self, shape: Option<LogShape>, skip: usize) {
        // Lines or records of one block give the size; it is guessed only if the lines allow both sizes.
        let guessed = shape.map_or(LEN, |shape| shape.size.bytes());
        self.size = self.said.unwrap_or(guessed).max(1);
        (self.shape, self.skip) = (shape, skip);
        self.flow = shape.is_some_and(|shape| shape.skip > 0) || self.line % self.size != 0 && shape.is_some();
    }

    /// Takes a line or record; a line of another length is returned as it is, and its block is lost.
    pub(super) fn feed(&mut self, burst: &Burst) -> Option<Piece> {
        if !self.flow {
            (self.rest, self.at, self.began) = (burst.bytes.clone(), 0, burst.clone());
            return None;
        }
        if burst.bytes.len() != self.line {
            self.lose();
            return Some(burst.clone());
        }
        if self.at >= self.rest.len() {
            self.began = burst.clone();
        }
        self.rest.drain(..self.at);
        self.at = 0;
        self.rest.extend_from_slice(&burst.bytes);
        None
    }

    /// Drops a line, and with it the block that it is part of.
    pub(super) fn lose(&mut self) {
        if !self.flow {
            return;
        }
        self.rest.drain(..self.at);
        self.rest.resize(self.rest.len() + self.line, 0);
        self.at = self.skip.min(self.rest.len());
        self.skip -= self.at;
        self.at += (self.rest.len() - self.at) / self.size * self.size;
        self.lost = self.at < self.rest.len();
    }

    /// Returns the next block of the bytes fed, from `line` onwards; in a log whose lines hold whole blocks, also the rest
    /// of one.
    pub(super) fn next(&mut self, line: &Burst) -> Option<Piece> {
        loop {
            let skipped = self.skip.min(self.rest.len() - self.at);
            self.skip -= skipped;
            self.at += skipped;
            let left = self.rest.len() - self.at;
            if left == 0 || self.flow && left < self.size {
                return None;
            }
            let end = self.at + left.min(self.size);
            let bytes = self.rest.get(self.at..end).unwrap_or_default().to_vec();
            self.at = end;
            let piece = Piece { bytes, ..std::mem::replace(&mut self.began, line.clone()) };
            if !std::mem::take(&mut self.lost) {
                return Some(piece);
            }
        }
    }

    /// Returns the bytes of a piece in the order of a block.
    pub(super) fn in_order(&self, bytes: &[u8]) -> Vec<u8> {
        let word = self.shape.map_or(1, |shape| shape.word);
        bytes.chunks(word).flat_map(|word| word.iter().rev()).copied().collect()
    }

    /// Checks whether the shape still holds after one more block as it was read; `sound`: an encoder may write it and it
    /// says something. If the last blocks have another shape, the log continues in that.
    pub(super) fn goes_on(&mut self, read: &[u8], sound: bool) -> Check {
        if !sound && self.from.is_none() {
            self.from = Some(self.window.len());
        }
        self.window.extend_from_slice(read);
        // A block that was cut short does not shift the following ones.
        self.window.resize(self.window.len().next_multiple_of(self.size), 0);
        self.seen += 1;
        self.unsound += usize::from(!sound);
        if self.seen < WINDOW {
            return Check::Nothing;
        }
        let (window, unsound) = (std::mem::take(&mut self.window), std::mem::take(&mut self.unsound));
        (self.seen, self.from) = (0, None);
        let now = self.now();
        let doubts = self.doubt.is_some();
        if self.said.is_some() || unsound == 0 && !doubts && !self.leaning {
            return Check::Holds;
        }
        let sure = certain(&window);
        self.leaning &= sure != Some(now);
        // While the shape is not known, neither is whether the window begins with a block.
        let guess = if doubts { sure } else { LogShape::guess(&window).ok() };
        let Some(other) = guess.filter(|other| *other != now || doubts) else {
            return if guess == Some(now) { Check::Holds } else { Check::Nothing };
        };
        self.doubt = None;
        self.leaning = leans(other) && sure != Some(other);
        let flow = self.flow;
        // The window begins with a block of the old shape, and its blocks fill it; the next bytes continue like its first ones.
        self.take(Some(other), other.skip);
        self.flow |= flow;
        Check::Changes(other)
    }

    /// Returns how many blocks at the end of the log have another shape, and which, if too few came to change it.
    pub(super) fn last(&self) -> Option<(usize, LogShape)> {
        let last = self.window.get(self.from.filter(|_| self.said.is_none() && self.doubt.is_none())?..)?;
        let other = LogShape::guess(last).ok().filter(|other| *other != self.now())?;
        Some((last.len() / self.size, other))
    }

    /// The shape of the next bytes, which begin with a block.
    fn now(&self) -> LogShape {
        LogShape { skip: 0, ..self.shape.unwrap_or(LogShape { size: BlockSize::Bytes16, word: 1, skip: 0 }) }
    }
}

/// Returns whether a shape may have been preferred to its twin because the log begins with a block in it.
fn leans(shape: LogShape) -> bool {
    shape.skip == 0 && shape.word > 1
}

/// Returns the shape that a piece has even if it is not known to begin with a block. Both twins begin later in what is after its first
/// four bytes, so neither is preferred.
fn certain(piece: &[u8]) -> Option<LogShape> {
    let shape = LogShape::guess(piece.get(4..)?).ok()?;
    Some(LogShape { skip: (shape.skip + 4) % shape.size.bytes(), ..shape })
}

/// Returns the shape that a piece certainly has, if it is this one or its twin.
fn twin(piece: &[u8], known: LogShape) -> Option<LogShape> {
    let begins = if known.word == 2 { known.size.bytes() - 2 } else { 2 };
    let other = LogShape { word: 6 - known.word, skip: begins, ..known };
    certain(piece).filter(|shape| *shape == known || *shape == other)
}

/// Returns the length that most lines have; if there are several, the longest.
fn most_common(lengths: impl Iterator<Item = usize>) -> usize {
    let mut counts = HashMap::new();
    lengths.for_each(|len| *counts.entry(len).or_insert(0_usize) += 1);
    counts.into_iter().max_by_key(|(len, count)| (*count, *len)).map_or(0, |(len, _)| len)
}
