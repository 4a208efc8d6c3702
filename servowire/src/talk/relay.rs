//! Relays between a master and its encoder, with an adapter at each: all requests and answers are passed on and logged.

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tformat::{Error, Request, Response};

use super::fault::Fault;
use super::link::Link;
use super::port::Port;

/// How long a read waits, and so how fast a stop is noticed. After a pause of this length an incomplete request is
/// abandoned.
const LOOK: Duration = Duration::from_millis(20);
/// How long the echo of a sent answer may take to come back.
const ECHO: Duration = Duration::from_millis(100);
/// Longest request.
const MOST_BYTES: usize = 4;

/// The bytes sent, as an adapter that hears itself returns them: identical bytes that arrive first after an answer are
/// discarded.
#[derive(Debug)]
pub(super) struct Echo {
    expected: VecDeque<u8>,
    until: Instant,
    hears_itself: bool,
}

impl Echo {
    pub(super) fn new(hears_itself: bool) -> Self {
        Self { expected: VecDeque::new(), until: Instant::now(), hears_itself }
    }

    /// Notes that these bytes were sent.
    pub(super) fn sent(&mut self, bytes: &[u8]) {
        self.expected.extend(bytes.iter().filter(|_| self.hears_itself));
        self.until = Instant::now() + ECHO;
    }

    /// Returns whether a byte is one of the bytes sent.
    pub(super) fn is(&mut self, byte: u8) -> bool {
        if Instant::now() > self.until || self.expected.front() != Some(&byte) {
            self.expected.clear();
            return false;
        }
        self.expected.pop_front();
        true
    }
}

/// What the master has sent.
#[derive(Debug)]
pub enum Said {
    /// A request and its result.
    Request(Request, Result<Response, Fault>),
    /// Bytes that do not form a request.
    Junk(Vec<u8>),
}

/// Passes requests from the master to the encoder, and answers back, until `stop` is set; `log` is called for each.
///
/// Requests and answers are decoded on the way, so only good ones are passed on. A PC takes milliseconds for this, and the
/// master has to wait that long.
///
/// # Errors
/// [`Fault::Io`] of the master's port; [`Fault::Port`] if that of the encoder is gone; that of the log.
pub fn run<M: Port, E: Port>(
    mut master: M,
    encoder: &mut Link<E>,
    hears_itself: bool,
    mut log: impl FnMut(&Said) -> Result<(), Fault>,
    stop: Option<&AtomicBool>,
) -> Result<(), Fault> {
    let mut echo = Echo::new(hears_itself);
    let mut bytes = Vec::new();
    master.wait(LOOK)?;
    while !stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
        let mut buffer = [0; 64];
        match master.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => bytes.extend(buffer.iter().take(count).copied().filter(|byte| !echo.is(*byte))),
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                // A pause: what is there is not continued.
                if !bytes.is_empty() {
                    log(&Said::Junk(std::mem::take(&mut bytes)))?;
                }
                continue;
            }
            Err(error) => return Err(error.into()),
        }
        let request = match Request::parse(&bytes) {
            Ok(request) => request,
            Err(Error::Truncated { .. }) if bytes.len() < MOST_BYTES => continue,
            Err(_) => {
                log(&Said::Junk(std::mem::take(&mut bytes)))?;
                continue;
            }
        };
        bytes.clear();
        let outcome = encoder.exchange(request);
        if let Ok(response) = &outcome {
            let frame = response.emit();
            master.write_all(frame.as_bytes())?;
            master.flush()?;
            echo.sent(frame.as_bytes());
        }
        let gone = match &outcome {
            Err(Fault::Io(error)) => Some(Fault::Port(format!("the encoder's port is gone or refused: {error}"))),
            _ => None,
        };
        log(&Said::Request(request, outcome))?;
        if let Some(gone) = gone {
            return Err(gone);
        }
    }
    Ok(())
}
