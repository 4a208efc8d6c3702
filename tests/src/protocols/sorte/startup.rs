//! What a master sends from reset to the IO exchange.

use std::collections::BTreeMap;

use serde::Deserialize;
use sorte_proto::cut_through::Rewriter;
use sorte_proto::master::{Action, Config, Heard, Master, Outgoing};
use sorte_proto::{
    Discovery, Entry, FrameType, LineDelay, Link, MasterFrameView, Parameters, Place, Preamble, Status, Sync,
    emit_master_frame_into, strip_preamble,
};

use super::Origin;
use super::exchange::on_wire;
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(untagged)]
enum StartupRow {
    Sync(SyncRow),
    Exchange(ExchangeRow),
    Frame(FrameRow),
    Summary(SummaryRow),
    HostView(HostView),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    frame: String,
    index: u16,
    of: u16,
    wire: Bytes,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SyncRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    frame: String,
    index: u16,
    of: u16,
    wire: Bytes,
    cmp3_ns: u32,
    line_delay_ns: u16,
    timestamp_ns: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ExchangeRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    frame: String,
    #[serde(rename = "index")]
    _index: u16,
    #[serde(rename = "of")]
    _of: (),
    wire: Bytes,
    out_data: Bytes,
    crc8: Hex,
    tx_timestamp: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SummaryRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "summary")]
    _summary: String,
    counts: BTreeMap<String, u16>,
    devices: u8,
    rtt_ns: Vec<u32>,
    rtt_sum16: u16,
    rtt_avg: u16,
    line_delay_ns: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HostView {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "host_view")]
    _of: String,
    offset_of_count_in_rx_image: usize,
    rx_image_head: Bytes,
    count: u16,
}

/// The default master, with the parameters that the published one sends, with `devices` stock devices, whose delay requests come back after the times of `rtt_ns`: all
/// frames until the first of the exchange, with the times at which they are triggered.
fn start_up(devices: u8, rtt_ns: &[u32]) -> (Vec<(u64, Outgoing)>, Master) {
    let mut master = Master::new(Config::default().with_parameters(Parameters::STOCK));
    master.set_link(Link::Up);
    let (mut sent, mut now_ns, mut rtt) = (Vec::new(), 0, rtt_ns.iter());
    loop {
        match master.poll(now_ns) {
            Action::Wait { until_ns } => now_ns = until_ns,
            Action::Send { at_ns, frame } => {
                sent.push((at_ns, frame));
                let answer = answer(frame, devices);
                let after = if let Outgoing::DelayReq(_) = frame { rtt.next().copied().unwrap_or(400) } else { 400 };
                assert_eq!(
                    master.hear(&answer, at_ns + u64::from(frame.preamble().capture_ns() + after)),
                    Ok(Heard::StartUp)
                );
            }
            Action::Exchange { .. } | Action::Restart { .. } => return (sent, master),
        }
    }
}

/// What device `n` of this many adds to STATUS.
fn last_of<T: PartialEq>(n: T, devices: T) -> Status {
    if n == devices { Status::LAST } else { Status::empty() }
}

fn answer(frame: Outgoing, devices: u8) -> Vec<u8> {
    match frame {
        Outgoing::Discovery { place } => {
            let mut frame = Discovery::request(place).emit();
            for n in 1..=devices {
                assert!(Rewriter::discovery(Entry::STOCK, last_of(n, devices)).pass(&mut frame).is_ok());
            }
            frame.to_vec()
        }
        Outgoing::Sync(frame) => {
            let mut frame = frame.emit();
            for n in 1..=devices {
                assert!(Rewriter::sync(0, last_of(n, devices)).pass(&mut frame).is_ok());
            }
            frame.to_vec()
        }
        Outgoing::Param(frame) => frame.emit().to_vec(),
        Outgoing::DelayReq(frame) => frame.emit().to_vec(),
    }
}

fn kind(frame: &Outgoing) -> FrameType {
    match frame {
        Outgoing::Discovery { .. } => FrameType::Discovery,
        Outgoing::Param(_) => FrameType::Param,
        Outgoing::DelayReq(_) => FrameType::DelayReq,
        Outgoing::Sync(_) => FrameType::Sync,
    }
}

fn code(name: &str) -> Result<FrameType, Fault> {
    match name {
        "DISCOVERY" => Ok(FrameType::Discovery),
        "PARAM" => Ok(FrameType::Param),
        "DELAY_REQ" => Ok(FrameType::DelayReq),
        "SYNC" => Ok(FrameType::Sync),
        _ => Err(Fault::Unreadable(format!("frame {name}"))),
    }
}

/// The frame with its preamble; DISCOVERY with the debug pattern that the published master fills it with.
fn wire(frame: &Outgoing) -> Vec<u8> {
    if let Outgoing::Discovery { place } = frame {
        return on_wire(Preamble::Long, &Discovery::published_request(*place).emit());
    }
    let mut buffer = [0; Discovery::LEN];
    let len = frame.emit_into(&mut buffer).unwrap_or_default();
    on_wire(frame.preamble(), buffer.get(..len).unwrap_or_default())
}

pub(super) fn master_startup(rows: &[Row]) -> Vec<Verdict> {
    // The round trips of the published run are in its summary.
    let summary = rows.iter().find_map(|row| row.read::<SummaryRow>().ok());
    let (devices, rtt_ns) = summary.map_or((4, vec![472; 16]), |row| (row.devices, row.rtt_ns));
    let (sent, master) = start_up(devices, &rtt_ns);
    let of_type =
        |t: FrameType| -> Vec<&(u64, Outgoing)> { sent.iter().filter(|(_, frame)| kind(frame) == t).collect() };
    each(rows, |row: StartupRow| match row {
        StartupRow::Frame(row) => {
            let frames = of_type(code(&row.frame)?);
            same("of", &usize::from(row.of), &frames.len())?;
            same("wire", &Some(row.wire.0), &frames.get(usize::from(row.index)).map(|(_, frame)| wire(frame)))
        }
        StartupRow::Sync(row) => {
            let frames = of_type(code(&row.frame)?);
            same("of", &usize::from(row.of), &frames.len())?;
            // When our master triggers it, on its own time.
            let triggered = frames.get(usize::from(row.index)).map(|(at_ns, _)| at_ns.wrapping_sub(master.epoch_ns()));
            same("cmp3_ns", &Some(u64::from(row.cmp3_ns)), &triggered)?;
            let last = if row.index + 1 == row.of { Place::Last } else { Place::Inner };
            let frame = Sync::of_master(row.cmp3_ns, row.line_delay_ns, last);
            same("timestamp_ns", &row.timestamp_ns, &frame.time_stamp_ns)?;
            same("wire", &row.wire.0, &on_wire(Preamble::Middle, &frame.emit()))?;
            if master.line_delay().checked() == Ok(row.line_delay_ns) {
                same("sent", &Some(row.wire.0), &frames.get(usize::from(row.index)).map(|(_, frame)| wire(frame)))?;
            }
            Ok(())
        }
        StartupRow::Exchange(row) => {
            same("frame", &"IOEX_MASTER", &row.frame.as_str())?;
            let mut frame = vec![0; row.out_data.0.len() + MasterFrameView::OVERHEAD];
            let len = emit_master_frame_into(&row.out_data.0, row.tx_timestamp, &mut frame);
            same("len", &Ok(frame.len()), &len)?;
            same("wire", &row.wire.0, &on_wire(Preamble::Short, &frame))?;
            let crc8 = frame.len().checked_sub(3).and_then(|at| frame.get(at)).copied();
            same("crc8", &Some(row.crc8.0), &crc8.map(u64::from))
        }
        StartupRow::Summary(row) => {
            let (sent, master) = start_up(row.devices, &row.rtt_ns);
            for (name, count) in row.counts {
                let code = code(&name)?;
                same("counts", &usize::from(count), &sent.iter().filter(|(_, frame)| kind(frame) == code).count())?;
            }
            let line: &LineDelay = master.line_delay();
            same("devices", &row.devices, &master.network().devices())?;
            same("rtt_sum16", &u32::from(row.rtt_sum16), &(row.rtt_ns.iter().sum::<u32>() & 0xffff))?;
            same("rtt_avg", &row.rtt_avg, &line.published_mean())?;
            same("line_delay_ns", &Ok(row.line_delay_ns), &line.checked())
        }
        StartupRow::HostView(row) => {
            let image = &row.rx_image_head.0;
            let at = row.offset_of_count_in_rx_image;
            let count = image.get(at..at + 2).and_then(|b| <[u8; 2]>::try_from(b).ok()).map(u16::from_le_bytes);
            same("count", &Some(row.count), &count)?;
            // The answer that our master gets from as many devices begins the same way.
            let mut frame = Discovery::published_request(Place::Last).emit();
            for n in 1..=row.count {
                let _: Result<_, _> = Rewriter::discovery(Entry::STOCK, last_of(n, row.count)).pass(&mut frame);
            }
            let head = strip_preamble(image).unwrap_or_default();
            same("rx_image_head", &Some(head), &frame.get(..head.len()))
        }
    })
}
