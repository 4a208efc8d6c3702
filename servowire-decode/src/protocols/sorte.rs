//! TI SORTE: the frames of a network capture, an event a packet.
//!
//! Packets of an Ethernet interface are start-up frames with their FCS; packets of another interface are frames of the
//! IO exchange, which have neither type nor addresses: the one with SA 0 is the master's.

use std::fmt::Write as _;

use pcap_file::DataLink;
use sorte_proto::inspect::{During, Frame, inspect};
use sorte_proto::{FrameType, Param, Status};

use crate::capture::pcapng::Packet;
use crate::codec::{Codec, Facts};
use crate::event::{Direction, Event, Field, Place, Refusal, Span, Verdict};

/// The names of all fields.
const FIELDS: &[&str] = &[
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

/// SORTE in the table.
pub(super) struct Sorte;

impl Codec for Sorte {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "sorte",
                title: "SORTE",
                about: "TI SORTE, from a network capture",
                needs: "SORTE is decoded from a pcapng file",
                fields: FIELDS,
                ..Facts::NONE
            }
        }
    }

    fn packet(&self, packet: &Packet) -> Option<Event> {
        Some(event(packet))
    }
}

fn event(packet: &Packet) -> Event {
    let during = if packet.link == DataLink::ETHERNET { During::StartUp } else { During::Exchange };
    let report = inspect(during, &packet.bytes);
    let kind = report.kind().name();
    let (fields, verdict) = match (report.error(), report.frame()) {
        (None, Some(frame)) => (fields(&frame), Verdict::Ok),
        (None, None) => (Vec::new(), Verdict::Ok),
        (Some(error), _) => (Vec::new(), Refusal::new(error.class().name(), error).into()),
    };
    let direction = match (packet.link, packet.inbound) {
        (DataLink::ETHERNET, Some(true)) => Some(Direction::Answer),
        (DataLink::ETHERNET, Some(false)) => Some(Direction::Request),
        _ => None,
    };
    let end = packet.time + BYTE.saturating_mul(packet.bytes.len() as i64);
    let place = Place::Time { start: packet.time, end };
    let event = Event::new(place, direction, kind, fields, verdict);
    event.locate(|name| {
        let (first, last) = bytes(report.frame()?, packet.bytes.len(), name)?;
        Some(Span::even(place, 8 * packet.bytes.len() as u32, 8 * first as u32, 8 * last as u32 + 7))
    })
}

/// The first and the last byte of a field, of `len` in all.
fn bytes(frame: Frame<'_>, len: usize, name: &str) -> Option<(usize, usize)> {
    Some(match (frame, name) {
        (Frame::Master(_) | Frame::Device(_), "STATUS") => (1, 1),
        (_, "STATUS") => (3, 3),
        (Frame::Discovery(_), "devices") => (4, 5),
        (Frame::Discovery(_), "in") => (6, 7),
        (Frame::Discovery(_), "out") | (Frame::Sync(_), "delay") => (8, 9),
        (Frame::Param(_), "cycle_time") | (Frame::Sync(_), "time stamp") => (4, 7),
        (Frame::Param(_), "delay_burst") => (14, 14),
        (Frame::Param(_), "ipg") => (20, 23),
        (Frame::Param(_), "crc_mode") => (35, 35),
        // Behind the output data come CRC and time stamp, behind a payload its check.
        (Frame::Master(_), "time stamp") => (len.checked_sub(2)?, len - 1),
        (Frame::Master(_), "data") => (2, len.checked_sub(4)?),
        (Frame::Device(_), "data") => (2, len.checked_sub(2)?),
        (_, "data") => (4, len.checked_sub(5)?),
        (Frame::Device(_), "SA") => (0, 0),
        (_, name) => {
            let at = 2 + 4 * PTO.iter().position(|pto| *pto == name)?;
            (at, at + 1)
        }
    })
}

fn fields(frame: &Frame<'_>) -> Vec<Field> {
    match frame {
        Frame::Discovery(view) => vec![
            status(view.status()),
            Field::number("devices", view.count()),
            Field::number("in", view.input_total()),
            Field::number("out", view.output_total()),
        ],
        Frame::Param(Param { status: bits, parameters, .. }) => vec![
            status(*bits),
            Field::measured("cycle_time", parameters.cycle_time_ns, "ns"),
            Field::number("delay_burst", parameters.delay_burst),
            Field::measured("ipg", i64::from(parameters.ipg_5ns) * 5, "ns"),
            Field::hex("crc_mode", parameters.crc_mode.byte(), 2),
        ],
        Frame::Sync(sync) => vec![
            status(sync.status),
            Field::measured("time stamp", sync.time_stamp_ns, "ns"),
            Field::measured("delay", sync.delay_ns, "ns"),
        ],
        Frame::DelayReq(request) => vec![status(request.status)],
        Frame::Other(frame) if frame.frame_type() == FrameType::DelayResp => vec![status(frame.status())],
        Frame::Other(frame) => vec![status(frame.status()), data(frame.payload())],
        Frame::Master(view) => {
            let mut fields = vec![status(view.status())];
            // Four bytes a device is the CNC machine; anything else is shown as it is.
            match frame.cnc_slices() {
                Some(slices) => {
                    fields.extend(PTO.into_iter().zip(slices).map(|(name, slice)| Field::text(name, slice.pto)));
                }
                None => fields.push(data(view.output())),
            }
            fields.push(Field::measured("time stamp", view.time_stamp(), "ns"));
            fields
        }
        Frame::Device(view) => {
            vec![Field::number("SA", view.address().get()), status(view.status()), data(view.payload())]
        }
    }
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
