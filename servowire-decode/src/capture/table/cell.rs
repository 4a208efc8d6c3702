//! The content of a cell of a table.

use crate::time::{self, Time};

/// A cell of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cell {
    /// 0 or 1.
    Level(bool),
    /// Empty, or X: no data.
    Nothing,
    Other,
}

pub(super) fn level(text: &[u8]) -> Cell {
    match text.trim_ascii() {
        b"0" => Cell::Level(false),
        b"1" => Cell::Level(true),
        b"" | b"X" | b"x" => Cell::Nothing,
        _ => Cell::Other,
    }
}

/// Reads the lines of a pod: `0x3F`.
pub(super) fn word(text: &[u8]) -> Option<u64> {
    let text = std::str::from_utf8(text.trim_ascii()).ok()?;
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"))?;
    if digits.bytes().all(|digit| digit.is_ascii_hexdigit()) { u64::from_str_radix(digits, 16).ok() } else { None }
}

/// Reads a number; `comma`: whether the decimal mark is a comma.
pub(super) fn number(text: &[u8], comma: bool) -> Option<f64> {
    let text = std::str::from_utf8(text).ok()?.trim();
    match text {
        "∞" => return Some(f64::MAX),
        "-∞" => return Some(f64::MIN),
        _ => {}
    }
    let number: f64 = if comma { text.replace(',', ".").parse() } else { text.parse() }.ok()?;
    number.is_finite().then_some(number)
}

/// Converts a time in fractions of a second (`divisor` of them per second) to picoseconds.
pub(crate) fn time(text: &str, divisor: i64) -> Option<Time> {
    let text = text.trim();
    if let Some(time) = time::from_decimal(text) {
        let (time, divisor) = (time.ps(), i128::from(divisor));
        return Some(Time::from_ps((time + time.signum() * (divisor / 2)) / divisor));
    }
    if text.contains(',') {
        return self::time(&text.replace(',', "."), divisor);
    }
    None
}

/// 1 January 1970 in this count of days.
const EPOCH: i64 = 719_469;

/// Reads `2022-06-24T18:51:08.852112100+00:00` as the time since 1970 in local time.
pub(crate) fn date(text: &str) -> Option<Time> {
    let (day, clock) = text.trim().split_once(['T', ' '])?;
    let mut parts = day.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    if !(1970..10_000).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Days since a first of March, by which leap days come last.
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day;
    let clock = clock.trim_end_matches('Z');
    let clock = clock.find(['+', '-']).map_or(clock, |at| clock.get(..at).unwrap_or(clock));
    let mut parts = clock.splitn(3, ':');
    let (hours, minutes): (i64, i64) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let seconds = time::from_decimal(parts.next()?)?;
    if !(0..24).contains(&hours)
        || !(0..60).contains(&minutes)
        || !(0..61 * i128::from(time::SECOND)).contains(&seconds.ps())
    {
        return None;
    }
    let before = (days - EPOCH) * 86_400 + hours * 3600 + minutes * 60;
    Some(Time::from_ps(i128::from(before) * i128::from(time::SECOND) + seconds.ps()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_in_all_units() {
        let time = |text, divisor| time(text, divisor).map(Time::ps);
        assert_eq!(time("0.000016460", 1), Some(16_460_000));
        assert_eq!(time("16.46", 1_000_000), Some(16_460_000));
        assert_eq!(time("-1,5", 1_000), Some(-1_500_000_000));
        let [a, b] =
            ["2022-06-24T18:51:08.852112100+00:00", "2022-06-24T18:51:09.852112100Z"].map(|t| date(t).unwrap());
        assert_eq!(b - a, 1_000_000_000_000);
        // Seconds since 1970, of that date and of the day after a leap day.
        assert_eq!(a.ps(), 1_656_096_668_852_112_100_000);
        assert_eq!(date("2000-03-01 00:00:00").map(Time::ps), Some(951_868_800_000_000_000_000));
        assert_eq!(time("oops", 1), None);
    }
}
