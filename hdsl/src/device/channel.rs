//! The encoder's end of the parameters channel, written from the printed layout of the messages; nothing is shared with the
//! receiver.
//!
//! Its input is the five bits of the master's symbols, its output those of the encoder's.

use super::check;

const IDLE: u8 = 0x10;
const SNAK: u8 = 0x15;
const LNAK: u8 = 0x1a;
const INIT: u8 = 0x1f;

/// The bytes of a message without its CRC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Message {
    bytes: [u8; 14],
    len: u8,
}

impl Message {
    const EMPTY: Self = Self { bytes: [0; 14], len: 0 };

    /// Creates a message of at most twelve bytes.
    pub(super) fn new(parts: &[&[u8]]) -> Self {
        let mut message = Self::EMPTY;
        for byte in parts.iter().copied().flatten() {
            message.push(*byte);
        }
        message
    }

    pub(super) fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&[])
    }

    fn push(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(usize::from(self.len)) {
            *place = byte;
            self.len = self.len.saturating_add(1);
        }
    }

    fn is_long(&self) -> bool {
        self.bytes().first().is_some_and(|first| first & 0x80 != 0)
    }

    /// Appends the CRC, high byte first.
    fn sealed(mut self) -> Self {
        for byte in check(self.bytes()).to_be_bytes() {
            self.push(byte);
        }
        self
    }

    /// Returns a nibble in the order sent, the high one of each byte first.
    fn nibble(&self, at: u8) -> Option<u8> {
        let byte = self.bytes().get(usize::from(at / 2))?;
        Some(if at % 2 == 0 { byte >> 4 } else { byte & 15 })
    }
}

/// Returns the length in bytes of the request that begins with this byte, including its CRC.
const fn request_len(first: u8) -> u8 {
    let offset: u8 = if first & 0x20 == 0 { 0 } else { 2 };
    let data = match first >> 2 & 3 {
        0 => 0,
        1 => 2,
        2 => 4,
        _ => 8,
    };
    match first >> 6 {
        // A register and its new value; a register to be read.
        0b00 => 4,
        0b01 => 3,
        // A resource and what is written; a resource to be read.
        0b10 => offset.saturating_add(data).saturating_add(4),
        _ => offset.saturating_add(4),
    }
}

/// Both directions of the channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Channel {
    /// The request being received.
    heard: Message,
    /// The first nibble of its next byte.
    half: Option<u8>,
    /// An IDLE has come since the last message, whether complete or lost.
    listening: bool,
    /// A short and a long request whose answers are pending, with the number of H-frames left.
    waiting: [Option<(Message, u16)>; 2],
    /// A short and a long answer waiting for the channel.
    answers: [Option<Message>; 2],
    /// SNAK, LNAK or INIT, to be sent between messages.
    signal: Option<u8>,
    /// The answer being sent, and its next nibble.
    sending: Option<(Message, u8)>,
}

impl Channel {
    pub(super) const fn new() -> Self {
        Self {
            heard: Message::EMPTY,
            half: None,
            listening: true,
            waiting: [None; 2],
            answers: [None; 2],
            signal: None,
            sending: None,
        }
    }

    /// Takes the master's symbol; returns a request that is complete and sound.
    pub(super) fn hear(&mut self, symbol: u8) -> Option<Message> {
        match symbol {
            0x00..=0x0f => return self.nibble(symbol),
            // INIT
            0x1e => *self = Self { signal: Some(INIT), ..Self::new() },
            // IDLE, and those of the start-up.
            0x10 | 0x19..=0x1f => {
                self.miss();
                self.listening = true;
            }
            _ => self.miss(),
        }
        None
    }

    /// Takes a symbol that could not be read: the message being received is lost, and reception resumes at the next IDLE.
    pub(super) const fn miss(&mut self) {
        self.heard = Message::EMPTY;
        self.half = None;
        self.listening = false;
    }

    fn nibble(&mut self, nibble: u8) -> Option<Message> {
        if !self.listening {
            return None;
        }
        let Some(high) = self.half.take() else {
            self.half = Some(nibble);
            return None;
        };
        self.heard.push(high << 4 | nibble);
        let first = *self.heard.bytes().first()?;
        if self.heard.len < request_len(first) {
            return None;
        }
        let whole = self.heard;
        self.miss();
        let request = Message { len: whole.len.saturating_sub(2), ..whole };
        // An offset is marked too.
        let marked = first & 0xa0 != 0xa0 || request.bytes().get(2).is_some_and(|offset| offset & 0x80 != 0);
        if marked && request.sealed() == whole {
            return Some(request);
        }
        self.signal = Some(if request.is_long() { LNAK } else { SNAK });
        None
    }

    /// Sets the request to be answered this many H-frames later.
    pub(super) fn wait(&mut self, request: Message, frames: u16) {
        let [short, long] = &mut self.waiting;
        *(if request.is_long() { long } else { short }) = Some((request, frames));
    }

    /// Returns the requests that are due for an answer.
    pub(super) fn due(&mut self) -> [Option<Message>; 2] {
        let due = self.waiting.map(|waiting| waiting.filter(|(_, frames)| *frames == 0).map(|(request, _)| request));
        self.waiting = self.waiting.map(|waiting| {
            let (request, frames) = waiting?;
            Some((request, frames.checked_sub(1)?))
        });
        due
    }

    /// Sends an answer as soon as the channel is free, a short one first.
    pub(super) fn answer(&mut self, answer: Message) {
        let [short, long] = &mut self.answers;
        *(if answer.is_long() { long } else { short }) = Some(answer.sealed());
    }

    /// Returns the symbol of the next answer.
    pub(super) fn speak(&mut self) -> u8 {
        if let Some((message, at)) = self.sending.take() {
            let Some(nibble) = message.nibble(at) else { return IDLE };
            self.sending = Some((message, at.saturating_add(1)));
            return nibble;
        }
        if let Some(signal) = self.signal.take() {
            return signal;
        }
        let [short, long] = &mut self.answers;
        let Some(message) = short.take().or_else(|| long.take()) else { return IDLE };
        self.sending = Some((message, 1));
        message.nibble(0).unwrap_or(IDLE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Acknowledgement, Resources};
    use std::vec::Vec;

    /// What the encoder says to these bytes, sent nibble by nibble, as nibbles.
    fn said(bytes: &[u8]) -> Vec<u8> {
        let mut channel = Channel::new();
        let mut resources = Resources::new();
        let nibbles = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
        for symbol in nibbles.chain([IDLE]) {
            if let Some(request) = channel.hear(symbol) {
                channel.answer(resources.answer(&request, Acknowledgement::Empty));
            }
        }
        core::iter::repeat_with(|| channel.speak()).take_while(|symbol| *symbol != IDLE).collect()
    }

    fn nibbles(bytes: &[u8]) -> Vec<u8> {
        bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]).collect()
    }

    /// Messages that the documents print.
    #[test]
    fn printed_messages() {
        assert_eq!(said(&[0x7c, 0xab, 0xf6]), nibbles(&[0x7c, 0x07, 0x53, 0x3f]));
        assert_eq!(said(&[0x3f, 0xa5, 0x99, 0x30]), nibbles(&[0x3f, 0x0d, 0xce]));
        assert_eq!(said(&[0xcc, 0x81, 0xc1, 0x0b]), nibbles(b"\xcc\x81RESOLUTN\xdb\x8c"));
        // Attribute 3, the level needed to write: 15, never.
        assert_eq!(said(&[0xe4, 0x81, 0x80, 0x03, 0x14, 0x13])[..8], [12, 4, 8, 1, 0, 0, 0, 15]);
        // 200h is not there: detail, class.
        let request = Message::new(&[&[0xc6, 0x00]]).sealed();
        assert_eq!(said(request.bytes()), nibbles(&[0xe6, 0x00, 0x10, 0x40, 0x38, 0x7b]));
    }

    /// Every wrong bit is refused with the signal of its kind, or makes the message look longer or shorter.
    #[test]
    fn damaged_messages() {
        for (message, signal) in [(&[0x3f, 0xa5, 0x99, 0x30][..], SNAK), (&[0xe4, 0x81, 0x80, 0x03, 0x14, 0x13], LNAK)]
        {
            for bit in 8..message.len() * 8 {
                let mut bad = message.to_vec();
                bad[bit / 8] ^= 0x80 >> (bit % 8);
                assert_eq!(said(&bad), [signal], "{bit}");
            }
        }
        // An offset without its mark, with a right CRC.
        let request = Message::new(&[&[0xe4, 0x81, 0x00, 0x03]]).sealed();
        assert_eq!(said(request.bytes()), [LNAK]);
    }

    /// Eight nibbles, four more for an offset, and in a write two for each byte of data.
    #[test]
    fn lengths_of_long_requests() {
        for (llen, bytes) in [(0, 0), (1, 2), (2, 4), (3, 8)] {
            for (read, with_offset) in [(false, false), (false, true), (true, false), (true, true)] {
                let first = 0x81 | llen << 2 | u8::from(read) << 6 | u8::from(with_offset) << 5;
                let offset: &[u8] = if with_offset { &[0x80, 0x00] } else { &[] };
                let data = &[0x55; 8][..if read { 0 } else { bytes }];
                let request = Message::new(&[&[first, 0x31], offset, data]);
                let mut channel = Channel::new();
                let heard: Vec<_> = nibbles(request.sealed().bytes()).into_iter().map(|n| channel.hear(n)).collect();
                assert_eq!(heard.len(), 8 + 2 * offset.len() + 2 * data.len());
                assert_eq!(heard.iter().flatten().count(), 1);
                let last = heard.last().copied().flatten().unwrap();
                assert_eq!(last.bytes(), request.bytes(), "{first:02x}");
            }
        }
    }

    /// A symbol without a meaning in a message, or one that could not be read: the rest is no message.
    #[test]
    fn a_hole_in_a_message() {
        for hole in [0x11, 0x18, 0x20] {
            let mut channel = Channel::new();
            let symbols = [0x7, 0xc, 0xa, hole, 0xb, 0xf, 0x6, 0x7, 0xc, 0xa, 0xb, 0xf, 0x6];
            assert!(symbols.iter().all(|symbol| channel.hear(*symbol).is_none()));
            assert_eq!(channel.speak(), IDLE);
            // After an IDLE it listens again.
            let symbols = [IDLE, 0x7, 0xc, 0xa, 0xb, 0xf, 0x6];
            assert_eq!(symbols.iter().filter(|symbol| channel.hear(**symbol).is_some()).count(), 1);
        }
    }

    /// A short request does not push out a long one that takes its time, and each keeps its own.
    #[test]
    fn two_requests_at_once() {
        let mut channel = Channel::new();
        channel.wait(Message::new(&[&[0xcc, 0x81]]), 3);
        channel.wait(Message::new(&[&[0x7c]]), 1);
        let due: Vec<_> = (0..5).map(|_| channel.due().map(|due| due.is_some())).collect();
        assert_eq!(due, [[false, false], [true, false], [false, false], [false, true], [false, false]]);
        channel.wait(Message::new(&[&[0x7c]]), 0);
        assert_eq!(channel.hear(0x1e), None);
        assert_eq!((channel.due(), channel.speak(), channel.speak()), ([None; 2], INIT, IDLE));
    }
}
