//! The content of a part program as straight lines and rests, read line by line.

use std::collections::VecDeque;
use std::io::{self, BufRead};

use servowire_decode::fault::{At, Fault};

use super::AXES;
use super::item::Item;
use super::modes::State;
use super::words::{before_the_end, is_optional, words};

/// A part program that is read line by line.
pub(super) struct Program<R> {
    name: String,
    text: R,
    number: u64,
    /// Lines that begin with a slash are skipped.
    block_delete: bool,
    /// It has words; a percent sign after them ends it.
    begun: bool,
    over: bool,
    state: State,
    items: VecDeque<Item>,
}

impl<R: BufRead> Program<R> {
    pub(super) fn new(name: &str, text: R, block_delete: bool) -> Self {
        let (state, items) = (State::default(), VecDeque::new());
        Self { name: name.to_owned(), text, number: 0, block_delete, begun: false, over: false, state, items }
    }

    /// Takes the steps of the axes per metre into account, below which arcs need not be cut.
    pub(super) fn with_scales(mut self, steps_per_m: [u32; AXES]) -> Self {
        self.state.half_steps = steps_per_m.map(|steps| 5_000_000 / steps.max(1));
        self
    }

    /// A fault of the line that was read last, which ends the program.
    pub(super) fn refuse(&mut self, what: String) -> Fault {
        self.over = true;
        self.items.clear();
        Fault::new(&self.name, At::Line(self.number), what)
    }

    /// Items read but not yet taken.
    #[cfg(test)]
    pub(super) fn waiting(&self) -> usize {
        self.items.len()
    }

    fn line(&mut self) -> Result<(), Fault> {
        let Some(line) = self.read()? else {
            self.over = true;
            return Ok(());
        };
        let done = self.execute(&line);
        self.over = done.map_err(|what| Fault::new(&self.name, At::Line(self.number), what))?;
        Ok(())
    }

    /// Executes a line; returns `true` at the end of the program.
    fn execute(&mut self, line: &[u8]) -> Result<bool, String> {
        let (line, last) = before_the_end(line)?;
        if self.leaves_out(line) {
            return Ok(last);
        }
        let words = words(line)?;
        self.begun |= !words.list.is_empty();
        let over = self.state.block(&words.list, &mut self.items)?;
        Ok(over || last || (words.percent && self.begun))
    }

    fn leaves_out(&self, line: &[u8]) -> bool {
        self.block_delete && is_optional(line)
    }

    /// Whether a line is no more than a comment.
    fn is_empty(&self, line: &[u8]) -> bool {
        let words = before_the_end(line).and_then(|(line, _)| words(line));
        self.leaves_out(line) || words.is_ok_and(|words| words.list.is_empty())
    }

    /// Reads a line; `None` at the end of the file.
    fn read(&mut self) -> Result<Option<Vec<u8>>, Fault> {
        let line = next_line(&mut self.text).map_err(|e| Fault::new(&self.name, At::File, e.to_string()))?;
        self.number += 1;
        Ok(line)
    }

    /// Where the program has ended before its file: the first line after M2, M30, a percent sign or ^Z that is more than a comment.
    pub(super) fn behind_the_end(&mut self) -> Result<Option<Fault>, Fault> {
        let end = self.number;
        while let Some(line) = self.read()? {
            if !self.is_empty(&line) {
                let what = format!("not run, nor is what follows: the program ends in line {end}");
                return Ok(Some(Fault::new(&self.name, At::Line(self.number), what)));
            }
        }
        Ok(None)
    }
}

/// Reads up to the end of a line, of whatever system: LF, CR LF, or CR alone. `None` at the end of the text.
fn next_line(text: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    loop {
        let some = text.fill_buf()?;
        let end = some.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        line.extend_from_slice(some.get(..end.unwrap_or(some.len())).unwrap_or_default());
        match end.and_then(|end| some.get(end).map(|byte| (end + 1, *byte == b'\r'))) {
            None if some.is_empty() => return Ok((!line.is_empty()).then_some(line)),
            None => {
                let all = some.len();
                text.consume(all);
            }
            Some((end, carriage)) => {
                text.consume(end);
                if carriage && text.fill_buf()?.first() == Some(&b'\n') {
                    text.consume(1);
                }
                return Ok(Some(line));
            }
        }
    }
}

impl<R: BufRead> Iterator for Program<R> {
    type Item = Result<Item, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.items.is_empty() && !self.over {
            if let Err(fault) = self.line() {
                self.over = true;
                return Some(Err(fault));
            }
        }
        self.items.pop_front().map(Ok)
    }
}
