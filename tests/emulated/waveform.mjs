// What the state machines of an image do by `chip.mjs`, as JSON for `compare.py`: program and settings as the image has set them
// up, what the transmitter makes of some words, and what the receiver makes of that.
//
//     node waveform.mjs IMAGE
import { fileURLToPath } from 'node:url';
import { Chip } from './chip.mjs';
import { HZ, IMAGES } from './pair.mjs';

const [DI, DE, RO] = [2, 3, 4];
// Number of bits - 1, a wait, the bits: an odd pattern of 60 bits, then one of 27 bits with a wait.
const WORDS = [59, 0, 0x6a5c3d96, 0x080f3a90 | (1 << 27), 26, 33, 0x06b7_51a1 | (1 << 26)];
/** The flag that starts what the transmitter holds. */
const START = 1;
const START_CLOCKS = 12_000;
// And so long without a request of its own.
const QUIET_CLOCKS = 1_000;

const chip = new Chip('image', IMAGES + process.argv[2], { hz: HZ });
const pio = chip.chip.pio[0];
for (let t = 0, quiet = 0; t < START_CLOCKS || quiet < QUIET_CLOCKS; t++) {
  chip.input(RO, true);
  chip.clock();
  quiet = (pio.pinValues >> DE) & 1 ? 0 : quiet + 1;
}
// From here on the processor and the DMA stand still.
chip.chip.core.executeInstruction = () => Number.MAX_SAFE_INTEGER;
for (const channel of chip.chip.dma.channels) channel.abort();
const [tx, rx] = pio.machines;
const divider = tx.clockDivInt;
if (tx.clockDivFrac || rx.clockDivFrac || rx.clockDivInt !== divider) throw new Error('a whole divider, the same for both');
const settings = (machine) => ({
  start: machine.pc,
  wrapTarget: machine.wrapBottom,
  wrapTop: machine.wrapTop,
  push: machine.pushThreshold,
});
const result = { image: process.argv[2], program: [...pio.instructions], tx: settings(tx), rx: settings(rx), words: WORDS };

// Pins once a cycle of the machines, in their phase; words go in as there is room; the receiver hears the transmitter.
const [waves, words, heard] = [[], [...WORDS], []];
chip.machines[0].clocks = chip.machines[1].clocks = 0;
for (let cycle = 0; cycle < 2500; cycle++) {
  while (words.length > 0 && !tx.txFIFO.full) tx.writeFIFO(words.shift());
  pio.irq |= START;
  for (let k = 0; k < divider; k++) chip.clock();
  const [di, de] = [(pio.pinValues >> DI) & 1, (pio.pinValues >> DE) & 1];
  const level = de ? di : 1;
  for (let stage = 0; stage < 3; stage++) chip.input(RO, level === 1);
  waves.push(di | (de << 1));
  while (!rx.rxFIFO.empty) heard.push(rx.readFIFO() >>> 0);
}
process.stdout.write(JSON.stringify({ ...result, waves, heard }));
process.exit(0);
