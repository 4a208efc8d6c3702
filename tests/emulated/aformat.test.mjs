// The A-format pairs: the whole position of encoder 0 (command 0). A frame has 16 bits between start and stop bit.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { US, check, service } from './pair.mjs';

/** Information field, ABS bits 0 to 15, 16 to 31, 32 to 39 with the CRC-8. The first three bits are the sync code 001. */
function value(units) {
  const [information, low, middle, high] = units.map((unit) => unit.value);
  assert.equal(information & 7, 4, 'sync code of an answer');
  const position = low + middle * 2 ** 16 + (high & 0xff) * 2 ** 32;
  return `turn ${Math.floor(position / 2 ** 20)}, ${position % 2 ** 20} counts at `;
}

// The sync code of a command frame is 010; address and command are 0, and so is their CRC-3.
const PAIR = { bits: 16, turn: 2.8 * US, late: 62 * US, request: [0b010], length: 4, value };
test('A-format at 8 Mbit/s', () => check('aformat-master', { ...PAIR, clocks: 15 }));
test('A-format at 2.5 Mbit/s', () => check('aformat-master-2m5', { ...PAIR, clocks: 48 }));

/** A word whose first bit on the line is bit 15, as TI and the vectors write it. */
const word = (first) => [...Array(16).keys()].reduce((sum, bit) => sum | (((first >> (15 - bit)) & 1) << bit), 0);

// EEPROM_WRITE with the data 0xff6 and the address 0; CLEAR_MULTITURN eight times; 20 bits a turn.
test('A-format EEPROM and turns', () =>
  service('aformat-master', {
    ...PAIR,
    clocks: 15,
    ms: 80,
    typed: ['read 0', 'write 0 ff6', 'read 0', 'lose multi-turn reference', 'write f0 1'],
    said: ['EEPROM 00: ffff', 'EEPROM 00: 0ff6', 'EEPROM 00: 0ff6', 'turns: cleared', 'that is not for users'],
    write: [0x4074, 0x537e, 0x4f82, 0x5801].map(word),
    reset: [word(0x4097)],
    repeats: 8,
    turns: ([, low, middle, high]) => Math.floor((low + middle * 2 ** 16 + (high & 0xff) * 2 ** 32) / 2 ** 20),
  }));
