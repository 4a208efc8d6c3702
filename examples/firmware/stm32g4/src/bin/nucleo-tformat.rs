//! Reads positions of a T-Format encoder at 2.5 Mbit/s, 5,000 a second, for the control interrupt.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Pull;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{bind_interrupts, peripherals};
use embassy_time::Delay;
use servowire_boards::{RESOLUTION, put};
use servowire_drivers::tformat::asynch::Driver;
use servowire_drivers::{Automatic, Clock as _, WithDelay};
use servowire_stm32g4::clocks::Start;
use servowire_stm32g4::control::policy;
use servowire_stm32g4::control_interrupt;
use servowire_stm32g4::report::{Report, first_line};
use static_cell::StaticCell;
use tformat::master::Line;
use tformat::{BitRate, Evidence, EvidenceShaftCell};

bind_interrupts!(struct Interrupts {
    USART2 => usart::BufferedInterruptHandler<peripherals::USART2>;
});

control_interrupt!(Evidence);

const RATE: BitRate = BitRate::Mbit2_5;
/// Of the motor.
const MAX_TURNS_PER_S: u32 = 100;
/// A byte may be handed over a control interrupt and a wake-up late.
const HAND_OVER_NS: u32 = 10_000;

static CELL: StaticCell<EvidenceShaftCell> = StaticCell::new();
static BUFFERS: StaticCell<([u8; 16], [u8; 64])> = StaticCell::new();

fn uart() -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = RATE.bits_per_second();
    config.rx_pull = Pull::Up;
    config.eager_reads = Some(1);
    // 31/16 bit, 775 ns: more than one bit before the request, and off long before the answer, which comes after 3 us. embassy-stm32
    // 0.6.0 takes the first for both, so they have to be equal.
    config.de_assertion_time = 31;
    config.de_deassertion_time = 31;
    config
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let Start { parts, source, mut clock } = Start::new();
    first_line("nucleo-tformat", source, RATE.bits_per_second());
    let tracker =
        servowire_core::Tracker::new(RESOLUTION.counts_per_turn(), MAX_TURNS_PER_S).expect("a possible speed");
    let (mut writer, reader) = CELL.init(EvidenceShaftCell::new()).split(tracker);
    LOOP.start(parts.timer, parts.enable, reader, clock);
    let (tx, rx) = BUFFERS.init(([0; 16], [0; 64]));
    let uart = BufferedUart::new_with_de(parts.usart, parts.ro, parts.uart_tx, parts.de, Interrupts, tx, rx, uart())
        .expect("64 clocks a bit");
    let line = Line::new(RATE).with_hand_over_ns(HAND_OVER_NS);
    let mut encoder =
        Driver::new(uart, Automatic, WithDelay { clock, delay: Delay }, line).expect("the UART switches the driver");
    let mut report = Report::new(parts.watchdog);
    loop {
        report.next().await;
        let read = encoder.read_evidence(RESOLUTION).await;
        report.reading(&put(&mut writer, read, clock.now_ns(), policy()));
    }
}
