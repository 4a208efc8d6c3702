use crate::flags::flag_set;

flag_set! {
    /// Status_Flags, bytes 2-3 of a response: byte 2 in bits 7-0, byte 3 in bits 15-8.
    ///
    /// ```text
    ///             7              6           5       4         3               2            1           0
    /// byte 2  Servo_Active  Servo_Ready    Alarm  Warning Torque_Limited Homing_Complete In_Progress In_Position
    /// byte 3  SI-MON5       SI-MON4       SI-MON3 SI-MON2   SI-MON1         HOME         POT         NOT
    ///         /E-STOP       /EX-SON       /EXT3   /EXT2     /EXT1
    /// ```
    /// Drive parameters can exchange POT and NOT and choose what the SI-MON bits show; linear drives may carry
    /// the magnetic-pole signals CS1 to CS3 in bits 3-5 of byte 3. The names here are those of the default
    /// setting, by bit position. System Design Guide for Master, "Cyclic position response"; SX-DSV02310,
    /// "Status flags".
    pub struct StatusFlags(u16) {
        /// Input SI-MON5, or E-STOP.
        SI_MON5 = 1 << 15;
        /// Input SI-MON4, or EX-SON.
        SI_MON4 = 1 << 14;
        /// Input SI-MON3, or EXT3.
        SI_MON3 = 1 << 13;
        /// Input SI-MON2, or EXT2.
        SI_MON2 = 1 << 12;
        /// Input SI-MON1, or EXT1.
        SI_MON1 = 1 << 11;
        /// Home sensor.
        HOME = 1 << 10;
        /// Positive over-travel input (exchangeable with NOT by parameter).
        POT = 1 << 9;
        /// Negative over-travel input (exchangeable with POT by parameter).
        NOT = 1 << 8;
        /// Servo_Active: the motor is energised; already 0 while the dynamic brake stops it.
        SERVO_ACTIVE = 1 << 7;
        /// Servo_Ready: main power is established, there is no alarm, and the drive is synchronised to the communication.
        SERVO_READY = 1 << 6;
        /// An alarm is active.
        ALARM = 1 << 5;
        /// A warning is active.
        WARNING = 1 << 4;
        /// Torque_Limited: the torque is at its limit.
        TORQUE_LIMITED = 1 << 3;
        /// Homing_Complete: homing has been completed.
        HOMING_COMPLETE = 1 << 2;
        /// In_Progress: the drive is generating a position command; a parameter can make this bit AC_OFF.
        IN_PROGRESS = 1 << 1;
        /// In_Position: the position deviation is inside the window.
        IN_POSITION = 1 << 0;
    }
}

impl StatusFlags {
    /// Reads bytes 2 and 3; every bit has a meaning.
    pub const fn from_bytes(bytes: [u8; 2]) -> Self {
        Self::from_bits_retain(u16::from_le_bytes(bytes))
    }

    /// Bytes 2 and 3.
    pub const fn to_bytes(self) -> [u8; 2] {
        self.bits().to_le_bytes()
    }
}

const _: () = assert!(StatusFlags::all().bits() == u16::MAX);

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_value() {
        for raw in (0..=u16::MAX).step_by(crate::STRIDE) {
            let flags = StatusFlags::from_bytes(raw.to_le_bytes());
            assert_eq!(flags.to_bytes(), raw.to_le_bytes());
            assert_eq!(flags.contains(StatusFlags::SERVO_ACTIVE), raw & 0x80 != 0);
            assert_eq!(flags.contains(StatusFlags::POT), raw & 0x200 != 0);
            assert_eq!(flags.contains(StatusFlags::NOT), raw & 0x100 != 0);
        }
        assert_eq!(StatusFlags::from_bytes([0xc1, 0]).to_string(), "SERVO_ACTIVE SERVO_READY IN_POSITION");
    }
}
