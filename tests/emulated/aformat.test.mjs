// The A-format pairs: the whole position of encoder 0 (command 0). A frame has 16 bits between start and stop bit.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { US, check } from './pair.mjs';

/** Information field, ABS bits 0 to 15, 16 to 31, 32 to 39 with the CRC-8. The first three bits are the sync code 001. */
function value(units) {
  const [information, low, middle, high] = units.map((unit) => unit.value);
  assert.equal(information & 7, 4, 'sync code of an answer');
  return `abs ${low + middle * 2 ** 16 + (high & 0xff) * 2 ** 32} `;
}

// The sync code of a command frame is 010; address and command are 0, and so is their CRC-3.
const PAIR = { bits: 16, turn: 2.8 * US, late: 22 * US, request: [0b010], length: 4, value };
test('A-format at 8 Mbit/s', () => check('aformat-master', { ...PAIR, clocks: 15 }));
test('A-format at 2.5 Mbit/s', () => check('aformat-master-2m5', { ...PAIR, clocks: 48 }));
