//! STEP and DIR of three axes from the interrupt of TIM2.
//!
//! PC0 to PC2 are STEP, PC3 to PC5 DIR. The handler is that of `step-motion`'s README: it makes the pulses that are due, and sets the
//! compare register of channel 1 for the next ones; channel 2 ends the pulses.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{Mutex, free};
use step_motion::AxesTimer;
use stm32_metapac::gpio::regs::Bsrr;
use stm32_metapac::gpio::vals::{Moder, Ospeedr};
use stm32_metapac::{GPIOC, Interrupt, RCC, TIM2};

use crate::clock::APB1_HZ;

/// Axes.
pub const AXES: usize = 3;
/// Slots of an axis in the queue.
pub const SLOTS: usize = 257;
/// A timer of APB1 counts twice as fast as the bus, which is slower than the core.
pub const TICK_HZ: u32 = APB1_HZ * 2;

/// Pins of port C: the first STEP, and the first DIR.
const STEP: u32 = 0;
const DIR: u32 = 3;
const PINS: usize = 6;
const ALL: u32 = (1 << AXES) - 1;
/// A pulse of 2 us.
const PULSE: u32 = TICK_HZ / 500_000;
/// Time from a start to the first event: 25 us.
const LEAD: u32 = TICK_HZ / 40_000;
/// An event whose interrupt comes more than 10 us after its time is late; the previous handler may have taken 6.
const LATE_TICKS: u32 = TICK_HZ / 100_000;

/// Channels of the timer: the next event, and the end of the pulses.
const EVENT: usize = 0;
const END: usize = 1;

/// The interrupt half of the motion.
pub type Timer = AxesTimer<'static, AXES, SLOTS>;
/// Holds it on its way to the handler.
static TIMER: Mutex<Cell<Option<Timer>>> = Mutex::new(Cell::new(None));
static LATE: AtomicU32 = AtomicU32::new(0);

/// Returns how many events have been late so far.
pub fn late() -> u32 {
    LATE.load(Ordering::Relaxed)
}

/// Starts the timer, and the pins.
pub fn start(timer: Timer) {
    RCC.ahb1enr().modify(|w| w.set_gpiocen(true));
    RCC.apb1enr().modify(|w| w.set_tim2en(true));
    for pin in 0..PINS {
        GPIOC.bsrr().write(|w| w.set_br(pin, true));
        GPIOC.ospeedr().modify(|w| w.set_ospeedr(pin, Ospeedr::HIGH_SPEED));
        GPIOC.moder().modify(|w| w.set_moder(pin, Moder::OUTPUT));
    }
    free(|cs| TIMER.borrow(cs).set(Some(timer)));
    TIM2.arr().write_value(u32::MAX);
    TIM2.cr1().modify(|w| w.set_cen(true));
    // SAFETY: the handler has everything that it needs.
    unsafe { cortex_m::peripheral::NVIC::unmask(Interrupt::TIM2) };
}

/// Lets the interrupt begin, unless it has begun.
pub fn begin() {
    if TIM2.dier().read().ccie(EVENT) {
        return;
    }
    free(|_| {
        TIM2.ccr(EVENT).write_value(TIM2.cnt().read().wrapping_add(LEAD));
        clear(EVENT);
        TIM2.dier().modify(|w| w.set_ccie(EVENT, true));
    });
}

/// Forgets that a channel has matched.
#[inline(always)]
fn clear(channel: usize) {
    // Writing 1 changes nothing.
    TIM2.sr().write(|w| {
        w.0 = u32::MAX;
        w.set_ccif(channel, false);
    });
}

/// What the handler of TIM2 has to do. It keeps its data in `own`, which is `None` at first.
pub fn fire(own: &mut Option<Timer>) {
    if own.is_none() {
        *own = free(|cs| TIMER.borrow(cs).take());
    }
    let (status, enabled) = (TIM2.sr().read(), TIM2.dier().read());
    TIM2.sr().write(|w| w.0 = !status.0);
    if status.ccif(END) && enabled.ccie(END) {
        GPIOC.bsrr().write_value(Bsrr(ALL << (16 + STEP)));
        TIM2.dier().modify(|w| w.set_ccie(END, false));
    }
    if let Some(timer) = own.as_mut().filter(|_| status.ccif(EVENT) && enabled.ccie(EVENT)) {
        event(timer);
    }
}

/// Makes the events that are due, and sets the time of the next.
#[inline(always)]
fn event(timer: &mut Timer) {
    let due = TIM2.ccr(EVENT).read();
    // Everything after it is delayed by as much, without a burst; STEP may have fallen only now.
    let now = TIM2.cnt().read();
    if now.wrapping_sub(due) > LATE_TICKS {
        LATE.store(late() + 1, Ordering::Relaxed);
        TIM2.ccr(EVENT).write_value(now.wrapping_add(PULSE));
        return;
    }
    let fired = timer.fire();
    let (steps, dirs) = (u32::from(fired.steps()), u32::from(fired.reverse()));
    GPIOC.bsrr().write_value(Bsrr(dirs << DIR | (!dirs & ALL) << (16 + DIR) | steps << STEP));
    let now = TIM2.cnt().read();
    if steps != 0 {
        TIM2.ccr(END).write_value(now.wrapping_add(PULSE));
        clear(END);
        TIM2.dier().modify(|w| w.set_ccie(END, true));
    }
    if fired.wait() == 0 {
        TIM2.dier().modify(|w| w.set_ccie(EVENT, false));
        return;
    }
    let next = due.wrapping_add(fired.wait());
    TIM2.ccr(EVENT).write_value(next);
    // Two axes may step a tick apart: if it has passed meanwhile, the interrupt comes again at once.
    if TIM2.cnt().read().wrapping_sub(next) < u32::MAX / 2 {
        TIM2.egr().write(|w| w.set_ccg(EVENT, true));
    }
}
