//! A HIPERFACE DSL receiver on an RP2350 at 150 MHz: PIO and DMA move samples, core 1 feeds them (the front end), core 0 is the link
//! and prints positions. Not tried on silicon.
#![no_std]
#![no_main]

mod console;
mod front_end;
mod line;
mod program;

use core::sync::atomic::{Ordering, fence};

use hal::clocks::init_clocks_and_plls;
use hal::dma::DMAExt;
use hal::gpio::{FunctionPio0, FunctionUart, Pin, Pins, PullUp};
use hal::multicore::{Multicore, Stack};
use hal::pac::Peripherals;
use hal::pio::PIOExt;
use hal::uart::{DataBits, StopBits, UartConfig, UartPeripheral};
use hal::{Clock, Sio, Watchdog, fugit::RateExtU32};
use hdsl::Dialect;
use hdsl::master::Master;
use panic_halt as _;
use rp235x_hal as hal;

use front_end::{ANSWERED, FrontEnd, SAMPLES};

/// What the boot ROM wants to see.
#[unsafe(link_section = ".start_block")]
#[used]
pub static IMAGE_DEF: hal::block::ImageDef = hal::block::ImageDef::secure_exe();

const CRYSTAL_HZ: u32 = 12_000_000;
const CONSOLE_BAUD: u32 = 1_000_000;

static CORE1_STACK: Stack<1024> = Stack::new();

#[hal::entry]
fn main() -> ! {
    let mut p = Peripherals::take().expect("called once");
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    // 150 MHz, the HAL's setting.
    let clocks = init_clocks_and_plls(CRYSTAL_HZ, p.XOSC, p.CLOCKS, p.PLL_SYS, p.PLL_USB, &mut p.RESETS, &mut watchdog)
        .expect("clocks");
    let mut sio = Sio::new(p.SIO);
    let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, sio.gpio_bank0, &mut p.RESETS);
    let uart_pins: (Pin<_, FunctionUart, _>, Pin<_, FunctionUart, _>) =
        (pins.gpio0.into_function(), pins.gpio1.into_function());
    let uart = UartPeripheral::new(p.UART0, uart_pins, &mut p.RESETS)
        .enable(
            UartConfig::new(CONSOLE_BAUD.Hz(), DataBits::Eight, None, StopBits::One),
            clocks.peripheral_clock.freq(),
        )
        .expect("9.4 clocks a sample");
    let _: Pin<_, FunctionPio0, _> = pins.gpio2.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio3.into_function();
    let _: Pin<_, FunctionPio0, PullUp> = pins.gpio4.into_function().into_pull_type();
    let (mut pio, machine, ..) = p.PIO0.split(&mut p.RESETS);
    let (tx, rx) = front_end::start(&mut pio, machine);
    let dma = p.DMA.split(&mut p.RESETS);
    let front_end = FrontEnd::new(dma.ch0, tx, rx);

    let mut multicore = Multicore::new(&mut p.PSM, &mut p.PPB, &mut sio.fifo);
    if let [_, core1] = multicore.cores() {
        let stack = CORE1_STACK.take().expect("called once");
        core1.spawn(stack, move || front_end.run()).expect("core 1");
    }

    let timer = hal::Timer::new_timer0(p.TIMER0, &mut p.RESETS, &clocks);
    let now_ns = || timer.get_counter().ticks() * 1_000;
    let mut master = Master::new(Dialect::SICK);
    let mut console = console::Console::new(uart);
    loop {
        let transmission = master.transmission();
        // A head has 26 bits.
        let head = transmission.head.bits().bits() as u32;
        sio.fifo.write_blocking(head | if transmission.answered { ANSWERED } else { 0 });
        // A piece of the console's work, while the frame is on the line.
        console.step(&master, now_ns());
        // Core 1 says that the answer is there, or that there is none.
        sio.fifo.read_blocking();
        // Late by the way through the FIFO and up to a microsecond: little beside the frame of 25 us.
        let end_ns = now_ns();
        fence(Ordering::Acquire);
        let mut samples = [0; hdsl::sampling::WINDOW];
        for (bytes, word) in samples.chunks_exact_mut(4).zip(&SAMPLES) {
            bytes.copy_from_slice(&word.load(Ordering::Relaxed).to_be_bytes());
        }
        // It fails for too few samples only, and they are all there.
        let _ = master.hear(&samples, end_ns);
    }
}
