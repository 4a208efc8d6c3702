use servowire_core::Angle;

/// Where the shaft is, in the units of a [`Resolution`](crate::Resolution).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Counts in the turn, `0..2^abs_bits`.
    pub single_turn: u32,
    /// Turns: `-2^(abm_bits-1)..2^(abm_bits-1)`, or `0..2^abm_bits` if they are not signed.
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
    abs_bits: u8,
}

servowire_core::one_line!(Sample {
    Self { single_turn, turns: Some(turns), sampled_ns, .. } => "turn {}, {} counts at {} ns", turns, single_turn, sampled_ns;
    Self { single_turn, turns: None, sampled_ns, .. } => "{} counts at {} ns", single_turn, sampled_ns;
});

impl Sample {
    pub(crate) const fn new(sampled_ns: u64, single_turn: u32, turns: Option<i32>, abs_bits: u8) -> Self {
        Self { sampled_ns, single_turn, turns, abs_bits }
    }

    /// When it was sampled, in ns by the clock of the master.
    pub const fn sampled_ns(self) -> u64 {
        self.sampled_ns
    }

    /// Counts in the turn, `0..2^abs_bits`.
    pub const fn single_turn(self) -> u32 {
        self.single_turn
    }

    /// The place in the turn as an angle.
    pub const fn angle(self) -> Angle {
        Angle::from_bits(self.single_turn.wrapping_shl(32_u32.wrapping_sub(self.abs_bits as u32)))
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

    /// Both parts in counts, `turns * 2^abs_bits + single_turn`, at most 48 bits wide; if the policy judged the turns.
    pub const fn counts(self) -> Option<i64> {
        match self.turns {
            Some(turns) => Some((turns as i64).wrapping_shl(self.abs_bits as u32) | self.single_turn as i64),
            None => None,
        }
    }
}
