// What every pair of images has to do: run it, hurt the line in some exchanges, and check what both have made of it.
import assert from 'node:assert/strict';
import { fileURLToPath } from 'node:url';
import { Chip } from './chip.mjs';
import { Wire, units } from './wire.mjs';

export const IMAGES = fileURLToPath(
  new URL('../../examples/firmware/rp2040/target/thumbv6m-none-eabi/release/', import.meta.url),
);
export const HZ = 120e6;
const MS = HZ / 1000;

/** Runs `ms` of two images. `faults`: what happens to the line, by the number of the exchange. */
export function run(masterImage, encoderImage, { ms, faults }) {
  const lines = [];
  const print = (text) => lines.push({ t: wire.t, text });
  const master = new Chip(masterImage, IMAGES + masterImage, { hz: HZ, print });
  const encoder = new Chip(encoderImage, IMAGES + encoderImage, { hz: HZ });
  const wire = new Wire(master, encoder);
  wire.onRequest = (exchange) => {
    wire.delay = 0;
    wire.silent = false;
    wire.disturb = null;
    faults[exchange]?.(wire);
  };
  wire.run(ms * MS);
  return { wire, lines };
}

/** The exchanges of a run that have ended: request and answer as units, by the wire alone. */
export function exchanges(wire, bits, clocks) {
  return wire.drives[0].slice(0, -1).map(([from, to], k) => {
    const next = wire.drives[0][k + 1][0];
    const answer = wire.drives[1].find(([start]) => start >= from && start < next);
    return {
      from,
      to,
      answer,
      request: units(wire.between(from, to), bits, clocks),
      units: answer ? units(wire.between(answer[0], answer[1]), bits, clocks) : [],
      edges: [...wire.between(from, to), ...(answer ? wire.between(answer[0], answer[1]) : [])],
    };
  });
}

/** Every edge of what a speaker sends is a whole number of bits after its first. */
export function bitsAreExact(exchange, clocks, hurt) {
  const grids = [exchange.request, hurt ? [] : exchange.units].filter((sent) => sent.length > 0);
  grids.forEach((sent, who) => {
    const edges = exchange.edges.filter(([at]) => (who === 0 ? at <= exchange.to : at > exchange.to));
    for (const [at] of edges) assert.equal((at - sent[0].at) % clocks, 0, `an edge off the grid of ${clocks} clocks`);
  });
}

/** The driver is on one bit before the first start bit, or a little more, and off within a bit after the last stop bit. */
export function driversAreTight(exchange, bits, clocks) {
  const check = ([from, to], sent) => {
    const lead = sent[0].at - from;
    assert.ok(lead >= clocks && lead < 2 * clocks, `driver on ${lead} clocks before the first bit`);
    const end = sent.at(-1).at + (bits + 2) * clocks;
    assert.ok(to >= end && to <= end + clocks, `driver off ${to - end} clocks after the last bit`);
  };
  check([exchange.from, exchange.to], exchange.request);
  if (exchange.units.length > 0) check(exchange.answer, exchange.units);
}
