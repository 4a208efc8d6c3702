//! Reception of a sampled line.

use nrz_line::{Field, Format, Receiver, Samples};

use crate::byte;

/// The same samples one by one, as runs, and as packed words give the same fields.
///
/// ```text
/// 0  samples a bit      1  content bits, 8 or 16 by bit 0; bits 1.. cut runs and words      2..  samples, LSB first
/// ```
pub fn receiver(mut data: &[u8]) {
    let samples_per_bit = u32::from(byte(&mut data));
    let shape = byte(&mut data);
    let content_bits = if shape & 1 == 0 { 8 } else { 16 };
    let cut = u32::from(shape >> 1 & 63) + 1;
    let Ok(format) = Format::new(samples_per_bit, content_bits) else { return };
    let samples: Vec<bool> = data.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 == 1)).collect();

    let (mut pushed, mut by_sample) = (Receiver::new(format), Vec::new());
    by_sample.extend(samples.iter().filter_map(|sample| pushed.push(*sample)));

    let (mut run, mut by_run) = (Receiver::new(format), Vec::new());
    for level in samples.chunk_by(|a, b| a == b) {
        // A run may come in parts.
        let len = level.len() as u64;
        let head = len.min(u64::from(cut));
        by_run.extend(run.run(level[0], head));
        by_run.extend(run.run(level[0], len - head));
    }

    let (mut fed, mut by_word) = (Receiver::new(format), Vec::new());
    for word in samples.chunks(cut as usize) {
        let bits = word.iter().rev().fold(0, |bits, sample| bits << 1 | u64::from(*sample));
        let mut rest = Samples::partial(bits, word.len() as u32);
        while let Some(field) = fed.feed(&mut rest) {
            by_word.push(field);
        }
        assert!(rest.is_empty());
    }

    assert_eq!(by_run, by_sample);
    assert_eq!(by_word, by_sample);
    for receiver in [pushed, run, fed] {
        assert_eq!(receiver.position(), samples.len() as u64);
        assert_eq!(receiver.is_receiving(), pushed.is_receiving());
    }
    check(format, &samples, &by_sample);
}

/// What holds for the fields of any line.
fn check(format: Format, samples: &[bool], fields: &[Field]) {
    let mut free = 0;
    for field in fields {
        let start = usize::try_from(field.start).expect("an index");
        assert!(start >= free, "fields do not overlap");
        assert!(!samples[start] && (start == 0 || samples[start - 1]), "a field begins with a falling edge");
        assert!(u32::from(field.content) < 1 << format.content_bits());
        free = start + 1;
    }
}
