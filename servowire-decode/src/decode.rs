//! From a capture of any kind to events.

use std::collections::BTreeMap;

use crate::capture::Capture;
use crate::codec::Codec;
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::protocols::{CODECS, meant};
use crate::recognition::{self, Note};
use crate::settings::Settings;
use crate::sink::{Sink, Tally};
use crate::{line, log};

/// Decodes a capture called `file` to its end; without `protocol`, the protocol is detected. Events before a fault have
/// already been passed to `out`.
pub fn decode(
    file: &str,
    capture: Capture,
    protocol: Option<&'static dyn Codec>,
    settings: &Settings,
    out: &mut Output<'_>,
) -> Result<(), Stop> {
    let of_lines = || meant(protocol).any(|codec| !codec.rates.is_empty());
    match (capture, protocol) {
        // Whatever was asked for: what has packets.
        (Capture::Packets(mut packets), _) => {
            let mut foreign: BTreeMap<&'static str, u64> = BTreeMap::new();
            while let Some(mut packet) = packets.packet()? {
                packet.has_fcs = settings.fcs.unwrap_or(packet.has_fcs);
                let events: Vec<_> = CODECS.iter().filter_map(|codec| codec.packet(&packet)).collect();
                // Where an EtherType would stand, a good frame may have any bytes.
                match packet.traffic().filter(|_| !events.iter().any(|event| event.verdict.is_ok())) {
                    Some(traffic) => *foreign.entry(traffic).or_default() += 1,
                    None => events.iter().try_for_each(|event| out.event(event))?,
                }
                if packets.is_live() {
                    out.flush()?;
                }
                out.tick();
                if out.is_done() {
                    break;
                }
            }
            if foreign.is_empty() {
                return Ok(());
            }
            if out.tally == Tally::default() {
                let what = format!("{}, and nothing else", recognition::traffic(&foreign));
                return Err(Fault::new(file, At::File, what).into());
            }
            out.note(&Note::Traffic { file: file.to_owned(), packets: foreign });
            Ok(())
        }
        (Capture::Bytes(bytes), _) => log::decode(file, bytes, protocol, settings, out),
        (_, Some(asked)) if !of_lines() => Err(Fault::new(file, At::File, asked.needs).into()),
        (Capture::Edges(mut line), _) => line::decode(file, line.as_mut(), protocol, settings, out),
        (Capture::Samples(mut raw), _) => line::samples(file, &mut raw, protocol, settings, out),
    }
}
