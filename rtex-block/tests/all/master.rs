//! The master as a service: set-up, phases, memory of words, watchdog, LED, stop policies.

use core::num::NonZeroU16;

use crate::common::{CODES, LIMIT, limits};
use rtex_block::device::{Drive, DriveConfig, Fault};
use rtex_block::master::{
    ActiveCode, Asic, Axis, AxisConfig, AxisState, ControlError, ControlPhase, Led, Master, MasterConfig, MoveStage,
    Ring, RingFailure, SameMacId, SetupError, Slave, SlaveInfo, StopCategory, StopReason, compare,
};
use rtex_block::pack::SizeMismatch;
use rtex_block::timing::{A6N, Periods, TimerSystem};
use rtex_block::{Alarm, BlockSize, CommandBlock, MacId, StatusFlags};

const ADDRESSES: [u8; 2] = [4, 17];

fn mac_id(number: u8) -> MacId {
    MacId::new(number).unwrap()
}

fn axis(number: u8) -> AxisConfig {
    AxisConfig::new(mac_id(number), ActiveCode::CyclicPosition, 500_000, limits())
}

fn table() -> [Slave; 2] {
    ADDRESSES.map(|number| Slave { mac_id: mac_id(number), kind: 1 })
}

fn config(size: BlockSize) -> MasterConfig {
    MasterConfig::new(size, Periods::from_a6n(3, 1, None).unwrap(), TimerSystem::External).with_invalid(2)
}

/// Two axes and their drives over memory of 16-bit words, 16-byte blocks.
struct Bench {
    master: Master<2>,
    drives: [Drive; 2],
    rx: [u16; 16],
    tx: [u16; 16],
    cut: [bool; 2],
}

impl Bench {
    fn new(config: MasterConfig, axes: [AxisConfig; 2]) -> Self {
        Self {
            master: Master::new(config, table(), axes.map(Axis::new)).unwrap(),
            drives: ADDRESSES.map(|number| Drive::new(DriveConfig::new(mac_id(number), CODES))),
            rx: [0; 16],
            tx: [0xffff; 16],
            cut: [false; 2],
        }
    }

    fn running(axes: [AxisConfig; 2]) -> Self {
        let mut bench = Self::new(config(BlockSize::Bytes16), axes);
        bench.start();
        bench.until("on", |bench| {
            bench.master.ring_mut().switch_on().ok();
            bench.master.ring().all_are(AxisState::On)
        });
        bench
    }

    fn start(&mut self) {
        self.master.control(Asic::Initial, None);
        assert_eq!(self.master.control(Asic::Ready, Some(&table())), ControlPhase::Prepare);
        self.update();
        assert_eq!(self.master.control(Asic::Ready, None), ControlPhase::Start);
        assert_eq!(self.master.control(Asic::Running, None), ControlPhase::Running);
    }

    fn block(&self, place: usize) -> [u8; 16] {
        let mut block = [0; 16];
        for (k, word) in self.tx[place * 8..place * 8 + 8].iter().enumerate() {
            block[2 * k] = *word as u8;
            block[2 * k + 1] = (word >> 8) as u8;
        }
        block
    }

    fn update(&mut self) {
        self.master.exchange_words(&self.rx, &mut self.tx, 0).unwrap();
        for place in 0..2 {
            if self.cut[place] {
                self.drives[place].framing_error();
                continue;
            }
            let block = self.block(place);
            let response = self.drives[place].hear(&block).unwrap();
            for k in 0..8 {
                self.rx[place * 8 + k] = u16::from(response[2 * k + 1]) << 8 | u16::from(response[2 * k]);
            }
        }
        self.master.frame_received();
    }

    fn until(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) {
        for _ in 0..2_000 {
            if done(self) {
                return;
            }
            self.update();
        }
        panic!("{what}: {:?}", self.master.ring().failure());
    }

    fn state(&self, place: usize) -> AxisState {
        self.master.ring().axes()[place].state()
    }
}

#[test]
fn what_cannot_be_set_up() {
    let axes = |a, b| [a, b].map(Axis::new);
    let new = |config, axes| Master::new(config, table(), axes).err();
    let good = config(BlockSize::Bytes16);
    assert_eq!(new(good, axes(axis(4), axis(17))), None);
    assert_eq!(new(good, axes(axis(4), axis(4))), Some(SetupError::SameMacId(SameMacId { mac_id: mac_id(4) })));
    assert_eq!(new(good, axes(axis(4), axis(18))), Some(SetupError::Table { mac_id: mac_id(18) }));
    assert_eq!(new(good, axes(axis(17), axis(4))), Some(SetupError::Table { mac_id: mac_id(17) }));
    let slow = AxisConfig::new(mac_id(17), ActiveCode::CyclicPosition, 1_000_000, limits());
    assert_eq!(new(good, axes(axis(4), slow)), Some(SetupError::UpdatePeriod { mac_id: mac_id(17) }));
    let half = MasterConfig::new(BlockSize::Bytes16, A6N[6], TimerSystem::Internal);
    assert_eq!(new(half, axes(axis(4), axis(17))), Some(SetupError::Timer));
    assert_eq!((half.invalid, half.watchdog), (4, None));
    assert_eq!(Ring::new(axes(axis(9), axis(9)), 0).err(), Some(SameMacId { mac_id: mac_id(9) }));
}

/// Before PH_RUNNING an exchange writes NOPs with counter 0 and believes nothing.
#[test]
fn from_reset_to_running() {
    let mut bench = Bench::new(config(BlockSize::Bytes16), ADDRESSES.map(axis));
    bench.rx = [0xffff; 16];
    assert_eq!((bench.master.phase(), bench.master.led(0)), (ControlPhase::Init, Led::Off));
    bench.update();
    assert_eq!((bench.block(0)[..4].to_vec(), bench.block(1)[..4].to_vec()), (vec![4, 0, 0, 0], vec![17, 0, 0, 0]));
    assert_eq!(bench.master.control(Asic::RingConfig, None), ControlPhase::Waiting);
    // Nothing is prepared by an exchange in an earlier phase.
    assert_eq!(bench.master.control(Asic::Ready, Some(&table())), ControlPhase::Prepare);
    assert_eq!(bench.master.control(Asic::Ready, None), ControlPhase::Prepare);
    assert_eq!(
        [0, 499, 500, 999, 1_000].map(|t| bench.master.led(t)),
        [Led::Green, Led::Green, Led::Off, Led::Off, Led::Green]
    );
    // Prepared once is prepared, however often.
    bench.update();
    bench.update();
    assert_eq!(bench.master.control(Asic::Ready, None), ControlPhase::Start);
    assert!(!bench.master.is_running());
    bench.master.control(Asic::Running, None);
    assert!(bench.master.is_running());
    let mut counters = Vec::new();
    for _ in 0..6 {
        bench.update();
        counters.push((bench.block(1)[0] >> 5, bench.block(1)[1]));
    }
    assert_eq!(counters, [(0, 0), (0, 0), (1, 0x20), (2, 0x20), (3, 0x20), (0, 0x20)]);
    assert_eq!((bench.master.led(700), bench.master.error()), (Led::Green, None));
}

#[test]
fn slaves_that_are_not_in_the_table() {
    let turned = [table()[1], table()[0]];
    let mut bench = Bench::new(config(BlockSize::Bytes16), ADDRESSES.map(axis));
    bench.master.control(Asic::Initial, None);
    bench.master.control(Asic::Ready, Some(&turned));
    let fault = Some(ControlError::SlaveInfoMismatch);
    assert_eq!(bench.master.error(), fault);
    bench.master.clear();
    assert_eq!((bench.master.error(), bench.master.led(700)), (fault, Led::Red));
    // Nor do the right ones change that.
    assert_eq!(bench.master.control(Asic::Ready, Some(&table())), ControlPhase::Waiting);
}

/// MAC-ID 31 is the highest, and one like the others.
#[test]
fn the_highest_mac_id_is_there_once() {
    let twice = [31, 31].map(|number| Axis::new(axis(number)));
    assert_eq!(Ring::new(twice, 0).err(), Some(SameMacId { mac_id: mac_id(31) }));
    assert!(Ring::new([0, 31].map(|number| Axis::new(axis(number))), 0).is_ok());
    let slaves = [31, 31].map(|number| Slave { mac_id: mac_id(number), kind: 1 });
    assert_eq!(compare(&slaves, &slaves), SlaveInfo::Mismatch);
    // Servo-on is refused for the first axis that is not ready.
    let mut ring = Ring::new([0, 31].map(|number| Axis::new(axis(number))), 0).unwrap();
    assert_eq!(ring.switch_on().unwrap_err().place, 0);
}

#[test]
fn memories_of_another_size() {
    let mut bench = Bench::new(config(BlockSize::Bytes16), ADDRESSES.map(axis));
    let before = bench.master;
    let mut words = [0x1234; 15];
    let refused = Err(SizeMismatch { bytes: 32, words: 15 });
    assert_eq!(bench.master.exchange_words(&bench.rx, &mut words, 0), refused);
    assert_eq!(bench.master.exchange_words(&words, &mut bench.tx, 0), refused);
    assert!(bench.master.exchange_words(&[0_u32; 9], &mut [0; 8], 0).is_err());
    assert!(bench.master.exchange_words(&[0_u8; 32], &mut [0; 64], 0).is_err());
    assert_eq!((bench.master, words), (before, [0x1234; 15]));
    assert!(bench.master.exchange_words(&[0_u8; 32], &mut [0; 32], 0).is_ok());
    let mut wide = Bench::new(config(BlockSize::Bytes32), ADDRESSES.map(axis));
    assert!(wide.master.exchange_words(&[0_u8; 32], &mut [0; 32], 0).is_err());
    let mut tx = [0xff; 64];
    wide.master.exchange_words(&[0_u8; 64], &mut tx, 0).unwrap();
    // Sub_Chk is always set, in a NOP too.
    assert_eq!((tx[16], tx[48]), (0x80, 0x80));
}

/// The drives are wired in another order than the table says: the reason names the drive that answers.
#[test]
fn a_wrong_order_is_said_as_such() {
    let mut bench = Bench::new(config(BlockSize::Bytes16), ADDRESSES.map(axis));
    bench.drives.swap(0, 1);
    bench.start();
    bench.until("stopped", |bench| bench.master.ring().failure().is_some());
    assert_eq!(
        bench.master.ring().failure(),
        Some(RingFailure { place: 0, reason: StopReason::WrongMacId(mac_id(17)) })
    );
    assert_eq!(
        (bench.master.error(), bench.master.led(0), bench.master.led(600)),
        (Some(ControlError::Timeout), Led::Red, Led::Off)
    );
}

/// Receptions stop: the watchdog trips at its limit, whatever lies in the memory.
#[test]
fn the_receive_watchdog() {
    let limit = NonZeroU16::new(3);
    let mut bench = Bench::new(config(BlockSize::Bytes16).with_watchdog(limit), ADDRESSES.map(axis));
    bench.start();
    bench.until("on", |bench| {
        bench.master.ring_mut().switch_on().ok();
        bench.master.ring().all_are(AxisState::On)
    });
    for _ in 0..2 {
        bench.master.exchange_words(&bench.rx, &mut bench.tx, 0).unwrap();
        assert_eq!(bench.state(0), AxisState::On);
    }
    bench.master.exchange_words(&bench.rx, &mut bench.tx, 0).unwrap();
    assert_eq!(bench.master.error(), Some(ControlError::Timeout));
    for place in 0..2 {
        assert_eq!(bench.state(place), AxisState::Stopped(StopReason::ReceiveTimeout));
        assert!(bench.master.ring().is_timed_out());
        assert!(CommandBlock::of(&bench.block(place)).unwrap().is_servo_off());
    }
    // Receptions again, and clearing: the ring can be switched on.
    bench.update();
    bench.master.clear();
    assert_eq!(bench.master.error(), None);
    bench.until("on", |bench| {
        bench.master.ring_mut().switch_on().ok();
        bench.master.ring().all_are(AxisState::On)
    });
}

/// Axis 1 is moving at 300 units an update period when axis 0 has an alarm.
fn alarm_beside(mode: ActiveCode, stop: Option<StopCategory>, deceleration: u32) -> Bench {
    let mut second = axis(17).with_stop(stop).with_deceleration(deceleration);
    second.mode = mode;
    let mut bench = Bench::running([axis(4), second]);
    if mode == ActiveCode::ProfilePosition {
        bench.master.ring_mut().axes_mut()[1].start_move(0x11, 1_000_000, 600_000).unwrap();
    }
    for _ in 0..40 {
        let moved = &mut bench.master.ring_mut().axes_mut()[1];
        match mode {
            ActiveCode::CyclicPosition => moved.set_position(moved.setpoint() + 300).unwrap(),
            ActiveCode::CyclicVelocity => moved.set_rate(600_000).unwrap(),
            ActiveCode::CyclicTorque => moved.set_rate(10).unwrap(),
            ActiveCode::ProfilePosition => assert!(moved.profile().unwrap().stage() != MoveStage::Ended),
        }
        bench.update();
    }
    bench.drives[0].set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    bench.until("axis 0 stopped", |bench| {
        let moved = &mut bench.master.ring_mut().axes_mut()[1];
        if mode == ActiveCode::CyclicPosition && moved.state() == AxisState::On {
            moved.set_position(moved.setpoint() + 300).unwrap();
        }
        bench.state(0) == AxisState::Stopped(StopReason::Alarm)
    });
    bench
}

#[test]
fn an_axis_stops_at_once_unless_it_was_told_otherwise() {
    for mode in [ActiveCode::CyclicPosition, ActiveCode::CyclicVelocity, ActiveCode::ProfilePosition] {
        let bench = alarm_beside(mode, Some(StopCategory::Zero), 1);
        assert_eq!(bench.state(1), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
        assert!(CommandBlock::of(&bench.block(1)).unwrap().is_servo_off());
    }
    // A torque cannot be slowed down.
    let bench = alarm_beside(ActiveCode::CyclicTorque, Some(StopCategory::One), 1);
    assert_eq!(bench.state(1), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
}

#[test]
fn an_axis_slows_down() {
    let mut bench = alarm_beside(ActiveCode::CyclicPosition, Some(StopCategory::One), 40);
    let position = |bench: &Bench| CommandBlock::of(&bench.block(1)).unwrap().command_data1();
    let mut steps = Vec::new();
    let mut last = position(&bench);
    while bench.state(1) == AxisState::Stopping(StopReason::OtherAxis { place: 0 }) {
        assert!(bench.master.ring_mut().axes_mut()[1].set_position(0).is_err());
        bench.update();
        steps.push(position(&bench) - last);
        last = position(&bench);
    }
    // 300 less 40 came in the period of the failure; the last set-point is followed by the servo-off.
    assert_eq!(steps[..6], [220, 180, 140, 100, 60, 20]);
    assert_eq!(bench.state(1), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));

    let mut bench = alarm_beside(ActiveCode::CyclicVelocity, Some(StopCategory::One), 200_000);
    assert_eq!(position(&bench), 400_000);
    bench.update();
    assert_eq!(position(&bench), 200_000);
    bench.update();
    assert_eq!(bench.state(1), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));

    let mut bench = alarm_beside(ActiveCode::ProfilePosition, Some(StopCategory::One), 1);
    assert_eq!(bench.block(1)[3] & 0x40, 0x40);
    bench.until("stopped", |bench| bench.state(1) == AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
    let status = bench.master.ring().axes()[1].status();
    assert!(status.contains(StatusFlags::SERVO_ACTIVE) && !status.contains(StatusFlags::IN_PROGRESS));
    // Too slow: the limit ends it.
    let mut bench = alarm_beside(ActiveCode::CyclicPosition, Some(StopCategory::One), 1);
    let from = (0..100).find(|_| {
        bench.update();
        bench.state(1) == AxisState::Stopped(StopReason::OtherAxis { place: 0 })
    });
    assert!((58..62).contains(&from.unwrap()), "{from:?}");
}

/// An axis may go on beside one that has an alarm, but not when the communication fails.
#[test]
fn an_axis_goes_on() {
    let mut bench = alarm_beside(ActiveCode::CyclicPosition, None, 1);
    (0..50).for_each(|_| bench.update());
    assert_eq!(bench.state(1), AxisState::On);
    let mut bench = Bench::running([axis(4), axis(17).with_stop(None)]);
    bench.cut[0] = true;
    for _ in 0..LIMIT {
        assert_eq!(bench.state(1), AxisState::On);
        bench.update();
    }
    bench.update();
    assert_eq!(bench.state(0), AxisState::Stopped(StopReason::EchoTimeout));
    assert_eq!(bench.state(1), AxisState::Stopped(StopReason::OtherAxis { place: 0 }));
}
