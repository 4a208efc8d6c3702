//! An axis and a drive on a perfect line.
#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]

use core::num::NonZeroU16;

use rtex_block::device::{Behaviour, Drive, DriveConfig, OpenCodes};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, CommandCounter, CommandEnded, Heard, Limits, Progress, Turn,
};
use rtex_block::{
    Alarm, Arguments, CommandBlock, MacId, Nibble, NonCyclicCommand, NonCyclicResponse, Policy, Response, Response32,
    Tolerated, TypeCode,
};

/// The drive's numbers that are not confirmed.
pub const CODES: OpenCodes = OpenCodes {
    profile_absolute: 0x10,
    parameter_read: TypeCode::short(0xc0),
    parameter_store: TypeCode::short(0xc1),
    alarm_active: TypeCode::short(0xc2),
    alarm_history: TypeCode::short(0xc3),
    alarm_clear: TypeCode::short(0xc4),
    alarm_attributes: TypeCode::short(0xc5),
    parameter_initial: TypeCode::short(0xc6),
    parameter_count: TypeCode::short(0xc9),
    latch_arm: 0xc7,
    homing: 0xc8,
    communication_lost: Alarm { main: 80, sub: 0 },
};

pub const LIMIT: u16 = 6;

pub struct Pair {
    pub axis: Axis,
    pub drive: Drive,
    pub counter: CommandCounter,
    pub sent: Turn,
    pub received: Heard,
    /// 32-byte blocks.
    pub wide: bool,
    pub now: u32,
}

pub fn limits() -> Limits {
    Limits::new(NonZeroU16::new(LIMIT).unwrap(), 60).with_ready(Some(100)).with_inactive(12)
}

impl Pair {
    pub fn with(config: AxisConfig, drive: DriveConfig) -> Self {
        Self {
            axis: Axis::new(config),
            drive: Drive::new(drive),
            counter: CommandCounter::new(3),
            sent: Turn::Invalid,
            received: Heard::Nothing,
            wide: false,
            now: 0,
        }
    }

    pub fn new(mode: ActiveCode, behaviour: Behaviour) -> Self {
        let mac_id = MacId::new(9).unwrap();
        let config = AxisConfig::new(mac_id, mode, 500_000, limits());
        let mut pair = Self::with(config, DriveConfig::new(mac_id, CODES));
        pair.drive.set_behaviour(behaviour);
        pair
    }

    pub fn on(mode: ActiveCode, behaviour: Behaviour) -> Self {
        let mut pair = Self::new(mode, behaviour);
        pair.switch_on();
        pair
    }

    pub fn switch_on(&mut self) {
        self.until("off", |pair| pair.axis.can_switch_on().is_ok());
        self.axis.switch_on().unwrap();
        self.until("on", |pair| pair.axis.state() == AxisState::On);
    }

    /// One update period. The law of the servo-off is checked in each.
    pub fn update(&mut self) {
        self.now += 1;
        self.axis.hear(self.sent, &self.received, self.now_ns());
        self.sent = self.counter.next();
        let command = self.axis.transmission(self.sent);
        let main = command.main.emit();
        if self.sent != Turn::Invalid {
            let off = CommandBlock::of(&main).unwrap().is_servo_off();
            assert_eq!(off, !self.axis.state().is_servo_on(), "{}", self.axis.state());
        }
        self.received = if self.wide {
            self.drive.hear(&command.emit()).map_or(Heard::Nothing, |block| Response32::parse_strict(&block).into())
        } else {
            self.drive.hear(&main).map_or(Heard::Nothing, |block| Response::parse_strict(&block).into())
        };
    }

    /// When the blocks of the last update period were heard.
    pub fn now_ns(&self) -> u64 {
        u64::from(self.now) * 500_000
    }

    /// The actual position, however old it is and in spite of an alarm.
    pub fn actual(&self) -> i32 {
        actual(&self.axis)
    }

    pub fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        for _ in 0..5_000 {
            if done(self) {
                return;
            }
            self.update();
        }
        panic!("{what}: {}, {:?}, {:?}", self.axis.state(), self.axis.status(), self.drive.alarm());
    }

    pub fn outcome(&mut self) -> Progress<NonCyclicResponse> {
        for _ in 0..200 {
            self.update();
            if let Some(progress) = self.axis.take_outcome() {
                return progress;
            }
        }
        panic!("no outcome");
    }

    pub fn ask(&mut self, request: NonCyclicCommand) -> Progress<NonCyclicResponse> {
        self.until("free", |pair| pair.axis.can_ask());
        self.axis.ask(request).unwrap();
        self.outcome()
    }

    /// The data of the answer on a copy of the pair: what follows is not disturbed.
    pub fn clone_ask(&self, request: NonCyclicCommand) -> Option<i32> {
        let Self { axis, drive, counter, sent, received, wide, now } = *self;
        let mut copy = Self { axis, drive, counter, sent, received, wide, now };
        match copy.ask(request) {
            Progress::Done { value } => value.data(),
            _ => None,
        }
    }

    pub fn run<T: core::fmt::Debug>(&mut self, mut receive: impl FnMut(&mut Axis) -> Progress<T>) -> Progress<T> {
        for _ in 0..3_000 {
            self.update();
            let progress = receive(&mut self.axis);
            if !progress.is_pending() {
                return progress;
            }
        }
        panic!("the procedure does not end");
    }

    pub fn end_of_move(&mut self) -> Progress<CommandEnded> {
        self.run(|axis| axis.take_move().unwrap())
    }
}

/// The actual position, however old it is and in spite of an alarm.
pub fn actual(axis: &Axis) -> i32 {
    let policy = Policy::new(u64::MAX).tolerating(Tolerated::ALARM);
    axis.evidence().at(0, policy).unwrap().position()
}

pub fn monitor(type_code: u8) -> NonCyclicCommand {
    NonCyclicCommand::Monitor(Arguments { type_code: TypeCode::short(type_code), index: 0, data: 0 })
}

pub fn alarm(type_code: TypeCode, index: u16) -> NonCyclicCommand {
    NonCyclicCommand::Alarm(Arguments { type_code, index, data: 0 })
}

pub fn set_position(type_code: u8, position: i32) -> NonCyclicCommand {
    NonCyclicCommand::Homing {
        type_code,
        latch_sel1: Nibble::ZERO,
        latch_sel2: Nibble::ZERO,
        monitor_sel: 0,
        setting_data: position,
    }
}
