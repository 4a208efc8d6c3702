use servowire_core::Angle;

/// Where the shaft is, in the units of a [`Resolution`](crate::Resolution).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Position {
    /// Counts in the turn.
    pub single_turn: u32,
    /// Turns, with 16 bits -32768..=32767; beyond, the counter wraps round and OVFLOW is raised. 0 without a counter.
    pub turns: i32,
}

servowire_core::one_line!(Position { Self { single_turn, turns } => "turn {}, {} counts", turns, single_turn; });

/// A position that may be used, and when it was sampled: from [`Evidence::at`](crate::Evidence::at).
///
/// It has turns where the policy judged them. With [`Tolerated::SINGLE_TURN`](crate::Tolerated::SINGLE_TURN) they may be
/// anything, and are not here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sample {
    sampled_ns: u64,
    single_turn: u32,
    turns: Option<i32>,
    st_bits: u8,
}

servowire_core::one_line!(Sample {
    Self { single_turn, turns: Some(turns), sampled_ns, .. } => "turn {}, {} counts at {} ns", turns, single_turn, sampled_ns;
    Self { single_turn, turns: None, sampled_ns, .. } => "{} counts at {} ns", single_turn, sampled_ns;
});

impl Sample {
    pub(crate) const fn new(sampled_ns: u64, single_turn: u32, turns: Option<i32>, st_bits: u8) -> Self {
        Self { sampled_ns, single_turn, turns, st_bits }
    }

    /// The earliest instant at which it can have been sampled, the end of the request, in ns by the clock of the master.
    pub const fn sampled_ns(self) -> u64 {
        self.sampled_ns
    }

    /// Counts in the turn.
    pub const fn single_turn(self) -> u32 {
        self.single_turn
    }

    /// The place in the turn as an angle.
    pub const fn angle(self) -> Angle {
        match self.single_turn.checked_shl(32_u32.wrapping_sub(self.st_bits as u32)) {
            Some(bits) => Angle::from_bits(bits),
            // Never: an encoder has a bit of single turn at the least.
            None => Angle::ZERO,
        }
    }

    /// Turns, if the policy judged them.
    pub const fn turns(self) -> Option<i32> {
        self.turns
    }

    /// Both parts, if the policy judged the turns.
    pub const fn position(self) -> Option<Position> {
        match self.turns {
            Some(turns) => Some(Position { single_turn: self.single_turn, turns }),
            None => None,
        }
    }

    /// Both parts in counts, `turns * 2^st_bits + single_turn`, at most 40 bits wide; if the policy judged the turns.
    pub const fn counts(self) -> Option<i64> {
        match self.turns {
            Some(turns) => Some((turns as i64).wrapping_shl(self.st_bits as u32) | self.single_turn as i64),
            None => None,
        }
    }
}
