//! The laws of time on the hostile line.
//!
//! `HOSTILE_EVENTS=100000 cargo test --release -p tformat --test all laws:: -- --nocapture` lives through as many faults in each test, and
//! prints what they were; 1,000 unless it is set. `SEED=1234` begins with another seed than 0.

use std::collections::{BTreeMap, BTreeSet};

use crate::bench::{Bench, Seen};
use proptest::prelude::*;
use servowire_core::Procedure;
use servowire_world::{Draw, Kind, Rates, Scenario, Seed, Tally, first_seed, scenarios, wanted_events};
use tformat::device::Behaviour;
use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, Line, MultiTurnZero, Reset, SingleTurnZero, Step};
use tformat::{Abm, Abs, Address, Almc, BitRate, Error, Page, Request, Resolution, Response};

/// Faults of a test, unless the environment says another number.
const FAULTS: u64 = 1_000;

/// Runs seed after seed until enough has happened, and prints what it was.
fn runs(name: &str, mut one: impl FnMut(u64) -> Bench) {
    let (mut tally, mut seen, mut seed) = (Tally::default(), Seen::default(), first_seed());
    let wanted = wanted_events(FAULTS);
    while tally.all_faults() < wanted {
        let said = Seed(seed);
        let bench = one(seed);
        drop(said);
        tally.add(&bench.tally());
        let s = bench.seen;
        seen.done += s.done;
        seen.failed += s.failed;
        seen.owed += s.owed;
        seen.forged += s.forged;
        seen.undetected += s.undetected;
        seen.beyond_budget += s.beyond_budget;
        seed += 1;
    }
    println!("{name}: seeds to {seed}, {tally}; {seen}");
    assert!(seen.done > 0 && seen.failed > 0 && seen.owed > 0, "the line was not hostile, or nothing but");
    for kind in Kind::ALL {
        assert!(tally.of(kind) > 0, "{kind:?} never happened");
    }
}

/// How acts that cannot be undone have ended.
#[derive(Debug, Default)]
struct Ends {
    done: u32,
    unknown: u32,
    not_done: u32,
    /// Not judged: the encoder believed a request that nobody had sent like that, or two readings were wrong ones.
    excused: u32,
    /// Judged by the state alone: requests of an attempt before may have come late.
    inherited: u32,
}

impl Ends {
    fn count<T>(&mut self, end: &Result<T, Error>) {
        *match end {
            Ok(_) => &mut self.done,
            Err(Error::EffectUnknown { .. }) => &mut self.unknown,
            Err(_) => &mut self.not_done,
        } += 1;
    }

    fn print(&self, name: &str) {
        let Self { done, unknown, not_done, excused, inherited } = self;
        println!(
            "{name}: {done} done, {unknown} unknown, {not_done} not done, {inherited} after an attempt, {excused} excused"
        );
        assert!(*done > 0 && *unknown > 0, "{self:?}");
    }
}

/// Law 5: one effect at the most, and the end says whether there was one. Any other error is that of the first exchange: nothing
/// was sent that has an effect.
fn done_once_at_most<T>(end: &Result<T, Error>, effects: u32, seed: u64) {
    assert!(effects <= 1, "{effects} effects, seed {seed}");
    match end {
        Ok(_) => assert_eq!(effects, 1, "seed {seed}"),
        Err(Error::EffectUnknown { .. }) => {}
        Err(error) => assert_eq!(effects, 0, "{error}, seed {seed}"),
    }
}

fn bench(seed: u64, rates: Rates) -> Bench {
    let rate = BitRate::ALL[(seed / 2) as usize % 2];
    let behaviour = Behaviour::numbered((seed * 37) as u16 % Behaviour::NUMBERED);
    let bench = Bench::new(Scenario::random(seed, rates), rate, behaviour, seed % 3 == 0);
    if seed % 4 == 1 { bench.mixing_up(seed) } else { bench }
}

/// So that ten exchanges in a row are whole in two of three runs, and hardly ever in the third.
fn procedure_rates(seed: u64) -> Rates {
    Rates { per_million: [[700, 2_000, 8_000][(seed / 8) as usize % 3]; Kind::ALL.len()], longest_ns: 100_000 }
}

const READS: [Request; 4] = [Request::ReadSingleTurn, Request::ReadAll, Request::ReadMultiTurn, Request::ReadEncoderId];

/// Laws 1 to 4 for single transactions, under all switches of the encoder.
#[test]
fn hostile_transactions() {
    runs("transactions", |seed| {
        let mut bench = bench(seed, Rates::ROUGH);
        for k in 0..60_usize {
            let request = READS[[0, 1, 0, 2, 0, 3][k % 6]];
            let at_ns = bench.ready_ns + (seed + k as u64) % 3 * 5_000;
            let _ = bench.exchange(request, at_ns);
        }
        bench
    });
}

/// Law 5: one zero at the most, and the three ends mean what they say, whatever an attempt that was dropped has left in the
/// encoder.
#[test]
fn hostile_zero_presets() {
    zeros("zero presets", Request::SetSingleTurnZero, |bench, seed| {
        bench.device.set_position(Abs::truncate(0x1000 + seed as u32 % 0x1000), Abm::truncate(3));
        let mut zero = SingleTurnZero::set_and_shift_commutation_angle(Resolution::new(23, 16).unwrap(), 10);
        bench.run(&mut zero)
    });
}

/// Law 5 for ID C that is read back, with a shaft that trembles on the boundary of a turn.
#[test]
fn hostile_turn_zeros() {
    zeros("turn zeros", Request::ResetTurnsAndErrors, |bench, seed| {
        bench.trembles = seed % 2 == 0;
        bench.device.set_position(Abs::truncate(0x7f_ffff), Abm::truncate(0x10 + seed as u32 % 0x1000));
        let mut zero = MultiTurnZero::set_and_lose_multi_turn_reference(Resolution::new(23, 16).unwrap(), 1);
        bench.run(&mut zero)
    });
}

/// A zero that is read back, in every scenario. In every second run up to nine requests of an attempt went before that nobody
/// saw the end of.
fn zeros<T>(name: &str, request: Request, set: impl Fn(&mut Bench, u64) -> Result<T, Error>) {
    let mut ends = Ends::default();
    runs(name, |seed| {
        let mut bench = bench(seed, procedure_rates(seed));
        bench.moves = false;
        bench.restarts = (seed % 5 == 0).then_some(Draw::seeded(seed));
        bench.device.set_position(Abs::truncate(0x1000), Abm::truncate(0x100));
        // A host that mixes requests up sends some of the ten by mistake besides.
        let dropped = if seed % 3 == 0 || bench.astray.is_some() { 0 } else { 1 + seed % 9 };
        for _ in 0..dropped {
            let at_ns = bench.ready_ns + 41_000;
            bench.wait(at_ns);
            let _ = bench.exchange(request, at_ns);
        }
        let earlier = bench.effects();
        let end = set(&mut bench, seed);
        // What was taken for a response to ID 8 or C is no excuse: it is read back. Nor is one wrong reading: the next contradicts it.
        // A request of the attempt before that the line held back, or repeated, is the tenth with nine more, and the twentieth with
        // nineteen: then there may be two effects, or one before the first reading.
        let tally = bench.tally();
        let moved = tally.of(Kind::Repeat) + tally.of(Kind::Delay) > 0;
        let inherited = dropped > 0 && (moved || bench.misheard > 0);
        let effects = bench.effects() - earlier;
        if bench.forged_requests > 0 || bench.misread > 1 {
            ends.excused += 1;
        } else if !inherited {
            done_once_at_most(&end, effects, seed);
            ends.count(&end);
        } else {
            let possible = match &end {
                Ok(_) => 1..=2,
                Err(Error::EffectUnknown { .. }) => 0..=2,
                Err(Error::NotDone { .. }) => 0..=0,
                Err(_) => 0..=1,
            };
            assert!(possible.contains(&effects), "seed {seed}: {:?}, {effects} effects", end.err());
            ends.inherited += 1;
        }
        bench
    });
    ends.print(name);
    assert!(ends.not_done > 0, "{ends:?}");
}

/// Law 5 for ID C and ID 8 alone: two attempts in a row, the second after whatever became of the first. Ten responses are no proof, but
/// what is said to be done and is not has its reason: the encoder heard what nobody had sent then, or an older response was
/// taken for one of the ten.
#[test]
fn hostile_resets() {
    let mut ends = Ends::default();
    runs("resets", |seed| {
        let mut bench = bench(seed, procedure_rates(seed));
        bench.moves = false;
        bench.device.set_position(Abs::truncate(5), Abm::truncate(7));
        let mut reset = match seed % 8 {
            0 | 1 => Reset::set_single_turn_zero_and_shift_commutation_angle(),
            _ => Reset::clear_turns_and_lose_multi_turn_reference(),
        };
        for _ in 0..2 {
            let before = bench.device.effects();
            let end = bench.run(&mut reset);
            let effects = bench.device.effects() - before;
            if bench.forged_requests > 0 {
                ends.excused += 1;
                return bench;
            }
            ends.count(&end);
            if end.is_err() || bench.misheard == 0 && bench.seen.forged + bench.seen.undetected == 0 {
                done_once_at_most(&end, effects, seed);
            }
            assert!(effects <= 1, "seed {seed}");
        }
        bench
    });
    ends.print("resets");
}

/// Errors may be cleared as often as one likes: they are gone when it is done, position and turns are not.
#[test]
fn hostile_error_resets() {
    runs("error resets", |seed| {
        let mut bench = bench(seed, procedure_rates(seed));
        bench.moves = false;
        bench.device.set_position(Abs::truncate(5), Abm::truncate(7));
        bench.device.raise_alarms(Almc::CE);
        bench.device.end_alarms(Almc::CE);
        let mut reset = Reset::clear_errors();
        let end = bench.run(&mut reset);
        if end.is_ok() && bench.misheard == 0 && bench.seen.forged + bench.seen.undetected == 0 {
            assert!(bench.device.almc().is_empty() && bench.device.effects() > 0, "seed {seed}");
        }
        assert!(bench.forged_requests > 0 || (bench.device.abs().get(), bench.device.abm().get()) == (5, 7));
        bench
    });
}

/// An access of which each repetition is looked at.
struct Watched {
    access: EepromAccess,
    /// What each cell was said to hold since it was last written to, and how often in a row.
    held: BTreeMap<u8, (u8, u32)>,
    /// Cells that were written to.
    written: BTreeSet<u8>,
    seed: u64,
}

impl Watched {
    fn new(access: EepromAccess, seed: u64) -> Self {
        Self { access, held: BTreeMap::new(), written: BTreeSet::new(), seed }
    }

    /// A write, to the page register too, is sent again only after the cell was read twice, was not busy, and held the same other
    /// value; a byte goes to a page that the register showed twice, or after a selection.
    fn send(&mut self, request: Request) {
        let [0x32, address, data, _] = *request.emit().as_bytes() else { return };
        let held = self.held.remove(&address);
        let evidence = self.written.insert(address) || held.is_some_and(|(held, times)| held != data && times > 1);
        assert!(evidence, "seed {}: {request} is sent again", self.seed);
        let page = self.held.get(&127).map_or(0, |(_, times)| *times);
        assert!(address == 127 || page + u32::from(self.written.contains(&127)) > 1, "seed {}: {request}", self.seed);
    }

    fn heard(&mut self, response: Response) {
        // With the busy flag the address is another one.
        if let [0xea, address, holds, _] = *response.emit().as_bytes() {
            let held = self.held.entry(address).or_insert((holds, 0));
            *held = if held.0 == holds { (holds, held.1 + 1) } else { (holds, 1) };
        }
    }
}

impl Procedure for Watched {
    type Request = Request;
    type Response = Response;
    type Value = u8;
    type Error = Error;

    fn start(&mut self, now_ns: u64) -> Step<u8> {
        let step = self.access.start(now_ns);
        assert!(matches!(step, Step::Send { .. }), "an access begins with a request");
        step
    }

    fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u8> {
        if let Ok(response) = outcome {
            self.heard(response);
        }
        let step = self.access.receive(outcome, ready_ns);
        if let Step::Send { request, .. } = step {
            self.send(request);
        }
        step
    }
}

/// Law 5 for the EEPROM: a byte is written once at the most, to the page that was named and to no other, and the end says
/// what is there.
#[test]
fn hostile_eeprom_writes() {
    let mut ends = Ends::default();
    runs("EEPROM writes", |seed| {
        let mut bench = bench(seed, procedure_rates(seed));
        let (page, cell, data) = (seed as usize % 8, seed as usize % 127, 0x40 + seed as u8 % 64);
        let address = Address::truncate(cell as u8);
        if seed % 3 == 0 {
            // The memory is busy: a byte that stays as it is was written before.
            let at_ns = bench.ready_ns;
            let _ = bench.exchange(Request::write_eeprom(Address::truncate(126 - cell as u8), 0xff), at_ns);
        }
        bench.restarts = (seed % 5 == 0).then_some(Draw::seeded(seed));
        let access = EepromAccess::write(Page::truncate(page as u8), address, data, EEPROM_POLLING);
        let end = bench.run(&mut Watched::new(access, seed));
        // Two wrong readings that agree are beyond it: an echo of EA 00 EA whose 00 comes twice, handed over beyond the budget.
        if bench.forged_requests > 0 || bench.misread > 1 {
            ends.excused += 1;
            return bench;
        }
        let written: Vec<_> = bench
            .device
            .eeprom_mut()
            .iter()
            .enumerate()
            .flat_map(|(page, cells)| cells.iter().enumerate().map(move |(at, byte)| (page, at, *byte)))
            .filter(|(.., byte)| *byte != 0xff)
            .collect();
        match end {
            Ok(value) => assert_eq!((value, written), (data, vec![(page, cell, data)]), "seed {seed}"),
            Err(Error::EffectUnknown { .. }) => assert!(written.len() <= 1, "seed {seed}: {written:?}"),
            Err(error) => assert_eq!(written, [], "seed {seed}: {error}"),
        }
        ends.count(&end);
        bench
    });
    assert!(ends.not_done > 0, "{ends:?}");
    ends.print("EEPROM writes");
}

/// What is read is what the cell of the named page holds, and reading changes no cell, although an encoder that has restarted is
/// on page 0 again.
#[test]
fn hostile_eeprom_reads() {
    let (mut done, mut failed, mut excused) = (0, 0, 0);
    runs("EEPROM reads", |seed| {
        let mut bench = bench(seed, procedure_rates(seed));
        bench.restarts = (seed % 2 == 0).then_some(Draw::seeded(seed));
        for (page, cells) in (0_u8..).zip(bench.device.eeprom_mut()) {
            cells.iter_mut().zip(0_u8..).for_each(|(cell, at)| *cell = page << 5 ^ at);
        }
        let memory = *bench.device.eeprom_mut();
        for k in 0..4 {
            let (page, cell) = ((seed + k) as usize % 6, (seed * 5 + k) as usize % 127);
            let page_of = Page::truncate(page as u8);
            let end = bench.run(&mut EepromAccess::read(page_of, Address::truncate(cell as u8), EEPROM_POLLING));
            // A write that nobody sent, or a reading that was none.
            if bench.forged_requests + bench.forged_reads + bench.misread > 0 {
                excused += 1;
                break;
            }
            match end {
                Ok(value) => assert_eq!(value, memory[page][cell], "seed {seed}: page {page}, cell {cell}"),
                Err(_) => failed += 1,
            }
            done += u32::from(end.is_ok());
            assert_eq!(*bench.device.eeprom_mut(), memory, "seed {seed}: a read has changed the memory");
        }
        bench
    });
    println!("EEPROM reads: {done} done, {failed} failed, {excused} excused");
    assert!(done > 0 && failed > 0, "{done} done, {failed} failed");
}

/// An encoder is found at its rate, with a response that is its own, or not at all.
#[test]
fn hostile_detections() {
    let (mut found, mut lost) = (0, 0);
    runs("detections", |seed| {
        let mut bench = bench(seed, Rates::ROUGH);
        let other = Line::new(BitRate::ALL[1 - (seed / 2) as usize % 2]);
        let lines = if seed % 3 == 0 { [bench.line, other] } else { [other, bench.line] };
        let mut draw = Draw::seeded(seed);
        for _ in 0..10 {
            let end = bench.detect(&mut Detection::on(lines), &mut draw);
            *(if end.is_ok() { &mut found } else { &mut lost }) += 1;
        }
        bench
    });
    println!("detections: {found} found, {lost} not");
    assert!(found > 0 && lost > 0, "{found} found, {lost} not");
}

proptest! {
    /// Few faults at any places: what fails is cut down to the fewest.
    #[test]
    fn few_faults(scenario in scenarios(12, 4), behaviour in 0..Behaviour::NUMBERED, fast: bool, hint: bool) {
        let rate = if fast { BitRate::Mbit5 } else { BitRate::Mbit2_5 };
        let mut bench = Bench::new(scenario, rate, Behaviour::numbered(behaviour), hint);
        for k in 0..6 {
            let at_ns = bench.ready_ns;
            let _ = bench.exchange(READS[k % 4], at_ns);
        }
    }
}
