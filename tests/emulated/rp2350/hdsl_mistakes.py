"""The table "what you see" of the HDSL board, mistake by mistake: what the console says if a wire is off, a pair is swapped, the encoder has
no supply, the transceiver is too slow, the line is bad, the program is late, or a core stood still.

    python hdsl_mistakes.py IMAGE

Not tried, for nothing here has volts or a UART's rate: the adapter's rate and its wires, the crystal, a real termination.
"""

import random
import sys

from chip import CLOCK_HZ, Chip
from hdsl import BIT, DE, DI, RO, Line, shaft

# The timer of these runs is so much faster: the console speaks ten times a second, which is long here.
HURRY = 20
REASON, SCRATCH2 = 0x400D8008, 0x400D8014


class Silent(Line):
    """An encoder without its supply."""

    def catch_up(self, clock):
        super().catch_up(clock)
        self.answer = None


class Swapped(Line):
    """DSL+ and DSL- swapped: both ends hear the inverse."""

    def changed(self, clock, levels, directions):
        super().changed(clock, levels ^ DI, directions)

    def inputs(self, clock):
        return RO if self.driven else super().inputs(clock) ^ RO


class NoDe(Line):
    """DE is not connected, and low by its pull-down: the pair is never driven."""

    def changed(self, clock, levels, directions):
        super().changed(clock, levels & ~DE, directions)


class NoRo(Line):
    """RO is not connected: the pull-up of the pin."""

    def inputs(self, clock):
        super().inputs(clock)
        return RO


class Slow(Line):
    """A transceiver whose output follows what lasts for four bits and more: 2.5 Mbit/s."""

    last = (0, 1)

    def changed(self, clock, levels, directions):
        since, level = self.last
        if clock - since < 4 * BIT:
            levels = levels & ~DI | (DI if level else 0)
        self.last = (clock, int(bool(levels & DI)))
        super().changed(clock, levels, directions)


def said(chip):
    return bytes(chip.console).decode().split("\r\n")[:-1]


def run(image, line, clocks, done=lambda chip, lines: False, **speed):
    """What the console says within so many clocks, or until it is enough."""
    chip = Chip(image, line.inputs, line.changed, **speed)
    end = chip.now + clocks
    chip.run(clocks + 1000, lambda: chip.now >= end or done(chip, said(chip)))
    return chip, said(chip)


def noisy(seed):
    """After the start-up a burst in one answer of ten, of which no word is left."""
    numbers, heard = random.Random(seed), [0]

    def damage(bits):
        heard[0] += 1
        return "0" * len(bits) if heard[0] > 100 and not numbers.randrange(40) else bits

    return damage


def main():
    image = sys.argv[1]
    enough = lambda _, lines: len(lines) >= 4
    for kind in (Silent, Swapped, NoDe, NoRo, Slow):
        _, lines = run(image, kind(shaft, lambda bits: bits), 4_000_000, enough, hz=CLOCK_HZ // HURRY)
        assert len(lines) >= 4 and all(text.startswith("no position: ") for text in lines[1:]), f"{kind.__name__}: {lines}"
        print(f"{kind.__name__}: {lines[-1]}")

    goes = lambda _, lines: [text[:8] for text in lines[1:]].count("position") >= 2
    _, lines = run(image, Line(shaft, noisy(3)), 3_000_000, goes)
    kinds = ["position" if text.startswith("position") else "none" for text in lines[1:]]
    assert "position none position" in " ".join(kinds), f"noisy: {lines}"
    print(f"noisy: {lines[1:]}")

    late = lambda _, lines: any(text.startswith("late: ") for text in lines)
    _, lines = run(image, Line(shaft, lambda bits: bits), 8_000_000, late, scale=4.0, hz=CLOCK_HZ // HURRY)
    assert late(None, lines) and not any(text.startswith("position") for text in lines), f"late: {lines}"
    print(f"late: {lines[-1]}")

    # A restart by the watchdog, as the image finds it.
    told = lambda _, lines: len(lines) >= 2
    chip, lines = run(image, Line(shaft, lambda bits: bits), 1_000_000, told)
    assert not any("watchdog" in text for text in lines), f"a first start: {lines}"
    line = Line(shaft, lambda bits: bits)
    again = Chip(image, line.inputs, line.changed)
    again.registers[SCRATCH2], again.registers[REASON] = chip.registers[SCRATCH2], 1
    again.run(1_000_000, lambda: told(None, said(again)))
    assert said(again)[1] == "the watchdog has restarted this image: it stood still", f"a restart: {said(again)}"
    print(f"a restart: {said(again)[1]}")


if __name__ == "__main__":
    main()
