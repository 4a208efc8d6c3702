//! Instructions of a call.
//!
//! Under QEMU with `-icount shift=0` every instruction takes 1 ns of virtual time, and the SysTick of the board runs
//! at 25 MHz: a tick is 40 instructions. Over thousands of calls that gives tenths of an instruction, the same ones on
//! every run and every machine.

use core::hint::black_box;
use core::mem::MaybeUninit;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const INSTRUCTIONS_PER_TICK: u64 = 40;

/// Calls of a kernel, at least.
const CALLS: usize = 2048;

/// SysTick counts 24 bits down.
const RELOAD: u32 = 0x00ff_ffff;

/// Starts the timer.
pub(crate) fn start(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RELOAD);
    timer.clear_current();
    timer.enable_counter();
}

/// Instructions of one call of `kernel`, in tenths and as the mean over `inputs`, without those of an empty call.
pub(crate) fn tenths<I, O>(kernel: fn(&'static I) -> O, inputs: &'static [I]) -> u32 {
    let rounds = CALLS.div_ceil(inputs.len());
    let (kernel, empty) = black_box((kernel, nothing::<I, O> as fn(&'static I) -> _));
    each(ticks(kernel, inputs, rounds), ticks(empty, inputs, rounds), rounds * inputs.len())
}

/// The same of a kernel that works on a state.
#[cfg(any(feature = "servowire-core", feature = "servowire-drivers", feature = "step-motion"))]
pub(crate) fn tenths_on<S, I, O>(state: &mut S, kernel: fn(&mut S, &'static I) -> O, inputs: &'static [I]) -> u32 {
    tenths_of(CALLS.div_ceil(inputs.len()), state, kernel, inputs)
}

/// The same of so many rounds.
#[cfg(any(feature = "servowire-core", feature = "servowire-drivers", feature = "step-motion"))]
pub(crate) fn tenths_of<S, I, O>(
    rounds: usize,
    state: &mut S,
    kernel: fn(&mut S, &'static I) -> O,
    inputs: &'static [I],
) -> u32 {
    let (kernel, empty) = black_box((kernel, nothing_on::<S, I, O> as fn(&mut S, &'static I) -> _));
    let with = ticks(|input| kernel(state, input), inputs, rounds);
    let without = ticks(|input| empty(state, input), inputs, rounds);
    each(with, without, rounds * inputs.len())
}

/// Tenths of an instruction of the dearest of many calls, to a tick: what `round` hands to the clock that it is given.
#[cfg(feature = "step-motion")]
pub(crate) fn most_tenths<T>(rounds: usize, mut round: impl FnMut(&mut dyn FnMut(&mut dyn FnMut() -> T) -> T)) -> u32 {
    let mut most = 0;
    for _ in 0..rounds {
        round(&mut |call| {
            let begin = SYST::get_current();
            let value = black_box(call());
            most = most.max(begin.wrapping_sub(SYST::get_current()) & RELOAD);
            value
        });
    }
    most * INSTRUCTIONS_PER_TICK as u32 * 10
}

/// Tenths of an instruction for each call, from the ticks of all calls with and without what is measured.
fn each(with: u64, without: u64, calls: usize) -> u32 {
    (with.saturating_sub(without) * INSTRUCTIONS_PER_TICK * 10 / calls as u64) as u32
}

#[inline(never)]
fn ticks<I, O>(mut kernel: impl FnMut(&'static I) -> O, inputs: &'static [I], rounds: usize) -> u64 {
    let (mut sum, mut begin) = (0_u64, SYST::get_current());
    for _ in 0..rounds {
        for input in inputs {
            black_box(&kernel(input));
        }
        // Read in every round, for the timer comes round after 2^24 ticks.
        let now = SYST::get_current();
        sum += u64::from(begin.wrapping_sub(now) & RELOAD);
        begin = now;
    }
    sum
}

/// The empty call: takes and gives the same as a kernel and does nothing.
#[inline(never)]
fn nothing<I, O>(_: &'static I) -> MaybeUninit<O> {
    MaybeUninit::uninit()
}

#[cfg(any(feature = "servowire-core", feature = "servowire-drivers", feature = "step-motion"))]
#[inline(never)]
fn nothing_on<S, I, O>(_: &mut S, _: &'static I) -> MaybeUninit<O> {
    MaybeUninit::uninit()
}

/// Instructions of one call of `call`, to within a look at the timer, some five of them, with those of reading it: from a tick
/// to the first one after the call, less what was left to that one.
#[cfg(feature = "hdsl")]
pub(crate) fn once(call: impl FnOnce()) -> u32 {
    next_tick();
    let (begin, all) = next_tick();
    call();
    let (end, left) = next_tick();
    let per_tick = INSTRUCTIONS_PER_TICK as u32;
    (begin.wrapping_sub(end) & RELOAD) * per_tick - left * per_tick / all
}

/// Waits for the next tick of the timer: what it shows then, and how many looks that took.
#[cfg(feature = "hdsl")]
#[inline(never)]
fn next_tick() -> (u32, u32) {
    let before = SYST::get_current();
    let mut looks = 0;
    loop {
        looks += 1;
        let now = SYST::get_current();
        if now != before {
            return (now, looks);
        }
    }
}
