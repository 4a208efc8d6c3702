//! A complete master behind two calls: one in the interrupt, one in the main loop.

use core::num::NonZeroU16;

use super::axis::Axis;
use super::echo::ReceiveWatchdog;
use super::heard::Heard;
use super::led::{Led, led};
use super::phase::{Asic, ControlError, ControlPhase, Inputs, PhaseControl};
use super::ring::{Ring, SameMacId};
use super::slaves::{Slave, compare};
use super::state::StopReason;
use crate::block::BlockSize;
use crate::header::MacId;
use crate::pack::{self, SizeMismatch, Word};
use crate::sub::Command32;
use crate::timing::{Periods, TimerSystem};

/// The configuration of a master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MasterConfig {
    /// Size of the blocks, which is the same for all drives of a ring here.
    pub size: BlockSize,
    /// Communication and update period.
    pub periods: Periods,
    /// The timer that sets the pace.
    pub timer: TimerSystem,
    /// Number of update periods of invalid data (00h) in PH_RUNNING, before the first valid commands; 4 unless changed (the
    /// vendor's number is not known).
    pub invalid: u32,
    /// Number of update periods without [`Master::frame_received`] that count as a time-out; `None` if the receive interrupt
    /// is not used.
    pub watchdog: Option<NonZeroU16>,
}

impl MasterConfig {
    /// Creates a configuration without a receive watchdog.
    pub const fn new(size: BlockSize, periods: Periods, timer: TimerSystem) -> Self {
        Self { size, periods, timer, invalid: 4, watchdog: None }
    }

    servowire_core::builder! {
        with_invalid: invalid, u32;
        with_watchdog: watchdog, Option<NonZeroU16>;
    }
}

/// Why a master cannot be set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SetupError {
    /// Two axes have the same address.
    #[error(transparent)]
    SameMacId(#[from] SameMacId),
    /// The periods do not work with the timer system.
    #[error("the periods do not work with the timer system")]
    Timer,
    /// An axis is configured for a different update period.
    #[error("the axis of drive {mac_id} has a different update period")]
    UpdatePeriod {
        /// MAC-ID of the drive of the axis.
        mac_id: MacId,
    },
    /// The slave table does not list the axis at its place.
    #[error("the slave table does not list drive {mac_id} in the place of its axis")]
    Table {
        /// MAC-ID of the drive of the axis.
        mac_id: MacId,
    },
}

/// A master: phases, slave table, COM LED, receive watchdog and the ring of axes.
///
/// * The main loop calls [`control`](Self::control) with the state of the ASIC, and shows [`led`](Self::led).
/// * Interrupts stay off until [`is_running`](Self::is_running).
/// * The NC interrupt calls [`exchange`](Self::exchange) or [`exchange_words`](Self::exchange_words): it reads the blocks of the last reception and writes the next
///   commands, before anything else is calculated. In the external-timer system it comes from the host's timer, in the
///   internal-timer system from XSYNC.
/// * The receive interrupt (XINTRX), if used, calls [`frame_received`](Self::frame_received). External timer: its priority
///   is above that of the NC interrupt, and it switches the reception bank. Internal timer: its priority is below.
///
/// The exchange must end before the next frame starts. If it does not, the bank switch is delayed and the commands are sent
/// one communication period later ([`Periods::frames_late`]).
///
/// Outside PH_RUNNING an exchange writes invalid data (00h, counter 0) and ignores what was received. System Design Guide
/// for Master, chapters 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Master<const N: usize> {
    config: MasterConfig,
    table: [Slave; N],
    ring: Ring<N>,
    phases: PhaseControl,
    watchdog: Option<ReceiveWatchdog>,
    prepared: bool,
}

impl<const N: usize> Master<N> {
    /// Creates a master in PH_INIT.
    ///
    /// # Errors
    /// [`SetupError`]
    pub fn new(config: MasterConfig, table: [Slave; N], axes: [Axis; N]) -> Result<Self, SetupError> {
        let ring = Ring::new(axes, config.invalid)?;
        if !config.timer.allows(&config.periods) {
            return Err(SetupError::Timer);
        }
        for (slave, axis) in table.iter().zip(ring.axes()) {
            let axis = axis.config();
            if axis.update_ns != config.periods.update_ns {
                return Err(SetupError::UpdatePeriod { mac_id: axis.mac_id });
            }
            if axis.mac_id != slave.mac_id {
                return Err(SetupError::Table { mac_id: axis.mac_id });
            }
        }
        let watchdog = config.watchdog.map(ReceiveWatchdog::new);
        Ok(Self { config, table, ring, phases: PhaseControl::new(), watchdog, prepared: false })
    }

    /// Takes one turn of the main loop: the state of the ASIC, and the slaves found by the ring configuration, once they
    /// are known.
    pub fn control(&mut self, asic: Asic, found: Option<&[Slave]>) -> ControlPhase {
        let slave_info = found.map(|found| compare(&self.table, found));
        let timeout = self.is_timed_out();
        self.phases.step(Inputs { asic, slave_info, tx_ready: self.prepared, timeout });
        self.phases.phase()
    }

    /// Returns whether cyclic communication runs: enable interrupts only then.
    pub fn is_running(&self) -> bool {
        self.phases.phase() == ControlPhase::Running
    }

    /// The phase.
    pub const fn phase(&self) -> ControlPhase {
        self.phases.phase()
    }

    /// Why the phases have stopped, if they have.
    pub const fn error(&self) -> Option<ControlError> {
        self.phases.error()
    }

    /// Returns what the COM LED shows `t_ms` after the start of a lit half-period.
    pub fn led(&self, t_ms: u64) -> Led {
        led(self.phases.phase(), self.phases.error(), t_ms)
    }

    /// Returns its configuration.
    pub const fn config(&self) -> &MasterConfig {
        &self.config
    }

    /// Returns the ring, for reading.
    pub const fn ring(&self) -> &Ring<N> {
        &self.ring
    }

    /// Returns the ring, for set-points, requests, switching on and off. Leave its [`update`](Ring::update) to the exchange.
    pub const fn ring_mut(&mut self) -> &mut Ring<N> {
        &mut self.ring
    }

    /// Reports that a frame has come; call it from the receive interrupt. Returns whether the handler has to switch the
    /// reception bank, as in the external-timer system.
    pub const fn frame_received(&mut self) -> bool {
        if let Some(watchdog) = &mut self.watchdog {
            watchdog.frame_received();
        }
        self.config.timer.reception_first()
    }

    /// Makes the exchange with blocks that are already decoded and were heard until `end_ns`.
    pub fn exchange(&mut self, heard: &[Heard; N], end_ns: u64) -> [Command32; N] {
        if !self.is_running() {
            self.prepared |= self.phases.phase() == ControlPhase::Prepare;
            return self.ring.invalid();
        }
        if self.watchdog.as_mut().is_some_and(ReceiveWatchdog::tick) {
            self.ring.fail(StopReason::ReceiveTimeout);
        }
        let commands = self.ring.update(heard, end_ns);
        let timeout = self.is_timed_out();
        self.phases.step(Inputs { asic: Asic::Running, slave_info: None, tx_ready: true, timeout });
        commands
    }

    /// Makes the exchange over memory of bytes, or of 16- or 32-bit words packed as described in [`pack`](crate::pack), heard
    /// until `end_ns`: the blocks of all axes follow one another, in the order of the axes.
    ///
    /// # Errors
    /// [`SizeMismatch`] unless each memory has the size of all blocks; nothing is read or written.
    pub fn exchange_words<W: Word>(&mut self, rx: &[W], tx: &mut [W], end_ns: u64) -> Result<(), SizeMismatch> {
        let size = self.config.size;
        let bytes = size.bytes().saturating_mul(N);
        for words in [rx.len(), tx.len()] {
            if words.checked_mul(W::BYTES) != Some(bytes) {
                return Err(SizeMismatch { bytes, words });
            }
        }
        let words = size.bytes().checked_div(W::BYTES).unwrap_or(1);
        let mut all = [Heard::Nothing; N];
        for (heard, words) in all.iter_mut().zip(rx.chunks_exact(words)) {
            *heard = Heard::parse(size, words);
        }
        for (command, words) in self.exchange(&all, end_ns).iter().zip(tx.chunks_exact_mut(words)) {
            let block = command.emit();
            // The sizes are compared above.
            pack::to_words(block.get(..size.bytes()).unwrap_or_default(), words)?;
        }
        Ok(())
    }

    /// Leaves the stop after a time-out, an alarm or a stop by the caller: every axis waits for Servo_Ready again. A
    /// mismatch of the slaves stays until the system is reset.
    pub fn clear(&mut self) {
        self.ring.clear();
        self.phases.release_timeout();
        self.watchdog = self.config.watchdog.map(ReceiveWatchdog::new);
    }

    fn is_timed_out(&self) -> bool {
        self.ring.is_timed_out() || self.watchdog.is_some_and(ReceiveWatchdog::is_tripped)
    }
}
