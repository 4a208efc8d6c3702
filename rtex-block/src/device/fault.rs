use crate::error_code::Alarm;
use crate::header::MacId;

/// The fault that a modelled drive is made to show, one at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Fault {
    /// Nothing. An alarm that was raised stays until it is cleared.
    #[default]
    None,
    /// It is off the ring: it receives no frame and sends none.
    Silent,
    /// Its processing has stopped: it sends its last block again and again, and receives nothing.
    StaleEcho,
    /// It sends an Actual_MAC-ID different from the address to which it responds.
    WrongMacId(MacId),
    /// The main power has failed: the motor is released, and the drive is not ready.
    NoMainPower,
    /// Emergency stop: the motor is released without an alarm, the drive is not ready, and E-STOP is 1.
    EmergencyStop,
    /// The motor is released once, without an alarm; Servo_Ready stays 1.
    ServoDrop,
    /// It raises this alarm once, and releases the motor. An alarm that is already active stays.
    Alarm(Alarm),
}

servowire_core::one_line!(Fault {
    Self::None => "no fault";
    Self::Silent => "silent";
    Self::StaleEcho => "sends its last block again";
    Self::WrongMacId(mac_id) => "sends MAC-ID {}", mac_id;
    Self::NoMainPower => "no main power";
    Self::EmergencyStop => "emergency stop";
    Self::ServoDrop => "drops the servo";
    Self::Alarm(alarm) => "raises {}", alarm;
});
