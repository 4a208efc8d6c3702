//! The registers of the SICK IP core. The online status is not among them.

use std::fmt;

use hdsl::registers::{Register, Registers};

use super::{byte, check, data, events, identity, line, number, refused, safe_2};

/// MIR_SUM at the interface of the drive: SUMMARY.
const MIR_SUM: u8 = 0x18;
/// ERR in PC_ADD_H. All its other bits are write-only.
const ERR: u8 = 0x20;

pub(super) fn write(mut map: Registers, bank: bool, out: &mut String) -> fmt::Result {
    let link = if map.link() { "up" } else { "down" };
    line(out, "link", format_args!("{link}, quality {} of 15", map.quality()))?;
    line(out, "online status", "not a register of this core: it is returned with every access")?;
    let id = identity(&map, out)?;
    let [p4, p3, p2, p1, p0] = map.get(Register::Pos);
    let raw = u64::from_be_bytes([0, 0, 0, p4, p3, p2, p1, p0]);
    let [v2, v1, v0] = map.get(Register::Vel);
    let velocity = i32::from_be_bytes([v2, v1, v0, 0]) >> 8;
    if map.link() {
        let condition = "valid only while POS is clear in the online status";
        line(out, "fast position", format_args!("{}, {velocity} steps a frame, {condition}", number(id, raw)))?;
    } else {
        line(out, "fast position", "not usable: the link is down")?;
    }
    let summary = byte(&map, MIR_SUM);
    let crc = check(&map, MIR_SUM, Register::VPos, Register::VPosCrc);
    line(out, "safe position", format_args!("{}, SUMMARY {summary:02X}h, CRC {crc}", number(id, map.vpos())))?;
    if bank {
        safe_2(&map, "", out)?;
    }
    let answer = if byte(&map, Register::PcAdd as u8) & ERR == 0 { data(&map, 8) } else { refused(&map, true) };
    line(out, "long message", answer)?;
    line(out, "short message", format_args!("data {:02X}h", byte(&map, Register::PcData as u8)))?;
    let [errors] = map.get::<1>(Register::AccErrCnt);
    let [high, low] = map.get(Register::MaxDev);
    let deviation = u16::from_be_bytes([high, low]);
    line(out, "acceleration", format_args!("{errors} words in a row lost, greatest deviation {deviation} steps"))?;
    events(&mut map, out)
}
