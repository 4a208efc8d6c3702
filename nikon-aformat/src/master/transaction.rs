use super::hunt::{Block, Found, Hunt};
use super::{Line, Progress};
use crate::bus::{Addresses, Bus, Outcome};
use crate::command::Command;
use crate::error::Error;
use crate::evidence::Evidence;
use crate::expected::Expected;
use crate::layout::Layout;
use crate::number::EncoderAddress;
use crate::operation::Operation;
use crate::request::{Frames, Request};
use crate::resolution::Resolution;
use crate::response::Response;
use crate::timing::BitRate;

/// A response that has passed all checks, and when its values were sampled: the exact instant is not documented, but it lies
/// after the end of the request and before the response began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Exchange {
    /// What the encoder sent.
    pub response: Response,
    /// The earliest instant of sampling, in ns: the end of the request. Its age counts from here.
    pub sampled_ns: u64,
    /// The latest instant of sampling, in ns: the first start bit of the response; it may be late by up to
    /// [`Line::latency_budget_ns`].
    pub began_ns: u64,
}

servowire_core::one_line!(Exchange {
    Self { response, sampled_ns, began_ns } => "{}, sampled from {} to {} ns", response, sampled_ns, began_ns;
});

impl Exchange {
    /// Returns what the response says about the position, to be judged where it is used.
    pub const fn evidence(&self, resolution: Resolution) -> Evidence {
        Evidence::of(self.response, resolution, self.sampled_ns)
    }
}

/// What a master sends, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// The frames, with [`Line::frame_gap_ns`] between them.
    pub frames: Frames,
    /// When the first start bit is on the line, in ns.
    pub start_ns: u64,
    /// When the last delimiter ends, in ns.
    pub end_ns: u64,
}

/// One request and its response, frame by frame or in blocks.
///
/// It ends with the first response that passes all checks and began after the request had left the line. Responses refused
/// meanwhile do not end it: the answer may still come. When no answer can arrive any more, it fails with the fault of the first
/// refused response; the line is then free. A transaction that is done or has failed stays in that state.
///
/// Hand over what was received before calling [`poll`](Self::poll). For a multi-response request it takes the first response;
/// [`BusTransaction`] takes all of them.
///
/// If the receiver hears the master's own request, no setting is needed for that: its sync code is not that of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    expected: Expected,
    line: Line,
    hunt: Hunt,
    start_ns: u64,
    asked_ns: u64,
    until_ns: u64,
    refused: Option<Error>,
    end: Option<Result<Exchange, Error>>,
    ready_ns: u64,
}

impl Transaction {
    /// Creates a transaction without request or response, as a place for [`restart`](Self::restart). It counts as one that
    /// ended with [`Error::NoResponse`], and its line is free at any time.
    #[inline]
    pub const fn idle() -> Self {
        Self {
            request: NOTHING,
            expected: Expected::new(Layout::Abs40, Command::Abs40),
            line: Line::new(BitRate::Mbit2_5),
            hunt: Hunt::new(0),
            start_ns: 0,
            asked_ns: 0,
            until_ns: 0,
            refused: None,
            end: Some(Err(Error::NoResponse)),
            ready_ns: 0,
        }
    }

    /// Begins a transaction with an encoder of this resolution; the first start bit of the request is at `start_ns`.
    ///
    /// A request that encoders of this version do not understand fails at once with [`Error::UnsupportedInVersion`]; if the
    /// settings of the line leave no time for a response, it fails at once with [`Error::Line`]. Such a request must not be
    /// sent.
    pub fn start(request: Request, resolution: Resolution, line: Line, start_ns: u64) -> Self {
        Self::begun(request, resolution, line, start_ns)
    }

    /// Begins the next transaction in the same place, whatever the state of this one: like [`start`](Self::start), without a copy.
    pub fn restart(&mut self, request: Request, resolution: Resolution, line: Line, start_ns: u64) {
        *self = Self::begun(request, resolution, line, start_ns);
    }

    /// It is inlined, so that the transaction is created in its final place.
    #[inline(always)]
    fn begun(request: Request, resolution: Resolution, line: Line, start_ns: u64) -> Self {
        let expected = request.expected(resolution);
        let asked_ns = start_ns.saturating_add(line.request_ns(request).into());
        Self {
            request,
            expected,
            line,
            hunt: Hunt::new(asked_ns),
            start_ns,
            asked_ns,
            until_ns: asked_ns.saturating_add(line.answered_ns(&expected).into()),
            refused: None,
            end: refusal(request, resolution, &line).map(Err),
            ready_ns: start_ns,
        }
    }

    /// Returns what is to be sent, and when.
    pub const fn transmission(&self) -> Transmission {
        Transmission { frames: self.request.emit(), start_ns: self.start_ns, end_ns: self.asked_ns }
    }

    /// Takes frames that were received back to back (a single one, a DMA block, or all until the line went idle), the last
    /// delimiter at `end_ns`. Each is its content bits, the first on the line in bit 0; `None` stands for a frame whose
    /// delimiter reads 0.
    ///
    /// Nothing is known about pauses within a block, so the response has to be at its end. For a block with pauses, use
    /// [`hear_since`](Self::hear_since).
    pub fn hear(&mut self, frames: &[Option<u16>], end_ns: u64) -> Progress<Exchange> {
        self.hear_since(frames, 0, end_ns)
    }

    /// Takes a frame whose delimiter, at `end_ns`, reads 0.
    pub fn framing_error(&mut self, end_ns: u64) -> Progress<Exchange> {
        self.hear(&[None], end_ns)
    }

    /// Like [`hear`](Self::hear), if it is known that none of the frames began before `since_ns`, for example because the
    /// receiver was enabled at that time. If that is after the request, a response may be anywhere in the block.
    pub fn hear_since(&mut self, frames: &[Option<u16>], since_ns: u64, end_ns: u64) -> Progress<Exchange> {
        if self.end.is_none() {
            let Self { hunt, line, expected, refused, end, ready_ns, asked_ns, until_ns, .. } = self;
            let others = expected.command().is_multi_response();
            hunt.take(line, expected, Block { frames, since_ns, end_ns }, |found| match found.outcome {
                Ok(response) if end.is_none() => {
                    *end = Some(Ok(Exchange { response, sampled_ns: *asked_ns, began_ns: found.began_ns }));
                    let heard = Addresses::NONE.with(response.ea);
                    let free_ns = if others { line.silent_ns(expected, heard, found.end_ns) } else { found.end_ns };
                    *ready_ns = free_ns.min(found.end_ns.max(*until_ns)).saturating_add(line.request_gap_ns.into());
                }
                Ok(_) if others => {}
                Ok(_) => *end = Some(Err(Error::TwoResponses)),
                Err(error) => *refused = refused.or(Some(error)),
            });
        }
        self.progress()
    }

    /// Does the same as [`hear`](Self::hear) without copying the response, for an interrupt; ask for the [outcome](Self::outcome).
    pub fn push(&mut self, frames: &[Option<u16>], end_ns: u64) -> Option<&Result<Exchange, Error>> {
        let _ = self.hear(frames, end_ns);
        self.outcome()
    }

    /// Returns the state of the transaction at `now_ns`; it fails once no answer can arrive any more.
    pub fn poll(&mut self, now_ns: u64) -> Progress<Exchange> {
        if self.end.is_none() && now_ns > self.until_ns {
            let Self { hunt, expected, refused, .. } = self;
            hunt.finish(expected, |Found { outcome, .. }| *refused = refused.or(outcome.err()));
            self.end = Some(Err(self.refused.unwrap_or(Error::NoResponse)));
            self.ready_ns = self.until_ns.saturating_add(self.line.request_gap_ns.into());
        }
        self.progress()
    }

    /// The state of the transaction.
    pub const fn progress(&self) -> Progress<Exchange> {
        match self.end {
            None => Progress::Pending { until_ns: self.until_ns.saturating_add(1) },
            Some(Ok(value)) => Progress::Done { value, ready_ns: self.ready_ns },
            Some(Err(error)) => Progress::Failed { error, ready_ns: self.ready_ns },
        }
    }

    /// Returns how it ended; `None` while it is pending.
    pub const fn outcome(&self) -> Option<&Result<Exchange, Error>> {
        self.end.as_ref()
    }

    /// When to poll it while it is pending, and when the line is free afterwards, in ns.
    pub const fn until_ns(&self) -> u64 {
        if self.end.is_none() { self.until_ns.saturating_add(1) } else { self.ready_ns }
    }
}

/// A multi-response request and the responses of all encoders, frame by frame or in blocks.
///
/// Each response can be used as soon as it has arrived, by [`exchange`](Self::exchange); a missing encoder delays no other
/// response. It is done when every requested encoder has been heard, or when the missing ones have had their turn; [`Bus`] says
/// which are missing. The line is free once every address up to [`Line::highest`] has been heard or has had its turn, so
/// configure how many encoders there are. A lost or damaged response does not affect any other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusTransaction {
    request: Request,
    expected: Expected,
    line: Line,
    hunt: Hunt,
    bus: Bus,
    start_ns: u64,
    asked_ns: u64,
    began_ns: [u64; 8],
    until_ns: u64,
    ended: bool,
    refused: Option<Error>,
    ready_ns: u64,
}

impl BusTransaction {
    /// Creates a transaction that requests nothing, as a place for [`restart`](Self::restart). It counts as one that has
    /// ended, and its line is free at any time.
    #[inline]
    pub const fn idle() -> Self {
        let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
        Self {
            request: NOTHING,
            expected,
            line: Line::new(BitRate::Mbit2_5),
            hunt: Hunt::new(0),
            bus: Bus::new(expected, Addresses::NONE),
            start_ns: 0,
            asked_ns: 0,
            began_ns: [0; 8],
            until_ns: 0,
            ended: true,
            refused: None,
            ready_ns: 0,
        }
    }

    /// Begins a transaction with encoders of this resolution; the first start bit of the request is at `start_ns`.
    ///
    /// It is not documented what EA of the request means to the encoders. [`Addresses::highest`] of the requested ones is the
    /// most likely reading; [`Line::highest`] covers the others.
    ///
    /// A request that encoders of this version do not understand fails at once with [`Error::UnsupportedInVersion`] and must not
    /// be sent.
    pub fn start(request: Request, resolution: Resolution, asked: Addresses, line: Line, start_ns: u64) -> Self {
        Self::begun(request, resolution, asked, line, start_ns)
    }

    /// Begins the next transaction in the same place, whatever the state of this one: like [`start`](Self::start), without a copy.
    pub fn restart(&mut self, request: Request, resolution: Resolution, asked: Addresses, line: Line, start_ns: u64) {
        *self = Self::begun(request, resolution, asked, line, start_ns);
    }

    /// It is inlined, so that the transaction is created in its final place.
    #[inline(always)]
    fn begun(request: Request, resolution: Resolution, asked: Addresses, line: Line, start_ns: u64) -> Self {
        let expected = request.expected(resolution).any_address();
        let line = match asked.highest() {
            Some(highest) => line.with_highest(line.highest.max(highest)),
            None => line,
        };
        let asked_ns = start_ns.saturating_add(line.request_ns(request).into());
        let refused = refusal(request, resolution, &line);
        Self {
            request,
            expected,
            line,
            hunt: Hunt::new(asked_ns),
            bus: Bus::new(expected, asked),
            start_ns,
            asked_ns,
            began_ns: [0; 8],
            until_ns: asked_ns.saturating_add(line.answered_ns(&expected).into()),
            ended: asked.is_empty() || refused.is_some(),
            refused,
            ready_ns: start_ns,
        }
    }

    /// Returns what is to be sent, and when.
    pub const fn transmission(&self) -> Transmission {
        Transmission { frames: self.request.emit(), start_ns: self.start_ns, end_ns: self.asked_ns }
    }

    /// Takes frames that were received back to back (a single one, a DMA block, or all until the line went idle), the last
    /// delimiter at `end_ns`. Each is its content bits, the first on the line in bit 0; `None` stands for a frame whose
    /// delimiter reads 0.
    ///
    /// Nothing is known about pauses within a block, so only a response at its end is taken. For a block with pauses, use
    /// [`hear_since`](Self::hear_since).
    pub fn hear(&mut self, frames: &[Option<u16>], end_ns: u64) -> Progress<()> {
        self.hear_since(frames, 0, end_ns)
    }

    /// Takes a frame whose delimiter, at `end_ns`, reads 0.
    pub fn framing_error(&mut self, end_ns: u64) -> Progress<()> {
        self.hear(&[None], end_ns)
    }

    /// Like [`hear`](Self::hear), if it is known that none of the frames began before `since_ns`, for example because the
    /// receiver was enabled at that time. If that is after the request, a response may be anywhere in the block.
    pub fn hear_since(&mut self, frames: &[Option<u16>], since_ns: u64, end_ns: u64) -> Progress<()> {
        if !self.ended {
            let Self { hunt, line, expected, bus, began_ns, until_ns, .. } = self;
            hunt.take(line, expected, Block { frames, since_ns, end_ns }, |found| {
                if let Some(ea) = found.instead_of {
                    bus.withdraw(ea);
                }
                if let Ok(response) = found.outcome {
                    if let Some(began) = began_ns.get_mut(usize::from(response.ea.get())) {
                        *began = found.began_ns;
                    }
                }
                bus.take(found.outcome);
                if found.outcome.is_ok() {
                    *until_ns = line.silent_ns(expected, bus.heard(), found.end_ns).min(*until_ns);
                }
            });
            self.ended = self.bus.heard_all();
            self.free();
        }
        self.progress()
    }

    /// Does the same as [`hear`](Self::hear) and returns the [outcome](Self::outcome).
    pub fn push(&mut self, frames: &[Option<u16>], end_ns: u64) -> Option<Result<(), Error>> {
        let _ = self.hear(frames, end_ns);
        self.outcome()
    }

    /// Returns the state of the transaction at `now_ns`; it ends once no answer can arrive any more.
    pub fn poll(&mut self, now_ns: u64) -> Progress<()> {
        if !self.ended && now_ns > self.until_ns {
            let Self { hunt, expected, bus, .. } = self;
            hunt.finish(expected, |Found { outcome, .. }| {
                bus.take(outcome);
            });
            self.ended = true;
            self.free();
        }
        self.progress()
    }

    /// Encoders that have not been heard may still answer.
    fn free(&mut self) {
        self.ready_ns = self.until_ns.saturating_add(self.line.request_gap_ns.into());
    }

    /// The state of the transaction.
    pub const fn progress(&self) -> Progress<()> {
        match self.outcome() {
            Some(Err(error)) => Progress::Failed { error, ready_ns: self.ready_ns },
            Some(Ok(())) => Progress::Done { value: (), ready_ns: self.ready_ns },
            None => Progress::Pending { until_ns: self.until_ns.saturating_add(1) },
        }
    }

    /// Returns how it ended; `None` while it is pending. A missing answer is not a failure: [`bus`](Self::bus) says which
    /// encoders did not answer.
    pub const fn outcome(&self) -> Option<Result<(), Error>> {
        match (self.refused, self.ended) {
            (Some(error), _) => Some(Err(error)),
            (None, true) => Some(Ok(())),
            (None, false) => None,
        }
    }

    /// When to poll it while it is pending, and when the line is free afterwards, in ns.
    pub const fn until_ns(&self) -> u64 {
        if self.ended { self.ready_ns } else { self.until_ns.saturating_add(1) }
    }

    /// What has arrived so far.
    pub const fn bus(&self) -> &Bus {
        &self.bus
    }

    /// The good response of a requested encoder, and when its values were sampled.
    pub fn exchange(&self, ea: EncoderAddress) -> Option<Exchange> {
        let Outcome::Good(response) = self.bus.of(ea) else { return None };
        let began_ns = self.began_ns.get(usize::from(ea.get())).copied().unwrap_or(0);
        Some(Exchange { response, sampled_ns: self.asked_ns, began_ns })
    }
}

/// The request of a transaction that requests nothing.
const NOTHING: Request = Request::new(EncoderAddress::ZERO, Operation::Abs40);

/// Returns why a request must not be sent.
fn refusal(request: Request, resolution: Resolution, line: &Line) -> Option<Error> {
    request.check(resolution).err().or_else(|| (!line.leaves_time()).then_some(Error::Line))
}

servowire_core::machine!(Transaction { Transmission, [Option<u16>] => Exchange, Error });
servowire_core::machine!(BusTransaction { Transmission, [Option<u16>] => (), Error });
