//! A harder world, with an encoder that uses nothing of the crates: all requests in any order, random positions, EEPROM accesses among
//! them, encoders that start anew, a second master on the line, twins that answer together, and an encoder that is at work for longer than it may be.

use servowire_drivers::tformat::blocking::Driver;
use servowire_drivers::{Automatic, Error};
use servowire_world::{Draw, Kind, Scenario, Verdict};
use tformat::{Address, Request, Response, StatusField};

use crate::bench::{Bench, Heard, Misframed, Uart, Watch, line, scenario};
use crate::hostile::{Calls, Excuse, live_through};
use crate::second::tformat::Encoder;

/// Cells that the test may write.
const SCRATCH: std::ops::Range<u8> = 100..120;

fn request(draw: &mut Draw) -> Request {
    let address = Address::new(SCRATCH.start + draw.below(20) as u8).unwrap();
    match draw.below(8) {
        0 => Request::ReadSingleTurn,
        1 => Request::ReadMultiTurn,
        2 => Request::ReadEncoderId,
        3 => Request::read_eeprom(address),
        4 => Request::write_eeprom(address, draw.below(256) as u8),
        5 => Request::ResetErrors,
        _ => Request::ReadAll,
    }
}

/// What another master asks: never anything that changes more than the test may.
fn intrusion(draw: &mut Draw) -> &'static [u8] {
    [&[0x1a][..], &[0x02], &[0x8a], &[0xea, 0x65, 0x8f], &[0x92]][draw.below(5) as usize]
}

/// What a call was like besides.
#[derive(Debug, Default)]
struct Besides {
    restarts: u64,
    masters: u64,
    twins: u64,
    writes: u64,
    /// Cells that a request has changed in which two wrong bits made another address, which the check does not see.
    stray: u64,
}

#[test]
fn hostile_events_in_a_harder_world() {
    let mut besides = Besides::default();
    live_through(|calls, seed| {
        let mut draw = Draw::seeded(seed);
        let misframed = [Misframed::Dropped, Misframed::Delivered, Misframed::Reported][seed as usize % 3];
        let twins = draw.below(8) == 0;
        let bench = Bench::with(scenario(seed), misframed, if twins { 2 } else { 1 });
        let mut encoder = Encoder::new();
        encoder.delay_ns = [2_000, 3_000, 6_000, 9_900][draw.below(4) as usize];
        encoder.store_ns = [18_000, 200_000, 40_000_000][draw.below(3) as usize];
        let cells = encoder.memory;
        bench.borrow_mut().seconds = vec![encoder; if twins { 2 } else { 1 }];
        let uart = Uart(bench.clone());
        let mut driver = Driver::new(uart, Automatic, Watch(bench.clone()), line()).unwrap();
        for call in 0..100 {
            let request = request(&mut draw);
            let mut alone = !twins;
            if draw.below(40) == 0 {
                besides.restarts += 1;
                bench.borrow_mut().restart();
            }
            if draw.below(20) == 0 {
                (besides.masters, alone) = (besides.masters + 1, false);
                let at_ns = bench.borrow().now_ns() + draw.below(80_000);
                bench.borrow_mut().intrude(intrusion(&mut draw), at_ns);
            }
            besides.twins += u64::from(twins);
            let outcome = driver.transact(request).map(|exchange| exchange.response);
            besides.writes += u64::from(matches!(outcome, Ok(Response::WriteEeprom(_))));
            let heard = bench.borrow_mut().verdict(outcome.as_ref().ok().and_then(position));
            let what = format!("seed {seed}, call {call}, {request:?}: {outcome:?}");
            assert!(!matches!(outcome, Err(Error::Closed | Error::Clock(_))), "{what}");
            // The encoder says that it has heard something else, such as noise before the request.
            let alone = alone && !matches!(outcome, Err(Error::Protocol(tformat::Error::Rejected { .. })));
            judge(calls, &outcome, &heard, alone, &what);
        }
        let bench = bench.borrow();
        for encoder in &bench.seconds {
            for (at, cell) in encoder.memory.iter().flatten().enumerate() {
                let was = cells.iter().flatten().nth(at).unwrap();
                besides.stray += u64::from(cell != was && !(at < 127 && SCRATCH.contains(&(at as u8))));
            }
            assert_eq!((encoder.zeros, encoder.page), (0, 0), "seed {seed}");
        }
        bench.tally()
    });
    println!("{besides:?}");
    assert!(besides.restarts > 500 && besides.masters > 1_000 && besides.twins > 1_000 && besides.writes > 500);
    assert!(besides.stray * 1_000 < besides.writes, "{besides:?}");
}

/// What may be used: an encoder that has heard something else than the request, such as noise before it, says so.
fn position(response: &Response) -> Option<u32> {
    let damaged = matches!(response, Response::ReadAll(all) if all.sf.intersects(StatusField::REQUEST_DAMAGED));
    response.abs().filter(|_| !damaged).map(tformat::Abs::get)
}

fn judge<E>(calls: &mut Calls, outcome: &Result<Response, E>, heard: &Heard, alone: bool, what: &str) {
    let old = matches!(heard.verdict, Some(Verdict::Old { .. }));
    if old {
        let excuse = Excuse::of(heard.preempted, heard.coincidence);
        assert!(excuse.is_some(), "{what}: {:?}", heard.verdict);
        calls.excuse(excuse);
    }
    let whole = heard.whole && alone && !heard.preempted;
    assert!(!whole || outcome.is_ok(), "{what}");
    match outcome {
        Ok(_) => calls.good += 1,
        Err(_) => calls.failed += 1,
    }
    calls.whole += u64::from(whole);
    let fresh = matches!(heard.verdict, None | Some(Verdict::Fresh));
    calls.forged += u64::from(!fresh && alone);
}

/// It is hard on a quiet line too: without faults every call of one master with one encoder is good.
#[test]
fn a_quiet_line_loses_nothing() {
    let (mut draw, bench) = (Draw::default(), Bench::new(Scenario::quiet(), Misframed::Dropped));
    bench.borrow_mut().seconds = vec![Encoder::new()];
    let mut driver = Driver::new(Uart(bench.clone()), Automatic, Watch(bench.clone()), line()).unwrap();
    for call in 0..2_000 {
        let outcome = driver.transact(request(&mut draw));
        assert!(outcome.is_ok(), "{call}: {outcome:?}");
    }
    assert_eq!(bench.borrow().tally().of(Kind::Drop), 0);
}
