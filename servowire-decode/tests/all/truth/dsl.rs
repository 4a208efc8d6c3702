//! A HIPERFACE DSL link as a colleague who does not trust the decoder would make it: bits from the published tables, and beside
//! each frame every value that may be said of it. No code of the crates, none of their constants.

use std::collections::VecDeque;

use super::line::Wire;
use super::rng::Rng;
use super::{Said, Shown};

/// 9.375 MBaud.
pub(crate) const BIT: f64 = 1e12 / 9.375e6;

/// abcdei of D.0 to D.31 in the column of running disparity -, then K28.
const SIX: &str = "100111 011101 101101 110001 110101 101001 011001 111000 111001 100101 010101 110100 001101 101100 \
    011100 010111 011011 100011 010011 110010 001011 101010 011010 111010 110011 100110 010110 110110 001110 101110 \
    011110 101011 001111";
/// fghj of y in the column -: of data, of K28.
const FOUR: &str = "1011 1001 0101 1100 1101 1010 0110 1110";
const FOUR_K28: &str = "1011 0110 1010 1100 1101 0101 1001 0111";
/// START, LEARN and CHECK are answered with it.
const PATTERN: &str = "0100110011001000000100010101110111111011001100110100010011001";

/// Resources as they are printed: one with a name, one that no list has.
const RESOURCES: [(u16, &str); 2] = [(0x081, "081h RESOLUTN"), (0x2a5, "2A5h")];

fn bits(text: &str) -> Vec<bool> {
    text.bytes().filter(|bit| matches!(bit, b'0' | b'1')).map(|bit| bit == b'1').collect()
}

fn word(table: &str, at: usize) -> Vec<bool> {
    bits(table.split_whitespace().nth(at).unwrap())
}

fn flipped(bits: &[bool]) -> Vec<bool> {
    bits.iter().map(|bit| !bit).collect()
}

/// Ones less zeros.
fn surplus(bits: &[bool]) -> i64 {
    bits.iter().map(|bit| if *bit { 1 } else { -1 }).sum()
}

/// 8b/10b with the running disparity `plus`.
fn coded(byte: u8, control: bool, plus: &mut bool) -> Vec<bool> {
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let k28 = control && x == 28;
    let mut six = word(SIX, if k28 { 32 } else { x });
    let even = surplus(&six) == 0;
    if *plus && (!even || x == 7) {
        six = flipped(&six);
    }
    *plus ^= !even;
    let other_seven = control || matches!((x, *plus), (17 | 18 | 20, false) | (11 | 13 | 14, true));
    let mut four = match (k28, y, other_seven) {
        (true, ..) => word(FOUR_K28, y),
        (_, 7, true) => bits("0111"),
        _ => word(FOUR, y),
    };
    let even = surplus(&four) == 0;
    if *plus && (!even || y == 3 || k28) {
        four = flipped(&four);
    }
    *plus ^= !even;
    [six, four].concat()
}

/// EQUALISATION and the parameter byte; `disparity`: ones less zeros that the master has sent.
fn parameter(byte: u8, disparity: i64) -> Vec<bool> {
    let (equal, mut d) = match disparity {
        -1..=1 => ("0000", disparity),
        2 | 3 => ("0010", disparity - 2),
        4.. => ("0000", disparity - 4),
        -3 | -2 => ("1101", disparity + 2),
        _ => ("1111", disparity + 4),
    };
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let mut six = word(SIX, if x == 28 { 32 } else { x });
    if x == 7 {
        six = bits("000111");
    }
    if surplus(&six) != 0 {
        let more_zeros = if surplus(&six) > 0 { flipped(&six) } else { six };
        six = if d >= 0 { more_zeros } else { flipped(&more_zeros) };
    }
    d += surplus(&six);
    let mut four = word(FOUR, y);
    if y == 3 {
        four = bits("0011");
    }
    if surplus(&four) != 0 {
        let more_zeros = if surplus(&four) > 0 { flipped(&four) } else { four };
        four = if d >= 0 { more_zeros } else { flipped(&more_zeros) };
    }
    [bits(equal), six, four].concat()
}

/// x^16 + x^15 + x^12 + x^7 + x^6 + x^4 + x^3 + 1, inverted in its low byte, behind the bytes.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut crc = 0_u32;
    for byte in bytes {
        for k in (0..8).rev() {
            let carry = (crc >> 15 ^ u32::from(*byte) >> k) & 1;
            crc = crc << 1 & 0xffff ^ if carry == 1 { 0x90d9 } else { 0 };
        }
    }
    [bytes, &[(crc >> 8) as u8, crc as u8 ^ 0xff]].concat()
}

/// Eleven bits and x^5 + x^2 + 1 over them, inverted.
fn acceleration(value: i64) -> [u8; 2] {
    let value = (value & 0x7ff) as u16;
    let mut crc = 0_u16;
    for k in (0..11).rev() {
        let carry = (crc >> 4 ^ value >> k) & 1;
        crc = crc << 1 & 31 ^ if carry == 1 { 5 } else { 0 };
    }
    (value << 5 | crc ^ 31).to_be_bytes()
}

/// What kind of link it is.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    /// H-frames after the start-up.
    pub(crate) frames: usize,
    /// Whether the start-up is there, so that the identifier is.
    pub(crate) start_up: bool,
    /// Bits of the position, and whether it has a sign.
    pub(crate) width: u32,
    pub(crate) signed: bool,
    /// First position, speed in steps a frame, and how much that changes from frame to frame at most.
    pub(crate) from: i64,
    pub(crate) speed: i64,
    pub(crate) jolt: i64,
    /// Eighths of a bit of a frame of sync mode beyond the 108 bits and six for each block; none: free running.
    pub(crate) window: Option<i64>,
    /// Blocks of stuffing.
    pub(crate) stuffing: usize,
    /// From the end of PARA and the bit after it to the answer, in bits.
    pub(crate) delay: f64,
    /// TRAILER has five driven zeros instead of four.
    pub(crate) five_zeros: bool,
    /// Each answer begins with running disparity - instead of going on.
    pub(crate) anew: bool,
    /// Messages on both channels.
    pub(crate) messages: bool,
    /// Share of answers with a flipped bit, and of heads.
    pub(crate) damaged: f64,
    pub(crate) heads_damaged: f64,
    /// The master's and encoder's clock, as a share of the nominal one.
    pub(crate) clock: f64,
    pub(crate) begins_low: bool,
}

impl Link {
    pub(crate) const PLAIN: Self = Self {
        frames: 88,
        start_up: false,
        width: 32,
        signed: false,
        from: 3_000_000,
        speed: 0,
        jolt: 20,
        window: None,
        stuffing: 0,
        delay: 0.8,
        five_zeros: false,
        anew: false,
        messages: false,
        damaged: 0.0,
        heads_damaged: 0.0,
        clock: 1.0,
        begins_low: false,
    };
}

impl Link {
    /// A position as a number: with its sign where the identifier says that there is one.
    fn counts(&self, position: i64) -> i64 {
        let raw = forty(self, position) as i64;
        if self.start_up && raw >> 39 == 1 { raw - (1 << 40) } else { raw }
    }
}

/// What goes over the parameters channel: each side says one symbol a frame.
#[derive(Debug, Default)]
struct Talk {
    master: VecDeque<(u8, Option<String>)>,
    encoder: VecDeque<(u8, Option<String>)>,
    gap: u64,
}

impl Talk {
    fn say(queue: &mut VecDeque<(u8, Option<String>)>, bytes: &[u8], text: String) {
        let bytes = sealed(bytes);
        let mut text = Some(text);
        let last = 2 * bytes.len() - 1;
        for at in 0..=last {
            let byte = bytes[at / 2];
            let nibble = if at % 2 == 0 { byte >> 4 } else { byte & 15 };
            queue.push_back((nibble, if at == last { text.take() } else { None }));
        }
        // A symbol that is none ends a message.
        queue.push_back((0x10, None));
    }

    /// The same of an encoder, whose answer has no length that is known before it has ended.
    fn answer(queue: &mut VecDeque<(u8, Option<String>)>, bytes: &[u8], text: String) {
        Self::say(queue, bytes, String::new());
        let end = queue.len();
        queue[end - 2].1 = None;
        queue[end - 1].1 = Some(text);
    }

    /// Both are quiet: a long request, and while it waits a short one; the answers in either order.
    fn begin(&mut self, rng: &mut Rng) {
        if !self.master.is_empty() || !self.encoder.is_empty() {
            return;
        }
        if self.gap > 0 {
            self.gap -= 1;
            return;
        }
        self.gap = rng.below(6);
        let register = rng.below(64) as u8;
        let data = rng.below(256) as u8;
        let (address, name) = rng.pick(&RESOURCES);
        let content: Vec<u8> = (0..8).map(|_| rng.below(256) as u8).collect();
        let long = [0x80 | 0x40 | 0x0c | (address >> 8) as u8, address as u8];
        let which = rng.below(4);
        let read = rng.chance(0.5);
        let number = 0x40 + register;
        let (short, short_text, answer, answer_text) = if read {
            (
                vec![0x40 | register],
                format!("read register {number:02X}h"),
                vec![0x40 | register, data],
                format!("register {number:02X}h holds {data:02X}h"),
            )
        } else {
            (
                vec![register, data],
                format!("write register {number:02X}h = {data:02X}h"),
                vec![register],
                format!("register {number:02X}h is written"),
            )
        };
        let hex: Vec<String> = content.iter().map(|byte| format!("{byte:02X}")).collect();
        let long_answer = [&long[..], &content].concat();
        let long_text = format!("{name} holds {}", hex.join(" "));
        if which != 0 {
            Self::say(&mut self.master, &long, format!("direct read of {name}, 8 bytes"));
        }
        if which != 1 {
            Self::say(&mut self.master, &short, short_text);
        }
        // The encoder thinks until both have been asked, and some frames more.
        let quiet = self.master.len() + 1 + rng.below(5) as usize;
        self.encoder.extend((0..quiet).map(|_| (0x10, None)));
        match which {
            0 => Self::answer(&mut self.encoder, &answer, answer_text),
            1 => Self::answer(&mut self.encoder, &long_answer, long_text),
            2 => {
                Self::answer(&mut self.encoder, &answer, answer_text);
                Self::answer(&mut self.encoder, &long_answer, long_text);
            }
            _ => {
                Self::answer(&mut self.encoder, &long_answer, long_text);
                Self::answer(&mut self.encoder, &answer, answer_text);
            }
        }
    }
}

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
        self.said.push(Said { kind: "H-frame", start, fields, position: None, damaged });
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

    /// 61 bits of the encoder.
    fn answer(&mut self, released: f64, line: &[bool]) -> (f64, bool) {
        let start = released + (1.0 + self.link.delay) * self.bit;
        let mut line = line.to_vec();
        let damaged = self.rng.chance(self.link.damaged);
        if damaged {
            let at = self.rng.below(61) as usize;
            line[at] = !line[at];
        }
        let end = self.wire.send(start, self.bit, &line);
        self.wire.drive(end, true);
        // Without its head nobody can tell what it is.
        (start, damaged || self.damaged)
    }

    /// A message that ends with the frame said last.
    fn message(&mut self, text: Option<String>) {
        let (Some(text), Some(last)) = (text, self.said.last()) else { return };
        let (start, damaged) = (last.start, last.damaged);
        let fields = vec![("message", Shown::Text(text))];
        self.said.push(Said { kind: "message", start, fields, position: None, damaged });
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
                        let (start, damaged) = self.answer(end, &line);
                        let fields = vec![("ENC_ID", Shown::Number(id.into()))];
                        self.said.push(Said { kind: "identifier", start, fields, position: None, damaged });
                    }
                    _ => {
                        let (start, damaged) = self.answer(end, &bits(PATTERN));
                        let fields = vec![self.delay()];
                        self.said.push(Said { kind: "test pattern", start, fields, position: None, damaged });
                    }
                }
                self.tail(end, !matches!(code, 0x1f | 0x19));
            }
        }
    }
}

/// 40 bits as the encoder sends them.
fn forty(link: &Link, position: i64) -> u64 {
    let modulus = 1_i64 << link.width;
    let within = position.rem_euclid(modulus);
    let value = if link.signed && within >= modulus / 2 { within - modulus } else { within };
    value as u64 & 0xff_ffff_ffff
}

/// Builds a link.
pub(crate) fn build(link: &Link, seed: u64) -> Built {
    let rng = Rng::new(seed);
    let bit = BIT * link.clock;
    let wire = Wire::new(!link.begins_low);
    let edge = link.window.map_or(0, |window| window.clamp(25, 72));
    let mut b = Builder { link, rng, wire, said: Vec::new(), now: 40.0 * bit, bit, plus: false, damaged: false, edge };
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
    // V-frames so far of which the first answer is there, and whether this one is.
    let mut whole = false;
    let mut quality = if link.start_up { 8 } else { 15 };
    let mut msync = b.rng.chance(0.5);
    for _ in 0..link.frames {
        if at == 0 {
            whole = true;
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
        let (start, damaged) = b.answer(end, &line);
        let raw = forty(link, position);
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
        b.said.push(Said { kind: "answer", start, fields, position: Some(("POS", link.counts(position))), damaged });
        b.message(told);
        vertical.damaged |= damaged;
        if vsync {
            if whole {
                quality = (quality + 2).min(15);
                let quality = if link.damaged > 0.0 { Shown::Any } else { Shown::Number(quality) };
                b.said.push(vertical.said(start, quality));
            }
            running = true;
        }
        at = (at + 1) % 8;
        b.tail(end, true);
    }
    let end = b.now + 30.0 * bit;
    Built { wire: b.wire, said: b.said, end }
}

/// What goes over the vertical and the secondary channel in eight frames.
struct Vertical {
    toggle: bool,
    blocks: [Vec<u8>; 2],
    fields: Vec<(&'static str, Shown)>,
    position: i64,
    damaged: bool,
}

impl Vertical {
    /// `position`: that of the sampling before it.
    fn new(link: &Link, position: i64, toggle: bool, rng: &mut Rng) -> Self {
        let summary = rng.pick(&[0, 0, 0x01, 0x40]);
        let status = 0x1c | u8::from(toggle) << 7;
        let first = forty(link, position);
        let second = !first & 0xff_ffff_ffff;
        let block = |head: u8, value: u64| sealed(&[&[head][..], &value.to_be_bytes()[3..]].concat());
        let fields = vec![
            ("SUMMARY", Shown::Number(summary.into())),
            ("VPOS", Shown::Number(first as i64)),
            ("STATUS2", Shown::Number(status.into())),
            ("VPOS2", Shown::Number(second as i64)),
        ];
        let blocks = [block(summary, first), block(status, second)];
        Self { toggle, blocks, fields, position: link.counts(position), damaged: false }
    }

    fn said(&self, start: f64, quality: Shown) -> Said {
        let fields = [self.fields.clone(), vec![("QM", quality)]].concat();
        Said { kind: "V-frame", start, fields, position: Some(("VPOS", self.position)), damaged: self.damaged }
    }
}
