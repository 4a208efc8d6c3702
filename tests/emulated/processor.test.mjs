import assert from 'node:assert/strict';
import test from 'node:test';
import { RP2040 } from 'rp2040js';
import { mend } from './processor.mjs';

const RAM = 0x20000000;
const OPERANDS = [0, 1, 2, 0x7ffffffe, 0x7fffffff, 0x80000000, 0x80000001, 0xfffffffe, 0xffffffff];

/** r0 = r0 OP r1, and what the ARMv6-M manual says of it: AddWithCarry of two words and the carry. */
const INSTRUCTIONS = [
  ['ADCS', 0x4148, (b, carry) => [b, carry]],
  ['SBCS', 0x4188, (b, carry) => [~b >>> 0, carry]],
  ['ADDS', 0x1840, (b) => [b, 0]],
  ['SUBS', 0x1a40, (b) => [~b >>> 0, 1]],
  ['CMP', 0x4288, (b) => [~b >>> 0, 1]],
];

function addWithCarry(a, b, carry) {
  const unsigned = BigInt(a) + BigInt(b) + BigInt(carry);
  const signed = BigInt(a | 0) + BigInt(b | 0) + BigInt(carry);
  const sum = Number(unsigned & 0xffffffffn);
  return { sum, N: sum >= 0x80000000, Z: sum === 0, C: unsigned > 0xffffffffn, V: BigInt(sum | 0) !== signed };
}

test('sums and differences at the ends of their ranges set the flags as the manual says', () => {
  const chip = new RP2040();
  const { core } = chip;
  mend(core);
  for (const [name, opcode, operands] of INSTRUCTIONS) {
    for (const a of OPERANDS) {
      for (const b of OPERANDS) {
        for (const carry of [0, 1]) {
          chip.writeUint16(RAM, opcode);
          [core.registers[0], core.registers[1], core.C, core.PC] = [a, b, carry === 1, RAM];
          core.executeInstruction();
          const { sum, ...want } = addWithCarry(a, ...operands(b, carry));
          const { N, Z, C, V } = core;
          assert.deepEqual({ N, Z, C, V }, want, `${name} ${a} ${b} ${carry}`);
          assert.equal(core.registers[0], name === 'CMP' ? a : sum, `${name} ${a} ${b} ${carry}`);
        }
      }
    }
  }
});
