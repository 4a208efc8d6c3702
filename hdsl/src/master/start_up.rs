//! The start-up: test pattern, identifier, the first VSYNC, and restarts.

use super::link::Link;
use super::state::{RestartReason, State};
use super::{HFrame, Master};
use crate::answer::Answer;
use crate::encoder_id::EncoderId;
use crate::error::Error;
use crate::parameter::EncoderByte;
use crate::sampling::{Alignment, TEST_PATTERN, WINDOW};

impl Master {
    /// Handles a frame with the test pattern.
    pub(super) fn hear_window(&mut self, samples: &[u8; WINDOW]) -> &HFrame {
        match self.alignment {
            Some(alignment) if self.state != State::Start => {
                self.edges |= alignment.edges(samples);
                let (bits, rssi) = alignment.read_quarter(samples, self.done & 3);
                self.end_measured(alignment, bits, rssi)
            }
            _ => self.learn(samples),
        }
    }

    /// Handles a START frame.
    fn learn(&mut self, samples: &[u8]) -> &HFrame {
        self.edges = 0;
        match Alignment::learn(self.dialect.edge, samples) {
            Ok(found) => {
                self.alignment = Some(found);
                self.end(TEST_PATTERN, None)
            }
            Err(error) => {
                self.h_frame.begin(self.state, None);
                self.end_with(Err(RestartReason::Learn(error)))
            }
        }
    }

    /// Handles the answer to IDREQ.
    pub(super) fn identify(&mut self, bits: u64) -> Result<(), Error> {
        let answer = Answer::from_bits(self.dialect.rule, bits);
        let id = EncoderId::from_answer(answer)?;
        let bits = id.check()?;
        self.encoder = Some(id);
        self.link = Link::new(&self.dialect, id, bits);
        self.h_frame.encoder = Some(id);
        Ok(())
    }

    /// Handles an answer of a running encoder while the beginning of the V-frame is not yet known.
    pub(super) fn wait_for_vsync(&mut self, bits: u64) -> Result<(), RestartReason> {
        let answer = Answer::from_bits(self.dialect.rule, bits);
        self.h_frame.encoder = None;
        self.done = self.done.saturating_add(1);
        if answer.parameter().is_ok_and(EncoderByte::vsync) {
            (self.state, self.done) = (State::Running, 0);
            self.latch();
        } else if self.dialect.vsync_frames != 0 && self.done >= self.dialect.vsync_frames {
            return Err(RestartReason::NoVsync);
        }
        Ok(())
    }

    /// Begins the start-up again. Messages under way end.
    pub(super) fn begin_again(&mut self) {
        self.counters.restarts = self.counters.restarts.wrapping_add(1);
        (self.state, self.done) = (State::Reset, 0);
        // The link itself begins anew with the next identifier.
        self.encoder = None;
        self.h_frame.encoder = None;
        self.requester.drop_into(&mut self.h_frame.finished);
        self.h_frame.clear();
    }
}
