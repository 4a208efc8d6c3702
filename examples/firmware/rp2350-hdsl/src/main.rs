//! A HIPERFACE DSL receiver on an RP2350 at 150 MHz: PIO and DMA are the line, core 0 is the link, core 1 uses the position. The whole
//! image runs in an emulator with its peripherals; it was not tried on silicon.
#![no_std]
#![no_main]

mod console;
mod frame;
mod front_end;
#[path = "../../rp2040/src/last_words.rs"]
mod last_words;
mod link;
mod program;
mod ram;

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::singleton;
use hal::clocks::init_clocks_and_plls;
use hal::gpio::{FunctionPio0, FunctionUart, Pin, Pins, PullUp};
use hal::multicore::{Multicore, Stack};
use hal::pac::Peripherals;
use hal::pio::PIOExt;
use hal::uart::{DataBits, StopBits, UartConfig, UartPeripheral};
use hal::{
    Clock, Sio, Watchdog,
    fugit::{ExtU32, RateExtU32},
};
use hdsl::master::Master;
use hdsl::{Dialect, EvidenceCell};
use rp235x_hal as hal;
use servowire_boards::{Board, FirstLine, Pin as BoardPin, Source};

use front_end::FrontEnd;
use last_words::Before;

/// The block that the boot ROM requires.
#[unsafe(link_section = ".start_block")]
#[used]
pub static IMAGE_DEF: hal::block::ImageDef = hal::block::ImageDef::secure_exe();

const CRYSTAL_HZ: u32 = 12_000_000;
const CONSOLE_BAUD: u32 = 1_000_000;
const SYSTEM_HZ: u32 = 150_000_000;
/// Longer than the start of the link and a console line take.
const WATCHDOG_MS: u32 = 100;

/// The pins, of a Raspberry Pi Pico 2; no power stage is near.
static BOARD: Board = Board::plain(
    "Raspberry Pi Pico 2",
    CRYSTAL_HZ,
    &[
        BoardPin::new("GPIO 2", "DI", "pin 4"),
        BoardPin::new("GPIO 3", "DE and /RE", "pin 5"),
        BoardPin::new("GPIO 4", "RO", "pin 6"),
    ],
);

const FIRST: FirstLine = FirstLine {
    image: env!("CARGO_PKG_NAME"),
    version: env!("CARGO_PKG_VERSION"),
    board: &BOARD,
    core_hz: SYSTEM_HZ,
    source: Source::Crystal,
    bits_per_second: 9_375_000,
};

static CORE1_STACK: Stack<2048> = Stack::new();

/// How often the link was restarted because this program was late.
pub static LATE: AtomicU32 = AtomicU32::new(0);
/// Changes with every frame: core 0 is at work.
pub static FRAME: AtomicU32 = AtomicU32::new(0);

#[hal::entry]
fn main() -> ! {
    let mut p = Peripherals::take().expect("called once");
    let before = Before::take(&p.WATCHDOG);
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    // 150 MHz, the HAL's setting.
    let clocks = init_clocks_and_plls(CRYSTAL_HZ, p.XOSC, p.CLOCKS, p.PLL_SYS, p.PLL_USB, &mut p.RESETS, &mut watchdog)
        .expect("clocks");
    let mut sio = Sio::new(p.SIO);
    let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, sio.gpio_bank0, &mut p.RESETS);
    let uart_pins: (Pin<_, FunctionUart, _>, Pin<_, FunctionUart, _>) =
        (pins.gpio0.into_function(), pins.gpio1.into_function());
    let mut uart = UartPeripheral::new(p.UART0, uart_pins, &mut p.RESETS)
        .enable(
            UartConfig::new(CONSOLE_BAUD.Hz(), DataBits::Eight, None, StopBits::One),
            clocks.peripheral_clock.freq(),
        )
        .expect("a rate that the UART has");
    console::begin(&mut uart, before);
    let _: Pin<_, FunctionPio0, _> = pins.gpio2.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio3.into_function();
    let _: Pin<_, FunctionPio0, PullUp> = pins.gpio4.into_function().into_pull_type();
    let (pio, player, sampler, ..) = p.PIO0.split(&mut p.RESETS);
    p.RESETS.reset().modify(|_, w| w.dma().clear_bit());
    while p.RESETS.reset_done().read().dma().bit_is_clear() {}
    let mut front_end = FrontEnd::new(pio, p.DMA, (player, sampler));

    let timer = hal::Timer::new_timer0(p.TIMER0, &mut p.RESETS, &clocks);
    let now_ns = move || timer.get_counter().ticks() * 1_000;
    let cell = singleton!(: EvidenceCell = EvidenceCell::new()).expect("called once");
    let (mut feedback, reader) = cell.split();

    watchdog.start(WATCHDOG_MS.millis());
    let mut multicore = Multicore::new(&mut p.PSM, &mut p.PPB, &mut sio.fifo);
    if let [_, core1] = multicore.cores() {
        let stack = CORE1_STACK.take().expect("called once");
        core1.spawn(stack, move || console::run(uart, watchdog, reader, now_ns)).expect("core 1");
    }

    loop {
        let mut master = Master::new(Dialect::SICK);
        master.set_stuffing(frame::RUNNING.stuffing());
        let first = master.transmission();
        let mut line = front_end.start(first.head);
        let _ = link::run(&mut line, &mut master, &mut feedback, &first, now_ns());
        front_end = line.stop();
        LATE.store(LATE.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
}
