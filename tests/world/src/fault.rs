use oorandom::Rand64;

/// What happens to a transmission or to one of its units. Faults combine in any way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The unit does not leave; the line is idle in its place.
    Drop,
    /// The unit comes twice.
    Repeat,
    /// One bit of the unit turns round, start and stop bit included (`bit % length`).
    Flip {
        /// Which.
        bit: u16,
    },
    /// The speaker pauses in front of the unit.
    Idle {
        /// For how many bits.
        bits: u16,
    },
    /// This unit and all after it do not leave.
    Cut,
    /// The whole transmission comes later, possibly into the next request.
    Delay {
        /// By how much.
        ns: u32,
    },
    /// A unit out of nowhere, its first bit this long after the end of the transmission.
    Noise {
        /// The distance.
        after_ns: u32,
    },
    /// A speaker that nobody asked, starting this long after the start of the transmission.
    Foreign {
        /// The distance.
        after_ns: u32,
        /// How many units.
        units: u8,
        /// Whether it repeats the answer before; otherwise its units are random.
        replay: bool,
    },
    /// One receiver does not hear the unit, all others do.
    Miss {
        /// 0: the host, 1...: the devices (modulo their number).
        receiver: u8,
    },
    /// What the host has received is handed over after the unit, whatever its delivery is.
    Split,
    /// From the end of the unit on the host does nothing for a time: no delivery, no look at the clock.
    Preempt {
        /// How long.
        ns: u32,
    },
    /// For this transmission of the host the echo is on if it is off, and off if it is on.
    EchoSwap,
}

/// A [`Fault`] without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "see Fault")]
pub enum Kind {
    Drop,
    Repeat,
    Flip,
    Idle,
    Cut,
    Delay,
    Noise,
    Foreign,
    Miss,
    Split,
    Preempt,
    EchoSwap,
}

impl Kind {
    /// All, in the order of [`Fault`].
    pub const ALL: [Self; 12] = [
        Self::Drop,
        Self::Repeat,
        Self::Flip,
        Self::Idle,
        Self::Cut,
        Self::Delay,
        Self::Noise,
        Self::Foreign,
        Self::Miss,
        Self::Split,
        Self::Preempt,
        Self::EchoSwap,
    ];

    /// A fault of this kind; `small` and `ns` become its numbers.
    fn fault(self, small: u16, ns: u32) -> Fault {
        match self {
            Self::Drop => Fault::Drop,
            Self::Repeat => Fault::Repeat,
            Self::Flip => Fault::Flip { bit: small },
            Self::Idle => Fault::Idle { bits: 1 + small % 64 },
            Self::Cut => Fault::Cut,
            Self::Delay => Fault::Delay { ns },
            Self::Noise => Fault::Noise { after_ns: ns },
            Self::Foreign => Fault::Foreign { after_ns: ns, units: 1 + small as u8 % 12, replay: small & 0x80 != 0 },
            Self::Miss => Fault::Miss { receiver: small as u8 },
            Self::Split => Fault::Split,
            Self::Preempt => Fault::Preempt { ns },
            Self::EchoSwap => Fault::EchoSwap,
        }
    }

    /// Whether it concerns a unit and not the transmission.
    const fn is_of_unit(self) -> bool {
        !matches!(self, Self::Delay | Self::Noise | Self::Foreign | Self::EchoSwap)
    }
}

impl Fault {
    /// Its kind.
    pub const fn kind(self) -> Kind {
        match self {
            Self::Drop => Kind::Drop,
            Self::Repeat => Kind::Repeat,
            Self::Flip { .. } => Kind::Flip,
            Self::Idle { .. } => Kind::Idle,
            Self::Cut => Kind::Cut,
            Self::Delay { .. } => Kind::Delay,
            Self::Noise { .. } => Kind::Noise,
            Self::Foreign { .. } => Kind::Foreign,
            Self::Miss { .. } => Kind::Miss,
            Self::Split => Kind::Split,
            Self::Preempt { .. } => Kind::Preempt,
            Self::EchoSwap => Kind::EchoSwap,
        }
    }
}

/// A fault with its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Planned {
    /// Number of the transmission, counted from 0 over host and devices alike.
    pub transmission: u16,
    /// Number of the unit in it, modulo their number: a planned fault hits if its transmission takes place.
    pub unit: u8,
    /// What happens.
    pub fault: Fault,
}

impl Planned {
    /// Reads a fault out of any six bytes; zeros are a dropped first unit. Times go up to 8 ms.
    pub fn decode([transmission, unit, kind, a, b, c]: [u8; 6]) -> Self {
        let ns = u32::from(u16::from_le_bytes([b, c])) << (a % 8);
        let small = u16::from_le_bytes([b, c]);
        let fault = Kind::ALL[usize::from(kind) % Kind::ALL.len()].fault(small, ns);
        Self { transmission: transmission.into(), unit, fault }
    }
}

/// How often faults happen, in a million transmissions or units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rates {
    /// By [`Kind::ALL`].
    pub per_million: [u32; Kind::ALL.len()],
    /// The longest time that a random fault lasts. Short times are as likely as long ones on a logarithmic scale.
    pub longest_ns: u32,
}

impl Rates {
    /// No faults.
    pub const QUIET: Self = Self { per_million: [0; Kind::ALL.len()], longest_ns: 100_000 };
    /// About every third exchange is hurt in some way.
    pub const ROUGH: Self = Self { per_million: [20_000; Kind::ALL.len()], longest_ns: 100_000 };

    /// The same with another rate of one kind.
    #[must_use]
    pub const fn with(mut self, kind: Kind, per_million: u32) -> Self {
        self.per_million[kind as usize] = per_million;
        self
    }

    fn draw(&self, kind: Kind, random: &mut Rand64) -> Option<Fault> {
        let rate = u64::from(self.per_million[kind as usize]);
        if rate == 0 || random.rand_range(0..1_000_000) >= rate {
            return None;
        }
        let octaves = u64::from(32 - self.longest_ns.leading_zeros());
        let top = 1_u64 << random.rand_range(0..octaves + 1);
        let ns = random.rand_range(0..top.min(u64::from(self.longest_ns)) + 1);
        Some(kind.fault(random.rand_u64() as u16, ns as u32))
    }
}

/// Which faults happen: planned ones, and random ones from a seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// Those with a place.
    pub planned: Vec<Planned>,
    /// Those without.
    pub rates: Rates,
    random: Rand64,
}

impl Script {
    /// These faults and no others.
    pub fn planned(planned: Vec<Planned>) -> Self {
        Self { planned, rates: Rates::QUIET, random: Rand64::new(0) }
    }

    /// Random faults; the same seed gives the same run.
    pub fn random(seed: u64, rates: Rates) -> Self {
        Self { planned: Vec::new(), rates, random: Rand64::new(seed.into()) }
    }

    /// The faults of one transmission, each with its unit.
    pub(crate) fn strike(&mut self, transmission: u64, units: usize) -> Vec<(usize, Fault)> {
        let here = |planned: &&Planned| u64::from(planned.transmission) == transmission && units > 0;
        let mut faults: Vec<_> =
            self.planned.iter().filter(here).map(|p| (usize::from(p.unit) % units, p.fault)).collect();
        for kind in Kind::ALL {
            let places = if kind.is_of_unit() { units } else { units.min(1) };
            for unit in 0..places {
                faults.extend(self.rates.draw(kind, &mut self.random).map(|fault| (unit, fault)));
            }
        }
        faults
    }

    /// Random bits, never 0: the damage of a collision, the content of noise.
    pub(crate) fn noise(&mut self) -> u64 {
        self.random.rand_u64() | 1
    }
}
