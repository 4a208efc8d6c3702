//! The PIO programs. They work with any number of cycles per bit, so that every rate has a whole divider at 120 MHz.

use pio::{
    Assembler, InSource, IrqIndexMode, JmpCondition, MovDestination, MovOperation, MovSource, OutDestination, Program,
    SetDestination, SideSet, WaitSource,
};

/// The system clock that makes all rates of [`Rate`] whole numbers of cycles.
pub const SYSTEM_HZ: u32 = 120_000_000;

/// A bit rate as the state machines make it: 120 MHz / `divider` / `cycles`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Cycles of the state machine per bit, 4..=17.
    pub cycles: u8,
    /// System clocks per cycle.
    pub divider: u16,
}

impl Rate {
    /// 48 clocks a bit.
    pub const MBIT2_5: Self = Self { cycles: 12, divider: 4 };
    /// 30 clocks a bit.
    pub const MBIT4: Self = Self { cycles: 10, divider: 3 };
    /// 24 clocks a bit.
    pub const MBIT5: Self = Self { cycles: 12, divider: 2 };
    /// 18 clocks a bit.
    pub const MBIT6_67: Self = Self { cycles: 9, divider: 2 };
    /// 15 clocks a bit.
    pub const MBIT8: Self = Self { cycles: 15, divider: 1 };
}

/// Flag of the PIO block that starts the transmitter.
pub const START: u8 = 0;

/// Holds bits until the flag [`START`] is set, then sends them, the first in bit 0 of a word, and switches the line driver on for
/// exactly as long (side-set).
///
/// ```text
/// begin:  out x, 32     side 0          number of bits - 1
///         out y, 32     side 0          how many cycles to wait after the flag
///         wait 1 irq 0  side 0          what is to be sent is held here, driver off
/// delay:  jmp y-- delay side 0
/// bit:    out pins, 1   side 1 [N - 2]
///         jmp x-- bit   side 1
///         out null, 32  side 1          what is left of the last word is thrown away
/// ```
///
/// Automatic pull, 32 bits, shift right. The number of bits must not be a multiple of 32: `out null` would take the next
/// word then. Sends one more idle bit.
pub fn transmitter(rate: Rate) -> Program<32> {
    let mut a = Assembler::<32>::new_with_side_set(SideSet::new(false, 1, false));
    let (mut begin, mut delay, mut bit, mut end) = (a.label(), a.label(), a.label(), a.label());
    a.bind(&mut begin);
    a.out_with_side_set(OutDestination::X, 32, 0);
    a.out_with_side_set(OutDestination::Y, 32, 0);
    a.wait_with_side_set(1, WaitSource::IRQ, START, false, 0);
    a.bind(&mut delay);
    a.jmp_with_side_set(JmpCondition::YDecNonZero, &mut delay, 0);
    a.bind(&mut bit);
    a.out_with_delay_and_side_set(OutDestination::PINS, 1, rate.cycles - 2, 1);
    a.jmp_with_side_set(JmpCondition::XDecNonZero, &mut bit, 1);
    a.out_with_side_set(OutDestination::NULL, 32, 1);
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}

/// Where the program of [`transmitter`] holds, counted from its start.
pub const HOLDS_AT: u32 = 2;

/// Receives start-stop units of `bits` bits; the word holds them and the stop bit in its highest bits, the stop bit on top. A word
/// that is the one in X sets the flag [`START`]: X is the last word written by the processor.
///
/// ```text
/// begin:  wait 1 pin 0
///         wait 0 pin 0                  the start bit
///         set y, bits - 1  [1.5 N - 3]  to the middle of the first bit
/// bit:    in pins, 1       [N - 4]
///         pull noblock                  what is expected now; X if nothing new was written
///         mov x, osr
///         jmp y-- bit
///         in pins, 1                    the stop bit: delivered, and part of what is expected
///         mov y, isr
///         jmp x!=y other
///         irq set 0
/// other:  push
/// ```
///
/// Shift right.
pub fn receiver(rate: Rate, bits: u8) -> Program<32> {
    let mut a = Assembler::<32>::new();
    let (mut begin, mut bit, mut other, mut end) = (a.label(), a.label(), a.label(), a.label());
    a.bind(&mut begin);
    a.wait(1, WaitSource::PIN, 0, false);
    a.wait(0, WaitSource::PIN, 0, false);
    a.set_with_delay(SetDestination::Y, bits - 1, rate.cycles * 3 / 2 - 3);
    a.bind(&mut bit);
    a.r#in_with_delay(InSource::PINS, 1, rate.cycles - 4);
    a.pull(false, false);
    a.mov(MovDestination::X, MovOperation::None, MovSource::OSR);
    a.jmp(JmpCondition::YDecNonZero, &mut bit);
    a.r#in(InSource::PINS, 1);
    a.mov(MovDestination::Y, MovOperation::None, MovSource::ISR);
    a.jmp(JmpCondition::XNotEqualY, &mut other);
    a.irq(false, false, START, IrqIndexMode::DIRECT);
    a.bind(&mut other);
    a.push(false, true);
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}

/// Cycles for Y with which an answer begins `turn_ns` after the end of the unit that was expected: less the half of its stop bit, the
/// bit for which the driver is on ahead, and the way from the pin to the flag and back to a pin.
pub const fn wait_cycles(rate: Rate, turn_ns: u32) -> u32 {
    const WAY: u32 = 6;
    let cycles = turn_ns * (SYSTEM_HZ / 1_000_000) / 1_000 / rate.divider as u32;
    cycles - rate.cycles as u32 / 2 - WAY
}
