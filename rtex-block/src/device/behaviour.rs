use crate::flags::flag_set;

flag_set! {
    /// What a modelled drive does if the available documents allow it or leave it open.
    pub struct Quirks(u16) {
        /// Every request is busy for as long as a parameter write would be.
        ALWAYS_BUSY = 1 << 0;
        /// A request that fails shows ERR while it is still busy.
        ERR_WHILE_BUSY = 1 << 1;
        /// A position can be set with the servo on; otherwise that fails with ERR.
        SETS_POSITION_WHILE_ON = 1 << 2;
        /// Most parameters take effect only after a reset of type 011h or 001h.
        PARAMETERS_AFTER_RESET = 1 << 3;
        /// If this is set before the first exchange, Homing_Complete is 1 from power-up.
        HOMED_AT_START = 1 << 4;
        /// In_Position is 1 while the axis is at rest before a profile motion, and also during the motion.
        ALWAYS_IN_POSITION = 1 << 5;
        /// WNG is set in every answer.
        WARNS = 1 << 6;
        /// An alarm is not cleared by command: that fails with ERR.
        REFUSES_TO_CLEAR = 1 << 7;
        /// The command that clears an alarm is executed, but the alarm stays.
        ALARM_STAYS = 1 << 8;
        /// A homing that starts leaves Homing_Complete as it is; otherwise it is 0 until the end.
        HOMED_THROUGH_HOMING = 1 << 9;
        /// Homing_Complete goes to 0 when the servo is switched off.
        UNHOMED_BY_SERVO_OFF = 1 << 10;
        /// Homing_Complete goes to 0 when an alarm occurs.
        UNHOMED_BY_ALARM = 1 << 11;
        /// A homing is busy until it ends; otherwise only In_Progress shows it.
        BUSY_WHILE_HOMING = 1 << 12;
    }
}

/// How awkwardly a modelled drive behaves. A new behaviour is polite: the drive does everything as soon as it can.
///
/// Each setting is allowed by the available documents or left open by them, so a master must cope with any combination.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// Number of exchanges by which everything but the counter echo is later than necessary, 0..=3.
    pub echo_lag: u8,
    /// Number of update periods from the start of a profile motion to In_Progress = 1; the axis is at rest until then.
    pub in_progress_late: u16,
    /// Number of update periods for which Servo_Active stays 1 after Servo_On went to 0.
    pub servo_off_late: u16,
    /// Number of answers to a new request that still carry type code and index of the previous request.
    pub stale_answers: u16,
    /// Number of exchanges by which each bit of byte 2 of the Status_Flags is shown late, bit 0 first (In_Position) and bit
    /// 7 last (Servo_Active), 0..=15 each.
    pub status_late: [u8; 8],
    /// Number of exchanges by which Latch_Comp1 and 2 are shown late, 0..=15.
    pub latch_late: u8,
    /// Its other quirks.
    pub quirks: Quirks,
}

impl Behaviour {
    /// Creates the behaviour of a drive that acts as soon as it can, without quirks.
    pub const fn new() -> Self {
        Self {
            echo_lag: 0,
            in_progress_late: 0,
            servo_off_late: 0,
            stale_answers: 0,
            status_late: [0; 8],
            latch_late: 0,
            quirks: Quirks::empty(),
        }
    }

    servowire_core::builder! {
        with_echo_lag: echo_lag, u8;
        with_in_progress_late: in_progress_late, u16;
        with_servo_off_late: servo_off_late, u16;
        with_stale_answers: stale_answers, u16;
        with_status_late: status_late, [u8; 8];
        with_latch_late: latch_late, u8;
        with_quirks: quirks, Quirks;
    }

    /// Returns whether it has this quirk.
    pub(super) const fn does(&self, quirk: Quirks) -> bool {
        self.quirks.contains(quirk)
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::new()
    }
}
