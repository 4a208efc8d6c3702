//! Puts frames on the line and takes samples from it with two state machines and four DMA channels, without the processor.
//!
//! One channel plays a frame; when it has finished, another gives it the address of the next one, from a ring of addresses.
//! The samples work the same way: a block of them ends with the window of an answer, and lasts from one window to the next.
//! The processor has
//! to write a head before its frame begins; if it is late, there is no address, nothing is played, and everything restarts.

use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

use hdsl::frame::Head;
use hdsl::master::Transmission;
use hdsl::sampling::WINDOW;
use rp235x_hal::pac::dma::CH;
use rp235x_hal::pac::dma::ch::ch_al1_ctrl as ctrl;
use rp235x_hal::pac::{DMA, PIO0};
use rp235x_hal::pio::{
    Buffers, PIO, PIOBuilder, PinDir, PinState, Running, Rx, SM0, SM1, ShiftDirection, StateMachineGroup2, Tx,
    UninitStateMachine,
};

use crate::frame::{Frame, Length, RUNNING, STARTING};
use crate::program;

/// DI, DE and RO of the transceiver; DE has to be the pin after DI.
const DI: u8 = 2;
const DE: u8 = 3;
const RO: u8 = 4;

/// Frames and blocks of samples in memory.
const DEPTH: usize = 4;
/// Addresses in a ring: this many blocks can be counted before the count wraps.
const RING: usize = 32;
/// Bits from the beginning of a frame to the end of its window.
const WINDOW_END_BITS: u32 = Head::BITS + 1 + WINDOW as u32;
/// The longest block of samples, in words of four bits of the line.
const BLOCK: usize = STARTING.bits as usize / 4;

/// The same in nanoseconds.
pub const WINDOW_END_NS: u64 = WINDOW_END_BITS as u64 * 320 / 3;

const _: () = assert!(RUNNING.bits % 4 == 0 && STARTING.bits % 4 == 0 && WINDOW % 4 == 0 && WINDOW_END_BITS == 99);

/// A ring for DMA, aligned to a multiple of its size.
#[repr(align(128))]
struct Ring([AtomicU32; RING]);

const _: () = assert!(size_of::<Ring>() == 128);

impl Ring {
    const fn new() -> Self {
        Self([const { AtomicU32::new(0) }; RING])
    }

    fn set(&self, at: u32, address: u32) {
        self.0[at as usize % RING].store(address, Ordering::Relaxed);
    }

    fn address(&self) -> u32 {
        self.0.as_ptr() as u32
    }
}

static SILENT: [Frame; DEPTH] = [const { Frame::new() }; DEPTH];
static ANSWERED: [Frame; DEPTH] = [const { Frame::new() }; DEPTH];
static BLOCKS: [[AtomicU32; BLOCK]; DEPTH] = [const { [const { AtomicU32::new(0) }; BLOCK] }; DEPTH];
static FRAMES: Ring = Ring::new();
static SAMPLES: Ring = Ring::new();

/// DMA channels: the one that moves words, and the one that tells it where the next words are.
const PLAY: usize = 0;
const NEXT_FRAME: usize = 1;
const TAKE: usize = 2;
const NEXT_BLOCK: usize = 3;

type Player = (PIO0, SM0);
type Sampler = (PIO0, SM1);

/// The processor was late, or DMA was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Late {
    /// The player had nothing to play: a frame should have begun, and its head was not there.
    Head,
    /// The samples of an answer were overwritten before they were read.
    Samples,
}

/// The front end at rest.
pub struct FrontEnd {
    pio: PIO<PIO0>,
    dma: DMA,
    machines: (UninitStateMachine<Player>, UninitStateMachine<Sampler>),
}

impl FrontEnd {
    /// Creates the front end from these parts; it uses DMA channels 0 to 3. The caller has taken DMA and the block out of
    /// reset.
    pub fn new(pio: PIO<PIO0>, dma: DMA, machines: (UninitStateMachine<Player>, UninitStateMachine<Sampler>)) -> Self {
        for frame in &SILENT {
            frame.paint(false);
        }
        for frame in &ANSWERED {
            frame.paint(true);
        }
        for at in 0..RING {
            SAMPLES.set(at as u32, BLOCKS[at % DEPTH].as_ptr() as u32);
        }
        Self { pio, dma, machines }
    }

    /// Starts with a frame that is not answered; its first bit goes out before this returns.
    ///
    /// # Panics
    /// If the instruction memory of the block is full.
    pub fn start(mut self, first: Head) -> Line {
        let (player, sampler) = self.machines;
        let play = self.pio.install(&program::play()).expect("1 of 32 instructions");
        let (mut player, player_rx, player_tx) = PIOBuilder::from_installed_program(play)
            .out_pins(DI, 2)
            .buffers(Buffers::OnlyTx)
            .out_shift_direction(ShiftDirection::Right)
            .autopull(true)
            .pull_threshold(32)
            .clock_divisor_fixed_point(1, 0)
            .build(player);
        player.set_pins([(DI, PinState::High), (DE, PinState::Low)]);
        player.set_pindirs([(DI, PinDir::Output), (DE, PinDir::Output), (RO, PinDir::Input)]);
        let sample = self.pio.install(&program::sample()).expect("2 of 32 instructions");
        let wait = sample.offset();
        let (mut sampler, sampler_rx, sampler_tx) = PIOBuilder::from_installed_program(sample)
            .in_pin_base(RO)
            .buffers(Buffers::OnlyRx)
            .in_shift_direction(ShiftDirection::Left)
            .autopush(true)
            .push_threshold(32)
            .clock_divisor_fixed_point(1, 0)
            .build(sampler);
        // The first window begins after a head and the bit in which the line is released.
        sampler.exec_instruction(program::wait_bits(Head::BITS as u8 + 1));
        sampler.exec_instruction(program::jump(wait));

        SILENT[0].set_head(first);
        FRAMES.set(0, SILENT[0].address());
        FRAMES.set(1, 0);
        // Everything written before the channels start has to be in memory.
        compiler_fence(Ordering::SeqCst);
        let channels = Channels(self.dma);
        channels.start(player_tx.fifo_address() as u32, sampler_rx.fifo_address() as u32);
        // The player's FIFO is full before it starts.
        while !player_tx.is_full() {}
        player_tx.clear_stalled_flag();
        Line {
            machines: player.with(sampler).sync().start(),
            fifos: (player_rx, player_tx, sampler_rx, sampler_tx),
            channels,
            pio: self.pio,
            length: STARTING,
            block: WINDOW as u32,
        }
    }
}

/// The front end at work.
pub struct Line {
    pio: PIO<PIO0>,
    channels: Channels,
    machines: StateMachineGroup2<PIO0, SM0, SM1, Running>,
    fifos: (Rx<Player>, Tx<Player>, Rx<Sampler>, Tx<Sampler>),
    /// Length of the frame whose window comes next, and of its block of samples.
    length: Length,
    block: u32,
}

impl Line {
    /// Writes the head of a frame, before that frame begins.
    #[inline]
    pub fn send(&self, number: u32, transmission: &Transmission) {
        let frames = if transmission.answered { &ANSWERED } else { &SILENT };
        let frame = &frames[number as usize % DEPTH];
        frame.set_head(transmission.head);
        // Without an address there is nothing to play.
        FRAMES.set(number.wrapping_add(1), 0);
        compiler_fence(Ordering::SeqCst);
        FRAMES.set(number, frame.address());
    }

    /// Waits for the end of a frame's window, and returns its samples, one byte per bit. Call it for one frame after the
    /// other; `next` is the length of the frame after this one.
    #[inline]
    pub fn window(&mut self, number: u32, next: Length) -> Result<[u32; WINDOW / 4], Late> {
        // A block is complete when the next one has begun.
        let begun = |channels: &Channels| channels.blocks().wrapping_sub(number + 1) % RING as u32;
        while begun(&self.channels) == 0 {}
        self.channels.set_length(next);
        let mut samples = [0; WINDOW / 4];
        // The window is the end of the block.
        let first = (self.block as usize - WINDOW) / 4;
        for (sample, word) in samples.iter_mut().zip(BLOCKS[number as usize % DEPTH].iter().skip(first)) {
            *sample = word.load(Ordering::Relaxed);
        }
        (self.block, self.length) = (self.length.bits, next);
        if begun(&self.channels) >= DEPTH as u32 {
            return Err(Late::Samples);
        }
        if self.fifos.1.has_stalled() { Err(Late::Head) } else { Ok(samples) }
    }

    /// Stops it; the line is released.
    pub fn stop(mut self) -> FrontEnd {
        self.channels.stop();
        let (mut player, sampler) = self.machines.stop().free();
        player.set_pins([(DE, PinState::Low)]);
        let (player_rx, player_tx, sampler_rx, sampler_tx) = self.fifos;
        let (player, play) = player.uninit(player_rx, player_tx);
        let (sampler, sample) = sampler.uninit(sampler_rx, sampler_tx);
        self.pio.uninstall(play);
        self.pio.uninstall(sample);
        FrontEnd { pio: self.pio, dma: self.channels.0, machines: (player, sampler) }
    }
}

/// The four channels.
struct Channels(DMA);

impl Channels {
    /// The first frame and the first block; a block of the window alone.
    fn start(&self, player: u32, sampler: u32) {
        let play = |w: &mut ctrl::W| {
            w.data_size().size_word().incr_read().set_bit();
            w.treq_sel().pio0_tx0();
        };
        let take = |w: &mut ctrl::W| {
            w.data_size().size_word().incr_write().set_bit().bswap().set_bit();
            w.treq_sel().pio0_rx1();
        };
        // SAFETY: these channels write to the FIFO of the player, to blocks of samples, which are atomics, and to the registers of
        // each other; the addresses in the rings are those of statics.
        unsafe {
            self.moves(PLAY, NEXT_FRAME, STARTING.bits / 2, play);
            self.ch(PLAY).ch_al1_write_addr().write(|w| w.bits(player));
            self.addresses(NEXT_FRAME, &FRAMES, self.ch(PLAY).ch_al3_read_addr_trig().as_ptr() as u32);
            self.moves(TAKE, NEXT_BLOCK, WINDOW as u32 / 4, take);
            self.ch(TAKE).ch_al1_read_addr().write(|w| w.bits(sampler));
            self.addresses(NEXT_BLOCK, &SAMPLES, self.ch(TAKE).ch_al2_write_addr_trig().as_ptr() as u32);
            self.0.multi_chan_trigger().write(|w| w.bits(1 << NEXT_FRAME | 1 << NEXT_BLOCK));
        }
        // The channels are running once both rings have been read; entries written now are for the following frames.
        while !self.is_busy(PLAY) || !self.is_busy(TAKE) {}
        self.set_length(STARTING);
    }

    /// A channel that moves words, and starts another at its end.
    ///
    /// # Safety
    /// The other channel starts this one again, with an address that it may use.
    unsafe fn moves(&self, channel: usize, then: usize, count: u32, with: impl FnOnce(&mut ctrl::W)) {
        let ch = self.ch(channel);
        // SAFETY: the caller's.
        unsafe {
            ch.ch_trans_count().write(|w| w.bits(count));
            ch.ch_al1_ctrl().write(|w| {
                with(w);
                w.chain_to().bits(then as u8).high_priority().set_bit().en().set_bit()
            });
        }
    }

    /// A channel that walks round a ring and writes an address from it to a register that starts the other channel.
    ///
    /// # Safety
    /// The ring holds addresses that the other channel may use.
    unsafe fn addresses(&self, channel: usize, ring: &Ring, register: u32) {
        let ch = self.ch(channel);
        // SAFETY: the caller's.
        unsafe {
            ch.ch_al1_read_addr().write(|w| w.bits(ring.address()));
            ch.ch_al1_write_addr().write(|w| w.bits(register));
            ch.ch_trans_count().write(|w| w.bits(1));
            ch.ch_al1_ctrl().write(|w| {
                w.data_size().size_word().incr_read().set_bit().treq_sel().permanent();
                w.ring_size().bits(size_of::<Ring>().trailing_zeros() as u8).ring_sel().clear_bit();
                w.chain_to().bits(channel as u8).high_priority().set_bit().en().set_bit()
            });
        }
    }

    /// How many blocks of samples have begun, modulo [`RING`].
    fn blocks(&self) -> u32 {
        (self.ch(NEXT_BLOCK).ch_read_addr().read().bits() - SAMPLES.address()) / 4
    }

    fn is_busy(&self, channel: usize) -> bool {
        self.ch(channel).ch_al1_ctrl().read().busy().bit_is_set()
    }

    /// The length of the next frame, and that of the block from its window to the one after it, which is the next block but one:
    /// the next has begun.
    fn set_length(&self, next: Length) {
        // SAFETY: a frame and a block in memory hold the longest.
        unsafe {
            self.ch(PLAY).ch_trans_count().write(|w| w.bits(next.bits / 2));
            self.ch(TAKE).ch_trans_count().write(|w| w.bits(next.bits / 4));
        }
    }

    /// Channels that start each other have to be disabled first.
    fn stop(&self) {
        let all = [PLAY, NEXT_FRAME, TAKE, NEXT_BLOCK];
        for channel in all {
            self.ch(channel).ch_al1_ctrl().modify(|_, w| w.en().clear_bit());
        }
        // SAFETY: it stops what this type started.
        unsafe { self.0.chan_abort().write(|w| w.bits(0b1111)) };
        while all.iter().any(|channel| self.is_busy(*channel)) {}
    }

    fn ch(&self, channel: usize) -> &CH {
        self.0.ch(channel)
    }
}
