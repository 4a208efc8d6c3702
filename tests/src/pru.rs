//! The PRU instructions that the step time sequence is made of, enough of them to run it.
//!
//! One clock an instruction. The multiplier (XFR device 0) samples R28 and R29 on every clock; XIN reads the product
//! of the clock before, so one instruction has to stand between the last operand and XIN. Encodings as in the opcode
//! table of GNU binutils for `pru-elf`.

#![expect(
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "the program is the project's own, and a wrong one has to stop the run"
)]

use std::fmt;

/// A register or a part of it: selector in bits 7..5 (0..=3 byte, 4..=6 half word at bit 0, 8 or 16, 7 all), number
/// in bits 4..0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field(u8);

impl Field {
    /// Register number, first bit and mask.
    fn place(self) -> (usize, u32, u32) {
        let (shift, mask) = match self.0 >> 5 {
            part @ 0..=3 => (u32::from(part) * 8, 0xff),
            half @ 4..=6 => (u32::from(half - 4) * 8, 0xffff),
            _ => (0, u32::MAX),
        };
        (usize::from(self.0 & 31), shift, mask)
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = ["b0", "b1", "b2", "b3", "w0", "w1", "w2", ""][usize::from(self.0 >> 5)];
        let dot = if part.is_empty() { "" } else { "." };
        write!(f, "r{}{dot}{part}", self.0 & 31)
    }
}

/// The second operand of the arithmetic and of the branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operand {
    Register(Field),
    Immediate(u8),
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Register(field) => write!(f, "{field}"),
            Self::Immediate(value) => write!(f, "{value}"),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instruction {
    Add {
        to: Field,
        left: Field,
        right: Operand,
    },
    Sub {
        to: Field,
        left: Field,
        right: Operand,
    },
    Or {
        to: Field,
        left: Field,
        right: Operand,
    },
    /// Load a 16-bit constant.
    Ldi {
        to: Field,
        value: u16,
    },
    /// Transfer from the multiplier.
    Xin {
        first: Field,
        bytes: u8,
    },
    /// Transfer to the multiplier.
    Xout {
        first: Field,
        bytes: u8,
    },
    /// Quick branch to the instruction at `target` if `right > left`.
    Qbgt {
        target: usize,
        left: Field,
        right: Operand,
    },
    Halt,
}

impl Instruction {
    /// Decodes the word at address `at` (in words); `None` for what the sequence does not use.
    pub(crate) fn decode(word: u32, at: usize) -> Option<Self> {
        let [low, left, right, _] = word.to_le_bytes();
        let (to, left) = (Field(low), Field(left));
        let right = if word >> 24 & 1 == 1 { Operand::Immediate(right) } else { Operand::Register(Field(right)) };
        let transfer = || {
            let (device, bytes) = (word >> 15 & 0xff, (word >> 7 & 0x7f) as u8 + 1);
            // Register in bits 4..0, first byte in bits 6..5: the same as a byte selector.
            (device == 0).then_some((Field(low & 0x7f), bytes))
        };
        Some(match word >> 25 {
            0b000_0000 => Self::Add { to, left, right },
            0b000_0010 => Self::Sub { to, left, right },
            0b000_1001 => Self::Or { to, left, right },
            0b001_0010 => Self::Ldi { to, value: (word >> 8) as u16 },
            0b001_0111 => {
                let (first, bytes) = transfer()?;
                match word >> 23 & 3 {
                    1 => Self::Xin { first, bytes },
                    2 => Self::Xout { first, bytes },
                    _ => return None,
                }
            }
            0b001_0101 if word == 0x2a00_0000 => Self::Halt,
            // Bits 29..27 are greater, equal, less; offset in bits 26..25 and 7..0, signed, in words.
            0b011_0000..=0b011_0011 => {
                let offset = i64::from((word >> 25 & 3) << 8 | u32::from(low));
                let offset = if offset < 0x200 { offset } else { offset - 0x400 };
                let target = usize::try_from(i64::try_from(at).ok()? + offset).ok()?;
                Self::Qbgt { target, left, right }
            }
            _ => return None,
        })
    }
}

/// As `objdump` writes it, for a program linked at 0x20000000 with `_start` first.
impl fmt::Display for Instruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Or { to, left, right: Operand::Register(right) } if to == left && left == right => f.write_str("nop"),
            Self::Or { to, left, right: Operand::Immediate(0) } => write!(f, "mov {to}, {left}"),
            Self::Add { to, left, right } => write!(f, "add {to}, {left}, {right}"),
            Self::Sub { to, left, right } => write!(f, "sub {to}, {left}, {right}"),
            Self::Or { to, left, right } => write!(f, "or {to}, {left}, {right}"),
            Self::Ldi { to, value } => write!(f, "ldi {to}, {value}"),
            Self::Xin { first, bytes } => write!(f, "xin 0, {first}, {bytes}"),
            Self::Xout { first, bytes } => write!(f, "xout 0, {first}, {bytes}"),
            Self::Qbgt { target, left, right } => {
                let byte = target * 4;
                write!(f, "qbgt {:x} <_start+{byte:#x}>, {left}, {right}", 0x2000_0000 + byte)
            }
            Self::Halt => f.write_str("halt"),
        }
    }
}

/// The registers, and the multiplier's product on its way.
#[derive(Debug, Clone, Default)]
struct Pru {
    registers: [u32; 32],
    /// What XIN reads now, and what it will read after this clock.
    product: [u64; 2],
}

impl Pru {
    fn read(&self, field: Field) -> u32 {
        let (register, shift, mask) = field.place();
        self.registers[register] >> shift & mask
    }

    fn write(&mut self, field: Field, value: u32) {
        let (register, shift, mask) = field.place();
        let old = self.registers[register];
        self.registers[register] = old & !(mask << shift) | (value & mask) << shift;
    }

    fn value(&self, operand: Operand) -> u32 {
        match operand {
            Operand::Register(field) => self.read(field),
            Operand::Immediate(value) => value.into(),
        }
    }

    /// One clock; the address of the next instruction, or `None` at the end.
    fn clock(&mut self, instruction: Instruction, at: usize) -> Option<usize> {
        self.product = [self.product[1], u64::from(self.registers[28]) * u64::from(self.registers[29])];
        match instruction {
            Instruction::Add { to, left, right } => self.write(to, self.read(left).wrapping_add(self.value(right))),
            Instruction::Sub { to, left, right } => self.write(to, self.read(left).wrapping_sub(self.value(right))),
            Instruction::Or { to, left, right } => self.write(to, self.read(left) | self.value(right)),
            Instruction::Ldi { to, value } => self.write(to, value.into()),
            Instruction::Xin { first, bytes } => {
                assert_eq!((first, bytes), (Field(26), 8), "the product is in R26 and R27");
                self.registers[26] = self.product[0] as u32;
                self.registers[27] = (self.product[0] >> 32) as u32;
            }
            Instruction::Xout { first, bytes } => {
                assert_eq!((first, bytes), (Field(25), 1), "the mode is in R25.b0");
                assert_eq!(self.registers[25] & 1, 0, "only the mode without accumulation is known");
            }
            Instruction::Qbgt { target, left, right } if self.value(right) > self.read(left) => return Some(target),
            Instruction::Qbgt { .. } => {}
            Instruction::Halt => return None,
        }
        Some(at + 1)
    }
}

/// A program, decoded.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    words: Vec<u32>,
    instructions: Vec<Instruction>,
}

/// What the step time program leaves in R17..R22: `t_step`, `cnt_raw`, `t_4us_cnt`, `sync_raw`, `cnt`, `sync`.
pub(crate) type Results = [u32; 6];

impl Program {
    /// The project's own step time program, `tests/pru/step_core.s`.
    pub(crate) fn step_core() -> Self {
        let words = include_str!("../pru/step_core.words").lines();
        Self::new(words.map(|word| u32::from_str_radix(word, 16).unwrap()).collect())
    }

    fn new(words: Vec<u32>) -> Self {
        let decode = |(at, &word)| Instruction::decode(word, at).unwrap_or_else(|| panic!("word {at}: {word:08x}"));
        let instructions = words.iter().enumerate().map(decode).collect();
        Self { words, instructions }
    }

    pub(crate) fn words(&self) -> &[u32] {
        &self.words
    }

    pub(crate) fn instructions(&self) -> &[Instruction] {
        &self.instructions
    }

    /// Runs it with ramp entry, speed constant and previous sync_time in R14..R16.
    pub(crate) fn run(&self, entry: u32, speed: u32, prev: u32) -> Results {
        let mut pru = Pru::default();
        pru.registers[14..17].copy_from_slice(&[entry, speed, prev]);
        let mut at = 0;
        // The program has no loop: it halts within its own length.
        for _ in 0..self.instructions.len() {
            match pru.clock(self.instructions[at], at) {
                Some(next) => at = next,
                None => break,
            }
        }
        let mut results = [0; 6];
        results.copy_from_slice(&pru.registers[17..23]);
        results
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use step_profile::pru_exact;

    fn registers(entry: u32, speed: u32, prev: u32) -> Results {
        let r = pru_exact::run(entry, speed, prev);
        [r.t_step, r.cnt_raw, r.t_4us_cnt, r.sync_raw, r.cnt, r.sync]
    }

    /// The words are those of the assembly, instruction by instruction.
    #[test]
    fn the_words_are_the_assembly() {
        let source = include_str!("../pru/step_core.s");
        let mut lines = Vec::new();
        let mut done = 0;
        for line in source.lines().map(|line| line.split(';').next().unwrap().trim()) {
            match line {
                "done:" => done = lines.len() * 4,
                "" | "_start:" => {}
                directive if directive.starts_with('.') => {}
                code => lines.push(code.split_whitespace().collect::<Vec<_>>().join(" ")),
            }
        }
        let target = format!("{:x} <_start+{done:#x}>", 0x2000_0000 + done);
        let want: Vec<String> = lines.iter().map(|line| line.replace("done", &target)).collect();
        let program = Program::step_core();
        assert_eq!(program.instructions().iter().map(ToString::to_string).collect::<Vec<_>>(), want);
        assert_eq!(want.len(), 26);
    }

    /// Table 2 as printed, with XIN right after its operands, multiplies what was there before.
    #[test]
    fn without_the_instruction_between_the_product_is_the_old_one() {
        let program = Program::step_core();
        assert_eq!(program.run(415_345, 262_144, 0)[0], 1_661_380);
        let literal = program.words().iter().copied().filter(|&word| word != 0x12e0_e0e0).collect();
        assert_eq!(Program::new(literal).run(415_345, 262_144, 0)[0], 0);
    }

    #[test]
    fn other_words_are_refused() {
        for word in [0xffff_ffff, 0x2e00_0000, 0x2e88_039a, 0x2a00_0001, 0x1000_0000, 0x5000_0000] {
            assert_eq!(Instruction::decode(word, 0), None, "{word:08x}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn pru_exact_is_the_program_over_all_words(entry: u32, speed: u32, prev: u32) {
            prop_assert_eq!(Program::step_core().run(entry, speed, prev), registers(entry, speed, prev));
        }

        #[test]
        fn pru_exact_is_the_program_over_real_moves(
            entry in 1000..=415_345_u32, speed in 262_144..=677_689_575_u32, prev in 0..4000_u32,
        ) {
            prop_assert_eq!(Program::step_core().run(entry, speed, prev), registers(entry, speed, prev));
        }
    }
}
