// Runs the motion image of the RP2040, types the lines of a script, and prints what was said and every edge of STEP and DIR as JSON.
//
//     node rp2040.mjs IMAGE SCRIPT
//
// SCRIPT is JSON: `lines` of [condition, text], typed one by one when the line before has been answered and the condition holds: the
// number of steps of the first axis, `steps`, or of rests, `rests`. `stall`: the processor stands still for so many clocks once the
// first axis has made so many steps. It ends a while after `rests` rests.
import { Chip } from '../chip.mjs';

const HZ = 120e6;
const DIR = [2, 3];
const TOGGLE = [4, 5];
const STEP = [6, 7];
const QUIET = 0.01 * HZ; // clocks after the last rest: pulses may still come
const MOST = 1.5 * HZ;

const [image, script] = process.argv.slice(2);
const { lines, rests: wanted, stall } = JSON.parse(script);
const [said, typed, edges] = [[], [], []];
let [interrupted, longest] = [0, 0]; // instructions of an interrupt, and of the longest
let [t, answered, rests, steps, before, stalled, rested] = [0, true, 0, 0, 0, false, 0];
const chip = new Chip('motion', image, {
  hz: HZ,
  print: (text) => {
    said.push([t, text]);
    if (/^rest/.test(text)) [rests, rested] = [rests + 1, t];
    else answered = true;
  },
});
const pio = chip.chip.pio[0];
const watched = [...DIR, ...STEP].reduce((sum, pin) => sum | (1 << pin), 0);
for (; t < MOST && (rests < wanted || t < rested + QUIET); t++) {
  const next = lines[typed.length];
  const due = next && (next[0]?.steps ?? 0) <= steps && (next[0]?.rests ?? 0) <= rests;
  if (due && answered && said.length > 0) {
    answered = false;
    typed.push([t, next[1]]);
    chip.type(next[1]);
  }
  if (stall && !stalled && steps >= stall.steps) {
    chip.busy = stall.clocks;
    stalled = true;
  }
  const executed = chip.instructions;
  chip.clock();
  if (chip.instructions > executed) interrupted = chip.chip.core.IPSR ? interrupted + 1 : 0;
  longest = Math.max(longest, interrupted);
  // A pin is an input too.
  for (const pin of TOGGLE) chip.input(pin, chip.output(pin));
  const now = pio.pinValues & watched;
  if (now !== before) {
    edges.push([t, now]);
    steps += (now & ~before & (1 << STEP[0])) === 0 ? 0 : 1;
    before = now;
  }
}
const pins = (levels, of) => of.reduce((sum, pin, axis) => sum | (((levels >> pin) & 1) << axis), 0);
const result = { hz: HZ, said, typed, edges: edges.map(([at, levels]) => [at, pins(levels, STEP), pins(levels, DIR)]) };
process.stdout.write(JSON.stringify({ ...result, stack: chip.stack, interrupt: longest }), () => process.exit(0));
