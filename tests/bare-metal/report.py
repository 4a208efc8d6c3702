#!/usr/bin/env python3
"""What run.sh says about an image: instruction counts against budget.toml, code size, paths to a panic.

    report.py table OBJDUMP IMAGES [--record]   the table; exit code 1 when something is over budget or can panic
    report.py walk  OBJDUMP IMAGE SYMBOL        the path from SYMBOL to a panic; exit code 1 when there is one

IMAGES holds PROTOCOL-O3.elf, PROTOCOL-O3.txt and the same for Os: each image and what it printed. PROTOCOL-M0 is there for
some protocols: opt-level 3 for the Cortex-M0+.
"""

import pathlib
import re
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).parent
BUDGET = HERE / "budget.toml"
LEVELS = ("O3", "Os", "M0")
# Levels at which the walk is made. On ARMv6-M jump tables are branches through a register, which it cannot follow.
WALKED = ("O3", "Os")
BAND = 0.02
# SysTick counts 40 instructions a tick: over 2048 calls nothing finer can be told.
GRAIN = 0.2

FUNCTION = re.compile(r"^([0-9a-f]+) <(.+)>:$")
INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\s+(?:[0-9a-f]{2} )*\s*(\S+)\s*(.*)$")
TARGET = re.compile(r"\b0x([0-9a-f]+) <")
HALF = re.compile(r"^(\w+), #(0x[0-9a-f]+|\d+)")
PANIC = re.compile(r"\bpanicking\b|rust_begin_unwind|panic_(fmt|handler|bounds|const)")


class Function:
    """A function of the image, from the disassembly."""

    def __init__(self, name, start):
        self.name, self.start, self.end = name, start, start
        self.targets = set()  # addresses that it branches to or calls
        self.pointers = set()  # addresses of code that it forms in registers or keeps in its literal pool
        self.indirect = []  # calls and branches through a register


class Image:
    """The call graph of an image."""

    def __init__(self, objdump, path):
        command = [objdump, "--disassemble", "--demangle", "--no-show-raw-insn", str(path)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        self.functions = list(parse(text))
        self.by_start = {f.start: f for f in self.functions}
        self.by_name = {f.name: f for f in self.functions}

    def callees(self, function):
        """The functions that `function` can continue in: calls, tail calls, and code whose address it takes."""
        for target in function.targets:
            callee = self.at(target)
            if callee and callee is not function:
                yield callee
        for pointer in function.pointers:
            callee = self.by_start.get(pointer & ~1) if pointer & 1 else None
            if callee and callee is not function:
                yield callee

    def at(self, address):
        """The function that holds `address`: a call goes to its start, a tail of it may be shared."""
        return self.by_start.get(address) or next((f for f in self.functions if f.start <= address < f.end), None)

    def reach(self, symbol):
        """Everything that can run in `symbol`, as {function: its caller}."""
        found = {self.by_name[symbol]: None}
        todo = list(found)
        while todo:
            function = todo.pop()
            for callee in self.callees(function):
                if callee not in found:
                    found[callee] = function
                    todo.append(callee)
        return found

    def fault(self, symbol):
        """Why `symbol` cannot be said to be free of panics, as a path of names; None if it is."""
        if symbol not in self.by_name:
            return f"{symbol} is no function of the image"
        found = self.reach(symbol)
        for function in found:
            if PANIC.search(function.name):
                return path_to(found, function)
            if function.indirect:
                return path_to(found, function) + f" -> ({function.indirect[0]}: not known where to)"
        return None

    def size(self, symbol):
        """Bytes of `symbol` and of all that it calls."""
        return sum(f.end - f.start for f in self.reach(symbol)) if symbol in self.by_name else 0


def parse(text):
    """The functions of a disassembly."""
    function, halves, branch = None, {}, None
    for line in text.splitlines():
        if head := FUNCTION.match(line):
            start = int(head[1], 16)
            if function:
                function.end = min(start, function.end + 4)
                yield function
            function, halves, branch = Function(head[2], start), {}, None
        elif function and (body := INSTRUCTION.match(line)):
            function.end = int(body[1], 16)
            # The linker fills the gap behind a function with d4d4, which reads as a conditional branch; no function ends in one.
            if branch:
                read(function, *branch, halves)
            branch = (body[2], body[3]) if body[2] == "bmi" else None
            if not branch:
                read(function, body[2], body[3], halves)
    if function:
        function.end += 4
        yield function


def read(function, mnemonic, operands, halves):
    """Notes where one instruction can lead. `halves` are the low halves of constants being formed."""
    mnemonic = mnemonic.removesuffix(".w")
    if mnemonic == ".word":
        function.pointers.add(int(operands.split()[0], 0))
    elif mnemonic in ("movw", "movt") and (half := HALF.match(operands)):
        if mnemonic == "movw":
            halves[half[1]] = int(half[2], 0)
        elif half[1] in halves:
            function.pointers.add(halves[half[1]] | int(half[2], 0) << 16)
    elif re.match(r"(blx|bx)\w* r\d+|(blx|bx)\w* (ip|r12)", f"{mnemonic} {operands}") or re.match(
        r"(ldr|mov|add)\w* pc,", f"{mnemonic} {operands}"
    ):
        function.indirect.append(f"{mnemonic} {operands}")
    elif target := TARGET.search(operands):
        function.targets.add(int(target[1], 16))


def path_to(found, function):
    """The names from the kernel down to `function`."""
    names = []
    while function:
        names.append(re.sub(r"::h[0-9a-f]{16}$", "", function.name))
        function = found[function]
    return " -> ".join(reversed(names))


class Run:
    """An image and what it printed."""

    def __init__(self, objdump, path):
        self.name, self.image = path.stem, Image(objdump, path.with_suffix(".elf"))
        lines = [line.split("\t") for line in path.read_text().splitlines()]
        self.topics = {line[1]: (int(line[2]), int(line[3])) for line in lines if line[0] == "self-test"}
        self.kernels = {line[1]: float(line[2]) for line in lines if line[0] == "kernel"}
        self.stacks = {line[1]: int(line[2]) for line in lines if line[0] == "stack"}
        self.faults = [f"self-test {topic}: {bad} rows differ" for topic, (_, bad) in self.topics.items() if bad]
        if lines[-1:] != [["end"]]:
            self.faults.append("the image did not come to its end: " + " ".join(lines[-1] if lines else ["no output"]))
        if not self.topics or not (self.kernels or self.stacks):
            self.faults.append("nothing was tested")


def judge(kernel, level, count, entry, same_compiler):
    """(fault, hint) about one figure."""
    if not entry:
        return f"{kernel}: not in budget.toml; run.sh --record enters it", None
    recorded, limit = entry.get(level), entry.get(f"limit_{level}")
    if limit and count > limit:
        return f"{kernel}: {count} instructions at {level}, the budget is {limit}", None
    if recorded is None:
        return f"{kernel}: {level} is not in budget.toml; run.sh --record enters it", None
    band = max(recorded * BAND, GRAIN)
    if count > recorded + band and same_compiler:
        return f"{kernel}: {count} instructions at {level}, {recorded} are recorded", None
    if abs(count - recorded) > band:
        return None, f"{kernel}: {count} instructions at {level}, {recorded} are recorded: run.sh --record"
    return None, None


class Level:
    """All images at one opt-level."""

    def __init__(self, objdump, folder, name):
        self.runs = [Run(objdump, path) for path in sorted(folder.glob(f"*-{name}.txt"))]
        self.kernels = {kernel: count for run in self.runs for kernel, count in run.kernels.items()}
        self.images = {kernel: run.image for run in self.runs for kernel in run.kernels}
        self.faults = [f"{run.name}: {fault}" for run in self.runs for fault in run.faults]


def record(levels, compiler):
    """Writes the present figures into budget.toml, in the order of the images; the limits and the head stay."""
    text = BUDGET.read_text()
    limits = tomllib.loads(text)["kernels"]
    head = re.sub(r'^rustc = ".*"$', f'rustc = "{compiler}"', text[: text.index("[kernels]")], flags=re.M)
    lines = []
    for kernel in levels["O3"].kernels:
        figures = {name: level.kernels[kernel] for name, level in levels.items() if kernel in level.kernels}
        figures |= {key: value for key, value in limits.get(kernel, {}).items() if key.startswith("limit_")}
        lines.append(f"{kernel} = {{ " + ", ".join(f"{key} = {value}" for key, value in figures.items()) + " }\n")
    BUDGET.write_text(head + "[kernels]\n" + "".join(lines))


def stacks(levels, limits):
    """Prints the stack of calls, deepest point in bytes; yields what is wrong."""
    print("bytes of stack of the calls, without the state machine itself and the caller's buffers")
    print("{:34} {:>8} {:>8} {:>11}".format("calls", "O3", "Os", "budget"))
    deepest = {}
    for name, level in levels.items():
        for run in (run for run in level.runs if run.stacks):
            known = run.stacks.pop("known_1000", 0)
            if not 1000 <= known < 1200:
                yield f"{run.name}: the stack of an array of 1000 bytes is measured as {known}"
            for calls, count in run.stacks.items():
                deepest.setdefault(calls, {})[name] = count
    for calls, counts in deepest.items():
        limit = limits.get(calls, 0)
        print("{:34} {:>8} {:>8} {:>11}".format(calls, *counts.values(), limit))
        yield from (f"{calls}: {n} bytes of stack at {level}, the budget is {limit}" for level, n in counts.items() if n > limit)
    yield from (f"{calls}: in budget.toml, but not measured" for calls in limits.keys() - deepest.keys())
    print()


ROW = "{:34} {:>8} {:>8} {:>8} {:>17} {:>7} {:>7}  {}"


def line(kernel, levels, entry, panics):
    """A line of the table."""
    counts = [level.kernels.get(kernel, "-") for level in levels.values()]
    sizes = [levels[name].images[kernel].size(kernel) for name in WALKED]
    limits = [str(entry.get(f"limit_{name}", "-")) for name in levels]
    bound = " / ".join(limits).removesuffix(" / -") if set(limits) != {"-"} else "-"
    return ROW.format(kernel, *counts, bound, *sizes, "YES" if panics else "no")


def table(objdump, folder, recording):
    """Prints the table; whether all is well."""
    levels = {name: Level(objdump, folder, name) for name in LEVELS}
    compiler = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    if recording:
        record(levels, compiler)
    budget = tomllib.loads(BUDGET.read_text())
    same_compiler = budget["rustc"] == compiler
    kernels = levels["O3"].kernels

    faults = [f"{name}: {fault}" for name, level in levels.items() for fault in level.faults]
    gone = budget["kernels"].keys() - kernels.keys()
    faults += [f"{kernel}: in budget.toml, but not in the image" for kernel in sorted(gone)]
    hints = [] if same_compiler else [f"figures are recorded for rustc {budget['rustc']}: only the budgets bind"]

    for run in levels["O3"].runs:
        for topic, (passed, failed) in run.topics.items():
            print(f"self-test {topic}: {passed} passed, {failed} failed")
    print()
    print("instructions on a Cortex-M4 (M0: on a Cortex-M0+, opt-level 3) without those of an empty call; bytes of the")
    print("function and all that it calls at O3 and Os")
    print(ROW.format("kernel", "O3", "Os", "M0", "budget", "bytes", "Os", "panic path"))
    for kernel in kernels:
        entry = budget["kernels"].get(kernel)
        paths = {name: levels[name].images[kernel].fault(kernel) for name in WALKED}
        faults += [f"{kernel} can panic at {name}: {path}" for name, path in paths.items() if path]
        for name, level in levels.items():
            if kernel not in level.kernels:
                continue
            fault, hint = judge(kernel, name, level.kernels[kernel], entry, same_compiler)
            faults += [fault] if fault else []
            hints += [hint] if hint else []
        print(line(kernel, levels, entry or {}, any(paths.values())))
    print()
    faults += stacks(levels, budget.get("stack", {}))
    for hint in hints:
        print(f"note: {hint}")
    for fault in faults:
        print(f"FAILED: {fault}")
    return not faults


def main():
    match sys.argv[1:]:
        case ["table", objdump, folder]:
            return table(objdump, pathlib.Path(folder), recording=False)
        case ["table", objdump, folder, "--record"]:
            return table(objdump, pathlib.Path(folder), recording=True)
        case ["walk", objdump, image, symbol]:
            fault = Image(objdump, image).fault(symbol)
            print(fault or f"{symbol}: no path to a panic")
            return not fault
    sys.exit(__doc__)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
