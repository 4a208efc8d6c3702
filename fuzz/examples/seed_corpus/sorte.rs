//! Frames of all kinds, DISCOVERY and SYNC on their way, the life of a device, steps of the generator.

use serde_json::Value;

use crate::{Source, hex};

pub(crate) const SOURCES: &[Source] = &[
    ("c_codecs", "sorte/ioex_device.jsonl", frame),
    ("c_codecs", "sorte/ioex_master.jsonl", frame),
    ("c_codecs", "sorte/param.jsonl", frame),
    ("sorte_frame", "sorte/negative.jsonl", frame),
    ("sorte_frame", "sorte/ioex_master.jsonl", frame),
    ("sorte_frame", "sorte/ioex_device.jsonl", frame),
    ("sorte_frame", "sorte/param.jsonl", frame),
    ("sorte_cut_through", "sorte/discovery_chain.jsonl", discovery),
    ("sorte_cut_through", "sorte/sync_chain.jsonl", sync),
    ("sorte_device", "sorte/timing_budget.jsonl", device),
    ("sorte_sync0", "sorte/sync0_closed_loop.jsonl", sync0),
];

fn frame(row: &Value) -> Option<Vec<u8>> {
    row["frame"].as_str().or(row["wire"].as_str()).map(hex)
}

fn discovery(row: &Value) -> Option<Vec<u8>> {
    let flags = u8::from(row["is_last"].as_bool()?) | u8::from(row["prev_frame_crc_error"].as_bool()?) << 1 | 4;
    Some([vec![flags, 4], hex(row["tx"].as_str()?)].concat())
}

fn sync(row: &Value) -> Option<Vec<u8>> {
    Some([vec![0, 76], hex(row["master_frame"].as_str()?)].concat())
}

/// From IDLE into the exchange, as the last device or in the line, with damaged frames between.
fn device(row: &Value) -> Option<Vec<u8>> {
    let [number, ..] = row["line_delay_ns"].as_u64()?.to_le_bytes();
    let in_line = row["devices"].as_u64()? % 2 == 0;
    let mut input = vec![u8::from(!in_line)];
    let phases: [&[u8]; 6] = [&[0, 0, 16, 0, 0, 1], &[1, 0, 17, 1], &[2, 0, 18, 0], &[6, 100], &[2, 1], &[6, 101]];
    for phase in phases {
        let times = if phase == [6, 100] { 15 } else { 1 };
        input.extend(phase.repeat(times));
    }
    input.extend([
        3,
        number & 0xfe,
        19,
        number,
        3,
        1,
        7,
        number,
        7,
        2,
        5,
        0,
        5,
        0,
        4,
        30,
        5,
        0,
        5,
        0,
        5,
        0,
        5,
        0,
        5,
        0,
    ]);
    Some(input)
}

fn sync0(row: &Value) -> Option<Vec<u8>> {
    let [low, high, ..] = row["handler_latency_ns"].as_u64()?.to_le_bytes();
    let words = row["pto_in_cycle"].as_array()?;
    let times = (0..).zip(words).filter_map(|(n, word)| word.as_u64().filter(|w| *w > 0).map(|w| n * 4000 + w));
    let times: Vec<u64> = times.collect();
    let gaps = times.windows(2).filter_map(|pair| pair[1].checked_sub(pair[0])?.checked_sub(4000));
    let gaps = gaps.filter_map(|gap| u16::try_from(gap).ok()).flat_map(u16::to_le_bytes);
    Some([low, high].into_iter().chain(gaps).collect())
}
