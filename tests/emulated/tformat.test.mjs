// The T-Format pairs: all data (ID 3). A field is a byte, the answer begins nominally 3 us after the request.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { US, check } from './pair.mjs';

/** CF, SF, ABS0..2, ENID, ABM0..2, ALMC, CRC. */
function value(units) {
  const bytes = units.map((unit) => unit.value);
  assert.equal(bytes.reduce((sum, byte) => sum ^ byte, 0), 0, 'x^8 + 1');
  const [abs, abm] = [2, 6].map((at) => bytes[at] | (bytes[at + 1] << 8) | (bytes[at + 2] << 16));
  return `abs ${abs} abm ${abm} enid ${bytes[5].toString(16)} `;
}

const PAIR = { bits: 8, turn: 3 * US, late: 12 * US, request: [0x1a], length: 11, value };
test('T-Format at 2.5 Mbit/s', () => check('tformat-master', { ...PAIR, clocks: 48 }));
test('T-Format at 5 Mbit/s', () => check('tformat-master-5m', { ...PAIR, clocks: 24 }));
