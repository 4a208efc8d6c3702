// The T-Format pairs: all data (ID 3). A field is a byte, the answer begins nominally 3 us after the request.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { US, check, service } from './pair.mjs';

/** CF, SF, ABS0..2, ENID, ABM0..2, ALMC, CRC. */
function value(units) {
  const bytes = units.map((unit) => unit.value);
  assert.equal(bytes.reduce((sum, byte) => sum ^ byte, 0), 0, 'x^8 + 1');
  const [abs, abm] = [2, 6].map((at) => bytes[at] | (bytes[at + 1] << 8) | (bytes[at + 2] << 16));
  assert.equal(bytes[5], 0x17, 'an encoder with 23 bits');
  return `turn ${abm}, ${abs} counts at `;
}

const PAIR = { bits: 8, turn: 3 * US, late: 16 * US, request: [0x1a], length: 11, value };
test('T-Format at 2.5 Mbit/s', () => check('tformat-master', { ...PAIR, clocks: 48 }));
test('T-Format at 5 Mbit/s', () => check('tformat-master-5m', { ...PAIR, clocks: 24 }));

// 32 05 A5 and their XOR; ID C ten times; ABM of all data (ID 3).
test('T-Format EEPROM and turns', () =>
  service('tformat-master', {
    ...PAIR,
    clocks: 48,
    ms: 60,
    typed: ['read 5', 'write 5 a5', 'read 5', 'lose multi-turn reference', 'nonsense'],
    said: ['EEPROM 05: ff', 'EEPROM 05: a5', 'EEPROM 05: a5', 'ABM: 0', '?'],
    write: [0x32, 0x05, 0xa5, 0x32 ^ 0x05 ^ 0xa5],
    reset: [0x62],
    repeats: 10,
    turns: (units) => units[6] | (units[7] << 8) | (units[8] << 16),
  }));
