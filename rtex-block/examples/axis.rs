//! What a machine does with one axis: text, parameters, position set, motion by the host and by the drive, latches, an alarm.
//!
//! `cargo run -p rtex-block --example axis`
#![allow(clippy::std_instead_of_core, reason = "a program for a host")]

use core::fmt::Debug;
use core::num::NonZeroU16;

use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::master::procedure::{
    AlarmAttributes, AlarmHistory, Backup, ClearAlarm, ClearableIf, Home, Latch, ParameterValue, ReadText, Restore,
    SetPosition,
};
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, CommandCounter, Heard, Limits, Progress, Turn};
use rtex_block::type_code::{Pr, monitor, parameter, profile, system_id};
use rtex_block::{
    Alarm, Arguments, ControlBits, MacId, Nibble, NonCyclicCommand, Policy, Response32, StatusFlags, SubCode,
};

/// An update period.
const UPDATE_NS: u64 = 500_000;

/// An axis, its drive, and a perfect line between them, in blocks of 32 bytes.
struct Machine {
    axis: Axis,
    drive: Drive,
    counter: CommandCounter,
    sent: Turn,
    received: Heard,
    now_ns: u64,
}

impl Machine {
    /// One update period.
    fn update(&mut self) {
        self.now_ns += UPDATE_NS;
        self.axis.hear(self.sent, &self.received, self.now_ns);
        self.sent = self.counter.next();
        let command = self.axis.transmission(self.sent);
        self.received = Response32::parse(&self.drive.hear(&command.emit()).unwrap()).into();
    }

    /// The actual position, if it is good for control: at most one update period old.
    fn position(&self) -> Result<i32, String> {
        let sample = self.axis.evidence().at(self.now_ns, Policy::new(UPDATE_NS));
        sample.map(|sample| sample.position()).map_err(|doubt| doubt.to_string())
    }

    fn until(&mut self, done: impl Fn(&Self) -> bool) -> Result<(), String> {
        let limit = 10_000;
        for _ in 0..limit {
            if done(self) {
                return Ok(());
            }
            self.update();
        }
        Err(format!("not reached within {limit} update periods: the axis is {}", self.axis.state()))
    }

    /// Runs a procedure to its end.
    fn run<T: Debug>(&mut self, mut receive: impl FnMut(&mut Axis) -> Progress<T>) -> Result<T, String> {
        loop {
            self.update();
            match receive(&mut self.axis) {
                Progress::Pending { .. } => {}
                Progress::Done { value } => return Ok(value),
                Progress::Failed { error } => return Err(error.to_string()),
            }
        }
    }

    fn ask(&mut self, request: NonCyclicCommand) -> Result<i32, String> {
        self.until(|machine| machine.axis.can_ask())?;
        self.axis.ask(request).map_err(|error| error.to_string())?;
        let answer = self.run(|axis| axis.take_outcome().unwrap_or(Progress::Pending { left: 0 }))?;
        Ok(answer.data().unwrap_or(0))
    }

    fn switch_on(&mut self) -> Result<(), String> {
        self.until(|machine| machine.axis.can_switch_on().is_ok())?;
        self.axis.switch_on().map_err(|error| error.to_string())?;
        self.until(|machine| machine.axis.state() == AxisState::On)
    }
}

fn main() -> Result<(), String> {
    let mac_id = MacId::new(5).unwrap_or_default();
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(7), 100).with_ready(400);
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits).with_max_speed(Some(5_000_000));
    // A drive that takes its time.
    let behaviour = Behaviour::new().with_stale_answers(2).with_in_progress_late(6).with_latch_late(3);
    let mut machine = Machine {
        axis: Axis::new(config),
        drive: Drive::new(DriveConfig::new(mac_id, OpenCodes::INVENTED)),
        counter: CommandCounter::new(4),
        sent: Turn::Invalid,
        received: Heard::Nothing,
        now_ns: 0,
    };
    machine.drive.set_behaviour(behaviour);
    machine.until(|machine| machine.axis.state() == AxisState::Off)?;
    set_up(&mut machine)?;
    machine.switch_on()?;
    by_the_host(&mut machine)?;
    by_the_drive(&mut machine)?;
    at_a_speed(&mut machine)?;
    an_alarm(&mut machine)?;
    what_goes_wrong(&mut machine)
}

/// With the servo off: who is there, its parameters, and its position.
fn set_up(machine: &mut Machine) -> Result<(), String> {
    let mut text = ReadText::new(system_id::VENDOR_NAME);
    let vendor = machine.run(|axis| text.receive(axis))?;
    let mut text = ReadText::new(system_id::DEVICE_TYPE);
    let kind = machine.run(|axis| text.receive(axis))?;
    let kind = system_id::device_type(kind.as_bytes()).unwrap_or("unknown");
    println!("vendor {}, device type {kind}", String::from_utf8_lossy(vendor.as_bytes()));
    let mut list = [1, 4].map(|number| ParameterValue::new(Pr { class: 8, number }, 0));
    let mut backup = Backup::new(OpenCodes::INVENTED.parameter_read);
    machine.run(|axis| backup.receive(axis, &mut list))?;
    println!("parameters {}, {}", list[0], list[1]);
    list[1].value = 2_000;
    let mut restore = Restore::new(OpenCodes::INVENTED.parameter_read);
    machine.run(|axis| restore.receive(axis, &list))?;
    let feed = Pr { class: 7, number: 35 }.index();
    machine.ask(NonCyclicCommand::Parameter(Arguments { type_code: parameter::WRITE, index: feed, data: 1 }))?;
    let mut set = SetPosition::actual(50_000);
    println!("position set to {}", machine.run(|axis| set.receive(axis))?);
    Ok(())
}

/// Cyclic position with velocity feed-forward, while a latch waits and a sub-command reads the speed.
fn by_the_host(machine: &mut Machine) -> Result<(), String> {
    let mut latch = Latch::both(OpenCodes::INVENTED.latch_arm, [Nibble::ZERO; 2], 2_000);
    let mut caught = Progress::Pending { left: 0 };
    let mut fastest = 0;
    for k in 0..400 {
        let position = machine.axis.setpoint().wrapping_add(100);
        machine.axis.set_position(position).map_err(|error| error.to_string())?;
        machine.axis.set_feed_forward(200_000).map_err(|error| error.to_string())?;
        if let 100 | 200 = k {
            machine.drive.trigger(k / 100);
        }
        // Busy until the one before is answered.
        let _ = machine.axis.ask_sub(SubCode::Monitor, 0x05, 0);
        machine.update();
        if caught.is_pending() {
            caught = latch.receive(&mut machine.axis);
        }
        if let Some(Progress::Done { value }) = machine.axis.take_sub_outcome() {
            fastest = fastest.max(value.data1);
        }
    }
    println!("latched {:?}, at most {fastest} command units/s, now at {}", latch.caught(), machine.position()?);
    machine.axis.set_feed_forward(0).map_err(|error| error.to_string())?;
    let deviation = Arguments { type_code: monitor::PERR, index: 0, data: 0 };
    println!("deviation {}", machine.ask(NonCyclicCommand::Monitor(deviation))?);
    machine.until(|machine| machine.axis.status().contains(StatusFlags::IN_POSITION) && machine.axis.can_ask())
}

/// Profile position: a motion that gets slower on the way, and homing.
fn by_the_drive(machine: &mut Machine) -> Result<(), String> {
    machine.axis.set_mode(ActiveCode::ProfilePosition).map_err(|error| error.to_string())?;
    machine.axis.start_move(profile::RELATIVE, 100_000, 1_000_000).map_err(|error| error.to_string())?;
    machine.until(|machine| machine.position().is_ok_and(|position| position > 150_000))?;
    machine.axis.set_move_speed(200_000).map_err(|error| error.to_string())?;
    let ended = machine.run(|axis| axis.take_move().unwrap_or(Progress::Pending { left: 0 }))?;
    println!("motion ended at {}, in position: {}", machine.position()?, ended.in_position);
    let mut home = Home::new(OpenCodes::INVENTED.homing, 4_000);
    machine.run(|axis| home.receive(axis))?;
    println!("homed, {} from the origin", machine.position()?);
    machine.until(|machine| machine.axis.can_ask())
}

/// Cyclic velocity, with an output of the drive switched, and feed-forward in the sub block.
fn at_a_speed(machine: &mut Machine) -> Result<(), String> {
    machine.axis.set_mode(ActiveCode::CyclicVelocity).map_err(|error| error.to_string())?;
    machine.axis.set_control(ControlBits::EX_OUT1);
    machine.axis.set_sub_feed_forward(0, 0).map_err(|error| error.to_string())?;
    for speed in [500_000, -500_000, 0] {
        machine.axis.set_rate(speed).map_err(|error| error.to_string())?;
        (0..200).for_each(|_| machine.update());
        println!("at {} with {speed} command units/s", machine.position()?);
    }
    Ok(())
}

/// A servo that drops out, main power that goes, a warning and an input: what a test bench can do to the modelled drive.
fn what_goes_wrong(machine: &mut Machine) -> Result<(), String> {
    machine.drive.set_warning(0xa0);
    machine.drive.set_inputs(StatusFlags::HOME.to_bytes()[1]);
    machine.drive.set_fault(Fault::ServoDrop);
    machine.until(|machine| machine.axis.state() != AxisState::On)?;
    println!("{} [{}]", machine.axis.state(), machine.axis.status());
    machine.axis.clear();
    machine.switch_on()?;
    machine.drive.set_fault(Fault::NoMainPower);
    machine.until(|machine| machine.axis.state() != AxisState::On)?;
    println!("{}", machine.axis.state());
    machine.drive.set_fault(Fault::None);
    // From now on it does not take its time.
    machine.drive.set_behaviour(Behaviour::new());
    machine.axis.clear();
    machine.switch_on()
}

fn an_alarm(machine: &mut Machine) -> Result<(), String> {
    machine.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    machine.until(|machine| matches!(machine.axis.state(), AxisState::Stopped(_)))?;
    println!("{}", machine.axis.state());
    let mut attributes = AlarmAttributes::new(OpenCodes::INVENTED.alarm_attributes);
    let attributes = machine.run(|axis| attributes.receive(axis))?;
    // The bit is in the manual of a drive; this one's is invented as its type codes are.
    println!("{attributes:?}, clearable: {}", attributes.is_clearable(ClearableIf::Set(0x01)));
    machine.until(|machine| machine.axis.can_ask())?;
    let (mut history, mut entries) =
        (AlarmHistory::new(OpenCodes::INVENTED.alarm_history), [Alarm { main: 0, sub: 0 }; 2]);
    machine.run(|axis| history.receive(axis, &mut entries))?;
    println!("history {}", entries[0]);
    let mut clear = ClearAlarm::new(OpenCodes::INVENTED.alarm_clear, 100);
    println!("{:?}", machine.run(|axis| clear.receive(axis))?);
    machine.axis.clear();
    machine.switch_on()?;
    println!("{} again, {} blocks good", machine.axis.state(), machine.axis.counters().good());
    Ok(())
}
