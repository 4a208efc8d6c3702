//! The control interrupt: TIM4 at 10 kHz reads the electrical angle from the feedback cell, or switches ENABLE off.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use critical_section::Mutex;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::{Peri, interrupt, peripherals};
use servowire_boards::{Control, Limits, Outputs};
use servowire_core::{Acceleration, Angle, Commutation, Policy, Sense, Shaft, ShaftReader, Tolerance, Words};
use servowire_drivers::Clock as _;

use crate::clocks::Cycles;

const CONTROL_HZ: u32 = 10_000;
/// Two readings at 5 kHz, and the way from the encoder to the cell.
pub const MAX_AGE_NS: u64 = 450_000;
/// Of the motor: four pole pairs, the field at 0 where the encoder reads 0. Yours has other numbers, which its maker says.
const COMMUTATION: Commutation = Commutation::new(4, Angle::ZERO, Sense::Up).expect("pole pairs");
/// With its load.
const MAX_ACCELERATION: Acceleration = Acceleration::from_turns_per_s2(2_000).expect("a possible one");
/// Of the electrical angle.
const MAX_ERROR: Angle = Angle::from_millidegrees(5_000);

/// Stands in for a power stage: a pin that is high while the angle may be used, and the angle itself.
struct Enable(Output<'static>);

static FIELD: AtomicU32 = AtomicU32::new(0);
static ON: AtomicBool = AtomicBool::new(false);

impl Outputs for Enable {
    #[inline]
    fn on(&mut self, field: Angle) {
        FIELD.store(field.to_bits(), Ordering::Relaxed);
        self.0.set_high();
    }

    #[inline]
    fn off(&mut self) {
        self.0.set_low();
    }
}

/// The electrical angle of the last control interrupt, if the outputs are on.
pub fn field() -> Option<Angle> {
    ON.load(Ordering::Relaxed).then(|| Angle::from_bits(FIELD.load(Ordering::Relaxed)))
}

/// The control loop of an image, in a `static` of it.
pub struct Loop<F: Shaft + 'static, const W: usize>(Place<F, W>);

type Place<F, const W: usize> = Mutex<RefCell<Option<(Control<'static, F, Enable, W>, Cycles)>>>;

impl<F: Shaft + Words<W>, const W: usize> Loop<F, W> {
    /// Not started.
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(None)))
    }

    /// Starts the interrupt.
    pub fn start(
        &self,
        timer: Peri<'static, peripherals::TIM4>,
        enable: Peri<'static, peripherals::PA5>,
        reader: ShaftReader<'static, F, W>,
        clock: Cycles,
    ) {
        let limits = Limits {
            policy: policy(),
            commutation: COMMUTATION,
            max_acceleration: MAX_ACCELERATION,
            max_error: MAX_ERROR,
        };
        let control = Control::new(reader, Enable(Output::new(enable, Level::Low, Speed::Low)), limits);
        critical_section::with(|cs| self.0.borrow_ref_mut(cs).replace((control, clock)));
        let timer = Timer::new(timer);
        timer.set_frequency(Hertz(CONTROL_HZ), RoundTo::Faster);
        timer.enable_update_interrupt(true);
        timer.start();
        // A timer that is dropped stops.
        core::mem::forget(timer);
        // SAFETY: the handler shares what it uses by a critical section and by atomics.
        unsafe { interrupt::TIM4.enable() };
    }

    /// What the interrupt does.
    #[inline(always)]
    pub fn run(&self) {
        pac::TIM4.sr().modify(|w| w.set_uif(false));
        let on = critical_section::with(|cs| match self.0.borrow_ref_mut(cs).as_mut() {
            Some((control, clock)) => control.interrupt(clock.now_ns()),
            None => false,
        });
        ON.store(on, Ordering::Relaxed);
    }
}

impl<F: Shaft + Words<W>, const W: usize> Default for Loop<F, W> {
    fn default() -> Self {
        Self::new()
    }
}

/// Makes the control interrupt of an image for its evidence: `LOOP`.
#[macro_export]
macro_rules! control_interrupt {
    ($evidence:ty) => {
        static LOOP: $crate::control::Loop<$evidence, 5> = $crate::control::Loop::new();

        struct Handler;

        impl embassy_stm32::interrupt::typelevel::Handler<embassy_stm32::interrupt::typelevel::TIM4> for Handler {
            unsafe fn on_interrupt() {
                LOOP.run();
            }
        }

        bind_interrupts!(struct ControlInterrupt {
            TIM4 => Handler;
        });
    };
}

/// A policy for the writer of the cell, that of the control interrupt.
pub const fn policy<T: Tolerance>() -> Policy<T> {
    Policy::new(MAX_AGE_NS)
}
