//! Frequencies on the command line.

use servowire_decode::time;

/// Frequencies as people write them: `24000000`, `24M`, `2.5MHz`, `100 kHz`.
pub(crate) fn frequency(text: &str) -> Result<u64, String> {
    match time::frequency(text) {
        Some(hertz) if (1.0..=1e12).contains(&hertz.round()) => Ok(hertz.round() as u64),
        _ => Err(format!("\"{text}\" is not a frequency from 1 to 10^12 Hz, as 24M or 2500000")),
    }
}

/// Rates for which the receiver's grid of 80 samples a bit can be laid.
pub(crate) fn bit_rate(text: &str) -> Result<u32, String> {
    match frequency(text)? {
        rate @ 1..=1_000_000_000 => Ok(rate as u32),
        rate => Err(format!("{rate} bits a second are more than 10^9")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies() {
        for (text, want) in [
            ("24000000", 24_000_000),
            ("24M", 24_000_000),
            ("2.5 MHz", 2_500_000),
            ("100k", 100_000),
            ("1MHz", 1_000_000),
        ] {
            assert_eq!(frequency(text), Ok(want), "{text}");
        }
        for text in ["", "M", "fast", "-1", "0", "1e13", "inf", "NaN"] {
            assert!(frequency(text).is_err(), "{text}");
        }
    }
}
