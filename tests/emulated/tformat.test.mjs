// The T-Format pair: ID 3 at 2.5 Mbit/s, with faults on the line.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { HZ, bitsAreExact, driversAreTight, exchanges, run } from './pair.mjs';

const BIT = 48; // 120 MHz / 2.5 Mbit/s
const FIELD = 10 * BIT;
const US = HZ / 1e6;
/** From the end of a request to the start bit of its answer: nominally 3 us. */
const TURN = [2.9 * US, 3.2 * US];

// Request, 3 us, 11 fields: clocks since the driver of the master went on.
const ANSWER = BIT + FIELD + 3 * US;
const FAULTS = {
  5: (wire) => (wire.silent = true),
  10: (wire) => (wire.disturb = (t, level) => (t > ANSWER + 44 * BIT && t <= ANSWER + 45 * BIT ? !level : level)),
  15: (wire) => (wire.delay = 12 * US), // later than the time-out of 10 us
  20: (wire) => (wire.disturb = (t, level) => level && !(t > ANSWER - US && t <= ANSWER - US / 2)),
  25: (wire) => (wire.disturb = (t, level) => (t > ANSWER + 3 * FIELD && t <= ANSWER + 5 * FIELD ? true : level)),
  30: (wire) => (wire.disturb = (t, level) => (t > BIT && t <= 3 * BIT ? !level : level)),
};

const HURT = new Set(Object.keys(FAULTS).map(Number));

test('T-Format at 2.5 Mbit/s', () => {
  const { wire, lines } = run('tformat-master', 'tformat-encoder', { ms: 20, faults: FAULTS });
  const all = exchanges(wire, 8, BIT);
  assert.ok(all.length > 150, `${all.length} exchanges`);
  assert.equal(wire.clashes, 0, 'both drivers on at once');

  const values = [];
  all.forEach((exchange, k) => {
    // The encoder still starts at the first request.
    const hurt = k === 0 || HURT.has(k);
    if (hurt) return;
    assert.deepEqual(exchange.request.map((unit) => unit.value), [0x1a], `request ${k}`);
    const bytes = exchange.units.map((unit) => unit.value);
    assert.ok(exchange.units.every((unit) => unit.framed));
    assert.equal(bytes.length, 11, `answer ${k}`);
    assert.equal(bytes.reduce((sum, byte) => sum ^ byte), 0, 'x^8 + 1');
    bitsAreExact(exchange, BIT, false);
    driversAreTight(exchange, 8, BIT);
    const turn = exchange.units[0].at - (exchange.request[0].at + FIELD);
    assert.ok(turn >= TURN[0] && turn <= TURN[1], `turn-around of ${(turn / US).toFixed(2)} us`);
    values.push(bytes[2] | (bytes[3] << 8) | (bytes[4] << 16));
  });
  values.forEach((value, k) => assert.ok(k === 0 || value > values[k - 1], 'the shaft turns'));

  // What the master says, against what the wire has carried.
  const printed = lines.filter(({ text }) => text.startsWith('abs'));
  assert.ok(printed.length > 8, lines.map(({ text }) => text).join('\n'));
  for (const { t, text } of printed) {
    const last = all.findLast((exchange) => exchange.answer && exchange.answer[1] <= t);
    const bytes = last.units.map((unit) => unit.value);
    const [abs, abm] = [bytes[2] | (bytes[3] << 8) | (bytes[4] << 16), bytes[6] | (bytes[7] << 8) | (bytes[8] << 16)];
    assert.ok(text.startsWith(`abs ${abs} abm ${abm} enid 17 `), `${text}: the wire carried ${abs} ${abm}`);
  }
  const faults = lines.filter(({ text }) => text.startsWith('fault'));
  assert.equal(faults.length, HURT.size, `one fault an exchange that was hurt, good ones between\n${faults.map(({ text }) => text).join('\n')}`);
  const [, good, bad] = printed.at(-1).text.match(/(\d+) good, (\d+) bad/).map(Number);
  assert.equal(bad, HURT.size);
  console.log(`${all.length} exchanges, ${good} good and ${bad} bad when last printed, ${all.length - HURT.size} unhurt`);
  console.log(faults.map(({ t, text }) => `${(t / US).toFixed(0)} us: ${text}`).join('\n'));
});
