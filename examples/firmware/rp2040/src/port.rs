//! The line as a PIO block sees it: bits out with the driver on, units in.
//!
//! Wiring: GPIO 2 to DI, GPIO 3 to DE and /RE (tied), GPIO 4 to RO of an RS-485 transceiver.

use cortex_m::singleton;

use crate::chip;
use crate::hal::dma::{CH0, Channel, SingleChannel};
use crate::hal::pac::{self, PIO0};
use crate::hal::pio::{
    PIO, PIOBuilder, PinDir, PinState, Running, Rx, SM0, SM1, ShiftDirection, StateMachine, Tx, UninitStateMachine,
};
use crate::programs::{self, Rate};

/// DI of the transceiver.
pub const DI: u8 = 2;
/// DE and /RE of the transceiver.
pub const DE: u8 = 3;
/// RO of the transceiver.
pub const RO: u8 = 4;

/// Most words of one transmission: number of bits, delay, and 128 bits.
const MOST_WORDS: usize = 6;

/// The transmitter.
pub struct Transmitter {
    fifo: Tx<(PIO0, SM0)>,
    machine: StateMachine<(PIO0, SM0), Running>,
    block: PIO<PIO0>,
    /// The instruction at which a transmission is held.
    holds_at: u32,
}

/// The words that make the transmitter send something: prepared ahead, they only have to be written.
#[derive(Debug, Clone, Copy, Default)]
pub struct Prepared {
    words: [u32; MOST_WORDS],
    len: u8,
}

impl Prepared {
    /// Start-stop units of `bits` bits, with `gap_bits` idle bits between them; 126 line bits in total at most. The driver
    /// is on for
    /// one idle bit before them, so that the line is settled at the start bit. `wait_cycles`: cycles of the state machine from the flag
    /// to that.
    pub fn new(units: impl Iterator<Item = u16>, bits: u32, gap_bits: u32, wait_cycles: u32) -> Self {
        let mut new = Self { words: [0, wait_cycles, 0, 0, 0, 0], len: 2 };
        let mut count = 1;
        new.put(0, 1);
        for content in units {
            if count > 1 {
                new.put(count, (1 << gap_bits) - 1);
                count += gap_bits;
            }
            new.put(count, u32::from(content) << 1 | 2 << bits);
            count += bits + 2;
        }
        // Not a multiple of 32, see the program: the last bit may well be idle.
        if count % 32 == 0 {
            new.put(count, 1);
            count += 1;
        }
        new.words[0] = count - 1;
        new.len += count.div_ceil(32) as u8;
        new
    }

    /// Up to 31 bits at a place of the line.
    #[inline]
    fn put(&mut self, at: u32, line: u32) {
        let (word, shift) = (2 + at as usize / 32, at % 32);
        if let Some(place) = self.words.get_mut(word) {
            *place |= line << shift;
        }
        if let Some(place) = self.words.get_mut(word + 1).filter(|_| shift > 0) {
            *place |= line >> (32 - shift);
        }
    }
}

impl Transmitter {
    /// Makes the transmitter hold a message until it is started, replacing the one held. Words that do not fit into the
    /// FIFO follow while the end of the previous message is sent.
    #[inline]
    pub fn hold(&mut self, prepared: &Prepared) {
        self.discard();
        for word in prepared.words.iter().take(prepared.len.into()) {
            while !self.fifo.write(*word) {}
        }
    }

    /// Drops the message held.
    #[inline]
    pub fn discard(&mut self) {
        if self.is_holding() {
            self.machine.clear_fifos();
            self.machine.restart();
        }
    }

    /// Returns whether a message is held and has not been started.
    fn is_holding(&self) -> bool {
        self.machine.instruction_address() == self.holds_at
    }

    /// Starts the message held, unless the receiver has done so.
    #[inline]
    pub fn start(&mut self) {
        if self.is_holding() {
            self.block.force_irq(1 << programs::START);
        }
    }

    /// Sends a message.
    #[inline]
    pub fn send(&mut self, prepared: &Prepared) {
        self.hold(prepared);
        self.block.force_irq(1 << programs::START);
    }
}

/// Units of the receiver, taken from its FIFO one by one.
pub struct Receiver {
    fifo: Rx<(PIO0, SM1)>,
    expected: Tx<(PIO0, SM1)>,
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

    /// Makes a unit with this content start the transmission held, beginning with the next unit; with `None` no unit does.
    #[inline]
    pub fn expect(&mut self, content: Option<u16>) {
        // Below its unit a word of the receiver is 0.
        const NEVER: u32 = 1;
        let unit = content.map_or(NEVER, |content| (1 << self.bits | u32::from(content)) << (31 - self.bits));
        // The receiver takes everything written with the next unit.
        while !self.expected.write(unit) {}
    }
}

/// How many units the ring holds.
const RING: usize = 64;

/// The ring must lie at a multiple of its size.
#[repr(C, align(256))]
struct Ring([u32; RING]);

const _: () = assert!(size_of::<Ring>() == 256 && align_of::<Ring>() == 256);

/// Units of the receiver, which DMA writes into a ring independently of the processor.
pub struct RingReceiver {
    ring: *const u32,
    /// The next to take.
    at: usize,
    receiver: Receiver,
}

impl RingReceiver {
    /// Starts DMA channel 0.
    ///
    /// # Panics
    /// If called twice.
    pub fn new(_channel: Channel<CH0>, receiver: Receiver) -> Self
    where
        Channel<CH0>: SingleChannel,
    {
        let ring = singleton!(: Ring = Ring([0; RING])).expect("one receiver");
        let ring = core::ptr::from_mut(ring).cast::<u32>();
        let fifo = &receiver.fifo;
        // SAFETY: the channel is owned, and so is the ring, which is read only by the volatile access below.
        let dma = unsafe { &*pac::DMA::ptr() };
        dma.ch(0).ch_read_addr().write(|w| unsafe { w.bits(fifo.fifo_address() as u32) });
        dma.ch(0).ch_write_addr().write(|w| unsafe { w.bits(ring as u32) });
        dma.ch(0).ch_al1_ctrl().write(|w| unsafe { w.bits(chip::dma_control(fifo.dreq_value())) });
        let mut new = Self { ring, at: 0, receiver };
        new.keep_running();
        new
    }

    /// The channel of an RP2040 stops by itself after 2^32 - 1 units, some hours of a busy line.
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
        Some(Unit::of(word, self.receiver.bits))
    }
}

/// Sets both machines up for units of `bits` bits at `rate` and starts them.
///
/// # Panics
/// If the block's instruction memory is not empty.
pub fn start(
    mut block: PIO<PIO0>,
    transmit: UninitStateMachine<(PIO0, SM0)>,
    receive: UninitStateMachine<(PIO0, SM1)>,
    rate: Rate,
    bits: u8,
) -> (Transmitter, Receiver) {
    let program = block.install(&programs::transmitter(rate)).expect("7 of 32 instructions");
    let holds_at = u32::from(program.offset()) + programs::HOLDS_AT;
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
    let transmitter = machine.start();
    let program = block.install(&programs::receiver(rate, bits)).expect("12 of 32 instructions");
    let (mut machine, rx, expected) = PIOBuilder::from_installed_program(program)
        .in_pin_base(RO)
        .in_shift_direction(ShiftDirection::Right)
        .clock_divisor_fixed_point(rate.divider, 0)
        .build(receive);
    machine.set_pindirs([(RO, PinDir::Input)]);
    let _running = machine.start();
    let mut receiver = Receiver { fifo: rx, expected, bits };
    receiver.expect(None);
    (Transmitter { fifo: tx, machine: transmitter, block, holds_at }, receiver)
}
