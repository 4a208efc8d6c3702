//! A HIPERFACE DSL link as a colleague who does not trust the decoder would make it: bits from the published tables, and beside
//! each frame every value that may be said of it. No code of the crates, none of their constants.

mod code;
mod doubt;
mod link;
mod talk;
mod vertical;

use super::line::Wire;
use super::rng::Rng;
use super::{Said, Shown};
use code::{PATTERN, acceleration, bits, coded, parameter};
use doubt::Sent;
pub(crate) use link::Link;
use talk::Talk;
use vertical::Vertical;

/// 9.375 MBaud.
pub(crate) const BIT: f64 = 1e12 / 9.375e6;

/// A link on the wire, and all that may be said of it.
pub(crate) struct Built {
    pub(crate) wire: Wire,
    pub(crate) said: Vec<Said>,
    pub(crate) end: f64,
}

struct Builder<'a> {
    link: &'a Link,
    rng: Rng,
    wire: Wire,
    said: Vec<Said>,
    /// When the next frame begins.
    now: f64,
    bit: f64,
    plus: bool,
    /// Whether the last head was damaged.
    damaged: bool,
    /// Eighths after the start of the window at which its edge lies.
    edge: i64,
    sent: Vec<Sent>,
}

fn symbol(code: u8) -> String {
    match code {
        0..=15 => format!("{code:X}"),
        0x10 => "IDLE".to_owned(),
        0x19 => "SYNC".to_owned(),
        0x1a => "START".to_owned(),
        0x1b => "LEARN".to_owned(),
        0x1c => "CHECK".to_owned(),
        0x1d => "IDREQ".to_owned(),
        0x1e => "INIT".to_owned(),
        _ => "RESET".to_owned(),
    }
}

impl Builder<'_> {
    /// SYNC to PARA; when the line is released.
    fn head(&mut self, byte: u8) -> f64 {
        let start = self.now;
        let damaged = self.rng.chance(self.link.heads_damaged);
        let extra = self.link.window.map_or(0, |_| (self.edge + 7) / 8);
        let mut line = bits("001011 11");
        let broken = damaged.then(|| self.rng.below(26) as usize);
        let flip = |line: &mut Vec<bool>, first: usize| {
            if let Some(bit) = broken.and_then(|at| at.checked_sub(first)).and_then(|at| line.get_mut(at)) {
                *bit = !*bit;
            }
        };
        flip(&mut line, 0);
        let mut at = self.wire.send(start, self.bit, &line);
        if extra > 0 {
            self.wire.drive(at, true);
            self.wire.drive(at + self.edge as f64 / 8.0 * self.bit, false);
            at += extra as f64 * self.bit;
        }
        let mut rest = [bits("0 110"), parameter(byte, extra)].concat();
        flip(&mut rest, 8);
        let end = self.wire.send(at, self.bit, &rest);
        // Released.
        self.wire.drive(end, true);
        let mut fields = vec![
            ("SYMBOL", Shown::Text(symbol(byte & 31))),
            ("FIRST", Shown::Number((byte >> 7).into())),
            ("MSYNC", Shown::Number((byte >> 6 & 1).into())),
        ];
        if extra > 0 {
            fields.push(("EXTRA", Shown::Number(extra)));
        }
        self.said.push(Said { kind: "H-frame".into(), start, fields, position: None, damaged });
        self.damaged = damaged;
        end
    }

    /// TRAILER and stuffing of a frame whose line was released at `end`.
    fn tail(&mut self, end: f64, answered: bool) {
        let free = end + 74.0 * self.bit;
        if !answered {
            let filler: Vec<bool> = (0..74).map(|at| at % 2 == 1).collect();
            self.wire.send(end, self.bit, &filler);
        }
        let zeros = if !answered || self.link.five_zeros { 5 } else { 4 };
        let driven = free + f64::from(6 - zeros) * self.bit;
        self.wire.drive(driven, false);
        let mut at = self.wire.send(free + 6.0 * self.bit, self.bit, &bits("11"));
        for _ in 0..self.link.stuffing {
            at = self.wire.send(at, self.bit, &bits("001011"));
        }
        self.now = at;
        if let Some(window) = self.link.window {
            // What the window was too long is missing in the next one.
            self.edge += window - 8 * ((self.edge + 7) / 8);
            while self.edge < 25 {
                self.edge += 48;
            }
            while self.edge > 72 {
                self.edge -= 48;
            }
        }
    }

    /// 61 bits of the encoder: when they begin, and the one that is flipped.
    fn answer(&mut self, released: f64, line: &[bool]) -> (f64, Option<u64>) {
        let start = released + (1.0 + self.link.delay) * self.bit;
        let mut line = line.to_vec();
        let flip = self.rng.chance(self.link.damaged).then(|| self.rng.below(61));
        if let Some(at) = flip {
            line[at as usize] = !line[at as usize];
        }
        let end = self.wire.send(start, self.bit, &line);
        self.wire.drive(end, true);
        (start, flip)
    }

    /// Says an answer. Without its head nobody can tell what it is.
    fn say(&mut self, kind: &'static str, answer: (f64, Option<u64>), fields: Vec<(&'static str, Shown)>) {
        let damaged = answer.1.is_some() || self.damaged;
        self.said.push(Said { kind: kind.into(), start: answer.0, fields, position: None, damaged });
    }

    /// A message that ends with the frame said last.
    fn message(&mut self, text: Option<String>) {
        let (Some(text), Some(last)) = (text, self.said.last()) else { return };
        let (start, damaged) = (last.start, last.damaged);
        let fields = vec![("message", Shown::Text(text))];
        self.said.push(Said { kind: "message".into(), start, fields, position: None, damaged });
    }

    fn delay(&self) -> (&'static str, Shown) {
        ("delay", Shown::Near(self.link.delay))
    }

    fn six(&mut self, words: [(u8, bool); 6]) -> Vec<bool> {
        if self.link.anew {
            self.plus = false;
        }
        let mut line: Vec<bool> = Vec::with_capacity(61);
        for (k, (byte, control)) in words.into_iter().enumerate() {
            if k == 5 {
                line.push(!line[49]);
            }
            line.extend(coded(byte, control, &mut self.plus));
        }
        line
    }

    /// RESET to IDREQ.
    fn start_up(&mut self) {
        for (code, count) in [(0x1f, 2), (0x19, 16), (0x1a, 9), (0x1b, 9), (0x1c, 16), (0x1d, 1)] {
            for _ in 0..count {
                let end = self.head(code);
                match code {
                    0x1f | 0x19 => {}
                    0x1d => {
                        let more = self.link.width - 11;
                        let id = 3 | more << 4 | u32::from(self.link.signed) << 10;
                        let [low, middle, high, _] = id.to_le_bytes();
                        let words = [low, middle, high << 4 | high, middle, low, 0].map(|byte| (byte, false));
                        let line = self.six(words);
                        let answer = self.answer(end, &line);
                        self.say("identifier", answer, vec![("ENC_ID", Shown::Number(id.into()))]);
                    }
                    _ => {
                        let answer = self.answer(end, &bits(PATTERN));
                        self.say("test pattern", answer, vec![self.delay()]);
                    }
                }
                self.tail(end, !matches!(code, 0x1f | 0x19));
            }
        }
    }
}

/// Builds a link.
pub(crate) fn build(link: &Link, seed: u64) -> Built {
    let rng = Rng::new(seed);
    let bit = BIT * link.clock;
    let wire = Wire::new(!link.begins_low);
    let edge = link.window.map_or(0, |window| window.clamp(25, 72));
    let (said, sent) = (Vec::new(), Vec::new());
    let mut b = Builder { link, rng, wire, said, now: 40.0 * bit, bit, plus: false, damaged: false, edge, sent };
    b.wire.drive(20.0 * bit, true);
    if link.start_up {
        b.start_up();
    }
    let mut talk = Talk::default();
    let (mut position, mut speed) = (link.from, link.speed);
    // Somewhere in a V-frame.
    let mut at = b.rng.below(8) as usize;
    // A link that is running, or one that waits for VSYNC with INIT.
    let mut running = !link.start_up;
    let mut vertical = Vertical::new(link, position, false, &mut b.rng);
    // Whether it is known where this V-frame began: VSYNC ended the one before.
    let mut whole = false;
    let mut v_frame = 0;
    let mut quality = if link.start_up { 8 } else { 15 };
    let mut msync = b.rng.chance(0.5);
    for _ in 0..link.frames {
        if at == 0 {
            v_frame += 1;
            msync = running && !msync;
            vertical = Vertical::new(link, position, !vertical.toggle, &mut b.rng);
        }
        if link.messages && running {
            talk.begin(&mut b.rng);
        }
        let (asks, asked) = if running { talk.master.pop_front().unwrap_or((0x10, None)) } else { (0x1e, None) };
        let end = b.head(0x80 | u8::from(msync && running) << 6 | asks);
        b.message(asked);
        let word = b.rng.about(link.jolt);
        speed += word;
        position += speed;
        let vsync = at == 7;
        let (says, told) = talk.encoder.pop_front().unwrap_or((0x10, None));
        let [high, low] = acceleration(word);
        let pipe = b.rng.pick(&[(0xfe, true), (0x30, false), (0xe7, false)]);
        let [first, second] = [0, 1].map(|channel| vertical.blocks[channel][at]);
        let words = [
            (first, false),
            (says | u8::from(vsync) << 7, false),
            pipe,
            (high, false),
            (low, false),
            (second, at == 0),
        ];
        let line = b.six(words);
        let answer = b.answer(end, &line);
        b.sent.push(Sent { said: b.said.len(), v_frame, at, flip: answer.1, words, line });
        let raw = link.forty(position);
        let fields = vec![
            b.delay(),
            ("VERT", Shown::Number(first.into())),
            ("SYMBOL", Shown::Text(symbol(says))),
            ("VSYNC", Shown::Number(vsync.into())),
            ("PIPE", Shown::Number(pipe.0.into())),
            ("DD", Shown::Number(word)),
            ("SEC", Shown::Number(second.into())),
            ("POS", Shown::Number(raw as i64)),
            ("VEL", Shown::Number(speed)),
        ];
        b.say("answer", answer, fields);
        if let Some(said) = b.said.last_mut() {
            said.position = Some(("POS", link.counts(position)));
            vertical.damaged |= said.damaged;
        }
        b.message(told);
        if vsync {
            if whole {
                quality = (quality + 2).min(15);
                let quality = if link.damaged > 0.0 { Shown::Any } else { Shown::Number(quality) };
                b.said.push(vertical.said(answer.0, quality));
            }
            (whole, running) = (true, true);
        }
        at = (at + 1) % 8;
        b.tail(end, true);
    }
    doubt::mark(&mut b.said, &b.sent);
    doubt::leave_to_chance(&mut b.said, &b.sent);
    let end = b.now + 30.0 * bit;
    Built { wire: b.wire, said: b.said, end }
}
