//! A-format frames as events: names, values, positions, reasons.

use std::borrow::Cow;

use nikon_aformat::{
    Alm, Body, Command, Data, EncoderStatus, Error, Expected, Operation, PmAlm, Request, Resolution, Response,
    Temperature, TypeWord,
};

use super::{Group, Settings};
use crate::event::{Direction, Event, Field, NO_RESPONSE, Place, Position, Refusal, Value, Verdict};

/// The fields an event may have.
pub const FIELDS: &[&str] = &[
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
pub(super) fn request(group: &Group, result: Result<Request, Error>) -> Event {
    let mut fields = Vec::new();
    match result {
        Ok(request) => {
            fields.push(number("EA", request.ea.get().into(), ""));
            arguments(request.operation, &mut fields);
        }
        Err(_) => fields.push(words(group)),
    }
    fields.extend(spikes(group));
    let names: &[&str] = if group.contents.len() > 1 { &["CDF", "MDF", "MDF", "MDF", "MDF"] } else { &["CDF"] };
    let kind = result.map_or(Cow::Borrowed("request"), |request| Cow::Borrowed(request.command().mnemonic()));
    event(group, Direction::Request, kind, fields, verdict(group, names, result.err()))
}

fn arguments(operation: Operation, fields: &mut Vec<Field>) {
    match operation {
        Operation::EepromRead { address } => fields.push(hex("address", address.into(), 2)),
        Operation::EepromWrite { address, data } => {
            fields.extend([hex("address", address.get().into(), 2), hex("data", data.into(), 4)]);
        }
        Operation::EepromReadBank { bank, address } => {
            fields.extend([hex("bank", bank.into(), 2), hex("address", address.into(), 2)]);
        }
        Operation::EepromWriteBank { bank, address, data } => {
            let place = [hex("bank", bank.into(), 2), hex("address", address.into(), 2)];
            fields.extend(place.into_iter().chain([hex("data", data.into(), 4)]));
        }
        Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id } => {
            fields.push(hex("ID", id.get().into(), 6));
        }
        Operation::CoefficientWrite { coefficient } => {
            fields.push(number("coefficient", coefficient.get().into(), ""));
        }
        _ => {}
    }
    let effect = match operation.command() {
        Command::ClearStatus => "clears alarms",
        Command::ClearMultiturn => "clears turns",
        Command::ClearStatusMultiturn => "clears alarms and turns",
        Command::SetAddress1 => "sets the address",
        Command::ZeroPreset => "sets the single-turn zero",
        _ => return,
    };
    fields.push(Field { name: "effect", value: Value::Text(format!("{effect}, one of eight")) });
}

/// What is known of the encoder.
pub(super) struct Encoder {
    settings: Settings,
    /// By the type word, once the line has carried it.
    hint: Option<Resolution>,
}

impl Encoder {
    pub(super) fn new(settings: Settings) -> Self {
        Self { settings, hint: None }
    }

    /// A reply as it was on the line.
    pub(super) fn answer(
        &mut self,
        group: &Group,
        expected: Option<Expected>,
        result: Result<Response, Error>,
        delay: Option<i64>,
    ) -> Event {
        let mut fields = Vec::with_capacity(8);
        let mut position = None;
        match result {
            Ok(response) => {
                position = self.response(response, &mut fields);
                let (crc, _) = response.emit().crc();
                let received = group.contents.last().map_or(crc, |last| (last >> 8) as u8).reverse_bits();
                fields.push(hex("CRC", received.into(), 2));
            }
            Err(_) => fields.push(words(group)),
        }
        fields.extend(spikes(group));
        let kind = expected.map_or("reply", |expected| expected.command().mnemonic());
        let names = &["IF", "data", "data", "data", "data", "data"];
        let mut event =
            event(group, Direction::Answer, Cow::Borrowed(kind), fields, verdict(group, names, result.err()));
        event.position = position;
        event.delay = delay;
        event
    }

    fn response(&mut self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        fields.push(number("EA", response.ea.get().into(), ""));
        match response.body {
            Body::Abs17 { es_any, .. } => {
                let set = if es_any { vec!["any"] } else { Vec::new() };
                fields.push(Field { name: "ES", value: Value::Flags { raw: es_any.into(), digits: 1, set } });
            }
            Body::Full { es, .. } => fields.push(status(es)),
        }
        let position = self.position(response, fields);
        self.data(response, fields);
        position
    }

    fn position(&self, response: Response, fields: &mut Vec<Field>) -> Option<Position> {
        if let Some(Data::Abs24High { abs }) = response.data() {
            fields.push(number("ABS", i64::from(abs.get()) << 16, ""));
            return None;
        }
        let abs = response.abs()?;
        let counts = i64::try_from(abs).unwrap_or(i64::MAX);
        fields.push(number("ABS", counts, ""));
        let bits = response.layout().abs_bits();
        let Some(resolution) = self.resolution() else {
            return Some(Position { counts, span: Some(1 << bits), per_turn: None });
        };
        match resolution.position(&response) {
            Ok(position) => Some(Position {
                counts,
                span: Some(1 << (resolution.st_bits() + position.turns_bits)),
                per_turn: Some(resolution.counts_per_turn()),
            }),
            Err(Error::NotCarried) => Some(Position { counts, span: Some(1 << bits), per_turn: None }),
            Err(error) => {
                let text = format!("{error}; taken as {} + {} bits", resolution.st_bits(), resolution.mt_bits());
                fields.push(Field { name: "width", value: Value::Text(text) });
                None
            }
        }
    }

    fn data(&mut self, response: Response, fields: &mut Vec<Field>) {
        fields.extend(response.alm().map(alarms));
        fields.extend(response.temperature().map(temperature));
        fields.extend(response.velocity().map(|velocity| number("velocity", velocity.into(), "")));
        match response.data() {
            Some(Data::Status { pm_alm, .. }) if pm_alm.bits() != 0 => fields.push(notices(pm_alm)),
            Some(Data::Eeprom { data, address }) => {
                fields.push(hex("address", address.into(), 2));
                // While the memory is busy the data say nothing.
                if !response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY)) {
                    fields.push(hex("data", data.into(), 4));
                    if address == TypeWord::EEPROM_ADDRESS && response.command() == Some(Command::EepromRead) {
                        self.hint = TypeWord(data).resolution().or(self.hint);
                    }
                }
            }
            Some(Data::EepromBank { data, bank, address, .. }) => {
                fields.extend([hex("bank", bank.into(), 2), hex("address", address.into(), 2)]);
                if !response.es().is_some_and(|es| es.contains(EncoderStatus::BUSY)) {
                    fields.push(hex("data", data.into(), 4));
                }
            }
            Some(Data::Id { id }) => fields.push(hex("ID", id.get().into(), 6)),
            Some(Data::Coefficient { coefficient }) => {
                fields.push(number("coefficient", coefficient.get().into(), ""));
            }
            Some(Data::Abs24VelAcc { acceleration, .. }) => {
                fields.push(number("acceleration", acceleration.into(), ""));
            }
            _ => {}
        }
    }

    /// The widths as the user gave them, else as the type word has them.
    fn resolution(&self) -> Option<Resolution> {
        let Settings { single_turn_bits, multi_turn_bits } = self.settings;
        let st = single_turn_bits.or(self.hint.map(Resolution::st_bits))?;
        let mt = multi_turn_bits.or(self.hint.map(Resolution::mt_bits)).unwrap_or(16);
        Resolution::new(st, mt).ok()
    }
}

/// Frames that the capture holds only in part: no fault of the line.
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

/// A piece of a request or reply at the end of the capture: what comes then is not known, so it is not sound.
pub(super) fn cut_off(place: Place) -> Event {
    let reason = "the capture ends inside a request or reply".to_owned();
    let cause = Some("the file was cut off, or recording stopped there".to_owned());
    let refusal = Refusal { class: "truncated", reason, field: None, bit: None, time: None, cause };
    Event { fields: Vec::new(), verdict: Verdict::Refused(Box::new(refusal)), ..cut(place, "") }
}

/// No reply came to the request at `place` until `now`.
pub(super) fn silence(request: Request, place: Place, timeout: i64, now: i64) -> Event {
    let (place, reason) = match place {
        Place::Time { end: start, .. } => {
            let end = start.saturating_add(timeout).min(now);
            let reason = format!("no reply within {:.1} us", (end - start) as f64 / 1e6);
            (Place::Time { start, end }, reason)
        }
        Place::Line(_) => (place, "no reply before the next request".to_owned()),
    };
    let cause = "only the request is on the line: no encoder of this address, A and B exchanged, or not its bit rate";
    let refusal =
        Refusal { class: NO_RESPONSE, reason, field: None, bit: None, time: None, cause: Some(cause.to_owned()) };
    Event {
        place,
        direction: Some(Direction::Answer),
        kind: Cow::Borrowed(request.command().mnemonic()),
        fields: Vec::new(),
        position: None,
        delay: None,
        verdict: Verdict::Refused(Box::new(refusal)),
    }
}

fn event(group: &Group, direction: Direction, kind: Cow<'static, str>, fields: Vec<Field>, verdict: Verdict) -> Event {
    Event { place: group.place(), direction: Some(direction), kind, fields, position: None, delay: None, verdict }
}

fn status(es: EncoderStatus) -> Field {
    let names = [
        (EncoderStatus::BUSY, "busy"),
        (EncoderStatus::BATT, "battery"),
        (EncoderStatus::WARNING, "warning"),
        (EncoderStatus::ERROR, "error"),
    ];
    let set = names.iter().filter(|(flag, _)| es.contains(*flag)).map(|(_, name)| *name).collect();
    Field { name: "ES", value: Value::Flags { raw: es.bits().into(), digits: 1, set } }
}

fn alarms(alm: Alm) -> Field {
    let set = alm.iter_names().map(|(name, _)| name).collect();
    Field { name: "ALM", value: Value::Flags { raw: alm.bits().into(), digits: 4, set } }
}

fn notices(pm_alm: PmAlm) -> Field {
    let set = pm_alm.iter_names().map(|(name, _)| name).collect();
    Field { name: "PM-ALM", value: Value::Flags { raw: pm_alm.bits().into(), digits: 2, set } }
}

fn temperature(temperature: Temperature) -> Field {
    let milli = temperature.milli_celsius();
    Field { name: "temperature", value: Value::Text(format!("{}.{:02} C", milli / 1000, milli % 1000 / 10)) }
}

fn number(name: &'static str, value: i64, unit: &'static str) -> Field {
    Field { name, value: Value::Number { value, unit } }
}

fn hex(name: &'static str, value: u64, digits: usize) -> Field {
    Field { name, value: Value::Hex { value, digits } }
}

/// The content bits as vendor documents print them, the first bit of the line in bit 15.
fn words(group: &Group) -> Field {
    let text = group.contents.iter().map(|content| format!("{:04X}", content.reverse_bits())).collect::<Vec<_>>();
    Field { name: "words", value: Value::Text(text.join(" ")) }
}

fn spikes(group: &Group) -> Option<Field> {
    (group.spikes > 0).then(|| number("spikes", group.spikes.into(), ""))
}

fn verdict(group: &Group, names: &[&'static str], error: Option<Error>) -> Verdict {
    let Some(error) = error else { return Verdict::Ok };
    let last = group.contents.len().saturating_sub(1);
    let (frame, bit) = match error {
        Error::StartBit { frame } => (Some(usize::from(frame)), Some(0)),
        Error::Delimiter { frame } => (Some(usize::from(frame)), Some(17)),
        Error::Truncated { .. } => (Some(last + 1), None),
        Error::Crc { .. } => (Some(last), None),
        Error::FrameCode { frame, .. } => (Some(usize::from(frame)), Some(4)),
        Error::SyncCode { .. } => (Some(0), Some(1)),
        Error::AddressMismatch { .. } => (Some(0), Some(4)),
        Error::CommandMismatch { .. } | Error::UnknownCommand { .. } => (Some(0), Some(7)),
        Error::FixedBit => (Some(0), Some(12)),
        _ => (None, None),
    };
    let time = frame.map(|frame| group.starts.get(frame).copied().unwrap_or(group.end));
    let disturbed = matches!(error, Error::Crc { .. } | Error::Crc3 { .. });
    Verdict::Refused(Box::new(Refusal {
        class: error.class().name(),
        reason: error.to_string(),
        field: frame.and_then(|frame| names.get(frame)).map(|name| (*name).to_owned()),
        bit,
        time: time.filter(|_| group.line.is_none()),
        cause: disturbed.then(|| "single bits were disturbed".to_owned()),
    }))
}
