"""How long an interrupt can be, from the disassembly of an image.

    python3 interrupts.py OBJDUMP IMAGE HANDLER

The instructions of the longest way through a handler and all that it calls. A loop, or a call through a register, has no such number and
is an error; a way that ends in a panic is none. Instructions that an `it` makes conditional all count.
"""

import functools
import pathlib
import re
import struct
import subprocess
import sys

import stack
from report import FUNCTION, INSTRUCTION, PANIC, TARGET  # where stack.py has put it

CONDITIONS = "eq ne hs lo cs cc mi pl vs vc hi ls ge lt gt le".split()
ENDS = re.compile(r"^(bx lr|(pop|ldm|ldmia) .*\bpc\b|ldr pc, \[sp\]|udf)")
INDIRECT = re.compile(r"^((blx|bx)\w* (r\d+|ip|r12)\b|(mov|add)\w* pc,|tb[bh] )")
# Stack pointer, reset, NMI and HardFault come before the vectors of which an image has handlers.
FIRST = 3


def code(objdump, path):
    """Instructions in order: address, mnemonic, operands; and the functions by the address at which they begin."""
    command = [objdump, "--disassemble", "--demangle", "--no-show-raw-insn", str(path)]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    instructions, names = [], {}
    for line in text.splitlines():
        if head := FUNCTION.match(line):
            names[int(head[1], 16)] = head[2]
        elif (body := INSTRUCTION.match(line)) and body[2] != ".word":
            instructions.append((int(body[1], 16), re.sub(r"\.[wn]$", "", body[2]), body[3]))
    return instructions, names


class Image:
    def __init__(self, objdump, path):
        instructions, self.names = code(objdump, path)
        following = [at for at, *_ in instructions[1:]] + [None]
        self.at = {at: (what, operands, after) for (at, what, operands), after in zip(instructions, following)}
        self.open = set()
        self.longest = functools.cache(self.way)
        self.by_name = {name: at for at, name in self.names.items()}
        self.vectors = next(
            ([word for (word,) in struct.iter_unpack("<I", content)] for name, _, content in stack.sections(path.read_bytes()) if name == ".vector_table"),
            [],
        )

    def handlers(self):
        """Vectors that lead somewhere of their own: exceptions and interrupts for which an image has a handler."""
        rest = [vector for vector in self.vectors[FIRST + 1 :] if vector]
        default = max(set(rest), key=rest.count, default=0)
        return {self.names.get(vector & ~1, hex(vector)) for vector in rest if vector != default} - {"HardFault", "HardFaultTrampoline", "_HardFault"}

    def way(self, start):
        """Instructions from here to the end of the function, on the longest way; `None` if every way ends in a panic."""
        assert start not in self.open, f"a loop at {start:#x}"
        self.open.add(start)
        what, operands, after = self.at[start]
        text = f"{what} {operands}"
        assert not INDIRECT.match(text), f"{start:#x}: {text}: not known where to"
        found = TARGET.search(operands)
        target = int(found[1], 16) if found and what.startswith(("b", "cb")) and not what.startswith(("bic", "bfi", "bfc")) else None
        ways, own = [], 1
        if target is not None and what in ("bl", "blx"):
            called = None if PANIC.search(self.names.get(target, "")) else self.longest(target)
            if called is not None:
                own += called
                ways.append(self.longest(after))
        elif target is not None:
            ways.append(None if PANIC.search(self.names.get(target, "")) else self.longest(target))
            if what != "b":
                ways.append(self.longest(after))
        elif what.startswith("udf"):
            ways.append(None)
        elif ENDS.match(text):
            ways.append(0)
        elif any(ENDS.match(text.replace(condition, "", 1)) for condition in CONDITIONS if what.endswith(condition)):
            ways += [0, self.longest(after)]
        else:
            ways.append(self.longest(after))
        self.open.remove(start)
        ways = [way for way in ways if way is not None]
        return own + max(ways) if ways else None


def longest(objdump, path, handler):
    """Instructions of the longest way through a handler."""
    sys.setrecursionlimit(20_000)
    image = Image(objdump, path)
    return image.longest(image.by_name[handler])


def main():
    objdump, path, handler = sys.argv[1:]
    print(f"{handler}: at most {longest(objdump, pathlib.Path(path), handler)} instructions")


if __name__ == "__main__":
    main()
