//! Step pulses from PTO words: the interrupt handler that programs the SYNC0 output of the IEP timer.
//!
//! The IEP counts 0, 5, .. 3995 ns and starts again. A compare event CMP1 starts the SYNC0 unit: `START + 1` ticks of
//! 5 ns later the output rises and stays high for 2000 ns. It does this once. Then it must be armed again by writing
//! SYNC_CTRL, which also cuts a pulse that is still high. Three events call the handler:
//!
//! ```text
//!  CMP0  3995 ns  the counter wraps
//!  CMP7  2000 ns  new data: the PTO word for the next cycle
//!  CMP6  moved    the pulse is over: disable CMP1 and CMP6, arm again
//!
//!  cycle n            cycle n+1          cycle n+2
//!  |-------CMP7------|------------------|---
//!          |  `late`: CMP1 = 3990, START = PTO / 5
//!          |         CMP1 ____pulse____
//!          |             |             |CMP6
//! ```
//!
//! A pulse is normally programmed *late* in the cycle before it. If the previous pulse is still running, the new one has to
//! be programmed in its own cycle, by CMP0 or CMP6 (*now*: CMP1 = PTO).
//!
//! [`Variant::Published`] does what the published device does, register write for register write; with steps 4 us
//! apart and random phases some 5 to 7 % of the pulses come a cycle late or not at all. [`Variant::Lossless`] keeps every
//! step, as long as the last register write for an event is made less than 600 ns after it and steps are at least 4000 ns
//! apart. The CMP6 handler with a deferred pulse makes the most writes, seven: with `w` ns for each, latency + 7 w < 600.
//!
//! Events that are pending together are served in the order CMP6, CMP0, CMP7.
//!
//! ```
//! use sorte_proto::StartTime;
//! use sorte_proto::sync0::{Register, Sync0, Write};
//! let mut sync0 = Sync0::default();
//! let writes: Vec<Write> = sync0.cmp7(StartTime::new(600)).into_iter().collect();
//! assert_eq!(writes, [
//!     Write { register: Register::SyncStart, value: 120 },
//!     Write { register: Register::Cmp6, value: 2600 },
//!     Write { register: Register::Cmp1, value: 3990 },
//!     Write { register: Register::CmpCfg, value: 0x107 },
//! ]);
//! ```

use crate::pto::StartTime;

/// Width of the pulse in ns: PWIDTH = 399.
pub const PULSE_NS: u16 = 2000;
/// CMP7: when the handler takes new data, in ns of the cycle.
pub const CMP7_NS: u16 = 2000;
/// CMP1 of a pulse programmed late, in ns: two ticks before the next cycle.
pub const LATE_CMP1_NS: u16 = 3990;
/// The longest time from an event to the last of its register writes for which [`Variant::Lossless`] is proved to lose no
/// step, in ns.
///
/// The proof is a walk over all phases of a step at every latency in ticks of 5 ns, over pairs of phases, and over writes
/// of 0 to 60 ns as events of their own, against the timer of [`iep`](crate::iep). At 600 ns the same walk loses steps: a
/// pulse that ends 3386 ns into the cycle leaves 604 ns until CMP1 of the pulse deferred after it.
pub const MAX_LATENCY_NS: u16 = 590;

/// CMP_CFG of an idle output: CMP0 resets the counter, CMP0 and CMP7 are enabled. Bit n+1 enables CMPn.
pub const CMP_CFG_IDLE: u16 = 0x103;
const CMP1_ENABLED: u16 = 1 << 2;
const CMP6_ENABLED: u16 = 1 << 7;

/// A pulse that ends at or after this time overlaps the next cycle, according to the state machine.
const OVERLAP_NS: u16 = 3390;
/// The lossless machine does not place CMP6 before this time: CMP0's handler must have enabled it.
const EARLIEST_CMP6_NS: u16 = 600;

/// The handler to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Variant {
    /// The handler of the published device, which loses steps.
    Published,
    /// The handler of this crate.
    #[default]
    Lossless,
}

/// Flags between the events, with the names and bits of the published status word. Bits 4 to 6 of that word are the events
/// themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Flags(u16);

bitflags::bitflags! {
    impl Flags: u16 {
        /// A pulse is programmed and has not ended.
        const PENDING_PULSE = 1 << 0;
        /// A pulse has been ordered and is not yet programmed.
        const ACTIVE_PULSE = 1 << 1;
        /// The coming wrap must not yet enable CMP6.
        const DELAYED_CMP6_ACTIVATED = 1 << 3;
        /// The pulse ordered last ends in the cycle after its own.
        const SYNC_PULSE_OVERLAP = 1 << 7;
        /// The pulse programmed last ends in the cycle after its own.
        const PREV_SYNC_PULSE_OVERLAP = 1 << 8;
    }
}

servowire_core::show_flags!(Flags);

impl Flags {
    /// Returns the flags with `flag` set or cleared.
    const fn with(self, flag: Self, on: bool) -> Self {
        if on { self.union(flag) } else { self.difference(flag) }
    }
}

/// A register of the IEP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Register {
    /// CMP_CFG: which compare events are enabled.
    CmpCfg,
    /// CMP1 in ns: starts SYNC0.
    Cmp1,
    /// CMP6 in ns: the end of the pulse.
    Cmp6,
    /// START of SYNC0 in ticks of 5 ns after CMP1, less one.
    SyncStart,
    /// SYNC_CTRL: 2 stops SYNC0, 3 arms it.
    SyncCtrl,
}

/// A value for a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Write {
    /// Where.
    pub register: Register,
    /// What.
    pub value: u16,
}

servowire_core::one_line!(Register {
    Self::CmpCfg => "CMP_CFG";
    Self::Cmp1 => "CMP1";
    Self::Cmp6 => "CMP6";
    Self::SyncStart => "SYNC_START";
    Self::SyncCtrl => "SYNC_CTRL";
});

servowire_core::one_line!(Write { Self { register, value } => "{} = {}", register, value; });

/// The writes that are made first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Prelude {
    Nothing,
    /// CMP_CFG only.
    Enable,
    /// CMP_CFG, then SYNC_CTRL 2 and 3.
    Rearm,
}

/// How the pulse is programmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Program {
    Nothing,
    /// START, CMP6, CMP1, CMP_CFG: for the next cycle.
    Late,
    /// CMP6, CMP1, START, CMP_CFG: for the running cycle.
    Now,
}

/// The register writes of one event, in the order in which they must be made; at most seven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the registers have to be written"]
#[repr(align(4))] // copied in words
pub struct Writes {
    prelude: Prelude,
    program: Program,
    first_cfg: u16,
    start: u16,
    cmp6: u16,
    cmp1: u16,
    cfg: u16,
}

impl Writes {
    /// The writes of an event that has none.
    pub(crate) const NONE: Self =
        Self { prelude: Prelude::Nothing, program: Program::Nothing, first_cfg: 0, start: 0, cmp6: 0, cmp1: 0, cfg: 0 };
}

impl IntoIterator for Writes {
    type Item = Write;
    type IntoIter = WriteIter;

    fn into_iter(self) -> WriteIter {
        WriteIter { writes: self, at: 0 }
    }
}

/// The writes one by one.
#[derive(Debug, Clone)]
pub struct WriteIter {
    writes: Writes,
    at: u8,
}

impl Iterator for WriteIter {
    type Item = Write;

    fn next(&mut self) -> Option<Write> {
        let writes = &self.writes;
        let write = |register, value| Some(Write { register, value });
        let prelude = match writes.prelude {
            Prelude::Nothing => 0,
            Prelude::Enable => 1,
            Prelude::Rearm => 3,
        };
        let next = match (self.at.checked_sub(prelude), writes.program) {
            (None, _) if self.at == 0 => write(Register::CmpCfg, writes.first_cfg),
            (None, _) if self.at == 1 => write(Register::SyncCtrl, 2),
            (None, _) => write(Register::SyncCtrl, 3),
            (Some(0), Program::Late) | (Some(2), Program::Now) => write(Register::SyncStart, writes.start),
            (Some(1), Program::Late) | (Some(0), Program::Now) => write(Register::Cmp6, writes.cmp6),
            (Some(2), Program::Late) | (Some(1), Program::Now) => write(Register::Cmp1, writes.cmp1),
            (Some(3), Program::Late | Program::Now) => write(Register::CmpCfg, writes.cfg),
            _ => return None,
        };
        self.at = self.at.saturating_add(1);
        next
    }
}

/// The SYNC0 generator: flags, the pulse on order, and the last value written to CMP_CFG.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(align(4))] // copied in words
pub struct Sync0 {
    variant: Variant,
    flags: Flags,
    /// Start of the pulse ordered last in ns, its register value, and its CMP6.
    pto: u16,
    ticks: u16,
    new6: u16,
    cfg: u16,
}

impl Default for Sync0 {
    fn default() -> Self {
        Self::new(Variant::Lossless)
    }
}

impl Sync0 {
    /// Creates a generator with an idle output: CMP_CFG holds [`CMP_CFG_IDLE`], SYNC0 is armed.
    pub const fn new(variant: Variant) -> Self {
        Self { variant, flags: Flags::empty(), pto: 0, ticks: 0, new6: 0, cfg: CMP_CFG_IDLE }
    }

    /// The variant of the handler.
    pub const fn variant(&self) -> Variant {
        self.variant
    }

    /// The flags.
    pub const fn flags(&self) -> Flags {
        self.flags
    }

    /// Handles CMP6: the pulse has ended.
    pub const fn cmp6(&mut self) -> Writes {
        self.cfg &= !(CMP1_ENABLED | CMP6_ENABLED);
        self.flags = self.flags.with(Flags::PENDING_PULSE, false);
        let mut writes = Writes { prelude: Prelude::Rearm, first_cfg: self.cfg, ..Writes::NONE };
        if self.flags.contains(Flags::ACTIVE_PULSE) {
            if self.flags.contains(Flags::PREV_SYNC_PULSE_OVERLAP) {
                self.program_now(&mut writes);
            } else if matches!(self.variant, Variant::Lossless) {
                self.program_late(&mut writes);
            }
        }
        writes
    }

    /// Handles CMP0: the counter wraps.
    pub const fn cmp0(&mut self) -> Writes {
        let mut writes = Writes::NONE;
        if self.flags.contains(Flags::DELAYED_CMP6_ACTIVATED) {
            self.flags = self.flags.with(Flags::DELAYED_CMP6_ACTIVATED, false);
        } else if self.flags.contains(Flags::PENDING_PULSE) {
            self.cfg |= CMP6_ENABLED;
            writes.prelude = Prelude::Enable;
            writes.first_cfg = self.cfg;
        }
        let deferred = self.flags.contains(Flags::ACTIVE_PULSE) && !self.flags.contains(Flags::PREV_SYNC_PULSE_OVERLAP);
        if deferred && matches!(self.variant, Variant::Published) {
            self.program_now(&mut writes);
        }
        writes
    }

    /// Handles CMP7, new data: `start` is the start of the pulse in the next cycle, [`Pto::start`](crate::pto::Pto::start)
    /// of the device's word.
    pub const fn cmp7(&mut self, start: Option<StartTime>) -> Writes {
        let mut writes = Writes::NONE;
        let Some(start) = start else {
            if matches!(self.variant, Variant::Published) {
                self.flags = self.flags.with(Flags::PREV_SYNC_PULSE_OVERLAP, false);
            }
            return writes;
        };
        self.flags = self.flags.with(Flags::ACTIVE_PULSE, true);
        self.pto = start.ns();
        self.ticks = start.ticks();
        // At most 3990 + 2000.
        let end = self.pto.wrapping_add(PULSE_NS);
        self.flags = self.flags.with(Flags::SYNC_PULSE_OVERLAP, end >= OVERLAP_NS);
        self.new6 = match (self.variant, end >= OVERLAP_NS) {
            (_, false) => end,
            // Never 0: that event would be lost in the wrap.
            (Variant::Published, true) if end == OVERLAP_NS => 10,
            (Variant::Published, true) => end.wrapping_sub(OVERLAP_NS),
            (Variant::Lossless, true) if end < LATE_CMP1_NS + EARLIEST_CMP6_NS => EARLIEST_CMP6_NS,
            (Variant::Lossless, true) => end.wrapping_sub(LATE_CMP1_NS),
        };
        if !self.flags.contains(Flags::PENDING_PULSE) {
            self.program_late(&mut writes);
        }
        writes
    }

    /// Programs a pulse for the next cycle.
    const fn program_late(&mut self, writes: &mut Writes) {
        let overlap = self.flags.contains(Flags::SYNC_PULSE_OVERLAP);
        self.flags = self.flags.with(Flags::PREV_SYNC_PULSE_OVERLAP, overlap);
        if overlap {
            self.flags = self.flags.with(Flags::DELAYED_CMP6_ACTIVATED, true);
        }
        self.cfg |= CMP1_ENABLED;
        self.programmed(writes, Program::Late, self.ticks, LATE_CMP1_NS);
    }

    /// Programs a pulse for the running cycle.
    const fn program_now(&mut self, writes: &mut Writes) {
        let overlap = self.flags.contains(Flags::SYNC_PULSE_OVERLAP);
        self.flags = self.flags.with(Flags::PREV_SYNC_PULSE_OVERLAP, overlap);
        self.cfg |= if overlap { CMP1_ENABLED } else { CMP1_ENABLED | CMP6_ENABLED };
        self.programmed(writes, Program::Now, 0, self.pto);
    }

    const fn programmed(&mut self, writes: &mut Writes, program: Program, start: u16, cmp1: u16) {
        self.flags = self.flags.with(Flags::ACTIVE_PULSE, false);
        self.flags = self.flags.with(Flags::PENDING_PULSE, true);
        writes.program = program;
        writes.start = start;
        writes.cmp6 = self.new6;
        writes.cmp1 = cmp1;
        writes.cfg = self.cfg;
    }
}

#[cfg(test)]
mod tests;
