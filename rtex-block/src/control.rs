use crate::bits::bit_set;

bit_set! {
    /// Control_Bits, bytes 2-3 of a command.
    ///
    /// ```text
    ///            7         6          5      4        3      2            1       0
    /// byte 2  Servo_On     0          0    Gain_SW  TL_SW  Homing_Ctrl    0       0
    /// byte 3  Hard_Stop Smooth_Stop Pause    0      SL_SW    0         EX-OUT2 EX-OUT1
    /// ```
    /// Only the ten named bits can be held; the other six are always written 0. A drive does not check them, so
    /// lenient decoding drops them and strict decoding refuses them. System Design Guide for Master, "Cyclic
    /// position command" and "Profile position command"; SX-DSV02310, "Control bits".
    ControlBits, control,
    /// Stops profile motion at once.
    HARD_STOP hard_stop 15 "Hard_Stop";
    /// Stops profile motion with its deceleration.
    SMOOTH_STOP smooth_stop 14 "Smooth_Stop";
    /// Holds profile motion: the axis stands, In_Progress stays 1.
    PAUSE pause 13 "Pause";
    /// Choice of the speed limit in torque control.
    SL_SW sl_sw 11 "SL_SW";
    /// Drive output EX-OUT2.
    EX_OUT2 ex_out2 9 "EX-OUT2";
    /// Drive output EX-OUT1.
    EX_OUT1 ex_out1 8 "EX-OUT1";
    /// Requests that the motor is energised. Has no effect in a NOP (00h).
    SERVO_ON servo_on 7 "Servo_On";
    /// First or second gain.
    GAIN_SW gain_sw 4 "Gain_SW";
    /// First or second torque limit.
    TL_SW tl_sw 3 "TL_SW";
    /// Used with the homing command.
    HOMING_CTRL homing_ctrl 2 "Homing_Ctrl";
}

impl ControlBits {
    /// Takes bytes 2 and 3; reserved bits are dropped.
    pub const fn from_bytes(bytes: [u8; 2]) -> Self {
        Self(u16::from_le_bytes(bytes) & Self::MASK)
    }

    /// The reserved bits that are set in bytes 2 and 3.
    pub const fn reserved(bytes: [u8; 2]) -> [u8; 2] {
        (u16::from_le_bytes(bytes) & !Self::MASK).to_le_bytes()
    }
}

// The guide's tables: bits 6, 5, 1, 0 of byte 2 and 4, 2 of byte 3 are 0.
const _: () = assert!(!ControlBits::MASK == u16::from_le_bytes([0x63, 0x14]));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value() {
        for raw in 0..=u16::MAX {
            let bytes = raw.to_le_bytes();
            let bits = ControlBits::from_bytes(bytes);
            let named = ControlBits::NAMED.iter().filter(|(b, _)| bits.contains(*b)).map(|(b, _)| b.0).sum::<u16>();
            assert_eq!(named, bits.0);
            assert_eq!(ControlBits::reserved(bytes), [bytes[0] & 0x63, bytes[1] & 0x14]);
            assert_eq!(bits.to_bytes(), [bytes[0] & !0x63, bytes[1] & !0x14]);
            assert_eq!(bits.servo_on(), bytes[0] & 0x80 != 0);
            assert_eq!(bits.pause(), bytes[1] & 0x20 != 0);
        }
    }
}
