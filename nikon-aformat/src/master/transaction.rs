use crate::bus::{Addresses, Bus};
use crate::frame::{FRAME_BITS, truncated};
use crate::{BitRate, Error, Expected, FRAME_GAP_NS, Frames, Profile, REQUEST_GAP_NS, Reply, Request, Response};

/// How a controller is connected, and how long it waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Bit rate.
    pub rate: BitRate,
    /// Idle time between two frames of a request, in ns. Default [`FRAME_GAP_NS`].
    pub frame_gap_ns: u32,
    /// Longest wait from the end of the request to the *start bit* of the reply, in ns. The turn-around time is not
    /// documented; the default is 1000 bits, as one maker's master has it. Others wait 3 ms and 35 ms.
    pub reply_timeout_ns: u32,
    /// Longest idle time between two frames of a reply, in ns. Default four bits.
    pub idle_in_reply_ns: u32,
    /// Longest idle time between two replies on a bus, in ns. Default twice [`BitRate::reply_gap_ns`].
    pub idle_between_replies_ns: u32,
}

impl Line {
    /// A line with the default time-outs.
    pub const fn new(rate: BitRate) -> Self {
        Self {
            rate,
            frame_gap_ns: FRAME_GAP_NS,
            reply_timeout_ns: rate.bits_ns(1000),
            idle_in_reply_ns: rate.bits_ns(4),
            idle_between_replies_ns: rate.reply_gap_ns().saturating_mul(2),
        }
    }

    /// The same with another wait for the reply.
    pub const fn with_reply_timeout_ns(self, reply_timeout_ns: u32) -> Self {
        Self { reply_timeout_ns, ..self }
    }

    /// Line time of a request in ns, its gaps included.
    pub fn request_ns(&self, request: Request) -> u32 {
        self.rate.bits_ns(request.emit().line_bits(self.rate.bits(self.frame_gap_ns)))
    }

    /// The time after which a transaction with `encoders` encoders is over in any case, in ns from its start.
    pub fn longest_ns(&self, request: Request, expected: &Expected, encoders: u8) -> u32 {
        let reply = self.rate.reply_ns(expected.layout()).saturating_add(self.idle_in_reply_ns);
        let replies = reply.saturating_add(self.idle_between_replies_ns).saturating_mul(encoders.into());
        self.request_ns(request).saturating_add(self.reply_timeout_ns).saturating_add(replies)
    }

    /// Shortest period in which a request to `encoders` encoders can be repeated even if nobody answers, in ns: the
    /// longest transaction and [`REQUEST_GAP_NS`].
    pub fn min_cycle_ns(&self, request: Request, expected: &Expected, encoders: u8) -> u32 {
        self.longest_ns(request, expected, encoders).saturating_add(REQUEST_GAP_NS)
    }
}

/// How far a transaction is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// More frames are to come; at the time given, call [`Transaction::poll`].
    Waiting {
        /// When the wait is over.
        until_ns: u64,
    },
    /// The reply, with all checks passed.
    Done(Response),
    /// No reply, or a refused one.
    Failed(Error),
}

/// One request and its reply, frame by frame as a shift register receives them.
///
/// Once done or failed it stays so. Of a multi-response request it takes the first reply; [`BusTransaction`] takes all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    expected: Expected,
    line: Line,
    collector: Collector,
    until_ns: u64,
    end: Option<Result<Response, Error>>,
}

impl Transaction {
    /// Begins a transaction with an encoder of this profile; the first start bit of the request is at `now_ns`.
    ///
    /// A request that encoders of this version do not understand fails at once with
    /// [`Error::UnsupportedInVersion`] and is not to be sent.
    pub fn start(request: Request, profile: Profile, line: Line, now_ns: u64) -> Self {
        let frame = line.rate.bits_ns(FRAME_BITS);
        let first = line.request_ns(request).saturating_add(line.reply_timeout_ns).saturating_add(frame);
        Self {
            request,
            expected: request.expected(profile),
            line,
            collector: Collector::EMPTY,
            until_ns: now_ns.saturating_add(first.into()),
            end: request.check(profile).err().map(Err),
        }
    }

    /// The frames to send.
    pub const fn frames(&self) -> Frames {
        self.request.emit()
    }

    /// A frame was received with start bit and delimiter in order, its delimiter at `now_ns`; `content` are its bits, the first
    /// of the line in bit 0.
    pub fn frame(&mut self, content: u16, now_ns: u64) -> Progress {
        if let Progress::Waiting { .. } = self.poll(now_ns) {
            self.until_ns = now_ns.saturating_add(self.patience_ns());
            if let Some(reply) = self.collector.frame(content, now_ns, &self.expected) {
                self.end = Some(Response::parse(&reply, &self.expected));
            }
        }
        self.progress()
    }

    /// A frame was received whose delimiter reads 0.
    pub fn framing_error(&mut self, now_ns: u64) -> Progress {
        if let Progress::Waiting { .. } = self.poll(now_ns) {
            self.end = Some(Err(Error::Delimiter { frame: self.collector.got }));
        }
        self.progress()
    }

    /// Ends the transaction if its time is over.
    pub fn poll(&mut self, now_ns: u64) -> Progress {
        if self.end.is_none() && now_ns > self.until_ns {
            let nothing = self.collector.got == 0;
            self.end = Some(Err(if nothing { Error::NoResponse } else { self.collector.truncation(&self.expected) }));
        }
        self.progress()
    }

    /// Where the transaction stands.
    pub const fn progress(&self) -> Progress {
        match self.end {
            None => Progress::Waiting { until_ns: self.until_ns },
            Some(Ok(response)) => Progress::Done(response),
            Some(Err(error)) => Progress::Failed(error),
        }
    }

    fn patience_ns(&self) -> u64 {
        u64::from(self.line.rate.bits_ns(FRAME_BITS)).saturating_add(self.line.idle_in_reply_ns.into())
    }
}

/// A multi-response request and the replies of all encoders, frame by frame.
///
/// It ends when as many replies have arrived as encoders were asked, good or not, or when its time is over; what is
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
    /// A frame was broken; the rest of its reply is passed over.
    broken: bool,
}

impl BusTransaction {
    /// Begins a transaction with encoders of this profile; the first start bit of the request is at `now_ns`.
    ///
    /// What EA of the request means to the encoders is not documented. [`Addresses::highest`] of those that are asked is
    /// the most likely reading.
    pub fn start(request: Request, profile: Profile, asked: Addresses, line: Line, now_ns: u64) -> Self {
        let expected = request.expected(profile).any_address();
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
        self.begin_reply(now_ns);
        if let Some(reply) = self.collector.frame(content, now_ns, &self.expected).filter(|_| !self.broken) {
            self.bus.push(Ok(reply));
        }
        self.close_if_complete()
    }

    /// A frame was received whose delimiter reads 0. Whether the transaction is over.
    pub fn framing_error(&mut self, now_ns: u64) -> bool {
        if self.poll(now_ns) {
            return true;
        }
        self.begin_reply(now_ns);
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

    /// A frame behind a pause is the first of the next reply.
    fn begin_reply(&mut self, now_ns: u64) {
        let whole = u64::from(self.line.rate.bits_ns(FRAME_BITS)).saturating_add(self.line.idle_in_reply_ns.into());
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

    /// A broken reply is over when its last frame has passed, which only a pause tells.
    fn close_if_complete(&mut self) -> bool {
        self.ended = self.bus.is_complete() && !self.broken;
        self.ended
    }
}

/// Frames of one reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Collector {
    contents: [u16; Reply::MAX_FRAMES],
    got: u8,
    last_ns: u64,
}

impl Collector {
    const EMPTY: Self = Self { contents: [0; Reply::MAX_FRAMES], got: 0, last_ns: 0 };

    fn frame(&mut self, content: u16, now_ns: u64, expected: &Expected) -> Option<Reply> {
        self.last_ns = now_ns;
        if let Some(place) = self.contents.get_mut(usize::from(self.got)) {
            *place = content;
        }
        self.got = self.got.saturating_add(1);
        if self.got < expected.layout().frames() {
            return None;
        }
        self.got = 0;
        Some(Reply::of(core::mem::take(&mut self.contents), expected.layout()))
    }

    fn truncation(&self, expected: &Expected) -> Error {
        truncated(u32::from(self.got).wrapping_mul(FRAME_BITS), expected.layout().line_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use crate::{Command, Data, EncoderAddress, EncoderStatus, Operation, U24, Version};
    use proptest::prelude::*;

    const LINE: Line = Line::new(BitRate::Mbit16);
    const FRAME_NS: u64 = 1_125;

    proptest! {
        #[test]
        fn a_reply_arrives_or_its_absence_is_told((request, expected, response) in exchanges(), cut in 0..7_usize) {
            let profile = if response.layout() == crate::Layout::Abs40Vel { Profile::default().low_with_velocity() } else { Profile::default() };
            let profile = if request.command().is_reset() && response.layout() == crate::Layout::Abs24 { profile.resets_with_position() } else { profile };
            let mut transaction = Transaction::start(request, profile, LINE, 0);
            prop_assert_eq!(transaction.frames(), request.emit());
            let reply = response.emit();
            let mut now_ns = u64::from(LINE.request_ns(request)) + 3_000;
            for content in reply.contents().iter().take(cut) {
                now_ns += FRAME_NS;
                let _ = transaction.frame(*content, now_ns);
            }
            let frames = usize::from(reply.frames());
            if cut >= frames {
                prop_assert_eq!(transaction.progress(), Progress::Done(response));
                let ended = transaction;
                let _ = (transaction.frame(7, now_ns), transaction.framing_error(now_ns), transaction.poll(u64::MAX));
                prop_assert_eq!(transaction, ended);
            } else {
                let Progress::Waiting { until_ns } = transaction.progress() else { panic!() };
                prop_assert_eq!(transaction.poll(until_ns), Progress::Waiting { until_ns });
                let want = if cut == 0 { Error::NoResponse } else {
                    Error::Truncated { got: cut as u16 * 18, want: expected.layout().line_bits() as u16 }
                };
                prop_assert_eq!(transaction.poll(until_ns + 1), Progress::Failed(want));
                prop_assert!(until_ns <= u64::from(LINE.longest_ns(request, &expected, 1)));
            }
        }
    }

    #[test]
    fn what_an_old_encoder_does_not_know_is_not_sent() {
        let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Vel);
        let profile = Profile::default().with_version(Version::V2_1);
        let progress = Transaction::start(request, profile, LINE, 0).progress();
        let error = Error::UnsupportedInVersion { command: Command::Abs24Vel, version: Version::V2_1 };
        assert_eq!(progress, Progress::Failed(error));
    }

    fn reply(ea: u8) -> Reply {
        let data = Data::Abs24 { abs: U24::truncate(u32::from(ea) << 8) };
        Response::new(EncoderAddress::truncate(ea), Command::Abs24LowMt, EncoderStatus::NONE, data).emit()
    }

    /// Three encoders; the second one loses its last frame, breaks a delimiter or is silent.
    #[test]
    fn one_bad_reply_costs_only_itself() {
        let request = Request::new(EncoderAddress::truncate(2), Operation::Abs24LowMt);
        for fault in 0..4 {
            let mut bus = BusTransaction::start(request, Profile::default(), Addresses::first(3), LINE, 0);
            let mut now_ns = 10_000;
            for ea in 0..3 {
                for (k, content) in reply(ea).contents().iter().enumerate() {
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
