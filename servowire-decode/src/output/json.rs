//! JSON Lines: one object per frame.

use std::io::{self, Write};

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::printer::{Origin, Printer};
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Value, Verdict};

/// Prints for programs.
pub struct JsonLines<W> {
    out: W,
}

impl<W: Write> JsonLines<W> {
    /// Writes to `out`.
    pub fn new(out: W) -> Self {
        Self { out }
    }
}

impl<W: Write> Printer for JsonLines<W> {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        serde_json::to_writer(&mut self.out, &Object { origin, event })?;
        self.out.write_all(b"\n")
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn end(&mut self, _: &Origin) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes an event as described in the README; keys without content are omitted.
struct Object<'a> {
    origin: &'a Origin,
    event: &'a Event,
}

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let event = self.event;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("file", &self.origin.file)?;
        if let Some(lane) = self.origin.lane() {
            map.serialize_entry("channel", &lane.channel)?;
            map.serialize_entry("protocol", lane.protocol.title)?;
            map.serialize_entry("bit_rate", &lane.rate)?;
        }
        match event.place {
            Place::Time { start, end } => {
                map.serialize_entry("start_ps", &start)?;
                map.serialize_entry("end_ps", &end)?;
            }
            Place::Line(line) => map.serialize_entry("line", &line)?,
        }
        match event.direction {
            Some(Direction::Request) => map.serialize_entry("direction", "request")?,
            Some(Direction::Answer) => map.serialize_entry("direction", "answer")?,
            None => {}
        }
        map.serialize_entry("kind", &event.kind)?;
        if let Some(address) = event.address {
            map.serialize_entry("address", &address)?;
        }
        map.serialize_entry("fields", &Fields(&event.fields))?;
        if let Some(position) = &event.position {
            map.serialize_entry("position", position)?;
        }
        if let Some(delay) = event.delay {
            map.serialize_entry("delay_ps", &delay)?;
        }
        match &event.verdict {
            Verdict::Ok => map.serialize_entry("verdict", "ok")?,
            Verdict::Refused(refusal) => {
                map.serialize_entry("verdict", refusal.class)?;
                refusal_entries(refusal, &mut map)?;
            }
        }
        map.end()
    }
}

fn refusal_entries<M: SerializeMap>(refusal: &Refusal, map: &mut M) -> Result<(), M::Error> {
    map.serialize_entry("reason", &refusal.reason)?;
    if let Some(field) = &refusal.field {
        map.serialize_entry("at_field", field)?;
    }
    if let Some(bit) = refusal.bit {
        map.serialize_entry("at_bit", &bit)?;
    }
    if let Some(time) = refusal.time {
        map.serialize_entry("at_ps", &time)?;
    }
    if let Some(cause) = &refusal.cause {
        map.serialize_entry("cause", cause)?;
    }
    Ok(())
}

struct Fields<'a>(&'a [Field]);

impl Serialize for Fields<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|field| (field.name, &field.value)))
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number { value, .. } => serializer.serialize_i64(*value),
            Self::Decimal { value, .. } => serializer.serialize_f64(*value),
            Self::Hex { value, .. } => serializer.serialize_u64(*value),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Flags { raw, set, .. } => {
                let mut map = serializer.serialize_map(Some(2))?;
                map.serialize_entry("raw", raw)?;
                map.serialize_entry("set", set)?;
                map.end()
            }
        }
    }
}

impl Serialize for Position {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("name", self.name)?;
        map.serialize_entry("counts", &self.counts)?;
        if let Some(turns) = self.turns() {
            map.serialize_entry("turns", &turns)?;
        }
        map.end()
    }
}
