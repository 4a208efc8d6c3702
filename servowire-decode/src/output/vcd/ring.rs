//! Finds the pieces of a recording around its faults.

use std::collections::VecDeque;

use crate::time::Time;

/// A piece begins or ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    Begins(Time),
    Ends(Time),
}

/// The pieces still to come, and the end of the one being written.
#[derive(Debug, Clone)]
pub(super) struct Ring {
    around: i64,
    inside: Option<Time>,
    pieces: VecDeque<(Time, Time)>,
    /// No piece begins before this.
    over: Option<Time>,
}

impl Ring {
    /// `around`: picoseconds before and after a fault.
    pub(super) fn new(around: i64) -> Self {
        Self { around, inside: None, pieces: VecDeque::new(), over: None }
    }

    pub(super) fn around(&self) -> i64 {
        self.around
    }

    /// Returns whether a piece is being written.
    pub(super) fn is_inside(&self) -> bool {
        self.inside.is_some()
    }

    /// Reports a fault from `start` to `end`.
    pub(super) fn fault(&mut self, start: Time, end: Time) {
        let (mut from, mut to) = (start - self.around, end + self.around);
        if let Some(inside) = self.inside.as_mut().filter(|inside| **inside >= from) {
            *inside = to.max(*inside);
            return;
        }
        // Faults of several lines do not come in the order of time.
        while let Some((first, last)) = self.pieces.pop_back() {
            if last < from {
                self.pieces.push_back((first, last));
                break;
            }
            (from, to) = (from.min(first), to.max(last));
        }
        self.pieces.push_back((from, to));
    }

    /// Returns what happens next, up to `time`.
    pub(super) fn turn(&mut self, time: Time) -> Option<Turn> {
        if let Some(end) = self.inside.filter(|end| *end <= time) {
            (self.inside, self.over) = (None, Some(end));
            return Some(Turn::Ends(end));
        }
        let (from, to) = *self.pieces.front().filter(|(from, _)| self.inside.is_none() && *from <= time)?;
        self.pieces.pop_front();
        self.inside = Some(to);
        Some(Turn::Begins(self.over.map_or(from, |over| from.max(over))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time: i128) -> Time {
        Time::from_ps(time)
    }

    #[test]
    fn pieces_that_meet_are_one() {
        let mut ring = Ring::new(10);
        ring.fault(at(100), at(105));
        ring.fault(at(112), at(114));
        // Of another line, and earlier.
        ring.fault(at(95), at(96));
        ring.fault(at(300), at(301));
        assert_eq!((ring.turn(at(84)), ring.is_inside()), (None, false));
        assert_eq!((ring.turn(at(85)), ring.is_inside()), (Some(Turn::Begins(at(85))), true));
        // One more while it is written.
        ring.fault(at(120), at(130));
        assert_eq!((ring.turn(at(139)), ring.turn(at(140))), (None, Some(Turn::Ends(at(140)))));
        let rest = [ring.turn(at(1000)), ring.turn(at(1000)), ring.turn(at(1000))];
        assert_eq!(rest, [Some(Turn::Begins(at(290))), Some(Turn::Ends(at(311))), None]);
    }
}
