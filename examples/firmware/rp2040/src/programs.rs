//! The PIO programs. They are written for any number of cycles a bit, so that every rate has a whole divider at 120 MHz.

use pio::{Assembler, InSource, JmpCondition, OutDestination, Program, SetDestination, SideSet};

/// The system clock that makes all rates of [`Rate`] whole numbers of cycles.
pub const SYSTEM_HZ: u32 = 120_000_000;

/// A bit rate as the state machines make it: 120 MHz / `divider` / `cycles`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Cycles of the state machine a bit, 4..=17.
    pub cycles: u8,
    /// System clocks a cycle.
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

/// Sends bits, the first in bit 0 of a word, and switches the line driver on for exactly as long (side-set).
///
/// ```text
/// begin:  out x, 32     side 0          number of bits - 1; the machine waits here, driver off
///         out y, 32     side 0          how many cycles to wait first
/// delay:  jmp y-- delay side 0
/// bit:    out pins, 1   side 1 [N - 2]
///         jmp x-- bit   side 1
///         out null, 32  side 1          what is left of the last word is thrown away
/// ```
///
/// Automatic pull, 32 bits, shift right. The number of bits must not be a multiple of 32: `out null` would take the next
/// word then. Send an idle bit more.
pub fn transmitter(rate: Rate) -> Program<32> {
    let mut a = Assembler::<32>::new_with_side_set(SideSet::new(false, 1, false));
    let (mut begin, mut delay, mut bit, mut end) = (a.label(), a.label(), a.label(), a.label());
    a.bind(&mut begin);
    a.out_with_side_set(OutDestination::X, 32, 0);
    a.out_with_side_set(OutDestination::Y, 32, 0);
    a.bind(&mut delay);
    a.jmp_with_side_set(JmpCondition::YDecNonZero, &mut delay, 0);
    a.bind(&mut bit);
    a.out_with_delay_and_side_set(OutDestination::PINS, 1, rate.cycles - 2, 1);
    a.jmp_with_side_set(JmpCondition::XDecNonZero, &mut bit, 1);
    a.out_with_side_set(OutDestination::NULL, 32, 1);
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}

/// Receives start-stop units of `bits` bits; the word holds them and the stop bit in its highest bits, the stop bit on top.
///
/// ```text
/// begin:  wait 1 pin 0
///         wait 0 pin 0                  the start bit
///         set x, bits - 1  [1.5 N - 3]  to the middle of the first bit
/// bit:    in pins, 1       [N - 2]
///         jmp x-- bit
///         in pins, 1                    the stop bit: delivered, not judged
/// ```
///
/// Automatic push, `bits` + 1 bits, shift right.
pub fn receiver(rate: Rate, bits: u8) -> Program<32> {
    let mut a = Assembler::<32>::new();
    let (mut begin, mut bit, mut end) = (a.label(), a.label(), a.label());
    a.bind(&mut begin);
    a.wait(1, pio::WaitSource::PIN, 0, false);
    a.wait(0, pio::WaitSource::PIN, 0, false);
    a.set_with_delay(SetDestination::X, bits - 1, rate.cycles * 3 / 2 - 3);
    a.bind(&mut bit);
    a.r#in_with_delay(InSource::PINS, 1, rate.cycles - 2);
    a.jmp(JmpCondition::XDecNonZero, &mut bit);
    a.r#in(InSource::PINS, 1);
    a.bind(&mut end);
    a.assemble_with_wrap(end, begin)
}
