/// How impolite a modelled drive is. The polite one of [`POLITE`](Self::POLITE) does everything as soon as it can.
///
/// Each of them is allowed by what the documents at hand say, or left open by them; a master has to live with any
/// combination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Behaviour {
    /// Exchanges by which everything but the counter echo is later than it has to be, 0..=3.
    pub echo_lag: u8,
    /// Update periods from the start of a profile motion to In_Progress = 1; the axis stands as long.
    pub in_progress_late: u16,
    /// Update periods for which Servo_Active stays 1 after Servo_On went to 0.
    pub servo_off_late: u16,
    /// Answers to a new request that still carry type code and index of the request before it.
    pub stale_answers: u16,
    /// Exchanges by which each bit of byte 2 of the Status_Flags is shown later than it is so, bit 0 first (In_Position) and bit 7
    /// last (Servo_Active), 0..=15 each.
    pub status_late: [u8; 8],
    /// Exchanges by which Latch_Comp1 and 2 are shown later than they are so, 0..=15.
    pub latch_late: u8,
    /// Every request is busy for as long as a parameter write.
    pub always_busy: bool,
    /// A request that fails says ERR while it is still busy.
    pub err_while_busy: bool,
    /// A position can be set with the servo on; otherwise that fails with ERR.
    pub sets_position_while_on: bool,
    /// Most parameters count only after a reset of type 011h or 001h.
    pub parameters_after_reset: bool,
    /// Homing_Complete is 1 from power-up on.
    pub homed_at_start: bool,
    /// In_Position is 1 during the standstill before a profile motion, and during the motion too.
    pub always_in_position: bool,
    /// WNG is set in every answer.
    pub warns: bool,
    /// An alarm is not cleared by command: that fails with ERR.
    pub refuses_to_clear: bool,
    /// The command that clears an alarm is executed, and the alarm is there all the same.
    pub alarm_stays: bool,
}

impl Behaviour {
    /// As soon as it can.
    pub const POLITE: Self = Self {
        echo_lag: 0,
        in_progress_late: 0,
        servo_off_late: 0,
        stale_answers: 0,
        status_late: [0; 8],
        latch_late: 0,
        always_busy: false,
        err_while_busy: false,
        sets_position_while_on: false,
        parameters_after_reset: false,
        homed_at_start: false,
        always_in_position: false,
        warns: false,
        refuses_to_clear: false,
        alarm_stays: false,
    };

    servowire_core::builder! {
        with_echo_lag: echo_lag, u8;
        with_in_progress_late: in_progress_late, u16;
        with_servo_off_late: servo_off_late, u16;
        with_stale_answers: stale_answers, u16;
        with_status_late: status_late, [u8; 8];
        with_latch_late: latch_late, u8;
        with_always_busy: always_busy, bool;
        with_err_while_busy: err_while_busy, bool;
        with_sets_position_while_on: sets_position_while_on, bool;
        with_parameters_after_reset: parameters_after_reset, bool;
        with_homed_at_start: homed_at_start, bool;
        with_always_in_position: always_in_position, bool;
        with_warns: warns, bool;
        with_refuses_to_clear: refuses_to_clear, bool;
        with_alarm_stays: alarm_stays, bool;
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::POLITE
    }
}
