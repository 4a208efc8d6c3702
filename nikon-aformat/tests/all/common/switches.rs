//! What the sources leave open, drawn for each run.

use std::collections::BTreeMap;

use nikon_aformat::bus::Addresses;
use nikon_aformat::device::{Behaviour, Ea, FirstRead, Restart, ShownAddress, Shows};

use super::line::{USUAL_FAULTS, faults};

/// One setting of all open points.
#[derive(Debug, Clone, Copy)]
pub struct Switches(u64);

/// How often each setting was drawn.
pub type Mix = BTreeMap<&'static str, u64>;

impl Switches {
    /// Each setting of each point is equally likely, whatever the others are.
    pub fn draw(seed: u64) -> Self {
        let mut word = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self(word ^ word >> 31)
    }

    /// Which of `settings` point number `point` has.
    fn of<T: Copy, const N: usize>(self, point: u32, settings: [T; N]) -> T {
        settings[(self.0 >> (7 * point)) as usize % 128 % N]
    }

    pub fn turn_around(self) -> (&'static str, u32) {
        let settings = [("0.9 us", 900), ("2.8 us", 2_800), ("5 us", 5_000), ("15 us", 15_000)];
        self.of(0, settings)
    }

    pub fn busy_in_first_read(self) -> (&'static str, bool) {
        self.of(1, [("ES0 set in the first read", true), ("ES0 clear in the first read", false)])
    }

    /// `None` stands for the word that was stored before.
    pub fn undetermined(self) -> (&'static str, Option<u16>) {
        let settings = [
            ("undetermined: a5a5", Some(0xa5a5)),
            ("undetermined: 0000", Some(0)),
            ("undetermined: ffff", Some(0xffff)),
            ("undetermined: the word before", None),
        ];
        self.of(2, settings)
    }

    pub fn reset_shows_in_the_eighth(self) -> (&'static str, bool) {
        self.of(3, [("a reset shows in the eighth", true), ("a reset shows in the ninth", false)])
    }

    pub fn order(self) -> (&'static str, Order) {
        let settings = [
            ("a slot for each address", Order::Slots),
            ("responses close up", Order::ClosedUp),
            ("the highest address first", Order::Descending),
        ];
        self.of(4, settings)
    }

    pub fn all_answer(self) -> (&'static str, bool) {
        self.of(5, [("EA: the highest that answers", false), ("EA: all answer", true)])
    }

    pub fn shows_old_address(self) -> (&'static str, bool) {
        self.of(6, [("11 and 20 show the new address", false), ("11 and 20 show the old address", true)])
    }

    pub fn counts_its_own(self) -> (&'static str, bool) {
        self.of(7, [("any request restarts the count", false), ("only an own request restarts the count", true)])
    }

    /// How the encoder with address `ea` behaves, of those that are there the one with number `index`.
    pub fn behaviour(self, ea: u8, index: u8) -> Behaviour {
        let mut behaviour = Behaviour::new().with_response_delay_ns(self.turn_around().1);
        if let Some(word) = self.undetermined().1 {
            behaviour = behaviour.with_undetermined(word);
        }
        if !self.busy_in_first_read().1 {
            behaviour = behaviour.with_first_read(FirstRead::Ready);
        }
        if self.reset_shows_in_the_eighth().1 {
            behaviour = behaviour.with_reset_shows(Shows::Eighth);
        }
        if self.all_answer().1 {
            behaviour = behaviour.with_ea(Ea::All);
        }
        if self.shows_old_address().1 {
            behaviour = behaviour.with_shown_address(ShownAddress::Old);
        }
        if self.counts_its_own().1 {
            behaviour = behaviour.with_restart(Restart::Own);
        }
        match self.order().1 {
            Order::Slots => behaviour,
            Order::ClosedUp => behaviour.with_place(Some(index)),
            Order::Descending => behaviour.with_place(Some(7 - ea)),
        }
    }

    /// Who is there on a bus, always somebody: all eight once in four times.
    pub fn present(self) -> Addresses {
        match self.of(8, [0, 1, 2, 3]) {
            0 => Addresses::ALL,
            _ => Addresses::from_bits((self.0 >> 24) as u8 | 1 << (self.0 >> 61)),
        }
    }

    /// Counts what was drawn.
    pub fn note(self, mix: &mut Mix) {
        let names = [
            self.turn_around().0,
            self.busy_in_first_read().0,
            self.undetermined().0,
            self.reset_shows_in_the_eighth().0,
            self.order().0,
            self.all_answer().0,
            self.shows_old_address().0,
            self.counts_its_own().0,
        ];
        for name in names {
            *mix.entry(name).or_default() += 1;
        }
    }
}

/// Who answers a multi-response request after whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    Slots,
    ClosedUp,
    Descending,
}

/// Every setting of every point was drawn, in a run of the usual length or a longer one.
pub fn assert_all_drawn(mix: &Mix) {
    if faults() < USUAL_FAULTS {
        return;
    }
    assert_eq!(mix.len(), 4 + 2 + 4 + 2 + 3 + 2 + 2 + 2, "{mix:?}");
}
