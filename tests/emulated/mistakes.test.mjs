// The table "If nothing arrives" of the README: each mistake is made, and the master has to say what stands there.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { run } from './pair.mjs';

const README = readFileSync(new URL('../../examples/firmware/rp2040/README.md', import.meta.url), 'utf8');
/** Of the encoder: it hears nothing and drives nothing. */
const absent = { 0: (wire) => (wire.deaf = true) };

const MISTAKES = {
  'A and B exchanged': { mistakes: { crossed: true } },
  'an encoder of 5 Mbit/s at a master of 2.5': { encoder: 'tformat-encoder-5m' },
  'an encoder of 2.5 Mbit/s at a master of 5': { master: 'tformat-master-5m' },
  'an A-format encoder': { encoder: 'aformat-encoder-2m5' },
  'DE always on': { mistakes: { enable: () => true } },
  'DE always off, or not wired': { mistakes: { enable: () => false } },
  'no supply at the encoder, or no encoder': { silent: true },
  'the same, and /RE at GND': { silent: true, mistakes: { echo: true } },
  'nothing but /RE at GND': { mistakes: { echo: true } },
};

for (const [mistake, { master = 'tformat-master', encoder = 'tformat-encoder', silent, mistakes }] of Object.entries(MISTAKES)) {
  test(mistake, () => {
    const always = { get: () => silent && absent[0] };
    const { lines } = run(master, encoder, { ms: 8, mistakes, faults: new Proxy({}, always), noted: false });
    const [first, ...rest] = lines.map(({ text }) => text);
    assert.ok(master !== 'tformat-master' || README.includes(`\n${first}\n`), `the README does not begin with\n${first}`);
    // The encoder still starts when the first request comes.
    const said = new Set(rest.slice(1).map((line) => line.replace(/, \d+ good.*| at \d+ ns.*/, '').replace(/\d+ counts/, '... counts')));
    assert.ok(rest.length > 2);
    const row = `| ${mistake} | ${[...said].map((line) => `\`${line}\``).join(', ')} |`;
    assert.ok(README.includes(row), `the README has no line\n${row}`);
    console.log(row);
  });
}
