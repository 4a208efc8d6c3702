//! A request on its way out, with the line driver on.

use servowire_core::ClockError;
use tformat::master::Line;

use crate::direction::Switch;
use crate::leaving::{self, Leaving};
use crate::quiet;
use crate::{Clock, Direction, Worst};

/// The line driver is on for as long as this value lives. When dropped, it waits until everything that was handed over has
/// left, because a request whose end is cut off may be read as a different request.
#[derive(Debug)]
pub(crate) struct Sending<'a, D: Direction, C: Clock> {
    switch: &'a mut Switch<D>,
    pub(crate) clock: &'a mut C,
    pub(crate) line: &'a mut quiet::Line,
    /// `None` if the hardware switches the driver.
    leaving: Option<Leaving>,
    /// Number of fields that were passed to a `write` and may be on their way.
    asked: usize,
    start_ns: Option<u64>,
}

/// When a request began to leave, and how much too late the driver was switched off after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sent {
    pub(crate) start_ns: u64,
    pub(crate) late_ns: u64,
}

/// Makes sure that the line driver is off, before listening; returns the time. A future that was forgotten while its request
/// was being sent has left the driver on; the driver is then not switched off before that request has left, however long ago
/// the last look was.
///
/// `looked` is the result of the last look at the clock. If that was a fault, the driver is switched off anyway.
#[inline]
pub(crate) fn off<D: Direction>(
    switch: &mut Switch<D>,
    clock: &mut impl Clock,
    state: &mut quiet::Line,
    line: &Line,
    looked: Result<u64, ClockError>,
) -> Result<Result<u64, ClockError>, D::Error> {
    let cut = switch.is_on() && switch.worst().is_some() && state.is_leaving();
    let waited = if cut { looked.and(outlast(clock, state, line)) } else { looked };
    switch.off()?;
    Ok(waited)
}

/// Waits until no part of a request is still leaving, no matter when the request began; returns the time.
#[cold]
#[inline(never)]
fn outlast(clock: &mut impl Clock, state: &mut quiet::Line, line: &Line) -> Result<u64, ClockError> {
    let longest_ns = leaving::longest_ns(line.rate.fields_ns(1).into(), line.turn_around_ns.into());
    state.sit_out(clock, u64::MAX, longest_ns).map(|()| state.last_ns())
}

impl<'a, D: Direction, C: Clock> Sending<'a, D, C> {
    /// Switches the driver on.
    #[inline]
    pub(crate) fn begin(
        switch: &'a mut Switch<D>,
        clock: &'a mut C,
        state: &'a mut quiet::Line,
        line: &Line,
    ) -> Result<Self, D::Error> {
        // The line is driven on after a request for as long as nobody answers.
        let (field_ns, window_ns) = (line.rate.fields_ns(1), line.turn_around_ns);
        let leaving = switch.worst().map(|worst| Leaving::new(worst, field_ns, window_ns));
        let sending = Self { switch, clock, line: state, leaving, asked: 0, start_ns: None };
        sending.switch.on()?;
        Ok(sending)
    }

    /// Returns when the first field may be handed over; at once if the hardware switches the driver.
    #[inline]
    pub(crate) fn lead_until_ns(&mut self, lead_ns: u32) -> Result<Option<u64>, ClockError> {
        let Some(Worst { clock_ns, .. }) = self.switch.worst() else { return Ok(None) };
        let now_ns = self.line.now_ns(self.clock)?;
        Ok(Some(now_ns.saturating_add(lead_ns.into()).saturating_add(clock_ns.into())))
    }

    /// Returns the fields to hand over next. If software switches the driver, the first one goes alone, because its time is the
    /// time of the request.
    pub(crate) const fn piece<'b>(&self, fields: &'b [u8]) -> &'b [u8] {
        match fields.split_at_checked(1) {
            Some((first, _)) if self.leaving.is_some() && self.start_ns.is_none() => first,
            _ => fields,
        }
    }

    /// Notes that a `write` is about to take these fields; returns the time.
    #[inline]
    pub(crate) fn ask(&mut self, fields: &[u8]) -> Result<u64, ClockError> {
        let now_ns = self.line.now_ns(self.clock)?;
        self.asked = fields.len();
        Ok(now_ns)
    }

    /// Notes that the `write` begun at `before_ns` has taken this many fields.
    #[inline]
    pub(crate) fn taken(&mut self, fields: usize, before_ns: u64) -> Result<(), ClockError> {
        let after_ns = self.line.now_ns(self.clock)?;
        self.asked = 0;
        let mut start_ns = before_ns;
        if let Some(leaving) = &mut self.leaving {
            leaving.taken(fields, before_ns, after_ns);
            // One field that was held up may have begun to leave as late as that, and nothing before it is an answer to it.
            if leaving.is_late(before_ns, after_ns) {
                start_ns = after_ns;
            }
        }
        self.start_ns.get_or_insert(start_ns);
        Ok(())
    }

    /// Returns when to switch the driver off.
    #[inline]
    pub(crate) fn off_ns(&self) -> Option<u64> {
        self.leaving.and_then(|leaving| leaving.off_ns())
    }

    /// Ends the request, which has left: switches the driver off and returns whether that succeeded; if not, it tries once
    /// more.
    #[inline]
    pub(crate) fn end(mut self) -> Result<Result<Sent, ClockError>, D::Error> {
        self.switch.off()?;
        Ok(self.sent())
    }

    #[inline]
    fn sent(&mut self) -> Result<Sent, ClockError> {
        let now_ns = self.line.now_ns(self.clock)?;
        self.line.sent(now_ns);
        let late_ns = self.leaving.map_or(0, |leaving| leaving.late_ns(now_ns));
        Ok(Sent { start_ns: self.start_ns.unwrap_or(now_ns), late_ns })
    }
}

impl<D: Direction, C: Clock> Drop for Sending<'_, D, C> {
    #[inline]
    fn drop(&mut self) {
        if !self.switch.is_on() {
            return;
        }
        if let Some(leaving) = &mut self.leaving {
            if self.asked > 0 {
                let now_ns = self.line.now_ns(self.clock).unwrap_or(self.line.last_ns());
                leaving.taken(self.asked, now_ns, now_ns);
            }
            if let Some(off_ns) = leaving.off_ns() {
                let _: Result<(), _> = self.line.sit_out(self.clock, off_ns, leaving.longest_ns());
            }
        }
        // Nobody is there to hear of it; the next call tries again before it listens.
        let _: Result<(), _> = self.switch.off();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;
    use core::convert::Infallible;
    use tformat::BitRate;

    /// A look lasts so long.
    const LOOK_NS: u64 = 10;
    const LINE: Line = Line::new(BitRate::Mbit2_5);

    /// A pin that notes when it was switched off.
    struct Pin<'a> {
        now_ns: &'a Cell<u64>,
        off_ns: &'a Cell<u64>,
    }

    impl Direction for Pin<'_> {
        type Error = Infallible;

        fn transmit(&mut self) -> Result<(), Infallible> {
            Ok(())
        }

        fn receive(&mut self) -> Result<(), Infallible> {
            self.off_ns.set(self.now_ns.get());
            Ok(())
        }

        fn worst(&self) -> Option<Worst> {
            Some(Worst { uart_start_ns: 100, wake_ns: 100, clock_ns: 10 })
        }
    }

    /// What is done with a request whose driver was switched on at 1 ms; when it began, and when the driver went off.
    fn send(
        act: impl FnOnce(Sending<'_, Pin<'_>, &mut dyn FnMut() -> u64>, &Cell<u64>) -> Option<u64>,
    ) -> (Option<u64>, u64) {
        let (now_ns, off_ns) = (Cell::new(1_000_000), Cell::new(0));
        let mut look = || {
            now_ns.set(now_ns.get() + LOOK_NS);
            now_ns.get()
        };
        let mut clock: &mut dyn FnMut() -> u64 = &mut look;
        let mut switch = Switch::new(Pin { now_ns: &now_ns, off_ns: &off_ns });
        let mut state = quiet::Line::new(8_000, 0);
        let _ = state.first_ns(&mut clock);
        let sending = Sending::begin(&mut switch, &mut clock, &mut state, &LINE).unwrap();
        let began_ns = act(sending, &now_ns);
        (began_ns, off_ns.get())
    }

    /// One field, whose `write` lasts this long: when the request began, after it was asked for.
    fn began_after(write_ns: u64) -> u64 {
        let mut asked = 0;
        let (began_ns, _) = send(|mut sending, now_ns| {
            let asked_ns = sending.ask(&[0x1a]).unwrap();
            // The look after it is part of it.
            now_ns.set(now_ns.get() + write_ns - LOOK_NS);
            sending.taken(1, asked_ns).unwrap();
            asked = asked_ns;
            Some(sending.end().unwrap().unwrap().start_ns)
        });
        began_ns.unwrap() - asked
    }

    /// Nothing that came before a request had left is an answer to it. A `write` that was held up for longer than four bits may have handed
    /// it over at its end; one that was not is taken by its beginning, so that no answer is too early.
    #[test]
    fn a_request_that_was_held_up_begins_at_the_end_of_its_write() {
        assert_eq!([40, 1_600].map(began_after), [0, 0]);
        assert_eq!([1_610, 100_000].map(began_after), [1_610, 100_000]);
    }

    #[test]
    fn a_driver_that_nothing_was_asked_of_goes_off_at_once() {
        let (_, off_ns) = send(|sending, _| {
            drop(sending);
            None
        });
        assert_eq!(off_ns, 1_000_010);
    }

    /// A field and the margins after the last `write`, which is known to have ended; one field more if nobody knows.
    #[test]
    fn what_was_taken_is_waited_for_once() {
        for (known, least_ns) in [(true, 4_000), (false, 8_000)] {
            let (_, off_ns) = send(|mut sending, _| {
                let asked_ns = sending.ask(&[0x32]).unwrap();
                sending.taken(1, asked_ns).unwrap();
                if !known {
                    let _ = sending.ask(&[0x01]).unwrap();
                }
                drop(sending);
                None
            });
            let after_ns = off_ns - 1_000_000;
            assert!((least_ns + 100..least_ns + 1_600).contains(&after_ns), "{known}: {after_ns}");
        }
    }
}
