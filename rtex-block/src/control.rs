use crate::flags::flag_set;

flag_set! {
    /// Control_Bits, bytes 2-3 of a command: byte 2 in bits 7-0, byte 3 in bits 15-8.
    ///
    /// ```text
    ///            7         6          5      4        3        2         1       0
    /// byte 2  Servo_On     0          0    Gain_SW  TL_SW  Homing_Ctrl    0       0
    /// byte 3  Hard_Stop Smooth_Stop Pause    0      SL_SW      0      EX-OUT2  EX-OUT1
    /// ```
    /// Only the ten named bits are ever written; the other six are sent as 0. A drive does not check these six, so lenient
    /// decoding drops them and strict decoding refuses them. System Design Guide for Master, "Cyclic position command" and
    /// "Profile position command"; SX-DSV02310, "Control bits".
    pub struct ControlBits(u16) {
        /// Hard_Stop: stops profile motion at once.
        HARD_STOP = 1 << 15;
        /// Smooth_Stop: stops profile motion with its deceleration.
        SMOOTH_STOP = 1 << 14;
        /// Pause: holds profile motion; the axis is at rest, In_Progress stays 1.
        PAUSE = 1 << 13;
        /// SL_SW: choice of the speed limit in torque control.
        SL_SW = 1 << 11;
        /// Drive output EX-OUT2.
        EX_OUT2 = 1 << 9;
        /// Drive output EX-OUT1.
        EX_OUT1 = 1 << 8;
        /// Servo_On: requests that the motor is energised. It has no effect in a NOP (00h).
        SERVO_ON = 1 << 7;
        /// Gain_SW: first or second gain.
        GAIN_SW = 1 << 4;
        /// TL_SW: first or second torque limit.
        TL_SW = 1 << 3;
        /// Homing_Ctrl: used with the homing command.
        HOMING_CTRL = 1 << 2;
    }
}

impl ControlBits {
    /// Reads bytes 2 and 3; reserved bits are dropped.
    pub const fn from_bytes(bytes: [u8; 2]) -> Self {
        Self::from_bits_truncate(u16::from_le_bytes(bytes))
    }

    /// Bytes 2 and 3; reserved bits are 0, even after `from_bits_retain`.
    pub const fn to_bytes(self) -> [u8; 2] {
        (self.bits() & Self::all().bits()).to_le_bytes()
    }

    /// Returns the reserved bits that are set in bytes 2 and 3.
    pub const fn reserved(bytes: [u8; 2]) -> [u8; 2] {
        (u16::from_le_bytes(bytes) & !Self::all().bits()).to_le_bytes()
    }
}

// The guide's tables: bits 6, 5, 1, 0 of byte 2 and 4, 2 of byte 3 are 0.
const _: () = assert!(!ControlBits::all().bits() == u16::from_le_bytes([0x63, 0x14]));

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_value() {
        for raw in (0..=u16::MAX).step_by(crate::STRIDE) {
            let bytes = raw.to_le_bytes();
            let control = ControlBits::from_bytes(bytes);
            assert_eq!(control.iter_names().map(|(_, bit)| bit.bits()).sum::<u16>(), control.bits());
            assert_eq!(ControlBits::reserved(bytes), [bytes[0] & 0x63, bytes[1] & 0x14]);
            assert_eq!(control.to_bytes(), [bytes[0] & !0x63, bytes[1] & !0x14]);
            assert_eq!(ControlBits::from_bits_retain(raw).to_bytes(), control.to_bytes());
            assert_eq!(control.contains(ControlBits::SERVO_ON), bytes[0] & 0x80 != 0);
            assert_eq!(control.contains(ControlBits::PAUSE), bytes[1] & 0x20 != 0);
        }
    }

    #[test]
    fn prints_the_names() {
        let control = ControlBits::SERVO_ON | ControlBits::PAUSE;
        assert_eq!(control.to_string(), "PAUSE SERVO_ON");
        assert_eq!(ControlBits::empty().to_string(), "-");
    }
}
