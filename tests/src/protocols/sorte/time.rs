//! Line delay, clock discipline, and what fits into a cycle.

use serde::Deserialize;
use sorte_proto::timing::{CNC_CYCLE_NS, Timing};
use sorte_proto::{Clock, Correction, DelayModel, DelayReq, DeviceAddress, LineDelay, Place, Preamble};

use super::Origin;
use super::exchange::on_wire;
use crate::hex::Bytes;
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(untagged)]
enum DelayRow {
    Samples(Samples),
    Wires(Wires),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Samples {
    #[serde(rename = "origin")]
    _origin: Origin,
    rtt_ns: Vec<u32>,
    master_avg: u16,
    master_line_delay: u16,
    device_port_delay: u16,
    device_line_delay_next: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wires {
    #[serde(rename = "origin")]
    _origin: Origin,
    device_delay_req_wire: Bytes,
    device_last_delay_req_wire: Bytes,
}

fn measure(model: DelayModel, rtt_ns: &[u32]) -> LineDelay {
    let mut delay = LineDelay::new(model);
    for &ns in rtt_ns {
        delay.add(ns);
    }
    delay
}

pub(super) fn line_delay(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: DelayRow| match row {
        DelayRow::Samples(row) => {
            let master = measure(DelayModel::MASTER, &row.rtt_ns);
            let device = measure(DelayModel::DEVICE, &row.rtt_ns);
            same("samples", &(true, true), &(master.is_complete(), device.is_complete()))?;
            same("master_avg", &row.master_avg, &master.published_mean())?;
            same("master_line_delay", &row.master_line_delay, &master.published())?;
            same("device_port_delay", &row.device_port_delay, &device.published_mean())?;
            same("device_line_delay_next", &row.device_line_delay_next, &device.published())?;
            // The checked delay is the same or an error.
            for delay in [master, device] {
                same("checked", &delay.published(), &delay.checked().unwrap_or(delay.published()))?;
            }
            Ok(())
        }
        DelayRow::Wires(row) => {
            for (place, wire) in
                [(Place::Inner, row.device_delay_req_wire), (Place::Last, row.device_last_delay_req_wire)]
            {
                same("wire", &wire.0, &on_wire(Preamble::Middle, &DelayReq::of_device(place).emit()))?;
            }
            Ok(())
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SyncRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    sync_delay: u32,
    sync_ts: u32,
    count_now: Option<u32>,
    new_count: Option<u32>,
    cmp_increment: Option<u8>,
    compensation_ticks: Option<u16>,
}

pub(super) fn time_sync(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SyncRow| {
        let mut clock = Clock::new();
        for step in row.steps {
            let correction = clock.frame(step.sync_delay, step.sync_ts, step.count_now.unwrap_or(step.sync_ts));
            let expected = match (step.new_count, step.cmp_increment, step.compensation_ticks) {
                (Some(counter_ns), ..) => Correction::Set { counter_ns },
                (None, Some(increment), Some(ticks)) => Correction::Rate { increment, ticks },
                _ => Correction::None,
            };
            same("correction", &expected, &correction)?;
        }
        Ok(())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    #[serde(rename = "origin")]
    _origin: Origin,
    devices: u8,
    line_delay_ns: u16,
    master_frame_bytes_with_preamble: u32,
    master_tx_end_ns: u32,
    master_frame_end_at_last_device_ns: u32,
    last_device_frame_end_at_master_ns: u32,
    fits_4000ns: bool,
    tts_formula_ns: Vec<i64>,
}

pub(super) fn timing_budget(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Budget| {
        let delays = [row.line_delay_ns];
        let output_len = u16::from(row.devices) * 4;
        let line = Timing::new(&delays, row.devices).with_output_len(output_len);
        let budget = line.budget();
        same("master_frame_bytes_with_preamble", &row.master_frame_bytes_with_preamble, &budget.master_frame_bytes)?;
        same("master_tx_end_ns", &row.master_tx_end_ns, &budget.master_sent_ns)?;
        same(
            "master_frame_end_at_last_device_ns",
            &row.master_frame_end_at_last_device_ns,
            &budget.master_frame_at_last_ns,
        )?;
        same(
            "last_device_frame_end_at_master_ns",
            &row.last_device_frame_end_at_master_ns,
            &budget.device_frames_at_master_ns,
        )?;
        same("fits_4000ns", &row.fits_4000ns, &budget.fits(CNC_CYCLE_NS))?;
        let addresses = (1..=row.devices.min(8)).filter_map(DeviceAddress::new);
        same("tts_formula_ns", &row.tts_formula_ns, &addresses.filter_map(|a| line.send_time_ns(a)).collect())
    })
}
