use crate::bits::bit_set;

bit_set! {
    /// Status_Flags, bytes 2-3 of a response.
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
    StatusFlags, status,
    /// Input SI-MON5, or E-STOP.
    SI_MON5 si_mon5 15 "SI-MON5";
    /// Input SI-MON4, or EX-SON.
    SI_MON4 si_mon4 14 "SI-MON4";
    /// Input SI-MON3, or EXT3.
    SI_MON3 si_mon3 13 "SI-MON3";
    /// Input SI-MON2, or EXT2.
    SI_MON2 si_mon2 12 "SI-MON2";
    /// Input SI-MON1, or EXT1.
    SI_MON1 si_mon1 11 "SI-MON1";
    /// Home sensor.
    HOME home 10 "HOME";
    /// Positive over-travel input (exchangeable with NOT by parameter).
    POT pot 9 "POT";
    /// Negative over-travel input (exchangeable with POT by parameter).
    NOT not 8 "NOT";
    /// The motor is energised; already 0 while the dynamic brake stops it.
    SERVO_ACTIVE servo_active 7 "Servo_Active";
    /// Main power is established, there is no alarm, and the drive is synchronised to the communication.
    SERVO_READY servo_ready 6 "Servo_Ready";
    /// An alarm is active.
    ALARM alarm 5 "Alarm";
    /// A warning is active.
    WARNING warning 4 "Warning";
    /// The torque is at its limit.
    TORQUE_LIMITED torque_limited 3 "Torque_Limited";
    /// Homing has been completed.
    HOMING_COMPLETE homing_complete 2 "Homing_Complete";
    /// The drive is generating a position command; a parameter can make this bit AC_OFF.
    IN_PROGRESS in_progress 1 "In_Progress";
    /// The position deviation is inside the window.
    IN_POSITION in_position 0 "In_Position";
}

impl StatusFlags {
    /// Takes bytes 2 and 3; every bit has a meaning.
    pub const fn from_bytes(bytes: [u8; 2]) -> Self {
        Self(u16::from_le_bytes(bytes))
    }
}

const _: () = assert!(StatusFlags::MASK == u16::MAX);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value() {
        for raw in 0..=u16::MAX {
            let flags = StatusFlags::from_bytes(raw.to_le_bytes());
            assert_eq!(flags.to_bytes(), raw.to_le_bytes());
            assert_eq!(flags.servo_active(), raw & 0x80 != 0);
            assert_eq!((flags.pot(), flags.not()), (raw & 0x200 != 0, raw & 0x100 != 0));
        }
    }
}
