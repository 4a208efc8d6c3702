//! Heads of frames: where they are, where one should have been, and what they contain.

use std::ops::Range;

use hdsl::frame::{H_FRAME_BITS, Head, ParsedHead, STUFFING_BITS, Stuffing};
use hdsl::inspect::{BrokenRule, FRONT_BITS, FoundHead, ends_with_stuffing, ends_with_trailer, find_head, head_damage};
use hdsl::{Error, MasterSymbol, Window};

use super::super::bits::{Again, Bits, RESET};
use super::super::refused::event;
use super::Decoder;
use crate::event::{Direction, Field, Span};

const LONE: &str = "a lone nibble between two frames that have none is not a message: a bit was flipped";
const TRAILER: &str = "the TRAILER or the stuffing in front of it is damaged";
const PAUSED: &str = "the line is idle here, although frames should follow each other without end";
/// Nibbles of the shortest message: a byte and its check.
const SHORTEST_MESSAGE: u8 = 6;
/// Bits between the heads of two frames: the shortest frame, the longest one with its stuffing, a block of stuffing, and
/// how far a length may be off if other speakers came in between.
const SHORTEST: u64 = H_FRAME_BITS as u64;
const LONGEST: u64 = 273 + 4;
const STUFFING: u64 = STUFFING_BITS as u64;
const SLACK: u64 = 8;
/// Bits after an answer in which there may be another head.
const BEHIND: u64 = Head::BITS as u64 + 8;

impl Decoder {
    /// Reports a head with its request, and what is `wrong` with it; returns whether it is a damaged head of a running link.
    pub(super) fn head(&mut self, found: FoundHead, wrong: Option<BrokenRule>, bits: &Bits, at: Range<u64>) -> bool {
        let symbol = found.head.byte.symbol();
        let trailer = self.head.is_some() && self.heads.is_end_damaged(front(bits, at.start));
        let place = bits.place(at.clone());
        let damaged = wrong.is_some() && self.delay.is_some();
        let talks = matches!(symbol, Ok(MasterSymbol::Data(_)));
        // Unheard heads may have continued it.
        if let Some(number) = self.lone.take().filter(|_| !talks && self.since_quiet < SHORTEST_MESSAGE) {
            self.said.refuse(number, ("lone", LONE.to_owned()));
        }
        self.lone = (talks && !self.talks).then(|| self.said.next());
        self.talks = talks;
        self.since_quiet = if talks { self.since_quiet.saturating_add(1) } else { 0 };
        let wrong = wrong.map_or(Ok(()), |rule| Err((rule.name(), rule.to_string())));
        let extra = if found.head.extra_bits > 0 { window_bits(bits, &at) } else { 0 };
        let event = event(place, Direction::Request, "H-frame", master(found.head, symbol, extra), wrong);
        // Everything is in the last word, PARA.
        let mut event = event.locate(|name| {
            let coded = matches!(name, "SYMBOL" | "FIRST" | "MSYNC") && found.len >= 10;
            coded.then(|| Span::even(place, found.len, found.len - 10, found.len - 1))
        });
        event.fields.extend(trailer.then(|| Field::text("note", TRAILER)));
        self.said.push(event);
        self.message_out(symbol, place);
        damaged
    }

    /// Returns the head before the one at `at`, if it is not far away.
    pub(super) fn before(&self, at: u64) -> Option<u64> {
        self.before.filter(|before| at - before < 4 * LONGEST)
    }

    /// Returns whether something is wrong at or before the head at `at`, such as a `broken` rule or a head that was not
    /// due: the edges are then examined again, once.
    pub(super) fn looks_again(&mut self, bits: &mut Bits, at: u64, broken: bool) -> bool {
        let Some(last) = self.head.filter(|last| self.is_running() && self.again != Some(*last)) else { return false };
        let fails = broken || !self.is_one_frame(bits, at - last, at) || !ends_with_trailer(front(bits, at));
        if bits.paused.is_some() || !fails && self.shaky == 0 && !bits.is_jittery() {
            return false;
        }
        self.look_again(bits, last);
        true
    }

    /// Returns whether the edges after the last head, which no other head followed, are examined again.
    pub(super) fn looks_behind_the_last(&mut self, bits: &mut Bits) -> bool {
        let last = self.head.filter(|last| self.is_running() && self.again != Some(*last));
        let Some(last) = last.filter(|_| bits.paused.is_none() && self.after + BEHIND <= bits.end()) else {
            return false;
        };
        self.look_again(bits, last);
        true
    }

    fn look_again(&mut self, bits: &mut Bits, last: u64) {
        let beat = bits.beat(last, self.head_len, self.before(last));
        bits.lay(last, beat, Again::Rest);
        (self.again, self.next, self.laid) = (Some(last), self.after, bits.end());
    }

    /// Reports where a frame should have been before the head at `at`: frames follow each other without end.
    pub(super) fn missed(&mut self, bits: &mut Bits, at: u64) {
        self.before = self.head;
        let Some(last) = self.head.replace(at) else {
            bits.paused = None;
            return;
        };
        let (apart, usual) = (at - last, self.apart.unwrap_or(SHORTEST));
        if bits.paused.take_if(|paused| *paused <= at).is_some() {
            let place = bits.place(last..at);
            self.lose(1);
            let refused = Err(("gap", PAUSED.to_owned()));
            self.said.push(event(place, Direction::Request, "H-frame", Vec::new(), refused));
        } else if !self.is_one_frame(bits, apart, at) {
            let missing = ((apart as f64 / usual as f64).round() as u64).saturating_sub(1).max(1);
            for k in 1..=missing {
                let due = last + k * apart / (missing + 1);
                self.lose(1);
                let damage = head_damage(bits.window(due.saturating_sub(3)));
                let place = bits.place(due..due + u64::from(Head::BITS));
                self.said.push(event(
                    place,
                    Direction::Request,
                    "H-frame",
                    Vec::new(),
                    Err((damage.name(), damage.to_string())),
                ));
            }
        } else {
            self.apart = Some(apart);
        }
    }

    /// Returns whether the bits at `at`, which resemble a head but break a rule, lie where no head is due: they are then
    /// part of an answer or of a damaged head.
    pub(super) fn is_stray(&self, bits: &Bits, at: u64) -> bool {
        let (Some(last), Some(usual)) = (self.head.filter(|_| self.is_running()), self.apart) else { return false };
        let apart = at - last;
        let is_due = |frames: u64| (frames * usual).abs_diff(apart) <= 2 * SLACK;
        !(1..=4).any(is_due) && filled(bits, self.head_len, at).abs_diff(apart) > SLACK / 2
    }

    /// Returns whether nothing is missing between the last head and the one at `at`: a frame may have any length, but here
    /// two frames would not fit, or the length is the same as before, or stuffing fills it.
    fn is_one_frame(&self, bits: &Bits, apart: u64, at: u64) -> bool {
        apart <= LONGEST
            && (apart + SLACK < 2 * SHORTEST
                || self.apart.is_some_and(|usual| usual.abs_diff(apart) <= 2 * SLACK)
                || filled(bits, self.head_len, at).abs_diff(apart) <= SLACK / 2)
    }
}

/// Returns the bits of a frame whose head has `head` bits, judging by the stuffing before the next head at bit `at`:
/// without stuffing, a frame has a fixed number of bits more than its head.
fn filled(bits: &Bits, head: u64, at: u64) -> u64 {
    let blocks = (1..=u64::from(Stuffing::MAX.get())).take_while(|k| {
        let from = at.saturating_sub(STUFFING * k);
        Window::from_bits(bits.load(from), STUFFING as u32).is_some_and(ends_with_stuffing)
    });
    head + SHORTEST - u64::from(Head::BITS) + STUFFING * blocks.count() as u64
}

/// Learns the length of a bit from the first frames of a link: `heads` has the bits at which they begin, and the number of
/// bits in each head.
/// If an encoder speaks in between, a frame may be read one bit too long or too short.
pub(super) fn learn(bits: &mut Bits, heads: &[(u64, u64)]) {
    for pair in heads.windows(2) {
        let [(at, len), (next, _)] = *pair else { continue };
        let filled = filled(bits, len, next);
        if filled.abs_diff(next - at) <= SLACK / 2 {
            bits.learn(at..next, filled);
        }
    }
}

/// Returns the heads at these bits, and the bits of the line from each of them.
pub(super) fn parsed(bits: &Bits, heads: &[(u64, u64)]) -> Vec<(ParsedHead, Window)> {
    let head = |at: u64| find_head(bits.window(at)).map(|found| (found.head, bits.window(at)));
    heads.iter().filter_map(|(at, _)| head(*at)).collect()
}

/// Returns the bits before a head.
fn front(bits: &Bits, at: u64) -> Window {
    let from = at.saturating_sub(FRONT_BITS.into());
    Window::from_bits(bits.load(from), (at - from) as u32).unwrap_or(Window::EMPTY)
}

/// Returns the bits of the EXTRA window in a head: its edge lies somewhere in the last of them, so the time from SYNC to
/// CYCLE RESET is what counts.
fn window_bits(bits: &Bits, head: &Range<u64>) -> u32 {
    let (sync, reset) = (bits.time(head.start), bits.time(head.end - RESET));
    let whole = ((reset - sync) as f64 / bits.mean()).round() as u32;
    whole.saturating_sub(Head::BITS - RESET as u32)
}

fn master(head: ParsedHead, symbol: Result<MasterSymbol, Error>, extra: u32) -> Vec<Field> {
    let mut fields = Vec::with_capacity(4);
    fields.extend(symbol.ok().map(|symbol| Field::text("SYMBOL", symbol)));
    fields.push(Field::number("FIRST", head.byte.first()));
    fields.push(Field::number("MSYNC", head.byte.msync()));
    if extra > 0 {
        fields.push(Field::measured("EXTRA", extra, "bit"));
    }
    fields
}
