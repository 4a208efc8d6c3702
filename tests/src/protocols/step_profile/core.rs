//! Single steps, in the crate and on the PRU.

use serde::Deserialize;
use step_profile::{StepTime, corrected, pru_exact};

use crate::hex::Hex;
use crate::pru::Program;
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    word_index: usize,
    word: Hex,
    asm: String,
}

/// The project's own program, word by word.
pub(super) fn words(rows: &[Row]) -> Vec<Verdict> {
    let program = Program::step_core();
    each(rows, |row: Listed| {
        same("word", &Some(row.word.0), &program.words().get(row.word_index).copied().map(u64::from))?;
        same("asm", &Some(row.asm), &program.instructions().get(row.word_index).map(ToString::to_string))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Trace {
    entry: u32,
    speed: u32,
    prev: u32,
    t_step: u32,
    cnt_raw: u32,
    t_4us_cnt: u32,
    sync_raw: u32,
    cnt: u32,
    sync: u32,
    true_cnt: Option<u32>,
    true_sync: Option<u32>,
    exact: Option<bool>,
    #[serde(rename = "tag")]
    _why: Option<String>,
}

pub(super) fn step_trace(rows: &[Row]) -> Vec<Verdict> {
    let program = Program::step_core();
    each(rows, |row: Trace| {
        let want = [row.t_step, row.cnt_raw, row.t_4us_cnt, row.sync_raw, row.cnt, row.sync];
        let r = pru_exact::run(row.entry, row.speed, row.prev);
        same("registers", &want, &[r.t_step, r.cnt_raw, r.t_4us_cnt, r.sync_raw, r.cnt, r.sync])?;
        same("interpreted program", &want, &program.run(row.entry, row.speed, row.prev))?;
        let step = pru_exact::step(row.entry, row.speed, row.prev);
        same("step", &(row.cnt, row.sync), &(step.cnt, step.sync))?;
        let StepTime { cnt, sync } = corrected(row.t_step, row.prev);
        same("corrected", &(row.true_cnt.unwrap_or(cnt), row.true_sync.unwrap_or(sync)), &(cnt, sync))?;
        let exact = (step.cnt, step.sync) == (cnt, sync);
        same("exact", &row.exact.unwrap_or(exact), &exact)
    })
}
