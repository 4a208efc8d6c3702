//! `servowire registers`: the register map of a HIPERFACE DSL receiver in words.

mod ip_core;

use std::error::Error;
use std::fmt::{self, Display, Write as _};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use hdsl::message::{Length, ResourceAddress, ResourceError};
use hdsl::registers::{Online1, Online2, OnlineD, Register, Registers};
use hdsl::{Dialect, EncoderId, crc16};
use servowire_decode::fault::{At, Fault};

use crate::files;
use crate::terminal::say;

/// Describe the register map of a HIPERFACE DSL receiver in words: link, positions, status, events, messages.
///
/// Exit code 0: the map could be read, whatever its content; 1: it could not be printed; 2: it could not be read.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The registers, as bytes or as hex digits; - for the standard input. More bytes may follow.
    file: PathBuf,
    /// Whose receiver it is.
    #[arg(long, value_enum, default_value_t = Receiver::Ti)]
    receiver: Receiver,
    /// Offset of the map in a memory dump, in bytes.
    #[arg(long, value_name = "BYTES", default_value_t = 0)]
    at: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Receiver {
    /// Firmware of the Motor Control SDK: 86 bytes, 00h to 55h.
    Ti,
    /// SICK IP core: 64 bytes, 00h to 3Fh, followed by the bank of safe channel 2, 00h to 1Fh, if it was read.
    Sick,
    /// A receiver made with the crate hdsl, following SICK's rules: 86 bytes.
    Hdsl,
}

impl Arguments {
    /// Prints the map. 1: it could not be printed; 2: it could not be read.
    pub fn run(&self) -> ExitCode {
        match self.text().map(|text| say(format_args!("{text}"))) {
            Ok(Ok(())) => ExitCode::SUCCESS,
            Ok(Err(error)) => {
                eprintln!("error: cannot write: {error}");
                ExitCode::FAILURE
            }
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::from(2)
            }
        }
    }

    fn text(&self) -> Result<String, Fault> {
        let fault = |what: String| Fault::new(&self.file.display().to_string(), At::File, what);
        let mut read = Vec::new();
        let done = if self.file == Path::new("-") {
            io::stdin().lock().read_to_end(&mut read)
        } else {
            files::open_file(&self.file)?.read_to_end(&mut read)
        };
        done.map_err(|e| fault(e.to_string()))?;
        self.words(&read).map_err(|e| fault(e.to_string()))
    }

    fn words(&self, read: &[u8]) -> Result<String, Box<dyn Error>> {
        let bytes = bytes(read)?;
        let rest = bytes.get(self.at..).unwrap_or_default();
        let mut text = String::new();
        match self.receiver {
            Receiver::Ti => Map(Registers::from_bytes(&Dialect::TI, *self.whole(rest)?), false).write(&mut text)?,
            Receiver::Hdsl => Map(Registers::from_bytes(&Dialect::SICK, *self.whole(rest)?), true).write(&mut text)?,
            Receiver::Sick => {
                let drive: &[u8; Registers::CORE_LEN] = self.whole(rest)?;
                let safe2 = rest.get(Registers::CORE_LEN..).and_then(<[u8]>::first_chunk);
                ip_core::write(Registers::from_core(drive, safe2), safe2.is_some(), &mut text)?;
            }
        }
        Ok(text)
    }

    fn whole<'r, const N: usize>(&self, rest: &'r [u8]) -> Result<&'r [u8; N], String> {
        let short = || format!("{} bytes from {} on, a register map has {N}", rest.len(), self.at);
        rest.first_chunk().ok_or_else(short)
    }
}

/// Decodes pairs of hex digits with or without spaces between them; other text is refused, and anything else is taken as it is.
fn bytes(file: &[u8]) -> Result<Vec<u8>, &'static str> {
    let digits: Vec<u8> = file.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let pairs = digits.chunks_exact(2).map(|pair| core::str::from_utf8(pair).ok());
    let bytes: Option<Vec<u8>> = pairs.map(|pair| u8::from_str_radix(pair?, 16).ok()).collect();
    match bytes.filter(|_| digits.len() % 2 == 0 && digits.iter().all(u8::is_ascii_hexdigit)) {
        Some(bytes) => Ok(bytes),
        None if digits.iter().all(u8::is_ascii_graphic) => Err(
            "text that is not pairs of hex digits: leave out addresses, names and signs, or give the bytes themselves",
        ),
        None => Ok(file.to_vec()),
    }
}

/// A map in the layout of the SDK, and whether it follows SICK's rules.
struct Map(Registers, bool);

impl Map {
    fn write(mut self, out: &mut String) -> fmt::Result {
        let map = &self.0;
        let (link, d) = (if map.link() { "up" } else { "down" }, map.online_d());
        line(out, "link", format_args!("{link}, quality {} of 15", map.quality()))?;
        line(out, "drive", d)?;
        line(out, "safe 1", map.online_1())?;
        line(out, "safe 2", map.online_2())?;
        let id = identity(map, out)?;

        match (map.pos(), map.vel()) {
            (Some(position), Some(velocity)) => {
                line(out, "fast position", format_args!("{}, {velocity} steps a frame", number(id, position)))?;
            }
            _ if d.contains(OnlineD::POS) => line(out, "fast position", "not usable: POS")?,
            _ => line(out, "fast position", "not usable: the link is down")?,
        }
        self.safe(out, id)?;
        self.messages(out)?;

        events(&mut self.0, out)
    }

    fn safe(&self, out: &mut String, id: EncoderId) -> fmt::Result {
        let map = &self.0;
        let [summary] = map.get(Register::SafeSum);
        let crc = check(map, Register::SafeSum as u8, Register::VPos, Register::VPosCrc);
        let stale = match map.online_1() {
            flags if flags.contains(Online1::VPOS) => ", not usable: VPOS",
            flags if flags.contains(Online1::SCE) => ", not new: SCE",
            _ => "",
        };
        let position = number(id, map.vpos());
        line(out, "safe position", format_args!("{position}, SUMMARY {summary:02X}h, CRC {crc}{stale}"))?;
        let stale = match map.online_2() {
            flags if flags.contains(Online2::VPOS2) => ", not usable: VPOS2",
            flags if flags.contains(Online2::SCE2) => ", not new: SCE2",
            _ => "",
        };
        safe_2(map, stale, out)
    }

    fn messages(&self, out: &mut String) -> fmt::Result {
        let map = &self.0;
        let [high, low] = map.get(Register::PcAdd);
        let resource = ResourceAddress::truncate(u16::from_be_bytes([high, low]));
        let direction = if high & 0x40 != 0 { "read" } else { "write" };
        let resource = format!("{} {:03X}h", resource.name().unwrap_or("resource"), resource.get());
        let what = if high & 0x10 != 0 { "" } else { ", directly" };
        let free = map.online_d().contains(OnlineD::FREL);
        let state = match (free, map.online_d().contains(OnlineD::ANS)) {
            (false, _) => "under way",
            (true, true) => "not answered well",
            (true, false) => "free",
        };
        let bytes = Length::from_code(high >> 2 & 3).map_or(0, Length::bytes);
        let data = if free && high & 0x20 != 0 { refused(map, self.1) } else { data(map, bytes) };
        line(out, "long message", format_args!("{state}; {direction} {resource}{what}; {data}"))?;
        let free = if map.online_1().contains(Online1::FRES) { "free" } else { "under way" };
        let data = byte(map, Register::SPcData as u8);
        line(out, "short message", format_args!("{free}; data {data:02X}h"))?;
        let ([errors], [threshold]) = (map.get(Register::AccErrCnt), map.get(Register::AccErrCntThresh));
        let beyond = if map.too_many_acceleration_errors() { ", too many" } else { "" };
        line(out, "acceleration", format_args!("{errors} words in a row lost, threshold {threshold}{beyond}"))
    }
}

/// Describes encoder and cable, and the identifier.
fn identity(map: &Registers, out: &mut String) -> Result<EncoderId, fmt::Error> {
    let id = EncoderId::truncate(u32::from_be_bytes([0, byte(map, 0x0d) & 15, byte(map, 0x0e), byte(map, 0x0f)]));
    line(out, "encoder", encoder(id))?;
    let [edges, delay] = map.get(Register::Edges);
    let periods: Vec<String> = (0..8).filter(|at| edges >> at & 1 == 1).map(|at: u8| at.to_string()).collect();
    let periods = if periods.is_empty() { "none".to_owned() } else { periods.join(" ") };
    line(out, "line", format_args!("RSSI {}, delay {} bits, edges in periods {periods}", delay >> 4, delay & 15))?;
    Ok(id)
}

fn safe_2(map: &Registers, stale: &str, out: &mut String) -> fmt::Result {
    let crc = check(map, Register::Status2 as u8, Register::VPos2, Register::VPosCrc2);
    let (position, status) = (map.vpos2(), map.status_2());
    let fixed = if status.is_fixed_part_right() { "" } else { " (FIX2 is wrong)" };
    line(out, "safe position 2", format_args!("{position:010X}h, STATUS2 {status}{fixed}, CRC {crc}{stale}"))
}

/// Describes why the encoder refused a long message: by SICK's rules the detail comes before the class, by TI's after it.
fn refused(map: &Registers, sick: bool) -> String {
    let [first, second] = map.get(Register::PcBuffer);
    let [detail, class] = if sick { [first, second] } else { [second, first] };
    format!("refused: {}", ResourceError::new(class, detail))
}

/// Describes the first bytes of the buffer of long messages, also as text if they are text.
fn data(map: &Registers, bytes: usize) -> String {
    let buffer: [u8; 8] = map.get(Register::PcBuffer);
    let data = buffer.get(..bytes).unwrap_or_default();
    let text = core::str::from_utf8(data).ok().filter(|text| text.bytes().all(|byte| byte.is_ascii_graphic()));
    let text = text.filter(|text| !text.is_empty()).map(|text| format!(" {text:?}")).unwrap_or_default();
    data.iter().fold(String::from("data"), |text, byte| format!("{text} {byte:02X}")) + &text
}

fn events(map: &mut Registers, out: &mut String) -> fmt::Result {
    let masks = format!("{:04X}h", u16::from_be_bytes(map.get(Register::MaskH)));
    let interrupts = map.masked_events();
    let events = map.take_events();
    let (event, event_s) = (events.drive, events.safe);
    line(out, "events", format_args!("{event}, mask {masks}"))?;
    let [mask_s] = map.get(Register::MaskS);
    line(out, "safe events", format_args!("{event_s}, mask {mask_s:02X}h"))?;
    line(out, "interrupts", interrupts)
}

fn line(out: &mut String, name: &str, text: impl Display) -> fmt::Result {
    writeln!(out, "{name:16}{text}")
}

fn byte(map: &Registers, address: u8) -> u8 {
    map.byte(address).unwrap_or(0)
}

fn encoder(id: EncoderId) -> String {
    let sign = if id.is_signed() { "signed" } else { "unsigned" };
    match id.check() {
        Ok(bits) => format!("{:05X}h: {bits} bits, {sign}, index {}", id.get(), id.user_index()),
        Err(error) => format!("{:05X}h: {error}", id.get()),
    }
}

/// Describes a position with the sign that the encoder gives it.
fn number(id: EncoderId, raw: u64) -> String {
    let position = if id.check().is_ok() { id.position(raw).to_string() } else { raw.to_string() };
    format!("{position} ({raw:010X}h)")
}

/// Returns whether the CRC in the map matches the status byte and the position.
fn check(map: &Registers, status: u8, position: Register, crc: Register) -> &'static str {
    let (status, [p4, p3, p2, p1, p0]) = (byte(map, status), map.get(position));
    let want = crc16(&[status, p4, p3, p2, p1, p0]);
    if map.get(crc) == want.to_be_bytes() { "right" } else { "wrong" }
}
