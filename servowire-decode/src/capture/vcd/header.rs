//! The header: time scale, scopes, variables.

use std::collections::HashMap;
use std::io::BufRead;

use super::codes::{Code, Codes};
use crate::capture::input::Input;
use crate::fault::{At, Fault};

/// A longer header cannot belong to a VCD.
const LONGEST: usize = 1 << 26;
/// Maximum number of channels.
const CHANNELS: usize = 65_535;
/// Vectors of up to this many bits become one channel per bit, as long as there are fewer channels than this.
const WIDEST: u16 = 64;
const FEW: usize = 4096;

/// The content of the header.
pub(super) struct Header {
    /// Unit of time in femtoseconds.
    pub(super) tick: u128,
    /// Lines read.
    pub(super) line: u64,
    /// What `$date` says.
    pub(super) date: Option<String>,
    variables: Vec<Variable>,
}

struct Variable {
    scope: String,
    name: String,
    code: Vec<u8>,
    width: u16,
    /// Number of the lowest bit, and whether the numbers decrease towards it.
    lowest: i32,
    falls: bool,
}

/// Words of the header, with the line they are on.
struct Words<'a> {
    input: &'a mut Input,
    line: u64,
    taken: usize,
}

impl Words<'_> {
    /// Returns the next word; `None` at the end of the file.
    fn next(&mut self) -> Result<Option<Vec<u8>>, Fault> {
        let mut word = Vec::new();
        loop {
            let at = At::Line(self.line);
            let fault = |e: &std::io::Error, input: &Input| input.io_fault(at, e);
            let buffer = match self.input.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) => return Err(fault(&e, self.input)),
            };
            if buffer.is_empty() {
                return Ok((!word.is_empty()).then_some(word));
            }
            let mut used = 0;
            let mut over = false;
            for byte in buffer {
                if *byte <= b' ' {
                    if !word.is_empty() {
                        over = true;
                        break;
                    }
                    self.line += u64::from(*byte == b'\n');
                } else {
                    word.push(*byte);
                }
                used += 1;
            }
            self.input.consume(used);
            self.taken += used;
            if self.taken > LONGEST {
                return Err(self.input.fault(At::Line(self.line), "a header of more than 64 MB"));
            }
            if over {
                return Ok(Some(word));
            }
        }
    }

    /// Reads the words of a command up to its `$end`.
    fn body(&mut self) -> Result<Vec<Vec<u8>>, Fault> {
        let mut words = Vec::new();
        loop {
            match self.next()? {
                None => {
                    let what = "the file ends in the header: it was cut off";
                    return Err(self.input.fault(At::Line(self.line), what));
                }
                Some(word) if word == b"$end" => return Ok(words),
                Some(word) => words.push(word),
            }
        }
    }
}

fn text(words: &[Vec<u8>]) -> String {
    words.iter().map(|word| String::from_utf8_lossy(word)).collect::<Vec<_>>().join(" ")
}

impl Header {
    pub(super) fn read(input: &mut Input) -> Result<Self, Fault> {
        let mut words = Words { input, line: 1, taken: 0 };
        // What most tools mean when they leave it out.
        let mut header = Self { tick: 1_000_000, line: 1, date: None, variables: Vec::new() };
        let mut scopes: Vec<String> = Vec::new();
        let mut first = true;
        loop {
            let Some(mut word) = words.next()? else {
                let what = "the file ends in its header, before $enddefinitions";
                return Err(words.input.fault(At::Line(words.line), what));
            };
            if std::mem::take(&mut first) && word.starts_with(b"\xef\xbb\xbf") {
                word.drain(..3);
            }
            match word.as_slice() {
                b"" => {}
                b"$enddefinitions" => {
                    words.body()?;
                    break;
                }
                b"$timescale" => {
                    let said = text(&words.body()?);
                    let tick = femtoseconds(&said).ok_or_else(|| {
                        words
                            .input
                            .fault(At::Line(words.line), format!("not VCD in the header: {said:?} is not a time scale"))
                    })?;
                    header.tick = tick;
                }
                b"$date" => header.date = Some(text(&words.body()?)).filter(|date| !date.is_empty()),
                b"$scope" => {
                    let body = words.body()?;
                    scopes.push(text(body.get(1..).unwrap_or_default()));
                }
                b"$upscope" => {
                    words.body()?;
                    scopes.pop();
                }
                b"$var" => {
                    let body = words.body()?;
                    header.variables.extend(variable(&body, &scopes));
                }
                word if word.starts_with(b"$") && !word.starts_with(b"$dump") => drop(words.body()?),
                word if word.starts_with(b"#")
                    || word.starts_with(b"$dump")
                    || matches!(word.first(), Some(b'0' | b'1')) =>
                {
                    let what = "value changes before $enddefinitions: the header is damaged";
                    return Err(words.input.fault(At::Line(words.line), what));
                }
                _ => {
                    let what = format!("not VCD in the header: unexpected {:?}", String::from_utf8_lossy(&word));
                    return Err(words.input.fault(At::Line(words.line), what));
                }
            }
        }
        header.line = words.line;
        Ok(header)
    }

    /// The names of the channels, and the meaning of the codes.
    pub(super) fn channels(&self, input: &Input) -> Result<(Vec<String>, Codes), Fault> {
        let mut known: HashMap<&str, usize> = HashMap::new();
        for variable in &self.variables {
            *known.entry(variable.name.as_str()).or_default() += 1;
        }
        let (mut names, mut codes) = (Vec::new(), Codes::default());
        // Lines before the bits of vectors, so that these take nobody's number.
        let (lines, vectors): (Vec<_>, Vec<_>) = self.variables.iter().partition(|variable| variable.width == 1);
        for variable in lines.into_iter().chain(vectors) {
            if variable.width != 1 && (variable.width > WIDEST || names.len() > FEW)
                || codes.get(&variable.code).is_some()
            {
                continue;
            }
            if names.len() + usize::from(variable.width) > CHANNELS {
                return Err(input.fault(At::Line(self.line), "more than 65535 one-bit variables"));
            }
            codes.insert(&variable.code, Code { first: names.len() as u16, width: variable.width });
            // The name alone where it is the only one of its kind, else with its scopes.
            let alone = known.get(variable.name.as_str()) == Some(&1) || variable.scope.is_empty();
            let name = if alone { variable.name.clone() } else { format!("{}.{}", variable.scope, variable.name) };
            if variable.width == 1 {
                names.push(name);
            } else {
                let bits = 0..i32::from(variable.width);
                names.extend(bits.map(|bit| {
                    let number = if variable.falls { variable.lowest + bit } else { variable.lowest - bit };
                    format!("{name}[{number}]")
                }));
            }
        }
        if names.is_empty() {
            return Err(input.fault(At::Line(self.line), "no variable of one bit in this file, so no line to decode"));
        }
        Ok((names, codes))
    }
}

/// `wire 1 ! name [3:0]`
fn variable(words: &[Vec<u8>], scopes: &[String]) -> Option<Variable> {
    let [kind, width, code, name @ ..] = words else { return None };
    if matches!(
        kind.as_slice(),
        b"real" | b"realtime" | b"real_parameter" | b"shortreal" | b"string" | b"event" | b"parameter"
    ) {
        return None;
    }
    let width = String::from_utf8_lossy(width);
    // A port has its range in the place of the width.
    let (width, full) = match bounds(&width) {
        Some((most, least)) => (most.abs_diff(least).saturating_add(1), format!("{}{width}", text(name))),
        None => (width.parse().ok()?, text(name)),
    };
    let width = u16::try_from(width).ok().filter(|width| *width > 0)?;
    // A range at the end belongs to the width.
    let range = full.rfind('[').and_then(|at| {
        let (most, least) = bounds(full.get(at..)?)?;
        (most.abs_diff(least).saturating_add(1) == u32::from(width)).then_some((at, most, least))
    });
    let (name, most, lowest) = match range {
        Some((at, most, least)) => (full.get(..at).unwrap_or_default().trim_end().to_owned(), most, least),
        // A single bit of an exploded vector: `name [3]` is `name[3]`.
        None => (full.replace(" [", "["), i32::from(width) - 1, 0),
    };
    let scope = scopes.iter().filter(|scope| !scope.is_empty()).cloned().collect::<Vec<_>>().join(".");
    Some(Variable { scope, name, code: code.clone(), width, lowest, falls: most >= lowest })
}

/// `[7:0]`
fn bounds(range: &str) -> Option<(i32, i32)> {
    let (most, least) = range.strip_prefix('[')?.strip_suffix(']')?.split_once(':')?;
    Some((most.trim().parse().ok()?, least.trim().parse().ok()?))
}

/// `10 ns`, `1ps`, `1 sec`
fn femtoseconds(said: &str) -> Option<u128> {
    let bare: String = said.split_whitespace().collect();
    let digits = bare.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(bare.len());
    let (number, unit) = bare.split_at_checked(digits)?;
    let number: u128 = number.parse::<u32>().ok()?.into();
    let unit = match unit {
        "s" | "sec" => 1_000_000_000_000_000,
        "ms" => 1_000_000_000_000,
        "us" => 1_000_000_000,
        "ns" => 1_000_000,
        "ps" => 1_000,
        "fs" => 1,
        _ => return None,
    };
    (number > 0).then_some(number * unit)
}
