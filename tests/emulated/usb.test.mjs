// The console of a master at its USB port, and what becomes of a panic.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip } from './chip.mjs';
import { HZ, IMAGES } from './pair.mjs';
import { UsbHost } from './usb.mjs';
import { Wire } from './wire.mjs';

const MS = HZ / 1000;

/** A master whose consoles are listened to, and an encoder at the other end of its line. */
class Bench {
  constructor(image, encoder, before = null) {
    this.uart = [];
    this.bytes = '';
    this.master = new Chip(image, IMAGES + image, { hz: HZ, before, print: (text) => this.uart.push(text) });
    this.host = new UsbHost(this.master.chip, (bytes) => (this.bytes += Buffer.from(bytes).toString('latin1')));
    this.wire = new Wire(this.master, new Chip(encoder, IMAGES + encoder, { hz: HZ }));
  }

  /** Lines of the port that have ended. */
  get usb() {
    return this.bytes.split('\n').slice(0, -1);
  }

  /** Until `done`, at most for so many ms. */
  until(ms, done) {
    for (const end = this.wire.t + ms * MS; !done(); ) {
      assert.ok(this.wire.t < end, `not within ${ms} ms\nUART ${this.uart.join('\n')}\nUSB ${this.bytes}`);
      this.wire.run(1_000);
    }
  }
}

for (const [image, encoder, typed, answer] of [
  ['tformat-master', 'tformat-encoder', 'read 5', 'EEPROM 05: ff'],
  ['aformat-master', 'aformat-encoder', 'read 0', 'EEPROM 00: ffff'],
]) {
  test(`${image} at a USB port`, () => {
    const bench = new Bench(image, encoder);
    bench.until(40, () => bench.usb.length > 6);
    assert.equal(bench.host.product, image);
    const [first, ...rest] = bench.usb;
    assert.equal(first, bench.uart[0]);
    // From a line on both say the same; the ports are not equally fast.
    const same = bench.uart.indexOf(rest[0]);
    assert.ok(same > 0 && /^turn 7, \d+ counts at \d+ ns, \d+ good, 0 bad$/.test(rest[0]), rest.join('\n'));
    const count = Math.min(rest.length, bench.uart.length - same);
    assert.ok(count >= 5);
    assert.deepEqual(rest.slice(0, count), bench.uart.slice(same, same + count));
    bench.host.send(`${typed}\n`);
    bench.until(20, () => bench.usb.includes(answer));
    assert.equal(bench.wire.clashes, 0);
    console.log(`${image}: the port is open, ${rest.length} lines, ${typed}: ${answer}`);
  });

  test(`${image} in a panic`, () => {
    const { master, wire, uart, ...bench } = new Bench(image, encoder);
    wire.run(4 * MS);
    assert.ok(uart.some((line) => line.startsWith('turn ')), uart.join('\n'));
    // A second start, as of a program that has lost its way: what is there once cannot be taken.
    master.jump('main');
    wire.run(4 * MS);
    const at = uart.findIndex((line) => line.startsWith('panicked at '));
    assert.match(uart[at], /^panicked at src\/board\.rs:\d+:\d+:$/);
    assert.equal(uart[at + 1], 'called once');
    assert.equal(uart.length, at + 2, 'nothing more');
    // It stands still, and the driver is off.
    assert.ok(wire.on.every((on) => !on));
    const requests = wire.requests;
    wire.run(MS);
    assert.equal(wire.requests, requests);
    let waited = 0;
    let triggered = false;
    master.watchdog.onWatchdogTrigger = () => {
      triggered = true;
      // The emulator's would come again at once, without an end.
      master.watchdog.alarm.enable = false;
    };
    for (; !triggered && waited < 2_000; waited++) master.chip.clock.tick(1e6);
    assert.ok(waited > 900 && waited <= 1_000, `the watchdog came after ${waited} ms`);
    const again = new Bench(image, encoder, master);
    again.until(40, () => again.usb.length > 3);
    const before = `the watchdog has restarted this image: ${uart[at]} called once`;
    for (const [first, second, third] of [again.uart, again.usb]) {
      assert.equal(first, uart[0]);
      assert.equal(second, before);
      assert.match(third, /^(turn 7, |fault: no response)/);
    }
    console.log(`${image}: ${uart[at]} ${uart[at + 1]}; begun again after ${waited} ms`);
  });
}
