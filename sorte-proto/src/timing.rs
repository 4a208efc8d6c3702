//! What fits into a cycle of the IO exchange.

use crate::address::DeviceAddress;
use crate::discovery::MAX_DEVICES;
use crate::sync::TRANSIT_NS;
pub use crate::sync::TRIGGER_NS;

/// One byte at 100 Mbit/s, in ns.
pub const BYTE_NS: u32 = 80;
/// Gap between two device frames on the way to the master, in ns.
pub const GAP_NS: u32 = 240;
/// Cycle time of the CNC machine, in ns.
pub const CNC_CYCLE_NS: u32 = 4000;

/// Rms jitter that a port adds to a frame, in ps: one that samples at 200 MHz, as the published hardware does, is off by 0 to 5 ns
/// (uniform: 5 ns / sqrt(12)). A port that re-times to the 25-MHz clock of its PHY has 11,547.
pub(crate) const JITTER_PS: u32 = 1443;

/// Send times of the published device in ns of the common time, for addresses 1, 2, 3, and 4 or more. They are tuned
/// by hand around the rule of [`Slots::Raster`].
///
/// ```
/// use sorte_proto::{DeviceAddress, timing::published_send_time_ns};
/// assert_eq!(published_send_time_ns(DeviceAddress::FIRST), 500);
/// ```
pub const fn published_send_time_ns(address: DeviceAddress) -> u32 {
    match address.get() {
        1 => 500,
        2 => 900,
        3 => 1360,
        _ => 1800,
    }
}

/// When the devices send. The planner, the master and the devices must all use the same rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Slots {
    /// [`published_send_time_ns`], which depends on the address alone: enough for four devices at 4 us, with up to 123 ns of
    /// cable before each.
    #[default]
    Published,
    /// Back to back at the master, whatever the cables: device `a` sends at `first_ns + (a - 1) x slot_ns` less its delay from
    /// the master, which it gets from SYNC.
    Raster {
        /// When the first device's frame begins at the master, in ns of the cycle. With 500 and the first line delay that device
        /// sends at 500 ns: the comment in the published source omits the line delay, which would make all frames that much
        /// earlier.
        first_ns: u32,
        /// From the start of one device's frame to the next one's, in ns: 880 for 3 payload bytes and a gap of 240 ns.
        slot_ns: u32,
    },
}

impl Slots {
    /// The rule behind the published table for 3 payload bytes, with the line delay of the first cable in ns.
    pub const fn rule(first_line_delay_ns: u16) -> Self {
        Self::Raster { first_ns: TRIGGER_NS.saturating_add(first_line_delay_ns as u32), slot_ns: 8 * BYTE_NS + GAP_NS }
    }

    /// When the device `address`, which is `delay_ns` away from the master, starts to send, in ns of its cycle. Below 0 it
    /// would have to send before the cycle begins, which no device does; [`Timing::misfit`] names it.
    pub(crate) const fn send_ns(self, address: DeviceAddress, delay_ns: u32) -> i64 {
        match self {
            Self::Published => published_send_time_ns(address) as i64,
            Self::Raster { first_ns, slot_ns } => {
                let slots = (slot_ns as i64).saturating_mul(address.hops_before() as i64);
                (first_ns as i64).saturating_add(slots).saturating_sub(delay_ns as i64)
            }
        }
    }
}

servowire_core::one_line!(Slots {
    Self::Published => "published send times";
    Self::Raster { first_ns, slot_ns } => "at the master from {} ns on, every {} ns", first_ns, slot_ns;
});

/// A line to plan: how many devices, how far apart, how many bytes, and who sends when.
///
/// ```
/// use sorte_proto::timing::Timing;
/// // Four devices, 85 ns of cable in front of each.
/// let line = Timing::new(&[85], 4);
/// assert_eq!((line.budget().min_cycle_ns(), line.misfit(4000)), (3865, None));
/// assert_eq!(line.misfit(3800).map(|misfit| misfit.device), Some(4));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Timing<'a> {
    /// Line delays in ns: master to device 1, device 1 to 2, ...; the last value applies to all devices after it. If this is
    /// empty, there is no delay.
    pub line_delays_ns: &'a [u16],
    /// Number of devices, 0..=254.
    pub devices: u8,
    /// Number of output bytes in the master frame: 4 for each device, or 16 always.
    pub output_len: u16,
    /// Payload bytes of each device frame: 3 in the reference design.
    pub payload_len: u16,
    /// When the devices send; `None` for the rule, with this line's first cable and payload.
    pub slots: Option<Slots>,
    /// Rms jitter of each port that a frame passes, in ps.
    pub jitter_ps: u32,
}

/// What limits a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Limit {
    /// The end of the master frame at the last device.
    MasterFrame,
    /// The end of the last device's frame at the master.
    DeviceFrames,
    /// The gap between two device frames.
    Gap,
    /// The send time of a device would be before its cycle.
    SendTime,
}

/// End times of one cycle, in ns from its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Budget {
    /// Bytes of the master frame with its two preamble bytes.
    pub master_frame_bytes: u32,
    /// End of the master frame at the master.
    pub master_sent_ns: u32,
    /// End of the master frame at the first device.
    pub master_frame_at_first_ns: u32,
    /// End of the master frame at the last device.
    pub master_frame_at_last_ns: u32,
    /// End of the last device's frame at the master.
    pub device_frames_at_master_ns: u32,
}

impl Budget {
    /// The shortest cycle, in ns.
    pub const fn min_cycle_ns(self) -> u32 {
        if self.master_frame_at_last_ns > self.device_frames_at_master_ns {
            self.master_frame_at_last_ns
        } else {
            self.device_frames_at_master_ns
        }
    }

    /// What prevents a shorter cycle.
    pub const fn limit(self) -> Limit {
        if self.master_frame_at_last_ns > self.device_frames_at_master_ns {
            Limit::MasterFrame
        } else {
            Limit::DeviceFrames
        }
    }

    /// Returns whether a cycle of `cycle_ns` is long enough.
    pub const fn fits(self, cycle_ns: u32) -> bool {
        self.min_cycle_ns() <= cycle_ns
    }

    /// Returns whether all devices act on the data of the same frame: their new-data event CMP7 comes before the first of
    /// them has received the whole frame, or after the last one has. Two devices with 8 output bytes and CMP7 at 2000 ns act
    /// one cycle apart; with 16 output bytes that cannot happen.
    pub const fn same_cycle(self, cmp7_ns: u32) -> bool {
        cmp7_ns < self.master_frame_at_first_ns || self.master_frame_at_last_ns < cmp7_ns
    }
}

impl<'a> Timing<'a> {
    /// Creates a line with four output bytes and three payload bytes for each device, send times by the rule, and ports
    /// like the published ones.
    pub const fn new(line_delays_ns: &'a [u16], devices: u8) -> Self {
        let output_len = (devices as u16).saturating_mul(4);
        Self { line_delays_ns, devices, output_len, payload_len: 3, slots: None, jitter_ps: JITTER_PS }
    }

    servowire_core::builder! {
        with_output_len: output_len, u16;
        with_payload_len: payload_len, u16;
        with_slots: slots, Option<Slots>;
        with_jitter_ps: jitter_ps, u32;
    }
}

impl Timing<'_> {
    /// When the devices send.
    pub fn slots(&self) -> Slots {
        self.slots.unwrap_or_else(|| {
            let first_ns = TRIGGER_NS.saturating_add(self.line_delay_ns(1));
            Slots::Raster { first_ns, slot_ns: self.slot_ns() }
        })
    }

    /// Line delay before device `address`, in ns.
    fn line_delay_ns(&self, address: u8) -> u32 {
        let index = usize::from(address.saturating_sub(1));
        let delays = self.line_delays_ns;
        delays.get(index).or(delays.last()).copied().map_or(0, u32::from)
    }

    /// Returns the devices, each with the time that a frame takes from the master to it, in ns: over the cables and the devices
    /// between.
    fn ways(&self) -> impl Iterator<Item = (DeviceAddress, u32)> + '_ {
        let addresses = (1..=self.devices.min(DeviceAddress::MAX.get())).filter_map(DeviceAddress::new);
        addresses.scan(0_u32, |way, address| {
            let transit = if address == DeviceAddress::FIRST { 0 } else { TRANSIT_NS.into() };
            *way = way.saturating_add(self.line_delay_ns(address.get())).saturating_add(transit);
            Some((address, *way))
        })
    }

    /// Time of one device frame with its two preamble bytes and the gap after it, in ns: 880 with 3 payload bytes.
    pub const fn slot_ns(&self) -> u32 {
        self.device_frame_ns().saturating_add(GAP_NS)
    }

    const fn device_frame_ns(&self) -> u32 {
        // Preamble 2, header 2, CRC 1.
        (self.payload_len as u32).saturating_add(5).saturating_mul(BYTE_NS)
    }

    /// Returns when device `address` starts to send, in ns of the cycle. `None` if the line has no such device.
    pub fn send_time_ns(&self, address: DeviceAddress) -> Option<i64> {
        let (_, way) = self.ways().find(|(device, _)| *device == address)?;
        Some(self.slots().send_ns(address, way))
    }

    /// 2 bytes of preamble, 2 of header, 1 of CRC, 2 of time stamp.
    const fn master_frame_bytes(&self) -> u32 {
        (self.output_len as u32).saturating_add(7)
    }

    const fn master_sent_ns(&self) -> u32 {
        TRIGGER_NS.saturating_add(self.master_frame_bytes().saturating_mul(BYTE_NS))
    }

    /// Returns the end, at the master, of a frame that a device sends at `send_ns`.
    const fn end_ns(&self, send_ns: i64, way_ns: u32) -> i64 {
        send_ns.saturating_add(way_ns as i64).saturating_add(self.device_frame_ns() as i64)
    }

    /// Returns the end times.
    pub fn budget(&self) -> Budget {
        let (slots, sent_ns) = (self.slots(), self.master_sent_ns());
        let (mut last_way, mut back) = (self.line_delay_ns(1), 0);
        for (address, way) in self.ways() {
            last_way = way;
            back = self.end_ns(slots.send_ns(address, way), way).max(back);
        }
        Budget {
            master_frame_bytes: self.master_frame_bytes(),
            master_sent_ns: sent_ns,
            master_frame_at_first_ns: sent_ns.saturating_add(self.line_delay_ns(1)),
            master_frame_at_last_ns: sent_ns.saturating_add(last_way),
            device_frames_at_master_ns: u32::try_from(back).unwrap_or(u32::MAX),
        }
    }

    /// Returns the smallest gap between two device frames, in ns, at which the frames of device `address` and of the one before
    /// it do not collide on the way. Each of the ports they pass adds its jitter to each frame, and six sigma of the
    /// difference must fit into the gap.
    pub(crate) fn least_gap_ns(&self, address: DeviceAddress) -> u32 {
        let jitter = u64::from(self.jitter_ps);
        let square = jitter.saturating_mul(jitter).saturating_mul(u64::from(address.hops_before())).saturating_mul(72);
        u32::try_from(square.isqrt().div_ceil(1000)).unwrap_or(u32::MAX)
    }
}

/// What does not fit, and for which device: the line must not be started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Misfit {
    /// The first device that does not fit.
    pub device: u8,
    /// What does not fit.
    pub limit: Limit,
    /// What this device needs, in ns: the length of the cycle, the gap before its frame, or the time before the cycle begins.
    pub needs_ns: u32,
    /// What is available, in ns. A gap below 0: the frame begins before the previous one has ended.
    pub has_ns: i32,
}

impl Timing<'_> {
    /// Returns the first device for which a cycle of `cycle_ns` is too short, whose frame comes too close to the one before, or
    /// which would have to send before its cycle. The devices are checked in the order of their addresses.
    pub fn misfit(&self, cycle_ns: u32) -> Option<Misfit> {
        let (slots, sent_ns) = (self.slots(), self.master_sent_ns());
        let mut line_free = None;
        self.ways().find_map(|(address, way)| {
            let send = slots.send_ns(address, way);
            let start = send.saturating_add(way.into());
            let gap = line_free.map_or(i64::MAX, |free| start.saturating_sub(free));
            let end = self.end_ns(send, way);
            line_free = Some(end);
            let (out, back) = (i64::from(sent_ns.saturating_add(way)), end);
            let least = self.least_gap_ns(address);
            let (limit, needs, has) = if send < 0 {
                (Limit::SendTime, send.saturating_neg(), 0)
            } else if gap < least.into() {
                (Limit::Gap, least.into(), gap)
            } else if out > back && out > cycle_ns.into() {
                (Limit::MasterFrame, out, cycle_ns.into())
            } else if back > cycle_ns.into() {
                (Limit::DeviceFrames, back, cycle_ns.into())
            } else {
                return None;
            };
            let needs_ns = u32::try_from(needs).unwrap_or(u32::MAX);
            // A gap below 0 is as long as a frame at most.
            let has_ns = i32::try_from(has).unwrap_or(i32::MAX);
            Some(Misfit { device: address.get(), limit, needs_ns, has_ns })
        })
    }

    /// Returns the shortest cycle that is a whole number of periods of the step pulse generator (4 us), in ns. A step word
    /// applies to the second period after the cycle that brought it, so a longer cycle means fewer steps per second, not longer
    /// pulses.
    pub fn cnc_cycle_ns(&self) -> u32 {
        self.budget().min_cycle_ns().max(1).div_ceil(CNC_CYCLE_NS).saturating_mul(CNC_CYCLE_NS)
    }
}

const _: () = assert!(MAX_DEVICES == DeviceAddress::MAX.get() as usize);

servowire_core::one_line!(Limit {
    Self::MasterFrame => "the way of the master frame";
    Self::DeviceFrames => "the device frames";
    Self::Gap => "the gap between two device frames";
    Self::SendTime => "the send time of a device";
});
servowire_core::one_line!(Misfit {
    Self { device, limit: Limit::Gap, needs_ns, has_ns } =>
        "the frame of device {} comes {} ns after the one before it, {} ns are needed", device, has_ns, needs_ns;
    Self { device, limit: Limit::SendTime, needs_ns, .. } =>
        "device {} would have to send {} ns before the cycle", device, needs_ns;
    Self { device, needs_ns, limit, .. } =>
        "the cycle is too short from device {} on, which needs {} ns for {}", device, needs_ns, limit;
});

impl core::error::Error for Misfit {}

#[cfg(test)]
mod tests;
