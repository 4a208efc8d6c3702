// A USB host at an emulated RP2040: it enumerates a serial port (CDC), opens it, and carries bytes both ways.
//
// rp2040js completes packets at once and forgets what the image armed before it was asked for. Here a buffer is the image's until its
// packet is over, one packet at a time, at 12 Mbit/s.
const BUFFERS = 0x80; // of EP0 IN; OUT is 4 bytes behind, the next endpoint 8
const [AVAILABLE, STALL, FULL, LENGTH] = [1 << 10, 1 << 11, 1 << 15, 0x3ff];
const PULL_UP = 1 << 16; // in SIE_CTRL
const PACKET = 64;
/** Token, handshake and gaps of a packet, in bytes: 19 packets of 64 bytes fit into a millisecond. */
const AROUND = 13;
const [DEVICE, CONFIGURATION, STRING] = [1, 2, 3];

/** Eight bytes of a request. */
const setup = (type, request, value, length) => [type, request, value & 255, value >> 8, 0, 0, length & 255, length >> 8];
const descriptor = (kind, number, length) => {
  const asked = setup(0x80, 6, (kind << 8) | number, length);
  return kind === STRING ? [...asked.slice(0, 4), 0x09, 0x04, ...asked.slice(6)] : asked;
};

export class UsbHost {
  /** `heard` is called with the bytes of each packet of the port. */
  constructor(chip, heard) {
    this.chip = chip;
    this.usb = chip.usbCtrl;
    this.heard = heard;
    this.open = false; // the port
    this.product = '';
    this.outgoing = [];
    this.armed = new Set(); // OUT endpoints with a buffer for us
    this.free = 0; // when the bus is, ns
    const control = this.usb.handleSieCtrlWrite.bind(this.usb);
    this.usb.handleSieCtrlWrite = (value) => {
      control(value);
      if (value & PULL_UP && !this.steps) {
        this.steps = this.enumerate();
        this.after(50_000, () => this.usb.resetDevice());
      }
    };
    this.usb.onResetReceived = () => this.next();
    this.usb.DPRAMUpdated = (offset, value) => this.buffer(offset, value);
  }

  /** To the port. */
  send(text) {
    this.outgoing.push(...Buffer.from(text));
    this.deliver();
  }

  after(ns, act) {
    this.chip.clock.createAlarm(act).schedule(ns);
  }

  packet(bytes, act) {
    this.free = Math.max(this.chip.clock.nanos, this.free) + ((bytes + AROUND) * 8 * 1000) / 12;
    this.after(this.free - this.chip.clock.nanos, act);
  }

  /** What a host asks of a new device, request by request; each gives what was read. */
  *enumerate() {
    yield { request: descriptor(DEVICE, 0, 18) };
    yield { request: setup(0, 5, 7, 0) }; // its address
    const device = yield { request: descriptor(DEVICE, 0, 18) };
    const configuration = yield { request: descriptor(CONFIGURATION, 0, 255) };
    this.endpoints(configuration);
    const product = yield { request: descriptor(STRING, device[15], 255) };
    this.product = Buffer.from(product.slice(2)).toString('utf16le');
    yield { request: setup(0, 9, 1, 0) };
    yield { request: setup(0x21, 0x20, 0, 7), data: [0x00, 0xc2, 0x01, 0, 0, 0, 8] }; // 115,200 baud, 8N1
    yield { request: setup(0x21, 0x22, 3, 0) }; // DTR and RTS: somebody has opened the port
  }

  /** The endpoints of the data interface, whose class is 10. */
  endpoints(bytes) {
    let data = false;
    for (let at = 0; at < bytes.length; at += bytes[at]) {
      if (bytes[at + 1] === 4) data = bytes[at + 5] === 10;
      if (bytes[at + 1] !== 5 || !data) continue;
      if (bytes[at + 2] & 0x80) this.in = bytes[at + 2] & 15;
      else this.out = bytes[at + 2];
    }
  }

  /** The next request, a frame later or so. */
  next() {
    const { value, done } = this.steps.next(this.read);
    if (done) {
      this.open = true;
      this.deliver();
      return;
    }
    this.request = value;
    this.read = [];
    const reads = value.request[0] & 0x80;
    this.phase = reads ? 'read' : value.data ? 'write' : 'written';
    this.after(30_000, () => {
      this.armed.delete(0);
      this.usb.sendSetupPacket(Uint8Array.from(value.request));
    });
  }

  /** The image has written a buffer control. */
  buffer(offset, value) {
    if (offset < BUFFERS || offset >= BUFFERS + 0x80) return;
    const endpoint = (offset - BUFFERS) >> 3;
    if (endpoint === 0 && value & STALL) throw new Error(`stalled: ${this.request?.request}`);
    if (!(value & AVAILABLE)) return;
    if (offset & 4) {
      this.armed.add(endpoint);
      this.deliver();
      return;
    }
    const [from, length] = [this.usb.getEndpointBufferOffset(endpoint, false), value & LENGTH];
    this.packet(length, () => {
      const bytes = this.chip.usbDPRAM.slice(from, from + length);
      this.change(offset, AVAILABLE | FULL, 0);
      this.usb.indicateBufferReady(endpoint, false);
      this.take(endpoint, bytes);
    });
  }

  change(offset, clear, set) {
    const view = this.chip.usbDPRAMView;
    view.setUint32(offset, (view.getUint32(offset, true) & ~clear) | set, true);
  }

  /** A packet from the device. */
  take(endpoint, bytes) {
    if (endpoint === this.in) this.heard(bytes);
    if (endpoint !== 0) return;
    if (this.phase === 'written') {
      this.next();
    } else if (this.phase === 'read') {
      this.read.push(...bytes);
      if (bytes.length < PACKET || this.read.length >= this.request.request[6]) this.phase = 'acknowledge';
      this.deliver();
    }
  }

  /** Packets to buffers that wait for them. */
  deliver() {
    if (this.armed.has(0) && this.phase === 'write') {
      this.phase = 'written';
      this.give(0, this.request.data);
    } else if (this.armed.has(0) && this.phase === 'acknowledge') {
      this.phase = '';
      this.give(0, []);
      this.next();
    }
    if (this.open && this.armed.has(this.out) && this.outgoing.length > 0) {
      this.give(this.out, this.outgoing.splice(0, PACKET));
    }
  }

  give(endpoint, bytes) {
    this.armed.delete(endpoint);
    const offset = BUFFERS + 8 * endpoint + 4;
    this.packet(bytes.length, () => {
      this.chip.usbDPRAM.set(bytes, this.usb.getEndpointBufferOffset(endpoint, true));
      this.change(offset, AVAILABLE | LENGTH, FULL | bytes.length);
      this.usb.indicateBufferReady(endpoint, true);
    });
  }
}
