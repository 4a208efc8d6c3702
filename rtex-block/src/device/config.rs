use crate::error_code::Alarm;
use crate::header::MacId;
use crate::position::Gear;
use crate::type_code::TypeCode;

/// Codes of a drive that no available document confirms; the author of a drive model has to choose them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OpenCodes {
    /// Profile: positioning to an absolute position.
    pub profile_absolute: u8,
    /// Parameter: read.
    pub parameter_read: TypeCode,
    /// Parameter: write to the EEPROM.
    pub parameter_store: TypeCode,
    /// Alarm: read the active alarm and the warning.
    pub alarm_active: TypeCode,
    /// Alarm: read the history; the index is 1 (latest) to 14.
    pub alarm_history: TypeCode,
    /// Alarm: clear it.
    pub alarm_clear: TypeCode,
    /// Alarm: read the attributes of the present alarm, with Index 0.
    pub alarm_attributes: TypeCode,
    /// Parameter: read the initial value.
    pub parameter_initial: TypeCode,
    /// Parameter: read the number of parameters in a class, which the high byte of the index names.
    pub parameter_count: TypeCode,
    /// Homing: arm both latches.
    pub latch_arm: u8,
    /// Homing: move the drive to its origin.
    pub homing: u8,
    /// The alarm raised when frames stop arriving.
    pub communication_lost: Alarm,
}

impl OpenCodes {
    /// Invented codes, for examples and tests in which both ends belong to this crate; a real drive has different ones.
    pub const INVENTED: Self = Self {
        profile_absolute: 0x10,
        parameter_read: TypeCode::short(0x10),
        parameter_store: TypeCode::short(0x21),
        alarm_active: TypeCode::short(0x01),
        alarm_history: TypeCode::short(0x02),
        alarm_clear: TypeCode::short(0x03),
        alarm_attributes: TypeCode::short(0x76),
        parameter_initial: TypeCode::short(0x77),
        parameter_count: TypeCode::short(0x7a),
        latch_arm: 0x78,
        homing: 0x79,
        communication_lost: Alarm { main: 80, sub: 0 },
    };
}

/// The configuration of a modelled drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DriveConfig {
    /// The address set on its switches.
    pub mac_id: MacId,
    /// Update period, ns.
    pub update_ns: u32,
    /// Number of communication periods in an update period, 1 or 2.
    pub communications: u8,
    /// Number of exchanges until the drive is synchronised to the communication.
    pub sync_exchanges: u16,
    /// Number of update periods from Servo_On to Servo_Active.
    pub servo_on_updates: u16,
    /// Number of exchanges for which a parameter write or a reset is busy.
    pub busy_exchanges: u16,
    /// Number of consecutive faulty receptions that raise Err86.0 or Err86.1 (the vendor's time is not known).
    pub fault_limit: u16,
    /// Number of consecutive update periods with a wrong Update_Counter that raise Err86.2 (the vendor's rule is not known).
    pub counter_limit: u16,
    /// Number of consecutive communication periods without a frame that raise [`OpenCodes::communication_lost`].
    pub lost_limit: u16,
    /// The motor makes up 1/2^`follow` of the deviation in each update period; 0..=15.
    pub follow: u8,
    /// Electronic gear, for the limit of the position step.
    pub gear: Gear,
    /// Command units per revolution, for speeds in r/min.
    pub units_per_rev: u32,
    /// In_Position window, command units.
    pub in_position: u32,
    /// Near window of profile motion, command units.
    pub near: u32,
    /// The attributes that it reports for every alarm.
    pub alarm_attributes: i32,
    /// Distance from the point where homing starts to the origin, in command units.
    pub homing_distance: i32,
    /// The codes that are not confirmed.
    pub codes: OpenCodes,
}

impl DriveConfig {
    /// Creates a polite drive at 0.5 ms, one communication per update, gear 1/1 and 2^20 units per revolution.
    pub const fn new(mac_id: MacId, codes: OpenCodes) -> Self {
        Self {
            mac_id,
            update_ns: 500_000,
            communications: 1,
            sync_exchanges: 16,
            servo_on_updates: 8,
            busy_exchanges: 4,
            fault_limit: 8,
            counter_limit: 8,
            lost_limit: 8,
            follow: 2,
            gear: Gear::UNITY,
            units_per_rev: 1 << 20,
            in_position: 20,
            near: 2_000,
            alarm_attributes: 1,
            homing_distance: -5_000,
            codes,
        }
    }

    servowire_core::builder! {
        with_update_ns: update_ns, u32;
        with_communications: communications, u8;
        with_sync_exchanges: sync_exchanges, u16;
        with_servo_on_updates: servo_on_updates, u16;
        with_busy_exchanges: busy_exchanges, u16;
        with_fault_limit: fault_limit, u16;
        with_counter_limit: counter_limit, u16;
        with_lost_limit: lost_limit, u16;
        with_follow: follow, u8;
        with_gear: gear, Gear;
        with_units_per_rev: units_per_rev, u32;
        with_in_position: in_position, u32;
        with_near: near, u32;
        with_alarm_attributes: alarm_attributes, i32;
        with_homing_distance: homing_distance, i32;
    }
}
