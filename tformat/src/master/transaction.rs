use super::Line;
use crate::data_id::DataId;
use crate::error::Error;
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::message::{CF3, refusal};
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;
use crate::status::StatusField;

/// A response that has passed all checks, and when its position was sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Exchange {
    /// The response.
    pub response: Response,
    /// The instant of sampling by [`Line::sampling_ns`], for extrapolation: it lies between the end of the request and
    /// the start of the response. The age of the position counts from here.
    pub sampled_ns: u64,
    /// When the first start bit of the response was on the line at the latest, in ns: by then the position had been sampled.
    pub began_ns: u64,
}

servowire_core::one_line!(Exchange { Self { response, sampled_ns, .. } => "{}, sampled at {} ns", response, sampled_ns; });

impl Exchange {
    /// Returns what the response says about the position of an encoder with these widths, to be judged where the position is
    /// used.
    pub const fn evidence(&self, resolution: Resolution) -> Evidence {
        Evidence::of(self.response, resolution, self.sampled_ns)
    }
}

/// What a master sends, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// The fields.
    pub frame: Frame,
    /// When the start bit is on the line, in ns.
    pub start_ns: u64,
    /// When the last bit ends, in ns.
    pub end_ns: u64,
    /// When to enable the driver, in ns: [`Line::driver_lead_ns`] before the start bit.
    pub driver_on_ns: u64,
    /// When to disable the driver.
    pub driver_off: DriverOff,
}

/// The interval in which the driver has to be disabled after a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriverOff {
    /// Not before this time, in ns: the end of the request.
    pub earliest_ns: u64,
    /// Not after this time, in ns: the encoder may begin to answer.
    pub latest_ns: u64,
}

/// The state of a transaction. After a failure, `ready_ns` is the end of the longest response to the request, however late
/// within the time-out it began: eleven fields without gaps, as encoders send them. If there is a bridge that pauses between
/// fields, also wait until the line is silent.
pub type Progress<T = Exchange> = servowire_core::Progress<T, Error>;

/// One request and its response, as a UART receives them: byte by byte, or in blocks.
///
/// The time of every byte of a block is found by counting back from the end of the block. No byte that began before the
/// request had left the line is ever part of the response, as long as the end times passed to the machine are late by less
/// than the [latency budget](Line::latency_budget_ns). An echo of the request is recognised by its time, and if that is not
/// conclusive, by its content. Anything before or after a sound response is harmless; two sound responses in one block are
/// [`Error::TwoResponses`].
///
/// A transaction that is done or has failed stays in that state. Keep handing over what arrives until `ready_ns`; it is
/// discarded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    frame: Frame,
    line: Line,
    /// Number of fields of the response.
    fields: u8,
    /// Duration of a field on the line.
    field_ns: u32,
    start_ns: u64,
    /// The end of the request's last bit.
    asked_ns: u64,
    /// The earliest end of the first field of a response.
    earliest_ns: u64,
    /// The bytes that may be the response.
    received: [u8; Frame::MAX_FIELDS],
    len: u8,
    /// Number of bytes of the master's own request that came back, and the first one that came back changed.
    echoed: u8,
    echo_fault: Option<u8>,
    /// Why the first run of bytes that had the length of a response was not a response.
    refused: Option<Error>,
    /// A framing error came where a response might have begun.
    broken: bool,
    /// End of the last byte.
    heard_ns: u64,
    /// The time-out while the transaction is pending; afterwards, when the line is free.
    until_ns: u64,
    end: Option<Result<Exchange, Error>>,
}

/// Begins a transaction in place, because a returned value would be copied.
macro_rules! begin {
    ($place:expr, $request:ident, $line:ident, $start_ns:ident) => {
        let frame = $request.emit();
        let asked_ns = $start_ns.saturating_add($line.rate.fields_ns(frame.fields()).into());
        let field_ns = $line.rate.fields_ns(1);
        // Sums of a few u32 first: one addition that may saturate, not several.
        let wait_ns = u64::from($line.response_timeout_ns).saturating_add($line.hand_over_ns.into());
        let waited_ns = asked_ns.saturating_add(wait_ns.saturating_add(field_ns.into()));
        let begins_ns = u64::from($line.turn_around_ns).saturating_add(field_ns.into());
        $place = Transaction {
            request: $request,
            frame,
            line: $line,
            fields: $request.data_id().response_fields(),
            field_ns,
            start_ns: $start_ns,
            asked_ns,
            earliest_ns: asked_ns.saturating_add(begins_ns),
            received: [0; Frame::MAX_FIELDS],
            len: 0,
            echoed: 0,
            echo_fault: None,
            refused: None,
            broken: false,
            heard_ns: asked_ns,
            until_ns: waited_ns,
            end: None,
        };
        if !$line.leaves_time() {
            $place.until_ns = $start_ns;
            $place.end = Some(Err(Error::Line));
        }
    };
}

impl Transaction {
    /// Creates a transaction without request or response, as a place for [`restart`](Self::restart). It counts as one that ended
    /// with [`Error::NoResponse`], and its line is free at any time.
    ///
    /// Nearly all of its memory is 0. This is a function and not a constant, so that firmware clears the memory and keeps no
    /// copy in flash.
    #[inline]
    pub const fn idle() -> Self {
        Self {
            request: Request::ReadSingleTurn,
            frame: Frame::NONE,
            line: Line::NONE,
            fields: 0,
            field_ns: 0,
            start_ns: 0,
            asked_ns: 0,
            earliest_ns: 0,
            received: [0; Frame::MAX_FIELDS],
            len: 0,
            echoed: 0,
            echo_fault: None,
            refused: None,
            broken: false,
            heard_ns: 0,
            until_ns: 0,
            end: Some(Err(Error::NoResponse { echo: false })),
        }
    }

    /// Begins a transaction; the start bit of the request is on the line at `start_ns`.
    ///
    /// On a line whose settings leave no time for a response it fails at once with [`Error::Line`], and nothing may be sent.
    pub fn start(request: Request, line: Line, start_ns: u64) -> Self {
        let mut it;
        begin!(it, request, line, start_ns);
        it
    }

    /// Begins the next transaction in the same place, whatever the state of this one: like [`start`](Self::start), without a copy.
    pub fn restart(&mut self, request: Request, line: Line, start_ns: u64) {
        begin!(*self, request, line, start_ns);
    }

    /// Returns the fields to send, and when.
    pub const fn transmission(&self) -> Transmission {
        let Self { frame, line, start_ns, asked_ns: end_ns, .. } = *self;
        Transmission {
            frame,
            start_ns,
            end_ns,
            driver_on_ns: start_ns.saturating_sub(line.driver_lead_ns as u64),
            driver_off: DriverOff { earliest_ns: end_ns, latest_ns: end_ns.saturating_add(line.turn_around_ns as u64) },
        }
    }

    /// Takes bytes that were received back to back; the delimiter of the last one ended at `end_ns` or, within the latency
    /// budget, before.
    ///
    /// A pause within a block shifts the times of the bytes before it. If a pause is as long as the request and four fields (20
    /// us at 2.5 Mbit/s), hand over the parts before and after it separately.
    pub fn hear(&mut self, bytes: &[u8], end_ns: u64) -> Progress {
        self.push(bytes, end_ns);
        self.progress()
    }

    /// Does the same as [`hear`](Self::hear) without copying the response, for an interrupt; ask for the [outcome](Self::outcome).
    pub fn push(&mut self, bytes: &[u8], end_ns: u64) -> Option<&Result<Exchange, Error>> {
        if self.end.is_none() && !bytes.is_empty() && !self.is_whole(bytes, end_ns) {
            self.take_all(bytes, end_ns);
        }
        self.outcome()
    }

    /// Takes a block that is exactly the response, as a DMA controller hands it over, in one go.
    fn is_whole(&mut self, bytes: &[u8], end_ns: u64) -> bool {
        let [first, second, ..] = bytes else { return false };
        let fits = self.len == 0 && bytes.len() == usize::from(self.fields) && !self.contradicts(*first, *second);
        if !fits || end_ns.saturating_sub(self.fields_ns(bytes.len().saturating_sub(1))) < self.earliest_ns {
            return false;
        }
        let Ok(response) = Response::parse(self.request, bytes) else { return false };
        self.found(&response, end_ns, bytes.len());
        self.until_ns = end_ns;
        true
    }

    fn take_all(&mut self, bytes: &[u8], end_ns: u64) {
        let mut rest = bytes;
        while let [byte, after @ ..] = rest {
            rest = after;
            self.take(*byte, end_ns.saturating_sub(self.fields_ns(after.len())), after);
        }
        self.heard_ns = end_ns;
        if self.len == 0 {
            self.refuse();
        }
        if self.end.is_some() {
            self.finish();
        } else if self.len > 0 {
            self.wait_longer(end_ns);
        }
    }

    /// Sets the time by which the next field is due; a line that does not fall silent is monitored for no longer than the
    /// longest response takes.
    fn wait_longer(&mut self, end_ns: u64) {
        let Line { response_timeout_ns, field_timeout_ns, hand_over_ns, .. } = self.line;
        let fields_ns = u64::from(field_timeout_ns).saturating_mul(Frame::MAX_FIELDS as u64);
        let longest_ns = fields_ns.saturating_add(response_timeout_ns.into()).saturating_add(hand_over_ns.into());
        let latest_ns = self.asked_ns.saturating_add(longest_ns);
        let longest_gap_ns = u64::from(field_timeout_ns).saturating_add(hand_over_ns.into());
        self.until_ns = end_ns.saturating_add(longest_gap_ns).min(latest_ns).max(self.until_ns);
    }

    /// Takes the UART's report of a framing error in the byte that ended at `end_ns`.
    ///
    /// Within a response it ends the transaction with [`Error::Delimiter`]. Before a response it is only remembered: the
    /// response may still come.
    pub fn framing_error(&mut self, end_ns: u64) -> Progress {
        if self.end.is_none() {
            self.heard_ns = end_ns;
            if end_ns < self.earliest_ns {
                self.echo_fault = self.echo_fault.or(Some(0));
            } else {
                self.broken = true;
                if self.len > 0 || end_ns > self.until_ns {
                    self.end = Some(Err(Error::Delimiter { field: self.len }));
                    self.finish();
                }
            }
        }
        self.progress()
    }

    /// Ends the transaction if its time has run out.
    pub fn poll(&mut self, now_ns: u64) -> Progress {
        if self.end.is_none() && now_ns > self.until_ns {
            self.give_up();
        }
        self.progress()
    }

    /// The state of the transaction.
    pub const fn progress(&self) -> Progress {
        match self.end {
            None => Progress::Pending { until_ns: self.until_ns.saturating_add(1) },
            Some(Ok(value)) => Progress::Done { value, ready_ns: self.until_ns },
            Some(Err(error)) => Progress::Failed { error, ready_ns: self.until_ns },
        }
    }

    /// Returns how it ended; `None` while it is pending.
    pub const fn outcome(&self) -> Option<&Result<Exchange, Error>> {
        self.end.as_ref()
    }

    /// When to poll it while it is pending, and when the line is free afterwards, in ns.
    pub const fn until_ns(&self) -> u64 {
        if self.end.is_none() { self.until_ns.saturating_add(1) } else { self.until_ns }
    }

    fn fields_ns(&self, fields: usize) -> u64 {
        u64::from(self.field_ns).saturating_mul(fields as u64)
    }

    /// Takes one more byte, which ended at `ended_ns` at the latest; the remaining bytes came after it in the same block.
    fn take(&mut self, byte: u8, ended_ns: u64, after: &[u8]) {
        if ended_ns < self.earliest_ns {
            return self.early(byte);
        }
        let [first, ..] = self.received;
        if self.len == 1 && self.contradicts(first, byte) {
            self.forget_echo();
        }
        if let Some(place) = self.received.get_mut(usize::from(self.len)) {
            *place = byte;
            self.len = self.len.saturating_add(1);
        }
        if self.len >= self.expected() {
            self.judge(ended_ns, after);
        }
    }

    /// Handles bytes that began before a response can begin: the echo, and what was on the line before.
    fn early(&mut self, got: u8) {
        self.len = 0;
        match self.frame.as_bytes().get(usize::from(self.echoed)) {
            Some(want) if *want == got => self.echoed = self.echoed.saturating_add(1),
            Some(_) => self.echo_fault = self.echo_fault.or(Some(got)),
            None => {}
        }
    }

    /// Returns the number of fields of the response that begins with the first byte held.
    const fn expected(&self) -> u8 {
        let [cf, ..] = self.received;
        if cf == CF3 { DataId::ReadAll.response_fields() } else { self.fields }
    }

    const fn begins_a_response(&self, byte: u8) -> bool {
        byte == self.frame.first() || byte == CF3
    }

    /// Returns whether the second byte shows that the first was the end of an echo: in place of SF there is a control field,
    /// whose low bits are never 0, while the information bits of SF always are.
    #[inline(never)]
    const fn contradicts(&self, first: u8, second: u8) -> bool {
        let eeprom = matches!(self.request, Request::ReadEeprom { .. } | Request::WriteEeprom { .. });
        (first == CF3 || !eeprom) && self.begins_a_response(second)
    }

    /// Handles a first byte that was the last one of the master's own request.
    fn forget_echo(&mut self) {
        let [first, ..] = self.received;
        if self.frame.as_bytes().last() == Some(&first) {
            self.echoed = self.frame.fields();
        }
        self.len = 0;
    }

    /// Judges the bytes as a response once there are enough of them.
    fn judge(&mut self, ended_ns: u64, after: &[u8]) {
        while self.len > 0 && self.len >= self.expected() {
            let heard = self.received.get(..usize::from(self.len)).unwrap_or(&self.received);
            // A response to a write repeats it: the first of two is the echo.
            if heard.iter().eq(self.frame.as_bytes()) && is_sound(&Response::parse(self.request, after)) {
                self.echoed = self.frame.fields();
                self.len = 0;
                return;
            }
            let fields = heard.len();
            let fresh = ended_ns.saturating_sub(self.fields_ns(fields.saturating_sub(1))) >= self.earliest_ns;
            match Response::parse(self.request, heard) {
                Ok(response) if fresh => return self.found(&response, ended_ns, fields),
                Err(Error::Rejected { sf }) if fresh => return self.rejected(sf),
                Err(error) if self.refused.is_none() => self.refused = Some(error),
                _ => {}
            }
            self.drop_first();
        }
    }

    /// Takes a valid response of this many fields. It is kept out of line, because blocks and single bytes both come here.
    #[inline(never)]
    fn found(&mut self, response: &Response, ended_ns: u64, fields: usize) {
        self.len = 0;
        if self.end.is_some() {
            return self.end = Some(Err(Error::TwoResponses));
        }
        self.end = Some(Ok(Exchange {
            response: *response,
            sampled_ns: self.asked_ns.saturating_add(self.line.sampling_ns.into()),
            began_ns: ended_ns.saturating_sub(self.fields_ns(fields)),
        }));
    }

    /// Returns a complete refusal by the encoder.
    #[cold]
    #[inline(never)]
    fn rejected(&mut self, sf: StatusField) {
        self.len = 0;
        if self.end.is_some() {
            return self.end = Some(Err(Error::TwoResponses));
        }
        self.end = Some(Err(Error::Rejected { sf }));
    }

    /// Drops the first byte and all bytes up to the next one with which a response may begin.
    #[cold]
    fn drop_first(&mut self) {
        while self.len > 0 {
            self.received.copy_within(1.., 0);
            self.len = self.len.saturating_sub(1);
            let [first, second, ..] = self.received;
            if self.begins_a_response(first) && !(self.len > 1 && self.contradicts(first, second)) {
                break;
            }
        }
    }

    /// Handles the end of reception: nothing more will come.
    #[cold]
    fn give_up(&mut self) {
        if self.refused.is_none() {
            self.refused = Some(self.reason());
        }
        while self.len > 0 && self.end.is_none() {
            self.drop_first();
            self.judge(self.heard_ns, &[]);
        }
        self.refuse();
        self.finish();
    }

    /// Returns why what was received until the time ran out is not a response.
    fn reason(&self) -> Error {
        let heard = self.received.get(..usize::from(self.len)).unwrap_or(&self.received);
        match (heard, self.echo_fault) {
            _ if self.broken => Error::Delimiter { field: 0 },
            ([], Some(got)) if self.line.echo => {
                let want = self.frame.as_bytes().get(usize::from(self.echoed)).copied().unwrap_or(0);
                Error::EchoMismatch { at: self.echoed, got, want }
            }
            ([], _) => Error::NoResponse { echo: self.echoed == self.frame.fields() },
            // There are fewer bytes than a response has.
            _ => refusal(self.request.data_id(), heard),
        }
    }

    /// Ends with the error of the refused bytes, if nothing else was found.
    fn refuse(&mut self) {
        if let (Some(error), None) = (self.refused, self.end) {
            self.end = Some(Err(error));
        }
    }

    /// The transaction has ended. After an error the line is free when the longest response would have ended if it had begun
    /// as late as it may. It is kept out of line, because all endings except that of a whole block come here.
    #[inline(never)]
    fn finish(&mut self) {
        self.until_ns = self.heard_ns;
        if let Some(Err(_)) = self.end {
            let longest_ns = u64::from(self.line.response_timeout_ns).saturating_add(self.fields_ns(Frame::MAX_FIELDS));
            self.until_ns = self.asked_ns.saturating_add(longest_ns).max(self.heard_ns);
        }
    }
}

/// Returns whether a complete response or refusal has come.
const fn is_sound(outcome: &Result<Response, Error>) -> bool {
    matches!(outcome, Ok(_) | Err(Error::Rejected { .. }))
}

servowire_core::machine!(Transaction { Transmission, [u8] => Exchange, Error });

#[cfg(test)]
mod tests;
