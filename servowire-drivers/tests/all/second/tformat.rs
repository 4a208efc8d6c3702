//! A T-Format encoder, byte by byte: control fields, answers and the memory as the drivers in use have them.

/// At 2.5 Mbit/s; half of it at 5.
const FIELD_NS: u64 = 4_000;

/// An answer: its bytes, and when its first start bit is on the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub bytes: Vec<u8>,
    pub start_ns: u64,
}

#[derive(Debug, Clone)]
pub struct Encoder {
    pub abs: u32,
    pub turns: u32,
    pub enid: u8,
    /// The error byte, and which of its bits are still so.
    pub almc: u8,
    pub memory: [[u8; 127]; 6],
    pub page: u8,
    /// Whether it talks at 5 Mbit/s.
    pub fast: bool,
    /// From the end of a request to the answer.
    pub delay_ns: u64,
    /// How long a write to the memory lasts.
    pub store_ns: u64,
    busy_until_ns: u64,
    silent_until_ns: u64,
    request: Vec<u8>,
    last_ns: u64,
    reset: (u8, u8),
    /// Zeros set, turns cleared and errors cleared.
    pub zeros: u32,
    pub clears: u32,
    pub writes: u32,
}

impl Encoder {
    pub fn new() -> Self {
        let mut memory = [[0; 127]; 6];
        for (page, cells) in (0..).zip(&mut memory) {
            for (at, cell) in (0..).zip(cells) {
                *cell = page << 5 ^ at;
            }
        }
        Self {
            abs: 0x12_3456,
            turns: 3,
            enid: 0x17,
            almc: 0,
            memory,
            page: 0,
            fast: false,
            delay_ns: 3_000,
            store_ns: 18_000_000,
            busy_until_ns: 0,
            silent_until_ns: 0,
            request: Vec::new(),
            last_ns: 0,
            reset: (0, 0),
            zeros: 0,
            clears: 0,
            writes: 0,
        }
    }

    pub fn field_ns(&self) -> u64 {
        if self.fast { FIELD_NS / 2 } else { FIELD_NS }
    }

    /// It was without supply: the page register and all counts begin anew, the memory stays.
    pub fn restart(&mut self, now_ns: u64) {
        (self.page, self.reset, self.busy_until_ns, self.silent_until_ns) = (0, (0, 0), 0, now_ns);
        self.request.clear();
    }

    /// It is not there.
    pub fn silent(&mut self) {
        self.silent_until_ns = u64::MAX;
    }

    /// A byte ended at `end_ns`; what it answers, if the request is complete.
    pub fn hear(&mut self, byte: u8, framed: bool, end_ns: u64) -> Option<Answer> {
        if end_ns < self.silent_until_ns {
            return None;
        }
        // A pause ends a request that is not complete.
        if end_ns > self.last_ns + 3 * self.field_ns() {
            self.request.clear();
        }
        self.last_ns = end_ns;
        self.request.push(byte);
        let request = self.request.clone();
        let bytes = match *request {
            _ if !framed => self.refuse(0x80),
            [0xea | 0x32] | [0xea | 0x32, _] | [0x32, _, _] => return None,
            [cf @ (0x02 | 0x8a | 0x92 | 0x1a)] => self.readout(cf),
            [cf @ (0xba | 0xc2 | 0x62)] => self.reset(cf, end_ns),
            [0xea, adf, check] if check == 0xea ^ adf => self.memory(adf, None, end_ns),
            [0x32, adf, edf, check] if check == 0x32 ^ adf ^ edf => self.memory(adf, Some(edf), end_ns),
            _ => self.refuse(0x40),
        };
        if !matches!(*request, [0xba | 0xc2 | 0x62]) {
            self.reset = (0, 0);
        }
        self.request.clear();
        Some(Answer { bytes, start_ns: end_ns + self.delay_ns })
    }

    fn status(&self) -> u8 {
        u8::from(self.almc & 0x04 != 0) << 4 | u8::from(self.almc & 0xf0 != 0) << 5
    }

    fn readout(&self, cf: u8) -> Vec<u8> {
        let [a0, a1, a2, _] = self.abs.to_le_bytes();
        let [m0, m1, m2, _] = self.turns.to_le_bytes();
        let sf = self.status();
        checked(match cf {
            0x8a => vec![cf, sf, m0, m1, m2],
            0x92 => vec![cf, sf, self.enid],
            0x1a => vec![cf, sf, a0, a1, a2, self.enid, m0, m1, m2, self.almc],
            _ => vec![cf, sf, a0, a1, a2],
        })
    }

    fn refuse(&self, why: u8) -> Vec<u8> {
        let mut bytes = self.readout(0x1a);
        bytes.pop();
        bytes[1] |= why;
        checked(bytes)
    }

    /// The tenth in a row has its effect.
    fn reset(&mut self, cf: u8, now_ns: u64) -> Vec<u8> {
        self.reset = if self.reset.0 == cf { (cf, self.reset.1 + 1) } else { (cf, 1) };
        let bytes = self.readout(cf);
        if self.reset.1 == 10 {
            self.reset = (0, 0);
            if cf == 0xc2 {
                (self.abs, self.zeros) = (0, self.zeros + 1);
                self.silent_until_ns = now_ns + 40_000;
            } else {
                (self.almc, self.clears) = (0, self.clears + 1);
            }
            if cf == 0x62 {
                self.turns = 0;
            }
        }
        bytes
    }

    fn memory(&mut self, adf: u8, write: Option<u8>, now_ns: u64) -> Vec<u8> {
        let (cf, at) = (if write.is_some() { 0x32 } else { 0xea }, usize::from(adf & 0x7f));
        if now_ns < self.busy_until_ns {
            return checked(vec![cf, adf | 0x80, 0xa5]);
        }
        let cell = match self.memory.get_mut(usize::from(self.page)).and_then(|page| page.get_mut(at)) {
            Some(cell) => cell,
            None => &mut self.page,
        };
        if let Some(data) = write {
            *cell = data;
            self.writes += u32::from(at < 127);
            self.busy_until_ns = now_ns + self.store_ns;
        }
        checked(vec![cf, adf & 0x7f, *cell])
    }
}

/// With the exclusive or of all bytes after them.
fn checked(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.push(bytes.iter().fold(0, |sum, byte| sum ^ byte));
    bytes
}
