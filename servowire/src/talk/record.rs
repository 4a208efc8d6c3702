//! A port whose bytes are logged as they pass.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use super::fault::Fault;
use super::port::Port;

/// A port and the log of its bytes. Each line holds bytes sent or received in one direction, with the time of the first
/// byte in seconds since the port was opened. `servowire decode` reads it.
///
/// ```text
/// 0.001283 TX: 1a
/// 0.003518 RX: 1a 20 29 c0 3b 17 00 00 00 c8 37
/// ```
#[derive(Debug)]
pub struct Recorded<P> {
    port: P,
    log: Option<(File, Instant)>,
    /// The last sender.
    last: Option<&'static str>,
}

impl<P> Recorded<P> {
    /// Nothing is logged without a file.
    ///
    /// # Errors
    /// [`Fault::File`]: the file cannot be created.
    pub fn new(port: P, file: Option<&Path>) -> Result<Self, Fault> {
        let made = |path: &Path| File::create(path).map_err(Fault::file(path));
        let log = file.map(made).transpose()?.map(|file| (file, Instant::now()));
        Ok(Self { port, log, last: None })
    }

    fn record(&mut self, who: &'static str, bytes: &[u8]) -> io::Result<()> {
        let Some((file, began)) = self.log.as_mut().filter(|_| !bytes.is_empty()) else { return Ok(()) };
        let words: Vec<_> = bytes.iter().map(|byte| format!(" {byte:02x}")).collect();
        let mut text = words.concat();
        let last = self.last.replace(who);
        if last != Some(who) {
            let end = if last.is_some() { "\n" } else { "" };
            text.insert_str(0, &format!("{end}{:.6} {who}:", began.elapsed().as_secs_f64()));
        }
        let named = |error| io::Error::other(format!("the log cannot be written: {error}"));
        file.write_all(text.as_bytes()).map_err(named)
    }
}

impl<P: Read> Read for Recorded<P> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.port.read(buffer)?;
        self.record("RX", buffer.get(..count).unwrap_or_default())?;
        Ok(count)
    }
}

impl<P: Write> Write for Recorded<P> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.port.write(bytes)?;
        self.record("TX", bytes.get(..count).unwrap_or_default())?;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

impl<P: Port> Port for Recorded<P> {
    fn wait(&mut self, longest: Duration) -> io::Result<()> {
        self.port.wait(longest)
    }

    fn forget(&mut self) -> io::Result<()> {
        self.port.forget()
    }
}
