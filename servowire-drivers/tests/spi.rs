//! T-Format and A-format through an SPI that samples the hostile line.

#![cfg(all(feature = "tformat", feature = "nikon"))]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod bench;
mod frames;
#[cfg(feature = "async")]
mod polls;

use std::convert::Infallible;

use embedded_hal::spi::{ErrorType, SpiBus};
use nikon_aformat::{EncoderAddress, Resolution};
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiFrames, SpiUart};
use servowire_drivers::{Automatic, DriverEnable, Error, nikon, tformat};
use servowire_world::{Fault, Id, Kind, Message, Planned, Scenario, Script, Tally, Truth, Verdict};

/// 2.5 Mbit/s.
const BIT_PS: u64 = 400_000;
/// From the call of a HAL to the first clock.
const SETUP_NS: u64 = 300;

/// The line as the SPI has it.
trait Line {
    fn now_ns(&self) -> u64;
    fn pass(&self, until_ns: u64);
    fn send(&self, contents: &[u64], gap_bits: usize, at_ns: u64);
    fn sampled(&self, from_ns: u64, count: usize, period_ps: u64) -> Vec<u8>;
    fn driver_is_on(&self) -> bool;
    /// Bits of a unit between start and stop bit.
    fn width(&self) -> usize;
}

impl Line for bench::Shared {
    fn now_ns(&self) -> u64 {
        self.borrow().now_ns()
    }

    fn pass(&self, until_ns: u64) {
        self.borrow_mut().pass(until_ns);
    }

    fn send(&self, contents: &[u64], _: usize, at_ns: u64) {
        let bytes: Vec<_> = contents.iter().map(|content| *content as u8).collect();
        let mut bench = self.borrow_mut();
        let id = bench.world().send(&Message::bytes(&bytes), at_ns);
        bench.request = Some(id);
    }

    fn sampled(&self, from_ns: u64, count: usize, period_ps: u64) -> Vec<u8> {
        self.borrow().truth().sampled(from_ns, count, period_ps, BIT_PS)
    }

    fn driver_is_on(&self) -> bool {
        self.borrow().driver_on
    }

    fn width(&self) -> usize {
        8
    }
}

impl Line for frames::Shared {
    fn now_ns(&self) -> u64 {
        self.borrow().world.now_ns()
    }

    fn pass(&self, until_ns: u64) {
        self.borrow_mut().pass(until_ns);
    }

    fn send(&self, contents: &[u64], gap_bits: usize, at_ns: u64) {
        let mut bench = self.borrow_mut();
        let message = Message::frames(16, contents.iter().copied()).with_gap_bits(gap_bits);
        let id = bench.world.send(&message, at_ns);
        bench.request = Some(id);
    }

    fn sampled(&self, from_ns: u64, count: usize, period_ps: u64) -> Vec<u8> {
        self.borrow().world.truth().sampled(from_ns, count, period_ps, BIT_PS)
    }

    fn driver_is_on(&self) -> bool {
        true
    }

    fn width(&self) -> usize {
        16
    }
}

struct Spi<L> {
    line: L,
    msb_first: bool,
    per_bit: usize,
}

impl<L: Line> Spi<L> {
    fn period_ps(&self) -> u64 {
        BIT_PS / self.per_bit as u64
    }

    fn ordered(&self, byte: u8) -> u8 {
        if self.msb_first { byte.reverse_bits() } else { byte }
    }

    /// Units in what MOSI sends, and the samples before the first.
    fn units(&self, words: &[u8]) -> (Vec<u64>, usize, usize) {
        let level = |at: usize| self.ordered(words[at / 8]) >> (at % 8) & 1 == 1;
        let end = words.len() * 8;
        let (mut found, mut at, mut first, mut last, mut gap) = (Vec::new(), 0, None, 0, 0);
        while at < end {
            if level(at) {
                at += 1;
                continue;
            }
            if first.is_some() {
                gap = (at - last) / self.per_bit;
            }
            first = first.or(Some(at));
            let middle = |bit: usize| at + bit * self.per_bit + self.per_bit / 2;
            let width = self.line.width();
            found.push((0..width).filter(|bit| level(middle(bit + 1))).map(|bit| 1 << bit).sum());
            assert!(level(middle(width + 1)), "a stop bit");
            at += (width + 2) * self.per_bit;
            last = at;
        }
        assert!(last + self.per_bit <= end, "the line is idle at the end");
        (found, first.unwrap(), gap)
    }

    fn transfer(&mut self, words: usize) -> u64 {
        let from_ns = self.line.now_ns() + SETUP_NS;
        self.line.pass(from_ns + words as u64 * 8 * self.period_ps() / 1000);
        from_ns
    }
}

impl<L> ErrorType for Spi<L> {
    type Error = Infallible;
}

impl<L: Line> SpiBus for Spi<L> {
    fn read(&mut self, _: &mut [u8]) -> Result<(), Infallible> {
        panic!("MOSI is not defined then");
    }

    fn write(&mut self, words: &[u8]) -> Result<(), Infallible> {
        assert!(self.line.driver_is_on());
        let (contents, first, gap_bits) = self.units(words);
        assert!(first >= self.per_bit, "a bit of idle line before the start bit");
        let from_ns = self.line.now_ns() + SETUP_NS;
        self.line.send(&contents, gap_bits, from_ns + first as u64 * self.period_ps() / 1000);
        self.transfer(words.len());
        Ok(())
    }

    fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), Infallible> {
        panic!("not used");
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        assert!(words.iter().all(|word| *word == 0xff), "MOSI stays idle");
        let from_ns = self.transfer(words.len());
        let samples = self.line.sampled(from_ns, words.len() * 8, self.period_ps());
        for (word, sample) in words.iter_mut().zip(samples) {
            *word = self.ordered(sample);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

#[cfg(feature = "async")]
impl<L: Line> embedded_hal_async::spi::SpiBus for Spi<L> {
    async fn read(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        SpiBus::read(self, words)
    }

    async fn write(&mut self, words: &[u8]) -> Result<(), Infallible> {
        SpiBus::write(self, words)
    }

    async fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Infallible> {
        SpiBus::transfer(self, read, write)
    }

    async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        SpiBus::transfer_in_place(self, words)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

type Uart<'b> = SpiUart<'b, Spi<bench::Shared>, DriverEnable<bench::Pin>>;

fn uart<'b>(bench: &bench::Shared, msb_first: bool, per_bit: u8, buffers: &'b mut ([u8; 48], [u8; 160])) -> Uart<'b> {
    let order = if msb_first { Order::MsbFirst8 } else { Order::LsbFirst8 };
    let sampling = Sampling::new(order, per_bit, 8, 2_500_000).unwrap();
    let spi = Spi { line: bench.clone(), msb_first, per_bit: per_bit.into() };
    let window = sampling.bytes(12_000 + 44_000);
    SpiUart::new(spi, DriverEnable(bench::Pin(bench.clone())), sampling, &mut buffers.0, &mut buffers.1[..window])
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
        let mut encoder = tformat::blocking::Encoder::new(port, Automatic, bench::Watch(bench.clone()), tformat_line());
        for _ in 0..5 {
            let all = encoder.read_all().unwrap();
            let bench = bench.borrow();
            assert_eq!(bench.truth().verdict(bench.request.unwrap(), all.abs.get().into()), Verdict::Fresh);
            assert!(!bench.driver_on);
            let sent = bench.truth().transmission(bench.request.unwrap()).unwrap();
            assert!((sent.end_ns..sent.end_ns + 3_000).contains(&bench.off_at_ns), "before the encoder answers");
        }
        let address = ::tformat::Address::new(5).unwrap();
        assert_eq!(encoder.write_eeprom(None, address, 0x5a), Ok(0x5a), "{msb_first} {per_bit}");
        assert_eq!(encoder.read_eeprom(None, address), Ok(0x5a));
        assert_eq!(bench.borrow().truth().clashes(), 0);
    }
}

#[test]
fn a_request_that_does_not_fit_is_refused() {
    let bench = bench::Bench::new(Scenario::quiet(), bench::Misframed::Dropped);
    let mut buffers = ([0; 8], [0; 160]);
    let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
    let spi = Spi { line: bench.clone(), msb_first: true, per_bit: 8 };
    let pin = DriverEnable(bench::Pin(bench.clone()));
    let port = SpiUart::new(spi, pin, sampling, &mut buffers.0, &mut buffers.1);
    let mut encoder = tformat::blocking::Encoder::new(port, Automatic, bench::Watch(bench.clone()), tformat_line());
    assert!(matches!(encoder.read_all(), Err(Error::Io(_))));
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
                tformat::blocking::Encoder::new(port, Automatic, bench::Watch(bench.clone()), tformat_line());
            let first = encoder.read_all();
            let second = encoder.read_all();
            assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
        }
    }
}

fn verdict(truth: &Truth, request: Id, tag: u64) -> bool {
    !matches!(truth.verdict(request, tag), Verdict::Old { .. })
}

/// No value is older than its request, and a call on a good line is good, whatever has happened before.
#[test]
fn hostile_events_are_survived() {
    let (mut sum, mut seed, mut good, mut failed) = (Tally::default(), 0, 0, 0);
    // Sampling in a test is slow: a fifth of the events.
    while sum.events() < bench::events() / 5 {
        let bench = bench::Bench::new(bench::scenario(seed), bench::Misframed::Dropped);
        let mut buffers = ([0; 48], [0; 160]);
        let port = uart(&bench, true, 8, &mut buffers);
        let mut encoder = tformat::blocking::Encoder::new(port, Automatic, bench::Watch(bench.clone()), tformat_line());
        for call in 0..100 {
            let before = bench.borrow().tally().events();
            let result = encoder.read_all();
            let mut bench = bench.borrow_mut();
            let quiet = bench.tally().events() == before;
            let Some(request) = bench.request else { continue };
            match result {
                Ok(all) => {
                    assert!(verdict(bench.truth(), request, all.abs.get().into()), "seed {seed}, call {call}");
                    good += 1;
                }
                Err(error) => {
                    assert!(!quiet || bench.truth().intact_answers(request).next().is_none(), "{seed} {call}: {error}");
                    failed += 1;
                }
            }
            let past_ns = bench.now_ns().saturating_sub(1_000_000);
            bench.world().truth_mut().forget_before(past_ns);
        }
        sum.add(&bench.borrow().tally());
        seed += 1;
    }
    println!("{sum}\n{good} good, {failed} failed");
    assert!(sum.of(Kind::Delay) > 0 && good > failed);
}

type Frames<'b> = SpiFrames<'b, Spi<frames::Shared>, Automatic, frames::Port>;

fn frame_port<'b>(bench: &frames::Shared, per_bit: u8, buffers: &'b mut ([u8; 96], [u8; 400])) -> Frames<'b> {
    let sampling = Sampling::new(Order::MsbFirst8, per_bit, 16, 2_500_000).unwrap();
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
        let mut master = nikon::blocking::Master::new(port, clock, Resolution::default(), frames::line());
        for _ in 0..5 {
            let reading = master.read_abs40(EncoderAddress::ZERO).unwrap();
            let abs = reading.response.abs40().unwrap().get();
            let bench = bench.borrow();
            assert_eq!(abs & 0xf_ffff, u64::from(bench.asked_at));
            let answer = bench.world.truth().answers(bench.request.unwrap()).next().unwrap();
            assert!(reading.sampled.latest_ns.abs_diff(answer.start_ns) <= 700, "{per_bit}: {reading:?} {answer:?}");
        }
        let both = nikon_aformat::bus::Addresses::first(2);
        let answers = master.read_all(nikon_aformat::Operation::Abs40Mt, both).unwrap();
        assert!(both.iter().all(|ea| answers.reading(ea).is_some()));
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
            let mut master = nikon::blocking::Master::new(port, clock, Resolution::default(), frames::line());
            let first = master.read_abs40(EncoderAddress::ZERO);
            let second = master.read_abs40(EncoderAddress::ZERO);
            assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
        }
    }
}

#[cfg(feature = "async")]
#[test]
fn both_as_futures() {
    use polls::{FOR_EVER, Looks, run};

    let bench = bench::Bench::new(lost(3, 2, Fault::Drop), bench::Misframed::Dropped);
    let mut buffers = ([0; 48], [0; 160]);
    let port = uart(&bench, true, 8, &mut buffers);
    let timer = Looks(bench::Watch(bench.clone()));
    let mut encoder = tformat::asynch::Encoder::new(port, Automatic, timer, tformat_line());
    assert!(run(encoder.read_all(), FOR_EVER).unwrap().is_ok());
    assert!(run(encoder.read_all(), FOR_EVER).unwrap().is_err());
    assert!(run(encoder.read_all(), FOR_EVER).unwrap().is_ok());

    let bench = frames::Bench::with(lost(3, 2, Fault::Drop), 1, false);
    let mut buffers = ([0; 96], [0; 400]);
    let port = frame_port(&bench, 8, &mut buffers);
    let clock = frames::Port(bench.clone());
    let mut master = nikon::asynch::Master::new(port, clock, Resolution::default(), frames::line());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_ok());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_err());
    assert!(run(master.read_abs40(EncoderAddress::ZERO), FOR_EVER).unwrap().is_ok());
}
