//! Two stepper motors under commands from the console.

use core::fmt::Write;

use servowire_boards::Machine;
use step_motion::{Axes, AxesQueue, AxisSetup, Clock, Limits, Path};

use crate::board::clocks;
use crate::console;
use crate::hal::fugit::ExtU32;
use crate::hal::gpio::{FunctionPio0, Pin, Pins};
use crate::hal::pac::Peripherals;
use crate::hal::pio::PIOExt;
use crate::hal::{Sio, Watchdog};
use crate::steps::{self, AXES, SLOTS, TICK_HZ};

/// Number of lines in the look-ahead.
const LINES: usize = 8;
/// Steps in a metre: 80 in a millimetre.
const STEPS_PER_M: u32 = 80_000;
/// Steps/s and steps/s² of both axes.
const SPEED: u32 = 5_000;
const ACCELERATION: u32 = 200_000;
/// Ticks between steps in different directions: 20 us.
const REVERSAL_PAUSE: u32 = TICK_HZ / 50_000;
/// Half of the time within which a request takes effect: 20 ms.
const REACH: u32 = TICK_HZ / 50;
/// Longer than any wait here.
const WATCHDOG_MS: u32 = 1_000;

static QUEUE: AxesQueue<AXES, SLOTS> = AxesQueue::new();

/// Sets the board up and does what is typed, for ever.
///
/// # Panics
/// If called twice, or if a clock does not start.
pub fn run(image: &str) -> ! {
    let mut p = Peripherals::take().expect("called once");
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let clocks = clocks(&mut watchdog, p.XOSC, p.CLOCKS, (p.PLL_SYS, p.PLL_USB), &mut p.RESETS);
    let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, Sio::new(p.SIO).gpio_bank0, &mut p.RESETS);
    let uart_pins = (pins.gpio0.into_function(), pins.gpio1.into_function());
    let mut console = console::uart(p.UART0, uart_pins, &mut p.RESETS, &clocks);
    let _: Pin<_, FunctionPio0, _> = pins.gpio2.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio3.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio4.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio5.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio6.into_function();
    let _: Pin<_, FunctionPio0, _> = pins.gpio7.into_function();

    let limits = Limits::new(SPEED, ACCELERATION).expect("above 0");
    let axis = AxisSetup::new(limits, STEPS_PER_M).with_reversal_pause(REVERSAL_PAUSE);
    let path = Path::<AXES, LINES>::new(Clock::new(TICK_HZ).expect("10 MHz"), [axis; AXES], 0);
    let (axes, timer) = Axes::new(&QUEUE, path.expect("below half the clock"));
    let (mut block, sm0, sm1, sm2, _) = p.PIO0.split(&mut p.RESETS);
    steps::start(&mut block, timer, (sm0, sm1, sm2));
    let _ = writeln!(
        console,
        "{image} {}, {AXES} axes, {TICK_HZ} ticks/s, DIR GPIO 2 and 3, STEP GPIO 6 and 7",
        env!("CARGO_PKG_VERSION")
    );
    watchdog.start(WATCHDOG_MS.millis());
    let mut machine = Machine::new(axes.with_reach(REACH));
    loop {
        watchdog.feed();
        let mut byte = [0];
        let typed = console.read_raw(&mut byte).is_ok().then_some(byte[0]);
        if let Ok(true) = machine.turn(typed, &mut console, steps::late()) {
            steps::begin();
        }
    }
}
