//! Test of the whole machine: lines of 4 to 254 devices with loss, duplicates, jitter and drift. The reports of both ends
//! are compared with what really happened on the wires.

use sorte_proto::Tally;
use sorte_proto::sync0::Variant;
use step_profile::{Motors, Parameters, Profile, Speed};

use super::axis::Build;
use super::host::Host;
use super::line::{Line, Progress};
use super::node::Truth;
use super::power::Power;
use super::program::Program;
use super::record::Recorder;
use super::setup::Setup;
use super::wires::Physics;

fn setup(devices: usize, physics: Physics, positions: bool, seed: u64) -> Setup {
    Setup {
        cables_ns: (0..devices).map(|k| 20 + (k * 37 % 100) as u16).collect(),
        cycle_ns: None,
        build: Build {
            variant: Variant::Lossless,
            latency_ns: 300,
            write_ns: 20,
            tolerance_ns: 100.0 + 2.0 * devices as f64,
        },
        physics,
        crystal_ppm: 50.0,
        drift_ppm: 1.0,
        unplug: None,
        driver_fault: None,
        positions,
        patient: false,
        max_lag: 128,
        seed,
    }
}

const QUIET: Physics = Physics {
    asymmetry_ns: 0.0,
    hop_jitter_ns: 1.443,
    capture_jitter_ns: 5.0,
    bit_error_rate: 0.0,
    loss: 0.0,
    duplicates: 0.0,
};

fn machine(setup: Setup, cycles: u64) -> (Line, Host, Recorder) {
    let axes = setup.cables_ns.len();
    let ramp = Profile::new(Parameters::at(Speed::KHZ_100)).unwrap();
    let motors = Motors::new((1 << axes.min(4)) - 1).unwrap_or_default();
    let program = Program::turns(motors, vec![ramp], 2000, u64::MAX);
    let line = Line::new(setup);
    let host = Host::new(Power::new(program, axes, None, line.setup.cycle_ns()), axes, Some(cycles), 128);
    let record = Recorder::new(axes, None, None, 0, 4000).unwrap();
    (line, host, record)
}

/// Returns what the device at place `k` has counted, and what the master knows about it.
fn counted(line: &Line, k: usize) -> (Tally, Tally) {
    let at_master = line.master.tally(k as u8 + 1).unwrap();
    (line.nodes[k].device.counters().master, at_master)
}

fn wrong(tally: Tally) -> u32 {
    tally.doubled + tally.late + tally.stale
}

/// Runs this many cycles; returns how many frames of the exchange were sent.
fn run(devices: usize, cycles: u64, positions: bool, seed: u64) -> u64 {
    let share = 4e-3 / devices as f64;
    let physics = Physics { loss: share, duplicates: share, ..QUIET };
    let (mut line, mut host, mut record) = machine(setup(devices, physics, positions, seed), u64::MAX);
    // What had happened to each device one, two and three cycles ago.
    let mut before: Vec<[Truth; 3]> = vec![[Truth::default(); 3]; devices];
    while line.master.counters().cycles < cycles {
        let progress = line.step(&mut host, &mut record).expect("the master goes on");
        if matches!(progress, Progress::StartUp) {
            continue;
        }
        for (k, history) in before.iter_mut().enumerate() {
            let [.., older] = *history;
            let (at_device, at_master) = counted(&line, k);
            let place = format!("{devices} devices, seed {seed}, device {}", k + 1);
            assert!(at_device.missed >= older.lost_out && at_master.missed >= older.lost_back, "{place}");
            assert!(wrong(at_device) >= older.again_out && wrong(at_master) >= older.again_back, "{place}");
            history.rotate_right(1);
            history[0] = line.nodes[k].truth;
        }
    }
    let place = format!("{devices} devices, seed {seed}: {:?}", line.events);
    assert_eq!((line.master.counters().retrains, line.event_count, line.wires.collisions), (0, 0, 0), "{place}");
    let mut happened = 0;
    for (k, history) in before.iter().enumerate() {
        let (truth, [.., older]) = (line.nodes[k].truth, *history);
        let (at_device, at_master) = counted(&line, k);
        let place = format!("{place}, device {}: {at_device}; {at_master}; {truth:?}", k + 1);
        assert_eq!(truth.stale, 0, "{place}");
        // Neither more than what has happened: the last two cycles may still be open.
        assert!((older.lost_out..=truth.lost_out).contains(&at_device.missed), "{place}");
        assert!((older.lost_back..=truth.lost_back).contains(&at_master.missed), "{place}");
        assert!(wrong(at_device) <= truth.again_out && wrong(at_master) <= truth.again_back, "{place}");
        happened += truth.lost_out + truth.lost_back + truth.again_out + truth.again_back;
        let node = &line.nodes[k];
        // Steps of the last three cycles are under way; what a lost frame has left out, the follower knows.
        let open = node.asked.asked() - node.axis.position - i64::from(node.follower.lag());
        let whole = node.axis.tally.extra + node.axis.tally.lost == 0 && (!positions || open.abs() <= 4);
        assert!(whole || !positions && at_device.missed > 0, "{place}: a step lost or made twice, and nobody knows");
        assert!(node.clock_error_ns < 60.0 + 2.0 * devices as f64, "{place}: clock {} ns off", node.clock_error_ns);
    }
    let sent = line.master.counters().cycles * devices as u64 * 2;
    println!("{devices} devices: {sent} frames, {happened} lost or doubled, {}", line.master.counters());
    assert!(sent < 50_000 || happened > 0, "{place}: nothing has happened");
    sent
}

/// A tenth of the frames for each number of devices; `HOSTILE_EVENTS` sets any other number.
#[test]
fn nothing_is_stale_and_every_loss_is_counted() {
    let frames = servowire_world::wanted_events(200_000) as u64;
    for (n, devices) in (1..).zip([4, 16, 64, 254]) {
        let cycles = (frames / 8 / (2 * devices as u64)).max(200);
        let sent = run(devices, cycles, true, n) + run(devices, cycles, false, n + 10);
        assert!(sent >= frames / 5, "{sent} frames");
    }
}

/// Start-up and exchange share the wires: all lines start at the first attempt, and no frame meets another one.
#[test]
fn lines_of_2_to_254_devices_start_at_the_first_try() {
    for devices in [2, 3, 4, 5, 9, 10, 11, 12, 14, 16, 20, 32, 64, 128, 254] {
        let (mut line, mut host, mut record) = machine(setup(devices, QUIET, true, devices as u64), 12);
        let mut cycles = 0;
        while cycles < 12 {
            let progress = line.step(&mut host, &mut record);
            cycles += u64::from(matches!(progress, Some(Progress::Cycle)));
            assert!(progress.is_some(), "{devices} devices: {:?}", line.events);
        }
        assert_eq!((line.master.counters().retrains, line.wires.collisions), (0, 0), "{devices}: {:?}", line.events);
        let counters = line.master.counters();
        assert_eq!((counters.frames, counters.timing_errors), (Tally::default(), 0), "{devices} devices");
        assert!(line.nodes.iter().all(|node| node.device.counters().master == Tally::default()), "{devices} devices");
    }
}

/// The frames of 254 devices with ports that re-time to 25 MHz would meet; the line is refused, naming the first device for
/// which this is so.
#[test]
fn a_line_that_jitter_does_not_carry_is_refused() {
    let physics = Physics { hop_jitter_ns: 5.0, ..QUIET };
    let (mut line, mut host, mut record) = machine(setup(254, physics, true, 1), 10);
    while line.why.is_none() {
        assert!(matches!(line.step(&mut host, &mut record), Some(Progress::StartUp)));
    }
    let why = line.why.clone().unwrap();
    // 6 x 5 ns x sqrt(2 x 33) are 244 ns.
    assert!(why.contains("the frame of device 34 comes 240 ns after the one before it, 244 ns are needed"), "{why}");
}

/// Each cable of four devices in turn, from none to the longest: all lines start at the first attempt and run.
#[test]
fn every_cable_runs() {
    for cable in (0..6).chain((7..=500).step_by(7)).chain([500]) {
        let mut setup = setup(4, QUIET, true, 3);
        setup.cables_ns = vec![cable; 4];
        let fits = setup.timing().misfit(setup.cycle_ns()).is_none();
        assert!(fits, "the planner has chosen a cycle that does not fit: {cable} ns");
        let (mut line, mut host, mut record) = machine(setup, u64::MAX);
        while line.why.is_none() && line.master.counters().cycles < 100 {
            assert!(line.step(&mut host, &mut record).is_some());
        }
        let counters = line.master.counters();
        assert_eq!((counters.frames, counters.timing_errors), (Tally::default(), 0), "{cable} ns: {:?}", line.why);
        assert_eq!((line.why, line.wires.collisions), (None, 0), "{cable} ns");
    }
}

/// 2800 ns more on every way back: a round trip over 500 ns of cable takes 4160 ns, more than the published sum holds. The
/// first
/// device that cannot measure is named: before the exchange if SYNC has gained less than the devices there are must add,
/// otherwise at the end of the exchange.
#[test]
fn a_device_that_cannot_measure_its_cable_is_named() {
    for (cables, early) in [(&[20, 500, 500][..], true), (&[20, 300, 500, 300, 300], false)] {
        let physics = Physics { asymmetry_ns: 2800.0, ..QUIET };
        let mut setup = setup(cables.len(), physics, true, 3);
        setup.cables_ns = cables.to_vec();
        let (mut line, mut host, mut record) = machine(setup, u64::MAX);
        while line.why.is_none() && line.master.counters().cycles < 50 {
            assert!(line.step(&mut host, &mut record).is_some());
        }
        let device = if early { 1 } else { 2 };
        let why = super::report::verdict(&line, &host).unwrap();
        assert!(why.contains(&format!("device {device}: round trip of 41")), "{why}");
        assert_eq!(why.contains("SYNC has passed 1 devices at most, DISCOVERY found 3"), early, "{why}");
    }
}
