//! Core 1 uses the position. Here it prints it ten times a second; a current loop would take the angle in its interrupt.

use core::fmt::Write;
use core::sync::atomic::Ordering;

use hdsl::{Evidence, Policy};
use rp235x_hal::Watchdog;
use rp235x_hal::gpio::bank0::{Gpio0, Gpio1};
use rp235x_hal::gpio::{FunctionUart, Pin, PullDown};
use rp235x_hal::pac::UART0;
use rp235x_hal::uart::{Enabled, UartPeripheral};
use servowire_core::Reader;

use crate::frame::RUNNING;
use crate::last_words::Before;
use crate::{FIRST, FRAME, LATE};

type Uart = UartPeripheral<Enabled, UART0, (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>)>;

/// The permitted age of a position: three frames.
const FRESH: Policy = Policy::new(3 * RUNNING.ns());
const PERIOD_NS: u64 = 100_000_000;

/// The first output: the board, and why the previous run ended, if the watchdog ended it.
pub fn begin(uart: &mut Uart, before: Option<Before>) {
    let _ = write!(uart, "{FIRST}, {} positions a second\r\n", 1_000_000_000 / RUNNING.ns());
    if let Some(before) = before {
        let _ = write!(uart, "{before}\r\n");
    }
}

/// A line in each period, and at once when the position comes or goes: the position, or why there is none. It never ends,
/// and feeds the watchdog as long as core 0 is running too.
pub fn run(mut uart: Uart, watchdog: Watchdog, mut feedback: Reader<'_, Evidence, 10>, now_ns: impl Fn() -> u64) -> ! {
    let mut frame = u32::MAX;
    let (mut next_ns, mut late, mut known) = (now_ns(), 0, false);
    loop {
        let at = FRAME.load(Ordering::Relaxed);
        if at != frame {
            frame = at;
            watchdog.feed();
        }
        let feedback = feedback.at(now_ns(), FRESH);
        if now_ns() < next_ns && feedback.is_ok() == known {
            continue;
        }
        known = feedback.is_ok();
        next_ns = now_ns() + PERIOD_NS;
        let _ = match feedback {
            Ok(sample) => write!(uart, "position {}\r\n", sample.position()),
            Err(doubt) => write!(uart, "no position: {doubt}\r\n"),
        };
        let count = LATE.load(Ordering::Relaxed);
        if count != late {
            late = count;
            let _ = write!(uart, "late: the link was begun anew {late} times because a head was not ready\r\n");
        }
    }
}
