//! A master and its RTEX drives, block by block: what a log of them holds. No code of the crates.

use super::rng::Rng;
use super::{Said, Shown};

/// Who is on the ring and what is said.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    pub(crate) drives: usize,
    pub(crate) periods: usize,
    /// Blocks of 32 bytes.
    pub(crate) wide: bool,
    /// Share of update periods in which something else than "normal" is begun.
    pub(crate) asked: f64,
    /// Share of these that the drive refuses.
    pub(crate) refused: f64,
    /// The last drive stops with an alarm half way.
    pub(crate) alarm: bool,
    /// Periods of NOPs before the start.
    pub(crate) nops: usize,
    /// Nanoseconds from one update period to the next.
    pub(crate) period: u64,
}

impl Ring {
    pub(crate) const PLAIN: Self =
        Self { drives: 1, periods: 60, wide: false, asked: 0.1, refused: 0.0, alarm: false, nops: 0, period: 500_000 };
}

/// A block as it is written down.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub(crate) ns: u64,
    pub(crate) from_master: bool,
    pub(crate) drive: u8,
    /// In which update period of the log.
    pub(crate) update: usize,
    pub(crate) bytes: Vec<u8>,
    pub(crate) said: Said,
}

/// A command of a drive, as its words are.
#[derive(Debug, Clone, Copy, Default)]
struct Order {
    code: u8,
    control: u16,
    data1: i32,
    /// Bytes 8 to 11, and what follows as a number.
    middle: [u8; 4],
    last: i32,
    /// Code, type, index, three words.
    sub: (u8, u8, u16, [i32; 3]),
}

/// A drive: the command that it will answer, where it is, and how it is.
struct Drive {
    mac: u8,
    before: Order,
    place: i32,
    holds: Option<(Order, u32)>,
    refuses: bool,
    alarmed: bool,
}

const CYCLIC: [&str; 5] = ["NOP", "PP", "CP", "CV", "CT"];
const NONCYCLIC: [(u8, &str); 8] = [
    (0, "normal"),
    (1, "reset"),
    (2, "system ID"),
    (4, "homing"),
    (5, "alarm"),
    (6, "parameter"),
    (7, "profile"),
    (10, "monitor"),
];
/// Bit 15 of bytes 2 and 3 first.
const STATUS: [&str; 16] = [
    "SI_MON5",
    "SI_MON4",
    "SI_MON3",
    "SI_MON2",
    "SI_MON1",
    "HOME",
    "POT",
    "NOT",
    "SERVO_ACTIVE",
    "SERVO_READY",
    "ALARM",
    "WARNING",
    "TORQUE_LIMITED",
    "HOMING_COMPLETE",
    "IN_PROGRESS",
    "IN_POSITION",
];
const CONTROL: [&str; 16] = [
    "HARD_STOP",
    "SMOOTH_STOP",
    "PAUSE",
    "",
    "SL_SW",
    "",
    "EX_OUT2",
    "EX_OUT1",
    "SERVO_ON",
    "",
    "",
    "GAIN_SW",
    "TL_SW",
    "HOMING_CTRL",
    "",
    "",
];
const SERVO_ON: u16 = 0x0080;
const REFUSALS: [(u16, &str); 3] =
    [(0x0031, "0031h (type code not known)"), (0x0032, "0032h (index or data out of range)"), (0x1234, "1234h")];

fn number(value: impl Into<i64>) -> Shown {
    Shown::Number(value.into())
}

fn flags(names: &[&'static str; 16], raw: u16) -> Shown {
    let set = (0..16).filter(|at| raw >> (15 - at) & 1 == 1).map(|at| names[at]).collect();
    Shown::Flags(raw.into(), set)
}

fn code(byte: u8) -> Shown {
    let other = NONCYCLIC.iter().find(|(code, _)| *code == byte & 15).unwrap().1;
    Shown::Text(format!("{} {other} ({byte:02X}h)", CYCLIC[usize::from(byte >> 4 & 7)]))
}

/// A command other than "normal", and how long it is kept up.
fn ask(rng: &mut Rng, cyclic: u8) -> (u8, [u8; 4], i32) {
    let data = rng.next() as i32;
    let wide = |kind: u16, index: u16| {
        let ([k0, k1], [i0, i1]) = (kind.to_le_bytes(), index.to_le_bytes());
        [k0, k1, i0, i1]
    };
    let kind = rng.pick(&[2, 4, 5, 6, 7, 10, 10]);
    match kind {
        7 if cyclic == 1 => (7, [0x11, 0, rng.below(16) as u8, rng.below(256) as u8], data),
        4 => (4, [0x21, 0, rng.below(256) as u8, rng.below(256) as u8], data),
        2 => (2, wide(rng.pick(&[0x01, 0x12, 0x120]), rng.below(3) as u16), 0),
        5 => (5, wide(0, 0), 0),
        6 => (6, wide(0x11, rng.next() as u16), data),
        _ => (10, wide(rng.pick(&[0x01, 0x07, 0x101, 0x112]), 0), 0),
    }
}

/// What is in bytes 8 to 15 of a command.
fn asked(order: &Order) -> Vec<(&'static str, Shown)> {
    let [b8, b9, b10, b11] = order.middle;
    let word = i32::from_le_bytes(order.middle);
    let generic = |last| {
        vec![
            ("Type_Code", number(u16::from_le_bytes([b8, b9]))),
            ("Index", number(u16::from_le_bytes([b10, b11]))),
            (last, number(order.last)),
        ]
    };
    match order.code & 15 {
        0 => vec![("Command_Data2", number(word)), ("Command_Data3", number(order.last))],
        4 => vec![
            ("Type_Code", number(b8)),
            ("Latch_Sel1", number(b10 & 15)),
            ("Latch_Sel2", number(b10 >> 4)),
            ("Monitor_Sel", number(b11)),
            ("Setting_Data", number(order.last)),
        ],
        7 => vec![
            ("Type_Code", number(b8)),
            ("Latch_Sel1", number(b10 & 15)),
            ("Monitor_Sel", number(b11)),
            ("Target_Speed", number(order.last)),
        ],
        6 => generic("Setting_Data"),
        _ => generic("Command_Data3"),
    }
}

fn command(drive: u8, counter: u8, order: &Order, wide: bool) -> (Vec<u8>, Vec<(&'static str, Shown)>) {
    let mut bytes = vec![counter << 5 | drive, order.code];
    bytes.extend(order.control.to_le_bytes());
    bytes.extend(order.data1.to_le_bytes());
    bytes.extend(order.middle);
    bytes.extend(order.last.to_le_bytes());
    let data1 = ["Command_Data1", "Target_Position", "Command_Position", "Command_Speed", "Command_Torque"]
        [usize::from(order.code >> 4)];
    let mut fields = vec![
        ("TMG_CNT", number(0)),
        ("Command_Code", code(order.code)),
        ("Control_Bits", flags(&CONTROL, order.control)),
        (data1, number(order.data1)),
    ];
    fields.extend(
        (0..16).filter(|at| !CONTROL[*at].is_empty()).map(|at| (CONTROL[at], number(order.control >> (15 - at) & 1))),
    );
    fields.extend(asked(order));
    if wide {
        let (sub, kind, index, [a, b, c]) = order.sub;
        bytes.extend([0x80 | sub, kind]);
        bytes.extend(index.to_le_bytes());
        bytes.extend([a, b, c].iter().flat_map(|word| word.to_le_bytes()));
        fields.extend([
            ("Sub_Chk", number(1)),
            ("Sub_Command_Code", number(sub)),
            ("Sub_Type_Code", number(kind)),
            ("Sub_Index", number(index)),
            ("Sub_Command_Data1", number(a)),
            ("Sub_Command_Data2", number(b)),
            ("Sub_Command_Data3", number(c)),
        ]);
    }
    (bytes, fields)
}

/// What a drive says in bytes 8 to 15 to the command before, and what of it may be shown.
fn answer(drive: &Drive, rng: &mut Rng) -> ([u8; 8], Vec<(&'static str, Shown)>) {
    let order = &drive.before;
    let mut bytes = [0; 8];
    if drive.refuses {
        let (code, text) = rng.pick(&REFUSALS);
        bytes[..2].copy_from_slice(&code.to_le_bytes());
        return (bytes, vec![("Error_Code", Shown::Text(text.to_owned()))]);
    }
    let data = rng.next() as i32;
    let [b8, b9, b10, b11] = order.middle;
    // ERR, WNG, Busy.
    let state = rng.pick(&[0, 0, 0x10, 0x40, 0x80]);
    let mut said =
        vec![("ERR", number(state >> 7 & 1)), ("WNG", number(state >> 6 & 1)), ("BUSY", number(state >> 4 & 1))];
    bytes[4..].copy_from_slice(&data.to_le_bytes());
    let kind = ("Type_Code_Echo", number(u16::from_le_bytes([b8, b9])));
    let index = ("Index_Echo", number(u16::from_le_bytes([b10, b11])));
    match order.code & 15 {
        0 => {
            let speed = rng.next() as i32;
            bytes[..4].copy_from_slice(&speed.to_le_bytes());
            return (bytes, vec![("Response_Data2", number(speed)), ("Response_Data3", number(data))]);
        }
        4 | 7 => {
            let low = if order.code & 15 == 4 { rng.below(4) } else { rng.below(16) } as u8;
            bytes[..4].copy_from_slice(&[b8, state | low, b10, b11]);
            said.extend([
                ("Type_Code_Echo", number(b8)),
                ("LATCH_COMP1", number(low & 1)),
                ("Monitor_Sel_Echo", number(b11)),
                ("Monitor_Data", number(data)),
                ("Latch_Sel1_Echo", number(b10 & 15)),
            ]);
            if order.code & 15 == 4 {
                said.extend([("LATCH_COMP2", number(low >> 1 & 1)), ("Latch_Sel2_Echo", number(b10 >> 4))]);
            } else {
                said.extend([("PSL", number(low >> 3)), ("NSL", number(low >> 2 & 1)), ("NEAR", number(low >> 1 & 1))]);
            }
        }
        2 => {
            let text = rng.pick(&[*b"Pana", *b"soni", *b"c\0\0\0"]);
            bytes[..4].copy_from_slice(&[b8, state | b9, b10, b11]);
            bytes[4..].copy_from_slice(&text);
            let shown = match &text {
                b"c\0\0\0" => r#""c\x00\x00\x00""#.to_owned(),
                text => format!("\"{}\"", String::from_utf8_lossy(text)),
            };
            said.extend([kind, index, ("ASCII", Shown::Text(shown))]);
        }
        5 => {
            bytes[..4].copy_from_slice(&[b8, state | b9, b10, b11]);
            bytes[4..].copy_from_slice(&[14, 1, 0xa2, 0]);
            let text = "Err14.1 warning 00A2h, or attributes 00A2010Eh";
            said.extend([kind, index, ("Alarm_Data", Shown::Text(text.to_owned()))]);
        }
        _ => {
            bytes[..4].copy_from_slice(&[b8, state | b9, b10, b11]);
            said.extend([kind, index, ("Monitor_Data", number(data))]);
        }
    }
    (bytes, said)
}

/// The response to the command of the update period before, with the counter of this one.
fn response(drive: &Drive, counter: u8, wide: bool, rng: &mut Rng) -> (Vec<u8>, Vec<(&'static str, Shown)>) {
    let order = &drive.before;
    let status = if drive.alarmed {
        0x0020
    } else if order.control & SERVO_ON == 0 {
        0x0040
    } else {
        0x00c0
    };
    let status = status | rng.pick(&[0x0000, 0x0001, 0x0002]) | (rng.below(8) as u16) << 8;
    let mut bytes = vec![0x80 | counter << 5 | drive.mac, order.code | u8::from(drive.refuses) << 7];
    bytes.extend(status.to_le_bytes());
    bytes.extend(drive.place.to_le_bytes());
    let (rest, said) = answer(drive, rng);
    bytes.extend(rest);
    let mut fields = vec![
        ("CMD_Error", number(u8::from(drive.refuses))),
        ("Command_Code_Echo", code(order.code)),
        ("Status_Flags", flags(&STATUS, status)),
        ("Response_Data1", number(drive.place)),
    ];
    fields.extend((0..16).map(|at| (STATUS[at], number(status >> (15 - at) & 1))));
    fields.extend(said);
    if wide {
        let (sub, kind, index, _) = order.sub;
        let [a, b, c] = [rng.next() as i32, rng.next() as i32, rng.next() as i32];
        bytes.extend([sub, kind]);
        bytes.extend(index.to_le_bytes());
        bytes.extend([a, b, c].iter().flat_map(|word| word.to_le_bytes()));
        let bits = ["Sub_CMD_Err", "Sub_ERR", "Sub_WNG", "Sub_Busy"].map(|name| (name, number(0)));
        fields.extend(bits);
        fields.extend([
            ("Sub_Command_Code_Echo", number(sub)),
            ("Sub_Type_Code_Echo", number(kind)),
            ("Sub_Index_Echo", number(index)),
            ("Sub_Response_Data1", number(a)),
            ("Sub_Response_Data2", number(b)),
            ("Sub_Response_Data3", number(c)),
        ]);
    }
    (bytes, fields)
}

impl Drive {
    /// Its next command: what is under way until its echo came, else something new or "normal".
    fn next(&mut self, ring: &Ring, period: usize, rng: &mut Rng) -> Order {
        let cyclic = 1 + self.mac % 4;
        let control = if period < 4 { 0 } else { SERVO_ON } | (rng.below(4) as u16) << 8;
        self.place = self.place.wrapping_add(rng.about(40) as i32);
        let holds = self.holds.take().filter(|(_, left)| *left > 0);
        let (order, left) = holds.unwrap_or_else(|| {
            if !rng.chance(ring.asked) {
                let sub = (0, 0, 0, [0, rng.next() as i32, rng.next() as i32]);
                let middle = (rng.next() as i32).to_le_bytes();
                return (Order { code: cyclic << 4, middle, last: rng.next() as i32, sub, ..Order::default() }, 0);
            }
            let (kind, middle, last) = ask(rng, cyclic);
            self.refuses = false;
            let sub = (10, 0x07, 0, [0, 0, 0]);
            (Order { code: cyclic << 4 | kind, middle, last, sub, ..Order::default() }, 4)
        });
        if left > 0 {
            self.holds = Some((order, left - 1));
        }
        Order { control, data1: self.place, ..order }
    }
}

/// All blocks of a log, in its order.
pub(crate) fn build(ring: &Ring, seed: u64) -> Vec<Block> {
    let mut rng = Rng::new(seed);
    let mut out = Vec::new();
    let mut drives: Vec<Drive> = (0..ring.drives)
        .map(|at| Drive {
            mac: (at * 5 + 1) as u8,
            before: Order::default(),
            place: rng.next() as i32,
            holds: None,
            refuses: false,
            alarmed: false,
        })
        .collect();
    let mut keep = |update: usize, late, drive: u8, from_master, (bytes, fields): (Vec<u8>, Vec<_>)| {
        let ns = update as u64 * ring.period + late;
        let at = fields.iter().find(|(name, _)| *name == "Response_Data1");
        let position = at.and_then(|(name, value)| match value {
            Shown::Number(value) => Some((*name, *value)),
            _ => None,
        });
        let kind = format!("{} {drive}", if from_master { "cmd" } else { "rsp" });
        let said = Said { kind: kind.into(), start: ns as f64 * 1e3, fields, position, damaged: false };
        out.push(Block { ns, from_master, drive, update, bytes, said });
    };
    for update in 0..ring.nops + ring.periods {
        let counter = update.saturating_sub(ring.nops.saturating_sub(1)) as u8 & 3;
        let idle = update < ring.nops;
        for drive in &mut drives {
            let mut order = Order::default();
            if !idle {
                order = drive.next(ring, update - ring.nops, &mut rng);
            }
            let counter = if idle { 0 } else { counter };
            keep(update, 0, drive.mac, true, command(drive.mac, counter, &order, ring.wide));
            let said = response(drive, counter, ring.wide, &mut rng);
            keep(update, 30_000, drive.mac, false, said);
            // What is refused is so as long as it is asked.
            let new = order.code & 15 != 0 && drive.before.code != order.code;
            drive.refuses = order.code & 15 != 0 && (drive.refuses && !new || new && rng.chance(ring.refused));
            drive.before = order;
        }
        if let Some(last) = drives.last_mut().filter(|_| ring.alarm && update == ring.nops + ring.periods / 2) {
            last.alarmed = true;
        }
    }
    out
}
