//! Logs of a CAN bus, as `candump` of can-utils writes them: recognised only to be refused with a clear message.

/// The message for such a log.
pub(super) const REFUSED: &str = "a log of a CAN bus (candump): none of the protocols that are decoded runs on CAN. If an \
    adapter carried bytes of a serial line, cut them out, one burst per line, and give --bytes";

/// Returns whether the first lines are frames of a CAN bus.
///
/// ```text
///   can0  123   [8]  11 22 33 44 55 66 77 88         on the screen; a time in brackets may come first
/// (1436509052.249713) can0 123#1122334455            in a file
/// ```
pub(super) fn looks_like(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty()).take(3).peekable();
    lines.peek().is_some() && lines.all(is_frame)
}

fn is_frame(line: &str) -> bool {
    // `(1700000000.123456)`, `(2009-06-30 12:00:00.123456)`
    let line = line.trim_start();
    let line = if line.starts_with('(') { line.split_once(')').map_or("", |(_, rest)| rest) } else { line };
    let mut words = line.split_ascii_whitespace();
    let interface = words.next().unwrap_or_default();
    if !interface.starts_with(|c: char| c.is_ascii_alphabetic()) || matches!(interface, "RX" | "TX") {
        return false;
    }
    // Direction and flags of -x.
    let mut words = words.skip_while(|word| matches!(*word, "RX" | "TX" | "-" | "B" | "E" | "BE"));
    let id = |word: &str| matches!(word.len(), 3 | 8) && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let Some(first) = words.next() else { return false };
    match first.split_once('#') {
        Some((before, _)) => id(before),
        None => id(first) && words.next().is_some_and(|length| length.starts_with('[') && length.ends_with(']')),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_candump() {
        for text in [
            "  can0  123   [8]  11 22 33 44 55 66 77 88\n  can0  124   [2]  11 22\n",
            "(1436509052.249713) can0 123#1122334455\n(1436509052.449713) vcan0 1F334455#R5\n",
            " (1700000000.123456)  can0  RX - -  123   [8]  11 22 33 44 55 66 77 88\n",
            "(2009-06-30 12:00:00.123456) can0 123##1112233\n",
            "  can0  12345678  [08]  11 22 33 44 55 66 77 88",
        ] {
            assert!(looks_like(text.as_bytes()), "{text}");
        }
        for text in
            ["", "1A 20 29\n", "(1.5) 1A 20\n", "RX: 1A 20\n", "TX 123 [3]\n", "Time [s],Channel 0\n", "add 123 45\n"]
        {
            assert!(!looks_like(text.as_bytes()), "{text}");
        }
    }
}
