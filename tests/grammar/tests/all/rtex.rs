use rtex_block::device::{DriveConfig, OpenCodes};
use rtex_block::{Command, Evidence, MacId, Response, UpdateCounter};

/// An answer of drive 5 in CP: servo on, in position, position 998, speed 10000, torque -100.
const SOUND: [u8; 16] = [0xc5, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];

/// A command where a response is due.
const DAMAGED: [u8; 16] = [0x45, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];

/// A cyclic code that is not defined.
const UNDEFINED: [u8; 16] = [0xc5, 0x70, 0xc1, 0, 0xe6, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];

fn mac_id() -> MacId {
    MacId::new(5).unwrap()
}

fn command() -> Command {
    Command::idle(mac_id(), UpdateCounter::new(2).unwrap())
}

fn evidence() -> Evidence {
    Evidence::of(&Response::parse(&SOUND).unwrap(), 5_000_000_000)
}

decode! { rtex_block::Response(&[u8]); with (); sound &SOUND; damaged &DAMAGED => "direction" }
encode! { rtex_block::Command = command() }
code! { rtex_block::CyclicCode: 2; unknown 5 }
feedback! { rtex_block: evidence(), sampled at 5_000_000_000; "`axis.evidence()`" }
device! {
    rtex_block::"Drive::new(DriveConfig)" = rtex_block::device::Drive::new(DriveConfig::new(mac_id(), OpenCodes::INVENTED));
    with Behaviour::new().with_echo_lag(2);
    heard |_at| (&command().emit()); "&[u8; N])`, of a command `&emit()"
}
inspect! { rtex_block::inspect(; bytes); damaged &UNDEFINED => "cyclic_code" }
log! { rtex_block: Command, Response, rtex_block::CyclicCode, rtex_block::master::Failure }
counters! { rtex_block }
differs! {
    EXCHANGE: "an update period has its own clock: `Axis::new(AxisConfig)`, `transmission(Turn)`, `hear(Turn, &Heard, end_ns)`";
    PROCEDURE: "counts update periods: `start(&mut axis)` of `master::procedure::{Home, ClearAlarm, ..}`, then `receive(&mut axis)` in each; `master::Run` does both";
}
