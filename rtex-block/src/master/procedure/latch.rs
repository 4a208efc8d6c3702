//! Positions that the drive catches at a trigger.

use super::ask::{Ask, procedure};
use crate::execution::LatchFlags;
use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::noncyclic_response::NonCyclicResponse;
use crate::type_code::{Nibble, homing};

/// Monitor_Sel for LPOS1 and LPOS2. The command has one Monitor_Sel, so two latches are read in turn.
const LPOS: [u8; 2] = [0x09, 0x0a];
const COMP: [LatchFlags; 2] = [LatchFlags::LATCH_COMP1, LatchFlags::LATCH_COMP2];

/// The positions caught, command units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Caught {
    /// LPOS1.
    pub latch1: Option<i32>,
    /// LPOS2.
    pub latch2: Option<i32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Stage {
    /// The state is being read (50h): a latch that is complete now was complete before arming.
    Before,
    Arming,
    Watching,
}

/// Arms latch 1, latch 2 or both, and waits for their positions. SX-DSV02310, "Latch mode".
///
/// The state is read (type 50h) before arming, and repeatedly afterwards. A position is accepted only with its Latch_Comp, and
/// only if that was 0 before arming or at any time since: a position left from an earlier latch is not the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Latch {
    ask: Ask,
    arm: u8,
    selections: [Nibble; 2],
    wanted: [bool; 2],
    limit: u32,
    left: u32,
    stage: Stage,
    /// Latch_Comp was 0 at some time, so a 1 is not left from an earlier latch.
    fresh: [bool; 2],
    caught: [Option<i32>; 2],
    end: Option<Progress<Caught>>,
}

procedure!(Latch, Caught);

impl Latch {
    /// Creates the procedure for latch 1: arms it with the type code `arm` and the trigger `selection` (Latch_Sel1), both
    /// from the drive's manual; the trigger has `limit` update periods.
    pub const fn first(arm: u8, selection: Nibble, limit: u32) -> Self {
        Self::new(arm, [selection, Nibble::ZERO], [true, false], limit)
    }

    /// Creates the procedure for latch 2, with its trigger in Latch_Sel2.
    pub const fn second(arm: u8, selection: Nibble, limit: u32) -> Self {
        Self::new(arm, [Nibble::ZERO, selection], [false, true], limit)
    }

    /// Creates the procedure for both latches, with the triggers of Latch_Sel1 and Latch_Sel2; done when both have caught a
    /// position.
    pub const fn both(arm: u8, selections: [Nibble; 2], limit: u32) -> Self {
        Self::new(arm, selections, [true; 2], limit)
    }

    const fn new(arm: u8, selections: [Nibble; 2], wanted: [bool; 2], limit: u32) -> Self {
        Self {
            ask: Ask::NEW,
            arm,
            selections,
            wanted,
            limit,
            left: limit,
            stage: Stage::Before,
            fresh: [false; 2],
            caught: [None; 2],
            end: None,
        }
    }

    const fn reset(&mut self) {
        *self = Self::new(self.arm, self.selections, self.wanted, self.limit);
    }

    /// The positions caught so far.
    pub const fn caught(&self) -> Caught {
        let [latch1, latch2] = self.caught;
        Caught { latch1, latch2 }
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<Caught> {
        let Some(left) = self.left.checked_sub(1) else { return Progress::Failed { error: Failure::TimedOut } };
        self.left = left;
        let pending = Progress::Pending { left };
        // The one that is still to be caught; both are only at the end, which has been said then.
        let place = usize::from(!self.is_awaited(0));
        let type_code = if self.stage == Stage::Arming { self.arm } else { homing::LATCH_STATE };
        let (selections, monitor_sel) = (self.selections, LPOS.get(place).copied().unwrap_or(0));
        match self.ask.receive_with(axis, |axis| axis.ask_latch(type_code, selections, monitor_sel)) {
            Progress::Done { value: NonCyclicResponse::Homing { latch, monitor_data, .. } } => {
                self.read(latch, place, monitor_data);
                let all = !self.is_awaited(0) && !self.is_awaited(1);
                if all { Progress::Done { value: self.caught() } } else { pending }
            }
            // A drive that knows the state only after arming.
            Progress::Failed { error: Failure::Execution | Failure::CommandError(_) }
                if self.stage == Stage::Before =>
            {
                self.stage = Stage::Arming;
                pending
            }
            Progress::Done { .. } | Progress::Pending { .. } => pending,
            Progress::Failed { error } => Progress::Failed { error },
        }
    }

    fn is_awaited(&self, place: usize) -> bool {
        self.wanted.get(place) == Some(&true) && self.caught.get(place) == Some(&None)
    }

    /// Takes an answer that holds the `data` of the latch at `place`.
    fn read(&mut self, latch: LatchFlags, place: usize, data: i32) {
        if self.stage == Stage::Watching {
            let mut latches = self.caught.iter_mut().zip(COMP).zip(self.fresh);
            if let Some(((caught, flag), true)) = latches.nth(place) {
                if latch.contains(flag) {
                    *caught = Some(data);
                }
            }
        }
        for (fresh, flag) in self.fresh.iter_mut().zip(COMP) {
            *fresh |= !latch.contains(flag);
        }
        self.stage = match self.stage {
            Stage::Before => Stage::Arming,
            Stage::Arming | Stage::Watching => Stage::Watching,
        };
    }
}
