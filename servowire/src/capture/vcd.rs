//! Value change dumps (IEEE 1364): sigrok, PulseView, Logic 2, GTKWave, simulators.

use std::collections::HashMap;
use std::io::{self, Cursor, Read};

use vcd::{Command, IdCode, ParseError, Parser, TimescaleUnit, Value};

use super::{Change, Input, Line};
use crate::fault::{At, Fault};

/// Changes given at once.
const BLOCK: usize = 4096;

/// A VCD file behind its header. Channels are the variables of one bit.
pub struct Vcd {
    name: String,
    /// A line end is put behind the file, since the parser wants white space behind the last token.
    parser: Parser<io::Chain<Input, Cursor<&'static [u8]>>>,
    channels: Vec<String>,
    codes: HashMap<IdCode, u16>,
    tick: Tick,
    now: i64,
    /// Time of the file's last time stamp in its own unit.
    stamp: u64,
    over: bool,
}

impl Vcd {
    /// Reads the header.
    pub fn new(input: Input) -> Result<Self, Fault> {
        let name = input.name().to_owned();
        let mut file = Self {
            name,
            parser: Parser::new(input.chain(Cursor::new(b"\n".as_slice()))),
            channels: Vec::new(),
            codes: HashMap::new(),
            // What most tools mean when they leave it out.
            tick: Tick::new(1, TimescaleUnit::NS),
            now: 0,
            stamp: 0,
            over: false,
        };
        file.header()?;
        Ok(file)
    }

    fn header(&mut self) -> Result<(), Fault> {
        let mut scopes: Vec<String> = Vec::new();
        let mut found: Vec<(Vec<String>, String, u16)> = Vec::new();
        loop {
            match self.parser.next() {
                Some(Ok(Command::Enddefinitions)) => break,
                Some(Ok(Command::Timescale(number, unit))) => self.tick = Tick::new(number, unit),
                Some(Ok(Command::ScopeDef(_, scope))) => scopes.push(scope),
                Some(Ok(Command::Upscope)) => drop(scopes.pop()),
                Some(Ok(Command::VarDef(_, 1, code, reference, index))) => {
                    let reference = match index {
                        Some(index) => format!("{reference}{index}"),
                        None => reference,
                    };
                    let next =
                        u16::try_from(self.codes.len()).map_err(|_| self.fault("more than 65536 one-bit variables"))?;
                    let channel = *self.codes.entry(code).or_insert(next);
                    if channel == next {
                        found.push((scopes.clone(), reference, channel));
                    }
                }
                Some(Ok(Command::Timestamp(_) | Command::ChangeScalar(..))) => {
                    return Err(self.fault("value changes before $enddefinitions: the header is damaged"));
                }
                Some(Ok(_)) => {}
                Some(Err(e)) => return Err(self.broken(&e, "in the header")),
                None => return Err(self.fault("the file ends in its header, before $enddefinitions")),
            }
        }
        if found.is_empty() {
            return Err(self.fault("no variable of one bit in this file, so no line to decode"));
        }
        // The name alone where it is the only one of its kind, else with its scopes.
        for (scopes, reference, _) in &found {
            let alone = found.iter().filter(|(_, other, _)| other == reference).count() == 1;
            let path = scopes.iter().map(String::as_str).chain([reference.as_str()]).collect::<Vec<_>>();
            self.channels.push(if alone { reference.clone() } else { path.join(".") });
        }
        Ok(())
    }

    fn fault(&self, what: impl Into<String>) -> Fault {
        Fault::new(&self.name, At::Line(self.parser.line()), what)
    }

    fn broken(&self, error: &io::Error, place: &str) -> Fault {
        if error.kind() == io::ErrorKind::UnexpectedEof {
            // The line end put behind the file counts as one.
            let line = At::Line(self.parser.line().saturating_sub(1).max(1));
            return Fault::new(&self.name, line, format!("the file ends {place}: it was cut off"));
        }
        match error.get_ref().and_then(|e| e.downcast_ref::<ParseError>()) {
            Some(parse) => Fault::new(&self.name, At::Line(parse.line()), format!("not VCD {place}: {}", parse.kind())),
            None => self.fault(format!("cannot be read: {error}")),
        }
    }

    fn step(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let command = match self.parser.next() {
            None => return Ok(false),
            Some(Err(e)) => return Err(self.broken(&e, "in the middle of a value change")),
            Some(Ok(command)) => command,
        };
        match command {
            Command::Timestamp(stamp) => {
                if stamp < self.stamp {
                    return Err(self.fault(format!("time goes back from #{} to #{stamp}", self.stamp)));
                }
                self.stamp = stamp;
                self.now = self.tick.time(stamp).ok_or_else(|| self.fault(format!("time #{stamp} is too large")))?;
            }
            Command::ChangeScalar(code, value) => {
                // Unknown and floating: the line keeps the level it had.
                let level = match value {
                    Value::V0 => false,
                    Value::V1 => true,
                    Value::X | Value::Z => return Ok(true),
                };
                if let Some(&channel) = self.codes.get(&code) {
                    changes.push(Change { time: self.now, channel, level });
                }
            }
            Command::ChangeVector(code, vector) => {
                if let (Some(&channel), Some(value)) = (self.codes.get(&code), vector.get(0)) {
                    if matches!(value, Value::V0 | Value::V1) {
                        changes.push(Change { time: self.now, channel, level: value == Value::V1 });
                    }
                }
            }
            _ => {}
        }
        Ok(true)
    }
}

impl Line for Vcd {
    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        while !self.over && changes.len() < enough {
            let more = self.step(changes);
            self.over = !matches!(more, Ok(true));
            more?;
        }
        Ok(!self.over)
    }

    fn reached(&self) -> i64 {
        self.now
    }
}

/// The file's unit of time in femtoseconds.
#[derive(Clone, Copy)]
struct Tick(u128);

impl Tick {
    fn new(number: u32, unit: TimescaleUnit) -> Self {
        Self(u128::from(number) * (1_000_000_000_000_000 / u128::from(unit.divisor())))
    }

    fn time(self, stamp: u64) -> Option<i64> {
        i64::try_from((u128::from(stamp).checked_mul(self.0)? + 500) / 1000).ok()
    }
}
