//! The short codes that a dump uses for its variables.

use std::collections::HashMap;

/// The meaning of a code: its channels, starting with the last bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Code {
    pub(super) first: u16,
    pub(super) width: u16,
}

/// The codes of all variables. Almost all have one or two letters.
#[derive(Debug, Default)]
pub(super) struct Codes {
    pub(super) short: Vec<Option<Code>>,
    long: HashMap<Vec<u8>, Code>,
}

impl Codes {
    fn place(code: &[u8]) -> Option<usize> {
        match *code {
            [a] => Some(usize::from(a)),
            [a, b] => Some(usize::from(a) | usize::from(b) << 8),
            _ => None,
        }
    }

    pub(super) fn get(&self, code: &[u8]) -> Option<Code> {
        match Self::place(code) {
            Some(place) => self.short.get(place).copied().flatten(),
            None => self.long.get(code).copied(),
        }
    }

    pub(super) fn insert(&mut self, text: &[u8], code: Code) {
        match Self::place(text) {
            Some(place) => {
                if self.short.is_empty() {
                    self.short = vec![None; 1 << 16];
                }
                if let Some(slot) = self.short.get_mut(place) {
                    *slot = Some(code);
                }
            }
            None => drop(self.long.insert(text.to_vec(), code)),
        }
    }
}
