// A pair of wires between a master and an encoder, each with an RS-485 transceiver whose receiver is off while it drives.
// Records who drives and every edge, and hurts the line when asked to.
const [DI, DE, RO] = [2, 3, 4];
/** Longest delay of an answer in clocks, a power of two. */
const PAST = 1 << 14;

export class Wire {
  constructor(master, encoder) {
    this.master = master;
    this.encoder = encoder;
    this.t = 0;
    this.clashes = 0;
    this.edges = []; // [clock, level]
    this.drives = [[], []]; // of master and encoder: [from, to]
    this.level = true;
    this.on = [false, false];
    this.requests = 0;
    // What the encoder wanted to drive: bit 0 the level, bit 1 whether at all.
    this.past = new Uint8Array(PAST).fill(1);
    this.delay = 0; // clocks by which the encoder's driver is late
    this.deaf = false; // the encoder hears nothing, so it is silent
    this.disturb = null; // (clocks since the request began, level) => level
    this.onRequest = () => {};
    // Mistakes of the wiring: what becomes of the master's DE, of the level that the encoder drives and hears, and of the
    // master's receiver while it drives.
    this.mistakes = { enable: (on) => on, crossed: false, echo: false };
  }

  clock() {
    const { master, encoder, t } = this;
    master.clock();
    encoder.clock();
    const masterOn = this.mistakes.enable(master.output(DE));
    this.past[t % PAST] = (encoder.output(DE) ? 2 : 0) | (encoder.output(DI) ? 1 : 0);
    // Only what was wanted since the request began comes late.
    const wanted = t - this.delay < this.began ? 1 : this.past[(t + PAST - this.delay) % PAST];
    const encoderOn = wanted > 1;
    const { crossed, echo } = this.mistakes;
    if (masterOn && encoderOn) this.clashes++;
    let level = masterOn ? master.output(DI) : encoderOn ? ((wanted & 1) === 1) !== crossed : true;
    this.driver(0, masterOn);
    this.driver(1, encoderOn);
    if (this.disturb) level = this.disturb(t - this.began, level);
    if (level !== this.level) this.edges.push([t, level]);
    this.level = level;
    // A receiver that is off gives 1, by the pull-up at its output.
    master.input(RO, (masterOn && !echo) || level);
    // Nobody drives: 1, whichever way round the wires are.
    encoder.input(RO, encoderOn || this.deaf || (masterOn ? level !== crossed : level));
    this.t++;
  }

  driver(who, on) {
    if (on === this.on[who]) return;
    this.on[who] = on;
    if (!on) {
      this.drives[who].at(-1)[1] = this.t;
      return;
    }
    this.drives[who].push([this.t, Infinity]);
    if (who === 0) {
      this.began = this.t;
      this.onRequest(this.requests++);
    }
  }

  run(clocks) {
    for (const end = this.t + clocks; this.t < end; ) this.clock();
  }

  /** The edges from one clock to another. */
  between(from, to) {
    const first = this.edges.findIndex(([at]) => at >= from);
    if (first < 0) return [];
    const last = this.edges.findIndex(([at]) => at > to);
    return this.edges.slice(first, last < 0 ? undefined : last);
  }
}

/**
 * Start-stop units of `bits` bits at `clocks` clocks a bit in a line that was idle before: `value`, `at` (the clock of the
 * start bit), and `framed`.
 */
export function units(edges, bits, clocks) {
  const level = (t) => edges.findLast(([at]) => at <= t)?.[1] ?? true;
  const found = [];
  let after = -1;
  for (const [at, high] of edges) {
    if (high || at < after) continue;
    const middle = (k) => at + k * clocks + clocks / 2;
    let value = 0;
    for (let k = 0; k < bits; k++) value += level(middle(1 + k)) ? 2 ** k : 0;
    found.push({ value, at, framed: level(middle(1 + bits)) });
    after = middle(1 + bits);
  }
  return found;
}
