//! Rows about the CLB design: truth tables and cycle traces of whole transactions.

use serde::Deserialize;

use tformat::clb::{Events, Inputs, SerialCrc, State, Tile, lut0, lut1};

use super::{bits_of, data_id};
use crate::hex::{Bits, Hex};
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum ClbRow {
    Fsm1 { s1: u8, s0: u8, e1: u8, e0: u8, next_s1: u8, next_s0: u8, state: String, next: String, out: u8 },
    Lut0 { i3_width_reached: u8, i2_s1: u8, i1_s0: u8, i0_any_edge: u8, out: u8 },
    Lut1 { i3_s1: u8, i2_s0: u8, i1_falling_edge: u8, i0_start: u8, out: u8 },
    Trace(Box<Trace>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Trace {
    data_id: Hex,
    clb_mhz: u64,
    freq_div: u16,
    match1: u16,
    match2: u16,
    cable_m: u64,
    tx_clocks: u16,
    rx_clocks: u16,
    response_wire: Bits,
    states: Vec<(u64, String)>,
    tx_clock_pulses: u32,
    rx_clock_pulses: u32,
    sampled: Bits,
    sample_offset_in_bit: Vec<u64>,
    txen_cycles: u64,
    serial_crc_register: Hex,
    crc_field_bit_reversed: Hex,
}

/// The state with these two bits. A row with others is answered by a mismatch, not by a panic.
fn of_bits(s1: u8, s0: u8) -> State {
    State::from_code(s1 << 1 | s0).unwrap_or(State::Idle)
}

pub(super) fn rows(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ClbRow| match row {
        ClbRow::Fsm1 { s1, s0, e1, e0, next_s1, next_s0, state, next, out } => {
            let now = of_bits(s1, s0);
            let then = now.next(Events { clock_count_complete: e1 == 1, started: e0 == 1 });
            same("state", &state.as_str(), &now.name())?;
            same("next", &next.as_str(), &then.name())?;
            same("next_s1", &(next_s1 == 1), &then.s1())?;
            same("next_s0", &(next_s0 == 1), &then.s0())?;
            same("out", &(out == 1), &now.is_active())
        }
        ClbRow::Lut0 { i3_width_reached, i2_s1, i1_s0, i0_any_edge, out } => {
            let state = of_bits(i2_s1, i1_s0);
            same("out", &(out == 1), &lut0(i3_width_reached == 1, i0_any_edge == 1, state))
        }
        ClbRow::Lut1 { i3_s1, i2_s0, i1_falling_edge, i0_start, out } => {
            let state = of_bits(i3_s1, i2_s0);
            same("out", &(out == 1), &lut1(i0_start == 1, i1_falling_edge == 1, state))
        }
        ClbRow::Trace(row) => trace(&row),
    })
}

/// What a simulated transaction shows.
#[derive(Default)]
struct Seen {
    states: Vec<(u64, String)>,
    tx_rises: u32,
    rx_rises: u32,
    sampled: Vec<bool>,
    offsets: Vec<u64>,
    txen_cycles: u64,
}

/// Runs the tile over one transaction: START_OPERATION in cycle 59, the answer 3 us and the way there and back
/// (10 ns a metre) after the last bit of the request.
fn simulate(row: &Trace) -> Seen {
    let bit = u64::from(row.freq_div) * 2;
    let delay = row.clb_mhz * (3000 + 10 * row.cable_m) / 1000;
    let mut tile = Tile::new(row.freq_div, row.tx_clocks, row.rx_clocks);
    let mut seen = Seen::default();
    let mut falls = u64::MAX;
    for cycle in 0..1_000_000_u64 {
        let at = cycle.checked_sub(falls).map(|since| since / bit);
        let level = at.and_then(|at| row.response_wire.0.get(at as usize)).copied().unwrap_or(true);
        let out = tile.cycle(Inputs { start: cycle == 59, response: level });
        if seen.states.last().is_none_or(|(_, last)| last != out.state.name()) {
            seen.states.push((cycle, out.state.name().to_owned()));
            if out.state == State::WaitForStart {
                falls = cycle + u64::from(row.freq_div) - 1 + delay;
            }
        }
        seen.txen_cycles += u64::from(out.transmit_enable);
        if out.clock_rises && out.state == State::TransmitData {
            seen.tx_rises += 1;
        }
        if out.clock_rises && out.state == State::ReceiveData {
            seen.rx_rises += 1;
            seen.sampled.push(level);
            seen.offsets.push((cycle - falls) % bit);
        }
        if seen.states.len() == 5 {
            break;
        }
    }
    seen.offsets.dedup();
    seen
}

fn trace(row: &Trace) -> Verdict {
    let id = data_id(row.data_id);
    let clocks = (u16::from(id.request_fields()) * 10 + 1, u16::from(id.response_fields()) * 10);
    same("tx_clocks, rx_clocks", &(row.tx_clocks, row.rx_clocks), &clocks)?;
    let tile = Tile::new(row.freq_div, row.tx_clocks, row.rx_clocks);
    same("match1", &row.match1, &tile.match1())?;
    same("match2", &row.match2, &tile.full_bit())?;
    let seen = simulate(row);
    same("states", &row.states, &seen.states)?;
    same("tx_clock_pulses", &row.tx_clock_pulses, &seen.tx_rises)?;
    same("rx_clock_pulses", &row.rx_clock_pulses, &seen.rx_rises)?;
    same("sample_offset_in_bit", &row.sample_offset_in_bit, &seen.offsets)?;
    same("txen_cycles", &row.txen_cycles, &seen.txen_cycles)?;
    same("sampled", &bits_of(&row.sampled), &bits_of(&Bits(seen.sampled.clone())))?;
    // The check register runs over the data bits of all fields but the last.
    let fields: Vec<&[bool]> = seen.sampled.chunks(10).collect();
    let mut register = SerialCrc::new();
    let Some((last, covered)) = fields.split_last() else { return same("sampled", &"fields", &"none") };
    for bit in covered.iter().flat_map(|field| field.get(1..9).unwrap_or(&[])) {
        register.bit(*bit);
    }
    same("serial_crc_register", &row.serial_crc_register.0, &register.register().into())?;
    let check = last.get(1..9).unwrap_or(&[]).iter().fold(0, |value, bit| value << 1 | u64::from(*bit));
    same("crc_field_bit_reversed", &row.crc_field_bit_reversed.0, &check)
}
