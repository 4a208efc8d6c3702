//! Messages of the parameter channel, symbol by symbol.
//!
//! A short message may be sent while a long one waits for its answer; an answer itself says which of the two it belongs to.

use hdsl::message::{LongAnswer, RemoteRegister, Request, Responder, ShortRequest};
use hdsl::{EncoderSymbol, Error, MasterSymbol};

use crate::event::Field;

/// Both directions of the channel.
pub(super) struct Messages {
    requests: Responder,
    /// The short request that is waiting for its answer, and whether a long one is.
    short: Option<ShortRequest>,
    long: bool,
    /// Symbols of the answer so far.
    nibbles: Vec<u8>,
}

impl Messages {
    pub(super) fn new() -> Self {
        Self { requests: Responder::new(), short: None, long: false, nibbles: Vec::new() }
    }

    /// Takes the next symbol of the master; returns the request that it completes.
    pub(super) fn asked(&mut self, symbol: MasterSymbol) -> Option<Field> {
        let request = self.requests.receive(symbol)?;
        match request {
            Request::Short(request) => self.short = Some(request),
            Request::Long(_) => self.long = true,
        }
        Some(Field::text("message", request))
    }

    /// Takes the next symbol of the encoder, if there is one; returns the result of the answer that it ends.
    pub(super) fn answered(&mut self, symbol: Option<EncoderSymbol>) -> Option<Result<Field, Error>> {
        if let Some(EncoderSymbol::Data(nibble)) = symbol {
            self.nibbles.push(nibble.get());
            return None;
        }
        let nibbles = std::mem::take(&mut self.nibbles);
        let bytes: Vec<u8> =
            nibbles.chunks(2).map(|pair| pair.iter().fold(0, |byte, nibble| byte << 4 | nibble)).collect();
        let first = *bytes.first()?;
        // Where the request was before the capture, the answer stands for itself; what is no answer then is nothing.
        let asked = self.long || self.short.is_some();
        if first & 0x80 != 0 {
            let answer = LongAnswer::parse(&bytes);
            self.long &= answer.is_err();
            return Some(answer.map(|answer| Field::text("message", answer))).filter(|it| asked || it.is_ok());
        }
        let register = RemoteRegister::of_index(first);
        let said = if first & 0x40 == 0 { ShortRequest::Write(register, 0) } else { ShortRequest::Read(register) };
        let answer = self.short.unwrap_or(said).parse_answer(&bytes);
        if answer.is_ok() {
            self.short = None;
        }
        Some(answer.map(|answer| Field::text("message", answer))).filter(|it| asked || it.is_ok())
    }
}
