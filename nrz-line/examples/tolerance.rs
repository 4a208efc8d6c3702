//! How far off may a transmitter's clock be? `cargo run -p nrz-line --example tolerance -- 8`
//!
//! Renders the worst content (nine bits without an edge) at rates further and further off, until it is misread.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use nrz_line::{Format, FormatError, Receiver, Wave};

fn main() -> Result<(), FormatError> {
    let samples = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(8);
    let format = Format::new(samples, 8)?;
    for sign in [1, -1] {
        let limit = (0..20_000).step_by(100).take_while(|ppm10| survives(format, sign * ppm10 * 10)).last();
        println!(
            "{samples} samples a bit, {}: {:.1} %",
            if sign > 0 { "fast" } else { "slow" },
            f64::from(limit.unwrap_or(0)) / 1000.0
        );
    }
    Ok(())
}

/// Whether 0x00 and 0xff arrive at all phases from a transmitter that is `ppm` too fast.
fn survives(format: Format, ppm: i32) -> bool {
    (0..64_u32).all(|phase| {
        let wave = Wave::new(format.samples_per_bit(), ppm, phase << 26);
        [0x00_u16, 0xff].into_iter().all(|content| {
            let mut receiver = Receiver::new(format);
            // idle, start, content, delimiter, idle
            let level = |bit: u64| !(3..12).contains(&bit) || (bit > 3 && content != 0);
            let fields: Vec<_> = (0..20)
                .filter_map(|bit| receiver.run(level(bit), wave.first_sample(bit + 1) - wave.first_sample(bit)))
                .collect();
            fields.len() == 1 && fields.iter().all(|field| field.content == content && field.delimiter)
        })
    })
}
