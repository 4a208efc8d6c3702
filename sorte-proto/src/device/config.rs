//! The settings and counters of a device.

use super::heard::PortId;
use crate::clock::AVERAGE;
use crate::discovery::Entry;
use crate::error::Error;
use crate::line_delay::DelayModel;
use crate::tally::Tally;
use crate::timing::Slots;

/// The settings of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Config {
    /// Lengths of its process data.
    pub lengths: Entry,
    /// Number of output bytes in the master frame; `None` for the number that DISCOVERY counted.
    pub output_len: Option<u16>,
    /// Cycle of the IO exchange in ns; `None` for the cycle in PARAM. The published device runs at 4000 whatever PARAM says,
    /// and its master says 10,000.
    pub cycle_ns: Option<u32>,
    /// When it sends its own frame: must be the same at the master and at every device.
    pub slots: Slots,
    /// How long before the send time [`Action::Send`](super::Action::Send) is returned, in ns: the time that the port needs to
    /// take the frame.
    pub lead_ns: u32,
    /// Longest time from the end of a frame of the exchange until it is handed over, in ns. After that the frame counts as
    /// lost.
    pub hand_over_ns: u32,
    /// How far from its expected time a master frame of the exchange may begin, and how far its time stamp may be off, in ns.
    pub window_ns: u16,
    /// Accepts DISCOVERY frames until the first PARAM, for a master that repeats the last DISCOVERY, see
    /// [`master::Config::patient_discovery`](crate::master::Config::patient_discovery). An extension of this crate.
    pub patient_discovery: bool,
    /// How the line to the next device is measured.
    pub delay_model: DelayModel,
    /// Number of frames averaged for a correction of the clock: a longer average is steadier but follows a drift more slowly.
    pub clock_average: u8,
    /// Cycle starts without a frame that a device in IO exchange tolerates.
    pub missed_frames: u8,
    /// Longest time that a start-up state waits for its frame, in ns.
    pub start_up_timeout_ns: u64,
}

impl Config {
    /// Creates the settings of the reference design. Time-outs, windows and `lead_ns` are chosen by this crate; the published
    /// device has none.
    pub const fn new() -> Self {
        Self {
            lengths: Entry::STOCK,
            output_len: Some(16),
            cycle_ns: None,
            slots: Slots::Published,
            lead_ns: 400,
            hand_over_ns: 1000,
            window_ns: 250,
            patient_discovery: false,
            delay_model: DelayModel::DEVICE,
            clock_average: AVERAGE,
            missed_frames: 5,
            start_up_timeout_ns: 20_000_000,
        }
    }
    servowire_core::builder! {
        with_lengths: lengths, Entry;
        with_output_len: output_len, Option<u16>;
        with_cycle_ns: cycle_ns, Option<u32>;
        with_slots: slots, Slots;
        with_lead_ns: lead_ns, u32;
        with_hand_over_ns: hand_over_ns, u32;
        with_window_ns: window_ns, u16;
        with_patient_discovery: patient_discovery, bool;
        with_delay_model: delay_model, DelayModel;
        with_clock_average: clock_average, u8;
        with_missed_frames: missed_frames, u8;
        with_start_up_timeout_ns: start_up_timeout_ns, u64;
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}

/// What a device counts, at both ports together and at each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Counters {
    /// Good frames.
    pub good_frames: u64,
    /// Frames with a wrong checksum.
    pub crc_errors: u64,
    /// Frames refused for another reason.
    pub format_errors: u64,
    /// How many times the device went back to IDLE.
    pub retrains: u64,
    /// Master frames of the exchange that were missing, came twice or came at the wrong time.
    pub master: Tally,
    /// Of these, at [`PortId::A`].
    pub a: PortCounters,
    /// Of these, at [`PortId::B`].
    pub b: PortCounters,
}

servowire_core::one_line!(Counters {
    Self { good_frames, crc_errors, format_errors, retrains, master, .. } =>
        "{} good frames, {} bad checksums, {} other refusals, {} restarts; master frames: {}",
        good_frames, crc_errors, format_errors, retrains, master;
});

/// What a device counts at one of its ports. A port that forwards in hardware counts no frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PortCounters {
    /// Good frames.
    pub good_frames: u64,
    /// Frames with a wrong checksum.
    pub crc_errors: u64,
    /// Frames refused for another reason.
    pub format_errors: u64,
}

impl Counters {
    pub(super) const ZERO: Self = {
        const PORT: PortCounters = PortCounters { good_frames: 0, crc_errors: 0, format_errors: 0 };
        Self { good_frames: 0, crc_errors: 0, format_errors: 0, retrains: 0, master: Tally::ZERO, a: PORT, b: PORT }
    };

    /// Counts a frame at `port`, good or refused.
    pub(super) fn count(&mut self, port: PortId, result: Result<(), Error>) {
        let at = match port {
            PortId::A => &mut self.a,
            PortId::B => &mut self.b,
        };
        for counter in match result {
            Ok(()) => [&mut self.good_frames, &mut at.good_frames],
            Err(Error::BadFcs { .. } | Error::BadCrc8 { .. }) => [&mut self.crc_errors, &mut at.crc_errors],
            Err(_) => [&mut self.format_errors, &mut at.format_errors],
        } {
            *counter = counter.saturating_add(1);
        }
    }
}
