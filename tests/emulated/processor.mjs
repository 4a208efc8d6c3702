// What rp2040js 1.4.1 gets wrong of the processor.
//
// ADCS and SBCS add the carry to one of the operands before they look at its sign. From 0x7fffffff that leads to 0x80000000, a
// negative number, and V is wrong: a comparison of 64 or 128 bits with the greatest number there is goes wrong.

const NEGATIVE = 0x80000000;
/** The opcodes, without their registers. */
const ADCS = 0b0100000101;
const SBCS = 0b0100000110;

/** Has a processor, a `core` of rp2040js, set V as it has to. */
export function mend(core) {
  const { addUpdateFlags, substractUpdateFlags } = core;
  const executes = (opcode) => core.rp2040.readUint16((core.PC - 2) >>> 0) >> 6 === opcode;
  core.addUpdateFlags = (to, and) => {
    const carried = core.C && and === NEGATIVE && executes(ADCS);
    const sum = addUpdateFlags.call(core, to, and);
    if (carried) core.V = (to & NEGATIVE) === 0;
    return sum;
  };
  core.substractUpdateFlags = (from, what) => {
    const borrowed = !core.C && what === NEGATIVE && executes(SBCS);
    const difference = substractUpdateFlags.call(core, from, what);
    if (borrowed) core.V = (from & NEGATIVE) !== 0;
    return difference;
  };
}
