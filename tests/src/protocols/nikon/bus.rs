//! Several encoders answering one request.

use nikon_aformat::bus::{Addresses, Bus, Verdict as Judged};
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{Data, Expected};
use serde::Deserialize;

use super::{RowVersion, class, command, layout};
use crate::hex::Bits;
use crate::row::{Verdict, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BusRow {
    cmd: u8,
    layout: String,
    version: RowVersion,
    expected_encoders: u8,
    #[serde(rename = "case")]
    _case: String,
    line: Bits,
    expect: Vec<Slot>,
}

/// One reply, or one that never started.
#[derive(Deserialize, Debug, Default, PartialEq)]
#[serde(deny_unknown_fields)]
struct Slot {
    ok: Option<bool>,
    error: Option<String>,
    duplicate: Option<bool>,
    ea: Option<u8>,
    crc: Option<u8>,
    es: Option<u8>,
    es_any: Option<u8>,
    abs: Option<u64>,
    abs_high: Option<u32>,
    alm: Option<u16>,
    temp_raw: Option<u32>,
    velocity: Option<i32>,
    acceleration: Option<i16>,
}

impl Slot {
    fn error(error: &str) -> Self {
        Self { error: Some(error.to_owned()), ..Self::default() }
    }

    fn of(judged: Judged, received_crc: Option<u8>) -> Self {
        let response = match judged.outcome {
            Ok(response) => response,
            Err(error) => return Self::error(class(error)),
        };
        let mut slot = Self {
            ok: Some(true),
            duplicate: judged.duplicate.then_some(true),
            ea: Some(response.ea.get()),
            crc: received_crc,
            es: response.es().map(|es| es.bits()),
            es_any: response.es().is_none().then_some(response.has_status().into()),
            abs: response.abs(),
            alm: response.alm().map(|alm| alm.bits()),
            temp_raw: response.temperature().map(|temperature| temperature.raw().into()),
            velocity: response.velocity(),
            ..Self::default()
        };
        match response.data() {
            Some(Data::Abs24High { abs }) => slot.abs_high = Some(abs.get()),
            Some(Data::Abs24VelAcc { acceleration, .. }) => slot.acceleration = Some(acceleration),
            _ => {}
        }
        slot
    }
}

pub(super) fn line(_: &str, row: BusRow) -> Verdict {
    let (command, layout) = (command(row.cmd)?, layout(&row.layout)?);
    same(
        "multi-response in its version",
        &true,
        &(command.is_multi_response() && command.min_version() <= row.version.0),
    )?;
    let expected = Expected::new(layout, command);
    let mut bus = Bus::new(expected, Addresses::first(row.expected_encoders));
    let mut receiver = LineReceiver::bits(layout);
    let mut slots = Vec::new();
    for bit in row.line.0 {
        if let Some(reply) = receiver.push(bit) {
            let crc = reply.ok().map(|reply| reply.crc().got);
            slots.push(Slot::of(bus.push(reply), crc));
        }
    }
    if let Some(error) = receiver.finish() {
        slots.push(Slot::of(bus.push(Err(error)), None));
    }
    slots.extend((0..bus.not_started()).map(|_| Slot::error("missing")));
    same("replies", &row.expect, &slots)?;
    same(
        "every asked encoder is good, doubled or missing",
        &true,
        &bus.asked()
            .iter()
            .all(|ea| bus.response(ea).is_some() != (bus.missing().contains(ea) || bus.duplicates().contains(ea))),
    )
}
