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

/// The seed with which a hostile test begins: what `SEED` says, or 0. A long test can be run in parts, and one run again.
///
/// # Panics
/// If `SEED` is set and is no whole number.
#[must_use]
#[expect(clippy::expect_used, reason = "a test that cannot do what was asked has failed")]
pub fn first_seed() -> u64 {
    std::env::var("SEED").map_or(0, |text| text.parse().expect("SEED should be a whole number, as 1234"))
}

/// While this lives, a panic of the thread says with which seed it came.
#[derive(Debug)]
pub struct Seed(pub u64);

impl Drop for Seed {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("SEED={} begins with it", self.0);
        }
    }
}
