//! Single transactions and buses on the hostile line, and the laws that they keep.

use nikon_aformat::bus::{Addresses, Outcome};
use nikon_aformat::device::{Device, Encoders, Fault};
use nikon_aformat::master::{BusTransaction, Line, Progress, Transaction};
use nikon_aformat::{
    Alm, BitRate, Doubt, EncoderAddress, EncoderStatus, Error, Evidence, Operation, Policy, Request, Resolution,
    Response, Sample, Tolerated, Version,
};
use servowire_world::{Id, Scenario, Seed, Speaker, Tally, Transmission, Verdict, first_seed};

use super::line::{Bench, Spoken, between_ns, faults, frame_ns, host_within, idle_ns, rates, value_of};
use super::switches::{Mix, Switches};

/// What a run depends on.
#[derive(Debug, Clone)]
pub struct Setup {
    /// To repeat it by.
    pub seed: u64,
    pub rate: BitRate,
    pub scenario: Scenario,
    pub switches: Switches,
    /// Nothing happens to the line: then nothing may be lost or mistaken.
    pub quiet: bool,
}

impl Setup {
    /// A line on which anything happens but in every fourth seed.
    pub fn hostile(seed: u64) -> Self {
        Self { scenario: Scenario::random(seed, rates(seed)), quiet: seed % 4 == 0, ..Self::still(seed) }
    }

    /// A line that does nothing by itself.
    pub fn still(seed: u64) -> Self {
        let rate = BitRate::ALL[seed as usize % 5];
        Self { seed, rate, scenario: Scenario::quiet(), switches: Switches::draw(seed), quiet: false }
    }
}

/// Runs seeds until enough has happened.
pub fn seeds<S: Default>(
    setup: impl Fn(u64) -> Setup,
    tally: impl Fn(&S) -> &Tally,
    run: impl Fn(&Setup, &mut S),
) -> S {
    let mut shown = S::default();
    for seed in first_seed().. {
        let said = Seed(seed);
        run(&setup(seed), &mut shown);
        drop(said);
        if tally(&shown).all_faults() >= faults() {
            break;
        }
    }
    shown
}

/// A request and the response to it, in numbers of the documents.
#[derive(Debug, Clone, Copy)]
struct Asked {
    operation: Operation,
    code: u16,
    frames: u64,
    /// Whether an encoder of version 2.1 does not know it.
    is_new: bool,
}

impl Asked {
    const fn of(operation: Operation, code: u16, frames: u64, is_new: bool) -> Self {
        Self { operation, code, frames, is_new }
    }
}

/// What is asked of one encoder, and of all: mostly the whole position.
const SINGLE: [Asked; 6] = [
    Asked::of(Operation::Abs40, 0, 4, false),
    Asked::of(Operation::Abs40, 0, 4, false),
    Asked::of(Operation::Abs40, 0, 4, false),
    Asked::of(Operation::Abs24Low, 1, 3, false),
    Asked::of(Operation::Abs24Vel, 23, 5, true),
    Asked::of(Operation::Abs24VelAcc, 25, 6, true),
];
const MULTI: [Asked; 6] = [
    Asked::of(Operation::Abs40Mt, 4, 4, false),
    Asked::of(Operation::Abs40Mt, 4, 4, false),
    Asked::of(Operation::Abs40Mt, 4, 4, false),
    Asked::of(Operation::Abs24LowMt, 5, 3, false),
    Asked::of(Operation::Abs24VelMt, 24, 5, true),
    Asked::of(Operation::Abs24VelAccMt, 26, 6, true),
];

/// Single turn and turns of the encoders that exist, and of some that the 40 bits allow.
const WIDTHS: [(u32, u32); 6] = [(20, 16), (17, 16), (24, 16), (17, 23), (22, 18), (20, 20)];

impl Setup {
    /// Of the encoders of this run.
    fn widths(&self) -> (u32, u32) {
        WIDTHS[self.seed as usize / 5 % WIDTHS.len()]
    }

    fn is_version_3(&self) -> bool {
        self.seed % 3 != 1
    }

    fn resolution(&self) -> Resolution {
        let (single, turns) = self.widths();
        let resolution = Resolution::new(single as u8, turns as u8).unwrap();
        resolution.with_version(if self.is_version_3() { Version::V3_0 } else { Version::V2_1 })
    }
}

/// Encoders that behave as the switches say; those that are not `present` are silent.
pub fn encoders<const N: usize>(
    rate: BitRate,
    addresses: [u8; N],
    present: Addresses,
    switches: Switches,
    resolution: Resolution,
) -> Encoders<N, 2> {
    let mut index = 0;
    let all = addresses.map(|ea| {
        let address = EncoderAddress::truncate(ea);
        let mut device = Device::new(address, resolution, rate);
        device.set_behaviour(switches.behaviour(ea, index));
        if present.contains(address) {
            index += 1;
        } else {
            device.set_fault(Fault::Silent);
        }
        device
    });
    Encoders { all }
}

/// What a run has shown.
#[derive(Debug, Default)]
pub struct Shown {
    runs: u64,
    good: u64,
    failed: u64,
    /// Not sent, because the encoder does not know it.
    unsent: u64,
    /// Nothing but the own request came back.
    echo_alone: u64,
    /// Not seen by the CRC-8, or a foreign speaker's.
    unknown: u64,
    forged: u64,
    pub mix: Mix,
    pub tally: Tally,
}

/// Whether the request was on the line only when the master believed, so that it can know the age of an answer. What a
/// repetition adds does not count: encoders may answer the first.
fn on_time<const N: usize>(bench: &Bench<N>, id: Id, at_ns: u64) -> bool {
    let sent = bench.world.truth().transmission(id);
    sent.is_some_and(|sent| sent.start_ns >= at_ns && sent.sent_ns <= at_ns + frame_ns(bench.rate))
}

fn judge<const N: usize>(bench: &Bench<N>, id: Id, value: u64, shown: &mut Shown, setup: &Setup) -> Verdict {
    let Setup { seed, quiet, .. } = *setup;
    let truth = bench.world.truth();
    let verdict = truth.verdict(id, value);
    match verdict {
        Verdict::Fresh => {}
        Verdict::Old { of } => panic!("seed {seed}: {value:#x} of {of:?} is older than {id:?}"),
        // Only where something was damaged, repeated or lost, which the CRC-8 does not see once in 256 times; and only what a
        // foreign speaker or a delay, of the answer or of its request, put there.
        Verdict::Unknown => {
            let damaged = !truth.undisturbed(id) || truth.answers(id).any(|answer| !answer.intact);
            assert!(damaged, "seed {seed}: nobody sent {value:#x}");
            shown.unknown += 1;
        }
        Verdict::Forged { of } => {
            let forger = truth.transmission(of).unwrap();
            let is_late = |t: &Transmission| t.start_ns > t.asked_ns || t.end_ns > t.sent_ns;
            let request = forger.answers.and_then(|request| truth.transmission(request));
            let late = is_late(forger) || request.is_none_or(is_late);
            // Noise can be a request.
            let foreign = forger.speaker == Speaker::Foreign || request.is_some_and(|t| t.speaker != Speaker::Host);
            assert!(late || foreign, "seed {seed}: {forger:?} is no answer to {id:?}");
            shown.forged += 1;
        }
    }
    assert!(verdict == Verdict::Fresh || !quiet, "seed {seed}: {verdict:?} on a quiet line");
    verdict
}

/// The position of a response is where the shaft was when it was sent. A response that does not hold all bits of the turns gives
/// none of them.
fn is_where_the_shaft_was<const N: usize>(bench: &Bench<N>, response: &Response, setup: &Setup) {
    let Some(Spoken { single_turn, turns, code, .. }) = bench.spoken(value_of(response.emit().contents())) else {
        return;
    };
    let (single_bits, turns_bits) = bench.widths;
    // Whatever the encoder shows, and however old it is.
    let at = |tolerated: Tolerated| {
        let policy = Policy::new(0).tolerating(tolerated.status(EncoderStatus::all()).alarms(Alm::all()));
        Evidence::of(*response, setup.resolution(), 0).at(0, policy)
    };
    let single = at(Tolerated::SINGLE_TURN).map(Sample::single_turn);
    assert_eq!(single, Ok(*single_turn), "seed {}", setup.seed);
    // The counter is cyclic: its upper half stands for what is below 0.
    let (turns, all) = (i64::from(*turns), 1_i64 << turns_bits);
    let signed = if turns >= all / 2 { turns - all } else { turns };
    let is_whole = matches!(code, 0 | 4) || single_bits + turns_bits <= 24;
    let want = if is_whole { Ok(Some(signed as i32)) } else { Err(Doubt::Absent) };
    assert_eq!(at(Tolerated::NOTHING).map(Sample::turns), want, "seed {}", setup.seed);
}

/// An own echo is no answer, not even a wrong one: where nothing else came back, nothing did.
fn is_echo_alone<const N: usize>(bench: &Bench<N>, id: Id, shown: &mut Shown) -> bool {
    let own = |handed: &servowire_world::Handed| handed.origin.transmission == id && !handed.damaged;
    let truth = bench.world.truth();
    let alone = truth.handed_since(id).next().is_some() && truth.handed_since(id).all(own);
    shown.echo_alone += u64::from(alone);
    alone
}

/// A response of this many frames with all the idle time between them that a master allows.
fn longest_ns(rate: BitRate, frames: u64) -> u64 {
    frames * frame_ns(rate) + (frames - 1) * idle_ns(rate)
}

/// Law 4: no encoder speaks at `ready_ns` or later that began in time, which is until `last_ns`. A request that the line
/// repeats is answered twice.
fn line_is_free<const N: usize>(bench: &Bench<N>, id: Id, asked: Asked, last_ns: u64, ready_ns: u64, seed: u64) {
    let truth = bench.world.truth();
    if truth.transmission(id).is_none_or(|sent| sent.end_ns > sent.sent_ns) {
        return;
    }
    let in_time = |t: &&Transmission| {
        t.answers == Some(id)
            && t.start_ns <= last_ns
            && t.end_ns - t.start_ns <= longest_ns(bench.rate, t.units as u64)
            && matches!(t.speaker, Speaker::Device(_))
            && is_answer(bench, t, asked)
    };
    let late = truth.speaking_from(ready_ns).find(in_time);
    assert!(late.is_none(), "seed {seed}: ready at {ready_ns}, but {late:?}");
}

/// Whether an encoder repeats the command that was asked; one that heard another request, by damage, answers that.
fn is_answer<const N: usize>(bench: &Bench<N>, sent: &Transmission, asked: Asked) -> bool {
    sent.tag.and_then(|tag| bench.spoken(tag)).is_some_and(|spoken| spoken.code == asked.code)
}

/// How long the masters of these tests wait for a response: the longest turn-around time of the switches, and the longest time
/// after which a host of the world sees that the line is idle.
const TIMEOUT_NS: u64 = 25_000;

fn line(rate: BitRate) -> Line {
    Line::new(rate).with_response_timeout_ns(TIMEOUT_NS as u32)
}

/// `turns` requests to one of three encoders after the other.
pub fn single(setup: &Setup, turns: u64, shown: &mut Shown) {
    let Setup { seed, rate, switches, quiet, .. } = *setup;
    let line = line(rate);
    let scenario = host_within(setup.scenario.clone(), line.latency_budget_ns());
    switches.note(&mut shown.mix);
    let resolution = setup.resolution();
    let encoders = encoders(rate, [0, 3, 6], Addresses::ALL, switches, resolution);
    let mut bench = Bench::new(encoders, rate, scenario).with_encoders(setup.widths(), setup.is_version_3());
    let mut at_ns = 1_000;
    let mut lost = 0;
    for turn in 0..turns {
        // Now and then one that is not there.
        let is_there = turn % 11 != 10;
        let ea = EncoderAddress::truncate(if is_there { [0, 3, 6][(turn % 3) as usize] } else { 5 });
        let asked = SINGLE[((turn + setup.seed) % 6) as usize];
        let request = Request::new(ea, asked.operation);
        let mut transaction = Transaction::start(request, resolution, line, at_ns);
        if let Progress::Failed { error, .. } = transaction.progress() {
            assert!(matches!(error, Error::UnsupportedInVersion { .. }) && asked.is_new, "seed {seed}: {error}");
            shown.unsent += 1;
            continue;
        }
        let id = bench.send(transaction.transmission().frames, at_ns);
        let end = loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match bench.next(until_ns) {
                    Ok(block) => drop(transaction.hear_since(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                end => break end,
            }
        };
        let known = on_time(&bench, id, at_ns);
        // Who believes a forged answer does not know that the true one is still to come.
        let mut believed = Verdict::Fresh;
        let ready_ns = match end {
            Progress::Done { value, ready_ns } => {
                shown.good += 1;
                if known {
                    believed = judge(&bench, id, value_of(value.response.emit().contents()), shown, setup);
                    is_where_the_shaft_was(&bench, &value.response, setup);
                    let sent_ns = at_ns + frame_ns(rate);
                    assert!(value.sampled_ns.abs_diff(sent_ns) <= 1 && value.began_ns >= sent_ns);
                }
                ready_ns
            }
            Progress::Failed { error, ready_ns } => {
                shown.failed += 1;
                lost += u64::from(is_there);
                let mut intact = bench.world.truth().intact_answers(id);
                let lost = intact.find(|t| {
                    is_answer(&bench, t, asked)
                        && t.speaker == Speaker::Device((turn % 3) as u8)
                        && t.delivered_ns < bench.world.now_ns()
                });
                assert!(
                    !known || lost.is_none_or(|t| bench.is_excused(t)),
                    "seed {seed} turn {turn}: {error}, but {lost:?}"
                );
                let silent = is_echo_alone(&bench, id, shown);
                assert!(!silent || error == Error::NoResponse, "seed {seed} turn {turn}: {error} for the own request");
                ready_ns
            }
            Progress::Pending { .. } => unreachable!(),
        };
        if known && believed == Verdict::Fresh {
            line_is_free(&bench, id, asked, at_ns + frame_ns(rate) + TIMEOUT_NS, ready_ns, seed);
        }
        at_ns = bench.world.now_ns().max(ready_ns) + turn % 7 * 100;
        bench.world.truth_mut().forget_before(at_ns.saturating_sub(2_000_000));
    }
    if quiet && bench.world.host().fifo == 0 {
        assert_eq!(lost, 0, "seed {seed}: on a quiet line nothing is lost, {:?}", bench.world.host());
    }
    shown.runs += 1;
    shown.tally.add(bench.world.tally());
}

/// `turns` requests to some of the encoders that are there, and to some that are not.
pub fn bus(setup: &Setup, turns: u64, shown: &mut Shown) {
    let Setup { seed, rate, switches, .. } = *setup;
    let line = line(rate);
    let scenario = host_within(setup.scenario.clone(), line.latency_budget_ns());
    switches.note(&mut shown.mix);
    let present = switches.present();
    let resolution = setup.resolution();
    let encoders = encoders(rate, [0, 1, 2, 3, 4, 5, 6, 7], present, switches, resolution);
    let mut bench = Bench::new(encoders, rate, scenario).with_encoders(setup.widths(), setup.is_version_3());
    let mut at_ns = 1_000;
    for turn in 0..turns {
        let what = MULTI[((turn + seed) % 6) as usize];
        let asked = Addresses::from_bits((seed.wrapping_mul(0x9e37_79b9) >> (turn % 24)) as u8 | 1 << (turn % 8));
        let request = Request::new(asked.highest().unwrap(), what.operation);
        let mut transaction = BusTransaction::start(request, resolution, asked, line, at_ns);
        if let Progress::Failed { error, .. } = transaction.progress() {
            assert!(matches!(error, Error::UnsupportedInVersion { .. }) && what.is_new, "seed {seed}: {error}");
            shown.unsent += 1;
            continue;
        }
        let id = bench.send(transaction.transmission().frames, at_ns);
        let ready_ns = loop {
            match transaction.progress() {
                Progress::Pending { until_ns } => match bench.next(until_ns) {
                    Ok(block) => drop(transaction.hear_since(&block.frames, block.since_ns, block.end_ns)),
                    Err(now_ns) => drop(transaction.poll(now_ns)),
                },
                Progress::Done { ready_ns, .. } => break ready_ns,
                Progress::Failed { error, .. } => panic!("seed {seed}: {error}"),
            }
        };
        // Law 2: nobody who was asked is given up before the time of the last place is over; after a response it is over when
        // each of those who were not heard could have had its turn.
        let turn_ns = longest_ns(rate, what.frames) + between_ns(rate);
        // A damaged one may be whole enough: one that was longer, say.
        let heard = |t: &&Transmission| t.delivered > 0 && is_answer(&bench, t, what);
        let answers = bench.world.truth().answers(id).filter(heard).map(|t| t.start_ns);
        // One that somebody repeated is as good.
        let taken = asked.iter().filter_map(|ea| transaction.exchange(ea)).map(|exchange| exchange.began_ns);
        let first_ns = answers.chain(taken).min().map(|began| began + what.frames * frame_ns(rate));
        let silent = |ea: &EncoderAddress| matches!(transaction.bus().of(*ea), Outcome::Missing | Outcome::NotAsked);
        let turns_ns = EncoderAddress::ALL.iter().filter(|ea| silent(ea)).count() as u64 * turn_ns;
        let place_ns = at_ns + frame_ns(rate) + TIMEOUT_NS + 8 * turn_ns - between_ns(rate);
        let last_ns = first_ns.map_or(place_ns, |end_ns| place_ns.min(end_ns + turns_ns));
        let missing = transaction.bus().missing();
        // Whoever puts a sound response on the line that nobody asked for makes the master wait from there on.
        let is_forged = |ea: &EncoderAddress| match transaction.bus().of(*ea) {
            Outcome::Good(response) | Outcome::Extra(response) | Outcome::Duplicate { first: response } => {
                bench.world.truth().verdict(id, value_of(response.emit().contents())) != Verdict::Fresh
            }
            _ => false,
        };
        let own = |speaker| matches!(speaker, Speaker::Host | Speaker::Device(_));
        let forged = EncoderAddress::ALL.iter().any(is_forged)
            || bench.world.truth().handed_since(id).any(|handed| !own(handed.origin.speaker));
        assert!(
            missing.is_empty() || bench.world.now_ns() > last_ns || forged,
            "seed {seed} turn {turn}: {:08b} given up at {}, not {last_ns}",
            missing.bits(),
            bench.world.now_ns()
        );
        if is_echo_alone(&bench, id, shown) {
            assert_eq!(transaction.bus().damaged(), 0, "seed {seed} turn {turn}: the own request is counted");
        }
        if on_time(&bench, id, at_ns) {
            for ea in asked.iter() {
                if let Some(exchange) = transaction.exchange(ea) {
                    shown.good += 1;
                    let _ = judge(&bench, id, value_of(exchange.response.emit().contents()), shown, setup);
                    is_where_the_shaft_was(&bench, &exchange.response, setup);
                    continue;
                }
                shown.failed += 1;
                let mut intact = bench.world.truth().intact_answers(id);
                let lost = intact.find(|t| {
                    is_answer(&bench, t, what)
                        && t.speaker == Speaker::Device(ea.get())
                        && t.delivered_ns < bench.world.now_ns()
                });
                let doubled = transaction.bus().duplicates().contains(ea);
                assert!(
                    doubled || lost.is_none_or(|t| bench.is_excused(t)),
                    "seed {seed} turn {turn}: {ea} lost, {lost:?}"
                );
            }
            line_is_free(&bench, id, what, last_ns - longest_ns(rate, what.frames), ready_ns, seed);
        }
        at_ns = bench.world.now_ns().max(ready_ns);
        bench.world.truth_mut().forget_before(at_ns.saturating_sub(2_000_000));
    }
    shown.runs += 1;
    shown.tally.add(bench.world.tally());
}
