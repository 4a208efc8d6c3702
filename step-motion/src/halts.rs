//! The halts of a background: the interrupt sees each without the queue, and confirms it.

use core::sync::atomic::Ordering;

use servowire_core::Direction;

use crate::error::Error;
use crate::queue::{DIR, IDLE, TICKET, dir};
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
        self.ticket = (self.ticket.wrapping_add(1) & (DIR >> TICKET).wrapping_sub(1)).max(1);
        self.pending = true;
        interrupt.store(self.ticket, Ordering::Release);
    }

    /// Returns DIR as the halt has left it, from where the interrupt is; `None` if it has not stopped for the halt.
    pub(crate) const fn dir(&self, current: u32) -> Option<Direction> {
        if current & !DIR == IDLE | self.ticket << TICKET { Some(dir(current)) } else { None }
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
    use servowire_core::Direction::{Forward, Reverse};

    use super::*;

    /// 13 bits above a slot, below the bits of DIR and of a timer that is stopped; and never 0.
    #[test]
    fn each_halt_has_a_ticket_of_its_own() {
        let (mut halts, interrupt) = (Halts::NONE, Word::new(0));
        assert_eq!((halts.is_pending(), halts.ready()), (false, Ok(())));
        let mut before = None;
        for n in 0..70_000 {
            halts.ask(&interrupt);
            let ticket = interrupt.load(Ordering::Relaxed);
            assert!((1..1 << 13).contains(&ticket) && Some(ticket) != before, "{n}: {ticket}");
            let report = 0x8000_0000 | ticket << 16;
            assert_eq!([report, report | 0x2000_0000].map(|report| halts.dir(report)), [Forward, Reverse].map(Some));
            let others = [report ^ 0x8000_0000, report ^ 1 << 16, report ^ 1 << 28, report ^ 1 << 30, report | 1];
            assert_eq!(others.map(|report| halts.dir(report)), [None; 5]);
            assert!(halts.is_pending() && halts.ready() == Err(Error::Moving));
            before = Some(ticket);
            if n % 3 == 0 {
                halts.confirmed(&interrupt);
                assert_eq!((interrupt.load(Ordering::Relaxed), halts.is_pending(), halts.ready()), (0, false, Ok(())));
            }
        }
    }
}
