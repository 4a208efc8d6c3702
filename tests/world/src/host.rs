/// When the host is given what it has received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Delivery {
    /// Unit by unit, an interrupt each.
    Each,
    /// A DMA block is full, or the line has been idle for a time.
    Blocks {
        /// Units of a block, at least 1.
        units: u8,
        /// The time, counted from the end of the last unit.
        idle_ns: u32,
    },
    /// The line has been idle for a time.
    Idle {
        /// The time, counted from the end of the last unit.
        idle_ns: u32,
    },
}

/// Which end time the host gives to a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stamp {
    /// The end of its last unit on the line, as a timer that captures edges has it.
    Line,
    /// The clock when the interrupt is served, less the idle time that has triggered it: late by latency and preemption.
    Handler,
}

/// How the host hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Host {
    /// Whether it hears what it sends itself, whatever the master was told.
    pub echo: bool,
    /// When it is given what it has received.
    pub delivery: Delivery,
    /// Which time it is told.
    pub stamp: Stamp,
    /// From the cause of an interrupt to its handler.
    pub latency_ns: u32,
    /// Units that its receiver holds; what comes when it is full is lost. 0: any number.
    pub fifo: u8,
}

impl Host {
    /// Hears everything but itself at once.
    pub const IDEAL: Self = Self { echo: false, delivery: Delivery::Each, stamp: Stamp::Line, latency_ns: 0, fifo: 0 };

    /// The same with another delivery.
    #[must_use]
    pub const fn with_delivery(self, delivery: Delivery) -> Self {
        Self { delivery, ..self }
    }

    /// The same with the receiver on while it sends.
    #[must_use]
    pub const fn with_echo(self) -> Self {
        Self { echo: true, ..self }
    }
}
