//! HIPERFACE DSL: H-frames, answers, V-frames and messages of a recorded pair.
//!
//! Every run of equal levels is rounded to whole bits, so that the grid follows the edges of the present driver. A frame is
//! found by the master's head, and the answer to it at the delay at which its words are valid.

mod bits;
mod decoder;
mod refused;
mod said;

use std::io;

use bits::Bits;
use decoder::Decoder;
use hdsl::frame::BIT_RATE;

use crate::bundled;
use crate::capture::Hole;
use crate::capture::samples::Samples;
use crate::codec::{Codec, Facts};
use crate::line::evidence::Weights;
use crate::line::lane::LineDecoder;
use crate::line::receive::Rates;
use crate::settings::Settings;
use crate::sink::Sink;
use crate::time::Time;

/// The names of all fields.
const FIELDS: &[&str] = &[
    "SYMBOL", "FIRST", "MSYNC", "EXTRA", "delay", "VERT", "VSYNC", "PIPE", "DD", "SEC", "POS", "VEL", "SUMMARY",
    "VPOS", "STATUS2", "VPOS2", "QM", "ENC_ID", "message", "note",
];

/// The table row of HIPERFACE DSL.
pub(super) struct Hdsl;

impl Codec for Hdsl {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "hdsl",
                title: "HIPERFACE DSL",
                about: "HIPERFACE DSL, from edges or samples of the pair",
                needs: "HIPERFACE DSL is decoded from edges or samples of the line",
                fields: FIELDS,
                rates: &[BIT_RATE],
                // Twelve fixed bits and a word of the code; six words and two checks.
                weights: Weights { request: 8, answer: 16, alone: 16 },
                clocked: true,
                answers_alone: false,
                captures: &bundled::HDSL,
                ..Facts::NONE
            }
        }
    }

    fn line(&self, rate: u32, _: &Settings) -> Option<Box<dyn LineDecoder>> {
        Some(Box::new(DslLine::new(1e12 / f64::from(rate.max(1)))))
    }
}

/// Decodes the link on one line.
pub struct DslLine {
    bits: Bits,
    decoder: Decoder,
    bit: f64,
    /// The sample at which the line last changed, if its levels come as samples.
    since: Option<u64>,
}

impl DslLine {
    /// `bit`: nominal length of a bit in picoseconds.
    pub fn new(bit: f64) -> Self {
        Self { bits: Bits::new(bit), decoder: Decoder::new(), bit, since: None }
    }
}

impl LineDecoder for DslLine {
    fn change(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.change(time, level);
        if self.bits.end() > self.decoder.enough() { self.decoder.take(&mut self.bits, out) } else { Ok(()) }
    }

    fn samples(&mut self, samples: Samples<'_>, out: &mut dyn Sink) -> io::Result<()> {
        let may_be_on_grid = self.bits.may_be_on_grid(&samples);
        let (mut at, mut level) = (samples.first(), samples.before());
        loop {
            if let Some(since) = self.since.filter(|_| may_be_on_grid) {
                if let Some(taken) = self.bits.on_grid(&samples, since, at, self.decoder.enough()) {
                    (at, level, self.since) = (taken.next, taken.level, Some(taken.since));
                }
            }
            let Some(next) = samples.change(at, level) else { return Ok(()) };
            level = !level;
            self.change(samples.clock().time(next), level, out)?;
            (self.since, at) = (Some(next), next + 1);
        }
    }

    fn reach(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.reach(time);
        if self.decoder.is_running() { self.decoder.take(&mut self.bits, out) } else { Ok(()) }
    }

    fn hole(&mut self, hole: Hole, out: &mut dyn Sink) -> io::Result<()> {
        self.finish(hole.from, out)?;
        *self = Self::new(self.bit);
        Ok(())
    }

    fn finish(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        self.bits.finish(time, 2.0);
        self.decoder.finish(&mut self.bits, out)
    }

    fn rates(&self) -> Rates {
        self.bits.rates()
    }
}
