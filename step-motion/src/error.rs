servowire_core::errors! {
    /// Why limits, a plan or a request is refused. A refusal changes nothing.
    pub enum Error {
        /// An axis is still moving.
        #[error("the axis is still moving")]
        Moving = 1,
        /// Two steps could fall into one tick of the clock.
        #[error("{speed} steps/s is too fast for this clock, at most {limit}")]
        SpeedAboveClock = 2 {
            /// Greatest speed in steps/s, as requested.
            speed: u32,
            /// Half the number of ticks in a second.
            limit: u32,
        },
        /// A move has more steps than 31 bits can count.
        #[error("a move of {steps} steps, at most {limit}")]
        TooManySteps = 3 {
            /// Steps, as requested.
            steps: u32,
            /// The maximum: 2^31 - 1.
            limit: u32,
        },
        /// There is no room for another line.
        #[error("the queue of lines is full")]
        QueueFull = 4,
        /// An axis has 0 steps per metre.
        #[error("an axis with 0 steps per metre")]
        NoScale = 5,
        /// The ends of an arc are not on one circle, or it is too large.
        #[error("an arc from a radius of {from} to one of {to}")]
        ArcRadius = 6 {
            /// Radius at its start, in the caller's unit.
            from: u32,
            /// Radius at its end.
            to: u32,
        },
        /// A target lies outside the soft limits.
        #[error("target {target} is outside the soft limits")]
        SoftLimit = 7 {
            /// The target in steps; the nearest that 32 bits hold.
            target: i32,
        },
        /// The change of speed within the limits needs more steps than there are.
        #[error("{steps} steps are too few, at least {needed} needed")]
        TooShort = 8 {
            /// Steps, as requested.
            steps: u32,
            /// The smallest sufficient number.
            needed: u64,
        },
        /// A path has no such axis.
        #[error("axis {axis} of {axes}; the first is 0")]
        NoAxis = 9 {
            /// The axis, as requested.
            axis: u32,
            /// How many there are.
            axes: u32,
        },
    }
}
