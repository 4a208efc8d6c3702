use crate::device::{Device, Transmission};

/// Several encoders on one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoders<const N: usize, const BANKS: usize> {
    /// The encoders, in any order.
    pub all: [Device<BANKS>; N],
}

impl<const N: usize, const BANKS: usize> Encoders<N, BANKS> {
    /// A frame was received by all of them; gives what each answers.
    pub fn frame(&mut self, content: u16, now_ns: u64) -> [Option<Transmission>; N] {
        let mut answers = [None; N];
        for (answer, device) in answers.iter_mut().zip(&mut self.all) {
            *answer = device.frame(content, now_ns);
        }
        answers
    }

    /// A frame was received whose delimiter reads 0.
    pub fn framing_error(&mut self, now_ns: u64) {
        for device in &mut self.all {
            device.framing_error(now_ns);
        }
    }
}
