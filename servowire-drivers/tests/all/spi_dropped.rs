//! What an encoder hears of ID 0 when the future that sends it through an SPI is dropped.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::spi::{ErrorType, SpiBus};
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiUart};
use servowire_drivers::tformat::asynch::Driver;
use servowire_drivers::{Automatic, Direction, Worst};
use tformat::master::Line;
use tformat::{BitRate, Request};

use crate::polls::{Looks, pause, run};

/// Samples a bit.
const PER_BIT: usize = 8;

/// The line, sample by sample: 1 where nobody drives it, as a line with bias rests.
#[derive(Debug, Default)]
struct Wire {
    levels: Vec<bool>,
    driven: bool,
}

type Shared = Rc<RefCell<Wire>>;

impl Wire {
    /// Sends a word; gives what is on the line meanwhile.
    fn put(&mut self, word: u8) -> u8 {
        let heard = if self.driven { word } else { 0xff };
        self.levels.extend((0..8).rev().map(|bit| heard >> bit & 1 == 1));
        heard
    }

    /// What a UART makes of it: bytes, and whether their stop bit was 1.
    fn heard(&self) -> Vec<(u8, bool)> {
        let level = |at: usize| self.levels.get(at).copied().unwrap_or(true);
        let (mut at, mut heard) = (0, Vec::new());
        while at < self.levels.len() {
            if level(at) {
                at += 1;
                continue;
            }
            let bit = |bit: usize| level(at + bit * PER_BIT + PER_BIT / 2);
            heard.push(((0..8).map(|place| u8::from(bit(place + 1)) << place).sum(), bit(9)));
            at += 9 * PER_BIT + PER_BIT / 2 + 1;
        }
        heard
    }
}

/// An SPI whose async transfers stop where they are dropped. Nobody answers.
struct Spi(Shared);

impl ErrorType for Spi {
    type Error = Infallible;
}

impl SpiBus for Spi {
    /// What it sends while it only reads are ones.
    fn read(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        self.transfer(words, &[])
    }

    fn write(&mut self, words: &[u8]) -> Result<(), Infallible> {
        self.transfer(&mut [], words)
    }

    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Infallible> {
        for at in 0..read.len().max(write.len()) {
            let heard = self.0.borrow_mut().put(sent(write, at));
            keep(read, at, heard);
        }
        Ok(())
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        for word in words {
            *word = self.0.borrow_mut().put(*word);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl embedded_hal_async::spi::SpiBus for Spi {
    async fn read(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        embedded_hal_async::spi::SpiBus::transfer(self, words, &[]).await
    }

    async fn write(&mut self, words: &[u8]) -> Result<(), Infallible> {
        embedded_hal_async::spi::SpiBus::transfer(self, &mut [], words).await
    }

    async fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Infallible> {
        for at in 0..read.len().max(write.len()) {
            pause().await;
            let heard = self.0.borrow_mut().put(sent(write, at));
            keep(read, at, heard);
        }
        Ok(())
    }

    async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
        let sent = words.to_vec();
        embedded_hal_async::spi::SpiBus::transfer(self, words, &sent).await
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The word of a transfer that goes out at a place: ones after the last.
fn sent(words: &[u8], at: usize) -> u8 {
    words.get(at).copied().unwrap_or(0xff)
}

/// What was heard at a place of a transfer, if anybody wants it.
fn keep(words: &mut [u8], at: usize, heard: u8) {
    if let Some(word) = words.get_mut(at) {
        *word = heard;
    }
}

/// The line driver, switched by the SPI's own pin.
struct Pin(Shared);

impl Direction for Pin {
    type Error = Infallible;

    fn transmit(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().driven = true;
        Ok(())
    }

    fn receive(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().driven = false;
        Ok(())
    }

    fn worst(&self) -> Option<Worst> {
        None
    }
}

/// ID 0 is 02h. Cut off after its sixth bit, on a line that rests at 1, it is C2h: ID 8, which sets the zero.
#[test]
fn id_0_is_whole_or_was_not_sent() {
    let (mut whole, mut now_ns) = (0, 0);
    for polls in 0..400 {
        let wire = Shared::default();
        let (mut tx, mut rx) = ([0; 48], [0; 160]);
        let sampling = Sampling::new(Order::MsbFirst8, PER_BIT as u8, 8, 2_500_000).unwrap();
        let port = SpiUart::new(Spi(wire.clone()), Pin(wire.clone()), sampling, &mut tx, &mut rx);
        let timer = Looks(|| {
            now_ns += 1_000;
            now_ns
        });
        let mut encoder = Driver::new(port, Automatic, timer, Line::new(BitRate::Mbit2_5)).unwrap();
        let _ = run(encoder.transact(Request::ReadSingleTurn), polls);
        let heard = wire.borrow().heard();
        assert!(heard.is_empty() || heard == [(0x02, true)], "dropped after {polls} polls: {heard:02x?}");
        assert!(!wire.borrow().driven, "dropped after {polls} polls");
        whole += usize::from(!heard.is_empty());
    }
    assert!((200..400).contains(&whole), "{whole}");
}
