//! Requests and answers through a port that gives no times.
//!
//! A PC cannot see the 3 us between request and answer: an adapter hands over both at once, milliseconds later. The echo of
//! a request is therefore recognised by its content and place, and a request is sent only after everything received has
//! been read.

use std::io;
use std::thread;
use std::time::{Duration, Instant};

use servowire_core::{Ended, Procedure};
use tformat::{Request, Response};

use super::fault::Fault;
use super::port::Port;

/// The encoder at the other end of a port.
#[derive(Debug)]
pub struct Link<P> {
    port: P,
    timeout: Duration,
    echo: bool,
    began: Instant,
    /// An answer may still arrive.
    owed: bool,
}

impl<P: Port> Link<P> {
    /// Finds out whether the adapter hears itself, with a request whose answer differs in length with and without echo.
    ///
    /// # Errors
    /// [`Fault`] if no encoder answers.
    pub fn open(port: P, timeout: Duration) -> Result<Self, Fault> {
        let mut link = Self { port, timeout, echo: false, began: Instant::now(), owed: true };
        let mut fault = Fault::Encoder(tformat::Error::NoResponse { echo: false });
        for echo in [true, false, true, false] {
            link.echo = echo;
            match link.exchange(Request::ReadAll) {
                Ok(_) => return Ok(link),
                // What has echo in it says more than what has not.
                Err(next) => fault = if matches!(fault, Fault::OnlyEcho) { fault } else { next },
            }
        }
        Err(fault)
    }

    /// Returns whether the adapter hears itself.
    pub const fn echo(&self) -> bool {
        self.echo
    }

    /// Time since the port was opened.
    pub fn now_ns(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    /// Makes one request and returns its answer.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn exchange(&mut self, request: Request) -> Result<Response, Fault> {
        self.empty()?;
        // Until it has come.
        self.owed = true;
        let response = self.ask(request)?;
        self.owed = false;
        Ok(response)
    }

    /// Sends a request and waits for its answer.
    fn ask(&mut self, request: Request) -> Result<Response, Fault> {
        let frame = request.emit();
        self.port.write_all(frame.as_bytes())?;
        self.port.flush()?;
        let (mut bytes, end) = (Vec::new(), Instant::now() + self.timeout);
        loop {
            let left = end.saturating_duration_since(Instant::now());
            // What is there is taken, even if the program was kept from running until now.
            self.port.wait(left.max(Duration::from_millis(1)))?;
            let mut buffer = [0; MOST_BYTES];
            match self.port.read(&mut buffer) {
                Ok(0) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
                Ok(count) => bytes.extend(buffer.iter().take(count)),
                Err(error) if is_wait(&error) && left.is_zero() => return self.judge(request, &bytes),
                Err(error) if is_wait(&error) => continue,
                Err(error) => return Err(error.into()),
            }
            if let Some(response) = self.find(request, &bytes) {
                return Ok(response);
            }
            if bytes.len() > MOST_BYTES {
                return self.judge(request, &bytes);
            }
        }
    }

    /// Takes a procedure through its exchanges.
    ///
    /// # Errors
    /// [`Fault`] of the procedure, or immediately a fault of the port.
    pub fn run<R: Procedure<Request = Request, Response = Response, Error = tformat::Error>>(
        &mut self,
        mut procedure: R,
    ) -> Result<R::Value, Fault> {
        let ended = servowire_core::run(&mut procedure, self.now_ns(), |request, not_before_ns| {
            thread::sleep(Duration::from_nanos(not_before_ns.saturating_sub(self.now_ns())));
            let outcome = match self.exchange(request) {
                Ok(response) => Ok(response),
                Err(Fault::Encoder(error)) => Err(error),
                Err(Fault::OnlyEcho) => Err(tformat::Error::NoResponse { echo: true }),
                Err(other) => return Err(other),
            };
            Ok(Ended { outcome, ready_ns: self.now_ns() })
        })?;
        Ok(ended.outcome?)
    }

    /// Reads everything received. While an answer is owed, the adapter may be holding it back.
    fn empty(&mut self) -> Result<(), Fault> {
        self.port.forget()?;
        self.port.wait(if self.owed { HELD_BACK } else { Duration::from_millis(1) })?;
        for _ in 0..MOST_BYTES {
            match self.port.read(&mut [0; MOST_BYTES]) {
                Ok(0) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
                Ok(_) => {}
                Err(error) if is_wait(&error) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
        }
        Err(Fault::Input("the line does not go quiet".to_owned()))
    }

    /// Returns a good answer in its place: at the end of the bytes received, or one byte before it; after the echo, if the
    /// adapter hears itself, otherwise at the beginning. A byte of noise may precede either.
    fn find(&self, request: Request, bytes: &[u8]) -> Option<Response> {
        let sent = request.emit();
        let echo: &[u8] = if self.echo { sent.as_bytes() } else { &[] };
        let length = usize::from(request.data_id().response_fields());
        (0..=1).find_map(|behind| {
            let end = bytes.len().checked_sub(behind)?;
            let (before, answer) = (bytes.get(..end.checked_sub(length)?)?, bytes.get(end - length..end)?);
            let between = before.len().checked_sub(echo.len())?;
            let placed = before.starts_with(echo) || before.ends_with(echo);
            if between > 1 || !placed {
                return None;
            }
            Response::parse(request, answer).ok()
        })
    }

    /// Returns what is wrong with the bytes received when the time is over.
    fn judge(&self, request: Request, bytes: &[u8]) -> Result<Response, Fault> {
        let sent = request.emit();
        let answer = bytes.strip_prefix(sent.as_bytes()).filter(|_| self.echo);
        match answer.unwrap_or(bytes) {
            [] if answer.is_some() => Err(Fault::OnlyEcho),
            [] => Err(tformat::Error::NoResponse { echo: false }.into()),
            // Good in itself, but not in its place: an echo, or noise before it.
            answer => match Response::parse(request, answer) {
                Ok(_) if answer == sent.as_bytes() => Err(Fault::OnlyEcho),
                Ok(_) => Err(tformat::Error::EchoMismatch {
                    at: 0,
                    got: answer.first().copied().unwrap_or(0),
                    want: sent.as_bytes().first().copied().unwrap_or(0),
                }
                .into()),
                Err(error) => Err(error.into()),
            },
        }
    }
}

/// How long an adapter may hold a short answer back: 16 ms, the latency timer of FTDI chips, and margin.
const HELD_BACK: Duration = Duration::from_millis(20);

/// More bytes than any exchange has.
const MOST_BYTES: usize = 64;

/// Nothing has arrived for now.
fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}
