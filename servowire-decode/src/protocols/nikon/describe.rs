//! A-format frames as events: names, values, positions, reasons.

use nikon_aformat::inspect::LineCause;
use nikon_aformat::{
    Alm, Body, Command, Data, Doubt, EncoderAddress, EncoderStatus, Error, Evidence, Expected, Layout, Operation,
    Policy, Request, Resolution, Response, Tolerated, TypeWord,
};

use super::frames::Frames;
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Value, Verdict};
use crate::protocols::group::{self, too_wide};
use crate::protocols::plausible::Motion;
use crate::settings::Widths;
use crate::time::Time;

/// The fields an event may have.
pub(super) const FIELDS: &[&str] = &[
    "EA",
    "ES",
    "ABS",
    "ALM",
    "PM-ALM",
    "bank",
    "address",
    "data",
    "temperature",
    "ID",
    "coefficient",
    "velocity",
    "acceleration",
    "CRC",
    "effect",
    "width",
    "spikes",
    "words",
    "note",
];

/// A request as it was on the line.
pub(super) fn request(group: &Frames, result: Result<Request, Error>) -> Event {
    let mut fields = Vec::new();
    match result {
        Ok(request) => {
            fields.push(Field::number("EA", request.ea.get()));
            arguments(request.operation, &mut fields);
        }
        Err(_) => fields.push(words(group)),
    }
    fields.extend(group.spikes());
    let names: &[&str] = if group.len() > 1 { &["CDF", "MDF", "MDF", "MDF", "MDF"] } else { &["CDF"] };
    let kind = result.map_or("request", |request| request.command().name());
    let mut event =
        Event::new(group.place(), Some(Direction::Request), kind, fields, verdict(group, names, result.err()));
    event.address = result.ok().map(|request| request.ea.get().into());
    event.locate(|name| {
        let (first, last) = place_in_request(result.ok()?.operation, name)?;
        group.span(first, last)
    })
}

/// Returns the content bits of a field in a request: the byte of a memory data frame comes after its sync and frame code.
fn place_in_request(operation: Operation, name: &str) -> Option<(u32, u32)> {
    let (first, last) = match (operation, name) {
        (_, "EA") => return Some((5, 7)),
        (Operation::EepromReadBank { .. }, "bank") | (Operation::EepromRead { .. }, "address") => (1, 1),
        (Operation::EepromReadBank { .. }, "address") => (2, 2),
        (Operation::EepromWrite { .. } | Operation::EepromWriteBank { .. }, "data") => (1, 2),
        (Operation::EepromWrite { .. }, "address") | (Operation::EepromWriteBank { .. }, "bank") => (3, 3),
        (Operation::EepromWriteBank { .. }, "address") => (4, 4),
        (_, "ID" | "coefficient") => (1, 3),
        _ => return None,
    };
    Some((16 * first + 5, 16 * last + 12))
}

/// Returns the content bits of a field in a reply; the data begin after the 16 bits of the information field.
fn place_in_reply(layout: Layout, name: &str) -> Option<(u32, u32)> {
    let data = |first: u32, bits: u32| Some((16 + first, 15 + first + bits));
    let abs = u32::from(layout.abs_bits());
    match (layout, name) {
        (_, "EA") => Some((3, 5)),
        (_, "CRC") => Some((16 * u32::from(layout.frames()) - 8, 16 * u32::from(layout.frames()) - 1)),
        (Layout::Abs17, "ES") => Some((6, 6)),
        (_, "ES") => Some((12, 15)),
        (Layout::Abs17, "ABS") => Some((7, 23)),
        (Layout::Abs24High, "ABS") | (_, "ID") => data(0, 24),
        (_, "ABS") => data(0, abs),
        (Layout::Status, "ALM") | (_, "data") => data(0, 16),
        (_, "ALM") => data(24, 16),
        (_, "PM-ALM") | (Layout::EepromBank, "bank") | (Layout::Eeprom, "address") => data(16, 8),
        (Layout::EepromBank, "address") => data(24, 8),
        (Layout::Temperature, "temperature") => data(0, 10),
        (_, "temperature") => data(24, 10),
        (_, "coefficient") => data(0, 19),
        (_, "velocity") => data(abs, 32),
        (_, "acceleration") => data(56, 16),
        _ => None,
    }
}

fn arguments(operation: Operation, fields: &mut Vec<Field>) {
    match operation {
        Operation::EepromRead { address } => fields.push(Field::hex("address", address, 2)),
        Operation::EepromWrite { address, data } => {
            fields.extend([Field::hex("address", address.get(), 2), Field::hex("data", data, 4)]);
        }
        Operation::EepromReadBank { bank, address } => {
            fields.extend([Field::hex("bank", bank, 2), Field::hex("address", address, 2)]);
        }
        Operation::EepromWriteBank { bank, address, data } => {
            let place = [Field::hex("bank", bank, 2), Field::hex("address", address, 2)];
            fields.extend(place.into_iter().chain([Field::hex("data", data, 4)]));
        }
        Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id } => {
            fields.push(Field::hex("ID", id.get(), 6));
        }
        Operation::CoefficientWrite { coefficient } => {
            fields.push(Field::number("coefficient", coefficient.get()));
        }
        _ => {}
    }
    let command = operation.command();
    let effect = |effect| Field::text("effect", format_args!("{effect}, one of {}", command.repeats()));
    fields.extend(command.effect().map(effect));
}

/// What is known about the encoder.
#[derive(Debug, Clone)]
pub(super) struct Encoder {
    widths: Widths,
    /// By address: the content of the type word, once it has been seen on the line.
    hints: [Option<Resolution>; 8],
    motion: [Motion; 8],
}

impl Encoder {
    pub(super) fn new(widths: Widths) -> Self {
        Self { widths, hints: [None; 8], motion: [Motion::default(); 8] }
    }

    /// A reply as it was on the line.
    pub(super) fn answer(
        &mut self,
        group: &Frames,
        expected: Option<Expected>,
        asked: Option<Request>,
        result: Result<Response, Error>,
        delay: Option<i64>,
    ) -> Event {
        let mut fields = Vec::with_capacity(8);
        let mut position = None;
        match result {
            Ok(response) => {
                position = self.response(response, &mut fields);
                let crc = response.emit().crc().want;
                let last =
                    usize::from(response.layout().frames()).checked_sub(1).and_then(|last| group.contents().get(last));
                let received = last.map_or(crc, |last| (last >> 8) as u8).reverse_bits();
                fields.push(Field::hex("CRC", received, 2));
                let motion = self.motion.get_mut(usize::from(response.ea.get()));
                let moved = position.zip(motion).and_then(|(position, motion)| motion.note(group.place(), position));
                fields.extend(moved.map(|what| Field::text("note", what)));
            }
            Err(_) => fields.push(words(group)),
        }
        fields.extend(group.spikes());
        let kind = expected.map_or("reply", |expected| expected.command().name());
        let names = &["IF", "data", "data", "data", "data", "data"];
        let verdict = verdict(group, names, result.err());
        let event = Event::new(group.place(), Some(Direction::Answer), kind, fields, verdict);
        let mut event = event.locate(|name| {
            let (first, last) = place_in_reply(result.ok()?.layout(), name)?;
            group.span(first, last)
        });
        event.position = position;
        event.delay = delay;
        // The request shows whose a damaged reply is, unless it addressed all encoders.
        let only = asked.filter(|request| !request.command().is_multi_response()).map(|request| request.ea);
        event.address = result.ok().map(|response| response.ea).or(only).map(|ea| ea.get().into());
        event
    }

    fn response(&mut self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(Field::number("EA", response.ea.get()));
        match response.body {
            Body::Abs17 { es_any, .. } => {
                let set = if es_any { vec!["any"] } else { Vec::new() };
                fields.push(Field::new("ES", Value::Flags { raw: es_any.into(), digits: 1, set }));
            }
            Body::Full { es, .. } => fields.push(Field::flags("ES", &es, 1)),
        }
        let position = self.position(response, fields);
        self.data(response, fields);
        position
    }

    fn position(&self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        if let Some(Data::Abs24High { abs }) = response.data() {
            fields.push(Field::number("ABS", i64::from(abs.get()) << 16));
            return None;
        }
        let abs = response.abs()?;
        let counts = i64::try_from(abs).unwrap_or(i64::MAX);
        fields.push(Field::number("ABS", counts));
        let bits = response.layout().abs_bits();
        let Some(resolution) = self.resolution(response.ea) else {
            return Some(Position { name: "ABS", counts, span: Some(1 << bits), per_turn: None });
        };
        // Shows the position given by the fields. Any other reason against it is shown beside it.
        let shown = Tolerated::SINGLE_TURN.status(EncoderStatus::all()).alarms(Alm::all());
        match Evidence::of(response, resolution, 0).at(0, Policy::new(0).tolerating(shown)) {
            Ok(_) => Some(Position {
                name: "ABS",
                counts,
                span: Some(1 << bits.min(resolution.st_bits() + resolution.mt_bits())),
                per_turn: Some(resolution.counts_per_turn()),
            }),
            Err(Doubt::Absent) => Some(Position { name: "ABS", counts, span: Some(1 << bits), per_turn: None }),
            Err(doubt) => {
                fields.push(too_wide(doubt, resolution.st_bits(), resolution.mt_bits()));
                None
            }
        }
    }

    fn data(&mut self, response: Response, fields: &mut Vec<Field>) {
        fields.extend(response.alm().map(|alm| Field::flags("ALM", &alm, 4)));
        let degrees = response.temperature().map(|value| f64::from(value.milli_celsius()) / 1000.0);
        fields.extend(degrees.map(|value| Field::new("temperature", Value::Decimal { value, unit: "C" })));
        fields.extend(response.velocity().map(|velocity| Field::number("velocity", velocity)));
        match response.data() {
            Some(Data::Status { pm_alm, .. }) if pm_alm.bits() != 0 => fields.push(Field::flags("PM-ALM", &pm_alm, 2)),
            Some(Data::Eeprom { data, address }) => {
                fields.push(Field::hex("address", address, 2));
                // While the memory is busy, the data mean nothing.
                if !response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY)) {
                    fields.push(Field::hex("data", data, 4));
                    if address == TypeWord::EEPROM_ADDRESS && response.command() == Some(Command::EepromRead) {
                        if let Some(hint) = self.hints.get_mut(usize::from(response.ea.get())) {
                            *hint = TypeWord(data).resolution().or(*hint);
                        }
                    }
                }
            }
            Some(Data::EepromBank { data, bank, address, .. }) => {
                fields.extend([Field::hex("bank", bank, 2), Field::hex("address", address, 2)]);
                if !response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY)) {
                    fields.push(Field::hex("data", data, 4));
                }
            }
            Some(Data::Id { id }) => fields.push(Field::hex("ID", id.get(), 6)),
            Some(Data::Coefficient { coefficient }) => {
                fields.push(Field::number("coefficient", coefficient.get()));
            }
            Some(Data::Abs24VelAcc { acceleration, .. }) => {
                fields.push(Field::number("acceleration", acceleration));
            }
            _ => {}
        }
    }

    /// Returns the widths as the user gave them, otherwise from the type word of this encoder.
    fn resolution(&self, ea: EncoderAddress) -> Option<Resolution> {
        let hint = self.hints.get(usize::from(ea.get())).copied().flatten();
        let (st, mt) = self.widths.or(hint.map(|hint| (hint.st_bits(), hint.mt_bits())))?;
        Resolution::new(st, mt).ok()
    }
}

/// Reports that no reply came to the request at `place` by `now`.
pub(super) fn silence(request: Request, place: Place, timeout: i64, now: Time, asked: bool) -> Event {
    let kind = request.command().name();
    let silence = group::silence(place, kind, "reply", timeout, now, asked, "no encoder of this address");
    let ea = request.ea.get();
    Event { fields: vec![Field::number("EA", ea)], address: Some(ea.into()), ..silence }
}

/// Returns the content bits as vendor documents print them, with the first bit of the line in bit 15.
fn words(group: &Frames) -> Field {
    Field::digits("words", group.contents().iter().map(|content| content.reverse_bits()), 4)
}

fn verdict(group: &Frames, names: &[&'static str], error: Option<Error>) -> Verdict {
    let Some(error) = error else { return Verdict::Ok };
    let frame = match error {
        Error::Truncated { .. } => Some(group.len()),
        Error::Crc { .. } => group.len().checked_sub(1),
        other => other.frame().map(usize::from),
    };
    let disturbed = matches!(error, Error::Crc { .. } | Error::Crc3 { .. });
    let cause = disturbed.then(|| LineCause::Disturbed.to_string());
    let why = Refusal { cause, ..Refusal::new(error.class().name(), error) };
    group.refused(names, frame, error.bit(), why).into()
}
