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

/// Phase of the control function. PH_INIT is 0, so that cleared memory is the right start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum Phase {
    /// PH_INIT.
    #[default]
    Init = 0,
    /// PH_WAITING: for the ring.
    Waiting = 1,
    /// PH_PREPARE: for the first transmit data.
    Prepare = 2,
    /// PH_START: for cyclic transmission.
    Start = 3,
    /// PH_RUNNING.
    Running = 4,
}

impl Phase {
    /// All, in order.
    pub const ALL: [Self; 5] = [Self::Init, Self::Waiting, Self::Prepare, Self::Start, Self::Running];
}

/// A fault that stops the phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Fault {
    /// The slaves found are not those of the table, or a MAC-ID is there twice. It stays until the system is reset.
    SlaveInfoMismatch,
    /// Reception stopped in PH_RUNNING.
    Timeout,
}

/// What a step of the phases looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
/// At most one transition a step, no way back, and nothing moves once there is a fault. The names of the phases
/// and the two faults are from the System Design Guide for Master; its figures of the transitions were not
/// available, so the conditions are this crate's reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PhaseControl {
    phase: Phase,
    fault: Option<Fault>,
}

impl PhaseControl {
    /// In PH_INIT.
    pub const fn new() -> Self {
        Self { phase: Phase::Init, fault: None }
    }

    /// The present phase.
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// The fault, if there is one.
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// One step; call it from the main loop.
    pub const fn step(&mut self, inputs: Inputs) {
        if self.fault.is_some() {
            return;
        }
        match (self.phase, inputs.asic, inputs.slave_info) {
            (Phase::Init, Asic::Initial | Asic::RingConfig, _) => self.phase = Phase::Waiting,
            (Phase::Waiting, Asic::Ready, Some(SlaveInfo::Match)) => self.phase = Phase::Prepare,
            (Phase::Waiting, Asic::Ready, Some(SlaveInfo::Mismatch)) => self.fault = Some(Fault::SlaveInfoMismatch),
            (Phase::Prepare, _, _) if inputs.tx_ready => self.phase = Phase::Start,
            (Phase::Start, Asic::Running, _) => self.phase = Phase::Running,
            (Phase::Running, _, _) if inputs.timeout => self.fault = Some(Fault::Timeout),
            _ => {}
        }
    }

    /// Forgets a time-out, so that the ring can be cleared. A mismatch of the slaves stays: only a system reset releases it.
    pub const fn release_timeout(&mut self) {
        if matches!(self.fault, Some(Fault::Timeout)) {
            self.fault = None;
        }
    }
}
