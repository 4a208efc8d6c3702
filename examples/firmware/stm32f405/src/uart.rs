//! USART1 for the encoder, received by interrupt into a ring; USART2 for the console.

use core::convert::Infallible;
use core::fmt;
use core::sync::atomic::{AtomicU16, AtomicUsize, Ordering};

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_boards::LineFault;
use stm32_metapac::gpio::vals::{Moder, Ospeedr, Pupdr};
use stm32_metapac::interrupt;
use stm32_metapac::usart::Usart;
use stm32_metapac::{GPIOA, GPIOB, Interrupt, RCC, USART1, USART2};

use crate::clock::{APB1_HZ, APB2_HZ};

const CONSOLE_BAUD: u32 = 1_000_000;
/// Of port B.
const DE: usize = 8;
/// Of port B.
const RO: usize = 7;

/// Switches everything on: PB6 and PB7 are the encoder's TX and RX, PB8 its DE, PA2 the console's TX.
pub fn start(bits_per_second: u32) -> (Uart, DriverEnable, Console) {
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
    });
    RCC.apb1enr().modify(|w| w.set_usart2en(true));
    RCC.apb2enr().modify(|w| w.set_usart1en(true));
    for (port, pin) in [(GPIOA, 2), (GPIOB, 6), (GPIOB, RO)] {
        port.afr(pin / 8).modify(|w| w.set_afr(pin % 8, 7));
        port.ospeedr().modify(|w| w.set_ospeedr(pin, Ospeedr::VERY_HIGH_SPEED));
        port.moder().modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    // Idle while nobody drives: the transceiver's output floats while its receiver is off.
    GPIOB.pupdr().modify(|w| w.set_pupdr(RO, Pupdr::PULL_UP));
    GPIOB.bsrr().write(|w| w.set_br(DE, true));
    GPIOB.moder().modify(|w| w.set_moder(DE, Moder::OUTPUT));
    open(USART1, APB2_HZ, bits_per_second);
    open(USART2, APB1_HZ, CONSOLE_BAUD);
    USART1.cr1().modify(|w| w.set_rxneie(true));
    // SAFETY: the handler below is all that shares something with the rest, and that by atomics.
    unsafe { cortex_m::peripheral::NVIC::unmask(Interrupt::USART1) };
    (Uart(()), DriverEnable(()), Console(()))
}

/// 8N1, 16 samples a bit.
fn open(usart: Usart, clock_hz: u32, bits_per_second: u32) {
    usart.brr().write_value(stm32_metapac::usart::regs::Brr((clock_hz + bits_per_second / 2) / bits_per_second));
    usart.cr1().write(|w| {
        w.set_ue(true);
        w.set_te(true);
        w.set_re(true);
    });
}

const RING: usize = 32;
/// A byte that came with a fault: framing, noise, overrun.
const FAULTY: u16 = 0x100;

static BYTES: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];
/// Counts of bytes received and of bytes taken so far.
static RECEIVED: AtomicUsize = AtomicUsize::new(0);
static TAKEN: AtomicUsize = AtomicUsize::new(0);

#[interrupt]
fn USART1() {
    let status = USART1.sr().read();
    let faulty = status.fe() || status.ne() || status.ore();
    if !status.rxne() && !faulty {
        return;
    }
    // Reading it clears all of them.
    let byte = USART1.dr().read().dr() & 0xff;
    let at = RECEIVED.load(Ordering::Relaxed);
    // A full ring keeps what it has: the driver drains before each request.
    if at.wrapping_sub(TAKEN.load(Ordering::Acquire)) < RING {
        BYTES[at % RING].store(byte | if faulty { FAULTY } else { 0 }, Ordering::Relaxed);
        RECEIVED.store(at.wrapping_add(1), Ordering::Release);
    }
}

/// The encoder's USART.
pub struct Uart(());

impl ErrorType for Uart {
    type Error = LineFault;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, LineFault> {
        Ok(RECEIVED.load(Ordering::Acquire) != TAKEN.load(Ordering::Relaxed))
    }
}

impl Read for Uart {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LineFault> {
        let mut count = 0;
        let mut at = TAKEN.load(Ordering::Relaxed);
        for place in bytes {
            while count == 0 && RECEIVED.load(Ordering::Acquire) == at {}
            if RECEIVED.load(Ordering::Acquire) == at {
                break;
            }
            let byte = BYTES[at % RING].load(Ordering::Relaxed);
            at = at.wrapping_add(1);
            TAKEN.store(at, Ordering::Release);
            if byte & FAULTY != 0 {
                return Err(LineFault::Damaged);
            }
            *place = byte as u8;
            count += 1;
        }
        Ok(count)
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, LineFault> {
        put(USART1, bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), LineFault> {
        while !USART1.sr().read().tc() {}
        Ok(())
    }
}

fn put(usart: Usart, bytes: &[u8]) {
    for byte in bytes {
        while !usart.sr().read().txe() {}
        usart.dr().write(|w| w.set_dr(u16::from(*byte)));
    }
}

/// DE and /RE of the transceiver.
pub struct DriverEnable(());

impl PinErrorType for DriverEnable {
    type Error = Infallible;
}

impl OutputPin for DriverEnable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        GPIOB.bsrr().write(|w| w.set_br(DE, true));
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        GPIOB.bsrr().write(|w| w.set_bs(DE, true));
        Ok(())
    }
}

/// Prints.
pub struct Console(());

impl Console {
    /// For a panic: its previous owner no longer runs.
    pub const fn last_words() -> Self {
        Self(())
    }
}

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        put(USART2, text.as_bytes());
        Ok(())
    }
}
