//! The items of a part program.

use super::AXES;

/// A straight line of a part program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// End point, in mm.
    pub(super) to: [f64; AXES],
    /// Feed in um/s; `None` for as fast as the machine can.
    pub(super) feed: Option<u32>,
    /// It continues an arc, of which the line before it is another chord.
    pub(super) bends: bool,
}

/// What a machine has to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Item {
    Line(Line),
    /// Come to rest, for this many ns.
    Rest(u64),
    /// From here on corners may be rounded by this many um; `None`: by the machine's setting.
    Deviation(Option<u32>),
}
