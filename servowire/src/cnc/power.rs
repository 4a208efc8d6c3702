//! Switches motor drivers off while their axis has nothing to do, and wakes them in time.

use servowire_decode::fault::Fault;
use sorte_proto::drv8711::WAKE_NS;
use sorte_proto::{Direction, Pto};

use super::program::Program;

/// Cycles beyond what the chip needs: the pins follow a word in the next cycle, and a step may come early in its own.
const MARGIN: u32 = 2;

/// Passes on the words of a program, with the driver-off word for axes at rest.
pub(super) struct Power {
    program: Program,
    /// Cycles at rest after which a driver is switched off; `None`: never.
    after: Option<u32>,
    /// Cycles that all axes wait while a driver wakes, and how many of them are left.
    wake: u32,
    waking: u32,
    /// Cycles that each axis has been at rest.
    idle: Vec<u32>,
    /// The program's words, held back while a driver wakes.
    held: Vec<Pto>,
    /// Number of driver-off words so far.
    pub(super) off: u64,
}

impl Power {
    pub(super) fn new(program: Program, axes: usize, after: Option<u32>, cycle_ns: u32) -> Self {
        let wake = WAKE_NS.div_ceil(cycle_ns) + MARGIN;
        Self { program, after, wake, waking: 0, idle: vec![0; axes], held: vec![Pto::default(); axes], off: 0 }
    }

    /// Why the program ended early.
    pub(super) fn fault(&self) -> Option<&Fault> {
        self.program.fault()
    }

    /// Notes that the axis has work unknown to the program.
    pub(super) fn keep(&mut self, axis: usize) {
        if let (Some(idle), Some(after)) = (self.idle.get_mut(axis), self.after) {
            // A driver that is off stays off until it has been woken.
            *idle = if *idle > after { *idle } else { 0 };
        }
    }

    /// The words of the next cycle. A step of an axis whose driver is off holds back all axes until the driver is awake.
    pub(super) fn next(&mut self, words: &mut [Pto]) {
        let Some(after) = self.after else { return self.program.next(words) };
        if self.waking == 0 {
            self.program.next(&mut self.held);
            for (idle, word) in self.idle.iter_mut().zip(&self.held) {
                if word.start().is_none() {
                    *idle = idle.saturating_add(1);
                    continue;
                }
                if *idle > after {
                    self.waking = self.wake;
                }
                *idle = 0;
            }
        } else {
            self.waking -= 1;
        }
        for ((to, word), idle) in words.iter_mut().zip(&self.held).zip(&self.idle) {
            *to = match word {
                _ if *idle > after => Pto::DriverOff,
                word if self.waking > 0 => rest(*word),
                word => *word,
            };
            self.off += u64::from(*to == Pto::DriverOff);
        }
    }

    pub(super) fn is_over(&self) -> bool {
        self.waking == 0 && self.program.is_over()
    }
}

/// Returns the word without its step.
pub(super) fn rest(word: Pto) -> Pto {
    match word {
        Pto::DriverOff => Pto::DriverOff,
        word => Pto::NoPulse { direction: word.direction().unwrap_or(Direction::Low) },
    }
}

#[cfg(test)]
mod tests {
    use step_profile::{Parameters, Profile, Speed};

    use super::*;

    /// Two moves of an axis, and one that ends before it and waits.
    fn program() -> Program {
        let profile = Profile::new(Parameters::at(Speed::KHZ_100)).unwrap();
        Program::independent(2, &[profile], 400, 2)
    }

    #[test]
    fn a_step_comes_a_millisecond_and_more_after_its_driver_is_on() {
        let mut power = Power::new(program(), 2, Some(50), 4000);
        let (mut words, mut on_since, mut steps, mut off) = ([Pto::default(); 2], [Some(0); 2], [0, 0], 0_u64);
        for cycle in 0..200_000_u64 {
            power.next(&mut words);
            for (k, word) in words.iter().enumerate() {
                on_since[k] = if *word == Pto::DriverOff { None } else { on_since[k].or(Some(cycle)) };
                off += u64::from(*word == Pto::DriverOff);
                if word.start().is_some() {
                    steps[k] += 1;
                    let since = on_since[k].expect("no step with the driver off");
                    assert!(
                        since == 0 || (cycle - since) * 4000 >= 1_000_000,
                        "axis {k}, cycle {cycle}, on since {since}"
                    );
                }
            }
        }
        assert_eq!((steps, power.off, power.is_over()), ([800, 400], off, true));
        assert_eq!(words, [Pto::DriverOff; 2]);
    }

    #[test]
    fn without_it_the_words_are_the_programs() {
        let (mut power, mut plain) = (Power::new(program(), 2, None, 4000), program());
        for _ in 0..3000 {
            let (mut a, mut b) = ([Pto::default(); 2], [Pto::default(); 2]);
            power.next(&mut a);
            plain.next(&mut b);
            assert_eq!(a, b);
        }
        assert_eq!(power.off, 0);
    }

    #[test]
    fn an_axis_that_catches_up_keeps_its_driver() {
        let mut power = Power::new(program(), 2, Some(10), 4000);
        let mut words = [Pto::default(); 2];
        for _ in 0..50_000 {
            power.keep(1);
            power.next(&mut words);
            assert_ne!(words[1], Pto::DriverOff);
        }
        assert_eq!(words[0], Pto::DriverOff);
    }
}
