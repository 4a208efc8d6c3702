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

/// Send times of the published device in ns of the common time, for addresses 1, 2, 3, and 4 or more. They are tuned
/// by hand around [`Timing::send_time_ns`].
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

/// A line to be timed: how many devices, how far from each other, how many bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Timing<'a> {
    /// Line delays in ns: master to device 1, device 1 to 2, ...; the last one stands for all after it. Empty: no delay.
    pub line_delays_ns: &'a [u16],
    /// Devices, 0..=254.
    pub devices: u8,
    /// Output bytes in the master frame: 4 for each device, or 16 always.
    pub output_len: u16,
    /// Payload of each device frame: 3 in the reference design.
    pub payload_len: u16,
}

/// What limits the cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Limit {
    /// The end of the master frame at the last device.
    MasterFrame,
    /// The end of the last device's frame at the master.
    DeviceFrames,
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
        match self.limit() {
            Limit::MasterFrame => self.master_frame_at_last_ns,
            Limit::DeviceFrames => self.device_frames_at_master_ns,
        }
    }

    /// What keeps the cycle from being shorter.
    pub const fn limit(self) -> Limit {
        if self.master_frame_at_last_ns > self.device_frames_at_master_ns {
            Limit::MasterFrame
        } else {
            Limit::DeviceFrames
        }
    }

    /// Whether a cycle of `cycle_ns` is long enough.
    pub const fn fits(self, cycle_ns: u32) -> bool {
        self.min_cycle_ns() <= cycle_ns
    }

    /// Whether all devices act on the data of the same frame: their new-data event CMP7 comes before the first of them
    /// has the whole frame, or after the last has. Two devices with 8 output bytes and CMP7 at 2000 ns act one cycle
    /// apart; with 16 output bytes that cannot happen.
    pub const fn same_cycle(self, cmp7_ns: u32) -> bool {
        cmp7_ns < self.master_frame_at_first_ns || self.master_frame_at_last_ns < cmp7_ns
    }
}

impl Timing<'_> {
    /// Line delay in front of device `address`, in ns.
    fn line_delay_ns(&self, address: u8) -> u32 {
        let index = usize::from(address.saturating_sub(1));
        let delays = self.line_delays_ns;
        delays.get(index).or(delays.last()).copied().map_or(0, u32::from)
    }

    /// Way of a frame from the master to device `address`, in ns: the cables and the devices between.
    fn way_ns(&self, address: u8) -> u32 {
        let cables = (1..=address).map(|a| self.line_delay_ns(a)).fold(0, u32::saturating_add);
        cables.saturating_add(u32::from(address.saturating_sub(1)).saturating_mul(u32::from(TRANSIT_NS)))
    }

    /// Time of one device frame with its two preamble bytes and the gap after it, in ns: 880 with 3 payload bytes.
    pub const fn slot_ns(&self) -> u32 {
        self.device_frame_ns().saturating_add(GAP_NS)
    }

    const fn device_frame_ns(&self) -> u32 {
        // Preamble 2, header 2, CRC 1.
        (self.payload_len as u32).saturating_add(5).saturating_mul(BYTE_NS)
    }

    /// When device `address` starts to send, in ns of the common time: so that the frames reach the master one slot
    /// after the other. Signed, because a cable longer than a slot asks a device to send before the one in front.
    pub fn send_time_ns(&self, address: DeviceAddress) -> i64 {
        let slots = i64::from(address.hops_before()).saturating_mul(i64::from(self.slot_ns()));
        let way = self.way_ns(address.get()).saturating_sub(self.way_ns(1));
        i64::from(TRIGGER_NS).saturating_add(slots).saturating_sub(i64::from(way))
    }

    /// The end times.
    pub fn budget(&self) -> Budget {
        let devices = self.devices.min(DeviceAddress::MAX.get());
        // Preamble 2, header 2, CRC 1, time stamp 2.
        let master_frame_bytes = u32::from(self.output_len).saturating_add(7);
        let master_sent_ns = TRIGGER_NS.saturating_add(master_frame_bytes.saturating_mul(BYTE_NS));
        let at = |address: u8| master_sent_ns.saturating_add(self.way_ns(address));
        let slots = u32::from(devices.saturating_sub(1)).saturating_mul(self.slot_ns());
        let last = slots.saturating_add(self.device_frame_ns()).saturating_add(self.way_ns(1));
        Budget {
            master_frame_bytes,
            master_sent_ns,
            master_frame_at_first_ns: at(1),
            master_frame_at_last_ns: at(devices.max(1)),
            device_frames_at_master_ns: TRIGGER_NS.saturating_add(last),
        }
    }
}

/// A cycle that is too short, and for whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Misfit {
    /// The first device for which it is.
    pub device: u8,
    /// How long the cycle must be for this device, in ns.
    pub needs_ns: u32,
    /// Which way takes so long.
    pub limit: Limit,
}

impl Timing<'_> {
    /// The first device that a cycle of `cycle_ns` is too short for, in the order of the addresses.
    pub fn misfit(&self, cycle_ns: u32) -> Option<Misfit> {
        let devices = self.devices.min(DeviceAddress::MAX.get());
        let sent_ns = self.budget().master_sent_ns;
        let (mut cables_ns, mut hops_ns, mut slots_ns) = (0_u32, 0_u32, 0_u32);
        let frame_ns = self.device_frame_ns().saturating_add(TRIGGER_NS).saturating_add(self.line_delay_ns(1));
        (1..=devices).find_map(|device| {
            cables_ns = cables_ns.saturating_add(self.line_delay_ns(device));
            let out = sent_ns.saturating_add(cables_ns).saturating_add(hops_ns);
            let back = frame_ns.saturating_add(slots_ns);
            hops_ns = hops_ns.saturating_add(TRANSIT_NS.into());
            slots_ns = slots_ns.saturating_add(self.slot_ns());
            let (needs_ns, limit) = if out > back { (out, Limit::MasterFrame) } else { (back, Limit::DeviceFrames) };
            (needs_ns > cycle_ns).then_some(Misfit { device, needs_ns, limit })
        })
    }

    /// The shortest cycle in whole periods of the step pulse generator, 4 us, in ns. A step word is about the second period
    /// after the cycle that brought it, so longer cycles mean fewer steps a second and not longer pulses.
    pub fn cnc_cycle_ns(&self) -> u32 {
        self.budget().min_cycle_ns().max(1).div_ceil(CNC_CYCLE_NS).saturating_mul(CNC_CYCLE_NS)
    }
}

const _: () = assert!(MAX_DEVICES == DeviceAddress::MAX.get() as usize);

servowire_core::one_line!(Limit {
    Self::MasterFrame => "the way of the master frame";
    Self::DeviceFrames => "the device frames";
});
servowire_core::one_line!(Misfit {
    Self { device, needs_ns, limit } =>
        "the cycle is too short from device {} on, which needs {} ns for {}", device, needs_ns, limit;
});

impl core::error::Error for Misfit {}

#[cfg(test)]
mod tests {
    use super::*;

    fn cnc(devices: u8, line_delays_ns: &[u16]) -> Timing<'_> {
        Timing { line_delays_ns, devices, output_len: u16::from(devices) * 4, payload_len: 3 }
    }

    #[test]
    fn four_devices_fit_four_microseconds_and_five_do_not() {
        assert!(cnc(4, &[85]).budget().fits(CNC_CYCLE_NS));
        assert!(!cnc(5, &[0]).budget().fits(CNC_CYCLE_NS));
        assert_eq!(cnc(4, &[0]).budget().limit(), Limit::DeviceFrames);
        let long = cnc(4, &[200]).budget();
        assert_eq!((long.limit(), long.min_cycle_ns()), (Limit::MasterFrame, 4205));
    }

    #[test]
    fn the_device_that_breaks_the_cycle_is_named() {
        assert_eq!(cnc(4, &[85]).misfit(4000), None);
        // 500 + 4 x 880 + 640 + 85: the fifth device's frame at the master.
        let misfit = Timing { output_len: 16, ..cnc(5, &[85]) }.misfit(4000);
        assert_eq!(misfit, Some(Misfit { device: 5, needs_ns: 4745, limit: Limit::DeviceFrames }));
        // 500 + 23 x 80 + 4 x 200 + 3 x 355: the master frame at the fourth.
        let misfit = cnc(4, &[200]).misfit(4000);
        assert_eq!(misfit, Some(Misfit { device: 4, needs_ns: 4205, limit: Limit::MasterFrame }));
        for devices in 1..=254 {
            let line = cnc(devices, &[85]);
            let cycle = line.cnc_cycle_ns();
            assert!(cycle % 4000 == 0 && line.misfit(cycle).is_none());
            assert!(cycle == 4000 || line.misfit(cycle - 4000).is_some());
            assert_eq!(line.misfit(line.budget().min_cycle_ns() - 1).map(|m| m.needs_ns > 0), Some(true));
        }
        assert_eq!(
            (cnc(4, &[85]).cnc_cycle_ns(), cnc(10, &[85]).cnc_cycle_ns(), cnc(254, &[85]).cnc_cycle_ns()),
            (4000, 12_000, 224_000)
        );
    }

    #[test]
    fn ten_devices_fit_ten_microseconds() {
        assert_eq!(cnc(10, &[0]).budget().min_cycle_ns(), 9060);
        assert_eq!(cnc(11, &[0]).budget().min_cycle_ns(), 9940);
        assert_eq!(cnc(254, &[0]).budget().min_cycle_ns(), 223_780);
    }

    #[test]
    fn data_act_in_the_same_cycle_only_with_sixteen_bytes() {
        for devices in 1..=4 {
            let all = Timing { output_len: 16, ..cnc(devices, &[0]) };
            assert!(all.budget().same_cycle(2000));
            assert_eq!(cnc(devices, &[0]).budget().same_cycle(2000), devices != 2);
        }
    }

    /// The frames of all devices reach the master one slot after the other, whatever the cables.
    #[test]
    fn device_frames_arrive_back_to_back() {
        let delays = [30, 200, 85, 0, 450, 7];
        let line = cnc(9, &delays);
        for address in 1..=9 {
            let sent = line.send_time_ns(DeviceAddress::new(address).unwrap());
            let arrival = sent + i64::from(line.way_ns(address));
            assert_eq!(arrival, 500 + 30 + i64::from(address - 1) * 880);
        }
        let last = 500 + 30 + 8 * 880 + 640;
        assert_eq!(line.budget().device_frames_at_master_ns, last);
    }

    #[test]
    fn the_published_slots_do_not_collide_up_to_their_cable_length() {
        let arrives = |a: u8, line: i64| {
            let sent = published_send_time_ns(DeviceAddress::new(a).unwrap());
            i64::from(sent) + i64::from(a - 1) * (355 + line)
        };
        // Two frames of 640 ns, one after the other.
        for line in 0..=200 {
            for a in 1..4 {
                assert!(arrives(a + 1, line) - arrives(a, line) >= 640, "{line}");
            }
        }
    }
}
