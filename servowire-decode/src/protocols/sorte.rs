//! TI SORTE: the frames of a network capture, one event per packet.
//!
//! Packets of an Ethernet interface are start-up frames, with their FCS if the file says so. Otherwise frames without an
//! FCS, padded or not, are accepted as a network card delivers them, with a remark. Packets of another interface are
//! frames of the IO exchange, which have neither a type nor Ethernet addresses: the frame with SA 0 is the master's.

use std::fmt::Write as _;

use pcap_file::DataLink;
use sorte_proto::follow::InputSlice;
use sorte_proto::inspect::{Cause, During, Frame, inspect};
use sorte_proto::{FrameType, Network, Param, Status};

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
    "FCS",
    "DRV8711",
    "reserved or steps ordered",
];
const PTO: [&str; 4] = ["PTO 1", "PTO 2", "PTO 3", "PTO 4"];

/// One byte at 100 Mbit/s, in picoseconds.
const BYTE: i64 = 80_000;

/// The table row of SORTE.
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
    let unchecked = matches!(report.cause(), Some(Cause::FcsMissing | Cause::FcsMissingAndPadded));
    let error = report.error().filter(|_| packet.has_fcs || !unchecked);
    let (fields, verdict) = match (error, report.frame()) {
        (None, Some(frame)) => {
            let mut fields = fields(&frame);
            fields.extend(report.error().map(|_| Field::text("FCS", "not captured")));
            (fields, contents(&frame))
        }
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
    let mut event = Event::new(place, direction, kind, fields, verdict);
    event.address = match (error, report.frame()) {
        (None, Some(Frame::Device(view))) => Some(view.address().get().into()),
        _ => None,
    };
    event.locate(|name| {
        let (first, last) = bytes(report.frame()?, packet.bytes.len(), name)?;
        Some(Span::even(place, 8 * packet.bytes.len() as u32, 8 * first as u32, 8 * last as u32 + 7))
    })
}

/// Returns the first and the last byte of a field; the frame has `len` bytes.
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
        // The output data are followed by CRC and time stamp, a payload by its check.
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

/// Judges the content of a frame: an impossible table is not an answer, even if its check is right.
fn contents(frame: &Frame<'_>) -> Verdict {
    match frame {
        Frame::Discovery(view) => match Network::new(*view) {
            Ok(_) => Verdict::Ok,
            Err(error) => Refusal::new(error.class().name(), error).into(),
        },
        _ => Verdict::Ok,
    }
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
            // Four bytes per device mean the CNC machine; anything else is shown as it is.
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
            let mut fields = vec![Field::number("SA", view.address().get()), status(view.status())];
            match view.payload().first_chunk().filter(|_| view.payload().len() == InputSlice::LEN) {
                Some(bytes) => {
                    let slice = InputSlice::parse(*bytes);
                    fields.push(Field::flags("DRV8711", &slice.driver, 2));
                    fields.push(Field::number("reserved or steps ordered", slice.ordered));
                }
                None => fields.push(data(view.payload())),
            }
            fields
        }
    }
}

/// Shows bytes unchanged, without spaces.
fn data(bytes: &[u8]) -> Field {
    let mut digits = String::new();
    for byte in bytes {
        // Writing to a String cannot fail.
        let _ = write!(digits, "{byte:02X}");
    }
    Field::text("data", digits)
}

fn status(status: Status) -> Field {
    Field::flags("STATUS", &status, 2)
}

#[cfg(test)]
mod tests {
    use sorte_proto::{Discovery, Entry, Place, Sync};

    use super::*;
    use crate::time::Time;

    fn of(link: DataLink, has_fcs: bool, bytes: &[u8]) -> Event {
        event(&Packet { time: Time::from_ps(0), link, inbound: None, has_fcs, bytes: bytes.to_vec() })
    }

    fn class(event: &Event) -> Option<&'static str> {
        match &event.verdict {
            Verdict::Ok => None,
            Verdict::Refused(refusal) => Some(refusal.class),
        }
    }

    /// 300 devices, and totals that are not the sums of the entries.
    #[test]
    fn a_table_that_cannot_be_is_refused() {
        let mut frame = Discovery::request(Place::Inner);
        frame.entries[0] = Entry::STOCK;
        (frame.count, frame.input_total, frame.output_total) = (1, 4, 4);
        assert_eq!(class(&of(DataLink::ETHERNET, true, &frame.emit())), None);
        frame.output_total = 5;
        assert_eq!(class(&of(DataLink::ETHERNET, true, &frame.emit())), Some("table_mismatch"));
        frame.count = 300;
        assert_eq!(class(&of(DataLink::ETHERNET, true, &frame.emit())), Some("too_many_devices"));
    }

    /// As a network card delivers it, 10 bytes or padded to 60; but not if the file says that the FCS is present.
    #[test]
    fn frames_without_their_fcs_are_taken_where_the_file_does_not_promise_it() {
        let sync = Sync::of_master(500, 76, Place::Inner).emit();
        let mut padded = sync[..10].to_vec();
        padded.resize(60, 0);
        for bytes in [&sync[..10], &padded] {
            let event = of(DataLink::ETHERNET, false, bytes);
            assert_eq!(class(&event), None);
            assert!(event.fields.iter().any(|field| field.name == "FCS"), "{event:?}");
            assert!(class(&of(DataLink::ETHERNET, true, bytes)).is_some());
        }
        assert!(class(&of(DataLink::ETHERNET, false, &sync[..9])).is_some());
        let mut damaged = sync;
        damaged[5] ^= 1;
        assert_eq!(class(&of(DataLink::ETHERNET, false, &damaged)), Some("bad_fcs"));
    }

    /// Device 1: its driver stalled, 4711 steps.
    #[test]
    fn the_payload_of_a_device_is_named() {
        let event = of(DataLink::USER0, false, &[0x01, 0x00, 0x40, 0x67, 0x12, 0x04]);
        let names: Vec<_> = event.fields.iter().map(|field| field.name).collect();
        assert_eq!((class(&event), names), (None, vec!["SA", "STATUS", "DRV8711", "reserved or steps ordered"]));
    }
}
