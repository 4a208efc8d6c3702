//! An encoder at a serial port.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tformat::device::Device;
use tformat::{Abm, Abs, BitRate, Resolution};

use super::fault::Fault;
use super::port::Port;
use super::relay::Echo;

/// How long a read waits, and so how fast a stop is noticed.
const LOOK: Duration = Duration::from_millis(20);

/// Settings of the simulation.
#[derive(Debug, Clone, Copy)]
pub struct Simulated {
    /// Bit rate.
    pub rate: BitRate,
    /// Encoder ID.
    pub id: u8,
    /// Speed of the shaft in turns per minute.
    pub rpm: f64,
    /// Whether the adapter hears itself: identical bytes that arrive first after an answer are discarded.
    pub echo: bool,
}

/// Answers requests until `stop` is set, or for ever without it.
///
/// A PC answers milliseconds late; a master that waits the specified few microseconds hears nothing. For `talk` at another
/// adapter this is fast enough.
///
/// # Errors
/// [`Fault::Io`].
pub fn run<P: Port>(mut port: P, encoder: Simulated, stop: Option<&AtomicBool>) -> Result<(), Fault> {
    let Simulated { rate, id, rpm, echo: hears_itself } = encoder;
    let mut device = Device::<6>::new(id, rate);
    let bits = Resolution::from_enid(id).map_or(24, |hint| hint.resolution.abs_bits());
    let begin = Instant::now();
    let mut echo = Echo::new(hears_itself);
    port.wait(LOOK)?;
    while !stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
        let mut buffer = [0; 64];
        let count = match port.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => continue,
            Err(error) => return Err(error.into()),
        };
        let elapsed = begin.elapsed();
        let turned = elapsed.as_secs_f64() * rpm / 60.0 * f64::from(1_u32 << bits.min(24));
        let counts = turned as i64;
        device.set_position(Abs::truncate(counts as u32), Abm::truncate((counts >> bits) as u32));
        // Bytes of one read came together; before them there was a pause.
        let now_ns = u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX);
        for byte in buffer.iter().take(count) {
            if echo.is(*byte) {
                continue;
            }
            if let Some(answer) = device.hear(&[*byte], now_ns) {
                port.write_all(answer.frame.as_bytes())?;
                port.flush()?;
                echo.sent(answer.frame.as_bytes());
            }
        }
    }
    Ok(())
}
