//! An A-format encoder of version 2.1, bit by bit: the first bit of the line in bit 0 of a frame.

/// Bits of a frame with start bit and delimiter.
const FRAME_BITS: u64 = 18;

/// An answer: the contents of its frames, and when its first start bit is on the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub frames: Vec<u16>,
    pub start_ns: u64,
}

#[derive(Debug, Clone)]
pub struct Encoder {
    pub ea: u8,
    pub single: u32,
    pub turns: u16,
    /// The alarm field.
    pub alm: u16,
    pub memory: [u16; 256],
    pub delay_ns: u64,
    bit_ns: u64,
    request: Vec<u16>,
    last_ns: u64,
    reset: (u8, u8),
    /// An address that was read once: the second answer has its data.
    latched: Option<u8>,
    pub clears: u32,
}

impl Encoder {
    /// 20 bits a turn; `bit_ns` is 400 at 2.5 Mbit/s.
    pub fn new(ea: u8, bit_ns: u64) -> Self {
        let mut memory = [0; 256];
        for (at, word) in (0..).zip(&mut memory) {
            *word = at ^ 0x5a00;
        }
        // 20 bits a turn, turns counted optically, no battery.
        memory[0xf6] = 1 | 2 << 3;
        Self {
            ea,
            single: 0x3_4567,
            turns: 3,
            alm: 0,
            memory,
            delay_ns: 7 * bit_ns,
            bit_ns,
            request: Vec::new(),
            last_ns: 0,
            reset: (0, 0),
            latched: None,
            clears: 0,
        }
    }

    pub fn frame_ns(&self) -> u64 {
        FRAME_BITS * self.bit_ns
    }

    /// After the supply was gone for a moment.
    pub fn restart(&mut self) {
        self.request.clear();
        (self.reset, self.latched) = ((0, 0), None);
    }

    /// A frame ended at `end_ns`, with a delimiter of 1 if it is `framed`; what it answers, if the request is complete. On a bus an encoder waits for those before it: for
    /// each 72 bits and 3 us.
    pub fn hear(&mut self, content: u16, framed: bool, end_ns: u64) -> Option<Answer> {
        if end_ns > self.last_ns + 3 * self.frame_ns() {
            self.request.clear();
        }
        self.last_ns = end_ns;
        // A request begins 0, 1, 0 and has its own check of three bits.
        if !framed || content & 7 != 2 || remainder(&bits(u64::from(content) >> 3, 13), 3, 0b1011) != 0 {
            self.request.clear();
            return None;
        }
        self.request.push(content);
        let field = |frame: u16, from: u32, len: u32| frame >> from & ((1 << len) - 1);
        let [command, rest @ ..] = &*self.request else { return None };
        let (ea, cc) = (field(*command, 5, 3) as u8, field(*command, 8, 5) as u8);
        let many = matches!(cc, 4 | 5 | 6 | 7 | 22 | 28 | 30);
        if field(*command, 3, 2) != 0 || !many && ea != self.ea || many && ea < self.ea {
            self.request.clear();
            return None;
        }
        let argument = match (cc, rest) {
            (13, []) => return None,
            (13, [address]) => field(*address, 5, 8) as u8,
            (13, _) | (_, [_, ..]) => {
                self.request.clear();
                return None;
            }
            _ => 0,
        };
        self.request.clear();
        let before = if many { u64::from(self.ea) } else { 0 };
        let frames = self.answer(cc, argument)?;
        let start_ns = end_ns + self.delay_ns + before * (4 * self.frame_ns() + 3_000);
        Some(Answer { frames, start_ns })
    }

    fn answer(&mut self, cc: u8, argument: u8) -> Option<Vec<u16>> {
        self.reset = if (8..=12).contains(&cc) && self.reset.0 == cc { (cc, self.reset.1 + 1) } else { (cc, 1) };
        if cc == 8 && self.reset.1 == 8 {
            (self.alm, self.clears) = (0, self.clears + 1);
        }
        let latched = self.latched.take();
        let abs = u64::from(self.turns) << 20 | u64::from(self.single);
        Some(match cc {
            0 | 4 => self.frames(cc, &[(abs, 40)]),
            1 | 5 => self.frames(cc, &[(abs & 0xff_ffff, 24)]),
            3 | 7 | 8..=10 => self.frames(cc, &[(self.alm.into(), 16), (0, 8)]),
            13 => {
                // Nobody says what the data of the first answer are.
                let word = if latched == Some(argument) { self.memory[usize::from(argument)] } else { 0xdead };
                let busy = latched != Some(argument);
                self.latched = Some(argument);
                self.frames_with(cc, busy, &[(word.into(), 16), (argument.into(), 8)])
            }
            16 | 17 => self.frames(cc, &[(0x0012_3456, 24)]),
            27 | 28 => self.frames(cc, &[(abs & 0xff_ffff, 24), (self.alm.into(), 16)]),
            _ => return None,
        })
    }

    fn frames(&self, cc: u8, fields: &[(u64, u32)]) -> Vec<u16> {
        self.frames_with(cc, false, fields)
    }

    fn frames_with(&self, cc: u8, busy: bool, fields: &[(u64, u32)]) -> Vec<u16> {
        let any = |mask: u16| u64::from(self.alm & mask != 0);
        let es = any(0x0180) | u64::from(busy) | any(0x0001) << 1 | any(0x0218) << 2 | any(0x0462) << 3;
        let mut line = Vec::new();
        for (value, len) in [(4, 3), (self.ea.into(), 3), (cc.into(), 5), (0, 1), (es, 4)].iter().chain(fields) {
            line.extend(bits(*value, *len));
        }
        line.extend([false; 8]);
        let check = remainder(&line, 8, 0x11d);
        let at = line.len() - 8;
        for (k, bit) in line[at..].iter_mut().enumerate() {
            *bit = check >> (7 - k) & 1 == 1;
        }
        line.chunks(16).map(|frame| (0..).zip(frame).map(|(k, bit)| u16::from(*bit) << k).sum()).collect()
    }
}

/// The least significant bit first.
fn bits(value: u64, len: u32) -> Vec<bool> {
    (0..len).map(|k| value >> k & 1 == 1).collect()
}

/// What a long division of the bits by a generator leaves.
fn remainder(line: &[bool], width: u32, generator: u32) -> u32 {
    line.iter().fold(0, |rest, bit| {
        let rest = rest << 1 | u32::from(*bit);
        if rest >> width & 1 == 1 { rest ^ generator } else { rest }
    })
}
