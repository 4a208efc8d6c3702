//! Traces of the receiver firmware, under its profile.

use hdsl::frame::{FILLER, Trailer};
use hdsl::master::{RestartReason, State};
use hdsl::registers::{OnlineD, Register, Registers};
use hdsl::sampling::{TEST_PATTERN, line};
use hdsl::symbol::{Character, Control, RunningDisparity};
use hdsl::{Content, DeltaDelta, Dialect, EncoderByte, EncoderId, EncoderSymbol, MasterSymbol, Window};
use serde::Deserialize;

use super::Line;
use super::bench::Bench;
use crate::hex::{Bits, Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Startup {
    #[serde(rename = "fault")]
    _fault: Option<String>,
    #[serde(rename = "delay_cycles")]
    _delay_cycles: u32,
    encoder_id: Hex,
    columns: Vec<String>,
    frames: Vec<StartupFrame>,
}

/// Symbol, parameter byte, master bits since the last answer, answer, MASTER_QM, DELAY, resets, ENC_ID2..0,
/// ONLINE_STATUS_D. The registers are those before the answer is processed.
type StartupFrame = (Option<String>, Option<Hex>, Bits, Bits, Hex, Hex, u32, Hex, Hex);

fn columns(real: &[String], want: &[&str]) -> Verdict {
    same("columns", &real.iter().map(String::as_str).collect(), &want.to_vec())
}

fn window(window: Window) -> impl Iterator<Item = bool> {
    (0..window.len()).filter_map(move |at| window.get(at))
}

fn symbol_name(symbol: MasterSymbol) -> &'static str {
    match symbol {
        MasterSymbol::Reset => "RESET",
        MasterSymbol::Sync => "SYNC",
        MasterSymbol::Start => "START",
        MasterSymbol::Learn => "LEARN",
        MasterSymbol::Check => "CHECK",
        MasterSymbol::IdReq => "IDREQ",
        MasterSymbol::Init => "INIT",
        MasterSymbol::Idle => "IDLE",
        MasterSymbol::Data(_) => "DATA",
    }
}

fn bits64(bits: &Bits) -> u64 {
    bits.0.iter().rev().fold(0, |line, bit| line << 1 | u64::from(*bit))
}

/// Compares the registers that a start-up row shows. After a failed identification the firmware leaves MASTER_QM.
fn startup_registers(frame: &StartupFrame, bench: &Bench, identified: bool) -> Verdict {
    let (_, _, _, _, qm, delay, resets, id, online) = frame;
    let map = &bench.map;
    if identified {
        same("MASTER_QM", qm, &Hex(map.get::<1>(Register::MasterQm)[0].into()))?;
    }
    same("cable delay", &(delay.0 & 15), &u64::from(map.get::<1>(Register::Delay)[0] & 15))?;
    same("resets", resets, &bench.master.counters().restarts)?;
    let [high, middle, low] = map.get(Register::EncId);
    same("ENC_ID", id, &Hex(u32::from_be_bytes([0, high, middle, low]).into()))?;
    same("ONLINE_STATUS_D", online, &Hex(map.online_d().bits().into()))
}

pub(super) fn fw_startup(rows: &[Row]) -> Vec<Verdict> {
    let names = ["symbol", "param", "master_bits_since_last_answer", "answer", "MASTER_QM", "DELAY", "resets"];
    let names = [&names[..], &["ENC_ID2..0", "ONLINE_STATUS_D"]].concat();
    each(rows, |row: Startup| {
        columns(&row.columns, &names)?;
        let delay = row.frames.iter().map(|f| (f.5.0 & 15) as u32).find(|delay| *delay != 0).unwrap_or(1);
        let mut bench = Bench::new(Dialect::TI);
        let (mut sent, mut identified) = (Vec::new(), true);
        let mut frames = row.frames.iter();
        while let Some(frame) = next_answered(&mut bench, &mut sent, &mut frames, &mut identified)? {
            let present = bench.master.transmission();
            let symbol = present.head.byte().symbol().map(symbol_name);
            same("symbol", &frame.0.as_deref(), &symbol.ok())?;
            same("param", &frame.1, &Some(Hex(present.head.byte().raw().into())))?;
            same("master bits", &frame.2.0, &sent)?;
            startup_registers(frame, &bench, identified)?;
            sent.clear();
            let silent = frame.3.0.iter().all(|bit| *bit);
            let samples = if silent { [0xff; 72] } else { line(bits64(&frame.3), delay * 8) };
            let before = bench;
            let h_frame = bench.hear(&samples)?;
            sent.extend(h_frame.tail.bits());
            identified &= !matches!(h_frame.restarted, Some(RestartReason::Identifier(_)));
            identified |= bench.master.state() == State::WaitVsync;
            if h_frame.restarted.is_some() && h_frame.tail.trailer != Trailer::Cut {
                // A row of its own for what was sent when the master gave up, with the registers before that.
                let Some(gave_up) = frames.next() else { return learned(&row, &bench) };
                same("gave up", &None, &gave_up.0)?;
                same("master bits", &gave_up.2.0, &sent)?;
                startup_registers(gave_up, &before, identified)?;
                sent.clear();
            }
        }
        learned(&row, &bench)
    })
}

/// The last entry shows ENC_ID with the nibble of ENC_ID2 doubled if the receiver locked, and 0 if it learned none.
fn learned(row: &Startup, bench: &Bench) -> Verdict {
    let shown = row.frames.last().map_or(0, |frame| frame.7.0);
    let id = bench.master.encoder_id().map(EncoderId::get).map(u64::from);
    if shown == 0 {
        return same("encoder_id", &None, &id);
    }
    let nibble = row.encoder_id.0 >> 16;
    same("ENC_ID of the row", &shown, &(row.encoder_id.0 & 0xffff | nibble << 20 | nibble << 16))?;
    same("encoder_id", &Some(row.encoder_id.0), &id)
}

/// Sends frames until one is answered, and gives its row.
fn next_answered<'a>(
    bench: &mut Bench,
    sent: &mut Vec<bool>,
    frames: &mut impl Iterator<Item = &'a StartupFrame>,
    identified: &mut bool,
) -> Result<Option<&'a StartupFrame>, Fault> {
    loop {
        let present = bench.master.transmission();
        sent.extend((0..present.lead_in).map(|_| false));
        sent.extend(window(present.head.bits()));
        if present.answered {
            *identified |= bench.map.link();
            return Ok(frames.next());
        }
        sent.extend(window(FILLER));
        let h_frame = bench.hear(&[])?;
        sent.extend(h_frame.tail.bits());
    }
}

/// A receiver that has just seen VSYNC; the next answer is the first of a V-frame.
fn locked(dialect: Dialect, pos_bits: u8) -> Result<Bench, Fault> {
    let id = EncoderId::new(3 | u32::from(pos_bits.wrapping_sub(11)) << 4);
    let id = id.ok_or_else(|| Fault::Unreadable(format!("pos_bits {pos_bits}")))?;
    let mut bench = Bench::new(dialect);
    for _ in 0..200 {
        let bits = match bench.master.state() {
            State::Reset | State::Sync | State::Start | State::Learn | State::Check => TEST_PATTERN,
            State::IdReq => id.to_answer(Character::data(0), RunningDisparity::Minus).bits,
            State::WaitVsync => idle(EncoderByte::of(EncoderSymbol::Idle).with_vsync()),
            State::Running => return Ok(bench),
        };
        let _ = bench.feed(bits)?;
    }
    Err(Fault::Unreadable("the receiver does not lock".to_owned()))
}

/// An answer at standstill.
fn idle(parameter: EncoderByte) -> u64 {
    let content = Content {
        vertical: Character::data(0),
        parameter,
        pipe: Character::control(Control::K30_7),
        acceleration: Some(DeltaDelta::ZERO),
        secondary: Character::data(0),
    };
    content.emit(RunningDisparity::Minus).bits
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Link {
    pos_bits: u8,
    flip_probability: f64,
    columns: Vec<String>,
    frames: Vec<Vec<serde_json::Value>>,
}

type LinkFrame = (Line, Hex, Hex, Hex, Hex, u8, u8, Hex, Hex, Hex);

fn bytes<const N: usize>(map: &Registers, from: Register) -> u64 {
    map.get::<N>(from).iter().fold(0, |all, byte| all << 8 | u64::from(*byte))
}

fn link_registers(frame: &LinkFrame, bench: &Bench, noise: bool) -> Verdict {
    let map = &bench.map;
    let (_, qm, pos, vel, online, errors, phase, vpos, sum, safe2) = frame;
    same("MASTER_QM", qm, &Hex(bytes::<1>(map, Register::MasterQm)))?;
    same("POS", pos, &Hex(bytes::<5>(map, Register::Pos)))?;
    same("VEL", vel, &Hex(bytes::<3>(map, Register::Vel)))?;
    // A symbol made by noise opens a message, after which the firmware shows MIN for a frame.
    let min = u64::from(OnlineD::MIN.bits());
    let unsure = if noise { min << 32 | min << 16 } else { 0 };
    same("ONLINE_STATUS", &Hex(online.0 & !unsure), &Hex(bytes::<6>(map, Register::OnlineStatusD) & !unsure))?;
    same("ACC_ERR_CNT", errors, &map.get::<1>(Register::AccErrCnt)[0])?;
    same("align_phase", phase, &(bench.map.stage() as u8))?;
    same("VPOS, VPOSCRC", vpos, &Hex(bytes::<7>(map, Register::VPos)))?;
    same("SAFE_SUM", sum, &Hex(bytes::<1>(map, Register::SafeSum)))?;
    same("STATUS2, VPOS2, VPOSCRC2", safe2, &Hex(bytes::<8>(map, Register::Status2)))
}

pub(super) fn fw_link(rows: &[Row]) -> Vec<Verdict> {
    let names = ["answer", "MASTER_QM", "POS", "VEL", "ONLINE_STATUS_D/1/2", "ACC_ERR_CNT", "align_phase", "VPOS+CRC"];
    let names = [&names[..], &["SAFE_SUM", "STATUS2+VPOS2+CRC2"]].concat();
    each(rows, |row: Link| {
        columns(&row.columns, &names)?;
        let mut bench = locked(Dialect::TI, row.pos_bits)?;
        let (last, len) = (row.frames.len().saturating_sub(1), row.frames.len());
        for (at, frame) in row.frames.into_iter().enumerate() {
            if frame.first().is_some_and(|first| first == "LINK_LOST") {
                // The answer that caused the loss is not in the row: nothing can follow.
                same("entry of the loss", &last, &at)?;
                return same("values of the loss", &10, &frame.len());
            }
            link_frame(&mut bench, at, frame, row.flip_probability > 0.0)?;
        }
        same("frames", &true, &(len > 0))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SickLink {
    pos_bits: u8,
    #[serde(rename = "kind")]
    _kind: String,
    columns: Vec<String>,
    frames: Vec<Vec<serde_json::Value>>,
}

pub(super) fn link_sick(rows: &[Row]) -> Vec<Verdict> {
    let names = ["answer", "MASTER_QM", "POS", "VEL", "ONLINE_STATUS_D/1/2", "ACC_ERR_CNT", "align_phase", "VPOS+CRC"];
    let names = [&names[..], &["SAFE_SUM", "STATUS2+VPOS2+CRC2"]].concat();
    each(rows, |row: SickLink| {
        columns(&row.columns, &names)?;
        let mut bench = locked(Dialect::SICK, row.pos_bits)?;
        let last = row.frames.len().saturating_sub(1);
        for (at, frame) in row.frames.into_iter().enumerate() {
            if frame.first().is_some_and(|first| first == "LINK_LOST") {
                same("entry of the loss", &last, &at)?;
                let (_, answer): (String, Line) = read_frame(at, frame)?;
                let h_frame = bench.feed(answer.bits as u64)?;
                same("restarted", &Some(RestartReason::Quality), &h_frame.restarted)?;
                return same("LINK", &false, &bench.map.link());
            }
            link_frame(&mut bench, at, frame, false)?;
        }
        Ok(())
    })
}

fn read_frame<T: serde::de::DeserializeOwned>(at: usize, frame: Vec<serde_json::Value>) -> Result<T, Fault> {
    serde_json::from_value(frame.into()).map_err(|e| Fault::Unreadable(format!("frame {at}: {e}")))
}

fn link_frame(bench: &mut Bench, at: usize, frame: Vec<serde_json::Value>, noise: bool) -> Verdict {
    let frame: LinkFrame = read_frame(at, frame)?;
    let h_frame = bench.feed(frame.0.bits as u64)?;
    same("restarted", &None, &h_frame.restarted)?;
    link_registers(&frame, bench, noise).map_err(|fault| at_frame(at, fault))
}

/// Says in which frame of a trace the difference is.
fn at_frame(at: usize, fault: Fault) -> Fault {
    match fault {
        Fault::Differs { what, expected, real } => {
            Fault::Differs { what, expected: format!("{expected} in frame {at}"), real }
        }
        Fault::Unreadable(why) => Fault::Unreadable(why),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Messages {
    kind: String,
    master_symbols: Vec<u8>,
    encoder_symbols: Vec<u8>,
    request: Bytes,
    #[serde(rename = "S_PC_DATA")]
    s_pc_data: Hex,
    #[serde(rename = "PC_ADD")]
    pc_add: Hex,
    #[serde(rename = "PC_BUFFER")]
    pc_buffer: Bytes,
    #[serde(rename = "EVENT")]
    event: Hex,
    #[serde(rename = "EVENT_S")]
    event_s: Hex,
    reg: Option<Hex>,
    value: Option<Hex>,
    addr: Option<Hex>,
    read: Option<bool>,
    indirect: Option<bool>,
    llen: Option<u8>,
    offset: Option<u16>,
    data: Option<Bytes>,
}

/// Starts the message of a row.
fn trigger(row: &Messages, bench: &mut Bench) -> Verdict {
    let missing = || Fault::Unreadable("a key of this kind of row is missing".to_owned());
    if row.kind == "long" {
        let (Some(addr), Some(read), Some(indirect), Some(llen), Some(data)) =
            (row.addr, row.read, row.indirect, row.llen, &row.data)
        else {
            return Err(missing());
        };
        let request = super::message::request(addr, read, indirect, llen, row.offset, data)?;
        same("request", &row.request.0, &request.emit().as_bytes().to_vec())?;
        let header = row.request.0.first_chunk().copied().unwrap_or([0; 2]);
        return bench.long(header, request.offset, &request.access);
    }
    let register = super::message::register(row.reg.ok_or_else(missing)?)?;
    let request = match (row.kind.as_str(), row.value) {
        ("short_read", None) => hdsl::message::ShortRequest::Read(register),
        ("short_write", Some(value)) => hdsl::message::ShortRequest::Write(register, value.0 as u8),
        _ => return Err(missing()),
    };
    same("request", &row.request.0, &request.emit().as_bytes().to_vec())?;
    bench.short(request)
}

/// A receiver and its encoder, kept from row to row.
struct Session {
    bench: Bench,
    answers: Encoder,
}

impl Session {
    fn new() -> Result<Self, Fault> {
        let mut session = Self { bench: locked(Dialect::TI, 32)?, answers: Encoder::default() };
        // One V-frame has to pass before messages are sent.
        for _ in 0..15 {
            session.bench.feed(session.answers.next(EncoderSymbol::Idle))?;
        }
        Ok(session)
    }

    fn row(&mut self, row: &Messages) -> Verdict {
        let mut sent = Vec::new();
        for (at, symbol) in row.encoder_symbols.iter().enumerate() {
            if at == 1 {
                trigger(row, &mut self.bench)?;
            }
            let byte = self.bench.master.transmission().head.byte();
            sent.push(byte.symbol().map_or(0xff, MasterSymbol::code));
            let symbol = EncoderSymbol::from_code(*symbol)
                .ok_or_else(|| Fault::Unreadable(format!("no symbol {symbol:02x}")))?;
            self.bench.feed(self.answers.next(symbol))?;
        }
        same("master_symbols", &row.master_symbols, &sent)?;
        let map = &self.bench.map;
        same("PC_ADD", &row.pc_add, &Hex(bytes::<2>(map, Register::PcAdd)))?;
        same("PC_BUFFER", &row.pc_buffer.0, &map.get::<8>(Register::PcBuffer).to_vec())?;
        same("S_PC_DATA", &row.s_pc_data, &Hex(bytes::<1>(map, Register::SPcData)))?;
        same("EVENT", &row.event, &Hex(map.event().bits().into()))?;
        same("EVENT_S", &row.event_s, &Hex(map.event_s().bits().into()))
    }
}

/// Rows are sessions in order: a short message with nothing in PC_BUFFER after a row with something begins a new one.
pub(super) fn fw_messages(rows: &[Row]) -> Vec<Verdict> {
    let mut session: Option<Session> = None;
    let mut used = false;
    let mut check = |row: &Row| -> Verdict {
        let row: Messages = row.read()?;
        let empty = row.pc_buffer.0.iter().all(|byte| *byte == 0);
        if row.kind != "long" && empty && used {
            session = None;
        }
        used = !empty || used && session.is_some();
        match &mut session {
            Some(session) => session.row(&row),
            none => none.insert(Session::new()?).row(&row),
        }
    };
    rows.iter().map(&mut check).collect()
}

/// An encoder at standstill that says what it is told to.
#[derive(Default)]
struct Encoder {
    at: u8,
}

impl Encoder {
    fn next(&mut self, symbol: EncoderSymbol) -> u64 {
        let position = [0_u8; 5];
        let block = |status: u8| {
            let covered = [&[status][..], &position].concat();
            [covered.clone(), hdsl::crc16(&covered).to_be_bytes().to_vec()].concat()
        };
        let at = usize::from(self.at);
        let pick = |block: Vec<u8>| block.get(at).copied().unwrap_or(0);
        let status2 = Character::control(Control::K28_0);
        let byte = EncoderByte::of(symbol);
        let content = Content {
            vertical: Character::data(pick(block(0))),
            parameter: if at == 7 { byte.with_vsync() } else { byte },
            pipe: Character::control(Control::K30_7),
            acceleration: Some(DeltaDelta::ZERO),
            secondary: if at == 0 { status2 } else { Character::data(pick(block(0x1c))) },
        };
        self.at = (self.at + 1) % 8;
        content.emit(RunningDisparity::Minus).bits
    }
}
