use super::{Line, Progress};
use crate::bus::{Addresses, Bus};
use crate::error::Error;
use crate::expected::Expected;
use crate::frame::truncated;
use crate::layout::FRAME_BITS;
use crate::raw_response::RawResponse;
use crate::request::{Frames, Request};
use crate::resolution::Resolution;
use crate::response::Response;
use crate::timing::REQUEST_GAP_NS;

/// One request and its response, frame by frame as a shift register receives them.
///
/// Once done or failed it stays so. Of a multi-response request it takes the first response; [`BusTransaction`] takes all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    expected: Expected,
    line: Line,
    collector: Collector,
    until_ns: u64,
    end: Option<Result<Response, Error>>,
    ready_ns: u64,
}

impl Transaction {
    /// Begins a transaction with an encoder of this resolution; the first start bit of the request is at `now_ns`.
    ///
    /// A request that encoders of this version do not understand fails at once with
    /// [`Error::UnsupportedInVersion`] and is not to be sent.
    pub fn start(request: Request, resolution: Resolution, line: Line, now_ns: u64) -> Self {
        let frame = line.rate.bits_ns(FRAME_BITS);
        let first = line.request_ns(request).saturating_add(line.response_timeout_ns).saturating_add(frame);
        Self {
            request,
            expected: request.expected(resolution),
            line,
            collector: Collector::EMPTY,
            until_ns: now_ns.saturating_add(first.into()),
            end: request.check(resolution).err().map(Err),
            ready_ns: now_ns,
        }
    }

    /// The frames to send.
    pub const fn frames(&self) -> Frames {
        self.request.emit()
    }

    /// A frame was received with start bit and delimiter in order, its delimiter at `now_ns`; `content` are its bits, the first
    /// of the line in bit 0.
    pub fn frame(&mut self, content: u16, now_ns: u64) -> Progress<Response> {
        if let Progress::Pending { .. } = self.poll(now_ns) {
            self.until_ns = now_ns.saturating_add(self.patience_ns());
            if let Some(raw) = self.collector.frame(content, now_ns, &self.expected) {
                self.finish(Response::parse(&self.expected, &raw), now_ns);
            }
        }
        self.progress()
    }

    /// A frame was received whose delimiter reads 0.
    pub fn framing_error(&mut self, now_ns: u64) -> Progress<Response> {
        if let Progress::Pending { .. } = self.poll(now_ns) {
            self.finish(Err(Error::Delimiter { frame: self.collector.got }), now_ns);
        }
        self.progress()
    }

    /// Ends the transaction if its time is over.
    pub fn poll(&mut self, now_ns: u64) -> Progress<Response> {
        if self.end.is_none() && now_ns > self.until_ns {
            let nothing = self.collector.got == 0;
            self.finish(
                Err(if nothing { Error::NoResponse } else { self.collector.truncation(&self.expected) }),
                now_ns,
            );
        }
        self.progress()
    }

    /// Where the transaction stands.
    pub const fn progress(&self) -> Progress<Response> {
        match self.end {
            None => Progress::Pending { until_ns: self.until_ns },
            Some(Ok(value)) => Progress::Done { value, ready_ns: self.ready_ns },
            Some(Err(error)) => Progress::Failed { error, ready_ns: self.ready_ns },
        }
    }

    fn finish(&mut self, end: Result<Response, Error>, now_ns: u64) {
        self.end = Some(end);
        self.ready_ns = now_ns.saturating_add(REQUEST_GAP_NS.into());
    }

    fn patience_ns(&self) -> u64 {
        u64::from(self.line.rate.bits_ns(FRAME_BITS)).saturating_add(self.line.idle_in_response_ns.into())
    }
}

/// A multi-response request and the responses of all encoders, frame by frame.
///
/// It ends when as many responses have arrived as encoders were asked, good or not, or when its time is over; what is
/// missing then is said by [`Bus`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusTransaction {
    request: Request,
    expected: Expected,
    line: Line,
    collector: Collector,
    bus: Bus,
    until_ns: u64,
    ended: bool,
    /// A frame was broken; the rest of its response is passed over.
    broken: bool,
}

impl BusTransaction {
    /// Begins a transaction with encoders of this resolution; the first start bit of the request is at `now_ns`.
    ///
    /// What EA of the request means to the encoders is not documented. [`Addresses::highest`] of those that are asked is
    /// the most likely reading.
    pub fn start(request: Request, resolution: Resolution, asked: Addresses, line: Line, now_ns: u64) -> Self {
        let expected = request.expected(resolution).any_address();
        let longest = line.longest_ns(request, &expected, asked.len());
        Self {
            request,
            expected,
            line,
            collector: Collector::EMPTY,
            bus: Bus::new(expected, asked),
            until_ns: now_ns.saturating_add(longest.into()),
            ended: asked.is_empty(),
            broken: false,
        }
    }

    /// The frames to send.
    pub const fn frames(&self) -> Frames {
        self.request.emit()
    }

    /// A frame was received with start bit and delimiter in order, its delimiter at `now_ns`; `content` are its bits, the first
    /// of the line in bit 0. Whether the transaction is over.
    pub fn frame(&mut self, content: u16, now_ns: u64) -> bool {
        if self.poll(now_ns) {
            return true;
        }
        self.begin_response(now_ns);
        if let Some(raw) = self.collector.frame(content, now_ns, &self.expected).filter(|_| !self.broken) {
            self.bus.push(Ok(raw));
        }
        self.close_if_complete()
    }

    /// A frame was received whose delimiter reads 0. Whether the transaction is over.
    pub fn framing_error(&mut self, now_ns: u64) -> bool {
        if self.poll(now_ns) {
            return true;
        }
        self.begin_response(now_ns);
        if !self.broken {
            self.bus.push(Err(Error::Delimiter { frame: self.collector.got }));
        }
        self.broken = true;
        self.collector = Collector { last_ns: now_ns, ..Collector::EMPTY };
        self.close_if_complete()
    }

    /// Ends the transaction if its time is over. Whether it is over.
    pub fn poll(&mut self, now_ns: u64) -> bool {
        if !self.ended && now_ns > self.until_ns {
            self.cut();
            self.ended = true;
        }
        self.ended
    }

    /// When the transaction is over at the latest.
    pub const fn until_ns(&self) -> u64 {
        self.until_ns
    }

    /// What has come so far.
    pub const fn bus(&self) -> &Bus {
        &self.bus
    }

    /// A frame behind a pause is the first of the next response.
    fn begin_response(&mut self, now_ns: u64) {
        let whole = u64::from(self.line.rate.bits_ns(FRAME_BITS)).saturating_add(self.line.idle_in_response_ns.into());
        if now_ns.saturating_sub(self.collector.last_ns) > whole {
            self.cut();
        }
    }

    fn cut(&mut self) {
        if self.collector.got > 0 && !self.broken {
            self.bus.push(Err(self.collector.truncation(&self.expected)));
        }
        self.broken = false;
        self.collector.got = 0;
    }

    /// A broken response is over when its last frame has passed, which only a pause tells.
    fn close_if_complete(&mut self) -> bool {
        self.ended = self.bus.is_complete() && !self.broken;
        self.ended
    }
}

/// Frames of one response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Collector {
    contents: [u16; RawResponse::MAX_FRAMES],
    got: u8,
    last_ns: u64,
}

impl Collector {
    const EMPTY: Self = Self { contents: [0; RawResponse::MAX_FRAMES], got: 0, last_ns: 0 };

    fn frame(&mut self, content: u16, now_ns: u64, expected: &Expected) -> Option<RawResponse> {
        self.last_ns = now_ns;
        if let Some(place) = self.contents.get_mut(usize::from(self.got)) {
            *place = content;
        }
        self.got = self.got.saturating_add(1);
        if self.got < expected.layout().frames() {
            return None;
        }
        self.got = 0;
        Some(RawResponse::of(core::mem::take(&mut self.contents), expected.layout()))
    }

    fn truncation(&self, expected: &Expected) -> Error {
        truncated(u32::from(self.got).wrapping_mul(FRAME_BITS), expected.layout().line_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Command, Version};
    use crate::data::Data;
    use crate::number::EncoderAddress;
    use crate::operation::Operation;
    use crate::response::tests::exchanges;
    use crate::status::EncoderStatus;
    use proptest::prelude::*;
    use servowire_core::U24;

    const LINE: Line = Line::new(crate::timing::BitRate::Mbit16);
    const FRAME_NS: u64 = 1_125;

    proptest! {
        #[test]
        fn a_response_arrives_or_its_absence_is_told((request, expected, response) in exchanges(), cut in 0..7_usize) {
            let resolution = if response.layout() == crate::layout::Layout::Abs40Vel { Resolution::default().low_with_velocity() } else { Resolution::default() };
            let resolution = if request.command().is_reset() && response.layout() == crate::layout::Layout::Abs24 { resolution.resets_with_position() } else { resolution };
            let mut transaction = Transaction::start(request, resolution, LINE, 0);
            prop_assert_eq!(transaction.frames(), request.emit());
            let raw = response.emit();
            let mut now_ns = u64::from(LINE.request_ns(request)) + 3_000;
            for content in raw.contents().iter().take(cut) {
                now_ns += FRAME_NS;
                let _ = transaction.frame(*content, now_ns);
            }
            let frames = usize::from(raw.frames());
            if cut >= frames {
                prop_assert_eq!(transaction.progress(), Progress::Done { value: response, ready_ns: now_ns + 10_000 });
                let ended = transaction;
                let _ = (transaction.frame(7, now_ns), transaction.framing_error(now_ns), transaction.poll(u64::MAX));
                prop_assert_eq!(transaction, ended);
            } else {
                let Progress::Pending { until_ns } = transaction.progress() else { panic!() };
                prop_assert_eq!(transaction.poll(until_ns), Progress::Pending { until_ns });
                let want = if cut == 0 { Error::NoResponse } else {
                    Error::Truncated { got: cut as u16 * 18, want: expected.layout().line_bits() as u16 }
                };
                prop_assert_eq!(transaction.poll(until_ns + 1), Progress::Failed { error: want, ready_ns: until_ns + 10_001 });
                prop_assert!(until_ns <= u64::from(LINE.longest_ns(request, &expected, 1)));
            }
        }
    }

    #[test]
    fn what_an_old_encoder_does_not_know_is_not_sent() {
        let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Vel);
        let resolution = Resolution::default().with_version(Version::V2_1);
        let progress = Transaction::start(request, resolution, LINE, 0).progress();
        let error = Error::UnsupportedInVersion { command: Command::Abs24Vel, version: Version::V2_1 };
        assert_eq!(progress, Progress::Failed { error, ready_ns: 0 });
    }

    fn raw(ea: u8) -> RawResponse {
        let data = Data::Abs24 { abs: U24::truncate(u32::from(ea) << 8) };
        Response::new(EncoderAddress::truncate(ea), Command::Abs24LowMt, EncoderStatus::empty(), data).emit()
    }

    /// Three encoders; the second one loses its last frame, breaks a delimiter or is silent.
    #[test]
    fn one_bad_response_costs_only_itself() {
        let request = Request::new(EncoderAddress::truncate(2), Operation::Abs24LowMt);
        for fault in 0..4 {
            let mut bus = BusTransaction::start(request, Resolution::default(), Addresses::first(3), LINE, 0);
            let mut now_ns = 10_000;
            for ea in 0..3 {
                for (k, content) in raw(ea).contents().iter().enumerate() {
                    now_ns += FRAME_NS;
                    let over = match (ea, fault, k) {
                        (1, 1, 2) | (1, 3, _) => false,
                        (1, 2, 1) => bus.framing_error(now_ns),
                        _ => bus.frame(*content, now_ns),
                    };
                    assert!(!over || ea == 2, "fault {fault}");
                }
                now_ns += 1_500;
            }
            let heard = bus.bus();
            let good = |ea| heard.response(EncoderAddress::truncate(ea)).is_some();
            assert_eq!([good(0), good(1), good(2)], [true, fault == 0, true], "fault {fault}");
            assert_eq!(
                (heard.damaged(), heard.not_started()),
                (u8::from(fault == 1 || fault == 2), u8::from(fault == 3))
            );
            let until_ns = bus.until_ns();
            assert!(bus.poll(until_ns + 1));
        }
    }
}
