//! One drive from power-up to a short move, block by block.
//!
//! `cargo run -p rtex-block --example exchange`

use core::num::NonZeroU16;

use rtex_block::device::{Drive, DriveConfig, OpenCodes};
use rtex_block::inspect::{Change, inspect};
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, Heard, Limits, Ring, SameMacId};
use rtex_block::{Command32, MacId, Response};

fn main() -> Result<(), SameMacId> {
    let mac_id = MacId::new(5).unwrap_or_default();
    let some = NonZeroU16::MIN.saturating_add(7);
    let limits = Limits::new(some, 50).with_ready(Some(200));
    let axis = Axis::new(AxisConfig::new(mac_id, ActiveCode::CyclicPosition, 500_000, limits));
    let mut ring = Ring::new([axis], 2)?;
    let mut drive =
        Drive::new(DriveConfig::new(mac_id, OpenCodes::INVENTED).with_sync_exchanges(4).with_servo_on_updates(2));
    let mut received = Heard::Nothing;
    let mut before = None;
    for now_ns in (0..8_000_000).step_by(500_000) {
        let [Command32 { main: command, .. }] = ring.update(&[received], now_ns);
        let Some(block) = drive.hear(&command.emit()) else { continue };
        received = Response::parse(&block).into();

        println!("{} -> {}   {}", hex(&command.emit()), hex(&block), ring.axes()[0].state());
        let report = inspect(&block);
        if let Some(before) = &before {
            for Change { field, before } in
                report.changes(before).filter(|change| change.field.name != "Update_Counter_Echo")
            {
                println!(
                    "{:36}{}: {} -> {}",
                    "",
                    field.name,
                    before.map_or(String::new(), |v| v.to_string()),
                    field.value
                );
            }
        }
        before = Some(report);

        if ring.all_are(AxisState::Off) {
            ring.switch_on().unwrap_or_else(|refused| println!("{refused}"));
        }
        let [axis] = ring.axes_mut();
        if axis.state() == AxisState::On {
            let next = axis.setpoint().wrapping_add(1_000);
            axis.set_position(next).unwrap_or_else(|refused| println!("{refused}"));
        }
    }
    Ok(())
}

fn hex(block: &[u8; 16]) -> String {
    format!("{:032x}", u128::from_be_bytes(*block))
}
