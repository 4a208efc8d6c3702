//! Moves three stepper motors along lines that are typed at USART1.
#![no_std]
#![no_main]

use core::fmt::{self, Write};

use embedded_io::{Read, ReadReady, Write as _};
use servowire_boards::{Board, Machine, Pin};
use servowire_stm32f405::clock::CRYSTAL_HZ;
use servowire_stm32f405::steps::{AXES, SLOTS, TICK_HZ};
use servowire_stm32f405::{POWER_STAGES, clock, stack, steps, uart, watchdog};
use step_motion::{Axes, AxesQueue, AxisSetup, Clock, Limits, Path};
use stm32_metapac::interrupt;

const PINS: &[Pin] = &[
    Pin::new("PC0", "STEP X", "GPIO"),
    Pin::new("PC1", "STEP Y", "GPIO"),
    Pin::new("PC2", "STEP Z", "GPIO"),
    Pin::new("PC3", "DIR X", "GPIO"),
    Pin::new("PC4", "DIR Y", "GPIO"),
    Pin::new("PC5", "DIR Z", "GPIO"),
    Pin::new("PB6", "console, out", "USART1"),
    Pin::new("PB7", "console, in", "USART1"),
];

static BOARD: Board =
    const { Board { name: "STM32F405RG", crystal_hz: CRYSTAL_HZ, pins: PINS, power_stage: POWER_STAGES }.checked() };

const CONSOLE_BAUD: u32 = 1_000_000;
/// Number of lines in the look-ahead.
const LINES: usize = 8;
/// Steps/s, steps/s² and steps in a metre of each axis: 80 steps/mm, Z 400.
const MACHINE: [(u32, u32, u32); AXES] =
    [(20_000, 400_000, 80_000), (20_000, 400_000, 80_000), (10_000, 200_000, 400_000)];
/// Ticks between steps in different directions: 20 us.
const REVERSAL_PAUSE: u32 = TICK_HZ / 50_000;
/// Half of the time within which a request takes effect: 4 ms.
const REACH: u32 = TICK_HZ / 250;

static QUEUE: AxesQueue<AXES, SLOTS> = AxesQueue::new();

/// The console, both ways.
struct Console(uart::Uart);

impl Console {
    fn read(&mut self) -> Option<u8> {
        let mut byte = [0];
        let heard = matches!(self.0.read_ready(), Ok(true)) && matches!(self.0.read(&mut byte), Ok(1));
        heard.then_some(byte[0])
    }
}

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write_all(text.as_bytes()).map_err(|_| fmt::Error)
    }
}

#[interrupt]
fn TIM2() {
    static mut OWN: Option<steps::Timer> = None;
    steps::fire(OWN);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    let source = clock::start();
    let (uart, ..) = uart::start(CONSOLE_BAUD);
    let mut console = Console(uart);
    let axes = MACHINE.map(|(speed, acceleration, steps_per_m)| {
        let limits = Limits::new(speed, acceleration).expect("above 0");
        AxisSetup::new(limits, steps_per_m).with_reversal_pause(REVERSAL_PAUSE)
    });
    let path = Path::<AXES, LINES>::new(Clock::new(TICK_HZ).expect("80 MHz"), axes, 0);
    let (axes, timer) = Axes::new(&QUEUE, path.expect("below half the clock"));
    steps::start(timer);
    let _ = writeln!(
        console,
        "stm32f405-motion {}, {TICK_HZ} ticks/s, {source:?}, {}",
        env!("CARGO_PKG_VERSION"),
        BOARD.name
    );
    watchdog::start();
    let mut machine = Machine::new(axes.with_reach(REACH));
    loop {
        watchdog::feed();
        let typed = console.read();
        if let Ok(true) = machine.turn(typed, &mut console, steps::late()) {
            steps::begin();
        }
    }
}
