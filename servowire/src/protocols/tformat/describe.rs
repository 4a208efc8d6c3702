//! T-Format frames as events: names, values, positions, reasons.

use std::borrow::Cow;

use tformat::{Abs, Adf, AllData, Almc, DataId, Error, Memory, Request, Resolution, Response, StatusField};

use super::frame::Frame;
use super::{ANSWER_TIMEOUT, Settings};
use crate::event::{Direction, Event, Field, NO_RESPONSE, Place, Position, Refusal, Value, Verdict};

/// The fields an event may have.
pub const FIELDS: &[&str] =
    &["SF", "ABS", "ENID", "ABM", "ALMC", "ADF", "EDF", "CRC", "resets", "width", "spikes", "bytes", "note"];

/// A request as it was on the line.
pub(super) fn request(frame: &Frame, id: Option<DataId>, result: Result<Request, Error>) -> Event {
    let mut fields = Vec::new();
    match result {
        Ok(Request::WriteEeprom { adf, edf }) => fields.extend([address(adf), hex("EDF", edf)]),
        Ok(Request::ReadEeprom { adf }) => fields.push(address(adf)),
        Ok(request) => fields.extend(resets(request.data_id())),
        Err(_) => fields.push(bytes(frame)),
    }
    fields.extend(spikes(frame));
    let names = id.map_or(&["CF"][..], request_names);
    event(frame, Direction::Request, id, fields, verdict(frame, names, result.err()))
}

/// What is known of the encoder.
pub(super) struct Encoder {
    settings: Settings,
    /// By the last ENID on the line.
    hint: Option<Resolution>,
}

impl Encoder {
    pub(super) fn new(settings: Settings) -> Self {
        Self { settings, hint: None }
    }

    /// An answer as it was on the line, to `id` where the request was read.
    pub(super) fn answer(
        &mut self,
        frame: &Frame,
        id: Option<DataId>,
        result: Result<Response, Error>,
        delay: Option<i64>,
    ) -> Event {
        let mut fields = Vec::with_capacity(8);
        let mut position = None;
        match result {
            Ok(response) => position = self.response(response, &mut fields),
            // A refusal is a sound ID 3 frame with all its values.
            Err(Error::Rejected { .. }) => {
                if let Ok(full) = AllData::parse(frame.bytes()) {
                    position = self.response(Response::ReadAll(full), &mut fields);
                }
            }
            Err(_) => fields.push(bytes(frame)),
        }
        if result.is_ok() {
            fields.extend(frame.bytes().last().map(|crc| hex("CRC", *crc)));
        }
        fields.extend(spikes(frame));
        let names = frame.data_id().ok().or(id).map_or(&["CF"][..], answer_names);
        let mut event = event(frame, Direction::Answer, id, fields, verdict(frame, names, result.err()));
        event.position = position;
        event.delay = delay;
        event
    }

    fn response(&mut self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        fields.extend(response.status().map(status));
        match response {
            Response::ReadSingleTurn(v) => self.single_turn(v.abs, fields),
            Response::ResetErrors(v) | Response::SetSingleTurnZero(v) | Response::ResetTurnsAndErrors(v) => {
                let position = self.single_turn(v.abs, fields);
                fields.extend(resets(response.data_id()));
                position
            }
            Response::ReadMultiTurn(v) => {
                fields.push(number("ABM", v.abm.get()));
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
                    fields.push(hex("EDF", edf));
                }
                None
            }
        }
    }

    fn full(&mut self, full: AllData, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(number("ABS", full.abs.get()));
        self.identify(full.enid, fields);
        fields.push(number("ABM", full.abm.get()));
        fields.push(alarms(full.almc));
        let resolution = self.resolution()?;
        match resolution.position(full.abs, full.abm) {
            Ok(position) => Some(Position {
                counts: position.combined,
                span: Some(1 << (resolution.abs_bits() + resolution.abm_bits())),
                per_turn: Some(resolution.counts_per_turn().into()),
            }),
            Err(error) => too_wide(error, resolution, fields),
        }
    }

    fn single_turn(&self, abs: Abs, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(number("ABS", abs.get()));
        let Some(resolution) = self.resolution() else {
            return Some(Position { counts: abs.get().into(), span: None, per_turn: None });
        };
        let turn = Some(resolution.counts_per_turn().into());
        match resolution.single_turn(abs) {
            Ok(counts) => Some(Position { counts: counts.into(), span: turn, per_turn: turn }),
            Err(error) => too_wide(error, resolution, fields),
        }
    }

    fn identify(&mut self, enid: u8, fields: &mut Vec<Field>) {
        fields.push(Field { name: "ENID", value: Value::Number { value: enid.into(), unit: "" } });
        self.hint = Resolution::from_enid(enid).map(|hint| hint.resolution);
    }

    /// The widths as the user gave them, else as the encoder ID suggests.
    fn resolution(&self) -> Option<Resolution> {
        let Settings { single_turn_bits, multi_turn_bits } = self.settings;
        let abs = single_turn_bits.or(self.hint.map(Resolution::abs_bits))?;
        let abm = multi_turn_bits.or(self.hint.map(Resolution::abm_bits)).unwrap_or(16);
        Resolution::new(abs, abm).ok()
    }
}

/// A frame that the capture holds only in part: no fault of the line.
pub(super) fn cut(place: Place, what: &str) -> Event {
    Event {
        place,
        direction: None,
        kind: Cow::Borrowed("cut"),
        fields: vec![Field { name: "note", value: Value::Text(what.to_owned()) }],
        position: None,
        delay: None,
        verdict: Verdict::Ok,
    }
}

/// A piece of a frame at the end of the capture: what comes then is not known, so it is not sound.
pub(super) fn cut_off(place: Place) -> Event {
    let reason = "the capture ends inside a frame".to_owned();
    let cause = Some("the file was cut off, or recording stopped there".to_owned());
    let refusal = Refusal { class: "truncated", reason, field: None, bit: None, time: None, cause };
    Event { fields: Vec::new(), verdict: Verdict::Refused(Box::new(refusal)), ..cut(place, "") }
}

/// No answer came to the request at `place` until `now`.
pub(super) fn silence(request: Request, place: Place, now: i64) -> Event {
    let (place, reason) = match place {
        Place::Time { end: start, .. } => {
            let end = start.saturating_add(ANSWER_TIMEOUT).min(now);
            let reason = format!("no answer within {:.1} us", (end - start) as f64 / 1e6);
            (Place::Time { start, end }, reason)
        }
        Place::Line(_) => (place, "no answer before the next request".to_owned()),
    };
    let cause = "only the request is on the line: no encoder, A and B exchanged, or not its bit rate";
    let refusal =
        Refusal { class: NO_RESPONSE, reason, field: None, bit: None, time: None, cause: Some(cause.to_owned()) };
    Event {
        place,
        direction: Some(Direction::Answer),
        kind: kind(Some(request.data_id())),
        fields: Vec::new(),
        position: None,
        delay: None,
        verdict: Verdict::Refused(Box::new(refusal)),
    }
}

fn event(frame: &Frame, direction: Direction, id: Option<DataId>, fields: Vec<Field>, verdict: Verdict) -> Event {
    let (direction, kind) = (Some(direction), kind(id));
    Event { place: frame.place(), direction, kind, fields, position: None, delay: None, verdict }
}

fn kind(id: Option<DataId>) -> Cow<'static, str> {
    Cow::Borrowed(match id {
        Some(DataId::ReadSingleTurn) => "ID 0",
        Some(DataId::ReadMultiTurn) => "ID 1",
        Some(DataId::ReadEncoderId) => "ID 2",
        Some(DataId::ReadAll) => "ID 3",
        Some(DataId::WriteEeprom) => "ID 6",
        Some(DataId::ResetErrors) => "ID 7",
        Some(DataId::SetSingleTurnZero) => "ID 8",
        Some(DataId::ResetTurnsAndErrors) => "ID C",
        Some(DataId::ReadEeprom) => "ID D",
        None => "ID ?",
    })
}

/// What a reset request clears. One of ten has to be seen ten times to have an effect.
fn resets(id: DataId) -> Option<Field> {
    let what = match id {
        DataId::ResetErrors => "errors",
        DataId::SetSingleTurnZero => "single-turn position",
        DataId::ResetTurnsAndErrors => "turns and errors",
        _ => return None,
    };
    Some(Field { name: "resets", value: Value::Text(what.to_owned()) })
}

fn status(sf: StatusField) -> Field {
    let set = sf.iter_names().map(|(name, _)| name).collect();
    Field { name: "SF", value: Value::Flags { raw: sf.bits().into(), digits: 2, set } }
}

fn alarms(almc: Almc) -> Field {
    let set = almc.iter_names().map(|(name, _)| name).collect();
    Field { name: "ALMC", value: Value::Flags { raw: almc.bits().into(), digits: 2, set } }
}

fn address(adf: Adf) -> Field {
    let set = if adf.busy() { vec!["busy"] } else { Vec::new() };
    Field { name: "ADF", value: Value::Flags { raw: adf.bits().into(), digits: 2, set } }
}

fn number(name: &'static str, value: u32) -> Field {
    Field { name, value: Value::Number { value: value.into(), unit: "" } }
}

fn hex(name: &'static str, byte: u8) -> Field {
    Field { name, value: Value::Hex { value: byte.into(), digits: 2 } }
}

fn bytes(frame: &Frame) -> Field {
    let text = frame.bytes().iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ");
    Field { name: "bytes", value: Value::Text(text) }
}

fn spikes(frame: &Frame) -> Option<Field> {
    let value = Value::Number { value: frame.spikes.into(), unit: "" };
    (frame.spikes > 0).then_some(Field { name: "spikes", value })
}

/// The position does not fit the encoder: said beside the values, which are those of the line.
fn too_wide(error: Error, resolution: Resolution, fields: &mut Vec<Field>) -> Option<Position> {
    let text = format!("{error}; taken as {} + {} bits", resolution.abs_bits(), resolution.abm_bits());
    fields.push(Field { name: "width", value: Value::Text(text) });
    None
}

/// Fields of a request.
fn request_names(id: DataId) -> &'static [&'static str] {
    match id {
        DataId::WriteEeprom => &["CF", "ADF", "EDF", "CRC"],
        DataId::ReadEeprom => &["CF", "ADF", "CRC"],
        _ => &["CF"],
    }
}

/// Fields of an answer.
fn answer_names(id: DataId) -> &'static [&'static str] {
    match id {
        DataId::ReadSingleTurn | DataId::ResetErrors | DataId::SetSingleTurnZero | DataId::ResetTurnsAndErrors => {
            &["CF", "SF", "ABS0", "ABS1", "ABS2", "CRC"]
        }
        DataId::ReadMultiTurn => &["CF", "SF", "ABM0", "ABM1", "ABM2", "CRC"],
        DataId::ReadEncoderId => &["CF", "SF", "ENID", "CRC"],
        DataId::ReadAll => &["CF", "SF", "ABS0", "ABS1", "ABS2", "ENID", "ABM0", "ABM1", "ABM2", "ALMC", "CRC"],
        DataId::WriteEeprom | DataId::ReadEeprom => &["CF", "ADF", "EDF", "CRC"],
    }
}

fn verdict(frame: &Frame, names: &[&'static str], error: Option<Error>) -> Verdict {
    let Some(error) = error else { return Verdict::Ok };
    let (field, bit) = place(error, frame);
    // A field that is missing should have begun where the frame ends.
    let start = field.map(|field| frame.bytes().get(field).and(frame.starts.get(field)).copied().unwrap_or(frame.end));
    let start = start.filter(|_| frame.line.is_none());
    Verdict::Refused(Box::new(Refusal {
        class: error.class().name(),
        reason: error.to_string(),
        field: field.and_then(|field| names.get(field)).map(|name| (*name).to_owned()),
        bit,
        time: start,
        cause: None,
    }))
}

/// The field in which an error shows, and the first bit of it that is wrong: 0 is the start bit.
fn place(error: Error, frame: &Frame) -> (Option<usize>, Option<u32>) {
    let differs = |got: u8, want: u8| Some(1 + (got ^ want).trailing_zeros()).filter(|bit| *bit < 9);
    match error {
        Error::StartBit { field } => (Some(field.into()), Some(0)),
        Error::Delimiter { field } => (Some(field.into()), Some(9)),
        Error::Truncated { got, .. } => (Some(got.into()), None),
        Error::SinkCode { cf } => (Some(0), differs(cf & 0b111, 0b010)),
        Error::Parity { .. } => (Some(0), Some(8)),
        Error::UnknownDataId { .. } => (Some(0), None),
        Error::CfMismatch { got, want } => (Some(0), differs(got, want)),
        Error::Crc { .. } => (Some(frame.fields.saturating_sub(1)), None),
        Error::AddressMismatch { got, want } => (Some(1), differs(got, want)),
        Error::DataMismatch { got, want } => (Some(2), differs(got, want)),
        _ => (None, None),
    }
}
