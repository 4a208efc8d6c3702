mod service;

use service::{Job, text};

use super::check::{Verdict, check};
use super::config::DriveConfig;
use super::motion::{Drivemode, Motion};
use super::parameters::{ACCELERATION, DECELERATION, Parameters, RESPONSE_DATA, SPEED_UNIT, SUB_RESPONSE_DATA};
use super::profile::Ramp;
use crate::block::{BlockSize, LEN, LEN32};
use crate::code::{Code, CyclicCode};
use crate::command::CommandBlock;
use crate::control::ControlBits;
use crate::error_code::{Alarm, ErrorCode};
use crate::execution::Execution;
use crate::header::{Header, UpdateCounter};
use crate::noncyclic_command::NonCyclicCommand;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{Response32, SubCode, SubCommand, SubResponse, split32};
use crate::type_code::{Nibble, Pr, TypeCode};

/// A model of a drive: every exchange takes a command block and gives a response block.
///
/// The response to command N carries the counter of command N and everything else as it was after command N - 1,
/// so the echo of a code comes one command later than the echo of the counter. Blocks with a fault in header or
/// cyclic code are thrown away and the command before stays in force; if that lasts the drive raises Err86.
///
/// The motor follows its command position as a first-order lag; that is a model for tests, not for tuning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Drive {
    config: DriveConfig,
    parameters: Parameters,
    motion: Motion,
    alarm: Option<Alarm>,
    history: [Option<Alarm>; 14],
    warning: u16,
    homed: bool,
    latches: [Option<i32>; 2],
    main_power: bool,
    inputs: StatusFlags,
    /// The command in force.
    cyclic: CyclicCode,
    control: ControlBits,
    data1: i32,
    target_speed: i32,
    /// What the next response echoes.
    echo: Code,
    error: Option<ErrorCode>,
    job: Option<Job>,
    sub: SubResponse,
    /// Supervision.
    exchanges: u16,
    faults: u16,
    lost: u16,
    counter: Option<UpdateCounter>,
    repeats: u8,
    wrong_counts: u16,
    communication: u8,
}

impl Drive {
    /// A drive that has just got control power; main power is on, and nothing has been received.
    pub const fn new(config: DriveConfig) -> Self {
        Self {
            config,
            parameters: Parameters::DEFAULT,
            motion: Motion::new(),
            alarm: None,
            history: [None; 14],
            warning: 0,
            homed: false,
            latches: [None; 2],
            main_power: true,
            inputs: StatusFlags::empty(),
            cyclic: CyclicCode::Nop,
            control: ControlBits::empty(),
            data1: 0,
            target_speed: 0,
            echo: Code::NOP,
            error: None,
            job: None,
            sub: SubResponse {
                cmd_error: false,
                execution: Execution::empty(),
                code: Nibble::ZERO,
                type_code: 0,
                index: 0,
                data1: 0,
                data2: 0,
                data3: 0,
            },
            exchanges: 0,
            faults: 0,
            lost: 0,
            counter: None,
            repeats: 0,
            wrong_counts: 0,
            communication: 0,
        }
    }

    /// One exchange in the 16-byte mode.
    pub fn exchange(&mut self, command: &[u8; LEN]) -> [u8; LEN] {
        let response = self.response(command[0]).emit();
        self.receive(command, BlockSize::Bytes16);
        response
    }

    /// One exchange in the 32-byte mode.
    pub fn exchange32(&mut self, command: &[u8; LEN32]) -> [u8; LEN32] {
        let [_, data2, data3] = SUB_RESPONSE_DATA.map(|pr| self.selected(pr, 0));
        let sub = SubResponse { data2, data3, ..self.sub };
        let response = Response32 { main: self.response(command[0]), sub }.emit();
        self.receive(command, BlockSize::Bytes32);
        response
    }

    /// A communication period in which no frame came.
    pub fn miss(&mut self) {
        self.lost = self.lost.saturating_add(1);
        if self.lost == self.config.lost_limit {
            self.raise(self.config.codes.communication_lost);
            self.exchanges = 0;
            self.counter = None;
        }
        self.tick();
    }

    /// Servo_Active: the motor is energised.
    pub const fn is_active(&self) -> bool {
        self.motion.is_active()
    }

    /// APOS, command units.
    pub const fn position(&self) -> i32 {
        self.motion.actual
    }

    /// The active alarm.
    pub const fn alarm(&self) -> Option<Alarm> {
        self.alarm
    }

    /// How it was set up.
    pub const fn config(&self) -> &DriveConfig {
        &self.config
    }

    /// Raises an alarm: the motor is released at once. An alarm that is already there stays.
    pub fn raise(&mut self, alarm: Alarm) {
        if self.alarm.is_none() {
            self.alarm = Some(alarm);
            self.history.rotate_right(1);
            self.history[0] = Some(alarm);
        }
        self.motion.release();
    }

    /// Clears the active alarm and the counts that lead to the next.
    pub fn clear_alarm(&mut self) {
        self.alarm = None;
        self.faults = 0;
        self.wrong_counts = 0;
    }

    /// Switches main power; without it the drive is not ready.
    pub fn set_main_power(&mut self, on: bool) {
        self.main_power = on;
        if !on {
            self.motion.release();
        }
    }

    /// Puts a warning; 0 for none.
    pub const fn set_warning(&mut self, warning: u16) {
        self.warning = warning;
    }

    /// Puts the inputs that byte 3 of a response shows.
    pub const fn set_inputs(&mut self, inputs: StatusFlags) {
        let [_, high] = inputs.to_bytes();
        self.inputs = StatusFlags::from_bytes([0, high]);
    }

    /// Catches the actual position in LPOS1, as the trigger of latch 1 does.
    pub const fn catch_latch1(&mut self) {
        self.latches[0] = Some(self.motion.actual);
    }

    /// Catches the actual position in LPOS2, as the trigger of latch 2 does.
    pub const fn catch_latch2(&mut self) {
        self.latches[1] = Some(self.motion.actual);
    }

    /// Servo_Ready: main power, no alarm, synchronised.
    pub const fn is_ready(&self) -> bool {
        self.main_power && self.alarm.is_none() && self.exchanges >= self.config.sync_exchanges
    }

    fn status(&self) -> StatusFlags {
        let progress = self.motion.profile.is_some();
        let settled = self.motion.deviation().unsigned_abs() <= self.config.in_position;
        let set = [
            (StatusFlags::SERVO_ACTIVE, self.is_active()),
            (StatusFlags::SERVO_READY, self.is_ready()),
            (StatusFlags::ALARM, self.alarm.is_some()),
            (StatusFlags::WARNING, self.warning != 0),
            (StatusFlags::TORQUE_LIMITED, self.motion.torque_limited),
            (StatusFlags::HOMING_COMPLETE, self.homed),
            (StatusFlags::IN_PROGRESS, progress),
            (StatusFlags::IN_POSITION, settled && !progress),
        ];
        set.into_iter().fold(self.inputs, |all, (flag, on)| if on { all.union(flag) } else { all })
    }

    /// The response while the block with this byte 0 comes in: its counter, everything else as it was before.
    fn response(&self, byte0: u8) -> Response {
        let [response_data1, ..] = self.response_data();
        Response {
            mac_id: self.config.mac_id,
            update_counter_echo: Header::from_byte(byte0).update_counter,
            cmd_error: false,
            code: self.echo,
            status: self.status(),
            response_data1,
            response_data2: 0,
            response_data3: 0,
        }
        .with_noncyclic(&self.noncyclic())
    }

    /// Response_Data1 to 3 as Pr7.29 to 7.31 select them.
    fn response_data(&self) -> [i32; 3] {
        let defaults = [self.motion.actual, self.speed(self.motion.actual_step), self.motion.torque];
        let [one, two, three] = RESPONSE_DATA;
        [self.selected(one, defaults[0]), self.selected(two, defaults[1]), self.selected(three, defaults[2])]
    }

    fn selected(&self, pr: Pr, default: i32) -> i32 {
        match u8::try_from(self.parameters.value(pr)) {
            Ok(0) => default,
            Ok(code) => self.monitor(TypeCode::short(code), 0).unwrap_or(0),
            Err(_) => 0,
        }
    }

    /// A step per update period as a speed in the unit of Pr7.25.
    fn speed(&self, step: i32) -> i32 {
        let scale = if self.parameters.value(SPEED_UNIT) == 0 { 60_000_000_000 } else { 1_000_000_000 };
        let per = if self.parameters.value(SPEED_UNIT) == 0 { self.config.units_per_rev } else { 1 };
        let divisor = i128::from(self.config.update_ns).saturating_mul(per.into());
        let speed = i128::from(step).saturating_mul(scale).checked_div(divisor).unwrap_or(0);
        i32::try_from(speed).unwrap_or(if speed < 0 { i32::MIN } else { i32::MAX })
    }

    /// A speed in the unit of Pr7.25 as command units per second.
    fn units_per_second(&self, speed: i32) -> i64 {
        let speed = i64::from(speed);
        if self.parameters.value(SPEED_UNIT) == 0 {
            speed.saturating_mul(self.config.units_per_rev.into()) / 60
        } else {
            speed
        }
    }

    fn is_near(&self) -> bool {
        let to_go = self.motion.profile.map_or(0, |generator| generator.distance_to_go());
        to_go.unsigned_abs() <= self.config.near.into()
    }

    fn receive(&mut self, bytes: &[u8], size: BlockSize) {
        self.lost = 0;
        self.exchanges = self.exchanges.saturating_add(1);
        let verdict = check(bytes, size, self.config.mac_id);
        if let Some(alarm) = verdict.alarm {
            self.discard(bytes, verdict, alarm);
        } else if let Some(main) = bytes.first_chunk::<LEN>() {
            if let Ok(block) = CommandBlock::of(main) {
                self.accept(block, verdict.error);
            }
            if let Ok((_, sub)) = split32(bytes) {
                self.serve_sub(sub, verdict.sub_error);
            }
        }
        self.tick();
    }

    /// The block is thrown away; an undefined code is echoed as it came.
    fn discard(&mut self, bytes: &[u8], verdict: Verdict, alarm: Alarm) {
        if let (Some(_), Some(&byte1)) = (verdict.error, bytes.get(1)) {
            self.echo = Code::truncate(byte1);
            self.error = verdict.error;
        }
        if let (Some(code), Ok((_, sub))) = (verdict.sub_error, split32(bytes)) {
            self.refuse_sub(sub, code);
        }
        self.count_fault(alarm);
    }

    fn count_fault(&mut self, alarm: Alarm) {
        self.faults = self.faults.saturating_add(1);
        if self.faults >= self.config.fault_limit && self.exchanges >= self.config.sync_exchanges {
            self.raise(alarm);
        }
    }

    fn accept(&mut self, block: CommandBlock<'_>, error: Option<ErrorCode>) {
        let before = core::mem::replace(&mut self.echo, block.code());
        self.error = error;
        let Some(cyclic) = block.code().cyclic() else { return };
        if error.is_none() && !block.code().is_allowed() {
            self.error = Some(ErrorCode::CYCLIC_MODE);
            return self.count_fault(Alarm::COMMAND);
        }
        self.faults = 0;
        if cyclic == CyclicCode::Nop {
            // The command before stays in force; Control_Bits are not looked at.
            self.job = None;
            return;
        }
        self.supervise(block.update_counter());
        self.cyclic = cyclic;
        self.control = block.control();
        self.data1 = block.command_data1();
        self.motion.request(self.control.contains(ControlBits::SERVO_ON) && self.is_ready(), &self.config);
        let Some(noncyclic) = block.code().noncyclic() else { return };
        let request = NonCyclicCommand::from_bytes(noncyclic, block.noncyclic_bytes());
        if let NonCyclicCommand::Profile { target_speed, .. } = request {
            self.target_speed = target_speed;
        }
        self.error = self.serve(request, before).err();
    }

    /// The counter adds 1 in every update period; with two communications in it every value comes twice.
    fn supervise(&mut self, counter: UpdateCounter) {
        let last = self.counter.replace(counter);
        let allowed = self.config.communications.saturating_sub(1);
        let good = match last {
            None => true,
            Some(last) if counter == last => self.repeats < allowed,
            Some(last) => counter == last.next(),
        };
        self.repeats = if last == Some(counter) { self.repeats.saturating_add(1) } else { 0 };
        self.wrong_counts = if good { 0 } else { self.wrong_counts.saturating_add(1) };
        if self.wrong_counts >= self.config.counter_limit && self.exchanges >= self.config.sync_exchanges {
            self.raise(Alarm::UPDATE_COUNTER);
        }
    }

    fn serve_sub(&mut self, sub: &[u8; LEN], error: Option<ErrorCode>) {
        if let Some(code) = error {
            return self.refuse_sub(sub, code);
        }
        let Ok(command) = SubCommand::from_bytes(sub) else { return };
        let [data, ..] = SUB_RESPONSE_DATA.map(|pr| self.selected(pr, 0));
        let result = match command.code {
            SubCode::Normal => Ok(data),
            SubCode::SystemId => text(TypeCode::short(command.type_code), command.index),
            SubCode::Monitor => self.monitor(TypeCode::short(command.type_code), command.index),
        };
        match result {
            Ok(data1) => {
                self.sub = SubResponse {
                    cmd_error: false,
                    code: Nibble::truncate(command.code as u8),
                    type_code: command.type_code,
                    index: command.index,
                    data1,
                    ..self.sub
                }
            }
            Err(code) => self.refuse_sub(sub, code),
        }
    }

    fn refuse_sub(&mut self, sub: &[u8; LEN], code: ErrorCode) {
        self.sub = SubResponse {
            cmd_error: true,
            code: Nibble::truncate(sub[0]),
            type_code: 0,
            index: code.0,
            data1: 0,
            ..self.sub
        };
    }

    /// The end of a communication period; at the end of an update period the axis moves.
    fn tick(&mut self) {
        self.communication = self.communication.saturating_add(1);
        if self.communication < self.config.communications {
            return;
        }
        self.communication = 0;
        let acceleration = |pr| i64::from(self.parameters.value(pr).max(1)).saturating_mul(10_000);
        let ramp = Ramp { up: acceleration(ACCELERATION), down: acceleration(DECELERATION) };
        let per_update = |speed: i32| {
            let units = self.units_per_second(speed).saturating_mul(self.config.update_ns.into()) / 1_000_000_000;
            i32::try_from(units).unwrap_or(if units < 0 { i32::MIN } else { i32::MAX })
        };
        let mode = match self.cyclic {
            CyclicCode::Nop | CyclicCode::ProfilePosition => Drivemode::Profile,
            CyclicCode::CyclicPosition => Drivemode::Position(self.data1),
            CyclicCode::CyclicVelocity => Drivemode::Velocity(per_update(self.data1)),
            CyclicCode::CyclicTorque => Drivemode::Torque(self.data1),
        };
        let (hard, smooth) =
            (self.control.contains(ControlBits::HARD_STOP), self.control.contains(ControlBits::SMOOTH_STOP));
        if mode == Drivemode::Profile && (hard || smooth) && self.motion.is_active() {
            return self.motion.stop_profile(!hard, ramp, &self.config);
        }
        let speed = if self.control.contains(ControlBits::PAUSE) {
            0
        } else {
            self.units_per_second(self.target_speed).saturating_abs()
        };
        if !self.motion.update(mode, ramp, speed, &self.config) {
            self.raise(Alarm::COMMAND_STEP);
        }
    }
}
