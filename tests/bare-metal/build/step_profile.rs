//! Tables from `step_trace`, `step_trace_edge` and `profile`.

use serde_json::Value;

use super::{number, table, text};

/// Whole moves up to this length: a turn at 1/256 step.
const LONGEST: u64 = 51_200;

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let steps = [rows("step_trace"), rows("step_trace_edge")].concat();
    let moves = rows("profile");
    [
        table("TRACES: &[Traced]", &steps, traced),
        table("MOVES: &[Move]", moves.iter().filter(|row| number(row, "n") <= LONGEST), whole),
    ]
    .concat()
}

fn traced(row: &Value) -> String {
    let n = |key| number(row, key);
    format!(
        "Traced {{ why: {:?}, given: [{}, {}, {}], want: Registers {{ t_step: {}, cnt_raw: {}, t_4us_cnt: {}, \
         sync_raw: {}, cnt: {}, sync: {} }}, exact: {} }}",
        text(row, "tag"),
        n("entry"),
        n("speed"),
        n("prev"),
        n("t_step"),
        n("cnt_raw"),
        n("t_4us_cnt"),
        n("sync_raw"),
        n("cnt"),
        n("sync"),
        row["exact"] == true
    )
}

fn whole(row: &Value) -> String {
    let n = |key| number(row, key);
    format!(
        "Move {{ name: {:?}, steps: {}, per_entry: {}, speed: {}, init_sync: {}, ns: {}, fnv1a64: 0x{} }}",
        text(row, "name"),
        n("n"),
        n("k"),
        n("speed"),
        n("init_sync"),
        n("total_ns"),
        text(row, "fnv1a64")
    )
}
