//! @Title@: logs of bytes, one frame a line or record.

use std::io;

use @snake@::Frame;

use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Facts, LogDecoder};
use crate::event::{Event, Field, Place, Refusal, Verdict};
use crate::settings::Settings;
use crate::sink::Sink;

/// @Title@ in the table.
pub(super) struct @Camel@;

impl Codec for @Camel@ {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "@name@",
                title: "@Title@",
                about: "@Title@ frames, from logs of bytes",
                needs: "@Title@ frames are read from logs of bytes: hex digits with --bytes, binary with --record-size",
                ..Facts::NONE
            }
        }
    }

    fn log(&self, _: &Settings, _: &[Burst]) -> Option<Box<dyn LogDecoder>> {
        Some(Box::new(Frames))
    }
}

/// Frames do not depend on each other.
struct Frames;

impl LogDecoder for Frames {
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let (fields, verdict) = match Frame::parse(&burst.bytes) {
            Ok(frame) => (vec![Field::number("value", frame.value)], Verdict::Ok),
            Err(error) => (Vec::new(), Refusal::new(error.class().name(), error).into()),
        };
        out.event(&Event::new(Place::Line(burst.line), None, "frame", fields, verdict))
    }

    fn spoilt(&mut self, _: &mut dyn Sink) -> io::Result<()> {
        Ok(())
    }

    fn end(&mut self, _: &mut dyn Sink) -> io::Result<()> {
        Ok(())
    }
}
