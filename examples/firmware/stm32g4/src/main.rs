//! Reads positions of a T-Format encoder at 2.5 Mbit/s and prints them. DMA sends and receives, the UART itself switches the
//! line driver, and the processor sleeps meanwhile.
#![no_std]
#![no_main]

use cortex_m::peripheral::DWT;
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_stm32::mode::{Async, Blocking};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, Uart, UartTx};
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_time::{Duration, Ticker, with_timeout};
use embedded_io::Write;
use panic_halt as _;
use servowire_core::{TickRate, TimeBase};
use tformat::master::{Exchange, Line, Progress, Transaction};
use tformat::{BitRate, Request, Response};

bind_interrupts!(struct Interrupts {
    USART1 => usart::InterruptHandler<peripherals::USART1>;
    DMA1_CHANNEL1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
});

/// The crystal of the board.
const CRYSTAL_HZ: u32 = 8_000_000;
/// 2.5 Mbit/s are 64 clocks of it, exactly.
const CORE_HZ: u32 = 160_000_000;
const RATE: BitRate = BitRate::Mbit2_5;
const CYCLE: Duration = Duration::from_millis(1);
/// The request, the wait for the answer, the answer, and idle: 4, 10, 44 and 4 us, and as much again.
const PATIENCE: Duration = Duration::from_micros(120);
/// The UART says that the line is idle after a field of silence.
const IDLE_NS: u64 = 4_000;
/// The longest answer, and some noise.
const MOST_BYTES: usize = 16;

/// The time from the cycle counter, which has to be looked at every 13 s.
struct Clock(TimeBase<32>);

impl Clock {
    fn new() -> Self {
        let mut core = cortex_m::Peripherals::take().expect("called once");
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        Self(TimeBase::new(TickRate::of::<CORE_HZ>(), DWT::cycle_count()))
    }

    fn now_ns(&mut self) -> u64 {
        self.0.now_ns(DWT::cycle_count()).expect("a cycle is shorter than a turn of the counter")
    }
}

fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(CRYSTAL_HZ), mode: HseMode::Oscillator });
    // 8 MHz into the PLL, 320 MHz in it.
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL40,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV1;
    config.rcc.apb2_pre = APBPrescaler::DIV1;
    config.rcc.boost = true;
    config
}

fn uart() -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = RATE.bits_per_second();
    // 31/16 bit, 775 ns: more than one bit before the request, and off long before the answer, which comes after 3 us. embassy-stm32
    // 0.6.0 takes the first for both, so they have to be equal.
    config.de_assertion_time = 31;
    config.de_deassertion_time = 31;
    config
}

/// One request and its answer. The reception is armed before the request goes out: the answer comes 3 us after it.
async fn exchange(uart: &mut Uart<'static, Async>, clock: &mut Clock, line: Line) -> Result<Exchange, tformat::Error> {
    let mut transaction = Transaction::start(Request::ReadAll, line, clock.now_ns());
    let frame = transaction.transmission().frame;
    let mut buffer = [0; MOST_BYTES];
    let (tx, rx) = uart.split_ref();
    let both = join(rx.read_until_idle(&mut buffer), tx.write(frame.as_bytes()));
    let received = with_timeout(PATIENCE, both).await;
    let now_ns = clock.now_ns();
    let progress = match received {
        Ok((Ok(count), Ok(()))) => {
            transaction.hear(buffer.get(..count).unwrap_or_default(), now_ns.saturating_sub(IDLE_NS))
        }
        // Noise, framing, overrun: all bytes of this reading are gone.
        Ok(_) => transaction.framing_error(now_ns),
        Err(_) => transaction.poll(now_ns),
    };
    match progress {
        Progress::Done { value, .. } => Ok(value),
        Progress::Failed { error, .. } => Err(error),
        // Bytes have come, and too few: the line was idle after them.
        Progress::Pending { until_ns } => match transaction.poll(until_ns.saturating_add(1)) {
            Progress::Done { value, .. } => Ok(value),
            Progress::Failed { error, .. } => Err(error),
            Progress::Pending { .. } => Err(tformat::Error::NoResponse { echo: false }),
        },
    }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_stm32::init(clocks());
    let mut clock = Clock::new();
    let mut console_config = usart::Config::default();
    console_config.baudrate = 1_000_000;
    let console: Result<UartTx<'static, Blocking>, _> = UartTx::new_blocking(p.USART2, p.PA2, console_config);
    let mut console = console.expect("160 clocks a bit");
    let mut encoder = Uart::new_with_de(p.USART1, p.PA10, p.PA9, p.PA12, p.DMA1_CH1, p.DMA1_CH2, Interrupts, uart())
        .expect("64 clocks a bit");
    let _ = writeln!(console, "T-Format master, {} bit/s, core {} Hz", RATE.bits_per_second(), CORE_HZ);
    // A block is handed over up to eleven fields and the idle time after the first of its bytes.
    let line = Line::new(RATE).with_hand_over_ns(100_000);
    let mut ticker = Ticker::every(CYCLE);
    let (mut good, mut bad) = (0_u32, 0_u32);
    loop {
        // A cycle is longer than any answer that is late, so the line is free at its end.
        ticker.next().await;
        match exchange(&mut encoder, &mut clock, line).await.map(|exchange| exchange.response) {
            Ok(Response::ReadAll(all)) => {
                good += 1;
                if good % 256 == 1 {
                    let _ = writeln!(console, "{all}, {good} good, {bad} bad");
                }
            }
            Ok(_) => {}
            Err(error) => {
                bad += 1;
                let _ = writeln!(console, "fault: {error}, {good} good, {bad} bad");
            }
        }
    }
}
