//! Lines of the oversampled T-Format vectors.

use serde_json::Value;

use crate::{Source, packed};

pub(crate) const SOURCES: &[Source] = &[("nrz_receiver", "tformat/oversampled.jsonl", receiver)];

/// Lines of up to 16 samples a bit: longer ones show the fuzzer nothing new.
fn receiver(row: &Value) -> Option<Vec<u8>> {
    let samples_per_bit = u8::try_from(row["n"].as_u64()?).ok().filter(|n| *n <= 16)?;
    let mut level = row["first"].as_u64()? == 0;
    let runs = row["runs"].as_array()?.iter().filter_map(Value::as_u64).flat_map(|len| {
        level = !level;
        (0..len).map(move |_| level)
    });
    let mut input = vec![samples_per_bit, 62];
    input.extend(packed(runs));
    Some(input)
}
