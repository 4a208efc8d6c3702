//! Core 1: messages to the state machine, samples from it.

use core::sync::atomic::{AtomicU32, Ordering, fence};

use cortex_m::singleton;
use hdsl::Window;
use hdsl::frame::Head;
use rp235x_hal::Sio;
use rp235x_hal::dma::{CH0, Channel, single_buffer};
use rp235x_hal::pac::{PIO0, Peripherals};
use rp235x_hal::pio::{PIO, PIOBuilder, PinDir, PinState, Rx, SM0, ShiftDirection, Tx, UninitStateMachine};

use crate::line::{Message, SAMPLE_WORDS};
use crate::program;

/// DI, DE and RO of the transceiver.
const DI: u8 = 2;
const DE: u8 = 3;
const RO: u8 = 4;

/// In the word with a head: an answer is expected.
pub const ANSWERED: u32 = 1 << 31;

/// The answer, 32 samples a word, the first in bit 31. Core 1 writes it before it tells core 0, which reads it before it tells core 1.
pub static SAMPLES: [AtomicU32; SAMPLE_WORDS] = [const { AtomicU32::new(0) }; SAMPLE_WORDS];

type Machine = (PIO0, SM0);

/// Sets the state machine up and starts it.
///
/// # Panics
/// If the block's instruction memory is not empty.
pub fn start(pio: &mut PIO<PIO0>, machine: UninitStateMachine<Machine>) -> (Tx<Machine>, Rx<Machine>) {
    let installed = pio.install(&program::program()).expect("12 of 32 instructions");
    let offset = installed.offset();
    let (mut machine, rx, tx) = PIOBuilder::from_installed_program(installed)
        .out_pins(DI, 1)
        .side_set_pin_base(DE)
        .in_pin_base(RO)
        .out_shift_direction(ShiftDirection::Right)
        .autopull(true)
        .pull_threshold(32)
        .in_shift_direction(ShiftDirection::Left)
        .autopush(true)
        .push_threshold(32)
        .clock_divisor_fixed_point(1, 0)
        .build(machine);
    machine.set_pins([(DI, PinState::High), (DE, PinState::Low)]);
    machine.set_pindirs([(DI, PinDir::Output), (DE, PinDir::Output), (RO, PinDir::Input)]);
    machine.exec_instruction(jump(offset + program::BEGIN));
    let _running = machine.start();
    (tx, rx)
}

/// `jmp address`, the driver off.
const fn jump(address: u8) -> pio::Instruction {
    pio::Instruction {
        operands: pio::InstructionOperands::JMP { condition: pio::JmpCondition::Always, address },
        delay: 0,
        side_set: Some(0),
    }
}

/// Both ends of the state machine. Messages are fed word by word, which is what this core is for; samples come by DMA, for they must
/// not wait.
pub struct FrontEnd {
    channel: Channel<CH0>,
    tx: Tx<Machine>,
    rx: Rx<Machine>,
}

impl FrontEnd {
    /// With these.
    pub fn new(channel: Channel<CH0>, tx: Tx<Machine>, rx: Rx<Machine>) -> Self {
        Self { channel, tx, rx }
    }

    /// Frame after frame, for ever.
    ///
    /// # Panics
    /// If called twice.
    pub fn run(self) -> ! {
        // SAFETY: each core has a SIO of its own at the same address, and this core uses nothing else of it.
        let mut fifo = Sio::new(unsafe { Peripherals::steal() }.SIO).fifo;
        let Self { mut channel, mut tx, mut rx } = self;
        let mut samples = singleton!(: [u32; SAMPLE_WORDS] = [0; SAMPLE_WORDS]).expect("one front end");
        let [silent, spoken] = [false, true].map(Message::tail);
        loop {
            let word = fifo.read_blocking();
            let answered = word & ANSWERED != 0;
            let head = Window::from_bits((word & !ANSWERED).into(), Head::BITS).unwrap_or(Window::EMPTY);
            let message = Message::head(head, answered);
            if answered {
                let taking = single_buffer::Config::new(channel, rx, samples).start();
                send(&mut tx, &message);
                (channel, rx, samples) = taking.wait();
                for (to, from) in SAMPLES.iter().zip(samples.iter()) {
                    to.store(*from, Ordering::Relaxed);
                }
                fence(Ordering::Release);
            } else {
                send(&mut tx, &message);
            }
            // The end of the frame goes out while core 0 works on the next head.
            fifo.write_blocking(0);
            send(&mut tx, if answered { &spoken } else { &silent });
        }
    }
}

/// Hands a message over as there is room: a word lasts 64 clocks.
fn send(tx: &mut Tx<Machine>, message: &Message) {
    for word in message.words.iter().take(message.len) {
        while !tx.write(*word) {}
    }
}
