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
    /// Cyclic transmission. Only now the transmit-timing input (XTXTIM) counts.
    Running,
}

servowire_core::codes! {
    /// Phase of the control function. PH_INIT is 0, so that cleared memory is the right start.
    #[derive(Default)]
    pub enum ControlPhase: u8 {
        /// At the start.
        #[default]
        Init = 0 => "PH_INIT",
        /// For the ring.
        Waiting = 1 => "PH_WAITING",
        /// For the first transmit data.
        Prepare = 2 => "PH_PREPARE",
        /// For cyclic transmission.
        Start = 3 => "PH_START",
        /// Cyclic transmission runs.
        Running = 4 => "PH_RUNNING",
    }
}

/// Why the phases stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum ControlError {
    /// The slaves found are not those of the table, or a MAC-ID is there twice. It stays until the system is reset.
    SlaveInfoMismatch,
    /// Reception stopped in PH_RUNNING.
    Timeout,
}

servowire_core::one_line!(ControlError {
    Self::SlaveInfoMismatch => "the slaves are not those of the table";
    Self::Timeout => "nothing is received any more";
});

impl core::error::Error for ControlError {}

/// What a step of the phases looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Inputs {
    /// State of the ASIC.
    pub asic: Asic,
    /// Outcome of the comparison with the slave table, once there is one.
    pub slave_info: Option<SlaveInfo>,
    /// The first transmit data are written.
    pub tx_ready: bool,
    /// The echo watch, or the receive watchdog, has tripped.
    pub timeout: bool,
}

/// The control function's phases.
///
/// ```text
///  PH_INIT ──► PH_WAITING ──► PH_PREPARE ──► PH_START ──► PH_RUNNING
///   ASIC is      ASIC READY,     first          ASIC         time-out ──► fault
///   INITIAL or   slaves match    transmit       RUNNING
///   RING-CONFIG  (else fault)    data written
/// ```
/// At most one transition a step, no way back, and nothing moves once there is an error. The names of the phases
/// and the two errors are from the System Design Guide for Master; its figures of the transitions were not
/// available, so the conditions are this crate's reading.
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

    /// One step; call it from the main loop.
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
