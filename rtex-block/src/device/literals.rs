//! The numbers on the wire, defined a second time: the drive shares none with the master.

/// Cyclic codes, bits 6-4 of byte 1.
pub(super) const NOP: u8 = 0;
pub(super) const PP: u8 = 1;
pub(super) const CP: u8 = 2;
pub(super) const CV: u8 = 3;
pub(super) const CT: u8 = 4;

/// The non-cyclic codes that are defined, and those that are also valid in the sub block.
pub(super) const NON_CYCLIC: [u8; 8] = [0, 1, 2, 4, 5, 6, 7, 10];
pub(super) const NORMAL: u8 = 0;
pub(super) const RESET: u8 = 1;
pub(super) const SYSTEM_ID: u8 = 2;
pub(super) const HOMING: u8 = 4;
pub(super) const ALARM: u8 = 5;
pub(super) const PARAMETER: u8 = 6;
pub(super) const PROFILE: u8 = 7;
pub(super) const MONITOR: u8 = 10;
pub(super) const SUB: [u8; 3] = [SUB_NORMAL, SUB_SYSTEM_ID, SUB_MONITOR];
pub(super) const SUB_NORMAL: u8 = 0;
pub(super) const SUB_SYSTEM_ID: u8 = 2;
pub(super) const SUB_MONITOR: u8 = 10;

/// Byte 1: profile position, idle.
pub(super) const PROFILE_IDLE: u8 = 0x10;

/// Error codes.
pub(super) const WRONG_MAC_ID: u16 = 0x0011;
pub(super) const WRONG_DIRECTION: u16 = 0x0012;
pub(super) const WRONG_CYCLIC: u16 = 0x0021;
pub(super) const WRONG_NON_CYCLIC: u16 = 0x0022;
pub(super) const WRONG_MODE: u16 = 0x002e;
pub(super) const WRONG_TYPE: u16 = 0x0031;
pub(super) const WRONG_ARGUMENT: u16 = 0x0032;
pub(super) const WRONG_FEED_FORWARD: u16 = 0x0034;

/// Alarms, main and sub code.
pub(super) const ERR27_4: (u8, u8) = (27, 4);
pub(super) const ERR86_0: (u8, u8) = (86, 0);
pub(super) const ERR86_1: (u8, u8) = (86, 1);
pub(super) const ERR86_2: (u8, u8) = (86, 2);
pub(super) const ERR91_1: (u8, u8) = (91, 1);

/// Type codes.
pub(super) const RESET_SOFTWARE: u16 = 0x001;
pub(super) const RESET_ATTRIBUTE_C: u16 = 0x011;
pub(super) const PARAMETER_WRITE: u16 = 0x011;
pub(super) const HOMING_ACTUAL: u16 = 0x21;
pub(super) const HOMING_COMMAND: u16 = 0x22;
pub(super) const HOMING_LATCH: u16 = 0x50;
pub(super) const PROFILE_RELATIVE: u16 = 0x11;
pub(super) const PERR: u16 = 0x01;
pub(super) const MPOS: u16 = 0x04;
pub(super) const ASPD: u16 = 0x05;
pub(super) const TRQ: u16 = 0x06;
pub(super) const APOS: u16 = 0x07;
pub(super) const IPOS: u16 = 0x08;
pub(super) const LPOS1: u16 = 0x09;
pub(super) const LPOS2: u16 = 0x0a;
pub(super) const MSPD: u16 = 0x0c;
pub(super) const REGENERATIVE_LOAD: u16 = 0x11;
pub(super) const OVERLOAD: u16 = 0x12;

/// The texts by the new type codes and by the conventional ones.
pub(super) const TEXTS: [(u16, u16, &[u8]); 8] = [
    (0x01, 0x010, b"Panasonic"),
    (0x05, 0x050, b"1"),
    (0x12, 0x120, b"DRIVE MODEL"),
    (0x13, 0x130, b"00000000"),
    (0x14, 0x140, b"0.1"),
    (0x15, 0x150, b"A"),
    (0x31, 0x310, b"SCALE"),
    (0x32, 0x320, b"SCALE MODEL"),
];

/// The control bits that the drive evaluates, byte 2 in bits 7-0.
pub(super) const SERVO_ON: u16 = 0x0080;
pub(super) const PAUSE: u16 = 0x2000;
pub(super) const SMOOTH_STOP: u16 = 0x4000;
pub(super) const HARD_STOP: u16 = 0x8000;

/// E-STOP, byte 3 of a response.
pub(super) const SHOWN_E_STOP: u8 = 0x80;

/// Status_Flags, byte 2 of a response.
pub(super) const SHOWN_ACTIVE: u8 = 0x80;
pub(super) const SHOWN_READY: u8 = 0x40;
pub(super) const SHOWN_ALARM: u8 = 0x20;
pub(super) const SHOWN_WARNING: u8 = 0x10;
pub(super) const SHOWN_TORQUE_LIMITED: u8 = 0x08;
pub(super) const SHOWN_HOMED: u8 = 0x04;
pub(super) const SHOWN_IN_PROGRESS: u8 = 0x02;
pub(super) const SHOWN_IN_POSITION: u8 = 0x01;

/// Byte 9 of an answer: its progress and, depending on the layout, the latches and the near window.
pub(super) const ERR: u8 = 0x80;
pub(super) const WNG: u8 = 0x40;
pub(super) const BUSY: u8 = 0x10;
pub(super) const LATCH_COMP1: u8 = 0x01;
pub(super) const LATCH_COMP2: u8 = 0x02;
pub(super) const NEAR: u8 = 0x02;
