use crate::error::Error;

/// Number of round trips in one measurement.
pub(crate) const SAMPLES: u8 = 16;
/// By how much the mean of a cable of zero length may be too short, in ns: a tick of the counter that captures both ends of a
/// round trip, plus the most that truncating each round trip takes away.
const TICK_NS: u32 = 5;
const CUT_NS: u32 = 15;

/// How round trips become a line delay. The vendor's master and device compute it differently, and so do those of this crate.
///
/// | | sum | line delay |
/// |---|---|---|
/// | master | of the round trips, modulo 2^16, then divided by 16 | (mean - 320) / 2 |
/// | device | of the round trips divided by 16 each, which is up to 15 ns lower | (mean - 360) / 2 |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DelayModel {
    /// Time between the reception of the request and its reflection, in ns.
    pub forward_ns: u16,
    /// Whether every round trip is divided by 16 before it is added, instead of dividing the sum.
    pub shift_samples: bool,
}

impl DelayModel {
    /// The model of the published master.
    pub const MASTER: Self = Self { forward_ns: 320, shift_samples: false };
    /// The model of the published device, for the line to the next device.
    pub const DEVICE: Self = Self { forward_ns: 360, shift_samples: true };
}

/// The spread of the round trips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoundTrips {
    /// The shortest, in ns.
    pub shortest_ns: u32,
    /// The longest, in ns.
    pub longest_ns: u32,
}

/// Line delay from round trips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct LineDelay {
    model: DelayModel,
    count: u8,
    sum: u32,
    min: u32,
    max: u32,
}

impl LineDelay {
    /// Creates a measurement without round trips.
    pub const fn new(model: DelayModel) -> Self {
        Self { model, count: 0, sum: 0, min: u32::MAX, max: 0 }
    }

    /// Takes one round trip in ns: from the start of the request as sent to the start of the reflection as received. Round
    /// trips beyond the sixteenth are ignored.
    #[inline]
    pub const fn add(&mut self, rtt_ns: u32) {
        if self.is_complete() {
            return;
        }
        let term = if self.model.shift_samples { rtt_ns >> 4 } else { rtt_ns };
        self.sum = self.sum.saturating_add(term);
        self.count = self.count.saturating_add(1);
        // Compared here: at opt-level s `min` and `max` are calls or not, as it pleases the compiler.
        if rtt_ns < self.min {
            self.min = rtt_ns;
        }
        if rtt_ns > self.max {
            self.max = rtt_ns;
        }
    }

    /// Number of round trips taken.
    pub const fn count(&self) -> u8 {
        self.count
    }

    /// Returns whether sixteen have been taken.
    pub const fn is_complete(&self) -> bool {
        self.count >= SAMPLES
    }

    /// Shortest and longest round trip.
    pub const fn extremes(&self) -> Option<RoundTrips> {
        if self.count == 0 { None } else { Some(RoundTrips { shortest_ns: self.min, longest_ns: self.max }) }
    }

    /// Mean round trip in ns as the published registers hold it, modulo 2^16 (master: 2^12).
    pub const fn published_mean(&self) -> u16 {
        let [low, high, ..] = self.sum.to_le_bytes();
        let sum = u16::from_le_bytes([low, high]);
        if self.model.shift_samples { sum } else { sum >> 4 }
    }

    /// The line delay in ns as the published firmware computes it: everything wraps, and round trips shorter than the forwarding
    /// time yield a huge delay. The master halves a 16-bit value; the device halves a 32-bit one and then keeps
    /// 16 bits.
    pub const fn published(&self) -> u16 {
        if !self.model.shift_samples {
            return self.published_mean().wrapping_sub(self.model.forward_ns) >> 1;
        }
        let [low, high, ..] = (self.sum.wrapping_sub(self.model.forward_ns as u32) >> 1).to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// The line delay in ns, as [`published`](Self::published) where that does not wrap.
    ///
    /// # Errors
    /// [`Error::ImplausibleRoundTrip`] with the longest if that is 4096 ns or more: sixteen of them do not fit the published
    /// 16 bits (some 350 m of cable); with the mean if that is shorter than the forwarding time.
    pub const fn checked(&self) -> Result<u16, Error> {
        if self.max >= 4096 {
            return Err(Error::ImplausibleRoundTrip { rtt_ns: self.max });
        }
        let mean = if self.model.shift_samples { self.sum } else { self.sum >> 4 };
        match mean.checked_sub(self.model.forward_ns as u32) {
            #[expect(clippy::cast_possible_truncation, reason = "sixteen below 4096 at most, and their mean is")]
            Some(twice) => Ok((twice >> 1) as u16),
            None => Err(Error::ImplausibleRoundTrip { rtt_ns: mean }),
        }
    }

    /// The line delay in ns that master and device use: as [`checked`](Self::checked), and 0 for a cable so short that
    /// truncation of the round trips, or a tick of the counter, makes it negative.
    ///
    /// # Errors
    /// Those of [`checked`](Self::checked), but a mean may be shorter than the forwarding time by a tick of 5 ns, and by
    /// another 15 ns if round trips are truncated.
    pub const fn measured(&self) -> Result<u16, Error> {
        let lacks = if self.model.shift_samples { TICK_NS.saturating_add(CUT_NS) } else { TICK_NS };
        match self.checked() {
            Err(Error::ImplausibleRoundTrip { rtt_ns })
                if self.max < 4096 && rtt_ns.saturating_add(lacks) >= self.model.forward_ns as u32 =>
            {
                Ok(0)
            }
            checked => checked,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn of(model: DelayModel, rtt: [u32; 16]) -> LineDelay {
        let mut delay = LineDelay::new(model);
        for ns in rtt {
            delay.add(ns);
        }
        delay
    }

    #[test]
    fn a_cable_of_no_length_has_no_delay() {
        assert_eq!(of(DelayModel::MASTER, [320; 16]).checked(), Ok(0));
        // 360 / 16 is cut to 22 sixteen times: 352 is less than the forwarding time, and the published result wraps.
        let device = of(DelayModel::DEVICE, [360; 16]);
        assert_eq!(device.checked(), Err(Error::ImplausibleRoundTrip { rtt_ns: 352 }));
        assert_eq!((device.measured(), device.published()), (Ok(0), 65532));
        assert_eq!(of(DelayModel::MASTER, [312; 16]).published(), 32764);
        // A tick less, and 15 ns of each that is cut, are a cable of no length; more is none at all.
        assert_eq!(of(DelayModel::MASTER, [315; 16]).measured(), Ok(0));
        assert_eq!(of(DelayModel::MASTER, [314; 16]).measured(), Err(Error::ImplausibleRoundTrip { rtt_ns: 314 }));
        let mut cut = [367; 16];
        cut[..12].fill(351);
        assert_eq!(of(DelayModel::DEVICE, cut).measured(), Ok(0));
        cut[12] = 351;
        assert_eq!(of(DelayModel::DEVICE, cut).measured(), Err(Error::ImplausibleRoundTrip { rtt_ns: 339 }));
        let whole = DelayModel { shift_samples: false, ..DelayModel::DEVICE };
        assert_eq!(of(whole, [355; 16]).measured(), Ok(0));
        assert_eq!(of(whole, [354; 16]).measured(), Err(Error::ImplausibleRoundTrip { rtt_ns: 354 }));
    }

    /// Sixteen round trips of 4096 ns do not fit the published 16 bits, sixteen of 4095 do.
    #[test]
    fn the_longest_round_trip_is_4095_ns() {
        for model in [DelayModel::MASTER, DelayModel::DEVICE] {
            assert!(of(model, [4095; 16]).measured().is_ok());
            let mut one = [500; 16];
            one[7] = 4096;
            assert_eq!(of(model, one).checked(), of(model, one).measured());
            assert_eq!(of(model, one).checked(), Err(Error::ImplausibleRoundTrip { rtt_ns: 4096 }));
        }
    }

    #[test]
    fn more_than_sixteen_are_left_out() {
        let mut delay = of(DelayModel::MASTER, [500; 16]);
        let before = delay;
        delay.add(4000);
        assert_eq!(delay, before);
        assert_eq!((delay.count(), delay.extremes()), (16, Some(RoundTrips { shortest_ns: 500, longest_ns: 500 })));
    }

    proptest! {
        #[test]
        fn measured_and_published_agree_in_the_range_of_the_registers(rtt in prop_oneof![
            proptest::array::uniform16(300u32..5000),
            proptest::array::uniform16(300u32..400),
        ]) {
            for model in [DelayModel::MASTER, DelayModel::DEVICE] {
                let delay = of(model, rtt);
                let mean = rtt.iter().sum::<u32>() / 16;
                match delay.measured() {
                    Ok(ns) => {
                        let negative = delay.published() >= 0x7f00;
                        prop_assert_eq!(ns, if negative { 0 } else { delay.published() });
                        // The device's rounding: up to 15 ns of round trip.
                        let exact = mean.saturating_sub(model.forward_ns.into()) / 2;
                        prop_assert!(u32::from(ns) <= exact && exact <= u32::from(ns) + 8);
                    }
                    Err(_) => prop_assert!(rtt.iter().any(|ns| *ns >= 4096) || mean + 5 < u32::from(model.forward_ns)
                        || model.shift_samples && mean < u32::from(model.forward_ns)),
                }
            }
        }
    }
}
