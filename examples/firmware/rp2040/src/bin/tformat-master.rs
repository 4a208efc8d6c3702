//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints every sixteenth, and every fault.
#![no_std]
#![no_main]

use core::fmt::Write;

use panic_halt as _;
use servowire_rp2040::board::Board;
use servowire_rp2040::port::{Prepared, RingReceiver};
use servowire_rp2040::programs::Rate;
use tformat::master::{Line, Progress, Transaction};
use tformat::{BitRate, Request, Response};

/// From the end of one transaction to the beginning of the next, longer after a fault: an encoder may still be talking.
const PAUSE_NS: u64 = 20_000;
const PAUSE_AFTER_FAULT_NS: u64 = 80_000;

#[rp2040_hal::entry]
fn main() -> ! {
    let Board { mut console, mut clock, mut transmitter, receiver, channel } = Board::new(Rate::MBIT2_5, 8);
    let mut receiver = RingReceiver::new(channel, receiver);
    let line = Line::new(BitRate::Mbit2_5);
    let (mut good, mut bad) = (0_u32, 0_u32);
    let _ = writeln!(console, "T-Format master, 2.5 Mbit/s");
    loop {
        let request = Request::Id3;
        let bits = request.emit().line();
        while receiver.take().is_some() {}
        let began_ns = clock.now_ns();
        let mut transaction = Transaction::start(request, line, began_ns);
        transmitter.send(&Prepared::new(bits.bits(), bits.len(), 0));
        let end = loop {
            let progress = match receiver.take() {
                Some(unit) if unit.framed => transaction.byte(unit.content as u8, clock.now_ns()),
                Some(_) => transaction.framing_error(clock.now_ns()),
                None => transaction.poll(clock.now_ns()),
            };
            match progress {
                Progress::Waiting { .. } => {}
                Progress::Done(response) => break Ok(response),
                Progress::Failed(error) => break Err(error),
            }
        };
        let took_ns = clock.now_ns() - began_ns;
        let pause_ns = if end.is_ok() { PAUSE_NS } else { PAUSE_AFTER_FAULT_NS };
        match end {
            Ok(Response::Id3(all)) => {
                good += 1;
                if good % 16 == 1 {
                    let (abs, abm, enid) = (all.abs.get(), all.abm.get(), all.enid);
                    let _ = writeln!(
                        console,
                        "abs {abs} abm {abm} enid {enid:02x} in {took_ns} ns, {good} good, {bad} bad"
                    );
                }
            }
            Ok(_) => {}
            Err(error) => {
                bad += 1;
                let _ = writeln!(console, "fault: {error}, {good} good, {bad} bad");
            }
        }
        let next_ns = clock.now_ns() + pause_ns;
        while clock.now_ns() < next_ns {}
    }
}
