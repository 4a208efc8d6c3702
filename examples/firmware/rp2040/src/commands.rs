//! Commands typed at the console of a master.

use crate::console::Console;

/// A typed line. Numbers are hexadecimal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// `read ADDRESS`: of the EEPROM.
    Read {
        /// Where.
        address: u8,
    },
    /// `write ADDRESS DATA`: the EEPROM, which motor makers keep commutation data in.
    Write {
        /// Where.
        address: u8,
        /// What.
        data: u16,
    },
    /// `lose multi-turn reference`: sets the turns to 0.
    LoseMultiTurnReference,
    /// Something else.
    Unknown,
}

/// Longest line.
const MOST: usize = 32;

/// A line being typed.
#[derive(Default)]
pub struct Typed {
    line: [u8; MOST],
    len: usize,
}

impl Typed {
    /// Returns the command once its line has ended.
    pub fn take(&mut self, console: &mut Console) -> Option<Command> {
        while let Some(byte) = console.read() {
            if byte != b'\n' && byte != b'\r' {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = byte;
                }
                self.len += 1;
                continue;
            }
            let line = self.line.get(..core::mem::take(&mut self.len));
            let text = line.and_then(|line| core::str::from_utf8(line).ok());
            if text != Some("") {
                return Some(text.and_then(parse).unwrap_or(Command::Unknown));
            }
        }
        None
    }
}

fn parse(line: &str) -> Option<Command> {
    if line == "lose multi-turn reference" {
        return Some(Command::LoseMultiTurnReference);
    }
    let mut words = line.split(' ');
    let command = match (words.next()?, words.next()?, words.next()) {
        ("read", address, None) => Command::Read { address: u8::from_str_radix(address, 16).ok()? },
        ("write", address, Some(data)) => {
            Command::Write { address: u8::from_str_radix(address, 16).ok()?, data: u16::from_str_radix(data, 16).ok()? }
        }
        _ => return None,
    };
    words.next().is_none().then_some(command)
}
