//! States, settings and counters of the master.

use crate::line_delay::DelayModel;
use crate::param::Parameters;
use crate::tally::Tally;
use crate::timing::{JITTER_PS, Slots};

servowire_core::codes! {
    /// State of the master, by the codes that the published one shows to its host: the low three bits of its status register,
    /// in which 7 is undefined.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum State: u8 {
        /// Waits for link and enable, or until the pause after a failure has ended.
        #[default]
        Idle = 0 => "IDLE",
        /// Counts the devices.
        Discovery = 1 => "DISCOVERY",
        /// Sends the parameters to the devices.
        Param = 2 => "PARAM",
        /// Measures the line to the first device.
        LineDelay = 3 => "LINE_DELAY",
        /// Sets the devices' clocks.
        Sync = 4 => "SYNC",
        /// Exchanges data.
        Exchange = 5 => "IOEX",
        /// Has failed too often and waits until the host clears the enable bit and sets it again.
        Error = 6 => "ERROR",
    }
}

/// How a master behaves. The counts are those of the published image; the time-outs are chosen by this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Config {
    /// Number of DISCOVERY frames, at least 2: devices take part from the second one onwards.
    pub discovery_frames: u16,
    /// A damaged answer to DISCOVERY does not end the phase: frames are sent until two answers in a row report the same
    /// line, then the last frame is sent until it comes back whole. The devices need
    /// [`device::Config::patient_discovery`](crate::device::Config::patient_discovery) too: a published device that has
    /// received the last frame lets its repetitions pass without being counted. An extension of this crate; the published
    /// master starts again.
    pub patient_discovery: bool,
    /// Maximum number of DISCOVERY frames, if the master is patient.
    pub discovery_tries: u16,
    /// Number of PARAM frames that must be answered.
    pub param_frames: u16,
    /// SYNC frames.
    pub sync_frames: u16,
    /// Period of DISCOVERY, PARAM and DELAY_REQ frames in ns.
    pub frame_period_ns: u64,
    /// Period of SYNC frames in ns.
    pub sync_period_ns: u32,
    /// Period of the IO exchange in ns.
    pub cycle_ns: u32,
    /// Longest time that a delay request or the last SYNC frame may take to come back, in ns.
    pub answer_timeout_ns: u64,
    /// Number of PARAM frames in a row that may remain unanswered.
    pub param_tries: u16,
    /// Pause after a failure in ns, so that the devices' start-up states time out.
    pub restart_pause_ns: u64,
    /// How long before its send time a frame is returned, in ns: the time that the port needs to take it, if the port sends
    /// at a set time by itself. With 0, a frame is to be sent as soon as it is returned.
    pub lead_ns: u32,
    /// Number of devices that DISCOVERY must find.
    pub min_devices: u8,
    /// Minimum number of output bytes of the master frame; 16 keeps all axes in the same cycle however many there are.
    pub min_output_len: u16,
    /// Number of payload bytes in a device frame.
    pub payload_len: u8,
    /// Parameters sent to the devices. The published master says 10 us and exchanges every 4 us; here both use the same cycle.
    pub parameters: Parameters,
    /// When the devices send: must be the same as at the devices.
    pub slots: Slots,
    /// Rms jitter of each port of the line, in ps.
    pub jitter_ps: u32,
    /// How far from its expected time a device frame may begin, in ns. For each device that it passes, 16 ns are added to cover
    /// what the published measurement of the line loses. The published send times depend on the cables, of which the master
    /// knows only the mean.
    pub window_ns: u16,
    /// How the line to the first device is measured.
    pub delay_model: DelayModel,
    /// Number of cycles in a row with a damaged device frame after which the master restarts; 0 for never.
    pub retrain_crc_errors: u8,
    /// Number of cycles in a row with a missing device frame after which the master restarts; 0 for never.
    pub retrain_timing_errors: u8,
    /// Number of cycles of the IO exchange in which the axes can come to rest before the master restarts; with 0 it restarts at
    /// once, and running motors stop dead.
    pub stop_cycles: u32,
    /// Number of failures in a row, without an IO exchange of 1000 cycles between them, after which the master stays in
    /// [`State::Error`]; with 0 it retries for ever.
    pub max_failures: u16,
    /// The line may be longer than the delay field of SYNC can express: an extension of this crate, see
    /// [`Sync::long_delay_ns`](crate::Sync::long_delay_ns). The master then sends its SYNC period in PARAM.
    pub long_line: bool,
}

impl Config {
    /// Creates the settings with the published master's counts and times, and this crate's time-outs.
    pub const fn new() -> Self {
        Self {
            discovery_frames: 10,
            patient_discovery: false,
            discovery_tries: 1000,
            param_frames: 10,
            sync_frames: 1024,
            frame_period_ns: 1_000_000,
            sync_period_ns: 10_000,
            cycle_ns: 4000,
            answer_timeout_ns: 1_000_000,
            param_tries: 10,
            restart_pause_ns: 30_000_000,
            lead_ns: 0,
            min_devices: 1,
            min_output_len: 16,
            payload_len: 3,
            parameters: Parameters::CNC,
            slots: Slots::Published,
            jitter_ps: JITTER_PS,
            window_ns: 500,
            delay_model: DelayModel::MASTER,
            retrain_crc_errors: 3,
            retrain_timing_errors: 3,
            stop_cycles: 0,
            max_failures: 0,
            long_line: false,
        }
    }

    /// Sets the period of the IO exchange in ns, which is also sent to the devices.
    #[must_use]
    pub const fn with_cycle_ns(self, cycle_ns: u32) -> Self {
        Self { cycle_ns, parameters: Parameters { cycle_time_ns: cycle_ns, ..self.parameters }, ..self }
    }

    servowire_core::builder! {
        with_discovery_frames: discovery_frames, u16;
        with_patient_discovery: patient_discovery, bool;
        with_discovery_tries: discovery_tries, u16;
        with_param_frames: param_frames, u16;
        with_sync_frames: sync_frames, u16;
        with_frame_period_ns: frame_period_ns, u64;
        with_sync_period_ns: sync_period_ns, u32;
        with_answer_timeout_ns: answer_timeout_ns, u64;
        with_param_tries: param_tries, u16;
        with_restart_pause_ns: restart_pause_ns, u64;
        with_lead_ns: lead_ns, u32;
        with_min_devices: min_devices, u8;
        with_min_output_len: min_output_len, u16;
        with_payload_len: payload_len, u8;
        with_parameters: parameters, Parameters;
        with_slots: slots, Slots;
        with_jitter_ps: jitter_ps, u32;
        with_window_ns: window_ns, u16;
        with_delay_model: delay_model, DelayModel;
        with_retrain_crc_errors: retrain_crc_errors, u8;
        with_retrain_timing_errors: retrain_timing_errors, u8;
        with_stop_cycles: stop_cycles, u32;
        with_max_failures: max_failures, u16;
        with_long_line: long_line, bool;
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}

/// What the master counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Counters {
    /// Cycles of the IO exchange.
    pub cycles: u64,
    /// Frames with a wrong checksum.
    pub crc_errors: u64,
    /// Cycles in which a device frame was missing.
    pub timing_errors: u64,
    /// Frames refused for another reason.
    pub format_errors: u64,
    /// Device frames with the ERROR bit: a device has seen a wrong checksum.
    pub device_errors: u64,
    /// How many times the master went back to IDLE.
    pub retrains: u64,
    /// Cycles of the IO exchange that were skipped because [`Master::poll`](super::Master::poll) was called after their
    /// time.
    pub skipped_cycles: u64,
    /// Device frames that were missing, came twice, or came at the wrong time; for each device in
    /// [`Master::tally`](super::Master::tally).
    pub frames: Tally,
}

impl core::fmt::Display for Counters {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { cycles, crc_errors, timing_errors, format_errors, device_errors, retrains, skipped_cycles, frames } =
            self;
        write!(
            f,
            "{cycles} cycles, {skipped_cycles} left out, {timing_errors} with a frame missing; {crc_errors} bad checksums, "
        )?;
        write!(
            f,
            "{format_errors} other refusals, {device_errors} device errors, {retrains} restarts; device frames: {frames}"
        )
    }
}
