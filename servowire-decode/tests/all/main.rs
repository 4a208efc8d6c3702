//! The library as somebody else's program uses it.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod places;
mod push;
mod traffic;
mod truth;

use std::io;

use servowire_decode::capture::{self, Capture, Format, Hints, Input, Line};
use servowire_decode::codec::Codec;
use servowire_decode::event::Event;
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::protocols::CODECS;
use servowire_decode::settings::Settings;

/// Keeps all events.
#[derive(Default)]
struct Keep(Vec<Event>);

impl Printer for Keep {
    fn event(&mut self, _: &Origin, event: &Event) -> io::Result<()> {
        self.0.push(event.clone());
        Ok(())
    }
}

/// A protocol by its name.
fn protocol(name: &str) -> &'static dyn Codec {
    CODECS.iter().copied().find(|codec| codec.name == name).unwrap()
}

/// Opens a recording of lines.
fn line(name: &str, bytes: &'static [u8]) -> Box<dyn Line> {
    match capture::open(Input::over(name, bytes), Hints { format: Some(Format::Vcd), ..Hints::default() }).unwrap() {
        Capture::Edges(line) => line,
        _ => panic!("{name} holds edges"),
    }
}

/// All events of a capture.
fn events(name: &str, capture: Capture, protocol: Option<&'static dyn Codec>) -> Vec<Event> {
    let mut keep = Keep::default();
    let mut out = Output::new(name, &mut keep);
    servowire_decode::decode(name, capture, protocol, &Settings::default(), &mut out).unwrap();
    keep.0
}
