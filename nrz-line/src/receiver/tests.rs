use super::*;
use crate::FormatError;
use crate::Wave;
use proptest::prelude::*;
use std::vec::Vec;

/// Line bits of fields sent back to back, with idle line before and after.
fn line(content_bits: u32, fields: &[u16]) -> Vec<bool> {
    let mut bits = std::vec![true; 3];
    for field in fields {
        bits.push(false);
        bits.extend((0..content_bits).map(|k| field >> k & 1 == 1));
        bits.push(true);
    }
    bits.extend([true; 3]);
    bits
}

fn render(bits: &[bool], wave: Wave) -> Vec<(bool, u64)> {
    (0..).zip(bits).map(|(k, &b)| (b, wave.first_sample(k + 1) - wave.first_sample(k))).collect()
}

fn receive(format: Format, runs: &[(bool, u64)]) -> Vec<Field> {
    let mut receiver = Receiver::new(format);
    runs.iter().filter_map(|&(level, len)| receiver.run(level, len)).collect()
}

/// All contents that stress the clock: every 8-bit content; for 16 bits all with one or two runs and their neighbours.
fn worst(content_bits: u32) -> Vec<u16> {
    if content_bits == 8 {
        return (0..=255).step_by(if cfg!(miri) { 51 } else { 1 }).collect();
    }
    let mut out: Vec<u16> = (0..=16)
        .flat_map(|k| {
            let low = (1_u32 << k) as u16;
            let ones = low.wrapping_sub(1);
            [ones, !ones, low, !low]
        })
        .collect();
    out.extend([0x5555, 0xaaaa, 0x8001, 0x7ffe, 0x00ff, 0xff00]);
    out
}

/// Whether fields of every worst content arrive at every phase of the sampler when the sender is `ppm` too fast.
fn survives(samples: u32, content_bits: u32, ppm: i32) -> bool {
    let format = Format::new(samples, content_bits).unwrap();
    worst(content_bits).iter().all(|&content| {
        (0..32).step_by(if cfg!(miri) { 31 } else { 1 }).all(|phase| {
            let wave = Wave::new(samples, ppm, phase << 27);
            let fields = [content, content, !content];
            let got = receive(format, &render(&line(content_bits, &fields), wave));
            let mask = if content_bits == 8 { 0xff } else { 0xffff };
            got.len() == 3 && got.iter().zip(fields).all(|(g, want)| g.delimiter && g.content == want & mask)
        })
    })
}

/// The limits of the alignment rule, in per mille of the bit rate: (N, K, fast, slow).
const LIMITS: [(u32, u32, i32, i32); 10] = [
    (8, 8, 43, 52),
    (13, 8, 54, 49),
    (16, 8, 51, 52),
    (40, 8, 55, 52),
    (80, 8, 57, 52),
    (4, 16, 15, 28),
    (5, 16, 24, 23),
    (6, 16, 20, 28),
    (8, 16, 22, 28),
    (80, 16, 29, 28),
];

#[test]
fn rate_tolerance_reaches_the_limits_and_ends_there() {
    for (samples, content_bits, fast, slow) in LIMITS.into_iter().take(if cfg!(miri) { 1 } else { LIMITS.len() }) {
        for ppm in (-slow * 1000 + 500..=fast * 1000 - 500).step_by(if cfg!(miri) { 80_000 } else { 3500 }) {
            assert!(survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
        }
        for ppm in [fast * 1000 - 500, -slow * 1000 + 500] {
            assert!(survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
        }
        // One per cent further the nine or seventeen bits without an edge are misread somewhere.
        for ppm in [fast * 1000 + 10_000, -slow * 1000 - 10_000] {
            assert!(!survives(samples, content_bits, ppm), "N {samples}, K {content_bits}, {ppm} ppm");
        }
    }
}

#[test]
fn a_plain_bit_stream_at_any_offset() {
    let format = Format::new(1, 8).unwrap();
    for idle in 0..20 {
        let mut bits = std::vec![true; idle];
        bits.extend(line(8, &[0x92, 0x00, 0xff]));
        let runs: Vec<_> = bits.iter().map(|&b| (b, 1)).collect();
        let got = receive(format, &runs);
        let first = idle as u64 + 3;
        assert_eq!(
            got.iter().map(|f| (f.content, f.start)).collect::<Vec<_>>(),
            [(0x92, first), (0, first + 10), (0xff, first + 20)]
        );
    }
}

#[test]
fn spikes_are_dropped_and_counted() {
    let format = Format::new(8, 8).unwrap();
    let mut receiver = Receiver::new(format);
    for (level, len) in [(true, 40), (false, 2), (true, 30), (false, 1), (true, 9)] {
        assert_eq!(receiver.run(level, len), None);
    }
    let got: Vec<_> =
        render(&line(8, &[0x1a]), Wave::new(8, 0, 0)).iter().filter_map(|&(l, n)| receiver.run(l, n)).collect();
    assert_eq!(got, [Field { content: 0x1a, delimiter: true, start: 82 + 24, spikes: 2 }]);
}

#[test]
fn a_low_delimiter_is_a_framing_error_and_the_line_must_rise_again() {
    let mut receiver = Receiver::new(Format::new(4, 8).unwrap());
    assert_eq!(receiver.run(true, 8), None);
    let broken = receiver.run(false, 400).unwrap();
    assert!(!broken.delimiter);
    assert!(!receiver.is_receiving());
    assert_eq!(receiver.run(false, 400), None);
    let got: Vec<_> =
        render(&line(8, &[0x55]), Wave::new(4, 0, 0)).iter().filter_map(|&(l, n)| receiver.run(l, n)).collect();
    assert_eq!((got.len(), got[0].content, got[0].delimiter), (1, 0x55, true));
}

#[test]
fn other_formats_are_refused() {
    for samples in (0..200).filter(|n| !matches!(n, 1 | 4..=80)) {
        assert_eq!(Format::new(samples, 8), Err(FormatError::SamplesPerBit { got: samples }));
    }
    assert_eq!(Format::new(8, 9), Err(FormatError::ContentBits { got: 9 }));
}

/// Start bit, 8 or 16 content bits, delimiter.
#[test]
fn bits_of_a_field() {
    assert_eq!([8, 16].map(|bits| Format::new(4, bits).map(Format::field_bits)), [Ok(10), Ok(18)]);
}

/// A word has 64 samples; what is taken is gone.
#[test]
fn samples_that_are_left() {
    assert_eq!([0, 1, 63, 64, 65, 1000].map(|len| Samples::partial(0, len).len()), [0, 1, 63, 64, 64, 64]);
    assert_eq!(Samples::new(0).len(), 64);
    // Ten samples of idle line, a start bit, eight zeros, and no delimiter: the field ends in the middle of its last bit.
    let mut samples = Samples::partial(0x3ff, 60);
    let field = Receiver::new(Format::new(4, 8).unwrap()).feed(&mut samples);
    assert_eq!(
        (field.map(|f| f.delimiter), samples.len(), samples.is_empty()),
        (Some(false), 60 - 10 - 9 * 4 - 3, false)
    );
}

proptest! {
    /// Sample by sample, run by run and word by word give the same fields, however the input is cut.
    #[test]
    fn all_three_ways_agree(
        words in prop::collection::vec(prop_oneof![any::<u64>(), Just(0), Just(u64::MAX), (0..64u32).prop_map(|k| u64::MAX << k)], 1..60),
        cuts in prop::collection::vec(1..=64u32, 60),
        samples in prop_oneof![Just(1u32), 4..=80u32],
        content_bits in prop_oneof![Just(8u32), Just(16)],
    ) {
        let format = Format::new(samples, content_bits).unwrap();
        let (mut a, mut b, mut c) = (Receiver::new(format), Receiver::new(format), Receiver::new(format));
        let (mut by_sample, mut by_run, mut by_word) = (Vec::new(), Vec::new(), Vec::new());
        let all: Vec<bool> = words.iter().flat_map(|w| (0..64).map(move |k| w >> k & 1 == 1)).collect();
        by_sample.extend(all.iter().filter_map(|&s| a.push(s)));
        for run in all.chunk_by(|x, y| x == y) {
            by_run.extend(b.run(run[0], run.len() as u64));
        }
        for (word, cut) in words.iter().zip(cuts) {
            for mut part in [Samples::partial(*word, cut), Samples::partial(word.checked_shr(cut).unwrap_or(0), 64 - cut)] {
                while let Some(field) = c.feed(&mut part) {
                    by_word.push(field);
                }
            }
        }
        prop_assert_eq!(&by_sample, &by_run);
        prop_assert_eq!(&by_sample, &by_word);
        // While receiving, the whole state is the same but for the origin; outside a field the phase has no meaning.
        let state = |r: Receiver| (r.position(), r.level, r.bits, r.left, r.start, r.spikes);
        prop_assert_eq!((a.is_receiving(), a.position()), (c.is_receiving(), c.position()));
        if a.is_receiving() {
            prop_assert_eq!(state(a), state(b));
            prop_assert_eq!(state(a), state(c));
        }
    }
}

proptest! {
    /// A receiver that is fed in all three ways in turn sees what one sees that is fed sample by sample.
    #[test]
    fn the_three_ways_may_be_mixed(
        parts in prop::collection::vec((prop_oneof![any::<u64>(), (0..64u32).prop_map(|k| u64::MAX << k)], 1..=64u32, 0..3u8), 1..60),
        samples in prop_oneof![Just(1u32), 4..=80u32],
    ) {
        let format = Format::new(samples, 8).unwrap();
        let (mut plain, mut mixed) = (Receiver::new(format), Receiver::new(format));
        let (mut want, mut got) = (Vec::new(), Vec::new());
        for (word, len, way) in parts {
            let levels: Vec<bool> = (0..len).map(|k| word >> k & 1 == 1).collect();
            want.extend(levels.iter().filter_map(|&level| plain.push(level)));
            match way {
                0 => got.extend(levels.iter().filter_map(|&level| mixed.push(level))),
                1 => got.extend(levels.chunk_by(|a, b| a == b).filter_map(|run| mixed.run(run[0], run.len() as u64))),
                _ => {
                    let mut part = Samples::partial(word, len);
                    while let Some(field) = mixed.feed(&mut part) {
                        got.push(field);
                    }
                }
            }
            prop_assert_eq!((mixed.position(), mixed.is_receiving()), (plain.position(), plain.is_receiving()));
        }
        prop_assert_eq!(got, want);
    }
}

/// A low of any length, cut wherever it ends: a start bit that is high in its middle is none, also if that is the first sample of the
/// next piece.
#[test]
fn a_piece_that_ends_in_a_start_bit() {
    for (samples, low) in (4..=80).flat_map(|samples| (1..=samples).map(move |low| (samples, low))) {
        let format = Format::new(samples, 8).unwrap();
        let (mut plain, mut pieces) = (Receiver::new(format), Receiver::new(format));
        let (idle, rest) = (3_u32, 12 * samples);
        let want: Vec<_> = (0..idle + low + rest).filter_map(|at| plain.push(at < idle || at >= idle + low)).collect();
        let mut got = Vec::new();
        let mut feed = |mut word: u128, mut len: u32| {
            while len > 0 {
                let mut part = Samples::partial(word as u64, len.min(64));
                while let Some(field) = pieces.feed(&mut part) {
                    got.push(field);
                }
                word = word.wrapping_shr(64);
                len = len.saturating_sub(64);
            }
        };
        feed(0b111, idle + low);
        for at in (0..rest).step_by(64) {
            feed(u128::MAX, (rest - at).min(64));
        }
        assert_eq!(got, want, "{samples} samples a bit, low for {low}");
        assert_eq!((pieces.spikes, pieces.is_receiving()), (plain.spikes, plain.is_receiving()), "{samples}, {low}");
    }
}

/// Hours of idle line, and a field after it: indices are exact, whichever way the line is fed.
#[test]
fn long_idle_lines() {
    let format = Format::new(4, 8).unwrap();
    let bits = render(&line(8, &[0x1a])[3..], Wave::new(4, 0, 0));
    let long = u64::from(LONG);
    for idle in [1, long - 1, long, long + 1, 1 << 33, 1 << 40] {
        for way in 0..3 {
            let mut receiver = Receiver::new(format);
            assert_eq!(receiver.run(true, idle), None);
            assert_eq!(receiver.position(), idle);
            // Over the place where the origin moves.
            for _ in 0..3 {
                assert_eq!(receiver.push(true), None);
            }
            let mut word = Samples::partial(u64::MAX, 40);
            assert_eq!(receiver.feed(&mut word), None);
            assert_eq!((receiver.position(), receiver.is_receiving()), (idle + 43, false));
            let got: Vec<_> = match way {
                0 => bits.iter().filter_map(|&(level, len)| receiver.run(level, len)).collect(),
                1 => bits
                    .iter()
                    .flat_map(|&(level, len)| (0..len).map(move |_| level))
                    .filter_map(|s| receiver.push(s))
                    .collect(),
                _ => {
                    let levels = bits.iter().flat_map(|&(level, len)| (0..len).map(move |_| level));
                    let word = levels.take(64).zip(0..).fold(0, |word, (level, k)| word | u64::from(level) << k);
                    receiver.feed(&mut Samples::new(word)).into_iter().collect()
                }
            };
            assert_eq!(got, [Field { content: 0x1a, delimiter: true, start: idle + 43, spikes: 0 }]);
        }
    }
}

/// A line that carries something faster never reaches the middle of a start bit. Indices stay exact for as long as that lasts.
#[test]
fn a_field_that_does_not_end() {
    let format = Format::new(80, 8).unwrap();
    for way in 0..3 {
        let mut receiver = Receiver::new(format);
        assert_eq!(receiver.run(false, 10), None);
        // As after two thousand million samples of it.
        receiver.next += NEAR - 5;
        let (mut level, mut at) = (false, u64::from(NEAR) + 5);
        assert_eq!(receiver.position(), at);
        for _ in 0..4 {
            level = !level;
            let ended = match way {
                0 => receiver.run(level, 20),
                1 => (0..20).find_map(|_| receiver.push(level)),
                _ => receiver.feed(&mut Samples::partial(if level { u64::MAX } else { 0 }, 20)),
            };
            at += 20;
            assert_eq!((ended, receiver.position(), receiver.is_receiving()), (None, at, true));
            assert!(receiver.here() <= NEAR + 20, "indices are kept small");
        }
        // The line is quiet at last: the start bit has its middle, eight zeros follow, and the delimiter is missing.
        let field = receiver.run(false, 1_000);
        assert_eq!(field.map(|f| (f.content, f.delimiter, f.start)), Some((0, false, 0)));
        assert_eq!(receiver.position(), at + 1_000);
    }
}

/// At most one field ends in a run, and what is left of it is idle line.
#[test]
fn a_run_that_outlasts_its_field() {
    let mut receiver = Receiver::new(Format::new(8, 16).unwrap());
    let field = receiver.run(false, u64::from(u32::MAX) * 3).unwrap();
    assert_eq!((field.content, field.delimiter, field.start), (0, false, 0));
    assert_eq!((receiver.position(), receiver.is_receiving()), (u64::from(u32::MAX) * 3, false));
    assert_eq!(receiver.run(true, 0), None);
    assert_eq!(receiver.level, 0, "a run of no samples is no edge");
}
