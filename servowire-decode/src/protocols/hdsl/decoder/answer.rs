//! Answers of a running link: their words, the running disparity between them, their V-frames.

use hdsl::frame::ANSWER_BITS;
use hdsl::inspect::{Expected, inspect};
use hdsl::symbol::RunningDisparity;
use hdsl::{Answer, EncoderByte, Error, Policy, Rule, Sample, VFrame, Window};

use super::super::refused::{Refused, event, position, refusal};
use super::{Break, Decoder, Neighbour};
use crate::event::{Direction, Field, Place, Span};

const DISPARITY: &str = "all words are in the tables, but cannot follow one another: bits of at least one were flipped";
const TAIL: &str =
    "the next answer does not begin at the running disparity that this one leaves: a bit was flipped at its end";
const FRONT: &str =
    "it does not begin at the running disparity that the answer before leaves: a bit was flipped at its front";
const ANEW: &str = "it begins with running disparity +, and all others begin with -: a bit was flipped at its front";
const BETWEEN: &str =
    "the running disparity does not go on from one answer to the next: a bit was flipped between their middles";
const STRAY: &str = "VSYNC is expected in every eighth answer, and only there";
const SWITCH: &str = "the switch bit is not the inverse of the bit before it";
/// The first of the words that the check of the acceleration covers; the word after them belongs to the secondary channel.
const ACCELERATION: u8 = 3;
/// The present answer is the last of a V-frame whose other answers are unknown.
const LAST: u8 = 8;

impl Decoder {
    pub(super) fn normal(&mut self, window: Window, place: Place) {
        let Ok(answer) = Answer::parse(Rule::Strict, window) else { return };
        let parameter = answer.parameter();
        let report = inspect(Expected::Normal { at: self.at }, window);
        let chain = report.disparity();
        let verdict = match report.error() {
            None if !chain.holds() => Err(("disparity", DISPARITY.to_owned())),
            None => Ok(()),
            Some(error) => Err(refusal(error)),
        };
        // If all words are good but cannot follow each other, any of them may be the wrong one.
        let doubtful = report.error().is_none() && !chain.holds();
        self.step(answer.delta_delta().ok().filter(|_| !doubtful));
        let sound = verdict.is_ok();
        let verdict = verdict.and_then(|()| self.follow(parameter.is_ok_and(EncoderByte::vsync)));
        let event = event(place, Direction::Answer, "answer", self.fields(answer), verdict);
        let mut event = event.locate(|name| {
            let (first, last) = match name {
                "VERT" => (0, 9),
                "SYMBOL" | "VSYNC" => (10, 19),
                "PIPE" => (20, 29),
                // The switch bit comes after it.
                "DD" => (30, 49),
                "SEC" => (51, 60),
                _ => return None,
            };
            Some(Span::even(place, ANSWER_BITS, first, last))
        });
        if let Some(sample) = self.sample() {
            // 40 bits, as the register shows it.
            let raw = u64::from_le_bytes(sample.position().to_le_bytes()) & 0xff_ffff_ffff;
            event.fields.push(Field::hex("POS", raw, 10));
            event.fields.push(Field::measured("VEL", sample.velocity(), "/frame"));
            event.position = Some(position("POS", raw, self.id));
        }
        if event.verdict.is_ok() && !answer.switch_ok() {
            event.fields.push(Field::text("note", SWITCH));
        }
        let number = self.said.next();
        self.said.push(event);
        self.join(Neighbour { chain, number, sound });
        self.message_in(parameter.ok(), place);
        self.v_frame(answer, place);
    }

    /// Returns the fast position, if a receiver may use it, by the receiver's own rules.
    fn sample(&self) -> Option<Sample> {
        let sample = self.fast?.evidence(0, 0).at(0, Policy::new(u64::MAX)).ok()?;
        let raw = u64::from_le_bytes(sample.position().to_le_bytes());
        (self.id.is_some() || self.reach.holds(raw)).then_some(sample)
    }

    fn fields(&self, answer: Answer) -> Vec<Field> {
        let byte = |name, word: hdsl::symbol::Reading| word.byte().ok().map(|byte| Field::hex(name, byte, 2));
        let mut fields = Vec::with_capacity(10);
        fields.push(Field::measured("delay", self.delay.unwrap_or(0), "bit"));
        fields.extend(byte("VERT", answer.vertical()));
        if let Ok(parameter) = answer.parameter() {
            fields.push(encoder_symbol(parameter));
            fields.push(Field::number("VSYNC", parameter.vsync()));
        }
        fields.extend(byte("PIPE", answer.pipe()));
        fields.extend(answer.delta_delta().ok().map(|dd| Field::number("DD", dd.get())));
        fields.extend(byte("SEC", answer.secondary()));
        fields
    }

    /// Follows VSYNC of an answer that is good so far; one unexpected VSYNC is ignored, but not two.
    fn follow(&mut self, vsync: bool) -> Result<(), Refused> {
        let due = self.at.map(|at| at == 7);
        if due.is_none_or(|due| due == vsync) {
            self.strays = 0;
            // The answer itself is the last of its V-frame.
            self.at = self.at.or(vsync.then_some(LAST));
            return Ok(());
        }
        self.strays += 1;
        if self.strays > 1 {
            self.lose_v_frame();
            self.at = vsync.then_some(LAST);
        }
        Err(("vsync", STRAY.to_owned()))
    }

    /// Checks whether an answer continues the running disparity of the previous one.
    fn join(&mut self, next: Neighbour) {
        let begins_with_plus = next.chain.before() == Some(RunningDisparity::Plus);
        if next.sound && begins_with_plus && self.beginnings.are_anew() {
            self.said.refuse(next.number, ("disparity", ANEW.to_owned()));
        }
        let Some(before) = self.chain.replace(next) else { return };
        let Some(goes_on) = before.chain.continues_into(next.chain) else { return };
        let (ends, begins) = (before.number, next.number);
        if !before.sound || !next.sound {
            // A damaged answer whose words do not show the place may be damaged just here.
            let tells = |it: Neighbour| it.sound || !it.chain.holds();
            if !goes_on && self.beginnings.are_carried() && tells(before) && tells(next) {
                self.said.refuse(ends, ("disparity", TAIL.to_owned()));
                self.said.refuse(begins, ("disparity", FRONT.to_owned()));
            }
            return;
        }
        if !goes_on && self.beginnings.are_carried() {
            let first_failed = if self.at == Some(0) { self.failed.map(|[_, second]| second) } else { None };
            let (tail_is_checked, front_is_checked) =
                (before.chain.last_decisive() >= ACCELERATION, next.chain.first_decisive() == 0);
            self.breaks.push(Break { ends, begins, tail_is_checked, front_is_checked, first_failed });
            let told = match self.at {
                Some(0) => first_failed.is_some(),
                Some(at) => at < LAST,
                None => false,
            };
            if !told {
                self.settle(None);
            }
        }
        self.beginnings.note(before.chain, next.chain);
    }

    /// The checks of the V-frame show on which side of a break a bit was flipped, if they cover the suspect words there:
    /// the last word of an answer belongs to channel 2, the first word of the next to channel 1.
    pub(super) fn settle(&mut self, failed: Option<[bool; 2]>) {
        for Break { ends, begins, tail_is_checked, front_is_checked, first_failed } in std::mem::take(&mut self.breaks)
        {
            let second = first_failed.or(failed.map(|[_, second]| second));
            let first = failed.map(|[first, _]| first);
            let (tail_holds, front_holds) =
                (tail_is_checked && second == Some(false), front_is_checked && first == Some(false));
            let (tail, front, what) = match (tail_holds, front_holds) {
                (true, false) => (false, true, FRONT),
                (false, true) => (true, false, TAIL),
                _ => (true, true, BETWEEN),
            };
            for (_, number) in [(tail, ends), (front, begins)].into_iter().filter(|side| side.0) {
                self.said.refuse(number, ("disparity", what.to_owned()));
            }
        }
    }

    fn v_frame(&mut self, answer: Answer, place: Place) {
        match self.at {
            Some(LAST) => {}
            Some(at) => {
                self.frame.put(Rule::Strict, at, answer);
                self.quality.count_answer(at, &answer);
                if at == 7 {
                    self.end_v_frame(place);
                }
                self.at = Some((at + 1) % 8);
                self.begun = if at == 7 { Some(self.said.next()) } else { self.begun };
                return;
            }
            None => return,
        }
        (self.at, self.failed, self.begun) = (Some(0), None, Some(self.said.next()));
    }

    fn end_v_frame(&mut self, place: Place) {
        let VFrame { safe1, safe2 } = self.frame;
        let safe = safe1.vpos();
        self.quality.count_v_frame(&self.frame);
        if let Some(fast) = &mut self.fast {
            fast.align(safe.ok());
        }
        if let Ok(safe) = safe {
            self.reach.note(safe);
        }
        let mut fields = vec![Field::hex("SUMMARY", safe1.status(), 2)];
        fields.extend(safe.ok().map(|position| Field::hex("VPOS", position, 10)));
        fields.push(Field::hex("STATUS2", safe2.status(), 2));
        fields.extend(safe2.vpos().ok().map(|position| Field::hex("VPOS2", position, 10)));
        fields.extend(self.quality.value().map(|value| Field::number("QM", value)));
        let second = safe2.vpos();
        let error = safe.err().or(second.err());
        let mut event = event(place, Direction::Answer, "V-frame", fields, error.map_or(Ok(()), |e| Err(refusal(e))));
        event.position = safe.ok().map(|raw| position("VPOS", raw, self.id));
        self.said.push(event);
        let failed = [is_damage(safe.err()), is_damage(second.err())];
        // One of its bytes is wrong, but it is unknown which.
        for name in ["VERT", "SEC"].into_iter().zip(failed).filter_map(|(name, failed)| failed.then_some(name)) {
            self.said.withhold(self.begun.unwrap_or(u64::MAX), name);
        }
        self.failed = Some(failed);
        self.settle(Some(failed));
    }
}

/// Returns the symbol, or its five bits if it has no meaning.
fn encoder_symbol(byte: EncoderByte) -> Field {
    match byte.symbol() {
        Ok(symbol) => Field::text("SYMBOL", symbol),
        Err(_) => Field::text("SYMBOL", format_args!("{:02X}h", byte.raw() & 31)),
    }
}

/// Returns whether the block was damaged, rather than saying that there is no position.
fn is_damage(error: Option<Error>) -> bool {
    error.is_some_and(|error| matches!(error, Error::InvalidWord { .. } | Error::WrongKind { .. } | Error::Crc { .. }))
}
