//! What an application sees of the registers, and the FIFO of the pipe channel; the default dialect.

use hdsl::registers::PipeFifo;
use hdsl::sampling::TEST_PATTERN;
use hdsl::symbol::{Character, Control, Rule, RunningDisparity, Word};
use hdsl::{Dialect, MasterSymbol};
use serde::Deserialize;

use super::bench::Bench;
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

/// Six characters as an answer, switch bit included; every word in column RD-.
fn answer(characters: [Character; 6]) -> u64 {
    let words = characters.map(|character| u64::from(character.encode(RunningDisparity::Minus).word.get()));
    let five = words.iter().take(5).rev().fold(0, |line, word| line << 10 | word);
    let [.., last] = words;
    five | (1 ^ five >> 49) << 50 | last << 51
}

/// CRC-16 of the link by long division: polynomial 90D9h, initial value 0, final XOR 00FFh.
fn crc(bytes: &[u8]) -> u16 {
    let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |at| u16::from(byte >> at & 1)));
    let rest = bits.fold(0_u16, |rest, bit| (rest << 1) ^ if rest >> 15 ^ bit == 1 { 0x90d9 } else { 0 });
    rest ^ 0x00ff
}

fn sealed(block: [u8; 6]) -> [u8; 8] {
    let [high, low] = crc(&block).to_be_bytes();
    let [a, b, c, d, e, f] = block;
    [a, b, c, d, e, f, high, low]
}

/// The encoder of these rows: 32 position bits, at standstill at position 0.
#[derive(Default)]
struct Encoder {
    at: u8,
}

/// One answer of it.
#[derive(Clone, Copy)]
struct Frame {
    symbol: u8,
    acceleration: [u8; 2],
    block: [Character; 8],
}

impl Frame {
    fn good() -> Self {
        Self { symbol: 0x10, acceleration: [0x00, 0x1f], block: sealed([0; 6]).map(Character::data) }
    }
}

impl Encoder {
    fn next(&mut self, frame: Frame) -> u64 {
        let at = usize::from(self.at);
        let second = sealed([0x1c, 0, 0, 0, 0, 0]);
        let secondary = match second.get(at) {
            Some(_) if at == 0 => Character::control(Control::K28_0),
            byte => Character::data(byte.copied().unwrap_or(0)),
        };
        let vsync = if at == 7 { 0x80 } else { 0 };
        let [high, low] = frame.acceleration.map(Character::data);
        let vertical = frame.block.get(at).copied().unwrap_or(Character::data(0));
        self.at = (self.at + 1) % 8;
        let parameter = Character::data(frame.symbol | vsync);
        answer([vertical, parameter, Character::control(Control::K30_7), high, low, secondary])
    }
}

struct Desk {
    bench: Bench,
    encoder: Encoder,
}

impl Desk {
    /// Locked, 48 good frames, events cleared.
    fn new() -> Result<Self, Fault> {
        let mut bench = Bench::new(Dialect::SICK);
        let mut encoder = Encoder::default();
        // RESET 2, SYNC 16, START 9, LEARN 9, CHECK 16: the test pattern where it is asked for.
        for _ in 0..52 {
            bench.feed(TEST_PATTERN)?;
        }
        // 00153h twice: 11 bits of acceleration, 32 of position.
        let id = [0x53, 0x01, 0x00, 0x01, 0x53, 0x00].map(Character::data);
        bench.feed(answer(id))?;
        for _ in 0..8 {
            bench.feed(encoder.next(Frame::good()))?;
        }
        let mut desk = Self { bench, encoder };
        desk.idle(48)?;
        for register in [0x04, 0x05, 0x3d] {
            desk.bench.write(register, 0)?;
        }
        same("locked", &Some(0x8f), &desk.bench.map.byte(0x03))?;
        Ok(desk)
    }

    fn frame(&mut self, frame: Frame) -> Result<(), Fault> {
        self.bench.feed(self.encoder.next(frame)).map(|_| ())
    }

    fn idle(&mut self, count: u32) -> Result<(), Fault> {
        (0..count).try_for_each(|_| self.frame(Frame::good()))
    }

    /// What the master says in the present frame.
    fn symbol(&self) -> Option<u8> {
        self.bench.master.transmission().head.byte().symbol().ok().map(MasterSymbol::code)
    }

    fn v_frame(&mut self, summary: u8, kind: &str) -> Result<(), Fault> {
        while self.encoder.at != 0 {
            self.idle(1)?;
        }
        let mut block = sealed([summary, 0, 0, 0, 0, 0]).map(Character::data);
        match kind {
            "ok" => {}
            "crc" => {
                let [.., last] = &mut block;
                *last = Character::data(last.byte() ^ 1);
            }
            "invalid" => {
                block = sealed([summary, 0xfd, 0xfd, 0xfd, 0xfd, 0xfd]).map(Character::data);
                for place in block.iter_mut().skip(1).take(5) {
                    *place = Character::control(Control::K29_7);
                }
            }
            other => return Err(Fault::Unreadable(format!("unknown kind of V-frame {other:?}"))),
        }
        (0..8).try_for_each(|_| self.frame(Frame { block, ..Frame::good() }))
    }

    /// Waits at most 16 frames with IDLE for `first`, then every frame has to bring the next symbol.
    fn sent(&mut self, symbols: &[u8]) -> Result<(), Fault> {
        let mut waited = 0;
        while self.symbol() == Some(0x10) && waited < 16 {
            self.idle(1)?;
            waited += 1;
        }
        for symbol in symbols {
            same("symbol sent", &Some(*symbol), &self.symbol())?;
            self.idle(1)?;
        }
        Ok(())
    }

    fn op(&mut self, op: Op) -> Result<(), Fault> {
        let good = Frame::good();
        match op {
            Op::Write(address, value) => self.bench.write(address.0 as u8, value.0 as u8),
            Op::Read(address, mask, value) => {
                let got = self.bench.map.read(address.0 as u8).map(|byte| Hex(u64::from(byte) & mask.0));
                same("register", &Some(value), &got)
            }
            Op::Idle(count) => self.idle(count),
            Op::BadAcc(count) => (0..count).try_for_each(|_| self.frame(Frame { acceleration: [0x00, 0x01], ..good })),
            Op::EncoderInit(count) => (0..count).try_for_each(|_| self.frame(Frame { symbol: 0x1f, ..good })),
            Op::VFrame(summary, kind) => self.v_frame(summary.0 as u8, &kind),
            Op::Sent(bytes) => {
                let nibbles: Vec<u8> = bytes.0.iter().flat_map(|byte| [byte >> 4, byte & 15]).collect();
                self.sent(&nibbles)
            }
            Op::SentInit => self.sent(&[0x1e]),
            Op::Answer(symbols) => {
                symbols.iter().try_for_each(|symbol| self.frame(Frame { symbol: symbol.0 as u8, ..good }))
            }
        }
    }
}

enum Op {
    Write(Hex, Hex),
    Read(Hex, Hex, Hex),
    Idle(u32),
    BadAcc(u32),
    EncoderInit(u32),
    VFrame(Hex, String),
    Sent(Bytes),
    SentInit,
    Answer(Vec<Hex>),
}

impl<'de> Deserialize<'de> for Op {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        fn read<T: serde::de::DeserializeOwned, E: serde::de::Error>(rest: serde_json::Value) -> Result<T, E> {
            serde_json::from_value(rest).map_err(E::custom)
        }
        let parts = Vec::<serde_json::Value>::deserialize(from)?;
        let name = parts.first().and_then(|name| name.as_str()).unwrap_or_default().to_owned();
        let rest = serde_json::Value::Array(parts.into_iter().skip(1).collect());
        Ok(match name.as_str() {
            "write" => read(rest).map(|(address, value)| Self::Write(address, value))?,
            "read" => read(rest).map(|(address, mask, value)| Self::Read(address, mask, value))?,
            "idle" => read(rest).map(|(count,)| Self::Idle(count))?,
            "bad_acc" => read(rest).map(|(count,)| Self::BadAcc(count))?,
            "encoder_init" => read(rest).map(|(count,)| Self::EncoderInit(count))?,
            "vframe" => read(rest).map(|(summary, kind)| Self::VFrame(summary, kind))?,
            "sent" => read(rest).map(|(bytes,)| Self::Sent(bytes))?,
            "sent_init" => read::<[(); 0], _>(rest).map(|_| Self::SentInit)?,
            "answer" => read(rest).map(|(symbols,)| Self::Answer(symbols))?,
            other => return Err(serde::de::Error::custom(format!("unknown operation {other:?}"))),
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Operations {
    ops: Vec<Op>,
}

pub(super) fn register_ops(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Operations| {
        let mut desk = Desk::new()?;
        row.ops.into_iter().enumerate().try_for_each(|(at, op)| {
            desk.op(op).map_err(|fault| match fault {
                Fault::Differs { what, expected, real } => {
                    Fault::Differs { what, expected: format!("{expected} in operation {at}"), real }
                }
                Fault::Unreadable(why) => Fault::Unreadable(format!("operation {at}: {why}")),
            })
        })
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pipe {
    ops: Vec<(String, Option<Hex>, serde_json::Value)>,
}

pub(super) fn pipe_fifo(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Pipe| {
        let mut fifo = PipeFifo::new();
        for (name, first, second) in row.ops {
            match (name.as_str(), first, second.as_bool(), second.as_str()) {
                ("word", Some(byte), Some(k), _) => {
                    let word = super::character((byte, k))?.encode(RunningDisparity::Plus).word;
                    fifo.put(word.read(Rule::Strict));
                }
                // Ten equal bits are in no table.
                ("word", None, None, None) => fifo.put(Word::truncate(0).read(Rule::Strict)),
                ("read", Some(status), None, data) => {
                    let entry = fifo.take();
                    same("PIPE_S", &status, &Hex(entry.status.into()))?;
                    if let Some(data) = data {
                        same("PIPE_D", data, &format!("{:02x}", entry.data))?;
                    }
                }
                _ => return Err(Fault::Unreadable(format!("unknown operation {name:?} {first:?} {second}"))),
            }
        }
        Ok(())
    })
}
