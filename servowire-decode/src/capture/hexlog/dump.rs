//! Dumps: lines with an address, bytes, and perhaps their text.

/// How a dump writes its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dump {
    /// In the order of the file, in groups of any length.
    InOrder,
    /// Words of two bytes, the lower one last (`hexdump`).
    Swapped,
    /// Words, the lowest byte last, in this many columns after the address (`xxd -e`): a short word is aligned to the right
    /// end of its place.
    Little(usize),
    /// Bits (`xxd -b`).
    Bits,
    /// Octal words (`od`): cannot be distinguished from other numbers with certainty.
    Octal,
}

/// A line of a dump.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Row {
    Bytes(Vec<u8>),
    /// The previous row, repeated up to the next address.
    Again,
    /// No bytes: the address after the last.
    End,
}

/// Returns the address at the front, the rest, and whether a colon separates them.
fn address(line: &str) -> Option<(u64, &str, usize, bool)> {
    let bare = line.trim_start();
    let bare = bare.strip_prefix("0x").unwrap_or(bare);
    let digits = bare.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(bare.len());
    let (number, rest) = bare.split_at(digits);
    let colon = rest.starts_with(':');
    let rest = rest.strip_prefix(':').unwrap_or(rest);
    let fits = (4..=16).contains(&digits) && (rest.is_empty() || rest.starts_with(char::is_whitespace));
    Some((u64::from_str_radix(number, 16).ok()?, rest, digits, colon)).filter(|_| fits)
}

impl Dump {
    /// Returns what the beginning of a file looks like; `None` if it is not a dump.
    pub(super) fn of(head: &str, whole: bool) -> Option<Self> {
        let mut lines: Vec<&str> = head.lines().filter(|line| !line.trim().is_empty()).take(16).collect();
        if !whole && lines.len() > 1 {
            lines.pop();
        }
        let rows: Vec<_> = lines.iter().filter(|line| line.trim() != "*").map(|line| address(line)).collect();
        let rows: Vec<(u64, &str, usize, bool)> = rows.into_iter().collect::<Option<_>>()?;
        let &(first, rest, width, colon) = rows.first()?;
        let grows = rows.windows(2).all(|pair| matches!(pair, [a, b] if b.0 > a.0 && b.2 == a.2));
        // Without a colon a dump begins at 0, as files do: else the address may be bytes.
        if !grows || !colon && (first != 0 || rows.len() < 2 && !rest.contains(['|', '>'])) {
            return None;
        }
        let groups: Vec<&str> = hex_part(rest, colon).split_whitespace().collect();
        // Of a whole row, or of sixteen bytes in words of four.
        let columns = if rows.len() > 1 { 1 + hex_part(rest, true).len() } else { 37 };
        let all = |test: &dyn Fn(&&str) -> bool| !groups.is_empty() && groups.iter().all(test);
        Some(if colon && all(&|group| group.len() == 8 && group.bytes().all(|b| matches!(b, b'0' | b'1'))) {
            Self::Bits
        } else if width == 7 && !colon && all(&|group| group.len() == 4) {
            Self::Swapped
        } else if colon && is_swapped(rest, columns) {
            Self::Little(columns)
        } else if width == 7 && !colon && all(&|group| group.len() == 6) {
            Self::Octal
        } else {
            Self::InOrder
        })
    }

    /// Takes a line, with its address.
    pub(super) fn row(self, line: &str) -> Result<(u64, Row), String> {
        if line.trim() == "*" {
            return Ok((0, Row::Again));
        }
        let (at, rest, _, colon) = address(line).ok_or_else(|| format!("{:?} has no address", line.trim()))?;
        let mut bytes = Vec::new();
        let words = match self {
            Self::Little(columns) => rest.get(..columns).unwrap_or(rest),
            _ => hex_part(rest, colon),
        };
        for group in words.split_whitespace() {
            let group = group.strip_prefix("0x").unwrap_or(group);
            if self == Self::Bits {
                let byte = u8::from_str_radix(group, 2);
                bytes.push(byte.map_err(|_| format!("{group:?} is not a byte in bits"))?);
                continue;
            }
            if group.len() % 2 != 0 || !group.bytes().all(|b| b.is_ascii_hexdigit()) {
                // The text beside the bytes.
                if bytes.is_empty() {
                    return Err(format!("{group:?} is not bytes in hex"));
                }
                break;
            }
            let from = bytes.len();
            let digits = (0..group.len()).step_by(2).filter_map(|k| u8::from_str_radix(group.get(k..k + 2)?, 16).ok());
            bytes.extend(digits);
            if matches!(self, Self::Swapped | Self::Little(_)) {
                bytes.get_mut(from..).unwrap_or_default().reverse();
            }
        }
        Ok((at, if bytes.is_empty() { Row::End } else { Row::Bytes(bytes) }))
    }
}

/// Returns whether the text beside the bytes matches only if the bytes of each word are read in reverse.
fn is_swapped(rest: &str, columns: usize) -> bool {
    let Some((groups, text)) = rest.split_at_checked(columns) else { return false };
    let (groups, text) = (groups.split_whitespace().collect::<Vec<_>>(), text.trim());
    let shown = |group: &str| -> Vec<char> {
        let byte = |k: usize| u8::from_str_radix(group.get(k..k + 2)?, 16).ok();
        let bytes = (0..group.len()).step_by(2).filter_map(byte);
        bytes.map(|byte| if (b' '..=b'~').contains(&byte) { char::from(byte) } else { '.' }).collect()
    };
    let straight: String = groups.iter().flat_map(|group| shown(group)).collect();
    let swapped: String = groups.iter().flat_map(|group| shown(group).into_iter().rev()).collect();
    let begins = |letters: &str| !letters.trim().is_empty() && text.starts_with(letters.trim());
    begins(&swapped) && !begins(&straight)
}

/// Returns the part of a row that holds bytes: up to the text between bars or after two blanks.
fn hex_part(rest: &str, colon: bool) -> &str {
    let rest = rest.split(['|', '>']).next().unwrap_or_default();
    let rest = rest.trim_start();
    match rest.find(if colon { "  " } else { "   " }) {
        Some(at) => rest.get(..at).unwrap_or(rest),
        None => rest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dumps_by_their_first_lines() {
        for (text, want) in [
            ("00000000: 02a5 00ff  ....\n00000010: 2080 81\n", Some(Dump::InOrder)),
            ("00000000  02 a5 00 ff  |....|\n00000010\n", Some(Dump::InOrder)),
            ("0000000 a502 ff00\n0000010 8020\n", Some(Dump::Swapped)),
            ("0000000 122402 177400\n0000020 100040\n", Some(Dump::Octal)),
            ("00000000: 00000010 10100101  ..\n", Some(Dump::Bits)),
            // The same six bytes by `xxd` and by `xxd -e`.
            ("00000000: 1a20 4142 4344                           . ABCD\n", Some(Dump::InOrder)),
            ("00000000: 4241201a     4443                     . ABCD\n", Some(Dump::Little(37))),
            ("0x20000000:\t0x1a\t0x20\n0x20000008:\t0x29\n", Some(Dump::InOrder)),
            ("0000   1a 20 29 c0   ....\n0010   1a\n", Some(Dump::InOrder)),
            ("1a2029c0 3b17\n1a2029c1 3b17\n", None),
            ("1A\n1A 20 29\n", None),
            ("00000000\n00000000\n", None),
        ] {
            assert_eq!(Dump::of(text, true), want, "{text}");
        }
    }

    #[test]
    fn rows() {
        let row = |dump: Dump, text: &str| dump.row(text).unwrap();
        assert_eq!(row(Dump::InOrder, "00000000: 02a5 00ff  2020"), (0, Row::Bytes(vec![2, 0xa5, 0, 0xff])));
        assert_eq!(row(Dump::InOrder, "00000010  20 80 81       | ..|"), (16, Row::Bytes(vec![0x20, 0x80, 0x81])));
        assert_eq!(row(Dump::Swapped, "0000010 8020 0081    "), (16, Row::Bytes(vec![0x20, 0x80, 0x81, 0])));
        let little = row(Dump::Little(37), "00000010: 01173bc0     0201                    .;....  01");
        assert_eq!(little, (16, Row::Bytes(vec![0xc0, 0x3b, 0x17, 1, 1, 2])));
        assert_eq!(row(Dump::InOrder, "00000013"), (0x13, Row::End));
        assert_eq!(row(Dump::Bits, "00000000: 00000010 10100101  .."), (0, Row::Bytes(vec![2, 0xa5])));
        assert_eq!(row(Dump::InOrder, "*"), (0, Row::Again));
        assert!(Dump::InOrder.row("00000000  zz").is_err());
    }
}
