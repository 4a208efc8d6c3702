use super::Line;
use crate::error::Error;
use crate::evidence::Evidence;
use crate::frame::Frame;
use crate::message::CF3;
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::{Response, expected_fields};

/// A response with all checks passed, and when its position was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Exchange {
    /// The response.
    pub response: Response,
    /// The instant of sampling by [`Line::sampling_ns`], for extrapolation: it lies between the end of the request and
    /// the begin of the response. Its age counts from here.
    pub sampled_ns: u64,
    /// When the first start bit of the response was on the line at the latest, in ns: by then the position had been taken.
    pub began_ns: u64,
}

servowire_core::one_line!(Exchange { Self { response, sampled_ns, .. } => "{}, sampled at {} ns", response, sampled_ns; });

impl Exchange {
    /// What it says of the position of an encoder with these widths, to be judged where it is used.
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
    /// When the driver is to be switched on, in ns: [`Line::driver_lead_ns`] before the start bit.
    pub driver_on_ns: u64,
    /// When the driver is to be switched off.
    pub driver_off: DriverOff,
}

/// The time in which the driver is to be switched off after a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriverOff {
    /// Not before this time, in ns: the end of the request.
    pub earliest_ns: u64,
    /// Not after this time, in ns: the encoder may begin to answer.
    pub latest_ns: u64,
}

/// How far a transaction is. `ready_ns` of a failure is the time at which the longest response to the request is over,
/// however late within the time-out it began: eleven fields, one right after the other as encoders send them. Behind a bridge that
/// pauses between fields, wait for a silent line besides.
pub type Progress<T = Exchange> = servowire_core::Progress<T, Error>;

/// Longest request and longest response in bytes.
const MAX_BYTES: usize = 4 + Frame::MAX_FIELDS;

/// One request and its response, as a UART receives them: byte by byte, or in blocks.
///
/// No byte that began before the request had left the line is ever part of the response, as long as the end times that
/// the machine is told are late by less than the [latency budget](Line::latency_budget_ns). An echo of the request is
/// known by its time; in a block it is known by its place, counted back from the end, and by its content.
///
/// Once done or failed it stays so: until `ready_ns` go on to give it what arrives, and it is thrown away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    line: Line,
    start_ns: u64,
    /// What began before is no response.
    earliest_ns: u64,
    /// What may be the response.
    received: [u8; MAX_BYTES],
    len: u8,
    /// Bytes of the own request that came back, and the first that came back as another.
    echoed: u8,
    echo_fault: Option<u8>,
    until_ns: u64,
    /// When the last field of the longest response is handed over at the latest: a line that does not fall silent is not
    /// listened to any longer.
    latest_ns: u64,
    end: Option<(Result<Exchange, Error>, u64)>,
}

impl Transaction {
    /// Begins a transaction; the start bit of the request is on the line at `start_ns`.
    pub fn start(request: Request, line: Line, start_ns: u64) -> Self {
        let transaction = Self {
            request,
            line,
            start_ns,
            earliest_ns: 0,
            received: [0; MAX_BYTES],
            len: 0,
            echoed: 0,
            echo_fault: None,
            until_ns: 0,
            latest_ns: 0,
            end: None,
        };
        let wait_ns = u64::from(line.response_timeout_ns).saturating_add(line.hand_over_ns.into());
        let end_ns = transaction.request_end_ns();
        let waited_ns = end_ns.saturating_add(wait_ns);
        let fields_ns = u64::from(line.field_timeout_ns).saturating_mul(Frame::MAX_FIELDS as u64);
        Self {
            earliest_ns: end_ns.saturating_add(line.turn_around_ns.into()),
            until_ns: waited_ns.saturating_add(transaction.fields_ns(1)),
            latest_ns: waited_ns.saturating_add(fields_ns),
            ..transaction
        }
    }

    /// The fields to send, and when.
    pub const fn transmission(&self) -> Transmission {
        let Self { request, line, start_ns, .. } = *self;
        let end_ns = self.request_end_ns();
        Transmission {
            frame: request.emit(),
            start_ns,
            end_ns,
            driver_on_ns: start_ns.saturating_sub(line.driver_lead_ns as u64),
            driver_off: DriverOff { earliest_ns: end_ns, latest_ns: end_ns.saturating_add(line.turn_around_ns as u64) },
        }
    }

    /// Bytes were received one after the other, the delimiter of the last one at `end_ns` or, within the latency
    /// budget, before.
    pub fn hear(&mut self, bytes: &[u8], end_ns: u64) -> Progress {
        if self.end.is_some() || bytes.is_empty() {
            return self.progress();
        }
        for byte in bytes {
            self.push(*byte);
        }
        self.drop_earlier(end_ns);
        self.drop_echo_by_content();
        // The response ends where the block ends: what is too much was there before.
        while self.len > self.expected() {
            self.drop_front();
        }
        if self.len > 0 {
            let patience = self.line.field_timeout_ns.saturating_add(self.line.hand_over_ns);
            self.until_ns = end_ns.saturating_add(patience.into()).min(self.latest_ns);
        }
        if self.len == self.expected() {
            self.finish(end_ns);
        }
        self.progress()
    }

    /// The UART reports a framing error for the byte that ended at `end_ns`.
    ///
    /// In a response it ends the transaction with [`Error::Delimiter`]; in the echo it is only remembered.
    pub fn framing_error(&mut self, end_ns: u64) -> Progress {
        if self.end.is_none() {
            if self.is_earlier(end_ns, 1) {
                self.echo_fault = self.echo_fault.or(Some(0));
            } else {
                self.fail(Error::Delimiter { field: self.len }, end_ns);
            }
        }
        self.progress()
    }

    /// Ends the transaction if its time is over.
    pub fn poll(&mut self, now_ns: u64) -> Progress {
        if self.end.is_none() && now_ns > self.until_ns {
            self.finish(self.until_ns);
        }
        self.progress()
    }

    /// Where the transaction stands.
    pub const fn progress(&self) -> Progress {
        match self.end {
            None => Progress::Pending { until_ns: self.until_ns.saturating_add(1) },
            Some((Ok(value), ready_ns)) => Progress::Done { value, ready_ns },
            Some((Err(error), ready_ns)) => Progress::Failed { error, ready_ns },
        }
    }

    /// The end of the request's last bit.
    const fn request_end_ns(&self) -> u64 {
        self.start_ns.saturating_add(self.fields_ns(self.request.data_id().request_fields()))
    }

    const fn fields_ns(&self, fields: u8) -> u64 {
        self.line.rate.fields_ns(fields) as u64
    }

    /// Fields of the response that begins with the first byte there is.
    fn expected(&self) -> u8 {
        let [cf, ..] = self.received;
        expected_fields(self.request.data_id(), cf)
    }

    fn push(&mut self, byte: u8) {
        if usize::from(self.len) == MAX_BYTES {
            self.drop_front();
        }
        if let Some(place) = self.received.get_mut(usize::from(self.len)) {
            *place = byte;
            self.len = self.len.saturating_add(1);
        }
    }

    fn drop_front(&mut self) {
        self.received.rotate_left(1);
        self.len = self.len.saturating_sub(1);
    }

    /// Whether the first of `fields` fields that end at `end_ns` began before a response can begin.
    fn is_earlier(&self, end_ns: u64, fields: u8) -> bool {
        end_ns < self.earliest_ns.saturating_add(self.fields_ns(fields))
    }

    /// Drops what began before a response can begin: the echo, and what was on the line before.
    fn drop_earlier(&mut self, end_ns: u64) {
        while self.len > 0 && self.is_earlier(end_ns, self.len) {
            let [got, ..] = self.received;
            match self.request.emit().as_bytes().get(usize::from(self.echoed)) {
                Some(want) if *want == got => self.echoed = self.echoed.saturating_add(1),
                Some(_) => self.echo_fault = self.echo_fault.or(Some(got)),
                None => {}
            }
            self.drop_front();
        }
    }

    /// Drops an echo whose time does not tell: the request, and a control field after it.
    ///
    /// No response begins like that: in place of SF there would be a control field, whose low bits are never 0 as the
    /// information bits of SF are; and EDF and CRC of an EEPROM response cannot both be right.
    fn drop_echo_by_content(&mut self) {
        let fields = self.request.data_id().request_fields();
        let cf = self.request.data_id().control_field().get();
        let next = self.received.get(usize::from(fields)).filter(|_| self.len > fields);
        // Looked at first, for it is hardly ever so.
        if next.is_some_and(|next| *next == cf || *next == CF3)
            && self.received.starts_with(self.request.emit().as_bytes())
        {
            self.echoed = fields;
            for _ in 0..fields {
                self.drop_front();
            }
        }
    }

    /// The response is whole, or no more of it will come.
    fn finish(&mut self, end_ns: u64) {
        let bytes = self.received.get(..usize::from(self.len)).unwrap_or(&self.received);
        let outcome = match (bytes, self.echo_fault) {
            ([], Some(got)) if self.line.echo => {
                let want = self.request.emit().as_bytes().get(usize::from(self.echoed)).copied().unwrap_or(0);
                Err(Error::EchoMismatch { at: self.echoed, got, want })
            }
            ([], _) => Err(Error::NoResponse { echo: self.echoed == self.request.data_id().request_fields() }),
            (bytes, _) => Response::parse(self.request, bytes),
        };
        match outcome {
            Ok(response) => {
                let sampled_ns = self.request_end_ns().saturating_add(self.line.sampling_ns.into());
                let began_ns = end_ns.saturating_sub(self.fields_ns(self.len));
                self.end = Some((Ok(Exchange { response, sampled_ns, began_ns }), end_ns));
            }
            Err(error) => self.fail(error, end_ns),
        }
    }

    /// Ends with an error: the longest response, begun as late as it may, is over at `ready_ns`.
    fn fail(&mut self, error: Error, end_ns: u64) {
        let latest = self.request_end_ns().saturating_add(self.line.response_timeout_ns.into());
        let drained_ns = latest.saturating_add(self.fields_ns(11));
        self.end = Some((Err(error), drained_ns.max(end_ns)));
    }
}

servowire_core::machine!(Transaction { Transmission, [u8] => Exchange, Error });

/// Decodes all that a UART received since the request began, with the receiver on all the time: the own request, then
/// the response. For buffers without times; what follows the response is left alone.
///
/// # Errors
/// [`Error::NoResponse`] without any byte; [`Error::EchoMismatch`] for the first byte that is not what was sent;
/// [`Error::Truncated`] in the middle of the echo; [`Error::NoResponse`] with `echo` set if nothing follows it: no
/// encoder is there, or the wires A and B are exchanged; then as [`Response::parse`].
pub fn parse_echoed(request: Request, bytes: &[u8]) -> Result<Response, Error> {
    let sent = request.emit();
    for (at, (&want, &got)) in (0..).zip(sent.as_bytes().iter().zip(bytes)) {
        if got != want {
            return Err(Error::EchoMismatch { at, got, want });
        }
    }
    match (bytes, bytes.get(usize::from(sent.fields())..)) {
        ([], _) => Err(Error::NoResponse { echo: false }),
        (_, None) => Err(Error::Truncated { got: 0, want: request.data_id().response_fields().into() }),
        (_, Some([])) => Err(Error::NoResponse { echo: true }),
        (_, Some(response)) => Response::parse(request, response),
    }
}

#[cfg(test)]
mod tests;
