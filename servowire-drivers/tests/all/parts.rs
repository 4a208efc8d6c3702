//! The parts around a line on which nobody answers, call by call: a UART that sends at once, an SPI whose `write` returns before the
//! bits have left, as the trait allows, the pin of the line driver, and the clock.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::digital::{ErrorKind as PinFault, ErrorType as PinErrorType, OutputPin};
use embedded_hal::spi::{self, SpiBus};
use embedded_io::ErrorKind;
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiUart};
use servowire_drivers::{Clock, ClockError, DirectionPin, Worst};

/// A UART that sends at once, and looks at a clock of 50 ns.
pub const WORST: Worst = Worst { uart_start_ns: 0, wake_ns: 50, clock_ns: 50 };
/// A byte at 20 MHz.
pub const BYTE_NS: u64 = 400;

/// Calls of the SPI and its pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    On,
    Off,
    Write,
    Flush,
    Sample,
}

#[derive(Default)]
pub struct World {
    pub now_ns: u64,
    pub calls: Vec<(Call, u64)>,
    /// The call that fails, by its number.
    pub fails: Option<usize>,
    pub on: bool,
    /// How often the pin refuses to go low.
    pub refuses: u32,
    /// Somebody has listened with the driver on.
    pub deaf: bool,
    /// Whether it was on after each request.
    pub left_on: Vec<bool>,
    /// When the bits that were written have left.
    left_ns: u64,
    /// The driver went off before that.
    pub cut: bool,
    /// Somebody talks until then, seldom.
    pub talks_until_ns: u64,
    /// What the next samples are; idle after them.
    pub samples: Vec<u8>,
}

#[derive(Clone, Default)]
pub struct Bench(pub Rc<RefCell<World>>);

pub type Uart<'b> = SpiUart<'b, Bench, DirectionPin<Bench>>;

impl Bench {
    /// A UART made of the SPI and the pin.
    pub fn uart<'b>(&self, buffers: &'b mut ([u8; 48], [u8; 160])) -> Uart<'b> {
        let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
        SpiUart::new(self.clone(), self.pin(), sampling, &mut buffers.0, &mut buffers.1)
    }

    pub fn pin(&self) -> DirectionPin<Self> {
        DirectionPin::new(self.clone(), WORST)
    }

    /// Notes a call; whether it works.
    fn call(&self, call: Call) -> bool {
        let mut world = self.0.borrow_mut();
        let (number, now_ns) = (world.calls.len(), world.now_ns);
        world.calls.push((call, now_ns));
        world.fails != Some(number)
    }

    fn listen(&self) {
        let mut world = self.0.borrow_mut();
        world.deaf |= world.on;
    }

    /// A request is over.
    pub fn over(&self) {
        let mut world = self.0.borrow_mut();
        let on = world.on;
        world.left_on.push(on);
    }
}

impl Clock for Bench {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut world = self.0.borrow_mut();
        world.now_ns += 50;
        Ok(world.now_ns)
    }
}

impl PinErrorType for Bench {
    type Error = PinFault;
}

impl OutputPin for Bench {
    fn set_low(&mut self) -> Result<(), PinFault> {
        let works = self.call(Call::Off);
        let mut world = self.0.borrow_mut();
        if !works || world.refuses > 0 {
            world.refuses = world.refuses.saturating_sub(1);
            return Err(PinFault::Other);
        }
        world.cut |= world.on && world.now_ns < world.left_ns;
        world.on = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), PinFault> {
        self.0.borrow_mut().on = true;
        if self.call(Call::On) { Ok(()) } else { Err(PinFault::Other) }
    }
}

impl embedded_io::ErrorType for Bench {
    type Error = ErrorKind;
}

impl embedded_io::Write for Bench {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl embedded_io::ReadReady for Bench {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        self.listen();
        Ok(false)
    }
}

impl embedded_io::Read for Bench {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        Err(ErrorKind::Other)
    }
}

impl spi::ErrorType for Bench {
    type Error = spi::ErrorKind;
}

impl SpiBus for Bench {
    fn read(&mut self, _: &mut [u8]) -> Result<(), spi::ErrorKind> {
        unreachable!("what MOSI sends meanwhile is not defined")
    }

    /// Comes back at once.
    fn write(&mut self, words: &[u8]) -> Result<(), spi::ErrorKind> {
        if !self.call(Call::Write) {
            return Err(spi::ErrorKind::ModeFault);
        }
        let mut world = self.0.borrow_mut();
        world.left_ns = world.now_ns + BYTE_NS * words.len() as u64;
        Ok(())
    }

    fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), spi::ErrorKind> {
        unreachable!("not needed")
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), spi::ErrorKind> {
        self.listen();
        if !self.call(Call::Sample) {
            return Err(spi::ErrorKind::Overrun);
        }
        let mut world = self.0.borrow_mut();
        assert!(words.iter().all(|word| *word == 0xff), "MOSI idles at 1");
        for (at, word) in words.iter_mut().enumerate() {
            world.now_ns += BYTE_NS;
            // One sample of 0 in ten bytes.
            *word = if at == 3 && world.now_ns < world.talks_until_ns { 0xfe } else { 0xff };
        }
        for (word, sample) in words.iter_mut().zip(std::mem::take(&mut world.samples)) {
            *word = sample;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), spi::ErrorKind> {
        let mut world = self.0.borrow_mut();
        world.now_ns = world.now_ns.max(world.left_ns);
        drop(world);
        if self.call(Call::Flush) { Ok(()) } else { Err(spi::ErrorKind::Other) }
    }
}

#[cfg(feature = "async")]
mod asynch {
    use super::{Bench, ErrorKind, SpiBus, spi};

    impl embedded_io_async::Write for Bench {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            Ok(bytes.len())
        }

        async fn flush(&mut self) -> Result<(), ErrorKind> {
            Ok(())
        }
    }

    impl embedded_io_async::Read for Bench {
        async fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
            self.listen();
            std::future::pending().await
        }
    }

    impl embedded_hal_async::spi::SpiBus for Bench {
        async fn read(&mut self, _: &mut [u8]) -> Result<(), spi::ErrorKind> {
            unreachable!("what MOSI sends meanwhile is not defined")
        }

        async fn write(&mut self, _: &[u8]) -> Result<(), spi::ErrorKind> {
            unreachable!("a transfer that is dropped is cut off")
        }

        async fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), spi::ErrorKind> {
            unreachable!("not needed")
        }

        async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), spi::ErrorKind> {
            SpiBus::transfer_in_place(self, words)
        }

        async fn flush(&mut self) -> Result<(), spi::ErrorKind> {
            SpiBus::flush(self)
        }
    }
}
