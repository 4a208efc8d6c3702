//! Splits a line of a part program into words.

/// A letter and its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Word {
    pub(super) letter: char,
    pub(super) value: f64,
}

/// The content of a line.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Words {
    pub(super) list: Vec<Word>,
    /// Whether it begins with a slash, so that it may be skipped.
    pub(super) optional: bool,
    /// Whether it is a percent sign, which stands before and after a program.
    pub(super) percent: bool,
}

/// Returns the words of a line, without its number, its comments and its checksum.
pub(super) fn words(line: &str) -> Result<Words, String> {
    let text = checked(line.trim_start_matches('\u{feff}').trim())?;
    let mut out = Words::default();
    if text.starts_with('%') {
        out.percent = true;
        return Ok(out);
    }
    let mut left = text.chars().peekable();
    if let Some('/') = left.peek() {
        out.optional = true;
        left.next();
        while left.next_if(char::is_ascii_digit).is_some() {}
    }
    while let Some(letter) = left.next() {
        match letter {
            ';' => break,
            '(' => {
                left.by_ref().find(|c| *c == ')').ok_or("unterminated comment: \")\" is missing")?;
            }
            _ if letter.is_whitespace() => {}
            _ if letter.is_ascii_alphabetic() => {
                while left.next_if(|c| c.is_whitespace()).is_some() {}
                let mut digits = String::new();
                while let Some(c) = left.next_if(|c| c.is_ascii_digit() || matches!(c, '.' | '-' | '+')) {
                    digits.push(c);
                }
                let letter = letter.to_ascii_uppercase();
                let value = match (digits.parse(), left.peek()) {
                    (Ok(value), _) => value,
                    (Err(_), Some('#' | '[')) => {
                        return Err(format!("{letter}: values are numbers, not variables or sums; write the number"));
                    }
                    (Err(_), _) if digits.is_empty() => return Err(format!("{letter} has no number")),
                    (Err(_), _) => return Err(format!("{letter}{digits}: \"{digits}\" is not a number")),
                };
                out.list.push(Word { letter, value });
            }
            '#' | '[' => return Err("values are numbers, not variables or sums; write the number".to_owned()),
            '\0' | char::REPLACEMENT_CHARACTER => {
                return Err("a byte that is no text: a part program is a text file, in ASCII or UTF-8".to_owned());
            }
            _ => return Err(format!("\"{letter}\" is not G-code: a word is a letter and a number")),
        }
    }
    // The number of a line, and of a program.
    out.list.retain(|word| !matches!(word.letter, 'N' | 'O'));
    Ok(out)
}

/// Returns the part of a line before its checksum, which is the exclusive or of its bytes, after an asterisk.
fn checked(line: &str) -> Result<&str, String> {
    let Some((text, sum)) = line.rsplit_once('*') else { return Ok(line) };
    let Ok(want) = sum.trim().parse::<u8>() else { return Ok(line) };
    let got = text.bytes().fold(0, |sum, byte| sum ^ byte);
    if got == want { Ok(text) } else { Err(format!("its checksum is {got}, not {want}: the line is damaged")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(line: &str) -> Vec<(char, f64)> {
        words(line).unwrap().list.iter().map(|word| (word.letter, word.value)).collect()
    }

    #[test]
    fn words_of_all_kinds_of_lines() {
        assert_eq!(
            pairs("N0120 g01X10.Y-.5 (to the left) z+3 ; down"),
            [('G', 1.0), ('X', 10.0), ('Y', -0.5), ('Z', 3.0)]
        );
        assert_eq!(pairs("O1001 (PLATE)"), []);
        assert_eq!(pairs("%"), []);
        assert!(words("x 12 3").unwrap_err().contains("\"3\" is not G-code"));
        assert!(words("/2 G0 X1").unwrap().optional && !words("G0 X1").unwrap().optional);
    }

    /// 'N' ^ '3' ^ ' ' ^ 'G' ^ '2' ^ '8' is 78 ^ 51 ^ 32 ^ 71 ^ 50 ^ 56 = 16.
    #[test]
    fn a_checksum_is_looked_at() {
        assert_eq!(pairs("N3 G28*16"), [('G', 28.0)]);
        assert!(words("N3 G28*17").unwrap_err().contains("its checksum is 16, not 17"));
    }

    #[test]
    fn what_is_no_word() {
        for (line, want) in [
            ("G0 X#1", "not variables"),
            ("G0 X[1+2]", "not variables"),
            ("#1=5", "not variables"),
            ("G0 X", "X has no number"),
            ("G0 X1.2.3", "not a number"),
            ("G0 (left", "unterminated comment"),
            ("G0 &", "is not G-code"),
            ("\u{fffd}\u{fffd}G\0", "a byte that is no text"),
        ] {
            let error = words(line).unwrap_err();
            assert!(error.contains(want), "{line}: {error}");
        }
    }
}
