use crate::error::Error;
use crate::frame::Frame;
use crate::request::Request;
use crate::response::{Response, expected_fields};
use crate::timing::BitRate;

/// How a controller is connected, and how long it waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Line {
    /// Bit rate.
    pub rate: BitRate,
    /// Whether the receiver is on while the request is sent, so that it comes back first.
    pub echo: bool,
    /// Longest wait from the end of the request to the *start bit* of the answer, in ns. Default 10 000: the nominal
    /// 3 us, 1 us for 100 m of cable, and margin.
    pub response_timeout_ns: u32,
    /// Longest time from the end of one field to the end of the next, in ns. Default one and a half field times.
    pub field_timeout_ns: u32,
}

impl Line {
    /// A line without echo and with the default time-outs.
    pub const fn new(rate: BitRate) -> Self {
        Self { rate, echo: false, response_timeout_ns: 10_000, field_timeout_ns: rate.bit_ns().saturating_mul(15) }
    }

    /// With the receiver always on.
    pub const fn with_echo(self) -> Self {
        Self { echo: true, ..self }
    }

    /// With another wait for the start bit of the response.
    pub const fn with_response_timeout(self, ns: u32) -> Self {
        Self { response_timeout_ns: ns, ..self }
    }

    /// With another wait for the next field.
    pub const fn with_field_timeout(self, ns: u32) -> Self {
        Self { field_timeout_ns: ns, ..self }
    }
}

/// How far a transaction is.
pub type Progress = servowire_core::Progress<Response, Error>;

/// Longest request and longest answer in bytes.
const MAX_BYTES: usize = 4 + Frame::MAX_FIELDS;

/// One request and its answer, byte by byte as a UART receives them.
///
/// Once done or failed it stays so. An answer that is refused early is still received to its end, so that its rest is
/// not taken for the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transaction {
    request: Request,
    line: Line,
    received: [u8; MAX_BYTES],
    len: u8,
    until_ns: u64,
    /// When the longest response to this request has ended, however late it began.
    drained_ns: u64,
    end: Option<(Result<Response, Error>, u64)>,
}

impl Transaction {
    /// Begins a transaction whose request starts on the line at `now_ns`.
    pub fn start(request: Request, line: Line, now_ns: u64) -> Self {
        let sending = line.rate.fields_ns(request.data_id().request_fields());
        let first = sending.saturating_add(line.response_timeout_ns).saturating_add(line.rate.fields_ns(1));
        let until_ns = now_ns.saturating_add(first.into());
        let rest = line.field_timeout_ns.saturating_mul(10);
        let drained_ns = until_ns.saturating_add(rest.into());
        Self { request, line, received: [0; MAX_BYTES], len: 0, until_ns, drained_ns, end: None }
    }

    /// The fields to send.
    pub const fn frame(&self) -> Frame {
        self.request.emit()
    }

    /// A byte was received, its delimiter at `now_ns`.
    pub fn byte(&mut self, byte: u8, now_ns: u64) -> Progress {
        if let Progress::Pending { .. } = self.poll(now_ns) {
            self.take(byte, now_ns);
        }
        self.progress()
    }

    /// The UART reports a framing error for the byte that ended at `now_ns`.
    ///
    /// Ends the transaction with [`Error::Delimiter`]; in the echo, with [`Error::EchoMismatch`] of the byte.
    pub fn framing_error(&mut self, now_ns: u64) -> Progress {
        if let Progress::Pending { .. } = self.poll(now_ns) {
            let field = self.len.saturating_sub(self.skip());
            let sent = self.frame();
            let echoed = sent.as_bytes().get(usize::from(self.len)).filter(|_| self.line.echo);
            let error = match echoed {
                Some(&want) => Error::EchoMismatch { at: self.len, got: 0, want },
                None => Error::Delimiter { field },
            };
            self.end = Some((Err(error), self.drained_ns));
        }
        self.progress()
    }

    /// Ends the transaction if its time is over.
    pub fn poll(&mut self, now_ns: u64) -> Progress {
        if self.end.is_none() && now_ns > self.until_ns {
            self.end = Some((self.evaluate(), self.until_ns));
        }
        self.progress()
    }

    /// Where the transaction stands.
    pub const fn progress(&self) -> Progress {
        match self.end {
            None => Progress::Pending { until_ns: self.until_ns },
            Some((Ok(value), ready_ns)) => Progress::Done { value, ready_ns },
            Some((Err(error), ready_ns)) => Progress::Failed { error, ready_ns },
        }
    }

    fn take(&mut self, byte: u8, now_ns: u64) {
        if let Some(place) = self.received.get_mut(usize::from(self.len)) {
            *place = byte;
            self.len = self.len.saturating_add(1);
        }
        let id = self.request.data_id();
        let skip = self.skip();
        if self.len <= skip {
            return;
        }
        self.until_ns = now_ns.saturating_add(self.line.field_timeout_ns.into());
        let cf = self.received.get(usize::from(skip)).copied().unwrap_or(0);
        if self.len >= skip.saturating_add(expected_fields(id, cf)) {
            // A whole response ends the talk; one that is refused may be a longer one, damaged.
            let outcome = self.evaluate();
            self.end = Some((outcome, if outcome.is_ok() { now_ns } else { self.drained_ns.max(now_ns) }));
        }
    }

    /// Bytes of the own request that come back first.
    const fn skip(&self) -> u8 {
        if self.line.echo { self.request.data_id().request_fields() } else { 0 }
    }

    fn evaluate(&self) -> Result<Response, Error> {
        let bytes = self.received.get(..usize::from(self.len)).unwrap_or(&self.received);
        match bytes {
            _ if self.line.echo => parse_echoed(self.request, bytes),
            [] => Err(Error::NoResponse { echo: false }),
            _ => Response::parse(self.request, bytes),
        }
    }
}

/// Decodes all that a UART received since the request began, with the receiver on all the time: the own request, then
/// the answer.
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
        (_, Some(answer)) => Response::parse(request, answer),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use proptest::prelude::*;

    const LINE: Line = Line::new(BitRate::Mbit2_5);

    /// Feeds an answer after the nominal delay; `echo` first if the line has one.
    fn run(request: Request, line: Line, echo: &[u8], answer: &[u8]) -> Result<Response, Error> {
        let mut transaction = Transaction::start(request, line, 1_000);
        let mut now_ns = 1_000;
        for byte in echo {
            now_ns += 4_000;
            let _ = transaction.byte(*byte, now_ns);
        }
        now_ns = 1_000 + 4_000 * u64::from(request.data_id().request_fields()) + 3_000;
        for byte in answer {
            now_ns += 4_000;
            let _ = transaction.byte(*byte, now_ns);
        }
        if let Progress::Pending { until_ns } = transaction.progress() {
            assert_eq!(transaction.poll(until_ns), Progress::Pending { until_ns });
            let _ = transaction.poll(until_ns + 1);
        }
        match transaction.progress() {
            Progress::Done { value, .. } => Ok(value),
            Progress::Failed { error, .. } => Err(error),
            Progress::Pending { .. } => panic!("the time-out did not end it"),
        }
    }

    proptest! {
        #[test]
        fn answers_arrive_with_and_without_echo((request, response) in exchanges()) {
            let (sent, answer) = (request.emit(), response.emit());
            prop_assert_eq!(run(request, LINE, &[], answer.as_bytes()), Ok(response));
            prop_assert_eq!(run(request, LINE.with_echo(), sent.as_bytes(), answer.as_bytes()), Ok(response));
        }

        #[test]
        fn cut_answers_end_by_time_out((request, response) in exchanges(), cut in 0..11usize) {
            let (sent, answer) = (request.emit(), response.emit());
            let cut = cut.min(answer.as_bytes().len() - 1);
            let want = answer.fields();
            let part = &answer.as_bytes()[..cut];
            let plain = if cut == 0 { Error::NoResponse { echo: false } } else { Error::Truncated { got: cut as u16, want: want.into() } };
            prop_assert_eq!(run(request, LINE, &[], part), Err(plain));
            let echoed = if cut == 0 { Error::NoResponse { echo: true } } else { plain };
            prop_assert_eq!(run(request, LINE.with_echo(), sent.as_bytes(), part), Err(echoed));
        }

        /// What has ended does not change any more, whatever comes.
        #[test]
        fn an_end_is_an_end((request, response) in exchanges(), more: [u8; 20]) {
            let mut transaction = Transaction::start(request, LINE, 0);
            for byte in response.emit().as_bytes() {
                let _ = transaction.byte(*byte, 10_000);
            }
            let ended = transaction;
            prop_assert_eq!(ended.progress(), Progress::Done { value: response, ready_ns: 10_000 });
            for byte in more {
                let _ = transaction.byte(byte, 10_000);
                let _ = transaction.framing_error(10_000);
                let _ = transaction.poll(u64::MAX);
            }
            prop_assert_eq!(transaction, ended);
        }
    }

    #[test]
    fn the_echo_must_be_what_was_sent() {
        let request = Request::write_eeprom(crate::Address::PAGE_REGISTER, 1);
        let wrong = run(request, LINE.with_echo(), &[0x32, 0x7f, 0x03, 0x4c], &[0x32, 0x7f, 0x01, 0x4c]);
        assert_eq!(wrong, Err(Error::EchoMismatch { at: 2, got: 3, want: 1 }));
        let half = run(request, LINE.with_echo(), &[0x32, 0x7f], &[]);
        assert_eq!(half, Err(Error::Truncated { got: 0, want: 4 }));
        assert_eq!(run(request, LINE.with_echo(), &[], &[]), Err(Error::NoResponse { echo: false }));
    }

    #[test]
    fn a_refusal_is_received_whole() {
        let refusal = [0x1a, 0x40, 0xeb, 0x3b, 0x1c, 0x17, 0x04, 0x27, 0x00, 0x00, 0xa2];
        let progress = run(Request::ReadSingleTurn, LINE, &[], &refusal);
        let Err(Error::Rejected { sf }) = progress else { panic!("{progress:?}") };
        assert!(sf.contains(crate::status::StatusField::CA0));
    }

    #[test]
    fn framing_errors_of_the_uart() {
        let mut plain = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        let _ = plain.byte(0x02, 11_000);
        assert!(matches!(plain.framing_error(15_000), Progress::Failed { error: Error::Delimiter { field: 1 }, .. }));
        let mut echoed = Transaction::start(Request::ReadSingleTurn, LINE.with_echo(), 0);
        let error = Error::EchoMismatch { at: 0, got: 0, want: 2 };
        assert!(matches!(echoed.framing_error(4_000), Progress::Failed { error: got, .. } if got == error));
    }

    #[test]
    fn late_bytes_do_not_count() {
        let mut transaction = Transaction::start(Request::ReadSingleTurn, LINE, 0);
        assert_eq!(transaction.progress(), Progress::Pending { until_ns: 18_000 });
        let late = transaction.byte(0x02, 18_001);
        assert!(matches!(late, Progress::Failed { error: Error::NoResponse { echo: false }, ready_ns: 18_000 }));
    }
}
