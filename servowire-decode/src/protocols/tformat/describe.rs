//! T-Format frames as events: names, values, positions, reasons.

use std::sync::LazyLock;

use tformat::{
    Abm, Abs, Adf, AllData, Almc, DataId, Doubt, Error, Evidence, Memory, Policy, Request, Resolution, Response,
    Sample, StatusField, Tolerated,
};

use super::frame::{ANSWER_TIMEOUT, Frame};
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Value, Verdict};
use crate::protocols::group::{self, too_wide};
use crate::protocols::plausible::Motion;
use crate::settings::Widths;
use crate::time::Time;

/// The fields an event may have.
pub(super) const FIELDS: &[&str] =
    &["SF", "ABS", "ENID", "ABM", "ALMC", "ADF", "EDF", "CRC", "effect", "width", "spikes", "bytes", "note"];

/// A request as it was on the line.
pub(super) fn request(frame: &Frame, id: Option<DataId>, result: Result<Request, Error>) -> Event {
    let mut fields = Vec::new();
    match result {
        Ok(Request::WriteEeprom { adf, edf }) => fields.extend([address(adf), Field::hex("EDF", edf, 2)]),
        Ok(Request::ReadEeprom { adf }) => fields.push(address(adf)),
        Ok(request) => fields.extend(effect(request.data_id())),
        Err(_) => fields.push(bytes(frame)),
    }
    fields.extend(frame.spikes());
    let names = id.map_or(&["CF"][..], |id| id.layout().request);
    let mut event = event(frame, Direction::Request, id, fields, verdict(frame, names, result.err()));
    locate(&mut event.fields, frame, parts(id, Direction::Request));
    event
}

/// What is known about the encoder.
#[derive(Debug, Clone)]
pub(super) struct Encoder {
    widths: Widths,
    /// The widths implied by the last ENID on the line.
    hint: Option<Resolution>,
    enid: Option<u8>,
    motion: Motion,
}

impl Encoder {
    pub(super) fn new(widths: Widths) -> Self {
        Self { widths, hint: None, enid: None, motion: Motion::default() }
    }

    /// An answer as it was on the line, to `id` if the request was read.
    pub(super) fn answer(
        &mut self,
        frame: &Frame,
        id: Option<DataId>,
        result: Result<Response, Error>,
        delay: Option<i64>,
    ) -> Event {
        let mut fields = Vec::with_capacity(8);
        let (mut position, mut note) = (None, None);
        match result {
            Ok(response) => {
                let before = self.enid;
                position = self.response(response, &mut fields);
                let moved = position.and_then(|position| self.motion.note(frame.place(), position));
                let notes: Vec<String> = doubts(response, before).into_iter().chain(moved).collect();
                if !notes.is_empty() {
                    note = Some(Field::text("note", notes.join("; ")));
                }
            }
            // A refusal is a sound ID 3 frame with all its values.
            Err(Error::Rejected { .. }) => {
                if let Ok(full) = AllData::parse(frame.contents()) {
                    position = self.response(Response::ReadAll(full), &mut fields);
                }
            }
            Err(_) => fields.push(bytes(frame)),
        }
        if let Ok(response) = result {
            let last = usize::from(response.data_id().response_fields()).checked_sub(1);
            fields.extend(last.and_then(|last| frame.contents().get(last)).map(|crc| Field::hex("CRC", *crc, 2)));
        }
        fields.extend(note);
        fields.extend(frame.spikes());
        let said = frame.data_id().ok().or(id);
        let names = said.map_or(&["CF"][..], |id| id.layout().response);
        let mut event = event(frame, Direction::Answer, id, fields, verdict(frame, names, result.err()));
        locate(&mut event.fields, frame, parts(said, Direction::Answer));
        event.position = position;
        event.delay = delay;
        event
    }

    fn response(&mut self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        fields.extend(response.status().map(|sf| Field::flags("SF", &sf, 2)));
        match response {
            Response::ReadSingleTurn(v) => self.single_turn(v.abs, fields),
            Response::ResetErrors(v) | Response::SetSingleTurnZero(v) | Response::ResetTurnsAndErrors(v) => {
                let position = self.single_turn(v.abs, fields);
                fields.extend(effect(response.data_id()));
                position
            }
            Response::ReadMultiTurn(v) => {
                fields.push(Field::number("ABM", v.abm.get()));
                None
            }
            Response::ReadEncoderId(v) => {
                self.identify(v.enid, fields);
                None
            }
            Response::ReadAll(full) => self.full(full, fields),
            Response::WriteEeprom(Memory { adf, edf }) | Response::ReadEeprom(Memory { adf, edf }) => {
                fields.push(address(adf));
                if !adf.busy() {
                    fields.push(Field::hex("EDF", edf, 2));
                }
                None
            }
        }
    }

    fn full(&mut self, full: AllData, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(Field::number("ABS", full.abs.get()));
        self.identify(full.enid, fields);
        fields.push(Field::number("ABM", full.abm.get()));
        fields.push(Field::flags("ALMC", &full.almc, 2));
        let resolution = self.resolution()?;
        match shown(full, resolution, Tolerated::NOTHING) {
            Ok(sample) => Some(Position {
                name: "ABM, ABS",
                counts: sample.counts()?,
                span: Some(1 << (resolution.abs_bits() + resolution.abm_bits())),
                per_turn: Some(resolution.counts_per_turn().into()),
            }),
            Err(doubt) => {
                fields.push(too_wide(doubt, resolution.abs_bits(), resolution.abm_bits()));
                None
            }
        }
    }

    fn single_turn(&self, abs: Abs, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(Field::number("ABS", abs.get()));
        let Some(resolution) = self.resolution() else {
            return Some(Position { name: "ABS", counts: abs.get().into(), span: None, per_turn: None });
        };
        let turn = Some(resolution.counts_per_turn().into());
        match shown(AllData { abs, ..NOTHING }, resolution, Tolerated::SINGLE_TURN) {
            Ok(sample) => {
                Some(Position { name: "ABS", counts: sample.single_turn().into(), span: turn, per_turn: turn })
            }
            Err(doubt) => {
                fields.push(too_wide(doubt, resolution.abs_bits(), resolution.abm_bits()));
                None
            }
        }
    }

    fn identify(&mut self, enid: u8, fields: &mut Vec<Field>) {
        fields.push(Field::number("ENID", enid));
        self.enid = Some(enid);
        self.hint = Resolution::from_enid(enid).map(|hint| hint.resolution);
    }

    /// Returns the widths as the user gave them, otherwise as the encoder ID suggests.
    fn resolution(&self) -> Option<Resolution> {
        let (abs, abm) = self.widths.or(self.hint.map(|hint| (hint.abs_bits(), hint.abm_bits())))?;
        Resolution::new(abs, abm).ok()
    }
}

const NOTHING: AllData =
    AllData { sf: StatusField::empty(), abs: Abs::truncate(0), enid: 0, abm: Abm::truncate(0), almc: Almc::empty() };

/// Returns the position given by the fields, for display. Other reasons against its use are shown beside it: alarms,
/// damage, another
/// encoder ID.
fn shown(full: AllData, resolution: Resolution, tolerated: Tolerated) -> Result<Sample, Doubt> {
    let fields = AllData { abs: full.abs, abm: full.abm, ..NOTHING };
    Evidence::of(Response::ReadAll(fields), resolution, 0).at(0, Policy::new(0).tolerating(tolerated))
}

/// Returns contradictions in an answer; `before`: the encoder ID until now.
fn doubts(response: Response, before: Option<u8>) -> Vec<String> {
    let mut out = Vec::new();
    let enid = match response {
        Response::ReadEncoderId(v) => Some(v.enid),
        Response::ReadAll(full) => Some(full.enid),
        _ => None,
    };
    if let (Some(before), Some(enid)) = (before, enid.filter(|enid| before.is_some_and(|before| before != *enid))) {
        out.push(format!(
            "the encoder ID was {before} and is {enid}: another encoder, or damage that CRC does not see"
        ));
    }
    if let Response::ReadAll(full) = response {
        // Encoders that leave SF at 0 always do so.
        if full.sf.bits() != 0 && !full.sf.agrees_with(full.almc) {
            out.push(format!("SF contradicts ALMC: {} is expected", StatusField::of_alarms(full.almc)));
        }
    }
    out
}

/// Reports that no answer came to the request at `place` by `now`; `asked`: whether the next request came instead.
pub(super) fn silence(request: Request, place: Place, now: Time, asked: bool) -> Event {
    let kind = kind(Some(request.data_id()));
    group::silence(place, kind, "answer", ANSWER_TIMEOUT, now, asked, "no encoder")
}

fn event(frame: &Frame, direction: Direction, id: Option<DataId>, fields: Vec<Field>, verdict: Verdict) -> Event {
    Event::new(frame.place(), Some(direction), kind(id), fields, verdict)
}

/// Adds the places of the fields of a frame, of which these are on the line.
fn locate(fields: &mut [Field], frame: &Frame, parts: &[Part]) {
    let Some(spans) = frame.spans() else { return };
    // The fields come in the order of the line, except those without a place.
    let mut rest = parts.iter();
    for field in fields {
        let mut behind = rest.clone();
        // Mostly it is the next one, whose name is the same text in the same place.
        let found = behind.next().filter(|part| std::ptr::eq(part.name, field.name)).or_else(|| {
            behind = rest.clone();
            behind.find(|part| part.name == field.name)
        });
        if found.is_some() {
            rest = behind;
        }
        if let Some(Part { first, last, .. }) = found.or_else(|| parts.iter().find(|part| part.name == field.name)) {
            field.span = spans.of(*first, *last);
        }
    }
}

/// A value of a frame on the line, and its bits: ABS is in the fields ABS0 to ABS2.
#[derive(Debug, Clone, Copy)]
struct Part {
    name: &'static str,
    first: u32,
    last: u32,
}

/// Returns the values in a request or an answer with this data ID; none if the ID is unknown.
fn parts(id: Option<DataId>, direction: Direction) -> &'static [Part] {
    type Both = [Vec<Part>; 2];
    static ALL: LazyLock<[(DataId, Both); 9]> =
        LazyLock::new(|| DataId::ALL.map(|id| (id, [id.layout().request, id.layout().response].map(gathered))));
    let of = |id| ALL.iter().find(|(known, _)| *known == id);
    let Some((_, [request, answer])) = id.and_then(of) else { return &[] };
    if direction == Direction::Request { request } else { answer }
}

/// The values in fields of these names, as far as events have them.
fn gathered(names: &[&'static str]) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for (first, name) in (0..).step_by(8).zip(names) {
        let name = name.strip_suffix(['0', '1', '2']).unwrap_or(name);
        let Some(name) = FIELDS.iter().copied().find(|own| *own == name) else { continue };
        match parts.last_mut() {
            Some(part) if part.name == name => part.last += 8,
            _ => parts.push(Part { name, first, last: first + 7 }),
        }
    }
    parts
}

/// Returns the data ID as it displays itself, formatted once rather than for every frame.
fn kind(id: Option<DataId>) -> &'static str {
    static NAMES: LazyLock<[(DataId, String); 9]> = LazyLock::new(|| DataId::ALL.map(|id| (id, id.to_string())));
    let name = |id| NAMES.iter().find(|(known, _)| *known == id).map(|(_, name)| name.as_str());
    id.and_then(name).unwrap_or("ID ?")
}

/// Describes what a reset does, and how many requests it takes.
fn effect(id: DataId) -> Option<Field> {
    id.effect().map(|effect| Field::text("effect", format_args!("{effect}, one of {}", id.repeats())))
}

fn address(adf: Adf) -> Field {
    let set = if adf.busy() { vec!["busy"] } else { Vec::new() };
    Field::new("ADF", Value::Flags { raw: adf.bits().into(), digits: 2, set })
}

fn bytes(frame: &Frame) -> Field {
    Field::digits("bytes", frame.contents().iter().copied(), 2)
}

fn verdict(frame: &Frame, names: &[&'static str], error: Option<Error>) -> Verdict {
    let Some(error) = error else { return Verdict::Ok };
    let field = match error {
        Error::Crc { .. } => frame.len().checked_sub(1),
        other => other.field().map(usize::from),
    };
    frame.refused(names, field, error.bit(), Refusal::new(error.class().name(), error)).into()
}
