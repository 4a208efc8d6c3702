//! How much a hostile test has to live through, and what becomes of its calls.

use std::fmt::Debug;

use servowire_world::{Kind, Rates, Seed, Tally, Verdict, first_seed, wanted_events};

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

/// Why a value may be older than its request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excuse {
    /// The host was preempted, or its UART lost bytes: that breaks the latency budget.
    Preempted,
    /// No driver could have told it from an answer.
    Coincidence,
}

impl Excuse {
    /// Neither, or one of them.
    pub fn of(preempted: bool, coincidence: bool) -> Option<Self> {
        if preempted { Some(Self::Preempted) } else { coincidence.then_some(Self::Coincidence) }
    }
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
    /// Old values that were excused: the host had been preempted and so broke the latency budget.
    pub preempted: u64,
    /// Old values that were excused: no driver could have told them from an answer.
    pub coincidences: u64,
    /// Answers of a bus that were lost and not judged: a response whose check is right by chance overlapped them.
    pub chances: u64,
}

/// Scenario after scenario, until there was enough of everything: `play` plays the one of a seed and gives what happened in it.
pub fn live_through(mut play: impl FnMut(&mut Calls, u64) -> Tally) -> Calls {
    let mut calls = Calls::default();
    for seed in first_seed().. {
        let said = Seed(seed);
        let happened = play(&mut calls, seed);
        drop(said);
        calls.tally.add(&happened);
        if !calls.go_on() {
            break;
        }
    }
    calls.end();
    calls
}

impl Calls {
    /// Counts a call: it was dropped, gave a value of which the truth is known, or failed. `whole`: its answer came through
    /// unhurt, so it must not be lost. With an excuse the value may be older than the request.
    pub fn count<E: Debug>(
        &mut self,
        outcome: Option<Result<Verdict, E>>,
        whole: bool,
        excuse: Option<Excuse>,
        seed: u64,
        call: usize,
    ) {
        match outcome {
            None => self.dropped += 1,
            Some(Ok(verdict)) => {
                if matches!(verdict, Verdict::Old { .. }) {
                    assert!(excuse.is_some(), "seed {seed}, call {call}: {verdict:?}");
                    self.excuse(excuse);
                }
                assert!(!whole || verdict == Verdict::Fresh, "seed {seed}, call {call}: {verdict:?}");
                self.good += 1;
                self.whole += u64::from(whole);
                self.forged += u64::from(verdict != Verdict::Fresh);
            }
            Some(Err(error)) => {
                assert!(!whole, "seed {seed}, call {call}: {error:?}");
                self.failed += 1;
            }
        }
    }

    /// An old value was excused.
    pub fn excuse(&mut self, excuse: Option<Excuse>) {
        self.preempted += u64::from(excuse == Some(Excuse::Preempted));
        self.coincidences += u64::from(excuse == Some(Excuse::Coincidence));
    }

    /// Whether there has to be more: 100,000 faults always, and as many as the environment wants.
    fn go_on(&self) -> bool {
        self.tally.all_faults() < wanted_events(0).max(FAULTS)
    }

    /// Says what there was, and that it was enough of everything.
    fn end(&self) {
        let Self { tally, good, failed, whole, dropped, forged, preempted, coincidences, chances } = self;
        println!("{tally}");
        println!("{good} good ({whole} of them unhurt, {forged} forged), {failed} failed, {dropped} dropped");
        println!("excused: {preempted} old in preempted calls, {coincidences} old by chance, {chances} lost by chance");
        assert!(tally.all_faults() >= FAULTS);
        for kind in Kind::ALL {
            assert!(tally.of(kind) >= FAULTS / 100, "{kind:?} only {} times", tally.of(kind));
        }
        assert!(*whole > FAULTS / 10 && *failed > FAULTS / 10 && *forged < tally.all_faults() / 100);
    }
}
