//! Messages over the parameters channel.

use std::collections::VecDeque;

use super::super::rng::Rng;
use super::code::sealed;

/// Resources as they are printed: one with a name, one that no list has.
const RESOURCES: [(u16, &str); 2] = [(0x081, "081h RESOLUTN"), (0x2a5, "2A5h")];

/// What goes over the parameters channel: each side says one symbol a frame.
#[derive(Debug, Default)]
pub(super) struct Talk {
    pub(super) master: VecDeque<(u8, Option<String>)>,
    pub(super) encoder: VecDeque<(u8, Option<String>)>,
    gap: u64,
}

impl Talk {
    fn say(queue: &mut VecDeque<(u8, Option<String>)>, bytes: &[u8], text: String) {
        let bytes = sealed(bytes);
        let mut text = Some(text);
        let last = 2 * bytes.len() - 1;
        for at in 0..=last {
            let byte = bytes[at / 2];
            let nibble = if at % 2 == 0 { byte >> 4 } else { byte & 15 };
            queue.push_back((nibble, if at == last { text.take() } else { None }));
        }
        // A symbol that is none ends a message.
        queue.push_back((0x10, None));
    }

    /// The same of an encoder, whose answer has no length that is known before it has ended.
    fn answer(queue: &mut VecDeque<(u8, Option<String>)>, bytes: &[u8], text: String) {
        Self::say(queue, bytes, String::new());
        let end = queue.len();
        queue[end - 2].1 = None;
        queue[end - 1].1 = Some(text);
    }

    /// Both are quiet: a long request, and while it waits a short one; the answers in either order.
    pub(super) fn begin(&mut self, rng: &mut Rng) {
        if !self.master.is_empty() || !self.encoder.is_empty() {
            return;
        }
        if self.gap > 0 {
            self.gap -= 1;
            return;
        }
        self.gap = rng.below(6);
        let register = rng.below(64) as u8;
        let data = rng.below(256) as u8;
        let (address, name) = rng.pick(&RESOURCES);
        let content: Vec<u8> = (0..8).map(|_| rng.below(256) as u8).collect();
        let long = [0x80 | 0x40 | 0x0c | (address >> 8) as u8, address as u8];
        let which = rng.below(4);
        let read = rng.chance(0.5);
        let number = 0x40 + register;
        let (short, short_text, answer, answer_text) = if read {
            (
                vec![0x40 | register],
                format!("read register {number:02X}h"),
                vec![0x40 | register, data],
                format!("register {number:02X}h holds {data:02X}h"),
            )
        } else {
            (
                vec![register, data],
                format!("write register {number:02X}h = {data:02X}h"),
                vec![register],
                format!("register {number:02X}h is written"),
            )
        };
        let hex: Vec<String> = content.iter().map(|byte| format!("{byte:02X}")).collect();
        let long_answer = [&long[..], &content].concat();
        let long_text = format!("{name} holds {}", hex.join(" "));
        if which != 0 {
            Self::say(&mut self.master, &long, format!("direct read of {name}, 8 bytes"));
        }
        if which != 1 {
            Self::say(&mut self.master, &short, short_text);
        }
        // The encoder thinks until both have been asked, and some frames more.
        let quiet = self.master.len() + 1 + rng.below(5) as usize;
        self.encoder.extend((0..quiet).map(|_| (0x10, None)));
        match which {
            0 => Self::answer(&mut self.encoder, &answer, answer_text),
            1 => Self::answer(&mut self.encoder, &long_answer, long_text),
            2 => {
                Self::answer(&mut self.encoder, &answer, answer_text);
                Self::answer(&mut self.encoder, &long_answer, long_text);
            }
            _ => {
                Self::answer(&mut self.encoder, &long_answer, long_text);
                Self::answer(&mut self.encoder, &answer, answer_text);
            }
        }
    }
}
