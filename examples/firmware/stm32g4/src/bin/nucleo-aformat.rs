//! Reads positions of an A-format encoder at 2.5 Mbit/s, 5,000 a second, for the control interrupt: an SPI sends, and samples the
//! line eight times a bit.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_time::Delay;
use nikon_aformat::master::Line;
use nikon_aformat::{BitRate, EncoderAddress, Evidence, EvidenceShaftCell, Resolution};
use servowire_boards::put;
use servowire_drivers::nikon::asynch::Driver;
use servowire_drivers::samples::Order;
use servowire_drivers::spi::{Sampling, SpiFrames};
use servowire_drivers::{Clock as _, DirectionPin, WithDelay, Worst};
use servowire_stm32g4::clocks::Start;
use servowire_stm32g4::control::policy;
use servowire_stm32g4::control_interrupt;
use servowire_stm32g4::report::{Report, first_line};
use static_cell::StaticCell;

bind_interrupts!(struct Interrupts {
    DMA1_CHANNEL1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
});

control_interrupt!(Evidence);

const RATE: BitRate = BitRate::Mbit2_5;
/// SPI clocks per bit: 20 MHz.
const PER_BIT: u8 = 8;
const SAMPLING: Sampling = match Sampling::new(Order::MsbFirst8, PER_BIT, 16, RATE.bits_per_second()) {
    Ok(sampling) => sampling,
    Err(_) => panic!("a possible sampling"),
};
/// That of your encoder.
const RESOLUTION: Resolution = match Resolution::new(20, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};
/// Of the motor.
const MAX_TURNS_PER_S: u32 = 100;
/// The transfer has an end of its own before the pin goes off, and nothing but the driver is in between.
const WORST: Worst = Worst { uart_start_ns: 0, wake_ns: 1_000, clock_ns: 7 };
/// Five frames of a request, and the window: 51 us, for an answer of 29 us and the wait before it.
const BYTES: usize = 128;

static CELL: StaticCell<EvidenceShaftCell> = StaticCell::new();
static BUFFERS: StaticCell<[[u8; BYTES]; 2]> = StaticCell::new();

fn spi() -> spi::Config {
    let mut config = spi::Config::default();
    config.frequency = Hertz(RATE.bits_per_second() * PER_BIT as u32);
    config.miso_pull = Pull::Up;
    config.gpio_speed = Speed::VeryHigh;
    config
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let Start { parts, source, mut clock } = Start::new();
    first_line("nucleo-aformat", source, RATE.bits_per_second());
    let tracker = servowire_core::Tracker::new(1 << 20, MAX_TURNS_PER_S).expect("a possible speed");
    let (mut writer, reader) = CELL.init(EvidenceShaftCell::new()).split(tracker);
    LOOP.start(parts.timer, parts.enable, reader, clock);
    let bus =
        Spi::new(parts.spi, parts.uart_tx, parts.spi_mosi, parts.ro, parts.tx_dma, parts.rx_dma, Interrupts, spi());
    let de = DirectionPin::new(Output::new(parts.de, Level::Low, Speed::VeryHigh), WORST);
    let [tx, rx] = BUFFERS.init([[0; BYTES]; 2]);
    let port = SpiFrames::new(bus, de, clock, SAMPLING, tx, rx);
    let mut encoder = Driver::new(port, WithDelay { clock, delay: Delay }, RESOLUTION, Line::new(RATE));
    let mut report = Report::new(parts.watchdog);
    loop {
        report.next().await;
        let read = encoder.read_evidence(EncoderAddress::ZERO).await;
        report.reading(&put(&mut writer, read, clock.now_ns(), policy()));
    }
}
