//! What the master's machines do, response by response.

use core::fmt::Display;
use core::num::NonZeroU16;

use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, Failure, Handshake, Heard, Limits, ProfileMove, Progress, StopCategory,
    StopReason, SubHandshake, Turn,
};
use rtex_block::position::Gear;
use rtex_block::{
    Codes, CommandBlock, ControlBits, Error, ErrorCode, Execution, NonCyclicCommand, NonCyclicResponse, Response,
    SubCode, SubResponse, UpdateCounter,
};
use serde::Deserialize;
use serde_json::{Value, json};

use super::fields::{code, mac_id, unreadable};
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

/// A response, `None` where the row has an empty one.
fn response(bytes: &Bytes) -> Result<Option<Response>, Fault> {
    if bytes.0.is_empty() {
        return Ok(None);
    }
    Response::parse(&bytes.0).map(Some).map_err(|e| unreadable(e.to_string()))
}

/// As the rows spell it.
fn progress<T>(progress: Progress<T>, done: impl FnOnce(T) -> Value) -> Value {
    match progress {
        Progress::Pending { .. } => json!("pending"),
        Progress::Done { value } => json!({ "done": done(value) }),
        Progress::Failed { error } => json!({ "failed": failure(error) }),
    }
}

fn failure(error: Failure) -> String {
    match error {
        Failure::Execution => "execution".to_owned(),
        Failure::CommandError(ErrorCode(code)) => format!("{code:04x}"),
        Failure::TimedOut => "timed_out".to_owned(),
        Failure::NotStarted => "not_started".to_owned(),
        other => other.to_string(),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HandshakeRow {
    code: Hex,
    mac_id: u8,
    bytes8_11: Bytes,
    limit: u32,
    attributes: u8,
    responses: Vec<Bytes>,
    expect: Vec<Value>,
}

pub(super) fn handshake(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: HandshakeRow| {
        let Codes { cyclic, noncyclic } = code(row.code.0)?.codes().map_err(|e| unreadable(e.to_string()))?;
        let [b8, b9, b10, b11] = row.bytes8_11.0.try_into().map_err(|_| unreadable("bytes8_11 is not four bytes"))?;
        let request = NonCyclicCommand::parse(noncyclic, [b8, b9, b10, b11, 0, 0, 0, 0]);
        let own = mac_id(row.mac_id)?;
        let handshake = match request {
            NonCyclicCommand::Alarm(a) if row.attributes == 1 => {
                Some(Handshake::alarm_attributes(own, cyclic, a.type_code, row.limit))
            }
            _ => Handshake::new(own, cyclic, request, row.limit),
        };
        let mut handshake = handshake.ok_or_else(|| unreadable("a command without a handshake"))?;
        same("what goes out", &request, &handshake.request())?;
        let mut seen = Vec::new();
        for bytes in &row.responses {
            seen.push(progress(handshake.receive(response(bytes)?.as_ref()), executed));
        }
        same("expect", &row.expect, &seen)
    })
}

fn executed(value: NonCyclicResponse) -> Value {
    let index = match value {
        NonCyclicResponse::Reset(r)
        | NonCyclicResponse::SystemId(r)
        | NonCyclicResponse::Alarm(r)
        | NonCyclicResponse::Parameter(r)
        | NonCyclicResponse::Monitor(r) => Some(r.index),
        _ => None,
    };
    let warning = value.execution().is_some_and(|e| e.contains(Execution::WNG));
    json!({ "data": value.data(), "index": index, "warning": u8::from(warning) })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SubRow {
    code: u8,
    type_code: u8,
    index: u16,
    limit: u32,
    responses: Vec<Bytes>,
    expect: Vec<Value>,
}

pub(super) fn sub(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SubRow| {
        let code = SubCode::from_code(row.code).ok_or_else(|| unreadable("not a sub-command"))?;
        let handshake = SubHandshake::new(code, row.type_code, row.index, row.limit);
        let mut handshake = handshake.ok_or_else(|| unreadable("a sub-command without a handshake"))?;
        let mut seen = Vec::new();
        for bytes in &row.responses {
            let sub = bytes.0.first_chunk().map(SubResponse::parse);
            seen.push(progress(
                handshake.receive(sub.as_ref()),
                |value| json!({ "data": value.data1, "warning": u8::from(value.execution.contains(Execution::WNG)) }),
            ));
        }
        same("expect", &row.expect, &seen)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProfileRow {
    mac_id: u8,
    type_code: u8,
    target: i32,
    speed: i32,
    limit: u32,
    latch_sel1: u8,
    monitor_sel: u8,
    responses: Vec<Bytes>,
    sent: Vec<Hex>,
    expect: Vec<Value>,
}

pub(super) fn profile(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ProfileRow| {
        let selection = row.latch_sel1.try_into().map_err(|_| unreadable("Latch_Sel1 above 15"))?;
        let motion = ProfileMove::new(mac_id(row.mac_id)?, row.type_code, row.target, row.speed, row.limit);
        let mut motion = motion.with_latch(selection, row.monitor_sel);
        let (mut seen, mut sent) = (Vec::new(), Vec::new());
        for bytes in &row.responses {
            seen.push(progress(
                motion.receive(response(bytes)?.as_ref()),
                |ended| json!({ "in_position": u8::from(ended.in_position), "warning": u8::from(ended.warning) }),
            ));
            let out = motion.request();
            sent.push(0x10 | out.code() as u64);
            if let NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, target_speed } = out {
                let want = (row.type_code, selection, row.monitor_sel, row.speed);
                same("bytes 8-15", &want, &(type_code, latch_sel1, monitor_sel, target_speed))?;
            }
        }
        same("target", &row.target, &motion.target_position())?;
        same("expect", &row.expect, &seen)?;
        same("sent", &row.sent.iter().map(|code| code.0).collect::<Vec<_>>(), &sent)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisRow {
    mac_id: u8,
    mode: String,
    update_ns: u32,
    gear: (u32, u32),
    limits: LimitKeys,
    steps: Vec<AxisStep>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitKeys {
    echo: NonZeroU16,
    command_errors: NonZeroU16,
    wait: u32,
    ready: u32,
    inactive: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisStep {
    #[serde(rename = "do")]
    action: Option<Action>,
    response: Option<Bytes>,
    state: String,
    sent: Bytes,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Action {
    SwitchOn,
    SwitchOff,
    Clear,
    Stop,
    SetPosition(i32),
    RefusedPosition(i32),
    SetRate(i32),
    SetControl(u16),
}

pub(super) fn axis(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: AxisRow| {
        let mode = match row.mode.as_str() {
            "CP" => ActiveCode::CyclicPosition,
            "PP" => ActiveCode::ProfilePosition,
            "CV" => ActiveCode::CyclicVelocity,
            "CT" => ActiveCode::CyclicTorque,
            other => return Err(unreadable(format!("{other} is not a mode"))),
        };
        let LimitKeys { echo, command_errors, wait, ready, inactive } = row.limits;
        let limits = Limits::new(echo, wait).with_command_errors(command_errors);
        let limits = limits.with_ready(Some(ready)).with_inactive(inactive);
        let gear = Gear::new(row.gear.0, row.gear.1).ok_or_else(|| unreadable("gear with 0"))?;
        let config = AxisConfig::new(mac_id(row.mac_id)?, mode, row.update_ns, limits).with_gear(gear);
        let mut axis = Axis::new(config);
        let mut counter = UpdateCounter::ZERO;
        for step in row.steps {
            let received = match &step.response {
                Some(bytes) => Heard::from(Response::parse(&bytes.0)),
                None => Heard::Nothing,
            };
            axis.hear(Turn::Valid(counter), &received, 0);
            if let Some(action) = step.action {
                act(&mut axis, action)?;
            }
            counter = counter.next();
            let block = axis.transmission(Turn::Valid(counter)).main.emit();
            same("state", &step.state, &state(axis.state()))?;
            same("sent", &step.sent.0.as_slice(), &block.get(..8).unwrap_or(&[]))?;
            let off = CommandBlock::of(&block).map(CommandBlock::is_servo_off);
            same::<Result<bool, Error>>("a servo-off", &Ok(!axis.state().is_servo_on()), &off)?;
        }
        Ok(())
    })
}

fn act(axis: &mut Axis, action: Action) -> Verdict {
    let refused = |e: &dyn Display| unreadable(e.to_string());
    match action {
        // Where it does nothing, state and block say so.
        Action::SwitchOn => _ = axis.switch_on().ok(),
        Action::SwitchOff => axis.switch_off(),
        Action::Clear => axis.clear(),
        Action::Stop => axis.stop(StopCategory::Zero),
        Action::SetPosition(at) => axis.set_position(at).map_err(|e| refused(&e))?,
        Action::RefusedPosition(at) => same("the position is refused", &true, &axis.set_position(at).is_err())?,
        Action::SetRate(rate) => axis.set_rate(rate).map_err(|e| refused(&e))?,
        Action::SetControl(bits) => axis.set_control(ControlBits::from_bits_retain(bits)),
    }
    Ok(())
}

fn state(state: AxisState) -> String {
    let stopped = |reason: StopReason| match reason {
        StopReason::EchoTimeout => "echo_timeout".to_owned(),
        StopReason::WrongMacId(other) => format!("wrong_mac_id:{other}"),
        StopReason::Alarm => "alarm".to_owned(),
        StopReason::NotReady => "not_ready".to_owned(),
        StopReason::NotActive => "not_active".to_owned(),
        StopReason::ReadyTimeout => "ready_timeout".to_owned(),
        StopReason::ActiveTimeout => "active_timeout".to_owned(),
        StopReason::InactiveTimeout => "inactive_timeout".to_owned(),
        StopReason::CommandError(ErrorCode(code)) => format!("command_error:{code:04x}"),
        StopReason::Requested => "requested".to_owned(),
        other => other.to_string(),
    };
    match state {
        AxisState::Starting => "starting".to_owned(),
        AxisState::Off => "off".to_owned(),
        AxisState::SwitchingOn => "switching_on".to_owned(),
        AxisState::On => "on".to_owned(),
        AxisState::SwitchingOff => "switching_off".to_owned(),
        AxisState::Stopping(reason) => format!("stopping:{}", stopped(reason)),
        AxisState::Held(reason) => format!("held:{}", stopped(reason)),
        AxisState::Stopped(reason) => format!("stopped:{}", stopped(reason)),
    }
}
