//! An SPI that sends onto the hostile line and samples it.

use std::convert::Infallible;

use embedded_hal::spi::{ErrorType, SpiBus};
use servowire_world::Message;

use crate::{bench, frames};

/// 2.5 Mbit/s.
const BIT_PS: u64 = 400_000;
/// From the call of a HAL to the first clock.
const SETUP_NS: u64 = 300;

/// The line as the SPI has it.
pub trait Line {
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

pub struct Spi<L> {
    pub line: L,
    pub msb_first: bool,
    pub per_bit: usize,
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

    /// When a transfer that is asked for now begins and ends.
    fn times(&self, words: usize) -> (u64, u64) {
        let from_ns = self.line.now_ns() + SETUP_NS;
        (from_ns, from_ns + words as u64 * 8 * self.period_ps() / 1000)
    }

    /// Puts the request on the line. When the transfer is over.
    fn begin(&self, words: &[u8]) -> u64 {
        assert!(self.line.driver_is_on());
        let (contents, first, gap_bits) = self.units(words);
        assert!(first >= self.per_bit, "a bit of idle line before the start bit");
        let (from_ns, end_ns) = self.times(words.len());
        self.line.send(&contents, gap_bits, from_ns + first as u64 * self.period_ps() / 1000);
        end_ns
    }

    /// What was on the line from then on.
    fn fill(&self, words: &mut [u8], from_ns: u64) {
        assert!(words.iter().all(|word| *word == 0xff), "MOSI stays idle");
        let samples = self.line.sampled(from_ns, words.len() * 8, self.period_ps());
        for (word, sample) in words.iter_mut().zip(samples) {
            *word = self.ordered(sample);
        }
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
        let end_ns = self.begin(words);
        self.line.pass(end_ns);
        Ok(())
    }

    fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), Infallible> {
        panic!("not used");
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        let (from_ns, end_ns) = self.times(words.len());
        self.line.pass(end_ns);
        self.fill(words, from_ns);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A transfer may be dropped while it lasts. What has been asked for goes out all the same, which is the worst for the next call.
#[cfg(feature = "async")]
impl<L: Line> embedded_hal_async::spi::SpiBus for Spi<L> {
    async fn read(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        SpiBus::read(self, words)
    }

    async fn write(&mut self, words: &[u8]) -> Result<(), Infallible> {
        let end_ns = self.begin(words);
        self.pass_slowly(end_ns).await;
        Ok(())
    }

    async fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Infallible> {
        SpiBus::transfer(self, read, write)
    }

    async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        let (from_ns, end_ns) = self.times(words.len());
        self.pass_slowly(end_ns).await;
        self.fill(words, from_ns);
        Ok(())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

#[cfg(feature = "async")]
impl<L: Line> Spi<L> {
    /// 200 ns a poll.
    async fn pass_slowly(&self, until_ns: u64) {
        std::future::poll_fn(|_| {
            self.line.pass(until_ns.min(self.line.now_ns() + 200));
            if self.line.now_ns() >= until_ns { std::task::Poll::Ready(()) } else { std::task::Poll::Pending }
        })
        .await;
    }
}
