use crate::block::LEN;
use crate::code::CyclicCode;
use crate::command::Command;
use crate::control::ControlBits;
use crate::header::{MacId, UpdateCounter};

servowire_core::codes! {
    /// The cyclic codes with which a drive evaluates Servo_On: all but NOP.
    pub enum ActiveCode: u8 {
        /// PP.
        ProfilePosition = 1 => "PP",
        /// CP.
        CyclicPosition = 2 => "CP",
        /// CV.
        CyclicVelocity = 3 => "CV",
        /// CT.
        CyclicTorque = 4 => "CT",
    }
}

impl ActiveCode {
    /// Returns the cyclic code.
    pub const fn cyclic(self) -> CyclicCode {
        match self {
            Self::ProfilePosition => CyclicCode::ProfilePosition,
            Self::CyclicPosition => CyclicCode::CyclicPosition,
            Self::CyclicVelocity => CyclicCode::CyclicVelocity,
            Self::CyclicTorque => CyclicCode::CyclicTorque,
        }
    }
}

/// A command that switches a servo off, regardless of what the drive did before.
///
/// A block of zeros does not do that: its code is NOP, with which a drive ignores Servo_On and continues with the previous
/// command. A value of this type always has Servo_On = 0 and the code of one of the drive's modes, so send one of these to
/// each axis instead of clearing the transmit memory. SX-DSV02310, "NOP command".
///
/// ```
/// use rtex_block::{Command, CommandBlock, ControlBits, CyclicCode, MacId, UpdateCounter, master::ServoOff};
/// let mac_id = MacId::new(5).unwrap();
/// let before = Command { control: ControlBits::SERVO_ON, ..Command::idle(mac_id, UpdateCounter::ZERO) };
/// let off = ServoOff::after(&before).unwrap();
/// assert_eq!(off.emit()[..4], [0x25, 0x20, 0x00, 0x00]);
///
/// assert_eq!(ServoOff::after(&Command::nop(mac_id)), None);
/// assert!(!CommandBlock::of(&[0; 16]).unwrap().is_servo_off());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ServoOff(Command);

impl ServoOff {
    /// Creates a servo-off command with nothing else in the block.
    pub const fn new(mac_id: MacId, update_counter: UpdateCounter, code: ActiveCode) -> Self {
        Self(Command { cyclic: code.cyclic(), ..Command::idle(mac_id, update_counter) })
    }

    /// Creates the command that follows `before`: the counter advanced by one, Servo_On cleared, everything else kept.
    ///
    /// `None` if a drive would not evaluate Servo_On in it: the code is NOP, or a pair it does not accept.
    pub const fn after(before: &Command) -> Option<Self> {
        if matches!(before.cyclic, CyclicCode::Nop) || !before.code().is_allowed() {
            return None;
        }
        Some(Self(Command {
            update_counter: before.update_counter.next(),
            control: before.control.difference(ControlBits::SERVO_ON),
            ..*before
        }))
    }

    /// Returns the servo-off as a command.
    pub const fn command(&self) -> &Command {
        &self.0
    }

    /// The block.
    pub const fn emit(&self) -> [u8; LEN] {
        self.0.emit()
    }
}
