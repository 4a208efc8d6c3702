//! Reception of responses from a sampled line: oversampled, or as a plain bit stream at any bit offset.
//!
//! Every start bit is searched for separately and the clock is recovered from every edge, so a rate error accumulates only over
//! one frame of 18 bits. Over the 108 bits of six frames, one per cent would already amount to more than a bit.
//!
//! The frames of a response follow each other without idle bits, and five idle bits or more separate two responses. A frame that
//! begins one or more bits late has lost its start bit, and its response is refused.
//!
//! ```
//! use nikon_aformat::reception::LineReceiver;
//! use nikon_aformat::{BitOrder, Command, Expected, Layout, RawResponse, Response};
//! use nrz_line::Samples;
//!
//! // three idle bits, then the response to command 1 that a vendor's manual shows
//! let line = RawResponse::from_words(Layout::Abs24, &[0x3e03, 0x00ef, 0xdf35], BitOrder::MsbFirst)?.line();
//! let mut samples = Samples::partial((line.bits() << 3 | 0b111) as u64, line.len() + 3);
//!
//! let mut receiver = LineReceiver::bits(Layout::Abs24);
//! let raw = receiver.feed(&mut samples).expect("a response")?;
//! let response = Response::parse(&Expected::new(Layout::Abs24, Command::Abs24Low), &raw)?;
//! assert_eq!(response.abs(), Some(0xfb_f700));
//! # Ok::<(), nikon_aformat::Error>(())
//! ```

use nrz_line::{Field, Format, FormatError, Receiver, Samples};

use crate::error::Error;
use crate::frame::truncated;
use crate::layout::FRAME_BITS;
use crate::layout::Layout;
use crate::raw_response::RawResponse;

/// Receives a sampled piece of line that holds responses of one layout in succession.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineReceiver {
    receiver: Receiver,
    layout: Layout,
    /// Whether idle bits are allowed between the frames of a response.
    idle_allowed: bool,
    contents: [u16; RawResponse::MAX_FRAMES],
    got: u8,
    /// Index of the first sample after the last frame.
    end: u64,
    /// A frame was broken; the rest of its response is skipped.
    broken: bool,
}

/// One sample per bit.
const PLAIN_BITS: Format = match Format::new(1, 16) {
    Ok(format) => format,
    Err(_) => panic!(),
};

impl LineReceiver {
    /// Idle bits that separate two responses on a bus. The shortest gap that masters allow for is 7.5 bits.
    const BUS_GAP_BITS: u64 = 5;

    /// Creates a receiver for 4 to 80 samples per bit.
    ///
    /// The vendor's receivers use 4, 5, 6 or 8.
    ///
    /// # Errors
    /// [`FormatError`] for other numbers.
    pub const fn oversampled(samples_per_bit: u32, layout: Layout) -> Result<Self, FormatError> {
        match Format::new(samples_per_bit, 16) {
            Ok(format) => Ok(Self::of(format, layout)),
            Err(error) => Err(error),
        }
    }

    /// Creates a receiver for a plain bit stream, as a shift register packs it.
    pub const fn bits(layout: Layout) -> Self {
        Self::of(PLAIN_BITS, layout)
    }

    /// Accepts any gap between the frames of a response, for a line on which idle bits separate them.
    ///
    /// **One wrong bit can then lead to a wrong position**: if the start bit of a frame is lost, a later edge is mistaken for it,
    /// and one such frame in 256 at the end of a response passes the CRC-8. A response that lost a frame also swallows the first
    /// frame of the next one.
    ///
    /// ```
    /// use nikon_aformat::reception::LineReceiver;
    /// use nikon_aformat::{BitOrder, Error, Layout, RawResponse};
    /// let sent = RawResponse::from_words(Layout::Abs24, &[0x3e03, 0x00ef, 0xdf35], BitOrder::MsbFirst)?;
    /// let mut receiver =
    ///     LineReceiver::oversampled(4, Layout::Abs24).map_err(|_| Error::NotCarried)?.allowing_idle_between_frames();
    /// let mut got = None;
    /// for frame in 0..3 {
    ///     // two idle bits, then the 18 bits of the frame, each four samples long
    ///     let bits = sent.line().bits() >> (18 * frame) << 2 | 0b11;
    ///     for at in 0..20 {
    ///         got = got.or(receiver.run(bits >> at & 1 == 1, 4));
    ///     }
    /// }
    /// assert_eq!(got, Some(Ok(sent)));
    /// # Ok::<(), Error>(())
    /// ```
    pub const fn allowing_idle_between_frames(self) -> Self {
        Self { idle_allowed: true, ..self }
    }

    const fn of(format: Format, layout: Layout) -> Self {
        Self {
            receiver: Receiver::new(format),
            layout,
            idle_allowed: false,
            contents: [0; RawResponse::MAX_FRAMES],
            got: 0,
            end: 0,
            broken: false,
        }
    }

    /// Number of samples taken so far, which is the index of the next one.
    pub const fn position(&self) -> u64 {
        self.receiver.position()
    }

    /// Takes one sample; returns a response when the delimiter of its last frame has been sampled, or the fault that ended a
    /// response.
    pub fn push(&mut self, sample: bool) -> Option<Result<RawResponse, Error>> {
        let field = self.receiver.push(sample)?;
        self.take(field)
    }

    /// Takes `len` samples of the same level.
    pub fn run(&mut self, level: bool, len: u64) -> Option<Result<RawResponse, Error>> {
        let field = self.receiver.run(level, len)?;
        self.take(field)
    }

    /// Takes samples from the front of `samples` until a response ends or none are left.
    pub fn feed(&mut self, samples: &mut Samples) -> Option<Result<RawResponse, Error>> {
        while let Some(field) = self.receiver.feed(samples) {
            let ended = self.take(field);
            if ended.is_some() {
                return ended;
            }
        }
        None
    }

    /// Ends the reception at the end of the line, or when the time for the response has run out: returns the fault of a response
    /// that had begun.
    pub fn finish(&mut self) -> Option<Error> {
        let begun = (self.got > 0 || self.receiver.is_receiving()) && !self.broken;
        let error = self.truncation();
        let format = self.receiver.format();
        *self = Self { idle_allowed: self.idle_allowed, ..Self::of(format, self.layout) };
        begun.then_some(error)
    }

    /// Takes one more frame. A gap before it ends the response that had begun, and the frame begins the next one.
    fn take(&mut self, field: Field) -> Option<Result<RawResponse, Error>> {
        let samples = u64::from(self.receiver.format().samples_per_bit());
        // The end of a frame is known to half a bit.
        let idle = field.start.saturating_sub(self.end).saturating_add(samples / 2);
        self.end = field.start.saturating_add(samples.saturating_mul(FRAME_BITS.into()));
        let mut ended = None;
        if !self.idle_allowed {
            if idle >= samples.saturating_mul(Self::BUS_GAP_BITS) {
                self.broken = false;
                ended = (self.got > 0).then(|| Err(self.truncation()));
                self.got = 0;
            } else if self.got > 0 && idle >= samples {
                return Some(Err(self.break_off(Error::StartBit { frame: self.got })));
            }
        }
        if self.broken {
            return ended;
        }
        if !field.delimiter {
            let error = self.break_off(Error::Delimiter { frame: self.got });
            return ended.or(Some(Err(error)));
        }
        if let Some(content) = self.contents.get_mut(usize::from(self.got)) {
            *content = field.content;
        }
        self.got = self.got.saturating_add(1);
        if self.got < self.layout.frames() {
            return ended;
        }
        self.got = 0;
        Some(Ok(RawResponse::of(core::mem::take(&mut self.contents), self.layout)))
    }

    /// Abandons a response and skips the rest of it.
    fn break_off(&mut self, error: Error) -> Error {
        self.got = 0;
        self.contents = [0; RawResponse::MAX_FRAMES];
        self.broken = !self.idle_allowed;
        error
    }

    fn truncation(&self) -> Error {
        truncated(u32::from(self.got).wrapping_mul(FRAME_BITS), self.layout.line_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::expected::Expected;
    use crate::number::{EncoderAddress, U17};
    use crate::response::Response;
    use crate::response::tests::exchanges;
    use crate::status::EncoderStatus;
    use core::iter::repeat_n;
    use nrz_line::{Wave, Window};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Runs of equal level of a line as a sampler sees it whose clock differs.
    fn render(bits: &[bool], wave: Wave) -> Vec<(bool, u64)> {
        (0..).zip(bits).map(|(k, &b)| (b, wave.first_sample(k + 1) - wave.first_sample(k))).collect()
    }

    fn bits_of(line: Window) -> impl Iterator<Item = bool> {
        (0..line.len()).map(move |at| line.get(at) == Some(true))
    }

    /// Half a response, then five idle bits, or four: the shortest pause between two responses, and the longest that belongs to one.
    #[test]
    fn the_shortest_pause_between_two_responses() {
        let sent = Response::abs17(EncoderAddress::MAX, EncoderStatus::empty(), U17::truncate(0x1_2345)).emit();
        for (pause, ends) in [
            (5, std::vec![Err(Error::Truncated { got: 18, want: 36 }), Ok(sent)]),
            (4, std::vec![Err(Error::StartBit { frame: 1 })]),
        ] {
            let half = bits_of(sent.line()).take(18);
            let line = half.chain(repeat_n(true, pause)).chain(bits_of(sent.line()));
            let mut receiver = LineReceiver::bits(Layout::Abs17);
            assert_eq!(line.filter_map(|bit| receiver.push(bit)).collect::<Vec<_>>(), ends);
        }
    }

    /// Whole frames of a response that never ended are told at the end of the line, however long it was idle before.
    #[test]
    fn the_line_ends_between_two_frames() {
        let line = Response::abs17(EncoderAddress::MAX, EncoderStatus::empty(), U17::truncate(0x1_2345)).emit().line();
        for idle in 0..3 {
            let mut receiver = LineReceiver::bits(Layout::Abs17).allowing_idle_between_frames();
            let first = (0..18 + idle).map(|at| at >= 18 || line.bits() >> at & 1 == 1);
            assert!(first.into_iter().all(|level| receiver.push(level).is_none()));
            assert_eq!(receiver.finish(), Some(Error::Truncated { got: 18, want: 36 }), "{idle} idle bits");
        }
    }

    /// Samples, runs and words are counted alike and give the same; the end of a line leaves the receiver as it was made.
    #[test]
    fn all_three_ways_and_what_the_end_of_a_line_leaves() {
        let sent = Response::abs17(EncoderAddress::MAX, EncoderStatus::empty(), U17::truncate(0x1_2345)).emit();
        let first = u64::from(Window::from_bits(sent.line().bits(), 18).unwrap().bits() as u32);
        // 18 bits, two idle bits, 18 bits.
        let line = first | 0b11 << 18 | (sent.line().bits() >> 18 << 20) as u64;
        for way in 0..3 {
            let mut receiver = LineReceiver::bits(Layout::Abs17).allowing_idle_between_frames();
            for _ in 0..2 {
                let from = receiver.position();
                let mut samples = Samples::partial(line, 38);
                let got: Vec<_> = match way {
                    0 => (0..38).filter_map(|at| receiver.push(line >> at & 1 == 1)).collect(),
                    1 => (0..38).filter_map(|at| receiver.run(line >> at & 1 == 1, 1)).collect(),
                    _ => receiver.feed(&mut samples).into_iter().collect(),
                };
                assert_eq!((got, receiver.position()), (std::vec![Ok(sent)], from + 38), "way {way}");
                assert_eq!((receiver.push(true), receiver.finish()), (None, None));
                assert_eq!(receiver.position(), 0);
            }
        }
    }

    /// ABS17 of encoder 7, position 96964, with one wrong bit: the start bit of the second frame reads 1.
    #[test]
    fn one_wrong_bit_gives_no_position_but_with_idle_allowed() {
        let line = "111000111110010001101110111101100100111";
        let hear = |mut receiver: LineReceiver| {
            let bits = line.chars().map(|c| c == '1').chain(repeat_n(true, 40));
            bits.filter_map(|bit| receiver.push(bit)).collect::<Vec<_>>()
        };
        let receiver = LineReceiver::bits(Layout::Abs17);
        assert_eq!(hear(receiver), [Err(Error::StartBit { frame: 1 })]);
        let expected = Expected::new(Layout::Abs17, Command::Abs17).from_address(EncoderAddress::MAX);
        let tolerant = hear(receiver.allowing_idle_between_frames());
        let wrong = tolerant[0].and_then(|raw| Response::parse(&expected, &raw));
        assert_eq!(wrong.map(Response::abs), Ok(Some(57_028)));
    }

    /// Every single wrong bit of every position in a sweep: nothing wrong is ever accepted.
    #[test]
    fn no_single_flip_passes() {
        let expected = Expected::new(Layout::Abs17, Command::Abs17).from_address(EncoderAddress::MAX);
        for abs in (0..=0x1_ffff).step_by(if cfg!(miri) { 10_007 } else { 11 }) {
            let sent = Response::abs17(EncoderAddress::MAX, EncoderStatus::empty(), U17::truncate(abs));
            let line = sent.emit().line();
            for at in 0..line.len() {
                let flipped = Window::from_bits(line.bits() ^ 1 << at, line.len()).unwrap();
                let mut receiver = LineReceiver::bits(Layout::Abs17);
                let bits = repeat_n(true, 3).chain(bits_of(flipped)).chain(repeat_n(true, 40));
                for raw in bits.filter_map(|bit| receiver.push(bit)).flatten() {
                    let read = Response::parse(&expected, &raw);
                    assert!(read.is_err(), "{abs}, bit {at}: {read:?}");
                }
            }
        }
    }

    proptest! {
        /// Any gap between frames, any phase, one per cent of clock error either way.
        #[test]
        fn oversampled_responses(
            (_, expected, response) in exchanges(), samples in prop::sample::select(&[4_u32, 5, 6, 8][..]),
            ppm in -10_000..=10_000_i32, phase: u32, gaps: [u8; 6],
        ) {
            let raw = response.emit();
            let mut bits = std::vec![true; 3];
            for (frame, gap) in gaps.iter().enumerate().take(usize::from(raw.frames())) {
                bits.extend(repeat_n(true, usize::from(gap % 4)));
                bits.extend(bits_of(raw.line()).skip(frame * 18).take(18));
            }
            bits.push(true);
            let mut receiver = LineReceiver::oversampled(samples, expected.layout()).unwrap().allowing_idle_between_frames();
            let got: Vec<_> = render(&bits, Wave::new(samples, ppm, phase)).into_iter()
                .filter_map(|(level, len)| receiver.run(level, len)).collect();
            prop_assert_eq!(got, [Ok(raw)]);
            prop_assert_eq!(receiver.finish(), None);
        }

        /// A frame that begins one to four bits late is refused: its start bit was lost.
        #[test]
        fn a_late_frame_lost_its_start_bit((_, expected, response) in exchanges(), frame in 1..6_u8, late in 1..5_usize) {
            let raw = response.emit();
            let frame = 1 + frame % (raw.frames() - 1);
            let mut bits: Vec<bool> = bits_of(raw.line()).collect();
            let at = usize::from(frame) * 18;
            bits.splice(at..at, repeat_n(true, late));
            let mut receiver = LineReceiver::bits(expected.layout());
            let got: Vec<_> = bits.into_iter().filter_map(|bit| receiver.push(bit)).collect();
            prop_assert_eq!(got, [Err(Error::StartBit { frame })]);
            prop_assert_eq!(receiver.finish(), None);
        }

        /// A response that loses frames costs only itself: the next one after a gap arrives.
        #[test]
        fn a_gap_ends_a_response((_, expected, response) in exchanges(), kept in 0..108_usize, gap in 5..40_usize) {
            let raw = response.emit();
            let frames = usize::from(raw.frames());
            let kept = kept % (frames * 18);
            let mut bits: Vec<bool> = bits_of(raw.line()).take(kept).collect();
            let whole = kept / 18;
            // What is left of a cut frame would run into the gap.
            bits.truncate(whole * 18);
            bits.extend(repeat_n(true, gap));
            bits.extend(bits_of(raw.line()));
            let mut receiver = LineReceiver::bits(expected.layout());
            let got: Vec<_> = bits.into_iter().filter_map(|bit| receiver.push(bit)).collect();
            let cut = Error::Truncated { got: whole as u16 * 18, want: frames as u16 * 18 };
            if whole == 0 {
                prop_assert_eq!(got, [Ok(raw)]);
            } else {
                prop_assert_eq!(got, [Err(cut), Ok(raw)]);
            }
        }

        #[test]
        fn cut_lines((_, expected, response) in exchanges(), cut in 1..108_usize) {
            let raw = response.emit();
            let cut = cut % (usize::from(raw.frames()) * 18 - 1) + 1;
            let mut receiver = LineReceiver::bits(expected.layout());
            prop_assert!(bits_of(raw.line()).take(cut).all(|bit| receiver.push(bit).is_none()));
            let want = Error::Truncated { got: cut as u16 / 18 * 18, want: u16::from(raw.frames()) * 18 };
            prop_assert_eq!(receiver.finish(), Some(want));
            prop_assert_eq!(receiver.finish(), None);
        }
    }
}
