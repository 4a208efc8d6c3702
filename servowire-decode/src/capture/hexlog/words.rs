//! Bytes in a line of text: how people, monitors and debuggers write them.

use std::iter::Peekable;
use std::str::Chars;

use super::super::table::cell;
use crate::event::Direction;
use crate::time::{self, SECOND, Time};

/// Bytes that followed each other, and their time and sender if the line gives them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::capture) struct Said {
    pub(in crate::capture) time: Option<Time>,
    pub(in crate::capture) direction: Option<Direction>,
    pub(in crate::capture) bytes: Vec<u8>,
}

/// The content of a line: one burst, or more if it names the senders.
pub(in crate::capture) fn line(text: &str) -> Result<Vec<Said>, String> {
    let text = text.trim_start_matches('\u{feff}').trim();
    let said = bare(text);
    // What somebody wrote in front is left out, if bytes follow and nothing else.
    if said.is_err() { titled(text).map_or(said, |said| Ok(vec![said])) } else { said }
}

/// `I (1234) encoder: 1A 20 29`, `12:30:00 PM: 1A 20 29`: bytes of two digits after words that end with a colon, a bracket
/// or an arrow; these words may name the sender.
fn titled(text: &str) -> Option<Said> {
    let is_byte = |word: &str| {
        let digits = word.strip_prefix("0x").unwrap_or(word);
        digits.len() == 2 && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
    };
    let ends = text.match_indices([':', ']', '>']).map(|(at, end)| at + end.len());
    let (title, words) = ends.filter_map(|at| text.split_at_checked(at)).find(|(_, after)| {
        after.starts_with(char::is_whitespace) && after.split_whitespace().all(is_byte) && !after.trim().is_empty()
    })?;
    let speaker = |word: &str| speaker(word).filter(|_| word.contains(char::is_alphabetic));
    let stamps: Vec<&str> = title.split_whitespace().collect();
    let direction = stamps.iter().copied().filter_map(speaker).next_back();
    let mut said = Said { time: moment(&stamps), direction, bytes: Vec::new() };
    words.split_whitespace().try_for_each(|word| bytes(word, &mut said.bytes)).ok()?;
    Some(said)
}

/// Reads a line whose bytes follow only times and the sender.
fn bare(text: &str) -> Result<Vec<Said>, String> {
    if let Some(bytes) = string(text) {
        return Ok(vec![Said { bytes: bytes?, ..Said::default() }]);
    }
    let text = without_remarks(text);
    if let Some(monitored) = monitored(&text) {
        return monitored;
    }
    if let Some(bytes) = decimal_list(&text) {
        return Ok(vec![Said { bytes, ..Said::default() }]);
    }
    let spread = text.replace("><", "> <").replace("}{", "} {").replace("\\x", " 0x");
    // What comes before the first byte may say when.
    let mut rest = spread.trim_start();
    let mut stamps = Vec::new();
    while let Some((word, after)) = rest.split_once(char::is_whitespace) {
        if !is_stamp(word, !after.trim().is_empty()) {
            break;
        }
        stamps.push(word);
        rest = after.trim_start();
    }
    let time = moment(&stamps);
    let words = rest.split(|c: char| c.is_whitespace() || matches!(c, ',' | ';')).filter(|word| !word.is_empty());
    let mut out = vec![Said::default()];
    let mut begun = false;
    for word in words {
        if let Some(mark) = mark(word, begun) {
            if out.last().is_some_and(|said| !said.bytes.is_empty()) {
                out.push(Said::default());
            }
            if let (Some(said), Mark::Speaker(direction)) = (out.last_mut(), mark) {
                said.direction = Some(direction);
            }
            continue;
        }
        if let Some(said) = out.last_mut() {
            bytes(word, &mut said.bytes)?;
            begun = true;
        }
    }
    out.retain(|said| !said.bytes.is_empty());
    Ok(out.into_iter().map(|said| Said { time, ..said }).collect())
}

/// Returns the time of a line from the words before its bytes: a date with a time of day, a time of day, seconds with a
/// fraction, or a number with its unit.
fn moment(words: &[&str]) -> Option<Time> {
    let bare = |word: &&str| word.trim_matches(['[', ']', '(', ')', ':']).replace(',', ".");
    let words: Vec<String> = words.iter().map(bare).collect();
    cell::date(&words.join(" ")).or_else(|| words.iter().find_map(|word| clock(word)))
}

/// `12:30:00.25`, `30:00.25`, `0.000500`, `500us`, and a date with a T.
fn clock(word: &str) -> Option<Time> {
    let Some((hours, seconds)) = word.rsplit_once(':') else {
        let seconds = word.contains('.').then(|| time::from_decimal(word)).flatten();
        return seconds.or_else(|| time::duration(word));
    };
    if let Some(date) = cell::date(word) {
        return Some(date);
    }
    let (hours, minutes) = match hours.split_once(':') {
        Some((hours, minutes)) => (hours.parse::<i64>().ok()?, minutes),
        None if seconds.contains('.') => (0, hours),
        None => return None,
    };
    let minutes: i64 = minutes.parse().ok()?;
    ((0..100).contains(&hours) && (0..60).contains(&minutes))
        .then_some(time::from_decimal(seconds)? + (hours * 60 + minutes) * 60 * SECOND)
}

/// Returns the sender from a word that names it.
pub(in crate::capture) fn speaker(word: &str) -> Option<Direction> {
    match mark(word, false) {
        Some(Mark::Speaker(direction)) => Some(direction),
        _ => None,
    }
}

fn without_remarks(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("/*") {
        out.push_str(before);
        out.push(' ');
        rest = after.split_once("*/").map_or("", |(_, after)| after);
    }
    out.push_str(rest);
    let end = out.find('#').into_iter().chain(out.find("//")).min().unwrap_or(out.len());
    out.truncate(end);
    out
}

/// Returns whether a word is a date, a time of day, seconds with a fraction, or one of these in brackets. `followed`: other
/// words follow, so `22:23:52` may be a time instead of three bytes.
fn is_stamp(word: &str, followed: bool) -> bool {
    let (bare, bracketed) = match word.strip_prefix(['[', '(']) {
        Some(inside) => (inside.trim_end_matches([']', ')', ':']), true),
        None => (word.trim_end_matches(':'), false),
    };
    let bare = bare.trim_end_matches([']', ')', 's', 'Z']).trim_end_matches('u').trim_end_matches('m');
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let split = |at: &[char]| bare.split(at).collect::<Vec<_>>();
    let parts = split(&[':', '.', ',', 'T', '-', '/', '+']);
    if !parts.iter().all(|part| digits(part)) {
        return false;
    }
    let clock = bare.contains(':') && split(&[':']).len() >= 2 && (bare.contains(['.', ',', 'T']) || followed);
    let date = !bare.contains(':') && parts.len() == 3 && parts.iter().any(|part| part.len() == 4);
    let seconds = parts.len() == 2 && bare.contains('.');
    clock || date || seconds || bracketed && parts.len() == 1
}

/// A word beside the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mark {
    /// It names the sender.
    Speaker(Direction),
    /// It is only a separator.
    Separator,
}

/// A word that is not bytes. `begun`: bytes come before it.
fn mark(word: &str, begun: bool) -> Option<Mark> {
    let (request, answer) = (Mark::Speaker(Direction::Request), Mark::Speaker(Direction::Answer));
    let bare = word.trim_matches(['[', ']', '(', ')', ':', '-', '<', '>', '|']);
    if bare.is_empty() {
        return match word.trim_end_matches(':') {
            ">" | ">>" => Some(request),
            "<" | "<<" | "<-" => Some(answer),
            // Between bytes an arrow stands before the answer; before them it says nothing.
            "->" | "=>" => Some(if begun { answer } else { Mark::Separator }),
            "-" | "|" | ":" | "[" | "]" | "--" => Some(Mark::Separator),
            _ => None,
        };
    }
    match bare.to_ascii_uppercase().as_str() {
        "TX" | "TXD" | "OUT" | "SEND" | "SENT" | "WRITE" | "REQ" | "REQUEST" | "CMD" | "COMMAND" | "H2D" => {
            Some(request)
        }
        "RX" | "RXD" | "IN" | "RECV" | "RECEIVED" | "READ" | "RESP" | "RSP" | "RESPONSE" | "ANSWER" | "D2H" => {
            Some(answer)
        }
        _ => None,
    }
}

/// `1A`, `1a2029`, `0x1A`, `0x2`, `1A:20:29`, `1A-20`, `<02>`, `{A5}`, `$02`, `0x02u8`, `'0x2'`
fn bytes(word: &str, out: &mut Vec<u8>) -> Result<(), String> {
    let bare = |c: char| matches!(c, '[' | ']' | '{' | '}' | '<' | '>' | '\'' | '"' | '(' | ')');
    for part in word.split([':', '-']).map(|part| part.trim_matches(bare)).filter(|part| !part.is_empty()) {
        let prefixed = part.strip_prefix("0x").or_else(|| part.strip_prefix("0X")).or_else(|| part.strip_prefix('$'));
        let digits = prefixed.unwrap_or(part);
        let digits = match prefixed {
            Some(digits) => digits.trim_end_matches("u8").trim_end_matches(['u', 'U', 'L']),
            None => digits.strip_suffix(['h', 'H']).filter(|digits| digits.len() == 2).unwrap_or(digits),
        };
        let single = prefixed.is_some() && digits.len() == 1;
        if digits.is_empty() || digits.len() % 2 != 0 && !single || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err(format!("\"{word}\" is not bytes in hex: two digits each, such as 1A 20 29"));
        }
        out.extend(digits.as_bytes().chunks(2).map(|pair| pair.iter().fold(0, |n, &d| n << 4 | nibble(d))));
    }
    Ok(())
}

fn nibble(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        _ => (digit | 0x20) - b'a' + 10,
    }
}

/// `[2, 165, 0]`: decimal if there are brackets and commas and nothing indicates hex.
fn decimal_list(text: &str) -> Option<Vec<u8>> {
    let inside = text.trim().trim_end_matches([';', ',']);
    let between = |open: char, close: char| inside.strip_prefix(open)?.strip_suffix(close);
    numbers(between('[', ']').or_else(|| between('{', '}'))?)
}

/// Decimal numbers of a byte with commas between them.
pub(super) fn numbers(inside: &str) -> Option<Vec<u8>> {
    if !inside.contains(',') {
        return None;
    }
    let cells = inside.split(',').map(str::trim).filter(|cell| !cell.is_empty());
    cells.map(|cell| if cell.bytes().all(|b| b.is_ascii_digit()) { cell.parse::<u8>().ok() } else { None }).collect()
}

/// A string of Python or C with its escapes: `b'\x02Hello'`.
fn string(text: &str) -> Option<Result<Vec<u8>, String>> {
    let inside = text.strip_prefix("bytearray(").and_then(|inside| inside.strip_suffix(')')).unwrap_or(text);
    let inside = inside.trim_end_matches([';', ',']);
    let inside = match inside.strip_prefix('b') {
        Some(inside) if inside.starts_with(['\'', '"']) => inside,
        _ if inside.starts_with('"') && inside.contains('\\') => inside,
        _ => return None,
    };
    let quote = inside.chars().next()?;
    let inside = inside.get(1..)?.strip_suffix(quote)?;
    let mut letters = inside.chars().peekable();
    let mut out = Vec::new();
    while let Some(letter) = letters.next() {
        let byte = if letter == '\\' { escape(&mut letters) } else { u8::try_from(u32::from(letter)).ok() };
        match byte {
            Some(byte) => out.push(byte),
            None => return Some(Err(format!("{text} contains an invalid escape"))),
        }
    }
    Some(Ok(out))
}

fn escape(letters: &mut Peekable<Chars<'_>>) -> Option<u8> {
    let mut digits = |base: u32, most: usize| {
        let mut value = None;
        for _ in 0..most {
            let Some(digit) = letters.peek().and_then(|letter| letter.to_digit(base)) else { break };
            letters.next();
            value = Some(value.unwrap_or(0) * base + digit);
        }
        value.and_then(|value| u8::try_from(value).ok())
    };
    if let Some(octal) = digits(8, 3) {
        return Some(octal);
    }
    match letters.next()? {
        'x' => {
            let mut value = None;
            for _ in 0..2 {
                let Some(digit) = letters.peek().and_then(|letter| letter.to_digit(16)) else { break };
                letters.next();
                value = Some(value.unwrap_or(0) << 4 | digit as u8);
            }
            value
        }
        't' => Some(b'\t'),
        'n' => Some(b'\n'),
        'r' => Some(b'\r'),
        'a' => Some(7),
        'b' => Some(8),
        'f' => Some(12),
        'v' => Some(11),
        other => u8::try_from(u32::from(other)).ok(),
    }
}

/// Lines of port monitors: `... IRP_MJ_WRITE Serial0 SUCCESS Length 2: 1A 20`; lines without data are ignored.
fn monitored(text: &str) -> Option<Result<Vec<Said>, String>> {
    if text.contains("IOCTL_SERIAL") {
        return Some(Ok(Vec::new()));
    }
    let (_, after) = text.split_once("IRP_MJ_")?;
    let direction = if after.starts_with("WRITE") {
        Direction::Request
    } else if after.starts_with("READ") {
        Direction::Answer
    } else {
        return Some(Ok(Vec::new()));
    };
    let Some((_, data)) = after.split_once("Length ").and_then(|(_, length)| length.split_once(':')) else {
        return Some(Ok(Vec::new()));
    };
    let mut out = Vec::new();
    for word in data.split_whitespace().filter(|word| !word.starts_with('.')) {
        if let Err(what) = bytes(word, &mut out) {
            return Some(Err(what));
        }
    }
    Some(Ok(vec![Said { direction: Some(direction), bytes: out, ..Said::default() }]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: [u8; 3] = [0x1a, 0x20, 0x29];

    fn alone(text: &str) -> Vec<u8> {
        let said = line(text).unwrap();
        assert_eq!(said.len(), 1, "{text}");
        said[0].bytes.clone()
    }

    #[test]
    fn ways_to_write_bytes() {
        for text in [
            "1A 20 29",
            "1a2029",
            "0x1A, 0x20,0x29",
            "1a:20:29",
            "  [1A-20-29] # position",
            "1A20 29 // x",
            "\u{feff}1A 20 29",
            "[26, 32, 41]",
            "{26, 32, 41},",
            "b'\\x1a )'",
            "bytearray(b'\\x1a \\x29')",
            "\"\\x1a\\040\\51\"",
            "\\x1a\\x20\\x29",
            "<1A><20><29>",
            "{1A}{20}{29}",
            "$1A $20 $29",
            "1Ah 20h 29h",
            "0x1au8, 0x20u8, 0x29u8 /* three */",
            "['0x1a', '0x20', '0x29']",
            "22:23:52.640 -> 1A 20 29",
            "[22:23:52.640] 1A 20 29",
            "22:23:52 1A 20 29",
            "2024-10-23 22:23:52,640 1A2029",
            "2024-10-23T22:23:52.640Z 1A2029",
            "(1436509052.249713) 1A 20 29",
            "0.001234: 1A 20 29",
            "I (1234) encoder: 1a 20 29",
            "12:30:00 PM: 1A 20 29",
            "17 ms: 0x1A 0x20 0x29",
            "Nov 22 09:15:00 bench axis[3]: 1A 20 29",
            "COM3 > 1A 20 29",
        ] {
            assert_eq!(alone(text), BYTES, "{text}");
        }
        for text in ["", "  # nothing", "// nothing", "59 0.1 app.exe IRP_MJ_CREATE Serial0 SUCCESS"] {
            assert_eq!(line(text), Ok(Vec::new()), "{text}");
        }
        for text in ["1A 2", "xyz", "1A 0x", "12 3g", "Hello", "b'\\q\u{416}'", "sent: 1A 2", "error: none"] {
            assert!(line(text).is_err(), "{text}");
        }
        // Three bytes when nothing follows.
        assert_eq!(alone("22:23:52"), [0x22, 0x23, 0x52]);
        assert_eq!(alone("0x2 0xA5"), [2, 0xa5]);
    }

    #[test]
    fn who_spoke() {
        let (tx, rx) = (Some(Direction::Request), Some(Direction::Answer));
        for (text, want) in [
            ("TX: 1A", vec![(tx, 1)]),
            ("[RX] - 1A 20 29", vec![(rx, 3)]),
            ("23.10.2024 22:23:52.640 [TX] - 1A 20 29", vec![(tx, 3)]),
            ("TX: 1A -> RX: 1A 20", vec![(tx, 1), (rx, 2)]),
            ("1A -> 1A 20", vec![(None, 1), (rx, 2)]),
            ("> 1A", vec![(tx, 1)]),
            ("<< 1A20", vec![(rx, 2)]),
            ("COM3 TX: 1A", vec![(tx, 1)]),
            ("I (1234) rx: 1A 20", vec![(rx, 2)]),
            ("send 1A recv 1A 20 29", vec![(tx, 1), (rx, 3)]),
            ("59 0.00000335 app.exe IRP_MJ_WRITE Serial0 SUCCESS Length 2: 1A 20", vec![(tx, 2)]),
            ("60 0.00000335 app.exe IRP_MJ_READ Serial0 SUCCESS Length 1: 1A", vec![(rx, 1)]),
        ] {
            let said: Vec<_> = line(text).unwrap().iter().map(|said| (said.direction, said.bytes.len())).collect();
            assert_eq!(said, want, "{text}");
        }
    }
}
