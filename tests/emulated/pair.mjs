// What every pair of images has to do: run it, hurt the line in some exchanges, and check what both have made of it.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { appendFileSync } from 'node:fs';
import { Chip } from './chip.mjs';
import { Wire, units } from './wire.mjs';

const cargo = execFileSync('cargo', ['metadata', '--no-deps', '--format-version', '1'], {
  cwd: new URL('../../examples/firmware/rp2040/', import.meta.url),
});
export const IMAGES = `${JSON.parse(cargo).target_directory}/thumbv6m-none-eabi/release/`;
export const HZ = 120e6;
const MS = HZ / 1000;

/** A position on the console. */
const POSITION = /^turn /;

export const US = HZ / 1e6;

/**
 * Runs `ms` of two images. `faults`: what happens to the line, by the number of the exchange. `typed`: lines for the master's
 * console; each is typed when the one before has been answered. `mistakes`: of the wiring; without `noted` the figures are not.
 */
export function run(masterImage, encoderImage, { ms, faults = {}, typed = [], mistakes = {}, noted = true }) {
  const lines = [];
  const rest = [...typed];
  const type = () => rest.length > 0 && master.type(rest.shift());
  const print = (text) => {
    lines.push({ t: wire.t, text });
    if (!POSITION.test(text) && !/^fault/.test(text)) type();
  };
  const master = new Chip(masterImage, IMAGES + masterImage, { hz: HZ, print });
  const encoder = new Chip(encoderImage, IMAGES + encoderImage, { hz: HZ });
  const wire = new Wire(master, encoder);
  Object.assign(wire.mistakes, mistakes);
  const counts = []; // instructions of both until each request
  wire.onRequest = (exchange) => {
    counts.push([master.instructions, encoder.instructions]);
    wire.delay = 0;
    wire.deaf = false;
    wire.disturb = null;
    faults[exchange]?.(wire);
  };
  wire.run(ms * MS);
  if (!noted) return { wire, lines };
  for (const [k, image] of [masterImage, encoderImage].entries()) {
    const chip = [master, encoder][k];
    note(image, 'stack', chip.stack);
    // Not of a run in which something was typed: its cycles are of many kinds.
    if (typed.length === 0) note(image, 'instructions a cycle', (counts.at(-1)[k] - counts[1][k]) / (counts.length - 2));
  }
  return { wire, lines };
}

/** Notes a figure for figures.py. */
function note(image, what, value) {
  if (process.env.FIGURES) appendFileSync(process.env.FIGURES, `${image}\t${what}\t${Math.round(value)}\n`);
}

/** The exchanges of a run that have ended: request and answer as units, by the wire alone. */
export function exchanges(wire, bits, clocks) {
  return wire.drives[0].slice(0, -1).map(([from, to], k) => {
    const next = wire.drives[0][k + 1][0];
    const answer = wire.drives[1].find(([start]) => start >= from && start < next);
    const [asked, answered] = [wire.between(from, to), answer ? wire.between(...answer) : []];
    return { from, to, answer, asked, answered, request: units(asked, bits, clocks), units: units(answered, bits, clocks) };
  });
}

/**
 * The faults that every pair has to survive, by the number of the exchange. `unit`: clocks of a unit; `turn`: of the
 * turn-around; `late`: by how much an answer is later than the master waits.
 */
export function faults({ clocks, unit, turn, late }) {
  const answer = clocks + unit + turn;
  const within = (t, from, length) => t > from && t <= from + length;
  const inverted = (from, length) => (wire) =>
    (wire.disturb = (t, level) => (within(t, from, length) ? !level : level));
  return {
    5: (wire) => (wire.deaf = true),
    10: inverted(answer + unit + 5 * clocks, clocks), // a bit of the second unit
    15: (wire) => (wire.delay = late),
    20: (wire) => (wire.disturb = (t, level) => level && !within(t, answer - US, US / 2)), // noise before the answer
    25: (wire) => (wire.disturb = (t, level) => level || within(t, answer + unit, 2 * unit)), // a hole in it
    30: inverted(clocks, 2 * clocks), // a damaged request
  };
}

/**
 * Runs a pair with faults on the line and checks it by what was on the wire and what the master printed.
 * `request`: its units; `length`: units of an answer; `value`: what units of an answer mean, as the master prints it.
 */
export function check(name, { bits, clocks, turn, late, request, length, value }) {
  const unit = (bits + 2) * clocks;
  const hurts = faults({ clocks, unit, turn, late });
  const hurt = new Set(Object.keys(hurts).map(Number));
  const { wire, lines } = run(name, name.replace('master', 'encoder'), { ms: 24, faults: hurts });
  const all = exchanges(wire, bits, clocks);
  const said = lines.map(({ text }) => text).join('\n');
  assert.ok(all.length > 140, `${all.length} exchanges`);
  assert.equal(wire.clashes, 0, 'both drivers on at once');

  // The encoder still starts when the first request comes.
  const good = all.filter((_, k) => k > 0 && !hurt.has(k));
  const turns = good.map((exchange) => {
    const values = exchange.units.map((heard) => heard.value);
    assert.deepEqual(exchange.request.map((sent) => sent.value), request);
    assert.equal(values.length, length, `${values}`);
    assert.ok(exchange.units.every((heard) => heard.framed));
    for (const [edges, sent] of [[exchange.asked, exchange.request], [exchange.answered, exchange.units]]) {
      for (const [at] of edges) assert.equal((at - sent[0].at) % clocks, 0, `an edge off the grid of ${clocks} clocks`);
    }
    tight([exchange.from, exchange.to], exchange.request, unit, clocks);
    tight(exchange.answer, exchange.units, unit, clocks);
    return exchange.units[0].at - (exchange.request.at(-1).at + unit);
  });
  for (const clocksOfTurn of turns) {
    assert.ok(Math.abs(clocksOfTurn - turn) <= 0.15 * US, `turn-around of ${(clocksOfTurn / US).toFixed(2)} us`);
  }
  // The transmitter is started by the receiver: a cycle of the machines and a clock of the synchroniser, and not the processor's.
  assert.ok(Math.max(...turns) - Math.min(...turns) <= 5, `turn-around of ${Math.min(...turns)} to ${Math.max(...turns)} clocks`);
  const shaft = good.map((exchange) => Number(value(exchange.units).match(/(\d+) counts/)[1]));
  assert.ok(shaft.every((at, k) => k === 0 || at > shaft[k - 1]), 'the shaft turns');

  // What was said after the last request is of an exchange that the run may have cut.
  const ended = wire.drives[0].at(-1)[0];
  const printed = lines.filter(({ t, text }) => t < ended && POSITION.test(text));
  assert.ok(printed.length > 8, said);
  for (const { t, text } of printed) {
    const last = all.findLast((exchange) => exchange.answer && exchange.answer[1] <= t);
    assert.ok(text.startsWith(value(last.units)), `${text}: the wire carried ${value(last.units)}`);
  }
  const failed = lines.filter(({ text }) => text.startsWith('fault'));
  assert.equal(failed.length, hurt.size, `a fault costs its own exchange and no other\n${said}`);
  const [, , bad] = printed.at(-1).text.match(/(\d+) good, (\d+) bad/).map(Number);
  assert.equal(bad, hurt.size);

  const microseconds = (t) => (t / US).toFixed(2);
  console.log(`${name}: ${all.length} exchanges, ${good.length} unhurt and good, answers after ` +
    `${microseconds(Math.min(...turns))} to ${microseconds(Math.max(...turns))} us, ` +
    `stack ${wire.master.stack} and ${wire.encoder.stack} bytes`);
  for (const { t, text } of failed) console.log(`  at ${(t / US).toFixed(0)} us ${text}`);
}

/**
 * Reads, writes and reads a cell of the EEPROM and sets the turns to 0, as typed at the console of the master, and checks what it
 * says and what was on the wire. `requests`: units of the requests to write and to reset, and how often the latter has to come;
 * `turns`: those of an answer to a read, as units; `before` and `after`: how the cell is printed.
 */
export function service(name, { bits, clocks, length, write, reset, repeats, turns, typed, said, ms }) {
  const { wire, lines } = run(name, name.replace('master', 'encoder'), { ms, typed });
  const text = lines.map((line) => line.text).join('\n');
  assert.deepEqual(lines.map((line) => line.text).filter((line) => !POSITION.test(line)).slice(1), said, text);
  assert.equal(wire.clashes, 0, 'both drivers on at once');
  const all = exchanges(wire, bits, clocks);
  const asked = all.map((exchange) => exchange.request.map((unit) => unit.value).join());
  assert.equal(asked.filter((request) => request === write.join()).length, 1, 'the cell is written once');
  const first = asked.indexOf(reset.join());
  const resets = asked.filter((request) => request === reset.join());
  assert.equal(resets.length, repeats, 'the reset is sent as often as the protocol wants');
  assert.ok(asked.slice(first, first + repeats).every((request) => request === reset.join()), 'with nothing between');
  const values = all.map((exchange) => exchange.units.map((unit) => unit.value));
  const reads = all.map((_, k) => k).filter((k) => k > 0 && values[k].length === length);
  const [early, late] = [reads.filter((k) => k < first), reads.filter((k) => k > first + repeats)];
  assert.ok(early.length > 3 && late.length > 20, `${early.length} reads before, ${late.length} after`);
  for (const k of early) assert.equal(turns(values[k]), 7, `${values[k]}`);
  for (const k of late) assert.equal(turns(values[k]), 0, `${values[k]}`);
  const plain = all.filter((_, k) => k > 0 && values[k].length !== length && values[k].length > 0);
  const slowest = Math.max(...plain.map((exchange) => exchange.units[0].at - (exchange.request.at(-1).at + (bits + 2) * clocks)));
  const printed = lines.filter((line) => POSITION.test(line.text));
  assert.ok(/ 0 bad$/.test(printed.at(-1).text), text);
  console.log(`${name}: ${said.join('; ')}; turns 7 in ${early.length} answers, then 0 in ${late.length}; ` +
    `answers not made ahead after up to ${(slowest / US).toFixed(1)} us, stack ${wire.master.stack} and ${wire.encoder.stack} bytes`);
}

/** The driver is on one bit before the first start bit, or a little more, and off within a bit after the last stop bit. */
function tight([from, to], sent, unit, clocks) {
  const lead = sent[0].at - from;
  assert.ok(lead >= clocks && lead < 2 * clocks, `driver on ${lead} clocks before the first bit`);
  const end = sent.at(-1).at + unit;
  assert.ok(to >= end && to <= end + clocks, `driver off ${to - end} clocks after the last bit`);
}
