use super::slaves::SlaveInfo;

/// State of the communication ASIC, as the guide names it (INITIAL and READY are inferred names).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Asic {
    /// After reset.
    Initial,
    /// RING-CONFIG: sends Init-A and Init-B frames by itself, from its internal timer.
    RingConfig,
    /// The ring is closed.
    Ready,
    /// Cyclic transmission. Only in this state is the transmit-timing input (XTXTIM) used.
    Running,
}

servowire_core::codes! {
    /// Phase of the control function. PH_INIT is 0, so cleared memory starts correctly.
    #[derive(Default)]
    pub enum ControlPhase: u8 {
        /// The initial phase.
        #[default]
        Init = 0 => "PH_INIT",
        /// Waits for the ring.
        Waiting = 1 => "PH_WAITING",
        /// Waits for the first transmit data.
        Prepare = 2 => "PH_PREPARE",
        /// Waits for cyclic transmission.
        Start = 3 => "PH_START",
        /// Cyclic transmission runs.
        Running = 4 => "PH_RUNNING",
    }
}

/// Why the phases have stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum ControlError {
    /// The slaves found are not those in the table, or a MAC-ID occurs twice. It stays until the system is reset.
    SlaveInfoMismatch,
    /// Reception stopped in PH_RUNNING.
    Timeout,
}

servowire_core::one_line!(ControlError {
    Self::SlaveInfoMismatch => "the slaves are not those of the table";
    Self::Timeout => "nothing is received any more";
});

impl core::error::Error for ControlError {}

/// The inputs to a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Inputs {
    /// State of the ASIC.
    pub asic: Asic,
    /// Outcome of the comparison with the slave table, once it is known.
    pub slave_info: Option<SlaveInfo>,
    /// The first transmit data are written.
    pub tx_ready: bool,
    /// The echo watch, or the receive watchdog, has tripped.
    pub timeout: bool,
}

/// The phases of the control function.
///
/// ```text
///  PH_INIT ──► PH_WAITING ──► PH_PREPARE ──► PH_START ──► PH_RUNNING
///   ASIC is      ASIC READY,     first          ASIC         time-out ──► fault
///   INITIAL or   slaves match    transmit       RUNNING
///   RING-CONFIG  (else fault)    data written
/// ```
/// A step makes at most one transition, never back, and none once there is an error. The names of the phases
/// and the two errors are from the System Design Guide for Master; its diagrams of the transitions were not available, so the
/// conditions are this crate's interpretation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PhaseControl {
    phase: ControlPhase,
    error: Option<ControlError>,
}

impl PhaseControl {
    /// In PH_INIT.
    pub const fn new() -> Self {
        Self { phase: ControlPhase::Init, error: None }
    }

    /// The present phase.
    pub const fn phase(&self) -> ControlPhase {
        self.phase
    }

    /// Why the phases have stopped, if they have.
    pub const fn error(&self) -> Option<ControlError> {
        self.error
    }

    /// Makes one step; call it from the main loop.
    pub const fn step(&mut self, inputs: Inputs) {
        if self.error.is_some() {
            return;
        }
        match (self.phase, inputs.asic, inputs.slave_info) {
            (ControlPhase::Init, Asic::Initial | Asic::RingConfig, _) => self.phase = ControlPhase::Waiting,
            (ControlPhase::Waiting, Asic::Ready, Some(SlaveInfo::Match)) => self.phase = ControlPhase::Prepare,
            (ControlPhase::Waiting, Asic::Ready, Some(SlaveInfo::Mismatch)) => {
                self.error = Some(ControlError::SlaveInfoMismatch);
            }
            (ControlPhase::Prepare, _, _) if inputs.tx_ready => self.phase = ControlPhase::Start,
            (ControlPhase::Start, Asic::Running, _) => self.phase = ControlPhase::Running,
            (ControlPhase::Running, _, _) if inputs.timeout => self.error = Some(ControlError::Timeout),
            _ => {}
        }
    }

    /// Forgets a time-out, so that the ring can be cleared. A mismatch of the slaves stays: only a system reset releases it.
    pub(super) const fn release_timeout(&mut self) {
        if matches!(self.error, Some(ControlError::Timeout)) {
            self.error = None;
        }
    }
}
