//! State machine of a device.

use serde::Deserialize;
use sorte_proto::device::{Action, Config, Device, FrameTimes, Port, PortFlags, PortId, Reaction, State, Trigger};
use sorte_proto::{DelayReq, Discovery, Link, Param, Parameters, Place, Sync, emit_master_frame_into};

use super::Origin;
use crate::hex::Bytes;
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(untagged)]
enum DeviceRow {
    Frame(FrameRow),
    Monitor(MonitorRow),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "case")]
    _case: String,
    state: String,
    flags: Vec<String>,
    frame_head: Option<Bytes>,
    state_after: String,
    flags_after: Vec<String>,
    forwards_modified_copy: bool,
    line_delay_trigger: u8,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MonitorRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "case")]
    _case: String,
    cycles: Vec<Cycle>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cycle {
    #[serde(rename = "cycle")]
    number: usize,
    frame_received: bool,
    missed_count: u8,
    restart: bool,
}

const FLAGS: [(PortFlags, &str); 5] = [
    (PortFlags::LAST_DEVICE, "LAST_DEVICE"),
    (PortFlags::MASTER_PORT, "MASTER_PORT"),
    (PortFlags::IGNORE_TO_EOF, "IGNORE_TO_EOF"),
    (PortFlags::SWITCH_PORT_CONFIG, "SWITCH_PORT_CONFIG"),
    (PortFlags::NEW_SYNC_FRAME, "NEW_SYNC_FRAME"),
];

fn name(state: State) -> String {
    state.name().to_owned()
}

fn flags(names: &[String]) -> Result<PortFlags, Fault> {
    let of = |name: &String| FLAGS.iter().find(|(_, n)| n == name).map(|(flag, _)| flag.bits());
    let mut bits = names.iter().map(|name| of(name).ok_or_else(|| Fault::Unreadable(format!("flag {name}"))));
    bits.try_fold(0, |all, bit| Ok(all | bit?)).map(PortFlags::from_bits_retain)
}

pub(super) fn device_state(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: DeviceRow| match row {
        DeviceRow::Frame(row) => {
            let state = State::ALL.into_iter().find(|state| state.name() == row.state);
            let state = state.ok_or_else(|| Fault::Unreadable(format!("state {}", row.state)))?;
            let mut port = Port { state, flags: flags(&row.flags)? };
            let head = match &row.frame_head {
                None => None,
                Some(Bytes(bytes)) => match bytes[..] {
                    [da, sa, code, status, ..] => Some([da, sa, code, status]),
                    _ => return Err(Fault::Unreadable("frame_head".to_owned())),
                },
            };
            let seen = head.map(|head| port.head(head)).unwrap_or_default();
            same("state_after", &row.state_after, &name(port.state))?;
            same("flags_after", &flags(&row.flags_after)?, &port.flags)?;
            same("forwards_modified_copy", &row.forwards_modified_copy, &seen.modifies)?;
            same("line_delay_trigger", &row.line_delay_trigger, &seen.trigger.code())
        }
        DeviceRow::Monitor(row) => {
            let mut device = taken_to(State::Exchange, true);
            // It counts once it has had a frame.
            let mut frame = [0; 21];
            let stamp = CYCLE_ZERO_NS + 500;
            assert_eq!(emit_master_frame_into(&[0; 16], stamp, &mut frame), Ok(21));
            assert!(device.hear_exchange(&frame, captured(0)).is_ok());
            assert!(!closed(&mut device, 0));
            for (index, cycle) in row.cycles.into_iter().enumerate() {
                same("cycle", &cycle.number, &(index + 1))?;
                let number = u32::try_from(index + 1).unwrap_or_default();
                if cycle.frame_received {
                    // Whatever it is, it counts.
                    let _: Result<_, _> = device.hear_exchange(&[], captured(number));
                }
                let before = device.missed_frames();
                let restart = closed(&mut device, number);
                let missed = if restart { before + 1 } else { device.missed_frames() };
                same("missed_count", &cycle.missed_count, &missed)?;
                same("restart", &cycle.restart, &restart)?;
                same("state", &restart, &(device.state() == State::Idle))?;
            }
            Ok(())
        }
    })
}

/// Common time at the start of the device's first cycle: 10 us after its SYNC frame was sent at 500 ns. PARAM says 10 us.
const CYCLE_ZERO_NS: u16 = 10_500;

/// When the master frame of a cycle is captured 76 ns from the master, 120 ns after its first bit.
fn captured(cycle: u32) -> FrameTimes {
    heard(u32::from(CYCLE_ZERO_NS) + 10_000 * cycle + 500 + 76 + 120)
}

/// Nobody waits for the frame of this cycle any more; whether the device has started again.
fn closed(device: &mut Device, cycle: u32) -> bool {
    let now = u32::from(CYCLE_ZERO_NS) + 10_000 * cycle + 5000;
    loop {
        match device.poll(now, 0) {
            Action::Wait { .. } => return false,
            Action::Restart => return true,
            _ => {}
        }
    }
}

/// A device, last in the line or not, taken to `state` by good frames.
fn taken_to(state: State, last: bool) -> Device {
    let mut device = Device::new(Config::default());
    device.set_links(Link::Up, if last { Link::Down } else { Link::Up });
    let frames = [
        Discovery::request(Place::Inner).emit().to_vec(),
        Discovery::request(Place::Last).emit().to_vec(),
        Param::request(Parameters::STOCK, Place::Last).emit().to_vec(),
        DelayReq::of_master(Place::Last).emit().to_vec(),
        Sync::of_master(500, 76, Place::Last).emit().to_vec(),
    ];
    for mut frame in frames {
        if device.state() == State::LineDelay && !last {
            measure(&mut device);
        }
        if device.state() != state {
            let reaction = device.hear(PortId::A, &mut frame, heard(0));
            assert_eq!(reaction.result, Ok(()));
        }
    }
    assert_eq!(device.state(), state);
    device
}

/// Sixteen round trips to the next device.
fn measure(device: &mut Device) {
    for n in 1..=16 {
        let trigger = if n == 16 { Trigger::Last } else { Trigger::Normal };
        let request = Device::delay_request(trigger).map(|request| request.emit()).unwrap_or_default();
        assert_eq!(device.hear_reflection(trigger, &request, 560), Ok(()));
    }
}

fn heard(sof_ns: u32) -> FrameTimes {
    FrameTimes { sof_ns, counter_ns: sof_ns, now_ns: 0 }
}

/// State after a DISCOVERY frame.
pub(super) fn after_discovery(frame: &[u8], last: bool) -> String {
    let mut device = taken_to(State::Discovery, last);
    let reaction = device.hear(PortId::A, &mut frame.to_vec(), heard(0));
    assert_eq!(reaction.result, Ok(()));
    name(device.state())
}

/// State after a PARAM frame, and the 32 bytes that the device has stored.
pub(super) fn after_param(frame: &[u8]) -> (String, Option<[u8; 32]>) {
    let mut device = taken_to(State::Param, true);
    let mut passed = frame.to_vec();
    let _: Reaction = device.hear(PortId::A, &mut passed, heard(0));
    assert_eq!(passed, frame, "PARAM is not changed");
    (name(device.state()), device.parameters().map(|parameters| parameters.emit()))
}

/// State after a SYNC frame, and the receive time that the device has stored.
pub(super) fn after_sync(frame: &[u8], last: bool, sof_ns: u32) -> (String, Option<u32>) {
    let mut device = taken_to(State::Sync, last);
    let _: Reaction = device.hear(PortId::A, &mut frame.to_vec(), heard(sof_ns));
    (name(device.state()), device.last_sync().map(|last| last.sof_ns))
}
