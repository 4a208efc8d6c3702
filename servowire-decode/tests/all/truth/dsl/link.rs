//! What kinds of links there are.

/// What kind of link it is.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    /// H-frames after the start-up.
    pub(crate) frames: usize,
    /// Whether the start-up is there, so that the identifier is.
    pub(crate) start_up: bool,
    /// Bits of the position, and whether it has a sign.
    pub(crate) width: u32,
    pub(crate) signed: bool,
    /// First position, speed in steps a frame, and how much that changes from frame to frame at most.
    pub(crate) from: i64,
    pub(crate) speed: i64,
    pub(crate) jolt: i64,
    /// Eighths of a bit of a frame of sync mode beyond the 108 bits and six for each block; none: free running.
    pub(crate) window: Option<i64>,
    /// Blocks of stuffing.
    pub(crate) stuffing: usize,
    /// From the end of PARA and the bit after it to the answer, in bits.
    pub(crate) delay: f64,
    /// TRAILER has five driven zeros instead of four.
    pub(crate) five_zeros: bool,
    /// Each answer begins with running disparity - instead of going on.
    pub(crate) anew: bool,
    /// Messages on both channels.
    pub(crate) messages: bool,
    /// Share of answers with a flipped bit, and of heads.
    pub(crate) damaged: f64,
    pub(crate) heads_damaged: f64,
    /// The master's and encoder's clock, as a share of the nominal one.
    pub(crate) clock: f64,
    pub(crate) begins_low: bool,
}

impl Link {
    pub(crate) const PLAIN: Self = Self {
        frames: 88,
        start_up: false,
        width: 32,
        signed: false,
        from: 3_000_000,
        speed: 0,
        jolt: 20,
        window: None,
        stuffing: 0,
        delay: 0.8,
        five_zeros: false,
        anew: false,
        messages: false,
        damaged: 0.0,
        heads_damaged: 0.0,
        clock: 1.0,
        begins_low: false,
    };

    /// A position as a number: with its sign where the identifier says that there is one.
    pub(super) fn counts(&self, position: i64) -> i64 {
        let raw = self.forty(position) as i64;
        if self.start_up && raw >> 39 == 1 { raw - (1 << 40) } else { raw }
    }

    /// 40 bits as the encoder sends them.
    pub(super) fn forty(&self, position: i64) -> u64 {
        let modulus = 1_i64 << self.width;
        let within = position.rem_euclid(modulus);
        let value = if self.signed && within >= modulus / 2 { within - modulus } else { within };
        value as u64 & 0xff_ffff_ffff
    }
}
