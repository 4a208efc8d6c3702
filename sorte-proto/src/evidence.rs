//! The part of a device's frame that a control loop may use.

use servowire_core::{Feedback, Tolerance, Words};

use crate::address::DeviceAddress;
use crate::drv8711;
use crate::exchange::DeviceFrameView;
use crate::payload::InputSlice;
use crate::status::Status;

/// The devices of a line send positions, as [`follow`](crate::follow) says: an extension of this crate. The reference design
/// sends 0 in their place, and nothing in a frame distinguishes the two, so the caller has to know which it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Positions {
    taken_before_ns: u32,
}

impl Positions {
    /// `taken_before_ns`: the longest time between the moment a device takes the position and the start of its frame at the
    /// master, in ns: the delays of its own firmware, and the travel time of the frame. A device that takes it at the start
    /// of its cycle, with the published send times: one cycle.
    pub const fn taken_before_ns(taken_before_ns: u32) -> Self {
        Self { taken_before_ns }
    }
}

/// The faults despite which a position may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tolerated {
    alarms: drv8711::Status,
}

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self { alarms: drv8711::Status::empty() };
    /// Both stall bits: they are meaningful only if stall detection is set up.
    pub const STALL: Self = Self::NOTHING.alarms(drv8711::Status::STD.union(drv8711::Status::STDLAT));

    /// Tolerates these bits of the motor driver's STATUS, replacing those set before.
    #[must_use]
    pub const fn alarms(self, alarms: drv8711::Status) -> Self {
        Self { alarms }
    }
}

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// Up to what age, and despite which faults, a position may be used.
pub type Policy = servowire_core::Policy<Tolerated>;

/// What a device has reported about its axis, and when. It is judged at the moment of use, by [`at`](Self::at).
///
/// ```
/// use sorte_proto::{DeviceFrameView, Doubt, Evidence, Policy, Positions};
/// // Device 1, no fault, 4711 steps; its frame began at 1 ms.
/// let bytes = [0x01, 0x00, 0x00, 0x67, 0x12, 0x82];
/// let frame = DeviceFrameView::parse(3, &bytes)?;
/// let evidence = Evidence::of(frame, Positions::taken_before_ns(4000), 1_000_000);
/// let policy = Policy::new(12_000); // three cycles
/// assert_eq!(evidence.at(1_008_000, policy).map(|sample| sample.position()), Ok(4711));
/// assert_eq!(evidence.at(1_008_001, policy), Err(Doubt::Old { age_ns: 12_001 }));
/// assert_eq!(Evidence::NEVER.at(1_000_000, policy), Err(Doubt::Never));
/// # Ok::<(), sorte_proto::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Evidence {
    sampled_ns: u64,
    /// `None` if nothing was heard yet.
    from: Option<DeviceAddress>,
    status: Status,
    /// `None` if the frame is too short for one.
    told: Option<InputSlice>,
}

impl Evidence {
    /// The evidence before the first frame: a doubt under every policy.
    pub const NEVER: Self = Self { sampled_ns: 0, from: None, status: Status::empty(), told: None };

    /// Creates the evidence of a device's frame that began at `sof_ns` at the master.
    pub fn of(frame: DeviceFrameView<'_>, positions: Positions, sof_ns: u64) -> Self {
        let told = frame.payload().first_chunk().map(|bytes| InputSlice::parse(*bytes));
        let sampled_ns = sof_ns.saturating_sub(positions.taken_before_ns.into());
        Self { sampled_ns, from: Some(frame.address()), status: frame.status(), told }
    }

    /// Returns the position, if it may be used at this time. The doubts are checked in the order in which [`Doubt`]
    /// declares them.
    ///
    /// # Errors
    /// The reason why it must not be used.
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        let Some(address) = self.from else { return Err(Doubt::Never) };
        let Some(told) = self.told else { return Err(Doubt::NoPosition { address }) };
        if self.status.contains(Status::ERROR) {
            return Err(Doubt::Error { address });
        }
        let alarms = told.driver.difference(policy.tolerated().alarms);
        if !alarms.is_empty() {
            return Err(Doubt::Alarms { address, alarms });
        }
        match policy.check_age(now_ns, self.sampled_ns) {
            Ok(()) => Ok(Sample { sampled_ns: self.sampled_ns, address, told }),
            Err(age_ns) => Err(Doubt::Old { age_ns }),
        }
    }
}

impl Feedback for Evidence {
    type Tolerated = Tolerated;
    type Sample = Sample;
    type Doubt = Doubt;
    const NEVER: Self = Self::NEVER;

    fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        self.at(now_ns, policy)
    }
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 4>;

/// The time, low half first; steps, STATUS of the driver, and in the last byte whether these are present; address and STATUS.
impl Words<4> for Evidence {
    fn to_words(&self) -> [u32; 4] {
        let [a, b, c, d, e, f, g, h] = self.sampled_ns.to_le_bytes();
        let (slice, there) = match self.told {
            Some(told) => (told.emit(), 1),
            None => ([0; InputSlice::LEN], 0),
        };
        let [driver, low, high] = slice;
        let address = self.from.map_or(0, DeviceAddress::get);
        [
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
            u32::from_le_bytes([driver, low, high, there]),
            u32::from_le_bytes([address, self.status.bits(), 0, 0]),
        ]
    }

    fn from_words([first, second, slice, head]: [u32; 4]) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (first.to_le_bytes(), second.to_le_bytes());
        let [driver, low, high, there] = slice.to_le_bytes();
        let [address, status, ..] = head.to_le_bytes();
        Self {
            sampled_ns: u64::from_le_bytes([a, b, c, d, e, f, g, h]),
            from: DeviceAddress::new(address),
            status: Status::from_bits_retain(status),
            told: (there != 0).then(|| InputSlice::parse([driver, low, high])),
        }
    }
}

/// A position that may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sample {
    sampled_ns: u64,
    address: DeviceAddress,
    told: InputSlice,
}

impl Sample {
    /// Steps that the device has ordered from its pulse generator, modulo 2^16; backward steps count as negative.
    /// [`Asked::position`](crate::follow::Asked::position) returns the full number. A motor that has lost steps is somewhere
    /// else, and nothing on this wire shows that.
    pub const fn position(self) -> u16 {
        self.told.ordered
    }

    /// The device that reported it.
    pub const fn address(self) -> DeviceAddress {
        self.address
    }

    /// The motor driver's STATUS: only bits that the policy tolerates.
    pub const fn alarms(self) -> drv8711::Status {
        self.told.driver
    }

    /// The earliest instant at which the position can have been taken, in ns.
    pub const fn sampled_ns(self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(Sample {
    Self { sampled_ns, address, told } => "device {}, {}, sampled at {} ns", address, told, sampled_ns;
});

/// Why a position must not be used.
///
/// A follower that has stopped because it was too far behind does not say so on the wire: its position falls behind the
/// commanded one, see [`Asked::lag`](crate::follow::Asked::lag).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// Nothing was heard yet.
    Never,
    /// The payload of the device's frame has fewer than three bytes.
    NoPosition {
        /// Who sent it.
        address: DeviceAddress,
    },
    /// The device sets ERROR: it has seen a wrong checksum since its previous frame, or does not know where its axis is.
    Error {
        /// Who sets it.
        address: DeviceAddress,
    },
    /// The motor driver reports a fault that the policy does not tolerate: the motor may not be where the steps are.
    Alarms {
        /// Address of the device.
        address: DeviceAddress,
        /// Bits that are not tolerated; all eight if the driver has no supply.
        alarms: drv8711::Status,
    },
    /// The position was sampled too long ago.
    Old {
        /// Its age in ns.
        age_ns: u64,
    },
}

servowire_core::one_line!(Doubt {
    Self::Never => "nothing was heard yet";
    Self::NoPosition { address } => "the frame of device {} has no room for a position", address;
    Self::Error { address } => "device {} sets ERROR", address;
    Self::Alarms { address, alarms } => "the driver of device {} reports {}", address, alarms;
    Self::Old { age_ns } => "the position is {} ns old", age_ns;
});

impl core::error::Error for Doubt {}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use super::*;
    use crate::exchange::DeviceFrame;

    const POLICY: Policy = Policy::new(1000);

    fn heard<const P: usize>(status: Status, payload: [u8; P]) -> Evidence {
        let mut bytes = [0; 16];
        let frame = DeviceFrame { address: DeviceAddress::truncate(3), status, payload };
        let len = frame.emit_into(&mut bytes).unwrap();
        let view = DeviceFrameView::parse(P, &bytes[..len]).unwrap();
        Evidence::of(view, Positions::taken_before_ns(400), 5000)
    }

    #[test]
    fn the_age_counts_from_the_earliest_instant() {
        let evidence = heard(Status::LAST, [0, 0xfe, 0xff]);
        let sample = evidence.at(5600, POLICY).unwrap();
        assert_eq!((sample.position(), sample.sampled_ns(), sample.address().get()), (0xfffe, 4600, 3));
        assert_eq!(evidence.at(5601, POLICY), Err(Doubt::Old { age_ns: 1001 }));
        assert_eq!(sample.to_string(), "device 3, 65534 steps ordered, DRV8711 -, sampled at 4600 ns");
        let sof =
            Evidence::of(DeviceFrameView::parse(3, &[1, 0, 0, 0, 0, 0x62]).unwrap(), Positions::taken_before_ns(9), 4);
        assert_eq!(sof.at(0, Policy::new(0)).map(Sample::sampled_ns), Ok(0));
    }

    #[test]
    fn evidence_goes_through_a_cell_as_it_is() {
        for evidence in [
            Evidence::NEVER,
            heard(Status::LAST | Status::ERROR, [0x81, 0xfe, 0xff]),
            heard(Status::empty(), [0; 2]),
            Evidence { sampled_ns: 0x0123_4567_89ab_cdef, ..heard(Status::LAST, [0, 1, 2]) },
        ] {
            assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        }
    }

    #[test]
    fn every_doubt_and_what_tolerates_it() {
        let address = DeviceAddress::truncate(3);
        assert_eq!(Evidence::NEVER.at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
        assert_eq!(heard(Status::LAST, [0, 0]).at(5000, POLICY), Err(Doubt::NoPosition { address }));
        // Nothing tolerates ERROR, and it comes before the faults.
        let all = POLICY.tolerating(Tolerated::NOTHING.alarms(drv8711::Status::all()));
        assert_eq!(heard(Status::ERROR, [0xff, 0, 0]).at(5000, all), Err(Doubt::Error { address }));
        assert_eq!(heard(Status::LAST, [0xff, 0, 0]).at(5000, all).map(Sample::alarms), Ok(drv8711::Status::all()));
        for bit in 0..8 {
            let alarms = drv8711::Status::from_bits_retain(1 << bit);
            let evidence = heard(Status::empty(), [1 << bit, 7, 0]);
            assert_eq!(evidence.at(9999, POLICY), Err(Doubt::Alarms { address, alarms }));
            let lenient = POLICY.tolerating(Tolerated::NOTHING.alarms(alarms));
            assert_eq!(evidence.at(5000, lenient).map(Sample::position), Ok(7));
            assert_eq!(evidence.at(9999, lenient), Err(Doubt::Old { age_ns: 5399 }));
            assert_eq!(evidence.at(5000, POLICY.tolerating(Tolerated::STALL)).is_ok(), bit >= 6);
        }
        let alarms = drv8711::Status::OTS | drv8711::Status::UVLO;
        assert_eq!(Doubt::Alarms { address, alarms }.to_string(), "the driver of device 3 reports OTS UVLO");
    }
}
