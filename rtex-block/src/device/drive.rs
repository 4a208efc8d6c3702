mod execute;
mod job;
mod sub_block;

use job::Job;

use super::behaviour::{Behaviour, Quirks};
use super::check::{Verdict, check};
use super::config::DriveConfig;
use super::fault::Fault;
use super::literals::{
    CP, CT, CV, ERR27_4, ERR86_2, ERR91_1, HARD_STOP, NON_CYCLIC, NOP, PAUSE, PP, PROFILE, PROFILE_IDLE, SERVO_ON,
    SHOWN_ACTIVE, SHOWN_ALARM, SHOWN_E_STOP, SHOWN_HOMED, SHOWN_IN_POSITION, SHOWN_IN_PROGRESS, SHOWN_READY,
    SHOWN_TORQUE_LIMITED, SHOWN_WARNING, SMOOTH_STOP, WRONG_MODE,
};
use super::motion::{Drivemode, Motion};
use super::parameters::{ACCELERATION, DECELERATION, Parameters, RESPONSE_DATA, SPEED_UNIT, SUB_RESPONSE_DATA};
use super::profile::Ramp;
use super::wire::{Block, Request, Sub};
use crate::block::{BlockSize, LEN, LEN32};
use crate::command::Command;
use crate::error_code::Alarm;
use crate::response::Response;

/// Command units per second.
const HOMING_SPEED: i64 = 1_000_000;

/// A model of a drive: in every communication period it receives a command block and returns a response block.
///
/// The response to command N carries the counter of command N and everything else as it was after command N - 1,
/// so the echo of a code comes one command later than the echo of the counter. Blocks with a fault in header or cyclic code
/// are discarded and the previous command stays in force; if that lasts, the drive raises Err86.
///
/// It shares neither constants nor code with the master: blocks are read and written byte by byte. Its [`Behaviour`] says how
/// late, forgetful and literal it is, and its [`Fault`] says what goes wrong. The motor follows its command position as a
/// first-order lag; that is a model for tests, not for tuning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Drive {
    config: DriveConfig,
    behaviour: Behaviour,
    fault: Fault,
    parameters: Parameters,
    motion: Motion,
    alarm: Option<Alarm>,
    history: [Option<Alarm>; 14],
    warning: u16,
    homed: bool,
    latches: [Option<i32>; 2],
    armed: [bool; 2],
    homing: bool,
    feed_forward: i32,
    sub_feed_forward: [i32; 2],
    /// Byte 3 of a response.
    inputs: u8,
    /// Byte 2 of the responses, and Latch_Comp, as they would have been without delay; the latest first.
    shown: [u8; 16],
    comp: [u8; 16],
    /// Latch_Comp as in the next response.
    latched: u8,
    /// The command in force: cyclic code, Control_Bits, Command_Data1.
    cyclic: u8,
    control: u16,
    data1: i32,
    target_speed: i32,
    /// What the next response echoes.
    echo: u8,
    /// Byte 1 of the last block taken; discarded blocks are not included.
    taken: u8,
    error: Option<u16>,
    job: Option<Job>,
    /// The previous request, whose echoes linger, and the number of answers for which they do.
    stale: Option<(Request, u16)>,
    sub: Sub,
    /// The response sent last.
    last: [u8; LEN32],
    /// Responses not sent yet.
    pending: [Block; 3],
    /// Supervision.
    exchanges: u16,
    faults: u16,
    lost: u16,
    counter: Option<u8>,
    repeats: u8,
    wrong_counts: u16,
    communication: u8,
}

impl Drive {
    /// Creates a drive whose control power has just come on; main power is on, and nothing has been received.
    pub const fn new(config: DriveConfig) -> Self {
        let silent = Block::new(config.mac_id.get(), NOP, [0; 2], 0, [0; 8]);
        Self {
            config,
            behaviour: Behaviour::new(),
            fault: Fault::None,
            parameters: Parameters::DEFAULT,
            motion: Motion::new(),
            alarm: None,
            history: [None; 14],
            warning: 0,
            homed: false,
            latches: [None; 2],
            armed: [false; 2],
            homing: false,
            feed_forward: 0,
            sub_feed_forward: [0; 2],
            inputs: 0,
            shown: [0; 16],
            comp: [0; 16],
            latched: 0,
            cyclic: NOP,
            control: 0,
            data1: 0,
            target_speed: 0,
            echo: NOP,
            taken: NOP,
            error: None,
            job: None,
            stale: None,
            sub: Sub::Done(0, 0, 0, 0),
            last: [0; LEN32],
            pending: [silent; 3],
            exchanges: 0,
            faults: 0,
            lost: 0,
            counter: None,
            repeats: 0,
            wrong_counts: 0,
            communication: 0,
        }
    }

    /// Makes one exchange: takes a command block of 16 or 32 bytes and returns the response; `None` if the drive is silent.
    /// A block of any other size does not compile.
    ///
    /// ```compile_fail,E0080
    /// # use rtex_block::{MacId, device::{Drive, DriveConfig, OpenCodes}};
    /// let mut drive = Drive::new(DriveConfig::new(MacId::truncate(0), OpenCodes::INVENTED));
    /// drive.hear(&[0; 17]);
    /// ```
    pub fn hear<const N: usize>(&mut self, command: &[u8; N]) -> Option<[u8; N]> {
        const { assert!(N == LEN || N == LEN32, "a block has 16 or 32 bytes") };
        match self.fault {
            Fault::Silent => {
                self.framing_error();
                return None;
            }
            Fault::StaleEcho => return self.last.first_chunk().copied(),
            _ => {}
        }
        let (main, sub) = (command.first_chunk::<LEN>()?, command.get(LEN..)?.first_chunk::<LEN>());
        let mut response = self.response(main[0]);
        if let Fault::WrongMacId(other) = self.fault {
            response[0] = response[0] & 0xe0 | other.get();
        }
        if let Some(half) = self.last.first_chunk_mut() {
            *half = response;
        }
        if sub.is_some() {
            let [_, data2, data3] = SUB_RESPONSE_DATA.map(|pr| self.selected(pr, 0));
            let half = self.sub.emit(data2, data3);
            if let Some(place) = self.last.last_chunk_mut() {
                *place = half;
            }
        }
        let size = if sub.is_some() { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
        self.receive(main, sub.copied(), check(command, size, self.config.mac_id));
        self.last.first_chunk().copied()
    }

    /// Like [`hear`](Self::hear), with messages instead of bytes.
    pub fn answer(&mut self, command: &Command) -> Option<Response> {
        Response::parse(&self.hear(&command.emit())?).ok()
    }

    /// Passes a communication period in which no frame came, or a damaged one.
    pub fn framing_error(&mut self) {
        self.lost = self.lost.saturating_add(1);
        if self.lost == self.config.lost_limit {
            self.raise(self.config.codes.communication_lost);
            self.exchanges = 0;
            self.counter = None;
        }
        self.tick();
    }

    /// Returns whether the motor is energised. Servo_Active may stay set for longer.
    pub const fn is_active(&self) -> bool {
        self.motion.is_active()
    }

    /// APOS, command units.
    pub const fn position(&self) -> i32 {
        self.motion.actual
    }

    /// The feed-forward in force, from Command_Data3.
    pub const fn feed_forward(&self) -> i32 {
        self.feed_forward
    }

    /// The feed-forward in force, from Sub_Command_Data2 and 3.
    pub const fn sub_feed_forward(&self) -> [i32; 2] {
        self.sub_feed_forward
    }

    /// The active alarm.
    pub const fn alarm(&self) -> Option<Alarm> {
        self.alarm
    }

    /// Returns its configuration.
    pub const fn config(&self) -> &DriveConfig {
        &self.config
    }

    /// Sets its behaviour from now on.
    pub const fn set_behaviour(&mut self, behaviour: Behaviour) {
        self.behaviour = behaviour;
        if self.exchanges == 0 {
            self.homed = behaviour.does(Quirks::HOMED_AT_START);
        }
    }

    /// Sets its fault from now on, replacing the previous one.
    pub fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
        match fault {
            Fault::Alarm(alarm) => self.raise(alarm),
            Fault::NoMainPower | Fault::ServoDrop | Fault::EmergencyStop => self.motion.release(0),
            Fault::None | Fault::Silent | Fault::StaleEcho | Fault::WrongMacId(_) => {}
        }
    }

    /// Raises an alarm: the motor is released at once. An alarm that is already active stays.
    fn raise(&mut self, alarm: Alarm) {
        if self.alarm.is_none() {
            self.alarm = Some(alarm);
            self.history.rotate_right(1);
            self.history[0] = Some(alarm);
        }
        self.homed &= !self.behaviour.does(Quirks::UNHOMED_BY_ALARM);
        self.motion.release(0);
    }

    /// Clears the active alarm and the counts that lead to the next one.
    pub fn clear_alarm(&mut self) {
        self.alarm = None;
        self.faults = 0;
        self.wrong_counts = 0;
    }

    /// Sets a warning; 0 for none.
    pub const fn set_warning(&mut self, warning: u16) {
        self.warning = warning;
    }

    /// Sets the inputs shown in byte 3 of a response.
    pub const fn set_inputs(&mut self, byte3: u8) {
        self.inputs = byte3;
    }

    /// Triggers latch 1 or 2: catches the actual position, if the latch is armed.
    pub fn trigger(&mut self, latch: usize) {
        let actual = self.motion.actual;
        let places = self.armed.iter_mut().zip(&mut self.latches);
        if let Some((armed, caught)) = places.take(latch).last().filter(|(armed, _)| **armed) {
            *armed = false;
            *caught = Some(actual);
        }
    }

    /// Servo_Ready: main power is on, there is no alarm, and the drive is synchronised.
    const fn is_ready(&self) -> bool {
        !matches!(self.fault, Fault::NoMainPower | Fault::EmergencyStop)
            && self.alarm.is_none()
            && self.exchanges >= self.config.sync_exchanges
    }

    /// Byte 2 without delay.
    fn status(&self) -> u8 {
        let progress = self.motion.in_progress();
        let settled = self.motion.deviation().unsigned_abs() <= self.config.in_position;
        let set = [
            (SHOWN_ACTIVE, self.motion.says_active()),
            (SHOWN_READY, self.is_ready()),
            (SHOWN_ALARM, self.alarm.is_some()),
            (SHOWN_WARNING, self.warning != 0),
            (SHOWN_TORQUE_LIMITED, self.motion.torque_limited),
            (SHOWN_HOMED, self.homed),
            (SHOWN_IN_PROGRESS, progress),
            (SHOWN_IN_POSITION, settled && !progress || self.behaviour.does(Quirks::ALWAYS_IN_POSITION)),
        ];
        set.into_iter().fold(0, |all, (flag, on)| if on { all | flag } else { all })
    }

    /// Byte 2 as shown in this response: each bit is delayed by its own number of exchanges.
    fn shown(&mut self) -> u8 {
        let (now, comp) = (self.status(), self.latch_flags());
        for (past, new) in [(&mut self.shown, now), (&mut self.comp, comp)] {
            past.rotate_right(1);
            past[0] = new;
        }
        let ago = |past: &[u8; 16], late: u8| past.get(usize::from(late)).copied().unwrap_or(past[15]);
        self.latched = ago(&self.comp, self.behaviour.latch_late);
        let bits = self.behaviour.status_late.into_iter().zip(0..8_u32);
        bits.fold(0, |all, (late, bit)| all | ago(&self.shown, late) & 1_u8.wrapping_shl(bit))
    }

    /// Returns the response sent while the block with this byte 0 comes in: it has the block's counter, and everything else
    /// as it was before.
    fn response(&mut self, byte0: u8) -> [u8; LEN] {
        let shown = self.shown();
        let [response_data1, ..] = self.response_data();
        let byte1 = self.echo & 0x7f | if self.error.is_some() { 0x80 } else { 0 };
        let tail = self.noncyclic(shown);
        let inputs = self.inputs | if self.fault == Fault::EmergencyStop { SHOWN_E_STOP } else { 0 };
        let present = Block::new(self.config.mac_id.get(), byte1, [shown, inputs], response_data1, tail);
        self.pending.rotate_right(1);
        let out = match usize::from(self.behaviour.echo_lag).checked_sub(1) {
            None => present,
            // What is rotated to the front is the oldest; shorter lags take a younger one.
            Some(lag) => {
                let [oldest, younger @ ..] = self.pending;
                younger.get(lag).copied().unwrap_or(oldest)
            }
        };
        self.pending[0] = present;
        out.with_counter_of(byte0)
    }

    /// Response_Data1 to 3 as Pr7.29 to 7.31 select them.
    fn response_data(&self) -> [i32; 3] {
        let defaults = [self.motion.actual, self.speed(self.motion.actual_step), self.motion.torque];
        let [one, two, three] = RESPONSE_DATA;
        [self.selected(one, defaults[0]), self.selected(two, defaults[1]), self.selected(three, defaults[2])]
    }

    fn selected(&self, pr: u16, default: i32) -> i32 {
        match u8::try_from(self.parameters.value(pr)) {
            Ok(0) => default,
            Ok(code) => self.monitor(code.into(), 0).unwrap_or(0),
            Err(_) => 0,
        }
    }

    /// Converts a step per update period to a speed in the unit of Pr7.25.
    fn speed(&self, step: i32) -> i32 {
        let scale = if self.parameters.value(SPEED_UNIT) == 0 { 60_000_000_000 } else { 1_000_000_000 };
        let per = if self.parameters.value(SPEED_UNIT) == 0 { self.config.units_per_rev } else { 1 };
        let divisor = i128::from(self.config.update_ns).saturating_mul(per.into());
        let speed = i128::from(step).saturating_mul(scale).checked_div(divisor).unwrap_or(0);
        saturated(speed)
    }

    /// Converts a speed in the unit of Pr7.25 to command units per second.
    fn units_per_second(&self, speed: i32) -> i64 {
        let speed = i64::from(speed);
        if self.parameters.value(SPEED_UNIT) == 0 {
            speed.saturating_mul(self.config.units_per_rev.into()) / 60
        } else {
            speed
        }
    }

    fn receive(&mut self, main: &[u8; LEN], sub: Option<[u8; LEN]>, verdict: Verdict) {
        self.lost = 0;
        self.exchanges = self.exchanges.saturating_add(1);
        let sub_error = verdict.sub_error.map(|code| code.0);
        if let Some(alarm) = verdict.alarm {
            self.discard(main, sub, verdict, alarm);
        } else {
            self.accept(main, verdict.error.map(|code| code.0));
            if let Some(sub) = sub {
                self.serve_sub(sub, sub_error);
            }
        }
        self.tick();
    }

    /// Discards the block; an undefined code is echoed as received.
    fn discard(&mut self, main: &[u8; LEN], sub: Option<[u8; LEN]>, verdict: Verdict, alarm: Alarm) {
        if let Some(code) = verdict.error {
            self.echo = main[1];
            self.error = Some(code.0);
        }
        if let (Some(code), Some([byte16, ..])) = (verdict.sub_error, sub) {
            self.sub = Sub::Refused(byte16 & 0x0f, code.0);
        }
        self.count_fault(alarm);
    }

    fn count_fault(&mut self, alarm: Alarm) {
        self.faults = self.faults.saturating_add(1);
        if self.faults >= self.config.fault_limit && self.exchanges >= self.config.sync_exchanges {
            self.raise(alarm);
        }
    }

    fn accept(&mut self, block: &[u8; LEN], error: Option<u16>) {
        let [byte0, byte1, c2, c3, d4, d5, d6, d7, noncyclic @ ..] = *block;
        let (cyclic, code) = (byte1 >> 4 & 7, byte1 & 0x0f);
        let before = core::mem::replace(&mut self.taken, byte1);
        self.echo = byte1;
        self.error = error;
        let goes_together = if cyclic == NOP { code == 0 } else { code != PROFILE || cyclic == PP };
        if error.is_none() && !goes_together {
            self.error = Some(WRONG_MODE);
            let (main, sub) = ERR91_1;
            return self.count_fault(Alarm { main, sub });
        }
        self.faults = 0;
        if cyclic == NOP {
            // The command before stays in force; Control_Bits are not looked at.
            self.job = None;
            return;
        }
        self.supervise(byte0 >> 5 & 3);
        self.cyclic = cyclic;
        self.control = u16::from_le_bytes([c2, c3]);
        self.data1 = i32::from_le_bytes([d4, d5, d6, d7]);
        let servo_on = self.control & SERVO_ON != 0 && self.is_ready();
        self.motion.request(servo_on, &self.config, self.behaviour.servo_off_late);
        if NON_CYCLIC.contains(&code) {
            let request = Request { code, bytes: noncyclic };
            if code == PROFILE {
                self.target_speed = request.data();
            }
            self.error = self.serve(request, before & 0x7f == PROFILE_IDLE).err();
        }
    }

    /// Checks that the counter advances by 1 in every update period; with two communications per period, every value comes
    /// twice.
    fn supervise(&mut self, counter: u8) {
        let last = self.counter.replace(counter);
        let allowed = self.config.communications.saturating_sub(1);
        let good = match last {
            None => true,
            Some(last) if counter == last => self.repeats < allowed,
            Some(last) => counter == last.wrapping_add(1) & 3,
        };
        self.repeats = if last == Some(counter) { self.repeats.saturating_add(1) } else { 0 };
        self.wrong_counts = if good { 0 } else { self.wrong_counts.saturating_add(1) };
        if self.wrong_counts >= self.config.counter_limit && self.exchanges >= self.config.sync_exchanges {
            let (main, sub) = ERR86_2;
            self.raise(Alarm { main, sub });
        }
    }

    /// Ends a communication period; at the end of an update period the axis moves.
    fn tick(&mut self) {
        self.communication = self.communication.saturating_add(1);
        if self.communication < self.config.communications {
            return;
        }
        self.communication = 0;
        let acceleration = |pr| i64::from(self.parameters.value(pr).max(1)).saturating_mul(10_000);
        let ramp = Ramp { up: acceleration(ACCELERATION), down: acceleration(DECELERATION) };
        let per_update = |speed: i32| {
            let units = i128::from(self.units_per_second(speed)).saturating_mul(self.config.update_ns.into());
            saturated(units / 1_000_000_000)
        };
        let mode = match self.cyclic {
            CP => Drivemode::Position(self.data1),
            CV => Drivemode::Velocity(per_update(self.data1)),
            CT => Drivemode::Torque(self.data1),
            _ => Drivemode::Profile,
        };
        if !self.motion.is_active() {
            self.homed &= !self.behaviour.does(Quirks::UNHOMED_BY_SERVO_OFF);
        }
        let (hard, smooth) = (self.control & HARD_STOP != 0, self.control & SMOOTH_STOP != 0);
        if mode == Drivemode::Profile && (hard || smooth) && self.motion.is_active() {
            self.homing = false;
            return self.motion.stop_profile(!hard, ramp, &self.config);
        }
        let pause = self.control & PAUSE != 0;
        let target = if self.homing { HOMING_SPEED } else { self.units_per_second(self.target_speed) };
        let speed = if pause { 0 } else { target.saturating_abs() };
        if !self.motion.update(mode, ramp, speed, &self.config) {
            let (main, sub) = ERR27_4;
            self.raise(Alarm { main, sub });
        }
        // The origin becomes 0, if it was found.
        if self.homing && self.motion.profile.is_none() {
            self.homing = false;
            if self.motion.is_active() && mode == Drivemode::Profile {
                self.homed = true;
                self.motion.shift(self.motion.command.wrapping_neg());
            }
        }
    }
}

fn saturated(value: i128) -> i32 {
    i32::try_from(value.clamp(i32::MIN.into(), i32::MAX.into())).unwrap_or(0)
}
