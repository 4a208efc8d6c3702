//! External synchronisation.

use hdsl::frame::{Extra, H_FRAME_BITS, Stuffing};
use hdsl::sync::Es;
use hdsl::{Error, LineDisparity, MasterSymbol, ParameterByte};
use serde::Deserialize;

use super::Line;
use super::startup::{CoreClock, Startup, of_registers};
use crate::hex::Hex;
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ExtSync {
    #[serde(rename = "kind")]
    _kind: String,
    start: Start,
    adjust: Vec<i16>,
    columns: Vec<String>,
    steps: Vec<(u8, u8, u8, i16, u8)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Start {
    extra_size: u8,
    time_rest: u8,
    num_stuffing: u8,
    time_extra_window: i16,
    extra_edge: u8,
}

pub(super) fn ext_sync_seed(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ExtSync| {
        let columns = ["extra_size", "time_rest", "num_stuffing", "time_extra_window", "extra_edge"];
        same("columns", &row.columns.iter().map(String::as_str).collect(), &columns.to_vec())?;
        let Start { extra_size, time_rest, num_stuffing, time_extra_window, extra_edge } = row.start;
        let blocks = Stuffing::new(num_stuffing).ok_or_else(|| Fault::Unreadable(format!("{num_stuffing} blocks")))?;
        let state = of_registers(extra_size, time_rest, blocks, time_extra_window);
        let mut state = state.ok_or_else(|| Fault::Unreadable("a window out of its range".to_owned()))?;
        same("extra_edge", &extra_edge, &state.extra().edge_register())?;
        same("steps", &row.adjust.len(), &row.steps.len())?;
        for (adjust, want) in row.adjust.iter().zip(row.steps) {
            same("step", &Ok(()), &state.step(*adjust))?;
            let edge = state.extra();
            let (size, rest) = (edge.get() / 8, edge.get() % 8);
            same("state", &want, &(size, rest, state.stuffing().get(), state.window(), edge.edge_register()))?;
        }
        Ok(())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SyncStartup {
    es: u8,
    period_cycles: u32,
    cycles_per_bit: u32,
    extra_size: Option<u32>,
    extra_remainder: Option<u32>,
    stuffing: Option<u32>,
    stuffing_remainder: Option<u32>,
    time_rest: Option<u8>,
    extra_edge: Option<Hex>,
    cycles_used: Option<u32>,
    cycles_dropped: Option<u32>,
    valid: Option<bool>,
    error: Option<String>,
}

pub(super) fn clock(cycles_per_bit: u32) -> Result<CoreClock, Fault> {
    [CoreClock::Mhz225, CoreClock::Mhz300]
        .into_iter()
        .find(|clock| clock.cycles_per_eighth() * 8 == cycles_per_bit)
        .ok_or_else(|| Fault::Unreadable(format!("no clock has {cycles_per_bit} cycles a bit")))
}

pub(super) fn es(es: u8) -> Result<Es, Fault> {
    Es::new(es).ok_or_else(|| Fault::Unreadable(format!("ES {es}")))
}

pub(super) fn sync_startup(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SyncStartup| {
        let start = match Startup::new(row.period_cycles, clock(row.cycles_per_bit)?, es(row.es)?) {
            Ok(start) => start,
            Err(e) => {
                let class = if matches!(e, Error::PeriodTooShort { .. }) { "period_too_short" } else { "unexpected" };
                return same("error", &row.error.as_deref(), &Some(class));
            }
        };
        same("error", &row.error, &None)?;
        same("valid", &row.valid, &Some(start.check().is_ok()))?;
        same("extra_size", &row.extra_size, &Some(start.extra_size))?;
        same("extra_remainder", &row.extra_remainder, &Some(start.extra_remainder))?;
        same("stuffing", &row.stuffing, &Some(start.stuffing))?;
        same("stuffing_remainder", &row.stuffing_remainder, &Some(start.stuffing_remainder))?;
        same("time_rest", &row.time_rest, &Some(start.time_rest))?;
        same("extra_edge", &row.extra_edge, &Some(Hex(start.extra_edge.into())))?;
        same("cycles_used", &row.cycles_used, &Some(start.cycles_used))?;
        same("cycles_dropped", &row.cycles_dropped, &Some(start.cycles_dropped))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FwSync {
    period_cycles: u32,
    cycles_per_bit: u32,
    es: u8,
    startup: FwStartup,
    /// Of the firmware's own run.
    #[serde(rename = "qm")]
    _qm: Hex,
    resets: u32,
    columns: Vec<String>,
    frames: Vec<FwFrame>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FwStartup {
    extra_size: u32,
    time_rest: u8,
    stuffing: u32,
    extra_remainder: u32,
    stuffing_remainder: u32,
}

/// Stuffing blocks before, edge in eighths, equalisation, PARA, edge minus pulse in cycles.
type FwFrame = (u8, u8, Line, Line, i64);

/// The equalisation goes by the nominal window, PARA gives IDLE with FIRST.
fn fw_head(frame: &FwFrame, nominal: u32) -> Result<bool, Fault> {
    let byte = ParameterByte::decode(frame.3.word());
    let byte = byte.ok_or_else(|| Fault::Unreadable("PARA is in no table".to_owned()))?;
    same("symbol, FIRST", &(Ok(MasterSymbol::Idle), true), &(byte.symbol(), byte.first()))?;
    let disparity = LineDisparity::ZERO.with_ones(nominal as u8);
    same("equalisation", &(frame.2.bits as u8), &disparity.equalisation().bits)?;
    Ok(byte.msync())
}

/// How much later the edge is than one frame before, against the pulse, as the frame's length says.
fn fw_spacing(from: &FwFrame, to: &FwFrame, cycles: i64, period: i64) -> Result<i64, Fault> {
    let extra = |edge| Extra::new(edge).ok_or_else(|| Fault::Unreadable(format!("edge {edge}")));
    let (before, after) = (extra(from.1)?, extra(to.1)?);
    let rest = i64::from(before.bits()) * 8 - i64::from(before.get());
    let eighths = rest + i64::from(H_FRAME_BITS) * 8 + 48 * i64::from(to.0) + i64::from(after.get());
    Ok(eighths * cycles - period)
}

pub(super) fn fw_sync(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FwSync| {
        let columns = ["stuffing_blocks_before", "edge_eighths_after_window_start", "equalisation", "para"];
        let columns = [&columns[..], &["edge_minus_pulse_cycles"]].concat();
        same("columns", &row.columns.iter().map(String::as_str).collect(), &columns)?;
        same("resets", &0, &row.resets)?;
        let clock = clock(row.cycles_per_bit)?;
        let start = Startup::new(row.period_cycles, clock, es(row.es)?);
        let start = start.map_err(|e| Fault::Unreadable(e.to_string()))?;
        let got = FwStartup {
            extra_size: start.extra_size,
            time_rest: start.time_rest,
            stuffing: start.stuffing,
            extra_remainder: start.extra_remainder,
            stuffing_remainder: start.stuffing_remainder,
        };
        same("startup", &row.startup, &got)?;
        let mut msync = Vec::new();
        for frame in &row.frames {
            msync.push(fw_head(frame, start.extra_size)?);
        }
        let runs: Vec<usize> = msync.chunk_by(|a, b| a == b).map(<[bool]>::len).collect();
        if let [first, inner @ .., last] = runs.as_slice() {
            let whole = inner.iter().all(|run| *run == 8) && *first <= 8 && *last <= 8;
            same("MSYNC changes every 8 frames", &true, &whole)?;
        }
        for (at, (from, to)) in row.frames.iter().zip(row.frames.iter().skip(1)).enumerate() {
            let cycles = i64::from(clock.cycles_per_eighth());
            let want = fw_spacing(from, to, cycles, row.period_cycles.into())?;
            // The firmware takes two cycles more for a frame, and one after entries 23 and 31 of every 32.
            let overhead = (to.4 - from.4) - want;
            same("the firmware's overhead", &if matches!(at % 32, 23 | 31) { 1 } else { 2 }, &overhead)?;
        }
        Ok(())
    })
}
