//! How much a hostile test has to live through, and what becomes of its calls.

#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]

use servowire_world::{Kind, Rates, Tally};

/// Faults that every driver has to survive, whatever the environment says.
pub const FAULTS: u64 = 100_000;

/// Every kind of fault, about one a call, and none so long that it reaches over several calls. Those of a whole transmission have
/// fewer places than those of a unit, so they are more frequent there.
pub fn rates(units: u32) -> Rates {
    let of_unit = Rates { per_million: [96_000 / units; Kind::ALL.len()], longest_ns: 60_000 };
    [Kind::Delay, Kind::Noise, Kind::Foreign, Kind::EchoSwap]
        .into_iter()
        .fold(of_unit, |rates, kind| rates.with(kind, 20_000))
}

/// As many events (faults, transmissions and units) as the environment wants; 100,000 faults are always wanted.
pub fn events() -> u64 {
    std::env::var("HOSTILE_EVENTS").ok().and_then(|events| events.parse().ok()).unwrap_or(0)
}

/// Calls, counted.
#[derive(Debug, Default)]
pub struct Calls {
    pub tally: Tally,
    pub good: u64,
    pub failed: u64,
    /// Of the good ones: with an answer that nothing had hurt, which must not be lost.
    pub whole: u64,
    pub dropped: u64,
    /// Good values that are no answer to the request, or nobody's: the check of the protocol does not see it.
    pub forged: u64,
}

impl Calls {
    /// Whether there has to be more.
    pub fn go_on(&self) -> bool {
        self.tally.all_faults() < FAULTS || self.tally.events() < events()
    }

    /// Says what there was, and that it was enough of everything.
    pub fn end(&self) {
        let Self { tally, good, failed, whole, dropped, forged } = self;
        println!("{tally}");
        println!("{good} good ({whole} of them unhurt, {forged} forged), {failed} failed, {dropped} dropped");
        assert!(tally.all_faults() >= FAULTS);
        for kind in Kind::ALL {
            assert!(tally.of(kind) >= FAULTS / 100, "{kind:?} only {} times", tally.of(kind));
        }
        assert!(*whole > FAULTS / 10 && *failed > FAULTS / 10 && *forged < FAULTS / 100);
    }
}
