// An RP2040 that is stepped clock by clock.
//
// rp2040js runs the processor and the peripherals of the unmodified image. Its PIO has no time: whole programs run in one go,
// without dividers and delays, and the state machines' enable bit is not looked at. The scheduler here takes the place of
// that: it lets every enabled machine do at most one thing in each of its own cycles. Inputs reach a pin two clocks late, as
// through the chip's synchronisers. Reading the DMA's abort register gives 0, an abort that has ended.
//
// Not modelled: joined FIFOs, the second core, misses of the flash cache, contention on the bus. Claim no processor times.
import { readFileSync } from 'node:fs';
import { RP2040, ConsoleLogger, LogLevel } from 'rp2040js';
import { mend } from './processor.mjs';

const FLASH = 0x10000000;
const BOOT2_RAM = 0x20041f00;
const BOOT2_BYTES = 256;
/** Where an image's stack begins: the end of its RAM in memory.x. */
const STACK_TOP = 0x20040000;
const PT_LOAD = 1;
const SHT_SYMTAB = 2;
/** The watchdog's place among the peripherals. */
const WATCHDOG = 0x40058;
const DMA_CHAN_ABORT = 0x444;
const EXEC_STALLED = 0x80000000;
/** SMx_SHIFTCTRL, from SMx_CLKDIV on, and its bits for joined FIFOs. */
const SHIFTCTRL = 0x08;
const JOINED = 0xc0000000;
/** Of a character on the console: 10 bits at 1,000,000 baud. */
const CHARACTER_NS = 10_000;

/** One state machine in time. */
class Scheduled {
  constructor(machine) {
    this.machine = machine;
    this.clocks = 0; // 1/256 clocks until the next cycle
    this.pause = 0; // cycles of delay that are left
    this.inCycle = false;
    const { checkWait, restart, writeUint32 } = machine;
    // Joining the FIFOs, or taking them apart again, empties them.
    machine.writeUint32 = (offset, value) => {
      if (offset === SHIFTCTRL && (value ^ machine.shiftCtrl) & JOINED) {
        while (!machine.txFIFO.empty) machine.txFIFO.pull();
        while (!machine.rxFIFO.empty) machine.rxFIFO.pull();
        machine.updateDMATx();
        machine.updateDMARx();
      }
      writeUint32.call(machine, offset, value);
    };
    // FIFO writes, IRQ flags and pins end a wait only when the machine's own cycle comes, or at once for an
    // instruction that the processor has put in.
    machine.checkWait = () => {
      if (this.inCycle || machine.execCtrl & EXEC_STALLED) checkWait.call(machine);
    };
    machine.restart = () => {
      restart.call(machine);
      this.pause = 0;
    };
    machine.clkDivRestart = () => {
      this.clocks = 0;
    };
  }

  clock() {
    this.clocks -= 256;
    if (this.clocks > 0) return;
    this.clocks += (this.machine.clockDivInt || 0x10000) * 256 + this.machine.clockDivFrac;
    if (this.pause > 0) {
      this.pause--;
      return;
    }
    this.inCycle = true;
    this.cycle(this.machine);
    this.inCycle = false;
  }

  cycle(machine) {
    if (machine.waiting) {
      const delay = Math.max(machine.waitDelay, 0);
      machine.checkWait();
      if (!machine.waiting) this.pause = delay;
      return;
    }
    const before = machine.cycles;
    machine.updatePC = true;
    machine.executeInstruction(machine.pio.instructions[machine.pc]);
    if (machine.updatePC) machine.nextPC();
    if (!machine.waiting) this.pause = machine.cycles - before - 1;
  }
}

/** Writes the loaded segments of an ELF file into the flash, at their physical addresses. */
function load(flash, path) {
  const file = readFileSync(path);
  const view = new DataView(file.buffer, file.byteOffset, file.length);
  const [headers, size, count] = [view.getUint32(28, true), view.getUint16(42, true), view.getUint16(44, true)];
  for (let k = 0; k < count; k++) {
    const at = headers + k * size;
    const [type, offset, , physical, length] = [0, 4, 8, 12, 16].map((field) => view.getUint32(at + field, true));
    const inFlash = physical >= FLASH && physical < FLASH + flash.length;
    if (type === PT_LOAD && length > 0 && inFlash) flash.set(file.subarray(offset, offset + length), physical - FLASH);
  }
}

/** The address of a symbol in an ELF file. */
function symbol(path, name) {
  const file = readFileSync(path);
  const view = new DataView(file.buffer, file.byteOffset, file.length);
  const [headers, size, count] = [view.getUint32(32, true), view.getUint16(46, true), view.getUint16(48, true)];
  const section = (k) => [4, 16, 20, 24].map((field) => view.getUint32(headers + k * size + field, true));
  for (let k = 0; k < count; k++) {
    const [type, at, length, link] = section(k);
    const [, names] = section(link);
    for (let entry = at; type === SHT_SYMTAB && entry < at + length; entry += 16) {
      const text = names + view.getUint32(entry, true);
      if (file.toString('latin1', text, file.indexOf(0, text)) === name) return view.getUint32(entry + 4, true);
    }
  }
  throw new Error(`${path}: no ${name}`);
}

/** The checksum that the chip's ROM wants to see over the second boot stage. */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) crc = crc & 0x80000000 ? (crc << 1) ^ 0x04c11db7 : crc << 1;
  }
  return crc >>> 0;
}

export class Chip {
  /** `print` is called with every line on the console. `before`: a chip whose watchdog has begun this one again; RAM stays. */
  constructor(name, path, { hz, print = () => {}, before = null }) {
    this.name = name;
    this.path = path;
    this.ns = 1e9 / hz;
    this.instructions = 0;
    this.deepest = STACK_TOP;
    this.busy = 0; // clocks that the present instruction still takes
    this.synchroniser = new Map();
    this.typed = []; // characters on their way to the console
    this.typing = 0; // clocks until the next one is there
    const chip = (this.chip = new RP2040());
    chip.logger = new ConsoleLogger(LogLevel.Error, true);
    mend(chip.core);
    load(chip.flash, path);
    if (before) {
      chip.sram.set(before.chip.sram);
      this.watchdog.reason = before.watchdog.reason;
      this.watchdog.scratchData.set(before.watchdog.scratchData);
    }
    this.boot();
    this.machines = chip.pio.flatMap((pio) => {
      pio.run = () => {};
      return pio.machines.map((machine) => new Scheduled(machine));
    });
    const read = chip.dma.readUint32.bind(chip.dma);
    chip.dma.readUint32 = (offset) => (offset === DMA_CHAN_ABORT ? 0 : read(offset));
    let line = '';
    chip.uart[0].onByte = (byte) => {
      if (byte === 10) {
        print(line);
        line = '';
      } else {
        line += String.fromCharCode(byte);
      }
    };
  }

  /** As the ROM does: the second stage is checked, copied into RAM and entered. It sets up the flash and enters the image. */
  boot() {
    const { chip } = this;
    const stage = chip.flash.subarray(0, BOOT2_BYTES);
    const want = new DataView(stage.buffer, stage.byteOffset).getUint32(BOOT2_BYTES - 4, true);
    if (crc32(stage.subarray(0, BOOT2_BYTES - 4)) !== want) throw new Error(`${this.name}: boot2 has a wrong checksum`);
    chip.sram.set(stage, BOOT2_RAM - 0x20000000);
    chip.core.SP = BOOT2_RAM;
    chip.core.LR = 0;
    chip.core.PC = BOOT2_RAM;
  }

  get watchdog() {
    return this.chip.peripherals[WATCHDOG];
  }

  /** Goes on at a function. */
  jump(name) {
    this.chip.core.PC = symbol(this.path, name) & ~1;
    this.busy = 0;
  }

  /** Sends a line to the console. */
  type(text) {
    this.typed.push(...Buffer.from(`${text}\n`));
  }

  /** One clock of the system. */
  clock() {
    const { chip } = this;
    if (this.typed.length > 0 && --this.typing < 0) {
      chip.uart[0].feedByte(this.typed.shift());
      this.typing = CHARACTER_NS / this.ns;
    }
    if (this.busy > 0) {
      this.busy--;
    } else if (!chip.core.waiting || chip.core.interruptsUpdated) {
      this.busy = chip.core.executeInstruction() - 1;
      this.instructions++;
      if (chip.core.SP < this.deepest) this.deepest = chip.core.SP;
    }
    for (const scheduled of this.machines) if (scheduled.machine.enabled) scheduled.clock();
    chip.clock.tick(this.ns);
    for (const pio of chip.pio) pio.checkChangedPins();
  }

  /** The most stack that was in use so far, in bytes. */
  get stack() {
    return STACK_TOP - this.deepest;
  }

  /** Whether the pin is driven high. */
  output(pin) {
    const gpio = this.chip.gpio[pin];
    return gpio.outputEnable && gpio.outputValue;
  }

  /** The level at a pin, which the chip sees two clocks later. */
  input(pin, level) {
    let stages = this.synchroniser.get(pin);
    if (!stages) this.synchroniser.set(pin, (stages = [level, level]));
    const seen = stages.shift();
    stages.push(level);
    const gpio = this.chip.gpio[pin];
    if (gpio.rawInputValue !== seen) gpio.setInputValue(seen);
  }
}
