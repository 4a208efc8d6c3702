"""The deepest that a stack can be, from the disassembly of an image.

    python3 stack.py OBJDUMP IMAGE...

Every function takes what its pushes and its `sub sp` take together, and what the deepest function takes that it may call. What is
called through a register may be any function whose address is taken anywhere. Where calls go in a circle, as formatting does, each
function of the circle is counted twice: values that are formatted format others, and those only numbers. One interrupt is added, the
deepest, with the frame that the processor pushes; all interrupts of these images have one priority.
"""

import pathlib
import re
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "bare-metal"))
from report import FUNCTION, INSTRUCTION, Image  # noqa: E402

PUSHED = re.compile(r"\{([^}]*)\}")
LOWERED = re.compile(r"^sp(?:, sp)?, #(0x[0-9a-f]+|\d+)$")
PRE_INDEXED = re.compile(r"\[sp, #-(0x[0-9a-f]+|\d+)\]!")
LITERAL = re.compile(r"^(r\d+), \[pc.*0x([0-9a-f]+)")
# What an exception pushes: eight words and one to align; with a floating-point unit eighteen more.
EXCEPTION, EXCEPTION_FLOAT = 36, 36 + 72


def registers(text, width):
    """Bytes of a list of registers such as `r4, r5, lr` or `d8-d11`."""
    count = 0
    for item in PUSHED.search(text)[1].split(","):
        first, _, last = item.strip().partition("-")
        count += int(last[1:]) - int(first[1:]) + 1 if last else 1
    return count * width


def frames(text):
    """Bytes of stack that each function takes by itself, by its address."""
    sizes, literals, words, pending, start = {}, {}, {}, [], None
    for line in text.splitlines():
        if head := FUNCTION.match(line):
            start = int(head[1], 16)
            sizes[start], literals = 0, {}
            continue
        body = INSTRUCTION.match(line)
        if not body or start is None:
            continue
        address, mnemonic, operands = int(body[1], 16), body[2].removesuffix(".w"), body[3].split("@")[0].strip()
        if mnemonic == ".word":
            words[address] = int(operands.split()[0], 0)
        elif mnemonic == "push" or (mnemonic.startswith("stmdb") and operands.startswith("sp!")):
            sizes[start] += registers(operands, 4)
        elif mnemonic == "vpush":
            sizes[start] += registers(operands, 8 if "d" in operands else 4)
        elif mnemonic.startswith("sub") and (lowered := LOWERED.match(operands)):
            sizes[start] += int(lowered[1], 0)
        elif mnemonic.startswith("str") and (lowered := PRE_INDEXED.search(operands)):
            sizes[start] += int(lowered[1], 0)
        elif mnemonic.startswith("ldr") and (literal := re.match(r"^(r\d+), \[pc", operands)):
            place = re.search(r"0x([0-9a-f]+) <", body[3])
            if place:
                literals[literal[1]] = int(place[1], 16)
        elif mnemonic == "add" and (added := re.match(r"^sp, (r\d+)$", operands)):
            # A large frame: a negative literal is added; a positive one takes it back.
            pending.append((start, literals.get(added[1])))
        elif re.match(r"^(add|mov)\w*$", mnemonic) and operands.startswith("sp, r") and mnemonic != "add":
            continue  # back from a frame pointer
    for start, place in pending:
        assert place in words, f"{start:#x}: a frame whose size is not known"
        lowered = (1 << 32) - words[place]
        sizes[start] += lowered if lowered < 1 << 31 else 0
    return sizes


def sections(data):
    """Name, address and bytes of the sections that are loaded."""
    at, size, count, names = (struct.unpack_from(kind, data, at)[0] for kind, at in (("<I", 32), ("<H", 46), ("<H", 48), ("<H", 50)))
    heads = [struct.unpack_from("<10I", data, at + k * size) for k in range(count)]
    for name, kind, flags, address, offset, length, *_ in heads:
        if kind == 1 and flags & 2:
            label = data[heads[names][4] + name :].split(b"\0", 1)[0].decode()
            yield label, address, data[offset : offset + length]


class Graph:
    """Who may call whom, and how much stack each takes."""

    def __init__(self, objdump, path):
        self.image = Image(objdump, path)
        command = [objdump, "--disassemble", "--demangle", "--no-show-raw-insn", str(path)]
        self.frames = frames(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        taken = set()
        for name, _, content in sections(pathlib.Path(path).read_bytes()):
            words = [word for (word,) in struct.iter_unpack("<I", content[: len(content) & ~3])]
            if name == ".vector_table":
                self.reset, *self.handlers = words[1:]
            elif name != ".text":
                taken |= set(words)
        for function in self.image.functions:
            taken |= function.pointers
        functions = self.image.by_start
        self.taken = [functions[word & ~1] for word in taken if word & 1 and word & ~1 in functions]
        # Writing the program counter in another way is a jump table.
        calls = [f for f in self.image.functions if any(call.startswith(("bl", "bx")) for call in f.indirect)]
        self.edges = {f: set(self.image.callees(f)) | set(self.taken if f in calls else ()) for f in self.image.functions}

    def circles(self):
        """Each function's circle of calls, by Tarjan's algorithm; those that are called come first."""
        number, low, on, stack, found, ordered = {}, {}, set(), [], {}, []
        for root in self.edges:
            work = [(root, None)] if root not in number else []
            while work:
                function, rest = work.pop()
                if rest is None:
                    number[function] = low[function] = len(number)
                    stack.append(function)
                    on.add(function)
                    rest = iter(self.edges[function])
                for callee in rest:
                    if callee not in number:
                        work += [(function, rest), (callee, None)]
                        break
                    if callee in on:
                        low[function] = min(low[function], low[callee])
                else:
                    if low[function] == number[function]:
                        circle = set()
                        while function not in circle:
                            circle.add(stack.pop())
                        on -= circle
                        ordered.append(circle)
                        found |= dict.fromkeys(circle, len(ordered) - 1)
                    if work:
                        low[work[-1][0]] = min(low[work[-1][0]], low[function])
        return found, ordered

    def deepest(self):
        """(bytes of the program, bytes of the deepest interrupt)."""
        place, ordered = self.circles()
        depth = []
        for number, circle in enumerate(ordered):
            called = {place[callee] for f in circle for callee in self.edges[f]} - {number}
            own = sum(self.frames[f.start] for f in circle) * (2 if len(circle) > 1 else 1)
            depth.append(own + max((depth[callee] for callee in called), default=0))
        of = {f.start | 1: depth[place[f]] for f in self.image.functions}
        return of[self.reset], max(of.get(handler, 0) for handler in self.handlers)


def bound(objdump, path):
    """The deepest that the stack of an image can be, in bytes."""
    program, interrupt = Graph(objdump, path).deepest()
    # Whether the processor has a floating-point unit, by the flags of the file.
    data = pathlib.Path(path).read_bytes()
    has_float = struct.unpack_from("<I", data, 36)[0] & 0x400
    return program + interrupt + (EXCEPTION_FLOAT if has_float else EXCEPTION)


def main():
    objdump, *images = sys.argv[1:]
    for image in images:
        print(f"{image.rsplit('/', 1)[-1]}: at most {bound(objdump, image)} bytes of stack")


if __name__ == "__main__":
    main()
