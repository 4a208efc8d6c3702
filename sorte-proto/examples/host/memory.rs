//! The memory that the published firmware shares with its host: what is where, and how to read it.
//!
//! The master keeps it in the data RAM of its PRU, a device in the shared RAM of the PRU-ICSS. From the Processor SDK RTOS (PDK am335x 1.0.17, example
//! `sorte`): `sorte_master_cfg.inc`, `sorte_host_interface.inc`, `sorte_loc.h`. Multi-byte numbers are little-endian.

use sorte_proto::{DeviceAddress, Discovery, DiscoveryView, Error, Parameters, Preamble, drv8711, master};

/// A stretch of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Region {
    /// What is there.
    pub(crate) name: &'static str,
    /// First byte.
    pub(crate) offset: u16,
    /// Bytes; `None` where no source says how many.
    pub(crate) len: Option<u16>,
}

const fn region(name: &'static str, offset: u16, len: u16) -> Region {
    Region { name, offset, len: if len == 0 { None } else { Some(len) } }
}

/// DISCOVERY, after the preamble of 8 bytes with which it is stored.
const ANSWER: usize = 0x208;
const _: () =
    assert!(ANSWER == 0x200 + Preamble::Long.bytes().len() && Discovery::LEN == 1030 && Parameters::LEN == 32);

/// The master's data RAM.
pub(crate) const MASTER: [Region; 18] = [
    region("control", 0x000, 4),
    region("status", 0x004, 4),
    region("control parameter", 0x008, 4),
    region("version", 0x00c, 4),
    region("port counters: cycles, CRC, timing, format", 0x050, 0),
    region("retrain counter", 0x070, 0),
    region("buttons", 0x0c0, 4),
    region("faders", 0x0c4, 4),
    region("speed", 0x0c8, 0),
    region("fstep", 0x0e0, 4),
    region("step time", 0x0e4, 4),
    region("pause", 0x0e8, 0),
    region("CRC-8 table", 0x100, 256),
    region("discovery answer with preamble", 0x200, 1038),
    region("output image", 0x700, 0),
    region("input image", 0x800, 32),
    region("sin2 table, 32 entries", 0x900, 0),
    region("acceleration table", 0xa00, 0),
];

/// A device's shared RAM.
pub(crate) const DEVICE: [Region; 18] = [
    region("delay sum", 0x08, 4),
    region("line delay to the next device", 0x0c, 2),
    region("accumulated delay", 0x0e, 2),
    region("time stamp of SYNC", 0x10, 4),
    region("receive time of SYNC", 0x14, 4),
    region("reference of the IO exchange", 0x18, 4),
    region("address", 0x24, 2),
    region("frame received", 0x26, 2),
    region("missed frames", 0x28, 2),
    region("CRC errors of port 0", 0x50, 2),
    region("CRC errors of port 1", 0x52, 2),
    region("good frames of port 0", 0x54, 2),
    region("good frames of port 1", 0x56, 2),
    region("retrains", 0x58, 2),
    region("DRV8711 STATUS", 0x5a, 2),
    region("input buffer", 0x60, 16),
    region("output slice", 0x70, 0),
    region("parameters of PARAM", 0x100, 32),
];

fn bytes<const N: usize>(ram: &[u8], offset: usize) -> Option<[u8; N]> {
    ram.get(offset..)?.first_chunk().copied()
}

fn half(ram: &[u8], offset: usize) -> Option<u16> {
    bytes(ram, offset).map(u16::from_le_bytes)
}

fn word(ram: &[u8], offset: usize) -> Option<u32> {
    bytes(ram, offset).map(u32::from_le_bytes)
}

/// The master's data RAM, or the front of it. What lies beyond its end is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MasterMemory<'a>(&'a [u8]);

impl<'a> MasterMemory<'a> {
    /// What the control parameter holds after reset: start again after 3 CRC errors and 3 timing errors.
    pub(crate) const CONTROL_PARAMETER: u32 = 0x303;

    /// `ram`: the memory from its first byte on.
    pub(crate) const fn new(ram: &'a [u8]) -> Self {
        Self(ram)
    }

    /// Bit 0 of control: the host lets the master run.
    pub(crate) fn is_enabled(self) -> Option<bool> {
        Some(word(self.0, 0x000)? & 1 == 1)
    }

    /// Bits 6 and 7 of control: the master starts again when it has received nothing in a cycle. Off after reset.
    pub(crate) fn retrains(self) -> Option<bool> {
        Some(word(self.0, 0x000)? & 0xc0 != 0)
    }

    /// Low three bits of status. `None` for 7 too.
    pub(crate) fn state(self) -> Option<master::State> {
        let [low] = bytes(self.0, 0x004)?;
        master::State::from_code(low & 7)
    }

    /// Control parameter.
    pub(crate) fn control_parameter(self) -> Option<u32> {
        word(self.0, 0x008)
    }

    /// Version of the firmware.
    pub(crate) fn version(self) -> Option<u32> {
        word(self.0, 0x00c)
    }

    /// Devices that the answer to DISCOVERY counts, as the vendor's host reads it: without a look at the check.
    pub(crate) fn devices(self) -> Option<u16> {
        half(self.0, 0x20c)
    }

    /// The answer to DISCOVERY.
    ///
    /// # Errors
    /// [`Error::Truncated`] if the memory ends before it; as [`DiscoveryView::parse`].
    pub(crate) fn discovery(self) -> Result<DiscoveryView<'a>, Error> {
        let image = self.0.get(ANSWER..).unwrap_or_default();
        DiscoveryView::parse(image.get(..Discovery::LEN).unwrap_or(image))
    }

    /// Output image, as many bytes as the caller knows the line to have.
    pub(crate) fn output(self, len: u16) -> Option<&'a [u8]> {
        self.0.get(0x700..)?.get(..usize::from(len))
    }

    /// The first 32 bytes received in the last cycle, with their preambles: four device frames fill them.
    pub(crate) fn input(self) -> Option<&'a [u8; 32]> {
        self.0.get(0x800..)?.first_chunk()
    }
}

/// Times of a SYNC frame as a device stores them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SyncTimes {
    /// The time stamp in the frame, in ns.
    pub(crate) time_stamp_ns: u32,
    /// The device's counter at the start of the frame, in ns.
    pub(crate) sof_ns: u32,
}

/// A device's shared RAM, or the front of it. What lies beyond its end is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DeviceMemory<'a>(&'a [u8]);

impl<'a> DeviceMemory<'a> {
    /// `ram`: the memory from its first byte on.
    pub(crate) const fn new(ram: &'a [u8]) -> Self {
        Self(ram)
    }

    /// Line delay to the next device in ns.
    pub(crate) fn line_delay_next_ns(self) -> Option<u16> {
        half(self.0, 0x0c)
    }

    /// Delay from the master in ns, modulo 2^16.
    pub(crate) fn delay_ns(self) -> Option<u16> {
        half(self.0, 0x0e)
    }

    /// Times of the last SYNC frame.
    pub(crate) fn last_sync(self) -> Option<SyncTimes> {
        Some(SyncTimes { time_stamp_ns: word(self.0, 0x10)?, sof_ns: word(self.0, 0x14)? })
    }

    /// The master's time at the start of the last master frame, seen here, in ns.
    pub(crate) fn reference_ns(self) -> Option<u32> {
        word(self.0, 0x18)
    }

    /// Address; `None` before DISCOVERY too.
    pub(crate) fn address(self) -> Option<DeviceAddress> {
        let [low] = bytes(self.0, 0x24)?;
        DeviceAddress::new(low)
    }

    /// Cycle starts without a frame since the last frame.
    pub(crate) fn missed_frames(self) -> Option<u16> {
        half(self.0, 0x28)
    }

    /// Frames with a wrong check at both ports.
    pub(crate) fn crc_errors(self) -> Option<[u16; 2]> {
        Some([half(self.0, 0x50)?, half(self.0, 0x52)?])
    }

    /// Good frames at both ports.
    pub(crate) fn good_frames(self) -> Option<[u16; 2]> {
        Some([half(self.0, 0x54)?, half(self.0, 0x56)?])
    }

    /// How often the device went back to IDLE.
    pub(crate) fn retrains(self) -> Option<u16> {
        half(self.0, 0x58)
    }

    /// What the motor driver reports.
    pub(crate) fn driver(self) -> Option<drv8711::Status> {
        let [low] = bytes(self.0, 0x5a)?;
        Some(drv8711::Status::from_bits_retain(low))
    }

    /// The parameters that PARAM has brought.
    pub(crate) fn parameters(self) -> Option<Parameters> {
        bytes(self.0, 0x100).map(|bytes| Parameters::parse(&bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sorte_proto::cut_through::Rewriter;
    use sorte_proto::{Entry, ErrorClass, Place, Status};

    #[test]
    fn places_follow_each_other_without_overlap() {
        for map in [&MASTER[..], &DEVICE[..]] {
            for pair in map.windows(2) {
                let end = pair[0].offset + pair[0].len.unwrap_or(1);
                assert!(end <= pair[1].offset, "{} runs into {}", pair[0].name, pair[1].name);
            }
        }
    }

    /// A dump by hand, with the numbers of the vendor's header.
    #[test]
    fn the_master_shows_its_state_and_the_line() {
        let mut ram = vec![0_u8; 0x1000];
        ram[0x000..0x010].copy_from_slice(&[0x41, 0, 0, 0, 0x0d, 0, 0, 0, 0x03, 0x03, 0, 0, 0x78, 0x56, 0x34, 0x12]);
        let mut answer = Discovery::request(Place::Last).emit();
        for adds in [Status::empty(), Status::empty(), Status::LAST] {
            Rewriter::discovery(Entry::STOCK, adds).pass(&mut answer).unwrap();
        }
        ram[0x200..0x208].copy_from_slice(&[0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0xd5]);
        ram[0x208..0x60e].copy_from_slice(&answer);
        ram[0x700..0x704].copy_from_slice(&[1, 2, 3, 4]);
        ram[0x800] = 0x55;
        let host = MasterMemory::new(&ram);
        assert_eq!((host.is_enabled(), host.retrains()), (Some(true), Some(true)));
        assert_eq!((host.state(), host.version()), (Some(master::State::Exchange), Some(0x1234_5678)));
        assert_eq!(host.control_parameter(), Some(MasterMemory::CONTROL_PARAMETER));
        assert_eq!((host.devices(), host.discovery().unwrap().count()), (Some(3), 3));
        assert_eq!((host.output(4), host.input().map(|input| input[0])), (Some(&[1, 2, 3, 4][..]), Some(0x55)));
        ram[0x000] = 0;
        ram[0x004] = 7;
        ram[0x300] ^= 1;
        let host = MasterMemory::new(&ram);
        assert_eq!((host.is_enabled(), host.retrains(), host.state()), (Some(false), Some(false), None));
        assert_eq!(host.discovery().map(|_| ()).map_err(Error::class), Err(ErrorClass::BadFcs));
    }

    #[test]
    fn the_state_of_the_master_has_the_published_code() {
        let codes: Vec<_> = (0..8).map(|code| master::State::from_code(code).map(|state| state as u8)).collect();
        assert_eq!(codes, [Some(0), Some(1), Some(2), Some(3), Some(4), Some(5), Some(6), None]);
    }

    #[test]
    fn a_device_shows_what_it_has_learnt() {
        let mut ram: Vec<u8> = (0..=255).chain(Parameters::STOCK.emit()).collect();
        ram[0x24] = 7;
        let host = DeviceMemory::new(&ram);
        assert_eq!((host.line_delay_next_ns(), host.delay_ns()), (Some(0x0d0c), Some(0x0f0e)));
        assert_eq!(host.last_sync(), Some(SyncTimes { time_stamp_ns: 0x1312_1110, sof_ns: 0x1716_1514 }));
        assert_eq!((host.reference_ns(), host.missed_frames()), (Some(0x1b1a_1918), Some(0x2928)));
        assert_eq!((host.crc_errors(), host.good_frames()), (Some([0x5150, 0x5352]), Some([0x5554, 0x5756])));
        assert_eq!((host.retrains(), host.driver().map(|status| status.bits())), (Some(0x5958), Some(0x5a)));
        assert_eq!((host.address().map(DeviceAddress::get), host.parameters()), (Some(7), Some(Parameters::STOCK)));
        ram[0x24] = 0;
        assert_eq!(DeviceMemory::new(&ram).address(), None);
    }

    #[test]
    fn what_lies_beyond_the_end_is_not_there() {
        for len in 0..0x10 {
            let ram = vec![0xff; len];
            let host = MasterMemory::new(&ram);
            assert_eq!((host.is_enabled().is_some(), host.version().is_some()), (len >= 4, len >= 16));
            assert!(host.devices().is_none() && host.input().is_none() && host.output(1).is_none());
            assert!(matches!(host.discovery(), Err(Error::Truncated { .. })));
            let device = DeviceMemory::new(&ram);
            assert_eq!(device.line_delay_next_ns().is_some(), len >= 14);
            assert!(device.parameters().is_none() && device.driver().is_none());
        }
    }
}
