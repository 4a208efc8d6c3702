//! Master, line and encoder on one bench.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use hdsl::device::Device;
use hdsl::line::{Disturbance, Line};
use hdsl::master::{Master, Report, State};
use hdsl::{EncoderId, Profile};

pub(crate) struct Bench {
    pub(crate) master: Master,
    pub(crate) device: Device,
    pub(crate) line: Line,
    /// Position at the last sampling edge.
    pub(crate) position: i64,
    pub(crate) speed: i64,
}

impl Bench {
    pub(crate) fn new(profile: Profile, id: u32, disturbance: Disturbance) -> Self {
        Self {
            master: Master::new(profile),
            device: Device::new(EncoderId::new(id).unwrap()),
            line: Line::new(disturbance, 1),
            position: 1 << 30,
            speed: 0,
        }
    }

    /// With an encoder of 32 bits.
    pub(crate) fn on_cable(profile: Profile, metres: u32) -> Self {
        Self::new(profile, 0x00153, Disturbance::cable(metres))
    }

    /// One H-frame.
    pub(crate) fn frame(&mut self) -> Report {
        self.frame_with(None)
    }

    pub(crate) fn frame_with(&mut self, late: Option<i16>) -> Report {
        self.position += self.speed;
        let head = self.line.down(self.master.transmission().head.bits());
        let answer = self.device.answer(head, self.position as u64);
        let samples = self.line.up(answer);
        self.master.finish(&samples, late).unwrap()
    }

    pub(crate) fn frames(&mut self, count: usize) {
        for _ in 0..count {
            let _ = self.frame();
        }
    }

    /// Until the link runs and the position is aligned.
    pub(crate) fn lock(&mut self) -> &mut Self {
        for _ in 0..2000 {
            let _ = self.frame();
            if self.master.state() == State::Running && self.aligned() && self.master.registers().quality() == 15 {
                return self;
            }
        }
        panic!("no lock: {:?}", self.master);
    }

    pub(crate) fn aligned(&self) -> bool {
        self.master.phase() == hdsl::Phase::Check && self.master.registers().position() == self.position as u64
    }
}
