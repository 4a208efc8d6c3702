//! The content of a part program as straight lines and rests, read line by line.

use std::collections::VecDeque;
use std::io::BufRead;

use servowire_decode::fault::{At, Fault};

use super::item::Item;
use super::modes::State;
use super::words::words;

/// A part program that is read line by line.
pub(super) struct Program<R> {
    name: String,
    text: R,
    number: u64,
    /// Lines that begin with a slash are skipped.
    block_delete: bool,
    over: bool,
    state: State,
    items: VecDeque<Item>,
}

impl<R: BufRead> Program<R> {
    pub(super) fn new(name: &str, text: R, block_delete: bool) -> Self {
        let (state, items) = (State::default(), VecDeque::new());
        Self { name: name.to_owned(), text, number: 0, block_delete, over: false, state, items }
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
        let mut line = Vec::new();
        let fault = |number, what| Fault::new(&self.name, number, what);
        let got = self.text.read_until(b'\n', &mut line).map_err(|e| fault(At::File, e.to_string()))?;
        self.number += 1;
        let line = String::from_utf8_lossy(&line);
        let done = words(&line).and_then(|words| {
            if words.optional && self.block_delete {
                return Ok(false);
            }
            self.state.block(&words.words, &mut self.items)
        });
        self.over = done.map_err(|what| fault(At::Line(self.number), what))? || got == 0;
        Ok(())
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
