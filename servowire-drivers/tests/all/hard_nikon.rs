//! A harder world for A-format, with encoders that use nothing of the crates: single reads, the EEPROM, clears and a bus in any order,
//! random positions, encoders that start anew, a second master on the line, and twins with one address.

use nikon_aformat::bus::Addresses;
use nikon_aformat::{EncoderAddress, Operation, Request, Resolution, Response};
use servowire_drivers::Error;
use servowire_drivers::nikon::blocking::Driver;
use servowire_world::{Delivery, Draw, Scenario, Verdict};

use crate::frames::{Bench, Port, Shared, line, scenario};
use crate::hostile::{Calls, Excuse, live_through};
use crate::second::nikon::Encoder;

/// Encoders on the line, with the addresses from 0 up.
const ENCODERS: u8 = 3;
/// The type word of the encoder, which nothing may change.
const TYPE: u8 = 0xf6;

fn driver(bench: &Shared) -> Driver<Port, Port> {
    let port = Port(bench.clone());
    Driver::new(port.clone(), port, Resolution::default(), line())
}

fn request(draw: &mut Draw) -> Request {
    let ea = EncoderAddress::truncate(draw.below(ENCODERS.into()) as u8);
    let operation = match draw.below(8) {
        0 => Operation::Abs24Low,
        1 => Operation::Status,
        2 => Operation::EepromRead { address: draw.below(256) as u8 },
        3 => Operation::ClearStatus,
        _ => Operation::Abs40,
    };
    Request::new(ea, operation)
}

/// What another master asks of encoder 0: the content of a frame, its first bit in bit 0. Command 0, 1 and 3 with their check bits, each word
/// as vendors print it, mirrored.
fn intrusion(draw: &mut Draw) -> u16 {
    [0x4000_u16, 0x4081, 0x40c4][draw.below(3) as usize].reverse_bits()
}

/// What a call was like besides.
#[derive(Debug, Default)]
struct Besides {
    restarts: u64,
    masters: u64,
    twins: u64,
    buses: u64,
    /// Words of the memory that were read whole.
    words: u64,
}

/// Of a position, what tells it from those before: the single turn.
fn position(response: &Response) -> Option<u32> {
    response.abs().map(|abs| (abs & 0xf_ffff) as u32)
}

#[test]
fn hostile_events_in_a_harder_world() {
    let mut besides = Besides::default();
    live_through(|calls, seed| {
        let mut draw = Draw::seeded(seed);
        let twins = draw.below(8) == 0;
        let count = ENCODERS + u8::from(twins);
        let bench = Bench::with(scenario(seed, count.into(), Delivery::Each), count, true);
        let encoder = |ea: u8| {
            let mut encoder = Encoder::new(ea % ENCODERS, 400);
            encoder.delay_ns = [800, 2_800, 4_000][seed as usize % 3];
            encoder
        };
        bench.borrow_mut().seconds = (0..count).map(encoder).collect();
        let mut master = driver(&bench);
        for call in 0..100 {
            let mut alone = !twins;
            besides.twins += u64::from(twins);
            if draw.below(40) == 0 {
                besides.restarts += 1;
                bench.borrow_mut().restart();
            }
            if draw.below(20) == 0 {
                (besides.masters, alone) = (besides.masters + 1, false);
                let at_ns = bench.borrow().world.now_ns() + draw.below(80_000);
                bench.borrow_mut().intrude(intrusion(&mut draw), at_ns);
            }
            if draw.below(4) == 0 {
                besides.buses += 1;
                let asked = Addresses::first(ENCODERS);
                let answers = master.read_bus(Operation::Abs40Mt, asked).unwrap();
                for ea in asked.iter() {
                    let value = answers.exchange(ea).and_then(|exchange| position(&exchange.response)).ok_or("missing");
                    if alone && bench.borrow().is_heard() {
                        bench.borrow().judge_of_bus(calls, answers.bus(), ea, value, seed, call);
                    }
                }
                bench.borrow_mut().end_call();
                continue;
            }
            let request = request(&mut draw);
            let outcome = master.transact(request).map(|exchange| exchange.response);
            let what = format!("seed {seed}, call {call}, {request:?}: {outcome:?}");
            assert!(!matches!(outcome, Err(Error::Closed | Error::Clock(_))), "{what}");
            besides.words += u64::from(outcome.is_ok() && matches!(request.operation, Operation::EepromRead { .. }));
            judge(calls, &bench, &outcome.map(|response| position(&response)), alone, &what);
            bench.borrow_mut().end_call();
        }
        for encoder in &bench.borrow().seconds {
            assert_eq!(encoder.memory[usize::from(TYPE)], 1 | 2 << 3, "seed {seed}");
        }
        *bench.borrow().world.tally()
    });
    println!("{besides:?}");
    assert!(besides.restarts > 500 && besides.masters > 1_000 && besides.twins > 1_000 && besides.buses > 5_000);
    assert!(besides.words > 1_000, "{besides:?}");
}

/// A value is never older than its request, and no call fails whose request and answer came through whole.
fn judge<E: std::fmt::Debug>(
    calls: &mut Calls,
    bench: &Shared,
    outcome: &Result<Option<u32>, E>,
    alone: bool,
    what: &str,
) {
    let bench = bench.borrow();
    let value = outcome.as_ref().ok().copied().flatten();
    let (truth, given) = (bench.world.truth(), bench.request.zip(value));
    let verdict = given.map(|(request, value)| truth.verdict(request, value.into()));
    let coincidence = given.is_some_and(|(request, value)| truth.is_coincidence(request, value.into()));
    if matches!(verdict, Some(Verdict::Old { .. })) {
        let excuse = Excuse::of(bench.was_preempted(), coincidence);
        assert!(excuse.is_some(), "{what}: {verdict:?}");
        calls.excuse(excuse);
    }
    let whole = alone && bench.came_whole();
    assert!(!whole || outcome.is_ok(), "{what}");
    match outcome {
        Ok(_) => calls.good += 1,
        Err(_) => calls.failed += 1,
    }
    calls.whole += u64::from(whole);
    calls.forged += u64::from(alone && !matches!(verdict, None | Some(Verdict::Fresh)));
}

/// It is hard on a quiet line too: without faults every call of one master is good, and the second read of a word has its data.
#[test]
fn a_quiet_line_loses_nothing() {
    let (mut draw, bench) = (Draw::default(), Bench::with(Scenario::quiet(), ENCODERS, true));
    bench.borrow_mut().seconds = (0..ENCODERS).map(|ea| Encoder::new(ea, 400)).collect();
    let mut master = driver(&bench);
    for call in 0..2_000 {
        let request = request(&mut draw);
        let outcome = master.transact(request);
        assert!(outcome.is_ok(), "{call}, {request:?}: {outcome:?}");
    }
    for address in [0, 9, TYPE, 255] {
        let word = if address == TYPE { 17 } else { u16::from(address) ^ 0x5a00 };
        assert_eq!(master.read_eeprom(EncoderAddress::truncate(1), address), Ok(word));
    }
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}
