//! Times of a counter of 32 bits, of readings one after the other.

use servowire_core::{ClockError, TickRate, TimeBase};

use super::{Tally, Topic, each};

pub(crate) const TOPICS: &[Topic] = &[("core/time", time)];

/// What the counter reads after 0xffff_0000 at the start, and the time, ns.
type Row = (&'static str, u32, Result<u64, ClockError>);

/// A tick is 1000 / 133 ns: 65,536 ticks are 492,751.88 ns, 2^31 - 1 more of them 16,146,986,338.35 ns, and 133 are 1,000 ns.
const ROWS: [Row; 5] = [
    ("start", 0xffff_0000, Ok(0)),
    ("wrap", 0, Ok(492_752)),
    ("half", 0x7fff_ffff, Ok(16_146_986_338)),
    ("back", 0x7fff_ff7a, Err(ClockError::Backwards { by_ns: 1_000 })),
    ("on", 0x7fff_ffff, Ok(16_146_987_338)),
];

fn time() -> Tally {
    let mut time = TimeBase::<32>::new(TickRate::of::<133_000_000>(), ROWS[0].1);
    let times = ROWS.map(|(_, counter, _)| time.now_ns(counter));
    let rows: [_; 5] = core::array::from_fn(|row| (ROWS[row], times[row]));
    each(&rows, |((name, ..), _)| name, |((.., want), got)| want == got)
}
