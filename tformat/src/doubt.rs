use crate::count::{Abm, Abs};
use crate::error::Error;
use crate::resolution::{Position, Resolution};
use crate::response::Response;
use crate::status::{Almc, StatusField};

/// Why a position must not be used for control. The raw fields of the response stay readable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Doubt {
    /// The response carries no such position: ID 2, the EEPROM, turns where only ABS comes.
    #[error("the response carries no such position")]
    Absent,
    /// Information bits of SF are set, which are always 0: the fields are not where they should be.
    #[error("the fields are shifted: status [{sf}]")]
    Shifted {
        /// The status.
        sf: StatusField,
    },
    /// The encoder says that the request was damaged (CA0, CA1): it may be a response to something else.
    #[error("the request was damaged: [{sf}]")]
    RequestDamaged {
        /// The status.
        sf: StatusField,
    },
    /// The encoder reports errors that are not tolerated.
    #[error("the encoder reports [{alarms}]")]
    Alarms {
        /// Those alarms.
        alarms: Almc,
    },
    /// EA0 or EA1 of a response without ALMC: some alarm that is not tolerated. ID 3 says which. In a response to ID 3: one
    /// that ALMC does not tell.
    #[error("the encoder reports errors: status [{sf}]")]
    Status {
        /// The status.
        sf: StatusField,
    },
    /// The response says that it comes from an encoder with another number of single-turn bits. Not checked where
    /// [`Resolution::with_upper_bits_ignored`] says that the encoder has rules of its own.
    #[error("the encoder calls itself {enid:#04x}, the resolution has {abs_bits} single-turn bits")]
    OtherEncoder {
        /// ENID of the response.
        enid: u8,
        /// Single-turn bits of the resolution.
        abs_bits: u8,
    },
    /// Bits above the width of the encoder are set.
    #[error("data field {value:#08x} has bits set that this encoder leaves 0: {excess:#08x}")]
    UpperBits {
        /// The 24-bit field.
        value: u32,
        /// Those of its bits that must be 0.
        excess: u32,
    },
    /// The position was sampled too long ago, or by a clock that was set back in the meantime; from
    /// [`Exchange`](crate::master::Exchange), which knows when.
    #[error("the position is {age_ns} ns old")]
    Old {
        /// How far the instant of sampling is away, in ns.
        age_ns: u64,
    },
}

/// Which alarms a drive lives with, and how old a position may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Policy {
    /// Alarms with which a position may be used.
    pub tolerated: Almc,
    /// The longest age of a position, in ns from the instant of sampling. Default: any.
    pub max_age_ns: u64,
}

impl Default for Policy {
    fn default() -> Self {
        Self::STRICT
    }
}

impl Policy {
    /// No alarm is tolerated, any age.
    pub const STRICT: Self = Self { tolerated: Almc::empty(), max_age_ns: u64::MAX };
    /// As one drive does that counts turns: an overflow of the turns is ignored, a low battery is a warning.
    pub const MULTI_TURN: Self = Self::STRICT.tolerating(Almc::OF.union(Almc::BA));
    /// As the same drive does where turns are not used: what concerns the turns and the battery is ignored.
    pub const SINGLE_TURN: Self =
        Self::STRICT.tolerating(Almc::OF.union(Almc::BA).union(Almc::BE).union(Almc::ME).union(Almc::OS));

    /// In spite of these alarms too.
    pub const fn tolerating(self, alarms: Almc) -> Self {
        Self { tolerated: self.tolerated.union(alarms), ..self }
    }

    /// Only up to this age, in ns from the instant of sampling.
    pub const fn with_max_age_ns(self, max_age_ns: u64) -> Self {
        Self { max_age_ns, ..self }
    }

    /// EA0 and EA1 stand for alarms that are not told.
    const fn summary(self, sf: StatusField) -> Result<(), Doubt> {
        let counting = sf.contains(StatusField::EA0) && !self.tolerated.contains(Almc::CE);
        let others = sf.contains(StatusField::EA1) && !self.tolerated.contains(Almc::IN_EA1);
        if counting || others { Err(Doubt::Status { sf }) } else { Ok(()) }
    }
}

impl Resolution {
    /// The position of a response, if it may be used: the request was not damaged, no alarm but the tolerated ones is
    /// set, and the fields fit the widths. It needs ABS and ABM, thus ID 3; with a resolution without turns any response
    /// with ABS will do.
    ///
    /// That it is no older than its request is the work of [`Transaction`](crate::master::Transaction), which also gives
    /// the instant of sampling; [`Exchange::position`](crate::master::Exchange::position) looks at the age too.
    ///
    /// # Errors
    /// [`Doubt`], in the order in which its variants are declared.
    ///
    /// ```
    /// use tformat::{Doubt, Almc, Policy, Request, Resolution, Response};
    /// let bytes = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];
    /// let response = Response::parse(Request::ReadAll, &bytes)?;
    /// let resolution = Resolution::new(23, 16)?;
    /// assert_eq!(resolution.read(&response, Policy::MULTI_TURN), Err(Doubt::Alarms { alarms: Almc::BE }));
    /// assert_eq!(resolution.read(&response, Policy::SINGLE_TURN)?.abs, 3_915_817);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub const fn read(self, response: &Response, policy: Policy) -> Result<Position, Doubt> {
        let abm = match response {
            Response::ReadAll(data) => data.abm,
            _ if self.abm_bits() == 0 => Abm::truncate(0),
            _ => return Err(Doubt::Absent),
        };
        let abs = match self.judged(response, policy) {
            Ok(abs) => abs,
            Err(doubt) => return Err(doubt),
        };
        match self.position(abs, abm) {
            Ok(position) => Ok(position),
            Err(error) => Err(width(error)),
        }
    }

    /// As [`read`](Self::read) for the single-turn position alone, in counts: from ID 0, 3, 7, 8 or C.
    ///
    /// # Errors
    /// [`Doubt`].
    pub const fn read_single_turn(self, response: &Response, policy: Policy) -> Result<u32, Doubt> {
        match self.judged(response, policy) {
            Ok(abs) => match self.single_turn(abs) {
                Ok(counts) => Ok(counts),
                Err(error) => Err(width(error)),
            },
            Err(doubt) => Err(doubt),
        }
    }

    /// ABS, if neither status nor alarms speak against it.
    const fn judged(self, response: &Response, policy: Policy) -> Result<Abs, Doubt> {
        let (Some(sf), Some(abs)) = (response.status(), response.abs()) else { return Err(Doubt::Absent) };
        if sf.bits() & 0x0f != 0 {
            return Err(Doubt::Shifted { sf });
        }
        if sf.intersects(StatusField::REQUEST_DAMAGED) {
            return Err(Doubt::RequestDamaged { sf });
        }
        if let Response::ReadAll(data) = response {
            let alarms = data.almc.difference(policy.tolerated);
            if !alarms.is_empty() {
                return Err(Doubt::Alarms { alarms });
            }
            // EA0 and EA1 without the alarm that they stand for: one of the two bytes is wrong.
            if let Err(doubt) = policy.summary(sf.difference(StatusField::of_alarms(data.almc))) {
                return Err(doubt);
            }
            if let Some(hint) = Self::from_enid(data.enid) {
                if self.checks_upper_bits() && hint.resolution.abs_bits() != self.abs_bits() {
                    return Err(Doubt::OtherEncoder { enid: data.enid, abs_bits: self.abs_bits() });
                }
            }
        } else if let Err(doubt) = policy.summary(sf) {
            return Err(doubt);
        }
        Ok(abs)
    }
}

/// A field that is wider than the encoder's.
const fn width(error: Error) -> Doubt {
    match error {
        Error::UpperBits { value, excess } => Doubt::UpperBits { value, excess },
        // Never: the widths are all that is refused.
        _ => Doubt::Absent,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{AllData, MultiTurn, SingleTurn};

    const R23: Resolution = match Resolution::new(23, 16) {
        Ok(resolution) => resolution,
        Err(_) => panic!(),
    };

    fn all(sf: u8, almc: u8) -> AllData {
        AllData {
            sf: StatusField::from_bits_retain(sf),
            abs: Abs::truncate(0x12_3456),
            enid: 0x17,
            abm: Abm::truncate(0xfffe),
            almc: Almc::from_bits_retain(almc),
        }
    }

    fn single(sf: u8) -> Response {
        Response::ReadSingleTurn(SingleTurn { sf: StatusField::from_bits_retain(sf), abs: Abs::truncate(7) })
    }

    #[test]
    fn a_position_without_doubt() {
        let position = R23.read(&Response::ReadAll(all(0, 0)), Policy::STRICT).unwrap();
        assert_eq!((position.abs, position.turns), (0x12_3456, -2));
        assert_eq!(R23.read_single_turn(&single(0), Policy::STRICT), Ok(7));
        let without_turns = Resolution::new(23, 0).unwrap();
        assert_eq!(without_turns.read(&single(0), Policy::STRICT).map(|p| (p.abs, p.turns)), Ok((7, 0)));
    }

    /// Each alarm is a doubt unless the policy tolerates it, in ID 3 and, as far as SF tells, elsewhere.
    #[test]
    fn alarms() {
        for policy in [Policy::STRICT, Policy::MULTI_TURN, Policy::SINGLE_TURN, Policy::STRICT.tolerating(Almc::all())]
        {
            for bits in 0..=255 {
                let almc = Almc::from_bits_retain(bits);
                let sf = StatusField::of_alarms(almc).bits();
                let alarms = almc.difference(policy.tolerated);
                let read = R23.read(&Response::ReadAll(all(sf, bits)), policy);
                assert_eq!(read.err(), (!alarms.is_empty()).then_some(Doubt::Alarms { alarms }));
                let tolerated = policy.tolerated.bits();
                let doubt = (bits & 4 & !tolerated) != 0 || (bits & 0xf0 != 0 && tolerated & 0xf0 != 0xf0);
                assert_eq!(R23.read_single_turn(&single(sf), policy).is_err(), doubt, "{almc}");
            }
        }
        // The drive whose policy this is: OF ignored, BA a warning; without turns BA, BE, ME and OS ignored too.
        assert_eq!((Policy::MULTI_TURN.tolerated.bits(), Policy::SINGLE_TURN.tolerated.bits()), (0x88, 0xe9));
        assert_eq!(Policy::default(), Policy::STRICT);
    }

    /// SF tells of an alarm that ALMC does not show: an encoder that leaves SF at 0 does not, damage does.
    #[test]
    fn a_status_without_its_alarm_is_a_doubt() {
        for (sf, almc, doubtful) in [(0x10, 0, true), (0x20, 0x04, true), (0x10, 0x80, true), (0, 0x84, false)] {
            let any = Policy::STRICT.tolerating(Almc::from_bits_retain(almc));
            let want = doubtful.then_some(Doubt::Status { sf: StatusField::from_bits_retain(sf) });
            assert_eq!(R23.read(&Response::ReadAll(all(sf, almc)), any).err(), want, "{sf:#x} {almc:#x}");
        }
    }

    #[test]
    fn damage_and_shifts() {
        let read = |sf: u8| R23.read(&Response::ReadAll(all(sf, 0)), Policy::STRICT);
        let (shifted, damaged) = (StatusField::from_bits_retain(0x02), StatusField::CA1);
        assert_eq!(read(0x02), Err(Doubt::Shifted { sf: shifted }));
        assert_eq!(read(0x80), Err(Doubt::RequestDamaged { sf: damaged }));
        assert_eq!(read(0x40), Err(Doubt::RequestDamaged { sf: StatusField::CA0 }));
        assert!(R23.read_single_turn(&single(0x40), Policy::STRICT).is_err());
    }

    #[test]
    fn widths() {
        let wide = AllData { abs: Abs::truncate(0x80_0000), ..all(0, 0) };
        let doubt = Doubt::UpperBits { value: 0x80_0000, excess: 0x80_0000 };
        assert_eq!(R23.read(&Response::ReadAll(wide), Policy::STRICT), Err(doubt));
        assert_eq!(R23.read_single_turn(&Response::ReadAll(wide), Policy::STRICT), Err(doubt));
        let turns = AllData { abm: Abm::truncate(0x1_0000), ..all(0, 0) };
        let doubt = Doubt::UpperBits { value: 0x1_0000, excess: 0x1_0000 };
        assert_eq!(R23.read(&Response::ReadAll(turns), Policy::STRICT), Err(doubt));
        let seventeen = Resolution::new(17, 16).unwrap();
        let doubt = Doubt::OtherEncoder { enid: 0x17, abs_bits: 17 };
        assert_eq!(seventeen.read(&Response::ReadAll(all(0, 0)), Policy::STRICT), Err(doubt));
        let own_rules = seventeen.with_upper_bits_ignored().read(&Response::ReadAll(all(0, 0)), Policy::STRICT);
        assert_eq!(own_rules.map(|position| position.abs), Ok(0x3456));
        // An encoder ID that no document knows says nothing.
        let unknown = AllData { enid: 0x99, abs: Abs::truncate(5), ..all(0, 0) };
        assert!(seventeen.read(&Response::ReadAll(unknown), Policy::STRICT).is_ok());
    }

    #[test]
    fn what_carries_no_position() {
        let turns = Response::ReadMultiTurn(MultiTurn { sf: StatusField::empty(), abm: Abm::truncate(1) });
        assert_eq!(R23.read(&turns, Policy::STRICT), Err(Doubt::Absent));
        assert_eq!(R23.read_single_turn(&turns, Policy::STRICT), Err(Doubt::Absent));
        // ABS alone is no position of an encoder that counts turns.
        assert_eq!(R23.read(&single(0), Policy::STRICT), Err(Doubt::Absent));
    }
}
