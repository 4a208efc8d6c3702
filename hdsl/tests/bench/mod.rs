//! Master, line and encoder on one bench.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use hdsl::cable::{Cable, Disturbance};
use hdsl::device::{Device, Heard};
use hdsl::master::{Master, Report, State};
use hdsl::registers::{Interrupts, Register, Registers};
use hdsl::{Dialect, EncoderId, Window};

pub(crate) struct Bench {
    pub(crate) master: Master,
    /// Image beside the receiver.
    pub(crate) map: Registers,
    /// Interrupt lines after the last frame.
    pub(crate) interrupts: Interrupts,
    pub(crate) device: Device,
    pub(crate) cable: Cable,
    /// Position at the last sampling edge.
    pub(crate) position: i64,
    pub(crate) speed: i64,
}

impl Bench {
    pub(crate) fn new(dialect: Dialect, id: u32, disturbance: Disturbance) -> Self {
        Self {
            master: Master::new(dialect),
            map: Registers::new(&dialect),
            interrupts: Interrupts::empty(),
            device: Device::new(EncoderId::new(id).unwrap()),
            cable: Cable::new(disturbance, 1),
            position: 1 << 30,
            speed: 0,
        }
    }

    /// With an encoder of 32 bits.
    pub(crate) fn on_cable(dialect: Dialect, metres: u32) -> Self {
        Self::new(dialect, 0x00153, Disturbance::metres(metres))
    }

    /// One H-frame.
    pub(crate) fn frame(&mut self) -> Report {
        self.frame_with(None)
    }

    pub(crate) fn frame_with(&mut self, late: Option<i16>) -> Report {
        self.position += self.speed;
        let line = self.cable.down_samples(self.master.transmission().head);
        let samples = if let Some(heard) = Heard::on_line(&line) {
            let answer = self.device.answer(heard.bits, self.position as u64);
            self.cable.up_heard(answer, &heard)
        } else {
            // The encoder's own clock goes on.
            let answer = self.device.answer(Window::EMPTY, self.position as u64);
            self.cable.up(answer)
        };
        let report = *self.master.finish(&samples, late).unwrap();
        self.interrupts = self.map.apply(&report);
        report
    }

    /// What an application writes over the bus.
    #[allow(dead_code, reason = "not all tests do")]
    pub(crate) fn write(&mut self, register: Register, value: u8) {
        self.map.write(&mut self.master, register as u8, value).unwrap();
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
            if self.master.state() == State::Running && self.aligned() && self.map.quality() == 15 {
                return self;
            }
        }
        panic!("no lock: {:?}", self.master);
    }

    pub(crate) fn aligned(&self) -> bool {
        self.master.phase() == hdsl::Phase::Check && self.map.position() == self.position as u64
    }
}
