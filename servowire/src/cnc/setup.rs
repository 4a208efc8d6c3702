//! The parts of the machine, and the one plan that they all share.

use sorte_proto::timing::{CNC_CYCLE_NS, Slots, Timing};
use sorte_proto::{DelayModel, Parameters, device, master};

use super::axis::Build;
use super::driver::Fault;
use super::wires::Physics;

/// Number of devices in a cycle of 4 us, for which the published send times are made.
const PUBLISHED: usize = 4;

#[derive(Debug, Clone)]
pub(super) struct Setup {
    pub(super) cables_ns: Vec<u16>,
    /// Cycle of the IO exchange; `None`: the shortest that the line allows.
    pub(super) cycle_ns: Option<u32>,
    pub(super) build: Build,
    pub(super) physics: Physics,
    /// Largest error of the crystals, and its largest change per second.
    pub(super) crystal_ppm: f64,
    pub(super) drift_ppm: f64,
    /// The cable before this device (from 1) is unplugged in this cycle.
    pub(super) unplug: Option<(usize, u64)>,
    /// This happens to the driver of this device (from 1) in this cycle.
    pub(super) driver_fault: Option<(usize, u64, Fault)>,
    /// Positions travel in the command words.
    pub(super) positions: bool,
    /// A damaged DISCOVERY is sent again.
    pub(super) patient: bool,
    pub(super) max_lag: u16,
    pub(super) seed: u64,
}

impl Setup {
    /// Returns the line planned by the rule.
    fn ruled(&self) -> Timing<'_> {
        let devices = self.cables_ns.len();
        Timing::new(&self.cables_ns, devices as u8)
            .with_output_len((devices * 4).max(16) as u16)
            .with_jitter_ps((self.physics.hop_jitter_ns * 1000.0).round() as u32)
    }

    /// Returns the line as all its parts see it: with the published send times if they fit, otherwise by the rule.
    pub(super) fn timing(&self) -> Timing<'_> {
        let ruled = self.ruled();
        let published = ruled.with_slots(Some(Slots::Published));
        let fits = self.cables_ns.len() <= PUBLISHED
            && self.cycle_ns.is_none_or(|cycle_ns| cycle_ns == CNC_CYCLE_NS)
            && published.misfit(CNC_CYCLE_NS - self.margin_ns()).is_none();
        if fits { published } else { ruled.with_slots(Some(ruled.slots())) }
    }

    /// Clocks are off by 2 ns per device.
    fn margin_ns(&self) -> u32 {
        2 * self.cables_ns.len() as u32
    }

    /// Returns the cycle of the IO exchange: whole periods of the generator, with a margin for the clocks.
    pub(super) fn cycle_ns(&self) -> u32 {
        let needs = self.timing().budget().min_cycle_ns() + self.margin_ns();
        self.cycle_ns.unwrap_or(needs.div_ceil(CNC_CYCLE_NS) * CNC_CYCLE_NS)
    }

    /// Returns whether the delay field of SYNC is too short, so that this project's extension is needed.
    pub(super) fn is_long(&self) -> bool {
        let out_ns: u64 = self.cables_ns.iter().map(|ns| u64::from(*ns) + 355).sum();
        out_ns > u64::from(u16::MAX)
    }

    pub(super) fn master(&self) -> master::Config {
        let timing = self.timing();
        master::Config::new()
            .with_parameters(Parameters::CNC)
            .with_cycle_ns(self.cycle_ns())
            .with_slots(timing.slots())
            .with_jitter_ps(timing.jitter_ps)
            .with_long_line(self.is_long())
            .with_patient_discovery(self.patient)
            .with_stop_cycles(25_000)
            .with_max_failures(20)
    }

    pub(super) fn device(&self) -> device::Config {
        let timing = self.timing();
        let config = device::Config::new()
            .with_output_len(Some(timing.output_len))
            .with_slots(timing.slots())
            .with_patient_discovery(self.patient);
        if timing.slots() == Slots::Published {
            return config;
        }
        // In a long line what the published measurement loses in each hop would add up to microseconds, and in a long cycle
        // sixteen frames are far apart.
        let frames = (64_000 / self.cycle_ns()).clamp(1, 16) as u8;
        config.with_clock_average(frames).with_delay_model(DelayModel { shift_samples: false, ..DelayModel::DEVICE })
    }
}
