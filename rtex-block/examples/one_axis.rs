//! What a machine does with one axis: text, parameters, position set, motion by the host and by the drive, latches, an alarm.
//!
//! `cargo run -p rtex-block --example one_axis`
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::std_instead_of_core,
    reason = "a program for a host"
)]

use core::convert::Infallible;
use core::num::NonZeroU16;
use std::error::Error;

use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::master::procedure::{
    AlarmAttributes, AlarmHistory, Backup, ClearAlarm, ClearableIf, Latch, ParameterValue, ReadText, Restore,
    SetPosition,
};
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, Ended, Heard, Limits, Progress, Ring, Run};
use rtex_block::type_code::{Pr, monitor, parameter, profile, system_id};
use rtex_block::{
    Alarm, Arguments, ControlBits, Doubt, MacId, Nibble, NonCyclicCommand, Policy, Response32, StatusFlags, SubCode,
};

/// An update period.
const UPDATE_NS: u64 = 500_000;

const CODES: OpenCodes = OpenCodes::INVENTED;

type Done = Result<(), Box<dyn Error>>;

/// A ring of one axis, its drive, and a perfect line between them, in blocks of 32 bytes.
struct Machine {
    ring: Ring<1>,
    drive: Drive,
    received: [Heard; 1],
    now_ns: u64,
}

impl Run<1> for Machine {
    type Error = Infallible;

    fn ring_mut(&mut self) -> &mut Ring<1> {
        &mut self.ring
    }

    fn update(&mut self) -> Result<u64, Infallible> {
        self.now_ns = self.now_ns.saturating_add(UPDATE_NS);
        let [command] = self.ring.update(&self.received, self.now_ns);
        let answer = self.drive.hear(&command.emit());
        self.received = [answer.map_or(Heard::Nothing, |block| Response32::parse(&block).into())];
        Ok(self.now_ns)
    }
}

impl Machine {
    fn axis(&mut self) -> &mut Axis {
        let [axis] = self.ring.axes_mut();
        axis
    }

    /// The actual position, if it is good for control: at most one update period old.
    fn position(&mut self) -> Result<i32, Doubt> {
        let now_ns = self.now_ns;
        self.axis().evidence().at(now_ns, Policy::new(UPDATE_NS)).map(|sample| sample.position())
    }
}

fn main() -> Done {
    let mac_id = MacId::new(5).unwrap_or_default();
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(7), 100);
    let config = AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits).with_max_speed(Some(5_000_000));
    let mut machine = Machine {
        ring: Ring::new([Axis::new(config)], 4)?,
        drive: Drive::new(DriveConfig::new(mac_id, CODES)),
        received: [Heard::Nothing],
        now_ns: 0,
    };
    // A drive that takes its time.
    let behaviour = Behaviour::new().with_stale_answers(2).with_in_progress_late(6).with_latch_late(3);
    machine.drive.set_behaviour(behaviour);
    set_up(&mut machine)?;
    machine.switch_on()?;
    by_the_host(&mut machine)?;
    by_the_drive(&mut machine)?;
    at_a_speed(&mut machine)?;
    an_alarm(&mut machine)?;
    what_goes_wrong(&mut machine)
}

/// With the servo off: who is there, its parameters, and its position.
fn set_up(machine: &mut Machine) -> Done {
    let vendor = machine.procedure(0, ReadText::new(system_id::VENDOR_NAME))?;
    let kind = machine.procedure(0, ReadText::new(system_id::DEVICE_TYPE))?;
    let kind = system_id::device_type(kind.as_bytes()).unwrap_or("unknown");
    println!("vendor {}, device type {kind}", String::from_utf8_lossy(vendor.as_bytes()));
    let mut list = [1, 4].map(|number| ParameterValue::new(Pr { class: 8, number }, 0));
    machine.procedure(0, Backup::new(CODES.parameter_read, &mut list))?;
    println!("parameters {}, {}", list[0], list[1]);
    list[1].value = 2_000;
    machine.procedure(0, Restore::new(CODES.parameter_read, &list))?;
    let feed = Pr { class: 7, number: 35 }.index();
    machine.ask(0, NonCyclicCommand::Parameter(Arguments { type_code: parameter::WRITE, index: feed, data: 1 }))?;
    println!("position set to {}", machine.procedure(0, SetPosition::actual(50_000))?);
    Ok(())
}

/// Cyclic position with velocity feed-forward, while a latch waits and a sub-command reads the speed.
fn by_the_host(machine: &mut Machine) -> Done {
    let mut latch = Latch::both(CODES.latch_arm, [Nibble::ZERO; 2], 2_000);
    let mut caught = latch.start(machine.axis());
    let mut fastest = 0;
    for k in 0..400 {
        let axis = machine.axis();
        axis.set_position(axis.setpoint().wrapping_add(100))?;
        axis.set_feed_forward(200_000)?;
        // Busy until the one before is answered.
        let _ = axis.ask_sub(SubCode::Monitor, 0x05, 0);
        if let 100 | 200 = k {
            machine.drive.trigger(k / 100);
        }
        machine.update()?;
        if caught.is_pending() {
            caught = latch.receive(machine.axis());
        }
        if let Some(Progress::Done { value }) = machine.axis().take_sub_outcome() {
            fastest = fastest.max(value.data1);
        }
    }
    println!("latched {:?}, at most {fastest} command units/s, now at {}", latch.caught(), machine.position()?);
    machine.axis().set_feed_forward(0)?;
    let deviation = Arguments { type_code: monitor::PERR, index: 0, data: 0 };
    let deviation = machine.ask(0, NonCyclicCommand::Monitor(deviation))?;
    println!("deviation {}", deviation.data().unwrap_or(0));
    // A sine from its instant, as any source of positions gives it.
    let (begin_ns, from) = (machine.now_ns, machine.axis().setpoint());
    machine.follow(|_, now_ns| {
        let turn = now_ns.saturating_sub(begin_ns) as f64 / 2e8;
        (turn <= 1.0).then(|| from.wrapping_add((5_000.0 * (core::f64::consts::TAU * turn).sin()) as i32))
    })?;
    Ok(machine.until(Some(200), |ring| {
        let in_position = StatusFlags::IN_POSITION;
        ring.axes().iter().all(|axis| axis.status().contains(in_position) && axis.can_ask())
    })?)
}

/// Profile position: a motion that gets slower on the way, and homing.
fn by_the_drive(machine: &mut Machine) -> Done {
    machine.axis().set_mode(ActiveCode::ProfilePosition)?;
    machine.axis().start_move(profile::RELATIVE, 100_000, 1_000_000)?;
    while machine.position()? < 150_000 {
        machine.run(1)?;
    }
    machine.axis().set_move_speed(200_000)?;
    let ended = loop {
        machine.run(1)?;
        match machine.axis().take_move() {
            Some(Progress::Done { value }) => break value,
            Some(Progress::Failed { error }) => return Err(error.into()),
            _ => {}
        }
    };
    println!("motion ended at {}, in position: {}", machine.position()?, ended.in_position);
    machine.home(0, CODES.homing, 4_000)?;
    println!("homed, {} from the origin", machine.position()?);
    let ended = machine.go(0, profile::RELATIVE, -20_000, 1_000_000)?;
    println!("moved to {}, in position: {}", machine.position()?, ended.in_position);
    Ok(machine.until(Some(100), |ring| ring.axes().iter().all(Axis::can_ask))?)
}

/// Cyclic velocity, with an output of the drive switched, and feed-forward in the sub block.
fn at_a_speed(machine: &mut Machine) -> Done {
    machine.axis().set_mode(ActiveCode::CyclicVelocity)?;
    machine.axis().set_control(ControlBits::EX_OUT1);
    machine.axis().set_sub_feed_forward(0, 0)?;
    for speed in [500_000, -500_000, 0] {
        machine.axis().set_rate(speed)?;
        machine.run(200)?;
        println!("at {} with {speed} command units/s", machine.position()?);
    }
    Ok(())
}

/// Lets the time pass until the axis has stopped, and says why it has.
fn stops(machine: &mut Machine) -> Done {
    match machine.run(1_000) {
        Err(Ended::Ring(failure)) => println!("{failure}"),
        Err(other) => return Err(other.into()),
        Ok(()) => return Err("the axis goes on".into()),
    }
    Ok(())
}

/// An alarm: what it is, whether it can be cleared, and on again.
fn an_alarm(machine: &mut Machine) -> Done {
    machine.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    stops(machine)?;
    let attributes = machine.procedure(0, AlarmAttributes::new(CODES.alarm_attributes))?;
    // The bit is in the manual of a drive; this one's is invented as its type codes are.
    println!("{attributes:?}, clearable: {}", attributes.is_clearable(ClearableIf::Set(0x01)));
    let mut entries = [Alarm { main: 0, sub: 0 }; 2];
    machine.procedure(0, AlarmHistory::new(CODES.alarm_history, &mut entries))?;
    println!("history {}", entries[0]);
    println!("{:?}", machine.procedure(0, ClearAlarm::new(CODES.alarm_clear, 100))?);
    machine.ring.clear();
    machine.switch_on()?;
    println!("{} again, {} blocks good", machine.axis().state(), machine.axis().counters().good());
    Ok(())
}

/// A servo that drops out, main power that goes, a warning and an input: what a test bench can do to the modelled drive.
fn what_goes_wrong(machine: &mut Machine) -> Done {
    machine.drive.set_warning(0xa0);
    machine.drive.set_inputs(StatusFlags::HOME.to_bytes()[1]);
    machine.drive.set_fault(Fault::ServoDrop);
    stops(machine)?;
    println!("[{}]", machine.axis().status());
    machine.ring.clear();
    machine.switch_on()?;
    machine.drive.set_fault(Fault::NoMainPower);
    stops(machine)?;
    machine.drive.set_fault(Fault::None);
    // From now on it does not take its time.
    machine.drive.set_behaviour(Behaviour::new());
    machine.ring.clear();
    machine.switch_on()?;
    println!("{}", if machine.ring.all_are(AxisState::On) { "on" } else { "off" });
    Ok(())
}
