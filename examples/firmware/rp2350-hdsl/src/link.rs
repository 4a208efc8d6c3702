//! Core 0: the link.

use core::sync::atomic::Ordering;

use hdsl::Evidence;
use hdsl::master::{Master, State, Transmission};

use servowire_core::Writer;

use crate::FRAME;
use crate::frame::{RUNNING, STARTING};
use crate::front_end::{Late, Line, WINDOW_END_NS};

/// Runs the link until the processor or DMA is late. `first`: the head of a RESET frame, which the line sends already, since
/// `start_ns`.
pub fn run(
    line: &mut Line,
    master: &mut Master,
    feedback: &mut Writer<'_, Evidence, 10>,
    first: &Transmission,
    start_ns: u64,
) -> Result<(), Late> {
    let (mut number, mut begin_ns, mut length) = (0_u32, start_ns, STARTING);
    loop {
        FRAME.store(number, Ordering::Relaxed);
        // The next head is sent before the answer of this frame has arrived, which leaves a whole frame of time for it.
        let ahead = master.ahead();
        // Handling an answer takes longer than its frame leaves, so an unused frame goes in between: while the link starts,
        // the same frame once more; at its end, one RESET more than requested. Not while it waits for VSYNC, when no frame
        // may be skipped.
        let between = match master.state() {
            State::Running if ahead.is_none() => Some(*first),
            State::Start | State::Learn | State::Check | State::IdReq => Some(master.transmission()),
            _ => None,
        };
        if let Some(next) = ahead.or(between) {
            line.send(number.wrapping_add(1), &next);
        }
        let next = if ahead.is_some() { RUNNING } else { STARTING };
        let samples = line.window(number, next)?;
        master.hear_words(&samples, begin_ns + WINDOW_END_NS);
        begin_ns += length.ns();
        length = next;
        number = number.wrapping_add(1);
        // The line cannot wait; the user of the position can.
        if ahead.is_none() {
            let at = if between.is_some() { number.wrapping_add(1) } else { number };
            line.send(at, &master.transmission());
        }
        feedback.put(master.fast());
        if between.is_some() {
            line.window(number, STARTING)?;
            number = number.wrapping_add(1);
            begin_ns += STARTING.ns();
        }
    }
}
