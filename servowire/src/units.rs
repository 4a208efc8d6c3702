//! Frequencies and times on the command line.

use servowire_decode::time::{self, Time};
use step_motion::Limits;
use step_profile::Error;
use tformat::BitRate;

/// Frequencies as people write them: `24000000`, `24M`, `2.5MHz`, `100 kHz`.
pub(crate) fn frequency(text: &str) -> Result<u64, String> {
    match time::frequency(text) {
        Some(hertz) if (1.0..=1e12).contains(&hertz.round()) => Ok(hertz.round() as u64),
        _ => Err(format!("\"{text}\" is not a frequency from 1 to 10^12 Hz, such as 24M or 2500000")),
    }
}

/// Parses the greatest acceleration of an axis, in steps/s².
pub(crate) fn acceleration(text: &str) -> Result<u32, String> {
    Ok(limit(text, Limits::MAX_ACCELERATION.into())? as u32)
}

/// Parses the greatest jerk of an axis, in steps/s³.
pub(crate) fn jerk(text: &str) -> Result<u64, String> {
    limit(text, Limits::MAX_JERK)
}

fn limit(text: &str, most: u64) -> Result<u64, String> {
    let limit = text.parse().ok().filter(|limit| (1..=most).contains(limit));
    limit.ok_or_else(|| format!("it is a whole number, at least 1 and at most {most}"))
}

/// Says what is wrong with a profile of this frequency: its errors name the frequency of a rounded speed constant.
pub(crate) fn of_frequency(error: Error, hertz: f64) -> String {
    match error {
        Error::StepRateTooHigh { .. } => format!("{hertz} Hz is above 250 kHz"),
        Error::StepTimeOverflow { .. } => format!("at {hertz} Hz the first step of the ramp is longer than 2^32 ns"),
        other => other.to_string(),
    }
}

/// Parses a bit rate that the receiver's grid of 80 samples per bit allows.
pub(crate) fn bit_rate(text: &str) -> Result<u32, String> {
    match frequency(text)? {
        rate @ 1..=1_000_000_000 => Ok(rate as u32),
        rate => Err(format!("{rate} bit/s is more than 10^9")),
    }
}

/// Parses a time of the capture.
pub(crate) fn moment(text: &str) -> Result<Time, String> {
    time::duration(text).ok_or_else(|| format!("\"{text}\" is not a time with its unit, such as 20us, 1.5ms or 2s"))
}

/// Parses one of a protocol's bit rates in the same form; `6.67M` is close enough to 6,666,667.
pub(crate) fn one_of<T>(text: &str, rates: impl Iterator<Item = (T, u32)> + Clone) -> Result<T, String> {
    let said = frequency(text).unwrap_or(0);
    let near = |(_, rate): &(T, u32)| said.abs_diff(u64::from(*rate)) * 200 < u64::from(*rate);
    rates.clone().find(near).map(|(rate, _)| rate).ok_or_else(|| {
        let name = |(_, rate): (T, u32)| format!("{}M", (f64::from(rate) / 1e4).round() / 100.0);
        format!("\"{text}\" is not one of the rates {}", rates.map(name).collect::<Vec<_>>().join(", "))
    })
}

/// Parses a rate of T-Format.
pub(crate) fn tformat_rate(text: &str) -> Result<BitRate, String> {
    one_of(text, [BitRate::Mbit2_5, BitRate::Mbit5].into_iter().map(|rate| (rate, rate.bits_per_second())))
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

    #[test]
    fn limits_of_an_axis() {
        assert_eq!((acceleration("1"), acceleration("2147483647")), (Ok(1), Ok(2_147_483_647)));
        assert_eq!((jerk("1"), jerk("17592186044415")), (Ok(1), Ok(17_592_186_044_415)));
        for text in ["0", "2147483648", "-1", "1.5", ""] {
            let error = acceleration(text).unwrap_err();
            assert_eq!(error, "it is a whole number, at least 1 and at most 2147483647", "{text}");
        }
        for text in ["0", "17592186044416", "1e30"] {
            let error = jerk(text).unwrap_err();
            assert_eq!(error, "it is a whole number, at least 1 and at most 17592186044415", "{text}");
        }
    }

    #[test]
    fn rates_of_a_protocol() {
        let rate = |text| one_of(text, [('a', 2_500_000), ('b', 6_666_667)].into_iter());
        for (text, want) in [("2.5M", 'a'), ("2500000", 'a'), ("2.5 MHz", 'a'), ("6.67M", 'b'), ("6.666667M", 'b')] {
            assert_eq!(rate(text), Ok(want), "{text}");
        }
        for text in ["2.5", "5M", "6.6M", "fast"] {
            assert_eq!(rate(text), Err(format!("\"{text}\" is not one of the rates 2.5M, 6.67M")));
        }
    }
}
