use super::bytes::MessageBytes;
use super::long::{LongAnswer, LongRequest};
use super::nibbles::{Collector, Sender, request_len};
use super::short::{ShortAnswer, ShortRequest};
use crate::parameter::{EncoderSymbol, MasterSymbol};

/// A valid request that an encoder received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Request {
    /// Access to a register.
    Short(ShortRequest),
    /// Access to a resource.
    Long(LongRequest),
}

servowire_core::one_line!(Request {
    Self::Short(request) => "{}", request;
    Self::Long(request) => "{}", request;
});

/// The encoder's side of the parameters channel.
///
/// In every H-frame [`receive`](Self::receive) takes the master's symbol and [`transmit`](Self::transmit) returns the symbol of
/// the answer. The responder itself answers a request that it does not understand with SNAK or LNAK; all others go to the
/// caller, which answers when it can.
///
/// ```
/// use hdsl::MasterSymbol;
/// use hdsl::message::{Data, LongAnswer, Request, Requester, Responder, ShortAnswer, ShortRequest, RemoteRegister};
///
/// let (mut master, mut encoder) = (Requester::new(Default::default()), Responder::new());
/// master.start_short(ShortRequest::Read(RemoteRegister::PING))?;
/// let mut answer = None;
/// // An H-frame each.
/// while answer.is_none() {
///     match encoder.receive(master.transmit()) {
///         Some(Request::Short(request)) => {
///             encoder.answer_short(ShortAnswer { register: request.register(), data: Some(0x5a) });
///         }
///         Some(Request::Long(request)) => encoder.answer_long(&LongAnswer::to(&request, Ok(Data::NONE))),
///         None => {}
///     }
///     answer = master.receive(Some(encoder.transmit())).short;
/// }
/// assert_eq!(answer.and_then(Result::ok).and_then(|answer| answer.data), Some(0x5a));
///
/// // A symbol that could not be read spoils the message that it was part of.
/// let half = ShortRequest::Read(RemoteRegister::PING).emit();
/// for at in 0..6 {
///     if at == 3 {
///         encoder.receive_nothing();
///     }
///     assert_eq!(encoder.receive(half.nibble(at).map_or(MasterSymbol::Idle, MasterSymbol::Data)), None);
/// }
/// # Ok::<(), hdsl::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Responder {
    collector: Collector,
    short: Option<MessageBytes>,
    long: Option<MessageBytes>,
    /// SNAK, LNAK or INIT, to be sent between messages.
    signal: Option<EncoderSymbol>,
    sending: Option<Sender>,
}

impl Default for Responder {
    fn default() -> Self {
        Self::new()
    }
}

impl Responder {
    /// Creates a responder with nothing under way.
    pub const fn new() -> Self {
        Self { collector: Collector::new(), short: None, long: None, signal: None, sending: None }
    }

    /// Takes the master's symbol.
    pub fn receive(&mut self, symbol: MasterSymbol) -> Option<Request> {
        let nibble = match symbol {
            MasterSymbol::Data(nibble) => nibble,
            MasterSymbol::Init => {
                *self = Self { signal: Some(EncoderSymbol::Init), ..Self::new() };
                return None;
            }
            _ => {
                self.collector.idle();
                return None;
            }
        };
        if !self.collector.nibble(nibble, request_len) {
            return None;
        }
        let message = &self.collector;
        if message.is_long() {
            if let Some(Ok(request)) = message.covered().map(LongRequest::of_covered) {
                return Some(Request::Long(request));
            }
            self.signal = Some(EncoderSymbol::Lnak);
        } else {
            if let Some(Ok(request)) = message.covered().map(ShortRequest::of_covered) {
                return Some(Request::Short(request));
            }
            self.signal = Some(EncoderSymbol::Snak);
        }
        None
    }

    /// Takes an unreadable symbol of the master: a message being received is lost.
    pub const fn receive_nothing(&mut self) {
        self.collector.drop_message();
    }

    /// Sends the answer to a short message as soon as the channel is free.
    pub fn answer_short(&mut self, answer: ShortAnswer) {
        self.short = Some(answer.body());
    }

    /// Sends the answer to a long message as soon as the channel is free and no short answer is waiting.
    pub fn answer_long(&mut self, answer: &LongAnswer) {
        self.long = Some(answer.body());
    }

    /// Returns the symbol for the answer.
    pub fn transmit(&mut self) -> EncoderSymbol {
        if let Some(sending) = &mut self.sending {
            if let Some(nibble) = sending.next() {
                return EncoderSymbol::Data(nibble);
            }
            self.sending = None;
            return EncoderSymbol::Idle;
        }
        if let Some(signal) = self.signal.take() {
            return signal;
        }
        match self.short.take().or_else(|| self.long.take()) {
            Some(body) => {
                let mut sender = Sender::new(body);
                let first = sender.next();
                self.sending = Some(sender);
                first.map_or(EncoderSymbol::Idle, EncoderSymbol::Data)
            }
            None => EncoderSymbol::Idle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::RemoteRegister;

    /// Every single wrong nibble of a request is answered with SNAK or makes the message look longer.
    #[test]
    fn a_damaged_request_is_refused() {
        let bytes = ShortRequest::Write(RemoteRegister::PING, 0xa5).emit();
        for at in 0..8 {
            for flip in 1..16 {
                let mut encoder = Responder::new();
                let mut requests = 0;
                for k in 0..8 {
                    let value = bytes.nibble(k).unwrap().get() ^ if k == at { flip } else { 0 };
                    requests += u8::from(
                        encoder.receive(MasterSymbol::Data(crate::parameter::Nibble::truncate(value))).is_some(),
                    );
                }
                encoder.receive(MasterSymbol::Idle);
                assert_eq!(requests, 0);
                let looks_longer = at == 0 && flip & 8 != 0;
                let refused = matches!(encoder.transmit(), EncoderSymbol::Snak | EncoderSymbol::Lnak);
                assert!(refused || looks_longer, "{at} {flip}");
            }
        }
    }
}
