//! Single steps of the traces, and moves with a few commands.

use serde_json::Value;

use crate::Source;

pub(crate) const SOURCES: &[Source] = &[
    ("step_profile_step", "step-profile/step_trace.jsonl", step),
    ("step_profile_step", "step-profile/step_trace_edge.jsonl", step),
    ("step_profile_axis", "step-profile/profile.jsonl", axis),
];

fn word(row: &Value, key: &str) -> Option<[u8; 4]> {
    row[key].as_u64().and_then(|number| u32::try_from(number).ok()).map(u32::to_le_bytes)
}

fn step(row: &Value) -> Option<Vec<u8>> {
    Some([word(row, "entry")?, word(row, "speed")?, word(row, "prev")?].concat())
}

/// The move, run for a while, given up, started again the other way.
fn axis(row: &Value) -> Option<Vec<u8>> {
    let speed = u32::from_le_bytes(word(row, "speed")?).checked_sub(262_144 - 8)?;
    let [k, ..] = word(row, "k")?;
    let [low, high, ..] = word(row, "init_sync")?;
    let [steps, ..] = word(row, "n")?;
    let mut input = speed.checked_shl(6)?.to_le_bytes().to_vec();
    input.extend([k, low, high, steps % 3, steps % 7]);
    for command in [[0, steps], [1, 200], [1, 40], [2, 0], [1, 255], [4, steps], [1, 255], [3, 5], [1, 255]] {
        input.extend(command);
    }
    Some(input)
}
