//! The halts of a background: the interrupt sees each without the queue, and confirms it.

use core::sync::atomic::Ordering;

use crate::error::Error;
use crate::queue::{IDLE, TICKET};
use crate::word::Word;

/// Each halt has a ticket, so that the interrupt's report of one is not taken for that of another.
#[derive(Debug)]
pub(crate) struct Halts {
    /// That of the last one.
    ticket: u32,
    /// The interrupt has not confirmed it.
    pending: bool,
}

impl Halts {
    /// None yet.
    pub(crate) const NONE: Self = Self { ticket: 0, pending: false };

    /// Tells the interrupt to make no further step.
    pub(crate) fn ask(&mut self, interrupt: &Word) {
        // 0 means that there is no halt.
        self.ticket = (self.ticket.wrapping_add(1) & (IDLE >> TICKET).wrapping_sub(1)).max(1);
        self.pending = true;
        interrupt.store(self.ticket, Ordering::Release);
    }

    /// What the interrupt reports once it has stopped for the halt; `None` if none is pending.
    pub(crate) fn report(&self) -> Option<u32> {
        self.pending.then_some(IDLE | self.ticket << TICKET)
    }

    /// Lets the interrupt go on after it has confirmed the halt.
    pub(crate) fn confirmed(&mut self, interrupt: &Word) {
        interrupt.store(0, Ordering::Release);
        self.pending = false;
    }

    /// Refuses what needs to know where the axes are.
    pub(crate) const fn ready(&self) -> Result<(), Error> {
        if self.pending { Err(Error::Moving) } else { Ok(()) }
    }

    pub(crate) const fn is_pending(&self) -> bool {
        self.pending
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 15 bits above a slot, below the bit of a timer that is stopped; and never 0.
    #[test]
    fn each_halt_has_a_ticket_of_its_own() {
        let (mut halts, interrupt) = (Halts::NONE, Word::new(0));
        assert_eq!((halts.report(), halts.ready()), (None, Ok(())));
        let mut before = None;
        for n in 0..70_000 {
            halts.ask(&interrupt);
            let ticket = interrupt.load(Ordering::Relaxed);
            assert!((1..1 << 15).contains(&ticket) && Some(ticket) != before, "{n}: {ticket}");
            assert_eq!(halts.report(), Some(0x8000_0000 | ticket << 16));
            assert!(halts.is_pending() && halts.ready() == Err(Error::Moving));
            before = Some(ticket);
            if n % 3 == 0 {
                halts.confirmed(&interrupt);
                assert_eq!((interrupt.load(Ordering::Relaxed), halts.report(), halts.ready()), (0, None, Ok(())));
            }
        }
    }
}
