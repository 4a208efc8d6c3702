use super::{EepromRead, Step};
use crate::command::Command;
use crate::error::Error;
use crate::number::EncoderAddress;
use crate::operation::Operation;
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;
use crate::type_word::TypeWord;

/// Finds an encoder and its widths: command 4, then the type word of the EEPROM.
///
/// The bit rate is part of the encoder's order code and the caller has to try the rates: no response means that the rate is wrong.
/// One drive maker tries 4 Mbit/s first, then 2.5.
///
/// After power-on, an encoder needs [`POWER_UP_NS`](crate::POWER_UP_NS) before the first request.
///
/// On a line with several encoders, query each by its address with [`Detection::of`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Detection {
    ea: Option<EncoderAddress>,
    reading: Option<EepromRead>,
    end: Option<Step<Detected>>,
}

/// The encoder that was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Detected {
    /// Its address.
    pub ea: EncoderAddress,
    /// Its type word.
    pub type_word: TypeWord,
    /// Its widths, if the type word is a known one, in a resolution of version 2.1, because nothing on the line says which
    /// version it is.
    pub resolution: Option<Resolution>,
}

servowire_core::one_line!(Detected { Self { ea, type_word, .. } => "encoder {}: {}", ea, type_word; });

impl Detection {
    /// Finds the only encoder on the line, whatever its address.
    pub const fn search() -> Self {
        Self { ea: None, reading: None, end: None }
    }

    /// Queries the encoder with this address.
    pub const fn of(ea: EncoderAddress) -> Self {
        Self { ea: Some(ea), reading: None, end: None }
    }

    /// Returns the first request, to be sent at once: command 4 to the highest address, which any encoder answers, or the read
    /// of the type word.
    pub const fn start(&mut self, now_ns: u64) -> Step<Detected> {
        self.reading = None;
        self.end = None;
        match self.ea {
            Some(ea) => self.read(ea, now_ns),
            None => {
                Step::Send { request: Request::new(EncoderAddress::MAX, Operation::Abs40Mt), not_before_ns: now_ns }
            }
        }
    }

    servowire_core::receive! { Detected }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Detected> {
        let Some(mut reading) = self.reading else {
            let soon = ready_ns.saturating_add(crate::timing::REQUEST_GAP_NS.into());
            return match outcome {
                Ok(response) if response.command() == Some(Command::Abs40Mt) => self.read(response.ea, soon),
                Ok(_) => Step::Failed { error: Error::NotCarried, ready_ns: soon },
                Err(error) => Step::Failed { error, ready_ns: soon },
            };
        };
        let step = reading.receive(outcome, ready_ns);
        self.reading = Some(reading);
        step.and_then(|word, ready_ns| {
            let type_word = TypeWord(word);
            let value = Detected { ea: reading.ea(), type_word, resolution: type_word.resolution() };
            Step::Done { value, ready_ns }
        })
    }

    const fn read(&mut self, ea: EncoderAddress, not_before_ns: u64) -> Step<Detected> {
        let mut reading = EepromRead::new(ea, TypeWord::EEPROM_ADDRESS);
        let request = reading.begin();
        self.reading = Some(reading);
        Step::Send { request, not_before_ns }
    }
}
