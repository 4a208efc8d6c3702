//! External synchronisation.

use hdsl::Error;
use hdsl::sync::{CoreClock, Es, ExtraWindow, Startup};
use serde::Deserialize;

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
        let state = ExtraWindow::from_registers(extra_size, time_rest, num_stuffing, time_extra_window);
        let mut state = state.map_err(|e| Fault::Unreadable(e.to_string()))?;
        same("extra_edge", &extra_edge, &state.extra_edge())?;
        same("steps", &row.adjust.len(), &row.steps.len())?;
        for (adjust, want) in row.adjust.iter().zip(row.steps) {
            same("step", &Ok(()), &state.step(*adjust))?;
            let edge = state.extra_edge();
            same("state", &want, &(state.extra_size(), state.time_rest(), state.stuffing(), state.window(), edge))?;
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
