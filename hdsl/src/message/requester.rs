use super::bytes::MessageBytes;
use super::limits::Limits;
use super::long::{LongAnswer, LongRequest};
use super::nibbles::{Collector, Sender, answer_len};
use super::short::{ShortAnswer, ShortRequest};
use crate::error::Error;
use crate::parameter::{EncoderSymbol, MasterSymbol};

/// The master's side of the parameters channel: one short and one long message can be under way.
///
/// A short message has priority over a long one, and may be sent while the long one waits for its answer; the nibbles of two
/// requests are never interleaved. A short message that is answered with SNAK or not at all is sent again, up to the limit of
/// tries, even if it is a write. A long one is not repeated: LNAK or a wrong CRC ends it, and the application decides.
///
/// A message that began before the request had been sent is never its answer. An answer that comes after its request was
/// abandoned ([`Error::NoAnswer`]) cannot be told from the answer to the next request of the same kind; [`reset`](Self::reset)
/// makes the encoder forget it.
///
/// In every H-frame [`transmit`](Self::transmit) returns the symbol to send and [`receive`](Self::receive) takes the symbol that
/// came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Requester {
    limits: Limits,
    collector: Collector,
    short: Slot<ShortRequest>,
    long: Slot<LongRequest>,
    /// The two messages as sent on the line, created when they are started.
    bodies: [MessageBytes; 2],
    sending: Option<Sender>,
    reset: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Slot<T> {
    Free,
    /// Waiting to be sent; it was sent `tries` times before.
    Queued {
        request: T,
        tries: u8,
    },
    Sending {
        request: T,
        tries: u8,
    },
    Waiting {
        request: T,
        tries: u8,
        frames: u32,
    },
}

/// The messages that ended in an H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Finished {
    /// The short message.
    pub short: Option<Result<ShortAnswer, Error>>,
    /// The long message. A refusal by the encoder is an answer too.
    pub long: Option<Result<LongAnswer, Error>>,
}

/// Returns whether a message began after the request had been sent, in the H-frame of its last nibble at the earliest. `frames`
/// counts from the IDLE after it. A message that began earlier answers an earlier request.
fn is_answer(message: &Collector, frames: u32) -> bool {
    let nibbles = message.as_bytes().len().saturating_mul(2);
    usize::try_from(frames).is_ok_and(|frames| frames.saturating_add(2) >= nibbles)
}

impl<T: Copy> Slot<T> {
    const fn is_free(&self) -> bool {
        matches!(self, Self::Free)
    }
}

impl Requester {
    /// Creates a requester with nothing under way.
    pub const fn new(limits: Limits) -> Self {
        Self {
            limits,
            collector: Collector::new(),
            short: Slot::Free,
            long: Slot::Free,
            bodies: [MessageBytes::EMPTY; 2],
            sending: None,
            reset: false,
        }
    }

    /// FRES: no short message is under way.
    pub const fn is_short_free(&self) -> bool {
        self.short.is_free()
    }

    /// FREL: no long message is under way.
    pub(crate) const fn is_long_free(&self) -> bool {
        self.long.is_free()
    }

    /// Starts a short message.
    ///
    /// # Errors
    /// [`Error::Busy`].
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), Error> {
        if !self.short.is_free() {
            return Err(Error::Busy);
        }
        self.short = Slot::Queued { request, tries: 0 };
        self.bodies[0] = request.body();
        Ok(())
    }

    /// Starts a long message.
    ///
    /// # Errors
    /// [`Error::Busy`].
    pub fn start_long(&mut self, request: LongRequest) -> Result<(), Error> {
        if !self.long.is_free() {
            return Err(Error::Busy);
        }
        self.long = Slot::Queued { request, tries: 0 };
        self.bodies[1] = request.body();
        Ok(())
    }

    /// Drops all messages and sends INIT once (MRST), upon which the encoder drops its own and answers INIT.
    /// Messages under way end with [`Error::Dropped`].
    pub fn reset(&mut self) -> Finished {
        let dropped = self.drop_all();
        self.reset = true;
        dropped
    }

    /// Drops all messages without telling the encoder, because the link is restarting.
    pub(crate) fn drop_all(&mut self) -> Finished {
        let mut finished = Finished::default();
        self.drop_into(&mut finished);
        finished
    }

    /// Does the same, but keeps messages that have ended in this frame.
    pub(crate) fn drop_into(&mut self, finished: &mut Finished) {
        if !self.short.is_free() {
            (self.short, finished.short) = (Slot::Free, Some(Err(Error::Dropped)));
        }
        if !self.long.is_free() {
            (self.long, finished.long) = (Slot::Free, Some(Err(Error::Dropped)));
        }
        self.collector.idle();
        self.sending = None;
        self.reset = false;
    }

    /// Returns the symbol for the next H-frame.
    pub fn transmit(&mut self) -> MasterSymbol {
        if core::mem::take(&mut self.reset) {
            return MasterSymbol::Init;
        }
        if let Some(sending) = &mut self.sending {
            if let Some(nibble) = sending.next() {
                return MasterSymbol::Data(nibble);
            }
            // One IDLE at least before the next message.
            self.sending = None;
            self.sent();
            return MasterSymbol::Idle;
        }
        match self.next() {
            Some(body) => {
                let mut sender = Sender::new(body);
                let first = sender.next();
                self.sending = Some(sender);
                first.map_or(MasterSymbol::Idle, MasterSymbol::Data)
            }
            None => MasterSymbol::Idle,
        }
    }

    /// Returns the message whose turn it is.
    fn next(&mut self) -> Option<MessageBytes> {
        if let Slot::Queued { request, tries } = self.short {
            self.short = Slot::Sending { request, tries: tries.saturating_add(1) };
            return Some(self.bodies[0]);
        }
        if let Slot::Queued { request, tries } = self.long {
            self.long = Slot::Sending { request, tries: tries.saturating_add(1) };
            return Some(self.bodies[1]);
        }
        None
    }

    #[cold]
    fn sent(&mut self) {
        if let Slot::Sending { request, tries } = self.short {
            self.short = Slot::Waiting { request, tries, frames: 0 };
        }
        if let Slot::Sending { request, tries } = self.long {
            self.long = Slot::Waiting { request, tries, frames: 0 };
        }
    }

    /// Takes the symbol of an answer; `None` if it was bad.
    pub fn receive(&mut self, symbol: Option<EncoderSymbol>) -> Finished {
        let mut finished = Finished::default();
        self.take(symbol, &mut finished);
        finished
    }

    /// Takes the symbol of an answer; messages that end go into `finished`.
    pub(crate) fn take(&mut self, symbol: Option<EncoderSymbol>, finished: &mut Finished) {
        match symbol {
            Some(EncoderSymbol::Data(nibble)) => {
                if self.collector.nibble(nibble, answer_len) {
                    self.complete(finished);
                }
            }
            Some(EncoderSymbol::Idle | EncoderSymbol::Init) => self.collector.idle(),
            Some(EncoderSymbol::Snak) => {
                self.collector.idle();
                if let Slot::Waiting { request, tries, .. } = self.short {
                    finished.short = self.again(request, tries, Error::NotAccepted { tries });
                }
            }
            Some(EncoderSymbol::Lnak) => {
                self.collector.idle();
                if let Slot::Waiting { tries, .. } = self.long {
                    self.long = Slot::Free;
                    finished.long = Some(Err(Error::NotAccepted { tries }));
                }
            }
            // A hole in a message: what follows it is no message.
            None => {
                self.collector.drop_message();
            }
        }
        self.count(finished);
    }

    /// Handles a complete message, which is rare; kept separate so that the frames without one take little code.
    #[cold]
    #[inline(never)]
    fn complete(&mut self, finished: &mut Finished) {
        let message = &self.collector;
        if message.is_long() {
            let Slot::Waiting { request, frames, .. } = &self.long else { return };
            if !is_answer(message, *frames) {
                return;
            }
            finished.long = Some(match message.covered() {
                Some(covered) => {
                    LongAnswer::of_covered(covered).and_then(|answer| request.check_answer(answer).map(|()| answer))
                }
                None => LongAnswer::parse(message.as_bytes()),
            });
            self.long = Slot::Free;
        } else if let Slot::Waiting { request, frames, .. } = self.short {
            if !is_answer(message, frames) {
                return;
            }
            // A wrong one is passed over: the time-out sends the request again.
            if let Some(Ok(answer)) = message.covered().map(|covered| request.answer_of_covered(covered)) {
                self.short = Slot::Free;
                finished.short = Some(Ok(answer));
            }
        }
    }

    /// Counts the frames that a message has waited.
    #[inline]
    fn count(&mut self, finished: &mut Finished) {
        if let Slot::Waiting { request, tries, frames } = &mut self.short {
            if *frames >= self.limits.short_frames {
                let (request, tries) = (*request, *tries);
                finished.short = self.again(request, tries, Error::NoAnswer { tries });
            } else {
                *frames = frames.saturating_add(1);
            }
        }
        if let Slot::Waiting { tries, frames, .. } = &mut self.long {
            if *frames >= self.limits.long_frames {
                finished.long = Some(Err(Error::NoAnswer { tries: *tries }));
                self.long = Slot::Free;
            } else {
                *frames = frames.saturating_add(1);
            }
        }
    }

    /// Queues a short message again, or gives up.
    const fn again(&mut self, request: ShortRequest, tries: u8, error: Error) -> Option<Result<ShortAnswer, Error>> {
        if tries < self.limits.short_tries {
            self.short = Slot::Queued { request, tries };
            None
        } else {
            self.short = Slot::Free;
            Some(Err(error))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use super::*;
    use crate::parameter::Nibble;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn read(register: RemoteRegister) -> ShortRequest {
        ShortRequest::Read(register)
    }

    /// Lets both sides talk for `frames`; `change` may spoil what the encoder says.
    fn talk(
        master: &mut Requester,
        encoder: &mut Responder,
        frames: usize,
        mut change: impl FnMut(usize, EncoderSymbol) -> Option<EncoderSymbol>,
    ) -> (Vec<MasterSymbol>, Finished) {
        let mut all = Finished::default();
        let mut sent = Vec::new();
        for k in 0..frames {
            let symbol = master.transmit();
            sent.push(symbol);
            if let Some(request) = encoder.receive(symbol) {
                match request {
                    Request::Short(request) => {
                        let data = matches!(request, ShortRequest::Read(_)).then_some(0x55);
                        encoder.answer_short(ShortAnswer { register: request.register(), data });
                    }
                    Request::Long(request) => {
                        encoder.answer_long(&LongAnswer::to(&request, Ok(resolution())));
                    }
                }
            }
            let done = master.receive(change(k, encoder.transmit()));
            all.short = all.short.or(done.short);
            all.long = all.long.or(done.long);
        }
        (sent, all)
    }

    fn resolution() -> Data {
        Data::new(b"RESOLUTN").unwrap()
    }

    fn long() -> LongRequest {
        LongRequest {
            address: ResourceAddress::RESOLUTN,
            indirect: false,
            offset: None,
            access: Access::Read(Length::Eight),
        }
    }

    #[test]
    fn a_short_goes_before_a_long_and_both_are_answered() {
        let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT), Responder::new());
        master.start_long(long()).unwrap();
        master.start_short(read(RemoteRegister::PING)).unwrap();
        assert_eq!(master.start_short(read(RemoteRegister::PING)), Err(Error::Busy));
        assert_eq!(master.start_long(long()), Err(Error::Busy));
        let (sent, done) = talk(&mut master, &mut encoder, 60, |_, s| Some(s));
        // 7F, its CRC, an IDLE, CC 81, its CRC
        assert_eq!(sent[0], MasterSymbol::Data(Nibble::truncate(7)));
        assert_eq!(sent[6], MasterSymbol::Idle);
        assert_eq!(sent[7], MasterSymbol::Data(Nibble::truncate(12)));
        assert_eq!(done.short.unwrap().unwrap().data, Some(0x55));
        assert_eq!(done.long.unwrap().unwrap().result, Ok(resolution()));
        assert!(master.is_short_free() && master.is_long_free());
    }

    #[test]
    fn a_short_passes_while_a_long_waits() {
        let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT), Responder::new());
        master.start_long(long()).unwrap();
        // The encoder's answer to the long message is held back.
        for _ in 0..40 {
            let symbol = master.transmit();
            encoder.receive(symbol);
            master.receive(Some(encoder.transmit()));
        }
        master.start_short(read(RemoteRegister::SRSSI)).unwrap();
        let (_, done) = talk(&mut master, &mut encoder, 40, |_, s| Some(s));
        assert!(done.short.unwrap().is_ok() && done.long.is_none());
        encoder.answer_long(&LongAnswer::to(&long(), Ok(resolution())));
        let (_, done) = talk(&mut master, &mut encoder, 40, |_, s| Some(s));
        assert!(done.long.unwrap().is_ok());
    }

    #[test]
    fn a_silent_encoder_gets_the_message_again_up_to_the_limit() {
        let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT), Responder::new());
        master.start_short(read(RemoteRegister::PING)).unwrap();
        let (sent, done) = talk(&mut master, &mut encoder, 300, |_, _| Some(EncoderSymbol::Idle));
        let starts = sent.windows(2).filter(|w| w[0] == MasterSymbol::Idle && w[1] != MasterSymbol::Idle).count();
        assert_eq!((starts + 1, done.short), (3, Some(Err(Error::NoAnswer { tries: 3 }))));
        // SNAK does the same without waiting.
        master.start_short(read(RemoteRegister::PING)).unwrap();
        let (sent, done) = talk(&mut master, &mut encoder, 40, |_, _| Some(EncoderSymbol::Snak));
        assert_eq!(sent.iter().filter(|s| **s != MasterSymbol::Idle).count(), 18);
        assert_eq!(done.short, Some(Err(Error::NotAccepted { tries: 3 })));
        master.start_long(long()).unwrap();
        let (_, done) = talk(&mut master, &mut encoder, 40, |_, _| Some(EncoderSymbol::Lnak));
        assert_eq!(done.long, Some(Err(Error::NotAccepted { tries: 1 })));
        let mut master = Requester::new(Limits::DEFAULT.with_long_frames(20));
        master.start_long(long()).unwrap();
        let (_, done) = talk(&mut master, &mut encoder, 40, |_, _| Some(EncoderSymbol::Idle));
        assert_eq!(done.long, Some(Err(Error::NoAnswer { tries: 1 })));
    }

    /// The answer to a request that was given up comes while the next one for the same register goes out: its data are older
    /// than the request. Eight nibbles; the request has six and an IDLE.
    #[test]
    fn an_answer_that_began_before_its_request_was_out_is_none() {
        let answer = ShortAnswer { register: RemoteRegister::SRSSI, data: Some(3) }.emit();
        let nibbles: Vec<u8> = answer.as_bytes().iter().flat_map(|byte| [byte >> 4, byte & 15]).collect();
        for (begins, taken) in [(0, false), (1, false), (4, false), (5, true), (6, true), (20, true)] {
            let mut master = Requester::new(Limits::DEFAULT);
            master.start_short(read(RemoteRegister::SRSSI)).unwrap();
            let mut done = Finished::default();
            for frame in 0..40_usize {
                master.transmit();
                let nibble = frame.checked_sub(begins).and_then(|at| nibbles.get(at)).copied();
                let symbol = nibble.map_or(EncoderSymbol::Idle, |nibble| EncoderSymbol::Data(Nibble::truncate(nibble)));
                done.short = done.short.or(master.receive(Some(symbol)).short);
            }
            assert_eq!(done.short.is_some(), taken, "{begins}");
        }
    }

    #[test]
    fn a_reset_drops_both_sides() {
        let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT), Responder::new());
        master.start_long(long()).unwrap();
        master.start_short(read(RemoteRegister::PING)).unwrap();
        talk(&mut master, &mut encoder, 4, |_, s| Some(s));
        let dropped = master.reset();
        assert_eq!((dropped.short, dropped.long), (Some(Err(Error::Dropped)), Some(Err(Error::Dropped))));
        assert_eq!(master.transmit(), MasterSymbol::Init);
        encoder.receive(MasterSymbol::Init);
        assert_eq!((encoder.transmit(), encoder.transmit()), (EncoderSymbol::Init, EncoderSymbol::Idle));
        assert_eq!(master.transmit(), MasterSymbol::Idle);
        master.start_short(read(RemoteRegister::PING)).unwrap();
        assert!(talk(&mut master, &mut encoder, 40, |_, s| Some(s)).1.short.unwrap().is_ok());
    }

    proptest! {
        /// Whatever noise does to the channel, a message ends with the right data or with an error, and the channel
        /// is usable afterwards.
        #[test]
        fn noise_gives_no_wrong_data(bad in prop::collection::btree_set(0..200_usize, 0..30)) {
            let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT.with_long_frames(60)), Responder::new());
            master.start_long(long()).unwrap();
            master.start_short(read(RemoteRegister::PING)).unwrap();
            let (_, done) = talk(&mut master, &mut encoder, 400, |k, s| (!bad.contains(&k)).then_some(s));
            prop_assert!(master.is_short_free() && master.is_long_free());
            if let Ok(answer) = done.short.unwrap() {
                prop_assert_eq!(answer.data, Some(0x55));
            }
            if let Ok(answer) = done.long.unwrap() {
                prop_assert_eq!(answer.result, Ok(resolution()));
            }
        }
    }

    /// Back to back requests for a long time: the channel never hangs.
    #[test]
    fn continuous_messages() {
        let (mut master, mut encoder) = (Requester::new(Limits::DEFAULT), Responder::new());
        let (mut shorts, mut longs) = (0, 0);
        let rounds = if cfg!(miri) { 400 } else { 20_000 };
        for _ in 0..rounds {
            if master.is_short_free() {
                master.start_short(read(RemoteRegister::PING)).unwrap();
            }
            if master.is_long_free() {
                master.start_long(long()).unwrap();
            }
            let (_, done) = talk(&mut master, &mut encoder, 1, |_, s| Some(s));
            shorts += u32::from(done.short.is_some_and(|s| s.is_ok()));
            longs += u32::from(done.long.is_some_and(|l| l.is_ok()));
        }
        assert!(shorts > rounds / 50 && longs > rounds / 200, "{shorts} {longs}");
    }
}
