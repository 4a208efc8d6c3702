//! DISCOVERY and SYNC through a line of devices, byte by byte.

use serde::Deserialize;
use sha2::{Digest, Sha256};
use sorte_proto::cut_through::{Passed, Rewriter};
use sorte_proto::{Discovery, Entry, Place, Status, Sync};

use super::{Origin, refused};
use crate::hex::Bytes;
use crate::row::{Fault, Row, Verdict, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Hop {
    #[serde(rename = "origin")]
    _origin: Origin,
    chain: u16,
    #[serde(rename = "hop")]
    number: u16,
    is_last: bool,
    prev_frame_crc_error: bool,
    rx_head: Bytes,
    tx_head: Bytes,
    tx_sha256: Bytes,
    tx_fcs: Bytes,
    len: usize,
    device: Device,
    state_after: String,
    tx: Option<Bytes>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Device {
    address: u8,
    in_offset: u16,
    out_offset: u16,
}

/// The frame on its way; rows of one pass follow each other.
struct Pass {
    chain: u16,
    hop: u16,
    last_round: bool,
    frame: [u8; Discovery::LEN],
}

/// A row as one of a pass that is under way, or as the first of a new one.
pub(super) fn discovery(rows: &[Row]) -> Vec<Verdict> {
    let mut pass: Option<Pass> = None;
    rows.iter().map(|row| row.read().and_then(|hop: Hop| check_hop(&mut pass, &hop))).collect()
}

/// What a device adds to STATUS.
pub(super) fn adds(last: bool, error: bool) -> Status {
    let mut adds = Status::empty();
    adds.set(Status::LAST, last);
    adds.set(Status::ERROR, error);
    adds
}

fn check_hop(pass: &mut Option<Pass>, row: &Hop) -> Verdict {
    let (Some(status), false) = (row.rx_head.0.get(3), row.number == 0) else {
        return Err(Fault::Unreadable("rx_head, hop".to_owned()));
    };
    let last_round = Status::from_bits_retain(*status).contains(Status::STATE_CHANGE);
    let goes_on = |p: &Pass| p.chain == row.chain && p.hop < row.number && p.last_round == last_round;
    let place = if last_round { Place::Last } else { Place::Inner };
    let mut current = match pass.take() {
        Some(current) if goes_on(&current) => current,
        _ => Pass { chain: row.chain, hop: 0, last_round, frame: Discovery::published_request(place).emit() },
    };
    while current.hop + 1 < row.number {
        let _: Result<_, _> = Rewriter::discovery(Entry::STOCK, Status::empty()).pass(&mut current.frame);
        current.hop += 1;
    }
    // What the row shows of the frame before must be what we have; an error flag of an unlisted hop is taken from it.
    let mut before = Discovery::parse(&current.frame).map_err(refused)?;
    before.status = Status::from_bits_retain(*status);
    let before = before.emit();
    same("rx_head", &Some(&row.rx_head.0[..]), &before.get(..row.rx_head.0.len()))?;

    let last = row.is_last;
    let mut after = before;
    let told = Rewriter::discovery(Entry::STOCK, adds(last, row.prev_frame_crc_error)).pass(&mut after);
    current.hop = row.number;
    current.frame = after;

    let got = match told {
        Ok(Passed::Discovery { status, assignment: a }) => {
            Ok((status.bits(), a.address.get(), a.in_offset, a.out_offset))
        }
        other => Err(other),
    };
    let device = &row.device;
    same("device", &Ok((*status, device.address, device.in_offset, device.out_offset)), &got)?;
    same("len", &row.len, &after.len())?;
    same("tx_head", &Some(&row.tx_head.0[..]), &after.get(..row.tx_head.0.len()))?;
    same("tx_fcs", &Some(&row.tx_fcs.0[..]), &after.get(1026..))?;
    same("tx_sha256", &row.tx_sha256.0, &Sha256::digest(after).to_vec())?;
    if let Some(tx) = &row.tx {
        same("tx", &tx.0, &after.to_vec())?;
    }
    let state = super::device::after_discovery(&before, last);
    same("state_after", &row.state_after, &state)?;
    *pass = Some(current);
    Ok(())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SyncRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    master_frame: Bytes,
    hops: Vec<SyncHop>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SyncHop {
    hop: usize,
    is_last: bool,
    prev_frame_crc_error: bool,
    line_delay_next: u16,
    rx: Bytes,
    tx: Bytes,
    stored_sync_delay: u32,
    stored_sync_ts: u32,
    rx_sof_capture: u32,
    stored_line_delay_previous: u16,
    state_after: String,
}

pub(super) fn sync(rows: &[Row]) -> Vec<Verdict> {
    crate::row::each(rows, |row: SyncRow| {
        let mut wire = row.master_frame.0;
        for (index, hop) in row.hops.into_iter().enumerate() {
            same("hop", &hop.hop, &(index + 1))?;
            same("rx", &hop.rx.0, &wire)?;
            let (line, last) = (hop.line_delay_next, hop.is_last);
            let adds = adds(last, hop.prev_frame_crc_error);
            let mut passed = wire.clone();
            let told = Rewriter::sync(line, adds).pass(&mut passed);
            same("tx", &hop.tx.0, &passed)?;
            let received = Sync::parse(&wire);
            same("told", &told, &received.map(Passed::Sync))?;
            same("stored_sync_delay", &Ok(hop.stored_sync_delay), &received.map(|f| f.time_stamp_ns))?;
            same("stored_line_delay_previous", &Ok(hop.stored_line_delay_previous), &received.map(|f| f.delay_ns))?;
            let (state, stored_ts) = super::device::after_sync(&wire, last, hop.rx_sof_capture);
            same("state_after", &hop.state_after, &state)?;
            same("stored_sync_ts", &Some(hop.stored_sync_ts), &stored_ts)?;
            wire = passed;
        }
        Ok(())
    })
}
