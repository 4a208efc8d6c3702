//! The line as a PIO block sees it: bits out with the driver on, units in.
//!
//! Wiring: GPIO 2 to DI, GPIO 3 to DE and /RE (tied), GPIO 4 to RO of an RS-485 transceiver.

use cortex_m::singleton;
use rp2040_hal::dma::{Channel, SingleChannel};
use rp2040_hal::pac::{self, PIO0};
use rp2040_hal::pio::{
    PIO, PIOBuilder, PinDir, PinState, Rx, SM0, SM1, ShiftDirection, StateMachine, Stopped, Tx, UninitStateMachine,
};

use crate::clock::Clock;
use crate::programs::{self, Rate};

/// DI of the transceiver.
pub const DI: u8 = 2;
/// DE and /RE of the transceiver.
pub const DE: u8 = 3;
/// RO of the transceiver.
pub const RO: u8 = 4;

/// Most words of one transmission: number of bits, delay, and 128 bits.
const MOST_WORDS: usize = 6;

/// The transmitter's FIFO.
pub struct Transmitter {
    fifo: Tx<(PIO0, SM0)>,
    cycles: u32,
}

/// The words that make the transmitter send something: made ahead, they only have to be written.
#[derive(Debug, Clone, Copy, Default)]
pub struct Prepared {
    words: [u32; MOST_WORDS],
    len: u8,
}

impl Prepared {
    /// `len` line bits, at most 126, the first in bit 0. The driver is on for one idle bit before them, so that the line is
    /// settled at the start bit. `wait_cycles`: cycles of the state machine before that.
    pub fn new(line: u128, len: u32, wait_cycles: u32) -> Self {
        let line = line << 1 | 1 | !0 << (len + 1);
        let bits = len + 1;
        // Not a multiple of 32, see the program: the last bit may well be idle.
        let bits = if bits % 32 == 0 { bits + 1 } else { bits };
        let [a, b, c, d] = [0, 32, 64, 96].map(|at| (line >> at) as u32);
        Self { words: [bits - 1, wait_cycles, a, b, c, d], len: 2 + bits.div_ceil(32) as u8 }
    }
}

impl Transmitter {
    /// Cycles of the state machine a bit.
    pub const fn cycles(&self) -> u32 {
        self.cycles
    }

    /// Starts a transmission. What does not fit into the FIFO goes in while the first bits are sent.
    #[inline]
    pub fn send(&mut self, prepared: &Prepared) {
        for word in prepared.words.iter().take(prepared.len.into()) {
            while !self.fifo.write(*word) {}
        }
    }
}

/// Units of the receiver, taken from its FIFO one by one.
pub struct Receiver {
    fifo: Rx<(PIO0, SM1)>,
    bits: u8,
}

/// A unit of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// Its bits, the first of the line in bit 0.
    pub content: u16,
    /// Whether the stop bit was 1.
    pub framed: bool,
}

impl Unit {
    #[inline]
    fn of(word: u32, bits: u8) -> Self {
        Self { content: (word << 1 >> (32 - u32::from(bits))) as u16, framed: word >> 31 == 1 }
    }
}

impl Receiver {
    /// The next unit, if one has ended.
    #[inline]
    pub fn take(&mut self) -> Option<Unit> {
        self.fifo.read().map(|word| Unit::of(word, self.bits))
    }
}

/// How many units the ring holds.
const RING: usize = 64;

/// The ring must lie at a multiple of its size.
#[repr(C, align(256))]
struct Ring([u32; RING]);

const _: () = assert!(size_of::<Ring>() == 256 && align_of::<Ring>() == 256);

/// Units of the receiver, which DMA writes into a ring whatever the processor does.
pub struct RingReceiver {
    ring: *const u32,
    /// The next to take.
    at: usize,
    bits: u8,
    _fifo: Rx<(PIO0, SM1)>,
}

impl RingReceiver {
    /// Starts DMA channel 0.
    ///
    /// # Panics
    /// If called twice.
    pub fn new(_channel: Channel<rp2040_hal::dma::CH0>, receiver: Receiver) -> Self
    where
        Channel<rp2040_hal::dma::CH0>: SingleChannel,
    {
        let ring = singleton!(: Ring = Ring([0; RING])).expect("one receiver");
        let ring = core::ptr::from_mut(ring).cast::<u32>();
        let Receiver { fifo, bits } = receiver;
        // SAFETY: the channel is owned, and so is the ring, which nobody reads but by volatile access below.
        let dma = unsafe { &*pac::DMA::ptr() };
        dma.ch(0).ch_read_addr().write(|w| unsafe { w.bits(fifo.fifo_address() as u32) });
        dma.ch(0).ch_write_addr().write(|w| unsafe { w.bits(ring as u32) });
        dma.ch(0).ch_al1_ctrl().write(|w| unsafe { w.bits(control(fifo.dreq_value())) });
        let mut new = Self { ring, at: 0, bits, _fifo: fifo };
        new.keep_running();
        new
    }

    /// The channel stops by itself after 2^32 - 1 units, some hours of a busy line.
    fn keep_running(&mut self) {
        // SAFETY: the channel is owned.
        let channel = unsafe { &*pac::DMA::ptr() }.ch(0);
        if !channel.ch_ctrl_trig().read().busy().bit_is_set() {
            channel.ch_al1_trans_count_trig().write(|w| unsafe { w.bits(u32::MAX) });
        }
    }

    /// The next unit, if one has ended.
    #[inline]
    pub fn take(&mut self) -> Option<Unit> {
        self.keep_running();
        // SAFETY: reading a register has no effect.
        let end = unsafe { &*pac::DMA::ptr() }.ch(0).ch_write_addr().read().bits() as usize;
        if self.ring as usize + self.at * 4 == end {
            return None;
        }
        // SAFETY: `at` is below RING, and the channel has written there.
        let word = unsafe { self.ring.add(self.at).read_volatile() };
        self.at = (self.at + 1) % RING;
        Some(Unit::of(word, self.bits))
    }
}

impl RingReceiver {
    /// Waits until `from_ns`, and longer while somebody is still talking: until nothing has come for `quiet_ns`. Throws away
    /// what comes. A line that never becomes quiet is given up after 1 ms.
    pub fn settle(&mut self, clock: &mut Clock, from_ns: u64, quiet_ns: u64) {
        let begin_ns = clock.now_ns();
        let mut until_ns = from_ns;
        loop {
            let now_ns = clock.now_ns();
            if self.take().is_some() {
                until_ns = until_ns.max(now_ns + quiet_ns);
            } else if now_ns >= until_ns || now_ns - begin_ns > GIVE_UP_NS {
                return;
            }
        }
    }
}

/// Longer than any response.
const GIVE_UP_NS: u64 = 1_000_000;

/// CHn_CTRL: enabled, words, the write address runs in a ring of 256 bytes, at the pace of the receiver; chained to itself,
/// that is to none.
const fn control(dreq: u8) -> u32 {
    const ENABLE: u32 = 1;
    const SIZE_WORD: u32 = 2 << 2;
    const INCREMENT_WRITE: u32 = 1 << 5;
    const RING_256: u32 = 8 << 6;
    const RING_WRITE: u32 = 1 << 10;
    const TREQ: u32 = 15;
    const QUIET: u32 = 1 << 21;
    ENABLE | SIZE_WORD | INCREMENT_WRITE | RING_256 | RING_WRITE | (dreq as u32) << TREQ | QUIET
}

/// Sets both machines up for units of `bits` bits at `rate` and starts them.
///
/// # Panics
/// If the block's instruction memory is not empty.
pub fn start(
    pio: &mut PIO<PIO0>,
    transmit: UninitStateMachine<(PIO0, SM0)>,
    receive: UninitStateMachine<(PIO0, SM1)>,
    rate: Rate,
    bits: u8,
) -> (Transmitter, Receiver) {
    let program = pio.install(&programs::transmitter(rate)).expect("6 of 32 instructions");
    let (mut machine, _, tx) = PIOBuilder::from_installed_program(program)
        .out_pins(DI, 1)
        .side_set_pin_base(DE)
        .out_shift_direction(ShiftDirection::Right)
        .autopull(true)
        .pull_threshold(32)
        .clock_divisor_fixed_point(rate.divider, 0)
        .build(transmit);
    machine.set_pins([(DI, PinState::High), (DE, PinState::Low)]);
    machine.set_pindirs([(DI, PinDir::Output), (DE, PinDir::Output)]);
    run(machine);
    let program = pio.install(&programs::receiver(rate, bits)).expect("6 of 32 instructions");
    let (mut machine, rx, _) = PIOBuilder::from_installed_program(program)
        .in_pin_base(RO)
        .in_shift_direction(ShiftDirection::Right)
        .autopush(true)
        .push_threshold(bits + 1)
        .clock_divisor_fixed_point(rate.divider, 0)
        .build(receive);
    machine.set_pindirs([(RO, PinDir::Input)]);
    run(machine);
    (Transmitter { fifo: tx, cycles: rate.cycles.into() }, Receiver { fifo: rx, bits })
}

fn run<S: rp2040_hal::pio::ValidStateMachine>(machine: StateMachine<S, Stopped>) {
    let _running = machine.start();
}
