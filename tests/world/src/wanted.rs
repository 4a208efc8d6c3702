/// How much a hostile test has to live through: what `HOSTILE_EVENTS` says, or as much as is usual.
///
/// # Panics
/// If `HOSTILE_EVENTS` is set and is no whole number: a run that is much shorter than was asked for would pass for it.
#[must_use]
#[expect(clippy::expect_used, reason = "a test that cannot do what was asked has failed")]
pub fn wanted_events(usual: u64) -> u64 {
    std::env::var("HOSTILE_EVENTS")
        .map_or(usual, |text| text.parse().expect("HOSTILE_EVENTS should be a whole number, as 10000000"))
}
