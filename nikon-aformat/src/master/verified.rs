use super::eeprom::{READY_POLLING, is_busy, status_of};
use super::{EepromRead, Step, Write};
use crate::command::Command;
use crate::data::Data;
use crate::error::Error;
use crate::number::EncoderAddress;
use crate::operation::Operation;
use crate::request::Request;
use crate::response::Response;
use crate::status::Alm;

/// A [`Write`] that ends as done, not done, or with an unknown effect.
///
/// 1. STATUS is read until ES0 is clear, because a busy encoder repeats the arguments and does nothing. MEMERR must be
///    clear, so that afterwards it refers to this write. The only encoder on a line (command 19) is first asked for its address with command 17.
///    If an encoder is chosen by its identification code (command 20), its address is not known, and MEMERR says nothing.
/// 2. The write is sent **once**; after 30 ms STATUS is read. MEMERR must still be clear.
/// 3. What was written is read back, even if the response to the write is missing.
///
/// **One response is no evidence**: its CRC-8 may be right by chance. What was written counts as stored if the encoder has answered
/// the write and its status and the value is read back once, and otherwise if it is read back twice. Something else counts as stored
/// if it is read back twice in a row. MEMERR has to be reported twice, and a wrong bank by the write and by the read.
///
/// | it ends with | the encoder |
/// |---|---|
/// | `Done` | has stored it |
/// | [`Error::NotDone`] | has something else stored: what was there before, or what the damaged request asked for |
/// | [`Error::MemoryFault`], [`Error::BankError`] | was not asked to write, or reports that it failed |
/// | [`Error::Busy`] and faults of the first response | was not asked to write |
/// | [`Error::EffectUnknown`] | may have stored it: it cannot be read back, or MEMERR is set and may have been before (command 20) |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VerifiedWrite {
    write: Write,
    back: Back,
    /// The encoder to ask for the status.
    ea: EncoderAddress,
    phase: Phase,
    /// How the write itself ended.
    written: Written,
    /// The value last read back.
    seen: Option<u32>,
    tries: u16,
    end: Option<Step<()>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    Address,
    Ready,
    Writing,
    ReadingBack,
}

/// How the write itself ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Written {
    /// Its response or the status afterwards is missing.
    Unanswered,
    /// The encoder has answered it, and its status reports no fault.
    Answered,
    /// MEMERR is set; it may have been set before.
    Doubtful,
    /// The response to it reports that there is no such bank.
    NoBank,
}

/// How the written value is read back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Back {
    Word { read: EepromRead, data: u16 },
    Id(Request),
}

impl VerifiedWrite {
    /// Creates the verification of this write.
    pub const fn new(write: Write) -> Self {
        let Request { ea, operation } = write.request();
        let back = match operation {
            Operation::EepromWrite { address, data } => Back::Word { read: EepromRead::new(ea, address.get()), data },
            Operation::EepromWriteBank { bank, address, data } => {
                Back::Word { read: EepromRead::of_bank(ea, bank, address), data }
            }
            Operation::IdWrite2 { .. } => Back::Id(Request::new(ea, Operation::IdRead2)),
            Operation::CoefficientWrite { .. } => Back::Id(Request::new(ea, Operation::CoefficientRead)),
            _ => Back::Id(Request::new(ea, Operation::IdRead1)),
        };
        Self { write, back, ea, phase: Phase::Ready, written: Written::Unanswered, seen: None, tries: 0, end: None }
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<()> {
        self.tries = 0;
        self.written = Written::Unanswered;
        self.seen = None;
        self.end = None;
        let Request { ea, operation } = self.write.request();
        self.ea = ea;
        match operation {
            Operation::SetAddress2 { .. } => self.begin(now_ns),
            Operation::IdWrite2 { .. } => self.ask(Phase::Address, now_ns),
            _ => self.ask(Phase::Ready, now_ns),
        }
    }

    /// Asks for the address of the only encoder, or for the status.
    const fn ask(&mut self, phase: Phase, not_before_ns: u64) -> Step<()> {
        self.phase = phase;
        let operation = if let Phase::Address = phase { Operation::IdRead2 } else { Operation::Status };
        Step::Send { request: Request::new(self.ea, operation), not_before_ns }
    }

    servowire_core::receive! { () }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<()> {
        match self.phase {
            Phase::Address => self.address(outcome, ready_ns),
            Phase::Ready => self.ready(outcome, ready_ns),
            Phase::Writing => {
                let (written, ready_ns) = match self.write.receive(outcome, ready_ns) {
                    Step::Send { request, not_before_ns } => return Step::Send { request, not_before_ns },
                    Step::Failed { error: Error::MemoryFault, ready_ns } if self.is_chosen_by_id() => {
                        (Written::Doubtful, ready_ns)
                    }
                    Step::Failed { error: error @ Error::MemoryFault, ready_ns } => {
                        return Step::Failed { error, ready_ns };
                    }
                    // The memory may have been written to all the same, and be busy.
                    Step::Failed { error: Error::BankError, ready_ns } => {
                        (Written::NoBank, ready_ns.saturating_add(crate::timing::WRITE_BUSY_NS.into()))
                    }
                    Step::Failed { ready_ns, .. } => (Written::Unanswered, ready_ns),
                    Step::Done { ready_ns, .. } => (Written::Answered, ready_ns),
                };
                self.written = written;
                self.read_back(ready_ns)
            }
            Phase::ReadingBack => self.compare(outcome, ready_ns),
        }
    }

    const fn begin(&mut self, not_before_ns: u64) -> Step<()> {
        self.phase = Phase::Writing;
        let _ = self.write.start(not_before_ns);
        Step::Send { request: self.write.request(), not_before_ns }
    }

    /// Returns whether the address of the encoder is not known in advance.
    const fn is_chosen_by_id(&self) -> bool {
        matches!(self.write.request().operation, Operation::SetAddress2 { .. })
    }

    fn address(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<()> {
        match outcome {
            Ok(response) if response.command() == Some(Command::IdRead2) => {
                self.ea = response.ea;
                self.tries = 0;
                self.ask(Phase::Ready, ready_ns.saturating_add(crate::timing::REQUEST_GAP_NS.into()))
            }
            other => {
                let ask = Request::new(self.ea, Operation::IdRead2);
                self.again(ask, other.err().unwrap_or(Error::NotCarried), ready_ns)
            }
        }
    }

    fn ready(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<()> {
        let soon_ns = ready_ns.saturating_add(crate::timing::REQUEST_GAP_NS.into());
        let error = match status_of(self.ea, outcome) {
            Ok((response, alm)) if !is_busy(response) && !alm.contains(Alm::MEMBUSY) => {
                if alm.contains(Alm::MEMERR) {
                    return Step::Failed { error: Error::MemoryFault, ready_ns: soon_ns };
                }
                return self.begin(soon_ns);
            }
            Ok(_) => Error::Busy { tries: self.tries.saturating_add(1) },
            Err(error) => error,
        };
        self.again(Request::new(self.ea, Operation::Status), error, ready_ns)
    }

    /// Asks once more, a millisecond later, up to forty times.
    fn again(&mut self, request: Request, error: Error, ready_ns: u64) -> Step<()> {
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = ready_ns.saturating_add(READY_POLLING.interval_ns.into());
        if self.tries >= READY_POLLING.max_tries {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request, not_before_ns }
    }

    fn read_back(&mut self, not_before_ns: u64) -> Step<()> {
        self.phase = Phase::ReadingBack;
        self.tries = 0;
        let request = match &mut self.back {
            Back::Word { read, .. } => read.begin(),
            Back::Id(request) => *request,
        };
        Step::Send { request, not_before_ns }
    }

    fn compare(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<()> {
        let written = self.write.request();
        match &mut self.back {
            Back::Word { read, data } => match read.receive(outcome, ready_ns) {
                Step::Send { request, not_before_ns } => Step::Send { request, not_before_ns },
                Step::Failed { error: error @ Error::BankError, ready_ns } if self.written == Written::NoBank => {
                    Step::Failed { error, ready_ns }
                }
                Step::Failed { ready_ns, .. } => Step::Failed { error: Error::EffectUnknown, ready_ns },
                Step::Done { value, ready_ns } => {
                    let shown = Read { got: value.into(), want: (*data).into() };
                    let request = read.begin();
                    self.shown(shown, request, ready_ns)
                }
            },
            Back::Id(request) => {
                let request = *request;
                match outcome.ok().and_then(|response| read_back(written, request, response)) {
                    Some(shown) => self.shown(shown, request, ready_ns),
                    None => self.again(request, Error::EffectUnknown, ready_ns),
                }
            }
        }
    }

    /// Judges what was read back, or reads it once more.
    fn shown(&mut self, Read { got, want }: Read, request: Request, ready_ns: u64) -> Step<()> {
        let twice = self.seen.replace(got) == Some(got);
        match (got == want, self.written) {
            (true, Written::Answered) => Step::Done { value: (), ready_ns },
            // Whether it was stored is what MEMERR would say.
            (true, Written::Doubtful) => Step::Failed { error: Error::EffectUnknown, ready_ns },
            (true, _) if twice => Step::Done { value: (), ready_ns },
            (false, _) if twice => Step::Failed { error: Error::NotDone, ready_ns },
            _ => self.again(request, Error::EffectUnknown, ready_ns),
        }
    }
}

/// What was read back, and what was written.
struct Read {
    got: u32,
    want: u32,
}

/// Returns what a response shows; `None` if it is inconclusive.
fn read_back(written: Request, asked: Request, response: Response) -> Option<Read> {
    let own = response.ea == asked.ea || !asked.command().answers_with_own_address();
    if response.command() != Some(asked.command()) || !own || is_busy(response) {
        return None;
    }
    match (written.operation, response.data()?) {
        (
            Operation::IdWrite1 { id: want } | Operation::IdWrite2 { id: want } | Operation::SetAddress2 { id: want },
            Data::Id { id },
        ) => Some(Read { got: id.get(), want: want.get() }),
        (Operation::CoefficientWrite { coefficient: want }, Data::Coefficient { coefficient }) => {
            Some(Read { got: coefficient.get(), want: want.get() })
        }
        _ => None,
    }
}

/// Returns the encoder to ask, so that the count of a reset restarts, and whether it answers with this address.
pub(super) const fn apart(request: Request) -> (Request, Option<EncoderAddress>) {
    match request.operation {
        // The address of the only encoder is not known.
        Operation::SetAddress1 => (Request::new(request.ea, Operation::IdRead2), None),
        _ => (Request::new(request.ea, Operation::Status), Some(request.ea)),
    }
}
