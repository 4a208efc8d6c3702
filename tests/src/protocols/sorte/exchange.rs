//! The frames of the IO exchange and the process data in them.

use serde::Deserialize;
use sorte_proto::cut_through::{Passed, Rewriter};
use sorte_proto::timing::published_send_time_ns;
use sorte_proto::{
    DeviceAddress, DeviceFrame, DeviceFrameView, Discovery, DiscoveryView, Entry, MasterFrameView, Place, Preamble,
    Pto, PublishedDeviceFrame, Slice, Status, emit_master_frame_into, strip_preamble,
};

use super::chain::adds;
use super::{Origin, outcome, refused};
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(untagged)]
enum MasterRow {
    Stock(Stock),
    Sized(Sized),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stock {
    #[serde(rename = "origin")]
    _origin: Origin,
    out_data: Bytes,
    tx_timestamp: u16,
    frame: Bytes,
    wire: Bytes,
    devices: Vec<Taken>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Taken {
    address: u8,
    out_offset: u16,
    slice: Bytes,
    line_delay_previous: u16,
    master_ts_plus_delay: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sized {
    #[serde(rename = "origin")]
    _origin: Origin,
    out_lengths: Vec<u16>,
    out_offsets: Vec<u16>,
    tx_timestamp: u16,
    frame: Bytes,
    crc8: Hex,
}

fn build(output: &[u8], time_stamp: u16) -> Vec<u8> {
    let mut frame = vec![0; output.len() + MasterFrameView::OVERHEAD];
    let len = emit_master_frame_into(output, time_stamp, &mut frame);
    assert_eq!(len, Ok(frame.len()));
    frame
}

pub(super) fn on_wire(preamble: Preamble, frame: &[u8]) -> Vec<u8> {
    [preamble.bytes(), frame].concat()
}

pub(super) fn master(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MasterRow| match row {
        MasterRow::Stock(row) => {
            let frame = build(&row.out_data.0, row.tx_timestamp);
            same("frame", &row.frame.0, &frame)?;
            same("wire", &row.wire.0, &on_wire(Preamble::Short, &frame))?;
            same("stripped", &Ok(&frame[..]), &strip_preamble(&row.wire.0))?;
            let view = MasterFrameView::parse(row.out_data.0.len(), &row.frame.0).map_err(refused)?;
            same("tx_timestamp", &row.tx_timestamp, &view.time_stamp())?;
            for (index, device) in row.devices.into_iter().enumerate() {
                let len = device.slice.0.len();
                same("slice", &Ok(&device.slice.0[..]), &view.slice(device.out_offset, len as u16))?;
                same(
                    "master_ts_plus_delay",
                    &device.master_ts_plus_delay,
                    &view.reference_ns(device.line_delay_previous.into()),
                )?;
                same("address", &usize::from(device.address), &(index + 1))?;
            }
            Ok(())
        }
        MasterRow::Sized(row) => {
            let mut discovery = Discovery::request(Place::Inner).emit();
            for (&output, &offset) in row.out_lengths.iter().zip(&row.out_offsets) {
                let told = Rewriter::discovery(Entry { input: 0, output }, Status::empty()).pass(&mut discovery);
                let got = match told {
                    Ok(Passed::Discovery { assignment, .. }) => Ok(assignment.out_offset),
                    other => Err(other),
                };
                same("out_offsets", &Ok(offset), &got)?;
            }
            let total = DiscoveryView::parse(&discovery).map_err(refused)?.output_total();
            let view = MasterFrameView::parse(total.into(), &row.frame.0).map_err(refused)?;
            same("frame", &row.frame.0, &build(view.output(), row.tx_timestamp))?;
            same("crc8", &row.frame.0.get(usize::from(total) + 2).map(|&crc| crc.into()), &Some(row.crc8.0))?;
            let slices = row.out_offsets.iter().zip(&row.out_lengths).map(|(&offset, &len)| view.slice(offset, len));
            same("slices", &Ok(view.output().to_vec()), &slices.collect::<Result<Vec<_>, _>>().map(|s| s.concat()))
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MasterNegative {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "base")]
    _base: String,
    byte: Option<usize>,
    bit: Option<usize>,
    frame: Bytes,
    expect: String,
}

pub(super) fn master_negative(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MasterNegative| {
        same("expect", &row.expect, &outcome(&MasterFrameView::parse(16, &row.frame.0)))?;
        let (Some(byte), Some(bit)) = (row.byte, row.bit) else { return Ok(()) };
        // The flip undone is a good frame.
        let mut whole = row.frame.0;
        if let Some(flipped) = whole.get_mut(byte) {
            *flipped ^= 1 << bit;
        }
        same("byte, bit", &"Ok".to_owned(), &outcome(&MasterFrameView::parse(16, &whole)))
    })
}

#[derive(Deserialize)]
#[serde(untagged)]
enum DeviceRow {
    Designed(Designed),
    Refused(Refused),
    Published(Published),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Designed {
    #[serde(rename = "origin")]
    _origin: Origin,
    layout: String,
    address: u8,
    status: u8,
    last: bool,
    error: bool,
    payload: Bytes,
    frame: Bytes,
    wire: Bytes,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Refused {
    #[serde(rename = "origin")]
    _origin: Origin,
    layout: String,
    frame: Bytes,
    expect: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Published {
    #[serde(rename = "origin")]
    _origin: Origin,
    #[serde(rename = "layout")]
    _layout: String,
    address: u8,
    last: bool,
    error: bool,
    drv_status: u8,
    wire_without_crc: Bytes,
    send_time_ns: u32,
}

/// "3-byte payload" is 3.
fn payload_len(layout: &str) -> Result<usize, Fault> {
    let number = layout.split_once("-byte payload").and_then(|(number, _)| number.parse().ok());
    number.ok_or_else(|| Fault::Unreadable(format!("layout {layout:?}")))
}

pub(super) fn device(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: DeviceRow| match row {
        DeviceRow::Designed(row) => {
            let view = DeviceFrameView::parse(payload_len(&row.layout)?, &row.frame.0).map_err(refused)?;
            same("address", &row.address, &view.address().get())?;
            same("status", &Status::from_bits_retain(row.status), &view.status())?;
            same("last, error", &Status::from_bits_retain(row.status), &adds(row.last, row.error))?;
            same("payload", &&row.payload.0[..], &view.payload())?;
            same("wire", &row.wire.0, &on_wire(Preamble::Short, &row.frame.0))?;
            if let Ok(payload) = view.payload().try_into() {
                let mut frame = [0; DeviceFrame::<3>::LEN];
                let frame_of = DeviceFrame::<3> { address: view.address(), status: view.status(), payload };
                let len = frame_of.emit_into(&mut frame);
                same("frame", &Ok(row.frame.0.len()), &len)?;
                same("frame", &row.frame.0, &frame.to_vec())?;
            }
            Ok(())
        }
        DeviceRow::Refused(row) => {
            let len = payload_len(&row.layout)?;
            same("expect", &row.expect, &outcome(&DeviceFrameView::parse(len, &row.frame.0)))
        }
        DeviceRow::Published(row) => {
            let address = DeviceAddress::try_from(row.address).map_err(|error| Fault::Unreadable(error.to_string()))?;
            let status = adds(row.last, row.error);
            let frame = PublishedDeviceFrame { address, status, drv8711_status: row.drv_status };
            let mut wire = on_wire(Preamble::Short, &frame.emit_without_crc());
            same("wire_without_crc", &row.wire_without_crc.0, &wire)?;
            wire.push(0);
            let parsed = strip_preamble(&wire).and_then(PublishedDeviceFrame::parse_unchecked);
            same("parsed", &Ok(frame), &parsed)?;
            same("send_time_ns", &row.send_time_ns, &published_send_time_ns(address))
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SliceRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    slice: Bytes,
    pto_raw: u16,
    command: u16,
    driver_enabled: bool,
    kind: String,
    start_ns: Option<u16>,
    raw_time: Option<u16>,
    direction: Option<u8>,
}

pub(super) fn process_data_slice(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SliceRow| {
        let bytes = <[u8; 4]>::try_from(&row.slice.0[..]).map_err(|e| Fault::Unreadable(e.to_string()))?;
        let slice = Slice::parse(bytes);
        same("slice", &bytes, &slice.emit())?;
        same("pto_raw", &row.pto_raw, &slice.pto.word())?;
        same("command", &row.command, &slice.command)?;
        same("driver_enabled", &row.driver_enabled, &slice.pto.driver_enabled())?;
        let (kind, raw_time) = match slice.pto {
            Pto::NoPulse { .. } => ("NoPulse", None),
            Pto::Pulse { .. } => ("Pulse", None),
            Pto::DriverOff => ("DriverOff", None),
            Pto::Reserved(word) => ("OutOfRange", Some(word.time())),
        };
        same("kind", &row.kind.as_str(), &kind)?;
        same("start_ns", &row.start_ns, &slice.pto.start().map(sorte_proto::StartTime::ns))?;
        same("raw_time", &row.raw_time, &raw_time)?;
        same("direction", &row.direction, &slice.pto.direction().map(|d| d.is_high().into()))
    })
}
