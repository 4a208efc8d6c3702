"""Compares the table of figures in examples/firmware/README.md, and those in the READMEs of the images, with what was measured.

    python3 figures.py OBJDUMP MEASURED

MEASURED is what the runs have noted, a line each: image, what, number, between tabs. Flash and static RAM are read from the ELF files;
the stack of an image that has not run is the bound of stack.py; instructions of what was counted on a Cortex-M4 are those of
tests/bare-metal/budget.toml, by the name of the kernel that stands behind them in the README. Fails if a README is more than 5 % off,
if a figure is missing, or if more stack was used than the bound allows. The worst interrupt is the longest way through the handler that
stands behind it, by interrupts.py, or the longest of a run that has noted it, where a handler has loops; `none` is compared with the
vectors.
"""

import json
import pathlib
import re
import struct
import subprocess
import sys
import tomllib

import interrupts
import stack

ROOT = pathlib.Path(__file__).parent.parent.parent
FIRMWARE = ROOT / "examples" / "firmware"
# Where RAM begins, by target; of the ESP32-C3 that for data.
RAM = {"riscv32imc-unknown-none-elf": 0x3FC80000}
ARM_RAM = 0x20000000
BAND = 0.05
COLUMNS = ["image", "flash", "static RAM", "stack", "instructions a cycle", "worst interrupt"]
# Folder, target, and whether the stack in the README is that of a run. How deep the interrupts of the STM32F405 nest in QEMU depends on
# the host, so its README has the bound.
IMAGES = [
    ("rp2040", "thumbv6m-none-eabi", True),
    ("stm32f405", "thumbv7em-none-eabihf", False),
    ("stm32g4", "thumbv7em-none-eabihf", False),
    ("teensy4", "thumbv7em-none-eabihf", False),
    ("esp32c3", "riscv32imc-unknown-none-elf", False),
    ("rp2350-hdsl", "thumbv8m.main-none-eabihf", False),
    ("pico2", "thumbv8m.main-none-eabihf", False),
]


def sizes(path, begin):
    """Flash and static RAM, from the segments of an ELF file."""
    data = path.read_bytes()
    headers, size, count = (struct.unpack_from(kind, data, at)[0] for kind, at in (("<I", 28), ("<H", 42), ("<H", 44)))
    flash = ram = 0
    for k in range(count):
        kind, _, virtual, _, in_file, in_memory = struct.unpack_from("<6I", data, headers + k * size)
        if kind == 1:
            flash += in_file
            ram += in_memory if begin <= virtual < begin + (1 << 20) else 0
    return flash, ram


def built(folder, target):
    """Where cargo puts the images of a folder, and their names."""
    command = ["cargo", "metadata", "--no-deps", "--format-version", "1"]
    told = json.loads(subprocess.run(command, check=True, capture_output=True, cwd=FIRMWARE / folder).stdout)
    names = {binary["name"] for package in told["packages"] for binary in package["targets"] if "bin" in binary["kind"]}
    return pathlib.Path(told["target_directory"]) / target / "release", names


def number(text):
    """`22.1 kB`, `516 B`, `1,426` as a number, and the name of a kernel behind it; `-` for what nobody knows."""
    if text == "-":
        return None, None
    found = re.match(r"([\d,.]+)(?: (kB|B))?(?: \(`(\w+)`\))?$", text)
    assert found, f"{text!r} is no figure"
    return float(found[1].replace(",", "")) * (1000 if found[2] == "kB" else 1), found[3]


def rows(text):
    """The table of figures: names of images, and the cells behind them."""
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    assert COLUMNS in lines, f"no table of {', '.join(COLUMNS)}"
    for cells in lines[lines.index(COLUMNS) + 2 :]:
        names = re.findall(r"`([\w-]+)`", cells[0])
        if len(cells) != len(COLUMNS) or not names:
            return
        yield names, cells[1:]


def interrupted(objdump, path, said):
    """What is wrong with what a README says of the worst interrupt of an image."""
    if said == "none":
        handlers = interrupts.Image(objdump, path).handlers()
        return [f"{path.name}: it has handlers for {', '.join(sorted(handlers))}"] if handlers else []
    longest, handler = number(said)
    is_ = interrupts.longest(objdump, path, handler)
    print(f"{path.name}: {handler} takes {is_} instructions at the most")
    return [f"{path.name}, {handler}: the README says {longest:g}, it is {is_}"] if abs(longest - is_) > BAND * is_ else []


def main():
    objdump, noted = sys.argv[1:]
    kernels = tomllib.loads((ROOT / "tests/bare-metal/budget.toml").read_text())["kernels"]
    measured = {}
    for line in pathlib.Path(noted).read_text().splitlines():
        image, what, value = line.split("\t")
        measured[image, what] = max(float(value), measured.get((image, what), 0))
    faults, compared = [], 0

    def compare(place, said, is_):
        nonlocal compared
        if said is None:
            return
        compared += 1
        if abs(said - is_) > BAND * is_:
            faults.append(f"{place}: the README says {said:g}, measured is {is_:g}")

    table = list(rows((FIRMWARE / "README.md").read_text()))
    for folder, target, runs in IMAGES:
        readme = (FIRMWARE / folder / "README.md").read_text()
        place, images = built(folder, target)
        for names, cells in [row for row in table if images & set(row[0])]:
            *cells, interrupt = cells
            (flash, _), (ram, _), (deep, _), (count, kernel) = map(number, cells)
            for name in names:
                images.discard(name)
                path = place / name
                is_flash, is_ram = sizes(path, RAM.get(target, ARM_RAM))
                bound = stack.bound(objdump, path) if target.startswith("thumb") else 0
                ran = measured.get((name, "stack"), 0)
                used = ran if runs else bound
                counted = kernels[kernel]["O3"] if kernel else measured.get((name, "instructions a cycle"))
                print(f"{name}: {is_flash} bytes of flash, {is_ram} of static RAM, {used} of stack (at most {bound}), {counted} instructions a cycle")
                compare(f"{name}, flash", flash, is_flash)
                compare(f"{name}, static RAM", ram, is_ram)
                compare(f"{name}, stack", deep, used)
                compare(f"{name}, instructions a cycle", count, counted)
                if (name, "interrupt") in measured:
                    compare(f"{name}, interrupt", number(interrupt)[0], measured[name, "interrupt"])
                elif target.startswith("thumb"):
                    compared += 1
                    faults += interrupted(objdump, path, interrupt)
                if ran > bound:
                    faults.append(f"{name}: {ran:g} bytes of stack were used, {bound} is the bound")
        if images:
            faults.append(f"{folder}: README.md has no figures of {', '.join(sorted(images))}")
        # In the text: `1,426 (`tformat_transaction`)`.
        for said, kernel in re.findall(r"([\d,]+)(?: instructions)? \(`(\w+)`", readme):
            compare(f"{folder}, {kernel}", number(said)[0], kernels[kernel]["O3"])
    for fault in faults:
        print("FAILED:", fault)
    print(f"figures: {compared} of the READMEs compared")
    sys.exit(1 if faults else 0)


main()
