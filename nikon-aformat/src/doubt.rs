use core::fmt;

use crate::error::Error;
use crate::resolution::{Position, Resolution};
use crate::response::{Body, Response};
use crate::status::{Alm, EncoderStatus};

/// Why a position must not be used. The raw fields of the response stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// Status bits are set that are not tolerated. With [`EncoderStatus::BUSY`] the position is being determined.
    #[error("the encoder shows {es}")]
    Status {
        /// Those bits.
        es: EncoderStatus,
    },
    /// The one status bit of commands 21 and 22 is set; which of the four it stands for is not told.
    #[error("the encoder shows that something is wrong")]
    AnyStatus,
    /// Alarms are set that are not tolerated.
    #[error("the encoder shows {alarms}")]
    Alarms {
        /// Those alarms.
        alarms: Alm,
    },
    /// The response carries no position, only its upper bits, or less than a turn of this encoder.
    #[error("the response carries no whole turn")]
    Absent,
    /// Bits are set above the widths of the encoder: another encoder, or a wrong [`Resolution`].
    #[error("bits are set above bit {width}, which this encoder leaves 0")]
    UpperBits {
        /// Single-turn and turn bits together.
        width: u8,
    },
    /// The position was sampled too long ago, or by a clock that was set back in the meantime.
    #[error("the position is {age_ns} ns old")]
    Old {
        /// How far the instant of sampling is away, in ns.
        age_ns: u64,
    },
}

/// What a position may be used in spite of.
///
/// An encoder whose turns are not used may show [`EncoderStatus::BATT`]; everything else means that the position may be wrong
/// or that something is about to fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Policy {
    status: EncoderStatus,
    alarms: Alm,
    max_age_ns: u64,
}

impl Policy {
    /// Nothing is tolerated, any age.
    pub const STRICT: Self = Self { status: EncoderStatus::empty(), alarms: Alm::empty(), max_age_ns: u64::MAX };

    /// As one drive does where turns are not used: an encoder without its battery shows BATT.
    pub const SINGLE_TURN: Self = Self::STRICT.tolerating(EncoderStatus::BATT).tolerating_alarms(Alm::BATT);

    /// In spite of these status bits too.
    pub const fn tolerating(self, status: EncoderStatus) -> Self {
        Self { status: self.status.union(status), ..self }
    }

    /// In spite of these alarms too, where a response carries them.
    pub const fn tolerating_alarms(self, alarms: Alm) -> Self {
        Self { alarms: self.alarms.union(alarms), ..self }
    }

    /// Only up to this age, in ns, counted from the earliest instant at which it can have been sampled.
    pub const fn with_max_age_ns(self, max_age_ns: u64) -> Self {
        Self { max_age_ns, ..self }
    }

    /// The longest age, in ns.
    pub const fn max_age_ns(self) -> u64 {
        self.max_age_ns
    }
}

impl Default for Policy {
    fn default() -> Self {
        Self::STRICT
    }
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tolerating {} and {}", self.status, self.alarms)
    }
}

impl Resolution {
    /// The position of a response for control: only if nothing speaks against its use. The checks are made in the order status,
    /// alarms, layout, upper bits. The raw fields of the response stay readable beside it.
    ///
    /// ```
    /// use nikon_aformat::{BitOrder, Command, Doubt, EncoderStatus, Expected, Layout, Policy, Resolution, Response};
    /// let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
    /// let words = [0x2085, 0xf64a, 0x8009, 0x80a1];
    /// let response = Response::parse_words(&expected, &words, BitOrder::MsbFirst)?;
    /// // an encoder without its battery
    /// let shown = EncoderStatus::BATT | EncoderStatus::ERROR;
    /// let resolution = Resolution::new(17, 16).unwrap_or_default();
    /// assert_eq!(resolution.read(&response, Policy::STRICT), Err(Doubt::Status { es: shown }));
    /// let position = resolution.read(&response, Policy::STRICT.tolerating(shown));
    /// assert_eq!(position.map(|position| position.single_turn), Ok(86_639));
    /// # Ok::<(), nikon_aformat::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Doubt`].
    pub fn read(self, response: &Response, policy: Policy) -> Result<Position, Doubt> {
        match response.body {
            Body::Abs17 { es_any: true, .. } if !policy.status.is_all() => return Err(Doubt::AnyStatus),
            Body::Full { es, .. } if !policy.status.contains(es) => {
                return Err(Doubt::Status { es: es.difference(policy.status) });
            }
            _ => {}
        }
        if let Some(alm) = response.alm().filter(|alm| !policy.alarms.contains(*alm)) {
            return Err(Doubt::Alarms { alarms: alm.difference(policy.alarms) });
        }
        match self.position(response) {
            Ok(position) => Ok(position),
            Err(Error::UpperBits { width }) => Err(Doubt::UpperBits { width }),
            Err(_) => Err(Doubt::Absent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::data::Data;
    use crate::number::{EncoderAddress, U17, U40};
    use crate::status::PmAlm;
    use servowire_core::U24;

    const EA: EncoderAddress = EncoderAddress::ZERO;

    fn response(command: Command, es: EncoderStatus, data: Data) -> Response {
        Response::new(EA, command, es, data)
    }

    #[test]
    fn every_status_and_every_alarm_is_a_doubt() {
        let twenty = Resolution::new(20, 16).unwrap();
        let abs = U40::truncate(5);
        for bits in 0..16 {
            let es = EncoderStatus::from_bits_truncate(bits);
            let whole = response(Command::Abs40, es, Data::Abs40 { abs });
            let want = if es.is_empty() { Ok(5) } else { Err(Doubt::Status { es }) };
            assert_eq!(twenty.read(&whole, Policy::STRICT).map(|p| p.single_turn), want);
            assert_eq!(twenty.read(&whole, Policy::STRICT.tolerating(es)).map(|p| p.single_turn), Ok(5));
        }
        for alm in Alm::all().iter() {
            let low = response(
                Command::Abs24Status,
                EncoderStatus::empty(),
                Data::Abs24Status { abs: U24::truncate(5), alm },
            );
            assert_eq!(twenty.read(&low, Policy::STRICT), Err(Doubt::Alarms { alarms: alm }));
            assert!(twenty.read(&low, Policy::STRICT.tolerating_alarms(alm)).is_ok());
        }
    }

    /// The drive whose policy this is lives with BATT where it does not count turns, and with nothing else.
    #[test]
    fn an_encoder_without_its_battery_turns_all_the_same() {
        let twenty = Resolution::new(20, 0).unwrap();
        let abs = U24::truncate(5);
        for alm in Alm::all().iter() {
            let es = EncoderStatus::of_alarms(alm);
            let low = response(Command::Abs24Status, es, Data::Abs24Status { abs, alm });
            assert_eq!(twenty.read(&low, Policy::SINGLE_TURN).is_ok(), alm == Alm::BATT, "{alm}");
        }
    }

    #[test]
    fn what_is_no_position() {
        let twenty = Resolution::new(20, 16).unwrap();
        let none = EncoderStatus::empty();
        let upper = response(Command::Abs24High, none, Data::Abs24High { abs: U24::truncate(5) });
        let status = Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() };
        let short = Response::abs17(EA, none, U17::truncate(5));
        for other in [upper, response(Command::Status, none, status), short] {
            assert_eq!(twenty.read(&other, Policy::STRICT), Err(Doubt::Absent));
        }
        let seventeen = Resolution::new(17, 16).unwrap();
        assert_eq!(seventeen.read(&short, Policy::STRICT).map(|p| p.single_turn), Ok(5));
        let doubtful = Response::abs17(EA, EncoderStatus::BATT, U17::truncate(5));
        assert_eq!(seventeen.read(&doubtful, Policy::STRICT.tolerating(EncoderStatus::BATT)), Err(Doubt::AnyStatus));
        assert!(seventeen.read(&doubtful, Policy::STRICT.tolerating(EncoderStatus::all())).is_ok());
        let wide = response(Command::Abs40, none, Data::Abs40 { abs: U40::truncate(1 << 36) });
        assert_eq!(twenty.read(&wide, Policy::STRICT), Err(Doubt::UpperBits { width: 36 }));
    }
}
