//! Numbers of the documents against the constants of the crate.

use rtex_block::master::{ControlPhase, Led, led};
use rtex_block::position::MAX_PULSES_PER_S;
use rtex_block::timing::FrameTime;
use rtex_block::type_code::{self, homing, monitor, parameter, profile, reset, system_id};
use rtex_block::{
    Alarm, Code, ControlBits, CyclicCode, ErrorCode, Execution, LatchFlags, MacId, NonCyclicCode, Pr, ProfileFlags,
    StatusFlags, SubCode, TypeCode,
};
use serde::Deserialize;
use serde_json::{Value, json};

use super::fields::unreadable;
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Constant {
    constant: String,
    value: Value,
}

pub(super) fn constants(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Constant| {
        let real = constant(&row.constant).ok_or_else(|| unreadable(format!("no constant {}", row.constant)))?;
        same("value", &row.value, &real)
    })
}

fn constant(name: &str) -> Option<Value> {
    let (group, rest) = name.split_once('.')?;
    Some(match group {
        "code" => named_code(rest)?.get().into(),
        "cyclic" => (CyclicCode::ALL.into_iter().find(|c| c.name().to_lowercase() == rest)? as u8).into(),
        "noncyclic" => {
            (NonCyclicCode::ALL.into_iter().find(|c| c.name().to_lowercase().replace(' ', "_") == rest)? as u8).into()
        }
        "sub" => {
            let all = [SubCode::Normal, SubCode::SystemId, SubCode::Monitor];
            (all.into_iter().find(|c| c.name().to_lowercase().replace(' ', "_") == rest)? as u8).into()
        }
        "control" => ControlBits::from_name(&rest.to_uppercase())?.bits().into(),
        "status" => StatusFlags::from_name(&rest.to_uppercase())?.bits().into(),
        "execution" => Execution::from_name(&rest.to_uppercase())?.bits().into(),
        "latch" => LatchFlags::from_name(&rest.to_uppercase())?.bits().into(),
        "profile" => ProfileFlags::from_name(&rest.to_uppercase())?.bits().into(),
        "error" => error(rest)?.0.into(),
        "alarm" => {
            let Alarm { main, sub } = alarm(rest)?;
            json!([main, sub])
        }
        "type" => kind(rest)?.into(),
        "conventional" => conventional(rest)?.get().into(),
        _ => other(name)?.into(),
    })
}

fn named_code(name: &str) -> Option<Code> {
    Some(match name {
        "nop" => Code::NOP,
        "profile_idle" => Code::PROFILE_IDLE,
        "profile_start" => Code::PROFILE_START,
        "cyclic_position" => Code::CYCLIC_POSITION,
        _ => return None,
    })
}

fn error(name: &str) -> Option<ErrorCode> {
    Some(match name {
        "mac_id" => ErrorCode::MAC_ID,
        "direction" => ErrorCode::DIRECTION,
        "cyclic_code" => ErrorCode::CYCLIC_CODE,
        "non_cyclic_code" => ErrorCode::NON_CYCLIC_CODE,
        "cyclic_mode" => ErrorCode::CYCLIC_MODE,
        "type_code" => ErrorCode::TYPE_CODE,
        "argument" => ErrorCode::ARGUMENT,
        "feed_forward" => ErrorCode::FEED_FORWARD,
        _ => return None,
    })
}

fn alarm(name: &str) -> Option<Alarm> {
    Some(match name {
        "command_step" => Alarm::COMMAND_STEP,
        "cyclic_data" => Alarm::CYCLIC_DATA,
        "cyclic_code" => Alarm::CYCLIC_CODE,
        "update_counter" => Alarm::UPDATE_COUNTER,
        "command" => Alarm::COMMAND,
        _ => return None,
    })
}

fn kind(name: &str) -> Option<u16> {
    Some(match name {
        "homing.set_actual_position" => homing::SET_ACTUAL_POSITION.into(),
        "homing.set_command_position" => homing::SET_COMMAND_POSITION.into(),
        "homing.latch_state" => homing::LATCH_STATE.into(),
        "profile.relative" => profile::RELATIVE.into(),
        _ => type_code(name)?.get(),
    })
}

fn type_code(name: &str) -> Option<TypeCode> {
    Some(match name {
        "reset.software" => reset::SOFTWARE,
        "reset.attribute_c" => reset::ATTRIBUTE_C,
        "parameter.write" => parameter::WRITE,
        "system_id.vendor_name" => system_id::VENDOR_NAME,
        "system_id.device_type" => system_id::DEVICE_TYPE,
        "system_id.model" => system_id::MODEL,
        "system_id.serial_number" => system_id::SERIAL_NUMBER,
        "system_id.software_version" => system_id::SOFTWARE_VERSION,
        "system_id.driver_type" => system_id::DRIVER_TYPE,
        "system_id.scale_vendor_id" => system_id::SCALE_VENDOR_ID,
        "system_id.scale_model_id" => system_id::SCALE_MODEL_ID,
        "monitor.perr" => monitor::PERR,
        "monitor.mpos" => monitor::MPOS,
        "monitor.aspd" => monitor::ASPD,
        "monitor.trq" => monitor::TRQ,
        "monitor.apos" => monitor::APOS,
        "monitor.ipos" => monitor::IPOS,
        "monitor.lpos1" => monitor::LPOS1,
        "monitor.lpos2" => monitor::LPOS2,
        "monitor.mspd" => monitor::MSPD,
        "monitor.regenerative_load" => monitor::REGENERATIVE_LOAD,
        "monitor.overload" => monitor::OVERLOAD,
        _ => return None,
    })
}

fn conventional(name: &str) -> Option<TypeCode> {
    let code = type_code(name)?;
    if name.starts_with("monitor") { monitor::conventional(code) } else { type_code::system_id::conventional(code) }
}

fn other(name: &str) -> Option<u64> {
    Some(match name {
        "position.max_pulses_per_s" => MAX_PULSES_PER_S.into(),
        "ring.most_axes" => MacId::COUNT as u64,
        "block.bytes" => rtex_block::LEN as u64,
        "block.bytes32" => rtex_block::LEN32 as u64,
        "index.pr7_20" => Pr { class: 7, number: 20 }.index().into(),
        "frame.one_axis_ns" => FrameTime::GUIDE.one_ns.into(),
        "frame.full_ns" => FrameTime::GUIDE.full_ns.into(),
        "led.half_period_ms" => (0..10_000).find(|t_ms| led(ControlPhase::Prepare, None, *t_ms) == Led::Off)?,
        _ => return None,
    })
}
