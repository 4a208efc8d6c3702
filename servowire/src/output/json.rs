//! JSON Lines: an object a frame.

use std::io::{self, Write};

use serde_json::{Map, Value as Json, json};

use super::{Printer, Sink};
use crate::event::{Direction, Event, Place, Value, Verdict};

/// Prints for programs.
pub struct JsonLines<W> {
    out: W,
    file: String,
}

impl<W: Write> JsonLines<W> {
    /// Writes to `out`.
    pub fn new(out: W) -> Self {
        Self { out, file: String::new() }
    }
}

impl<W: Write> Sink for JsonLines<W> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        serde_json::to_writer(&mut self.out, &object(&self.file, event))?;
        self.out.write_all(b"\n")
    }
}

impl<W: Write> Printer for JsonLines<W> {
    fn begin(&mut self, file: &str) -> io::Result<()> {
        file.clone_into(&mut self.file);
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// An event as the documentation of the tool describes it.
fn object(file: &str, event: &Event) -> Json {
    let mut object = Map::new();
    let mut put = |key: &str, value: Json| drop(object.insert(key.to_owned(), value));
    put("file", json!(file));
    match event.place {
        Place::Time { start, end } => {
            put("start_ps", json!(start));
            put("end_ps", json!(end));
        }
        Place::Line(line) => put("line", json!(line)),
    }
    if let Some(direction) = event.direction {
        put("direction", json!(if direction == Direction::Request { "request" } else { "answer" }));
    }
    put("kind", json!(event.kind));
    put("fields", Json::Object(event.fields.iter().map(|f| (f.name.to_owned(), value(&f.value))).collect()));
    if let Some(position) = event.position {
        put("position", json!({ "counts": position.counts, "turns": position.turns() }));
    }
    if let Some(delay) = event.delay {
        put("delay_ps", json!(delay));
    }
    match &event.verdict {
        Verdict::Ok => put("verdict", json!("ok")),
        Verdict::Refused(refusal) => {
            put("verdict", json!(refusal.class));
            put("reason", json!(refusal.reason));
            let at = json!({ "field": refusal.field, "bit": refusal.bit, "time_ps": refusal.time });
            put("at", at);
            put("cause", json!(refusal.cause));
        }
    }
    Json::Object(object)
}

fn value(value: &Value) -> Json {
    match value {
        Value::Number { value, .. } => json!(value),
        Value::Hex { value, .. } => json!(value),
        Value::Flags { raw, set, .. } => json!({ "raw": raw, "set": set }),
        Value::Text(text) => json!(text),
    }
}
