//! STEP and DIR of two axes from PIO 0, fed by an interrupt.
//!
//! GPIO 2 and 3 are DIR, GPIO 6 and 7 STEP. GPIO 4 and 5 are between the state machines: each changes its level with every step,
//! so a driver that steps on both edges may be wired there instead.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{Mutex, free};
use pio::{Assembler, JmpCondition, OutDestination, Program, SetDestination, WaitSource};
use step_motion::AxesTimer;

use crate::hal::pac::{self, PIO0};
use crate::hal::pio::{
    InstalledProgram, PIO, PIOBuilder, PinDir, PioIRQ, SM0, SM1, SM2, ShiftDirection, StateMachine, StateMachineIndex,
    Stopped, Tx, UninitStateMachine,
};
use crate::programs::SYSTEM_HZ;

/// A state machine without a program.
type Unused<SM> = UninitStateMachine<(PIO0, SM)>;

/// Axes.
pub const AXES: usize = 2;
/// Slots of an axis in the queue.
pub const SLOTS: usize = 257;

/// DIR of the first axis; one pin each.
pub const DIR: u8 = 2;
/// Pin that changes with each step of the first axis.
pub const TOGGLE: u8 = 4;
/// STEP of the first axis.
pub const STEP: u8 = 6;

/// System clocks in a cycle of the state machines.
const DIVIDER: u16 = 3;
/// Cycles per tick: the minimum for an event, so that two axes may step a tick apart.
const CYCLES: u32 = 4;
/// Ticks in a second.
pub const TICK_HZ: u32 = SYSTEM_HZ / DIVIDER as u32 / CYCLES;

/// Bits of a word for the wait, in cycles.
const WAIT_BITS: u8 = 28;
/// The longest wait in one word, in ticks.
const LONGEST: u32 = (1 << WAIT_BITS) / CYCLES - 1;
/// Wait before the first event of a motion, in ticks, in which the FIFO fills up.
const LEAD: u32 = TICK_HZ / 10_000;

/// Sets the levels of DIR and of the pins that change with each step, after a wait.
///
/// ```text
/// begin:  out x, 28
/// wait:   jmp x-- wait
///         out pins, 4
/// ```
///
/// X + 3 cycles. Automatic pull, 32 bits, shift right.
fn events() -> Program<32> {
    let mut a = Assembler::<32>::new();
    let (mut begin, mut wait, mut end) = (a.label(), a.label(), a.label());
    a.bind(&mut begin);
    a.out(OutDestination::X, WAIT_BITS);
    a.bind(&mut wait);
    a.jmp(JmpCondition::XDecNonZero, &mut wait);
    a.out(OutDestination::PINS, 2 * AXES as u8);
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}

/// A pulse of 80 cycles, 2 us, for each change of a pin.
fn pulses() -> Program<32> {
    let mut a = Assembler::<32>::new();
    let (mut begin, mut end) = (a.label(), a.label());
    a.bind(&mut begin);
    for level in [1, 0] {
        a.wait(level, WaitSource::PIN, 0, false);
        a.set_with_delay(SetDestination::PINS, 1, 31);
        a.set_with_delay(SetDestination::PINS, 1, 31);
        a.set_with_delay(SetDestination::PINS, 1, 15);
        a.set(SetDestination::PINS, 0);
    }
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}

/// Starts three state machines at the same clock.
///
/// # Panics
/// If the block's instruction memory is not empty.
pub fn start(
    block: &mut PIO<PIO0>,
    timer: AxesTimer<'static, AXES, SLOTS>,
    (sm0, sm1, sm2): (Unused<SM0>, Unused<SM1>, Unused<SM2>),
) {
    let program = block.install(&events()).expect("3 of 32 instructions");
    let (mut events, _, fifo) = PIOBuilder::from_installed_program(program)
        .out_pins(DIR, 2 * AXES as u8)
        .out_shift_direction(ShiftDirection::Right)
        .autopull(true)
        .pull_threshold(32)
        .clock_divisor_fixed_point(DIVIDER, 0)
        .build(sm0);
    events.set_pindirs((DIR..STEP).map(|pin| (pin, PinDir::Output)));
    let first = block.install(&pulses()).expect("10 of 32 instructions");
    // SAFETY: neither is uninstalled.
    let second = unsafe { first.share() };
    let _running = events.with(axis(first, sm1, 0)).with(axis(second, sm2, 1)).sync().start();
    let feed = Feed { timer, fifo, levels: 0, wait: LEAD, words: 0 };
    free(|cs| FEED.borrow(cs).set(Some(feed)));
    // SAFETY: the handler has everything that it needs.
    unsafe { cortex_m::peripheral::NVIC::unmask(pac::Interrupt::PIO0_IRQ_0) };
}

/// The pulses of an axis.
fn axis<SM: StateMachineIndex>(
    program: InstalledProgram<PIO0>,
    machine: Unused<SM>,
    axis: u8,
) -> StateMachine<(PIO0, SM), Stopped> {
    let (mut machine, ..) = PIOBuilder::from_installed_program(program)
        .set_pins(STEP + axis, 1)
        .in_pin_base(TOGGLE + axis)
        .clock_divisor_fixed_point(DIVIDER, 0)
        .build(machine);
    machine.set_pindirs([(STEP + axis, PinDir::Output)]);
    machine
}

/// Holds it on its way to the handler.
static FEED: Mutex<Cell<Option<Feed>>> = Mutex::new(Cell::new(None));
/// How often the FIFO was empty during a motion.
static LATE: AtomicU32 = AtomicU32::new(0);

/// Returns how often a pulse has been late so far.
pub fn late() -> u32 {
    LATE.load(Ordering::Relaxed)
}

/// Lets the interrupt begin: there is room in the FIFO.
pub fn begin() {
    // SAFETY: the handler ends it, and only then does the background start again.
    unsafe { &*PIO0::ptr() }.sm_irq(0).irq_inte().modify(|_, w| w.sm0_txnfull().set_bit());
}

/// The interrupt's own.
pub struct Feed {
    timer: AxesTimer<'static, AXES, SLOTS>,
    fifo: Tx<(PIO0, SM0)>,
    /// DIR of the axes, then what changes with each step.
    levels: u32,
    /// Ticks until the event that comes next.
    wait: u32,
    /// Words of this motion, or since a pulse was late, up to 2.
    words: u32,
}

impl Feed {
    /// The next word: there is room for it.
    fn feed(&mut self) {
        // A wait for the first word of a motion does not delay a pulse. One is seen twice, until there is a word.
        if self.fifo.has_stalled() {
            self.fifo.clear_stalled_flag();
            if self.words == 2 {
                LATE.store(late() + 1, Ordering::Relaxed);
                self.words = 0;
            }
        }
        self.words = 2.min(self.words + 1);
        let wait = self.wait.min(LONGEST);
        self.wait -= wait;
        if self.wait == 0 {
            let fired = self.timer.fire();
            let toggled = self.levels >> AXES ^ u32::from(fired.steps());
            self.levels = u32::from(fired.reverse()) | toggled << AXES;
            self.wait = fired.wait();
        }
        self.fifo.write(self.levels << WAIT_BITS | (wait * CYCLES - 3));
        if self.wait == 0 {
            (self.wait, self.words) = (LEAD, 0);
            self.fifo.disable_tx_not_full_interrupt(PioIRQ::Irq0);
        }
    }
}

/// What the handler of `PIO0_IRQ_0` has to do. It keeps its data in `own`, which is `None` at first.
pub fn fire(own: &mut Option<Feed>) {
    if own.is_none() {
        *own = free(|cs| FEED.borrow(cs).take());
    }
    if let Some(feed) = own {
        feed.feed();
    }
}
