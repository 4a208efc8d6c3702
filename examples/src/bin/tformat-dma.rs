//! Firmware with interrupts and DMA, without a driver crate: `cargo run -p servowire-examples --bin tformat-dma`.
//!
//! The master of `tformat` takes whole blocks, so three short handlers are enough. To copy this, replace the simulated
//! encoder in `main` by a UART: DMA to it, DMA from it into a buffer, its idle interrupt, and a timer.

use tformat::device::Device;
use tformat::master::{Exchange, Line, Progress, Transaction, Transmission};
use tformat::{Abm, Abs, BitRate, Evidence, Policy, Request, Resolution};

/// After this much silence the UART says that the line is idle: one field.
const IDLE_NS: u64 = 4_000;

/// What the handlers share: a `static` in a critical section, or a resource of RTIC.
struct Reader {
    line: Line,
    transaction: Option<Transaction>,
    /// The line is free from then on.
    ready_ns: u64,
}

impl Reader {
    fn new() -> Self {
        // A block is handed over up to eleven fields and the idle time after the first of its bytes.
        let line = Line::new(BitRate::Mbit2_5).with_hand_over_ns(50_000);
        Self { line, transaction: None, ready_ns: 0 }
    }

    /// The timer of the control loop: what the DMA has to send, if the line is free. Start the receiving DMA before.
    fn on_cycle(&mut self, now_ns: u64) -> Option<Transmission> {
        if self.transaction.is_some() || now_ns < self.ready_ns {
            return None;
        }
        let transaction = Transaction::start(Request::ReadAll, self.line, now_ns);
        self.transaction = Some(transaction);
        Some(transaction.transmission())
    }

    /// The idle interrupt: all that the DMA has received, whatever it is, and when the last byte of it ended.
    fn on_idle(&mut self, received: &[u8], now_ns: u64) -> Option<Result<Evidence, String>> {
        let progress = self.transaction.as_mut()?.hear(received, now_ns.saturating_sub(IDLE_NS));
        self.end(progress)
    }

    /// A timer at the time that `Progress::Pending` has said, or simply the next cycle: the answer has not come.
    fn on_timeout(&mut self, now_ns: u64) -> Option<Result<Evidence, String>> {
        let progress = self.transaction.as_mut()?.poll(now_ns);
        self.end(progress)
    }

    fn end(&mut self, progress: Progress) -> Option<Result<Evidence, String>> {
        let (result, ready_ns) = match progress {
            Progress::Pending { .. } => return None,
            Progress::Done { value, ready_ns } => (evidence(value), ready_ns),
            Progress::Failed { error, ready_ns } => (Err(error.to_string()), ready_ns),
        };
        self.transaction = None;
        self.ready_ns = ready_ns;
        Some(result)
    }
}

fn evidence(exchange: Exchange) -> Result<Evidence, String> {
    let resolution = Resolution::new(23, 16).map_err(|error| error.to_string())?;
    Ok(exchange.evidence(resolution))
}

fn main() {
    let mut reader = Reader::new();
    let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
    for cycle in 1..=5_u32 {
        let start_ns = u64::from(cycle).saturating_mul(100_000);
        let Some(request) = reader.on_cycle(start_ns) else { continue };
        encoder.set_position(Abs::truncate(cycle.wrapping_mul(0x11_1111)), Abm::truncate(cycle));
        let answer = encoder.hear(request.frame.as_bytes(), request.end_ns);
        // In the fourth cycle the cable is broken.
        let outcome = match answer.filter(|_| cycle != 4) {
            Some(answer) => reader.on_idle(answer.frame.as_bytes(), answer.end_ns.saturating_add(IDLE_NS)),
            None => reader.on_timeout(start_ns.saturating_add(99_000)),
        };
        match outcome {
            // Where the current is controlled: an interrupt of another priority takes it out of a `servowire_core::Cell`.
            Some(Ok(evidence)) => match evidence.at(start_ns.saturating_add(90_000), Policy::new(100_000)) {
                Ok(sample) => println!("{sample}"),
                Err(doubt) => println!("{doubt}"),
            },
            Some(Err(error)) => println!("{error}"),
            None => println!("still waiting"),
        }
    }
}
