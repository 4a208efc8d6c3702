//! A source that may pause: a pipe, or a file that is still growing.

use std::cell::RefCell;
use std::io::{self, Read};
use std::rc::Rc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use servowire_decode::capture::Live;

use crate::interrupt;

/// Bytes read at once.
const CHUNK: usize = 1 << 16;
/// Maximum number of chunks waiting to be taken.
const AHEAD: usize = 4;
/// A source that delivers nothing for this long counts as empty for now.
const PAUSE: Duration = Duration::from_millis(60);
/// Complete events are shown after this time at the latest.
const SHOWN: Duration = Duration::from_millis(250);
/// How often a file is checked for growth.
const LOOK: Duration = Duration::from_millis(50);

thread_local! {
    /// The function called repeatedly while nothing arrives.
    static WAITING: RefCell<Option<Rc<dyn Fn()>>> = const { RefCell::new(None) };
}

/// From now on, repeats `call` while this thread waits for a source that delivers nothing.
pub(crate) fn while_waiting(call: impl Fn() + 'static) {
    WAITING.set(Some(Rc::new(call)));
}

/// Reads in a separate thread, so that it can be asked whether data are available.
pub(crate) struct Pipe {
    chunks: Receiver<io::Result<Vec<u8>>>,
    chunk: Vec<u8>,
    taken: usize,
    fault: Option<io::Error>,
    ended: bool,
    /// When it last reported that events are to be shown.
    shown: Instant,
}

impl Pipe {
    /// `grows`: the source may grow at its end.
    pub(crate) fn over(mut source: impl Read + Send + 'static, grows: bool) -> Self {
        let (send, chunks) = mpsc::sync_channel(AHEAD);
        thread::spawn(move || {
            loop {
                let mut bytes = vec![0; CHUNK];
                let chunk = match source.read(&mut bytes) {
                    Ok(0) if grows => {
                        thread::sleep(LOOK);
                        continue;
                    }
                    Ok(0) => return,
                    Ok(n) => {
                        bytes.truncate(n);
                        Ok(bytes)
                    }
                    Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                    Err(e) => Err(e),
                };
                let over = chunk.is_err();
                if send.send(chunk).is_err() || over {
                    return;
                }
            }
        });
        Self { chunks, chunk: Vec::new(), taken: 0, fault: None, ended: false, shown: Instant::now() }
    }

    fn is_empty(&self) -> bool {
        self.taken == self.chunk.len() && self.fault.is_none() && !self.ended
    }

    fn take(&mut self, chunk: io::Result<Vec<u8>>) {
        self.taken = 0;
        match chunk {
            Ok(chunk) => self.chunk = chunk,
            Err(fault) => (self.chunk, self.fault) = (Vec::new(), Some(fault)),
        }
    }

    /// Returns whether a read delivers data, or the end, within `patience`.
    pub(crate) fn gives_within(&mut self, patience: Duration) -> bool {
        if self.is_empty() {
            match self.chunks.recv_timeout(patience) {
                Ok(chunk) => self.take(chunk),
                Err(RecvTimeoutError::Disconnected) => self.ended = true,
                Err(RecvTimeoutError::Timeout) => return false,
            }
        }
        true
    }

    /// Returns whether it has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.ended && self.taken == self.chunk.len()
    }
}

impl Live for Pipe {
    fn is_ready(&mut self) -> bool {
        self.gives_within(PAUSE)
    }

    fn is_overdue(&mut self) -> bool {
        let overdue = self.shown.elapsed() > SHOWN;
        if overdue {
            self.shown = Instant::now();
        }
        overdue
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.is_empty() {
            let waiting = WAITING.with_borrow(Option::clone);
            // Somebody who wants it to end is heard also while nothing comes.
            while !interrupt::asked() && !self.gives_within(LOOK) {
                if let Some(call) = &waiting {
                    call();
                }
            }
            self.ended |= interrupt::asked();
        }
        if let Some(fault) = self.fault.take() {
            self.ended = true;
            return Err(fault);
        }
        let rest = self.chunk.get(self.taken..).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        if let (Some(to), Some(from)) = (buffer.get_mut(..count), rest.get(..count)) {
            to.copy_from_slice(from);
        }
        self.taken += count;
        Ok(count)
    }
}
