//! Looks of a cyclic master at where a machine is: before and after each step, in the ticks around, and where no step comes.

/// A machine, and the tick at which its user looks.
pub(crate) trait Watched {
    fn due(&self) -> Option<u64>;
    fn pulse(&mut self);
    fn now(&mut self) -> &mut u64;
    /// Looks where it is now.
    fn look(&mut self);

    /// Makes all steps up to a time, and looks.
    fn until(&mut self, time: u64) {
        while let Some(due) = self.due().filter(|due| *due <= time) {
            for early in [50, 1, 0] {
                *self.now() = (*self.now()).max(due.saturating_sub(early));
                self.look();
            }
            self.pulse();
            self.look();
            for _ in 0..2 {
                let next = *self.now() + 1;
                if next <= time && self.due().is_none_or(|due| due > next) {
                    *self.now() = next;
                    self.look();
                }
            }
        }
        // Whatever ends, or begins, without a step.
        let step = (time.saturating_sub(*self.now()) / 64).max(1);
        while *self.now() < time {
            *self.now() = (*self.now() + step).min(time);
            self.look();
        }
    }
}
