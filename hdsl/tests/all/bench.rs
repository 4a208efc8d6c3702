//! Master, line and encoder on one bench.

use crate::cable::{Cable, Disturbance};
use hdsl::device::{Device, Heard};
use hdsl::master::{HFrame, Master, State};
use hdsl::message::{Access, Data, LongRequest, Offset, ResourceAddress};
use hdsl::registers::{Interrupts, Register, Registers};
use hdsl::{Dialect, Doubt, EncoderId, Policy, Sample, Window};

/// A free-running frame.
const FRAME_NS: u64 = 11_520;

/// A write into the loaded user file.
pub(crate) fn write_file(address: u16, bytes: &[u8]) -> LongRequest {
    LongRequest {
        address: ResourceAddress::RWFILE,
        indirect: true,
        offset: Offset::new(address),
        access: Access::Write(Data::new(bytes).unwrap()),
    }
}

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
    /// When the sampling edge of the last frame was: frames of 11.52 µs.
    pub(crate) sampled_ns: u64,
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
            sampled_ns: 0,
        }
    }

    /// With an encoder of 32 bits.
    pub(crate) fn on_cable(dialect: Dialect, metres: u32) -> Self {
        Self::new(dialect, 0x00153, Disturbance::metres(metres))
    }

    /// One H-frame.
    pub(crate) fn frame(&mut self) -> HFrame {
        self.frame_with(None)
    }

    pub(crate) fn frame_with(&mut self, late: Option<i16>) -> HFrame {
        self.position += self.speed;
        let line = self.cable.down_samples(self.master.transmission().head);
        let samples = if let Some(heard) = Heard::on_line(&line) {
            let answer = self.device.set_position(self.position as u64).hear(heard.bits);
            self.cable.up_heard(answer, &heard)
        } else {
            // The encoder's own clock goes on.
            let answer = self.device.set_position(self.position as u64).hear(Window::EMPTY);
            self.cable.up(answer)
        };
        if let Some(late) = late {
            self.master.hear_pulse(late);
        }
        self.sampled_ns += FRAME_NS;
        // 91 bits from the edge to the end of the window.
        let report = *self.master.hear(&samples, self.sampled_ns + 9_707).unwrap();
        self.interrupts = self.map.apply(&report);
        report
    }

    /// The fast position, for a control loop that asks at once.
    pub(crate) fn fast(&self) -> Result<Sample, Doubt> {
        let fast = self.master.fast().at(self.sampled_ns, Policy::new(0))?;
        assert_eq!(fast.sampled_ns(), self.sampled_ns);
        Ok(fast)
    }

    /// The safe position, and how many frames old it is.
    pub(crate) fn safe(&self) -> Result<(i64, usize), Doubt> {
        let safe = self.master.safe().at(self.sampled_ns, Policy::new(15 * FRAME_NS))?;
        let age_ns = self.sampled_ns - safe.sampled_ns();
        assert!(age_ns % FRAME_NS == 0 && (8..=15).contains(&(age_ns / FRAME_NS)), "{age_ns}");
        Ok((safe.position(), (age_ns / FRAME_NS) as usize))
    }

    /// What an application writes over the bus.
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
        self.map.pos() == Some(self.position as u64)
    }
}
