//! T-Format and A-format through an SPI that samples the hostile line.

use crate::hostile::live_through;
use crate::sampler::Spi;
use crate::{bench, frames};
use nikon_aformat::{EncoderAddress, Resolution};
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiFrames, SpiUart};
use servowire_drivers::{Automatic, DirectionPin, Error, nikon, tformat};
use servowire_world::{Delivery, Fault, Planned, Scenario, Script, Verdict};

type Uart<'b> = SpiUart<'b, Spi<bench::Shared>, DirectionPin<bench::Pin>>;

fn uart<'b>(bench: &bench::Shared, msb_first: bool, per_bit: u8, buffers: &'b mut ([u8; 48], [u8; 160])) -> Uart<'b> {
    let order = if msb_first { Order::MsbFirst8 } else { Order::LsbFirst8 };
    let sampling = Sampling::new(order, per_bit, 8, 2_500_000).unwrap();
    bench.borrow_mut().sampled = true;
    let spi = Spi { line: bench.clone(), msb_first, per_bit: per_bit.into() };
    let window = sampling.bytes(12_000 + 44_000);
    SpiUart::new(
        spi,
        DirectionPin::new(bench::Pin(bench.clone()), bench::WORST),
        sampling,
        &mut buffers.0,
        &mut buffers.1[..window],
    )
}

fn tformat_line() -> ::tformat::master::Line {
    ::tformat::master::Line::new(::tformat::BitRate::Mbit2_5)
}

#[test]
fn tformat_at_an_spi() {
    for (msb_first, per_bit) in [(true, 8), (false, 8), (true, 4), (false, 4), (true, 5)] {
        let bench = bench::Bench::new(Scenario::quiet(), bench::Misframed::Dropped);
        let mut buffers = ([0; 48], [0; 160]);
        let port = uart(&bench, msb_first, per_bit, &mut buffers);
        let mut encoder =
            tformat::blocking::Driver::new(port, Automatic, bench::Watch(bench.clone()), tformat_line()).unwrap();
        for _ in 0..5 {
            let all = encoder.read_data().unwrap();
            let bench = bench.borrow();
            assert_eq!(bench.truth().verdict(bench.request.unwrap(), all.abs.get().into()), Verdict::Fresh);
            assert!(!bench.driver_on);
            let sent = bench.truth().transmission(bench.request.unwrap()).unwrap();
            assert!((sent.end_ns..sent.end_ns + 3_000).contains(&bench.off_at_ns), "before the encoder answers");
        }
        let address = ::tformat::Address::new(5).unwrap();
        assert_eq!(
            encoder.write_eeprom(::tformat::Page::truncate(0), address, 0x5a),
            Ok(0x5a),
            "{msb_first} {per_bit}"
        );
        assert_eq!(encoder.read_eeprom(::tformat::Page::truncate(0), address), Ok(0x5a));
        assert_eq!(bench.borrow().truth().clashes(), 0);
    }
}

#[test]
fn a_request_that_does_not_fit_is_refused() {
    let bench = bench::Bench::new(Scenario::quiet(), bench::Misframed::Dropped);
    let mut buffers = ([0; 8], [0; 160]);
    let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
    let spi = Spi { line: bench.clone(), msb_first: true, per_bit: 8 };
    let pin = DirectionPin::new(bench::Pin(bench.clone()), bench::WORST);
    let port = SpiUart::new(spi, pin, sampling, &mut buffers.0, &mut buffers.1);
    let mut encoder =
        tformat::blocking::Driver::new(port, Automatic, bench::Watch(bench.clone()), tformat_line()).unwrap();
    assert!(matches!(encoder.read_data(), Err(Error::Io(_))));
    assert!(bench.borrow().request.is_none());
}

fn lost(transmission: u16, unit: u8, fault: Fault) -> Scenario {
    Scenario { script: Script::planned(vec![Planned { transmission, unit, fault }]), ..Scenario::quiet() }
}

const FAULTS: [Fault; 6] = [
    Fault::Drop,
    Fault::Flip { bit: 4 },
    Fault::Flip { bit: 9 },
    Fault::Idle { bits: 20 },
    Fault::Cut,
    Fault::Delay { ns: 30_000 },
];

#[test]
fn any_fault_is_over_with_the_next_call() {
    for fault in FAULTS {
        for (transmission, unit) in [(0, 0), (1, 0), (1, 1), (1, 5), (1, 10)] {
            let bench = bench::Bench::new(lost(transmission, unit, fault), bench::Misframed::Dropped);
            let mut buffers = ([0; 48], [0; 160]);
            let port = uart(&bench, true, 8, &mut buffers);
            let mut encoder =
                tformat::blocking::Driver::new(port, Automatic, bench::Watch(bench.clone()), tformat_line()).unwrap();
            let first = encoder.read_data();
            let second = encoder.read_data();
            assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
        }
    }
}

/// No value is older than its request, and no good answer is lost, whatever has happened before.
#[test]
fn hostile_events_are_survived() {
    live_through(|calls, seed| {
        let bench = bench::Bench::new(bench::sampled_scenario(seed), bench::Misframed::Dropped);
        let mut buffers = ([0; 48], [0; 160]);
        let port = uart(&bench, seed % 2 == 0, 8, &mut buffers);
        let mut encoder =
            tformat::blocking::Driver::new(port, Automatic, bench::Watch(bench.clone()), tformat_line()).unwrap();
        for call in 0..100 {
            let result = encoder.read_data().map(|all| all.abs.get());
            bench.borrow_mut().judge(calls, Some(result), seed, call);
        }
        bench.borrow().tally()
    });
}

type Frames<'b> = SpiFrames<'b, Spi<frames::Shared>, Automatic, frames::Port>;

fn frame_port<'b>(bench: &frames::Shared, per_bit: u8, buffers: &'b mut ([u8; 96], [u8; 400])) -> Frames<'b> {
    let sampling = Sampling::new(Order::MsbFirst8, per_bit, 16, 2_500_000).unwrap();
    bench.borrow_mut().sampled = true;
    let spi = Spi { line: bench.clone(), msb_first: true, per_bit: per_bit.into() };
    let window = sampling.bytes(20_000 + 3 * 30_000);
    let clock = frames::Port(bench.clone());
    SpiFrames::new(spi, Automatic, clock, sampling, &mut buffers.0, &mut buffers.1[..window])
}

#[test]
fn aformat_at_an_spi() {
    for per_bit in [4, 8, 10] {
        let bench = frames::Bench::with(Scenario::quiet(), 2, false);
        let mut buffers = ([0; 96], [0; 400]);
        let port = frame_port(&bench, per_bit, &mut buffers);
        let clock = frames::Port(bench.clone());
        let mut master = nikon::blocking::Driver::new(port, clock, Resolution::default(), frames::line());
        for _ in 0..5 {
            let exchange = master.read_abs40(EncoderAddress::ZERO).unwrap();
            let abs = exchange.response.abs40().unwrap().get();
            let bench = bench.borrow();
            assert_eq!(abs & 0xf_ffff, u64::from(bench.asked_at));
            let answer = bench.world.truth().answers(bench.request.unwrap()).next().unwrap();
            assert!(exchange.began_ns.abs_diff(answer.start_ns) <= 700, "{per_bit}: {exchange:?} {answer:?}");
        }
        let both = nikon_aformat::bus::Addresses::first(2);
        let answers = master.read_bus(nikon_aformat::Operation::Abs40Mt, both).unwrap();
        assert!(both.iter().all(|ea| answers.exchange(ea).is_some()));
        let word = master.read_eeprom(EncoderAddress::ZERO, 9);
        assert!(word.is_ok(), "a request of two frames: {word:?}");
        assert_eq!(bench.borrow().world.truth().clashes(), 0);
    }
}

#[test]
fn faults_of_aformat_are_over_with_the_next_call() {
    for fault in FAULTS {
        for (transmission, unit) in [(0, 0), (1, 0), (1, 1), (1, 3)] {
            let bench = frames::Bench::with(lost(transmission, unit, fault), 1, false);
            let mut buffers = ([0; 96], [0; 400]);
            let port = frame_port(&bench, 8, &mut buffers);
            let clock = frames::Port(bench.clone());
            let mut master = nikon::blocking::Driver::new(port, clock, Resolution::default(), frames::line());
            let first = master.read_abs40(EncoderAddress::ZERO);
            let second = master.read_abs40(EncoderAddress::ZERO);
            assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
        }
    }
}

/// The same for A-format.
#[test]
fn hostile_events_of_aformat_are_survived() {
    live_through(|calls, seed| {
        let bench = frames::Bench::with(frames::scenario(seed, 1, Delivery::Each), 1, false);
        let mut buffers = ([0; 96], [0; 400]);
        let port = frame_port(&bench, 8, &mut buffers);
        let clock = frames::Port(bench.clone());
        let mut master = nikon::blocking::Driver::new(port, clock, Resolution::default(), frames::line());
        for call in 0..100 {
            let result = master.read_abs40(EncoderAddress::ZERO).map(|exchange| frames::shaft(exchange.response));
            bench.borrow_mut().judge(calls, Some(result), seed, call);
        }
        *bench.borrow().world.tally()
    });
}

#[cfg(feature = "async")]
mod asynch {
    use super::*;
    use crate::polls::{FOR_EVER, Looks, run};

    type Driver<'b> = tformat::asynch::Driver<Uart<'b>, Automatic, Looks<bench::Watch>>;
    type Master<'b> = nikon::asynch::Driver<Frames<'b>, frames::Port>;

    fn encoder<'b>(bench: &bench::Shared, buffers: &'b mut ([u8; 48], [u8; 160])) -> Driver<'b> {
        let timer = Looks(bench::Watch(bench.clone()));
        tformat::asynch::Driver::new(uart(bench, true, 8, buffers), Automatic, timer, tformat_line()).unwrap()
    }

    fn master<'b>(bench: &frames::Shared, buffers: &'b mut ([u8; 96], [u8; 400])) -> Master<'b> {
        let clock = frames::Port(bench.clone());
        let port = frame_port(bench, 8, buffers);
        nikon::asynch::Driver::new(port, clock, Resolution::default(), frames::line())
    }

    /// Dropped after each number of polls: the driver is off at once, and the next call is good.
    #[test]
    fn a_future_may_be_dropped_at_any_point() {
        for polls in 0.. {
            let bench = bench::Bench::new(Scenario::quiet(), bench::Misframed::Dropped);
            let mut buffers = ([0; 48], [0; 160]);
            let mut encoder = encoder(&bench, &mut buffers);
            let first = run(encoder.read_data(), polls);
            assert!(!bench.borrow().driver_on, "after {polls} polls");
            let abs = run(encoder.read_data(), FOR_EVER).unwrap().unwrap().abs.get();
            let bench = bench.borrow();
            let verdict = bench.truth().verdict(bench.request.unwrap(), abs.into());
            assert_eq!((verdict, bench.truth().clashes()), (Verdict::Fresh, 0), "after {polls} polls");
            if first.is_some() {
                assert!(polls > 200);
                break;
            }
        }
        for polls in 0.. {
            let bench = frames::Bench::new(Scenario::quiet());
            let mut buffers = ([0; 96], [0; 400]);
            let mut master = master(&bench, &mut buffers);
            let first = run(master.read_abs40(EncoderAddress::ZERO), polls);
            let second = run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().unwrap();
            let bench = bench.borrow();
            let shaft = frames::shaft(second.response);
            let verdict = bench.world.truth().verdict(bench.request.unwrap(), shaft.into());
            assert_eq!((verdict, bench.world.truth().clashes()), (Verdict::Fresh, 0), "after {polls} polls");
            if first.is_some() {
                assert!(polls > 200);
                break;
            }
        }
    }

    /// As the blocking ones; every fourth call may be dropped.
    #[test]
    fn hostile_events_are_survived() {
        let calls = live_through(|calls, seed| {
            let bench = bench::Bench::new(bench::sampled_scenario(seed), bench::Misframed::Dropped);
            let mut buffers = ([0; 48], [0; 160]);
            let mut encoder = encoder(&bench, &mut buffers);
            for call in 0..100_usize {
                let polls = if call % 4 == 3 { call * 4 + seed as usize % 4 } else { FOR_EVER };
                let outcome = run(encoder.read_data(), polls).map(|result| result.map(|all| all.abs.get()));
                bench.borrow_mut().judge(calls, outcome, seed, call);
            }
            bench.borrow().tally()
        });
        assert!(calls.dropped > 1_000);
    }

    #[test]
    fn hostile_events_of_aformat_are_survived() {
        let calls = live_through(|calls, seed| {
            let bench = frames::Bench::with(frames::scenario(seed, 1, Delivery::Each), 1, false);
            let mut buffers = ([0; 96], [0; 400]);
            let mut master = master(&bench, &mut buffers);
            for call in 0..100_usize {
                let polls = if call % 4 == 3 { call * 8 + seed as usize % 8 } else { FOR_EVER };
                let outcome = run(master.read_abs40(EncoderAddress::ZERO), polls);
                let outcome = outcome.map(|result| result.map(|exchange| frames::shaft(exchange.response)));
                bench.borrow_mut().judge(calls, outcome, seed, call);
            }
            *bench.borrow().world.tally()
        });
        assert!(calls.dropped > 1_000);
    }
}

#[cfg(feature = "async")]
#[test]
fn both_as_futures() {
    use crate::polls::{FOR_EVER, Looks, run};

    let bench = bench::Bench::new(lost(3, 2, Fault::Drop), bench::Misframed::Dropped);
    let mut buffers = ([0; 48], [0; 160]);
    let port = uart(&bench, true, 8, &mut buffers);
    let timer = Looks(bench::Watch(bench.clone()));
    let mut encoder = tformat::asynch::Driver::new(port, Automatic, timer, tformat_line()).unwrap();
    assert!(run(encoder.read_data(), FOR_EVER).unwrap().is_ok());
    assert!(run(encoder.read_data(), FOR_EVER).unwrap().is_err());
    assert!(run(encoder.read_data(), FOR_EVER).unwrap().is_ok());

    let bench = frames::Bench::with(lost(3, 2, Fault::Drop), 1, false);
    let mut buffers = ([0; 96], [0; 400]);
    let port = frame_port(&bench, 8, &mut buffers);
    let clock = frames::Port(bench.clone());
    let mut master = nikon::asynch::Driver::new(port, clock, Resolution::default(), frames::line());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_ok());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_err());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_ok());
}
