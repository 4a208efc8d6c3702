//! Splits a line of a part program into words.

use std::iter::Peekable;
use std::str::Chars;

/// A letter and its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Word {
    pub(super) letter: char,
    pub(super) value: f64,
}

impl Word {
    /// Refuses what counts nothing.
    pub(super) fn whole(self) -> Result<(), String> {
        let Self { letter, value } = self;
        let whole = value >= 0.0 && value.fract() == 0.0;
        if whole { Ok(()) } else { Err(format!("{letter}{value}: a whole number from 0 on")) }
    }
}

/// The content of a line.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Words {
    pub(super) list: Vec<Word>,
    /// Whether it is a percent sign, which stands before and after a program.
    pub(super) percent: bool,
}

/// ^Z, which ended the files of CP/M and DOS.
const END: u8 = 0x1a;

/// Returns what is before ^Z in a line, and whether there is one. More of them may follow, as they fill a block.
pub(super) fn before_the_end(line: &[u8]) -> Result<(&[u8], bool), String> {
    let at = line.iter().position(|byte| *byte == END);
    let Some((text, rest)) = at.and_then(|at| line.split_at_checked(at)) else { return Ok((line, false)) };
    if rest.iter().any(|byte| *byte != END && !byte.is_ascii_whitespace()) {
        return Err("text after ^Z (\\x1a), which ends a file".to_owned());
    }
    Ok((text, true))
}

/// Whether a line begins with a slash, so that it may be left out.
pub(super) fn is_optional(line: &[u8]) -> bool {
    trimmed(line).starts_with(b"/")
}

/// A line without the mark of UTF-8 and the blanks around it.
fn trimmed(line: &[u8]) -> &[u8] {
    line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line).trim_ascii()
}

/// Returns the words of a line, without its number, its comments and its checksum.
pub(super) fn words(line: &[u8]) -> Result<Words, String> {
    let (text, comment) = checked(trimmed(line))?;
    let (text, comment) = (String::from_utf8_lossy(text), String::from_utf8_lossy(comment));
    let mut out = Words::default();
    let mut left = text.trim().chars().peekable();
    if left.peek() == Some(&'%') {
        out.percent = true;
        return Ok(out);
    }
    if left.next_if_eq(&'/').is_some() {
        while left.next_if(char::is_ascii_digit).is_some() {}
    }
    out.list = list(left)?;
    if !list(comment.chars().peekable())?.is_empty() {
        return Err("a word after the checksum: only a comment may follow it".to_owned());
    }
    number(&out.list)?;
    // The number of a line, and of a program.
    out.list.retain(|word| !matches!(word.letter, 'N' | 'O'));
    Ok(out)
}

/// Refuses what is no number of a line.
fn number(list: &[Word]) -> Result<(), String> {
    let mut numbers = list.iter().filter(|word| word.letter == 'N');
    if let Some(word) = numbers.next() {
        word.whole()?;
    }
    if numbers.next().is_some() { Err("N is there twice".to_owned()) } else { Ok(()) }
}

/// Returns all words of a text, without its comments.
fn list(mut left: Peekable<Chars<'_>>) -> Result<Vec<Word>, String> {
    let mut list = Vec::new();
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
                list.push(Word { letter, value });
            }
            '#' | '[' => return Err("values are numbers, not variables or sums; write the number".to_owned()),
            '\0' | char::REPLACEMENT_CHARACTER => {
                return Err("a byte that is no text: a part program is a text file, in ASCII or UTF-8".to_owned());
            }
            _ => return Err(format!("\"{letter}\" is not G-code: a word is a letter and a number")),
        }
    }
    Ok(list)
}

/// Splits a line at its checksum, which is the exclusive or of all bytes before its asterisk; what follows is a comment.
fn checked(line: &[u8]) -> Result<(&[u8], &[u8]), String> {
    let Some((text, end)) = asterisk(line).and_then(|at| line.split_at_checked(at)) else { return Ok((line, &[])) };
    let comment = end.iter().position(|byte| matches!(byte, b'(' | b';')).unwrap_or(end.len());
    let (sum, comment) = end.split_at_checked(comment).unwrap_or((end, &[]));
    let sum = String::from_utf8_lossy(sum.trim_ascii());
    let want = sum.strip_prefix('*').and_then(|sum| sum.trim().parse::<u8>().ok());
    let want = want.ok_or_else(|| format!("\"{sum}\" is not a checksum, which is 0 to 255"))?;
    let got = text.iter().fold(0, |sum, byte| sum ^ byte);
    if got == want {
        Ok((text, comment))
    } else {
        Err(format!("its checksum is {got}, not {want}: the line is damaged"))
    }
}

/// Where the first asterisk outside comments is.
fn asterisk(line: &[u8]) -> Option<usize> {
    let mut inside = false;
    for (at, byte) in line.iter().enumerate() {
        match byte {
            b'(' => inside = true,
            b')' => inside = false,
            b';' if !inside => return None,
            b'*' if !inside => return Some(at),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Result<Words, String> {
        super::words(line.as_bytes())
    }

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
        assert_eq!(pairs("/2 G0 X1"), pairs("G0 X1"));
        assert!(is_optional(b" /2 G0 X1") && is_optional("\u{feff}/".as_bytes()) && !is_optional(b"G0 X1 /"));
    }

    /// 'N' ^ '3' ^ ' ' ^ 'G' ^ '2' ^ '8' is 78 ^ 51 ^ 32 ^ 71 ^ 50 ^ 56 = 16.
    #[test]
    fn a_checksum_is_looked_at() {
        for line in ["N3 G28*16", " N3 G28* 16 ", "N3 G28*16 ; home 10*20", "N3 G28*16;*17", "N3 G28*16 (home) (2*3)"] {
            assert_eq!(pairs(line), [('G', 28.0)], "{line}");
            assert!(words(&line.replace("16", "17")).unwrap_err().contains("its checksum is 16, not 17"), "{line}");
        }
        for (line, want) in [
            ("N3 G28*", "\"*\" is not a checksum, which is 0 to 255"),
            ("N3 G28*272", "\"*272\" is not a checksum, which is 0 to 255"),
            ("N3 G28*-1 (home)", "\"*-1\" is not a checksum"),
            ("N3 G28*16*0", "\"*16*0\" is not a checksum"),
            ("N3 G28*16 X5", "\"*16 X5\" is not a checksum"),
            ("N3 G28*16 (home", "unterminated comment"),
            ("N3 G28*16 (home) X5", "a word after the checksum"),
            ("%*36", "its checksum is 37, not 36"),
        ] {
            let error = words(line).unwrap_err();
            assert!(error.contains(want), "{line}: {error}");
        }
    }

    /// A comment may end as a checksum does, and stand before one, in whatever text: 'G' ^ '2' ^ '8' ^ '(' ^ '2' ^ '*' ^ '3' ^ ')'
    /// is 71 ^ 50 ^ 56 ^ 40 ^ 50 ^ 42 ^ 51 ^ 41 = 103, and with 0xe9 in place of '*' 164.
    #[test]
    fn an_asterisk_in_a_comment_begins_no_checksum() {
        for line in ["; pocket 10*20", ";*", "(10*20)", "(10*20", "% ; 10*20"] {
            assert!(!words(line).is_err_and(|error| error.contains("checksum")), "{line}");
        }
        for line in ["G28 ; 2*3", "G28;(2*3", "G28 (2*3)", "G28 (a;2*3) (b) ; c*4", "G28(2*3)*103"] {
            assert_eq!(pairs(line), [('G', 28.0)], "{line}");
        }
        assert!(words("G28(2*3)*102").unwrap_err().contains("its checksum is 103, not 102"));
        assert_eq!(super::words(b"G28(2\xe93)*164").unwrap().list, words("G28").unwrap().list);
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
