// node compare.mjs MODULE FOLDER: what the wasm module says of each N.in has to be N.out.
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

const [module, folder] = process.argv.slice(2);
const compiled = new WebAssembly.Module(readFileSync(module));
const imports = WebAssembly.Module.imports(compiled);
if (imports.length > 0) {
    console.error("the module needs something of its host:", imports);
    process.exit(1);
}

let instance = new WebAssembly.Instance(compiled, {});
// The first line is the name.
const parts = (file) => {
    const bytes = readFileSync(file);
    const at = bytes.indexOf(10);
    return [bytes.subarray(0, at), bytes.subarray(at + 1)];
};

function decode(name, capture) {
    const { memory, reserve, decode, length } = instance.exports;
    const input = Buffer.concat([name, capture]);
    try {
        const at = reserve(input.length) >>> 0;
        new Uint8Array(memory.buffer).set(input, at);
        const text = decode(name.length) >>> 0;
        return Buffer.from(memory.buffer, text, length() >>> 0);
    } catch (trap) {
        if (!(trap instanceof WebAssembly.RuntimeError)) throw trap;
        // Nothing is known of its memory after a panic.
        instance = new WebAssembly.Instance(compiled, {});
        return Buffer.from("panic");
    }
}

const files = readdirSync(folder).filter((file) => file.endsWith(".in"));
let different = 0;
let panics = 0;
for (const file of files) {
    const due = parts(join(folder, file.replace(/in$/, "out")))[1];
    const said = decode(...parts(join(folder, file)));
    panics += due.equals(Buffer.from("panic"));
    if (!said.equals(due)) {
        different += 1;
        console.error(`${join(folder, file)}: ${said.length} bytes on wasm, ${due.length} natively`);
    }
}
console.log(`${files.length} captures on wasm, ${different} differ, ${panics} of damaged FST end in a panic on both`);
process.exit(different === 0 && files.length > 300 ? 0 : 1);
