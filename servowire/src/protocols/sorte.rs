//! TI SORTE: the frames of a network capture, an event a packet.
//!
//! Packets of an Ethernet interface are start-up frames with their FCS; packets of another interface are frames of the
//! IO exchange, which have neither type nor addresses: the one with SA 0 is the master's.

use std::fmt::Write as _;

use pcap_file::DataLink;
use sorte_proto::{
    DeviceFrameView, DiscoveryView, Error, FrameType, LongFrame, MasterFrameView, ParamView, Slice, Status, SyncView,
};

use crate::capture::pcapng::{Packet, Pcapng};
use crate::event::{Direction, Event, Field, Place, Refusal, Verdict};
use crate::line::Stop;
use crate::output::{Output, Sink};

/// The names of all fields.
pub const FIELDS: &[&str] = &[
    "STATUS",
    "devices",
    "in",
    "out",
    "cycle_time",
    "delay_burst",
    "ipg",
    "crc_mode",
    "time stamp",
    "delay",
    "SA",
    "data",
    "PTO 1",
    "PTO 2",
    "PTO 3",
    "PTO 4",
];
const PTO: [&str; 4] = ["PTO 1", "PTO 2", "PTO 3", "PTO 4"];

/// One byte at 100 Mbit/s, in picoseconds.
const BYTE: i64 = 80_000;

/// Decodes a capture to its end.
pub(super) fn decode(mut capture: Pcapng, out: &mut Output<'_>) -> Result<(), Stop> {
    while let Some(packet) = capture.packet()? {
        out.event(&event(&packet))?;
        if capture.is_live() {
            out.flush()?;
        }
        out.tick();
    }
    Ok(())
}

fn event(packet: &Packet) -> Event {
    let frame = if packet.link == DataLink::ETHERNET { long(&packet.bytes) } else { exchange(&packet.bytes) };
    let (kind, fields, verdict) = match frame {
        Ok((kind, fields)) => (kind, fields, Verdict::Ok),
        Err(error) => (guess(packet), Vec::new(), Refusal::new(error.class().name(), error).into()),
    };
    let direction = match (packet.link, packet.inbound) {
        (DataLink::ETHERNET, Some(true)) => Some(Direction::Answer),
        (DataLink::ETHERNET, Some(false)) => Some(Direction::Request),
        _ => None,
    };
    let end = packet.time.saturating_add(BYTE.saturating_mul(packet.bytes.len() as i64));
    let place = Place::Time { start: packet.time, end };
    Event::new(place, direction, kind, fields, verdict)
}

/// What a refused packet was meant to be.
fn guess(packet: &Packet) -> &'static str {
    let code = packet.bytes.get(2).copied().and_then(FrameType::from_code);
    match (packet.link, packet.bytes.first()) {
        (DataLink::ETHERNET, _) => code.map_or("?", FrameType::name),
        (_, Some(0)) => "master",
        _ => "device",
    }
}

type Decoded = Result<(&'static str, Vec<Field>), Error>;

fn long(bytes: &[u8]) -> Decoded {
    let frame = LongFrame::parse(bytes)?;
    let mut fields = vec![status(frame.status())];
    match frame.frame_type() {
        FrameType::Discovery => {
            let view = DiscoveryView::of(frame)?;
            fields.push(Field::number("devices", view.count()));
            fields.push(Field::number("in", view.input_total()));
            fields.push(Field::number("out", view.output_total()));
        }
        FrameType::Param => {
            let parameters = ParamView::of(frame)?.parameters();
            fields.push(Field::measured("cycle_time", parameters.cycle_time_ns, "ns"));
            fields.push(Field::number("delay_burst", parameters.delay_burst));
            fields.push(Field::measured("ipg", i64::from(parameters.ipg_5ns) * 5, "ns"));
            fields.push(Field::hex("crc_mode", parameters.crc_mode.byte(), 2));
        }
        FrameType::Sync => {
            let view = SyncView::of(frame)?;
            fields.push(Field::measured("time stamp", view.time_stamp_ns(), "ns"));
            fields.push(Field::measured("delay", view.delay_ns(), "ns"));
        }
        FrameType::DelayReq | FrameType::DelayResp => {}
        _ => fields.push(data(frame.payload())),
    }
    Ok((frame.frame_type().name(), fields))
}

fn exchange(bytes: &[u8]) -> Decoded {
    if bytes.first() == Some(&0) {
        let view = MasterFrameView::parse(bytes.len().saturating_sub(MasterFrameView::OVERHEAD), bytes)?;
        let mut fields = vec![status(view.status())];
        // Four bytes a device is the CNC machine; anything else is shown as it is.
        if view.output().len() % 4 == 0 && view.output().len() <= 16 {
            let slices = view.output().chunks_exact(4).filter_map(|bytes| bytes.first_chunk());
            fields.extend(PTO.into_iter().zip(slices).map(|(name, bytes)| Field::text(name, Slice::parse(*bytes).pto)));
        } else {
            fields.push(data(view.output()));
        }
        fields.push(Field::measured("time stamp", view.time_stamp(), "ns"));
        return Ok(("master", fields));
    }
    let view = DeviceFrameView::parse(bytes.len().saturating_sub(DeviceFrameView::OVERHEAD), bytes)?;
    Ok(("device", vec![Field::number("SA", view.address().get()), status(view.status()), data(view.payload())]))
}

/// Bytes that are shown as they are, without spaces.
fn data(bytes: &[u8]) -> Field {
    let mut digits = String::new();
    for byte in bytes {
        // A String takes everything.
        let _ = write!(digits, "{byte:02X}");
    }
    Field::text("data", digits)
}

fn status(status: Status) -> Field {
    Field::flags("STATUS", &status, 2)
}
