//! The interrupt of a current loop: the electrical angle of this instant, or the outputs off.

use servowire_core::{
    Acceleration, Angle, ClockError, Commutation, Estimate, Policy, Shaft, ShaftReader, ShaftWriter, Words,
};
use servowire_drivers::Error;

/// The power stage of a motor.
pub trait Outputs {
    /// Sets the field to this electrical angle.
    fn on(&mut self, field: Angle);
    /// No current.
    fn off(&mut self);
}

/// What a control loop requires of an angle.
#[derive(Debug, Clone, Copy)]
pub struct Limits<T> {
    /// How old the evidence may be, and which alarms it may carry.
    pub policy: Policy<T>,
    /// How the encoder is mounted on the motor.
    pub commutation: Commutation,
    /// What motor and load can do to the shaft.
    pub max_acceleration: Acceleration,
    /// How far the electrical angle may be off.
    pub max_error: Angle,
}

/// Reads the feedback cell in an interrupt, and switches the outputs off whenever the angle must not be used: no evidence, or too old,
/// or with an alarm; an unknown speed; a faulty clock. They come on again with the next good angle; a latch that a person
/// has to reset belongs outside.
pub struct Control<'a, F: Shaft, O, const W: usize> {
    reader: ShaftReader<'a, F, W>,
    outputs: O,
    limits: Limits<F::Tolerated>,
}

impl<'a, F: Shaft + Words<W>, O: Outputs, const W: usize> Control<'a, F, O, W> {
    /// Creates the loop with the outputs off.
    pub fn new(reader: ShaftReader<'a, F, W>, mut outputs: O, limits: Limits<F::Tolerated>) -> Self {
        outputs.off();
        Self { reader, outputs, limits }
    }

    /// The interrupt. Returns whether the outputs are on.
    #[inline]
    pub fn interrupt(&mut self, now_ns: Result<u64, ClockError>) -> bool {
        let Limits { policy, commutation, max_acceleration, max_error } = self.limits;
        let field =
            now_ns.ok().and_then(|now_ns| self.reader.angle(now_ns, policy, commutation, max_acceleration).ok());
        match field {
            Some(Estimate { angle, bound }) if bound <= max_error => {
                self.outputs.on(angle);
                true
            }
            _ => {
                self.outputs.off();
                false
            }
        }
    }
}

/// Puts a successful reading into the cell of a control interrupt, and judges it as the interrupt does. After a failure the
/// content of the cell grows old.
///
/// # Errors
/// Why there is no position.
pub fn put<F: Shaft + Words<W>, const W: usize, IO, PIN, P>(
    writer: &mut ShaftWriter<'_, F, W>,
    read: Result<F, Error<IO, PIN, P, F::Doubt>>,
    now_ns: Result<u64, ClockError>,
    policy: Policy<F::Tolerated>,
) -> Result<F::Sample, Error<IO, PIN, P, F::Doubt>> {
    let (evidence, now_ns) = (read?, now_ns?);
    writer.put(evidence, now_ns, policy);
    evidence.at(now_ns, policy).map_err(Error::Doubt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::RefCell;
    use servowire_core::{Sense, Tracker};
    use std::vec::Vec;
    use tformat::{Evidence, EvidenceShaftCell, Request, Resolution, Response};

    /// What was written to the registers: an angle in millidegrees, or off.
    #[derive(Default)]
    struct Registers(RefCell<Vec<Option<u32>>>);

    impl Outputs for &Registers {
        fn on(&mut self, field: Angle) {
            self.0.borrow_mut().push(Some(field.millidegrees()));
        }

        fn off(&mut self) {
            self.0.borrow_mut().push(None);
        }
    }

    /// All data (ID 3) of an encoder with 17 and 16 bits: CF, SF, ABS, ENID, ABM, ALMC, CRC.
    fn evidence(count: u32, almc: u8, sampled_ns: u64) -> Evidence {
        let [low, middle, high, _] = count.to_le_bytes();
        let sf = if almc == 0 { 0 } else { 0x20 };
        let mut bytes = [0x1a, sf, low, middle, high, 0x11, 7, 0, 0, almc, 0];
        bytes[10] = bytes.iter().fold(0, |sum, byte| sum ^ byte);
        let response = Response::parse(Request::ReadAll, &bytes).unwrap();
        Evidence::of(response, Resolution::new(17, 16).unwrap(), sampled_ns)
    }

    #[test]
    fn the_outputs_are_on_with_a_good_angle_and_off_without() {
        let policy = Policy::new(450_000);
        let limits = Limits {
            policy,
            commutation: Commutation::new(4, Angle::ZERO, Sense::Up).unwrap(),
            max_acceleration: Acceleration::from_turns_per_s2(2_000).unwrap(),
            max_error: Angle::from_millidegrees(5_000),
        };
        let registers = Registers::default();
        let mut cell = EvidenceShaftCell::new();
        let (mut writer, reader) = cell.split(Tracker::new(1 << 17, 100).unwrap());
        let mut control = Control::new(reader, &registers, limits);
        let mut seen = Vec::new();
        let mut at = |now_ns| seen.push(control.interrupt(now_ns));
        at(Ok(100_000)); // nothing was heard yet
        writer.put(evidence(1_000, 0, 200_000), 250_000, policy);
        at(Ok(300_000)); // the speed is not known
        writer.put(evidence(1_655, 0, 400_000), 450_000, policy);
        at(Ok(400_000)); // 1655 counts of 131072, times four
        at(Ok(600_000)); // as far again
        at(Err(ClockError::Stopped));
        at(Ok(849_999)); // the cable is broken
        at(Ok(850_001)); // for too long
        writer.put(evidence(2_310, 0x40, 900_000), 950_000, policy);
        at(Ok(960_000)); // an alarm
        writer.put(evidence(2_310, 0, 1_000_000), 1_050_000, policy);
        writer.put(evidence(2_310, 0, 1_200_000), 1_250_000, policy);
        at(Ok(1_260_000)); // it stands, and is good again
        assert_eq!(seen, [false, false, true, true, false, true, false, false, true]);
        let written = registers.0.take();
        assert_eq!(written.len(), 10);
        let on: Vec<_> = written.iter().copied().flatten().collect();
        assert_eq!(on[..2], [18_182, 25_378], "{written:?}");
        assert_eq!(on[3], 25_378);
        assert_eq!(written.iter().filter(|angle| angle.is_none()).count(), 6);
    }
}
