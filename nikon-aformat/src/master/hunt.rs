use super::Line;
use crate::error::Error;
use crate::expected::{Expected, SYNC_CODE};
use crate::frame::truncated;
use crate::layout::FRAME_BITS;
use crate::number::EncoderAddress;
use crate::raw_response::RawResponse;
use crate::response::Response;

/// Finds responses among the frames that arrive.
///
/// It keeps the last received frames, as many as a response has. They are taken as a response if they pass all checks and cannot
/// have begun before the request had left the line; otherwise the oldest one is dropped. So a good response is found whatever
/// came before it: the master's own request, an older answer, noise, the rest of a damaged response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Hunt {
    /// End of the request.
    from_ns: u64,
    contents: [u16; RawResponse::MAX_FRAMES],
    /// The earliest time at which each frame began.
    begun_ns: [u64; RawResponse::MAX_FRAMES],
    got: usize,
    /// End of the last frame, by its time stamp.
    end_ns: u64,
    /// How many of the oldest frames belong to a valid response of this encoder that was already reported.
    given: usize,
    giver: EncoderAddress,
}

/// The result of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Found {
    /// A response, or why something that began like one was refused.
    pub(super) outcome: Result<Response, Error>,
    /// Its first start bit, by the time stamps.
    pub(super) began_ns: u64,
    /// Its last delimiter, by the time stamps.
    pub(super) end_ns: u64,
    /// It begins inside a response of this encoder that was already reported, and nothing began after that response: the
    /// earlier one had lost frames, and its CRC-8 was right by chance.
    pub(super) instead_of: Option<EncoderAddress>,
}

/// Frames that are handed over together; `None` for a frame whose delimiter read 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) frames: &'a [Option<u16>],
    pub(super) since_ns: u64,
    pub(super) end_ns: u64,
}

impl Hunt {
    /// Creates a hunt in which anything that began before `from_ns` is not taken as an answer.
    pub(super) const fn new(from_ns: u64) -> Self {
        Self {
            from_ns,
            contents: [0; RawResponse::MAX_FRAMES],
            begun_ns: [0; RawResponse::MAX_FRAMES],
            got: 0,
            end_ns: 0,
            given: 0,
            giver: EncoderAddress::ZERO,
        }
    }

    /// Takes the frames of a block.
    pub(super) fn take(&mut self, line: &Line, expected: &Expected, block: Block<'_>, mut found: impl FnMut(Found)) {
        let count = block.frames.len();
        let times = Times { line, block, count };
        if self.got != 0 && times.earliest_start(expected).saturating_sub(self.end_ns) > line.pause_ns() {
            self.cut(expected, &mut found);
        }
        for (at, frame) in block.frames.iter().enumerate() {
            self.end_ns = times.end(at);
            let Some(content) = *frame else {
                self.broken(expected, &times, at, &mut found);
                continue;
            };
            // Frame by frame, what is after a response comes only now. If that begins one, nothing was lost.
            if self.given != 0 && self.given == self.got && expected.differs_first(content) == 0 {
                self.clear();
            }
            self.push(content, times.begun(at));
            if self.got >= usize::from(expected.layout().frames()) {
                self.judge(expected, &times, at, &mut found);
            }
        }
        // What is left stands at the end of the block, so its times are known.
        let len = self.got.min(count);
        let first = self.got.saturating_sub(len);
        for (place, left) in self.begun_ns.iter_mut().take(self.got).skip(first).zip((0..len).rev()) {
            *place = (*place).max(times.begun_of_tail(left));
        }
    }

    /// Ends the search when the time has run out: reports the fault of a response that had begun.
    pub(super) fn finish(&mut self, expected: &Expected, mut found: impl FnMut(Found)) {
        self.cut(expected, &mut found);
    }

    fn push(&mut self, content: u16, begun_ns: u64) {
        if let (Some(to), Some(begun)) = (self.contents.get_mut(self.got), self.begun_ns.get_mut(self.got)) {
            (*to, *begun) = (content, begun_ns);
            self.got = self.got.saturating_add(1);
        }
    }

    /// Judges the frames once there are as many as a response has; the last of them has index `at` in its block.
    fn judge(&mut self, expected: &Expected, times: &Times<'_>, at: usize, found: &mut impl FnMut(Found)) {
        let [first, ..] = self.contents;
        let [begun_ns, ..] = self.begun_ns;
        let before = self.got.saturating_sub(1);
        let last_of_block = at.saturating_add(1) == times.count;
        let begun_ns = if last_of_block && before <= at { begun_ns.max(times.begun_of_tail(before)) } else { begun_ns };
        // Stamps are never early: if by that of the last frame the first began before the request was out, it did.
        let began_ns = self.end_ns.saturating_sub(times.line.rate.response_ns(expected.layout()).into());
        let fresh = begun_ns.min(began_ns) >= self.from_ns;
        if fresh && begins_a_response(first) && !self.is_overtaken(expected, times, at) {
            let raw = RawResponse::of(self.contents, expected.layout());
            let outcome = Response::parse(expected, &raw);
            let instead_of = (self.given != 0).then_some(self.giver);
            if outcome.is_ok() || instead_of.is_none() {
                found(Found { outcome, began_ns, end_ns: self.end_ns, instead_of });
            }
            if let Ok(response) = outcome {
                (self.given, self.giver) = (self.got, response.ea);
            }
        }
        self.drop_first();
    }

    /// Returns whether a sound response begins inside the frames at hand and continues in the block. If so, the first of these
    /// frames has lost those that followed it, and the CRC-8 is right by chance. This is not so if the next response begins
    /// right after the frames at hand, as on a line that lost nothing: then the inner one is a coincidence, which a shaft at
    /// rest repeats for ever.
    fn is_overtaken(&self, expected: &Expected, times: &Times<'_>, at: usize) -> bool {
        let next = at.saturating_add(1);
        let begins = |at: usize| {
            times.block.frames.get(at).is_none_or(|frame| frame.is_some_and(|first| expected.differs_first(first) == 0))
        };
        !begins(next)
            && (1..self.got).any(|lost| {
                let (Some(first), Some(more)) =
                    (self.contents.get(lost), times.block.frames.get(next..next.saturating_add(lost)))
                else {
                    return false;
                };
                if expected.differs_first(*first) != 0 || !begins(next.saturating_add(lost)) {
                    return false;
                }
                let mut contents = [0; RawResponse::MAX_FRAMES];
                let kept = self.contents.iter().take(self.got).skip(lost).copied();
                let frames = kept.chain(more.iter().map(|frame| frame.unwrap_or(0)));
                contents.iter_mut().zip(frames).for_each(|(to, from)| *to = from);
                RawResponse::of(contents, expected.layout()).is_sound()
            })
    }

    fn drop_first(&mut self) {
        let [_, c1, c2, c3, c4, c5] = self.contents;
        self.contents = [c1, c2, c3, c4, c5, 0];
        let [_, b1, b2, b3, b4, b5] = self.begun_ns;
        self.begun_ns = [b1, b2, b3, b4, b5, 0];
        self.got = self.got.saturating_sub(1);
        self.given = self.given.saturating_sub(1);
    }

    /// Handles a pause: a response that had begun is not continued.
    fn cut(&mut self, expected: &Expected, found: &mut impl FnMut(Found)) {
        self.forget_given();
        let ([first, ..], [begun_ns, ..]) = (self.contents, self.begun_ns);
        // Without frames it is 0, which begins no response.
        if begun_ns >= self.from_ns && begins_a_response(first) {
            let got = u32::try_from(self.got).unwrap_or(0).wrapping_mul(FRAME_BITS);
            let outcome = Err(truncated(got, expected.layout().line_bits()));
            found(Found { outcome, began_ns: begun_ns, end_ns: self.end_ns, instead_of: None });
        }
        self.clear();
    }

    /// Handles a delimiter that reads 0.
    fn broken(&mut self, expected: &Expected, times: &Times<'_>, at: usize, found: &mut impl FnMut(Found)) {
        self.forget_given();
        let last_of_block = at.saturating_add(1) == times.count;
        let begun_ns = if last_of_block { times.begun(at).max(times.begun_of_tail(0)) } else { times.begun(at) };
        if begun_ns >= self.from_ns {
            let most = expected.layout().frames().saturating_sub(1);
            let frame = u8::try_from(self.got).unwrap_or(most).min(most);
            let outcome = Err(Error::Delimiter { frame });
            found(Found { outcome, began_ns: begun_ns, end_ns: self.end_ns, instead_of: None });
        }
        self.clear();
    }

    /// Drops the response that was already reported, because nothing further belongs to it.
    fn forget_given(&mut self) {
        while self.given != 0 {
            self.drop_first();
        }
    }

    fn clear(&mut self) {
        (self.got, self.given) = (0, 0);
        self.contents = [0; RawResponse::MAX_FRAMES];
    }
}

/// Returns whether a frame has the sync code of a response. The frames of the master's own request, received as an echo,
/// have a different one.
const fn begins_a_response(content: u16) -> bool {
    content & 7 == SYNC_CODE as u16
}

/// What is known about the times of a block's frames.
struct Times<'a> {
    line: &'a Line,
    block: Block<'a>,
    count: usize,
}

impl Times<'_> {
    fn frames_ns(&self, frames: usize) -> u64 {
        u64::try_from(frames).unwrap_or(u64::MAX).saturating_mul(self.line.frame_ns())
    }

    /// The latest end of frame `at`.
    fn end(&self, at: usize) -> u64 {
        self.block.end_ns.saturating_sub(self.frames_ns(self.count.saturating_sub(at).saturating_sub(1)))
    }

    /// The earliest start of frame `at`, whatever pauses the block holds.
    fn begun(&self, at: usize) -> u64 {
        self.block.since_ns.saturating_add(self.frames_ns(at))
    }

    /// The earliest start of a frame with `left` frames between it and the end of the block, if these belong to the same
    /// response. Idle time between them is ignored: if they had begun that much earlier, they would have collided with the
    /// request.
    fn begun_of_tail(&self, left: usize) -> u64 {
        let frames = self.frames_ns(left.saturating_add(1));
        self.block.end_ns.saturating_sub(frames.saturating_add(self.line.early_ns()))
    }

    /// The earliest start of the first frame. If no other response begins in the block, its frames follow each other.
    fn earliest_start(&self, expected: &Expected) -> u64 {
        let begins = |frame: &Option<u16>| frame.is_some_and(|content| expected.differs_first(content) == 0);
        if self.block.frames.iter().skip(1).any(begins) {
            return self.block.since_ns;
        }
        self.block.since_ns.max(self.block.end_ns.saturating_sub(self.frames_ns(self.count)))
    }
}
