use crate::device::{Device, Transmission};

/// Several encoders on one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoders<const N: usize, const BANKS: usize> {
    /// The encoders, in any order.
    pub all: [Device<BANKS>; N],
}

impl<const N: usize, const BANKS: usize> Encoders<N, BANKS> {
    /// Passes frames to all of them, like [`Device::hear`]; returns what each answers.
    pub fn hear(&mut self, frames: &[Option<u16>], end_ns: u64) -> [Option<Transmission>; N] {
        let mut answers = [None; N];
        for (answer, device) in answers.iter_mut().zip(&mut self.all) {
            *answer = device.hear(frames, end_ns);
        }
        answers
    }

    /// Takes a frame whose delimiter, at `end_ns`, reads 0.
    pub fn framing_error(&mut self, end_ns: u64) {
        for device in &mut self.all {
            device.framing_error(end_ns);
        }
    }
}
