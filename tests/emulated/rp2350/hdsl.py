"""The HIPERFACE DSL image on an emulated RP2350, with an encoder at the other end: the line has to be the same to the clock however
fast its processors are.

    python hdsl.py IMAGE

The image runs unmodified with processors at half speed more and less, with slow flash and slow DMA, on a sound line and on one that
damages one answer in twelve. Each run has to give frames of whole bits and constant length, positions that are right, and nothing late.
What it prints are the margins: how long a head was in memory before its frame began, at the least.
"""

import itertools
import random
import sys

from chip import CLOCK_HZ, Chip
from encoder import Encoder

BIT = 16
DI, DE, RO = 1 << 2, 1 << 3, 1 << 4
STARTING, RUNNING = 252, 180
RING, FRAMES_SYMBOL = 128, "FRAMES"
# Positions a second, as the README says.
RATE = 52_083
# What the console says first: image, rate, clock, board.
FIRST = "servowire-rp2350-hdsl 0.1.0, 9375000 bit/s, core 150000000 Hz of the crystal of 12000000 Hz, Raspberry Pi Pico 2, "
# Clocks from the end of PARA to the first bit of an answer: one bit, then the cable.
CABLE_EIGHTHS = 11
FRAMES = 260


class Line:
    """What is on the pair, and who drives it."""

    def __init__(self, position, damage):
        # The shaft begins to turn with the first bit of the line, so that the answers of a start that takes longer are the same.
        self.encoder = Encoder(lambda clock: position(clock - self.first), damage)
        self.edges = []
        self.first = None
        self.next_bit = None
        self.driven, self.level = False, 1
        self.answer, self.answer_at = None, 0

    def changed(self, clock, levels, _directions):
        self.catch_up(clock)
        self.driven, self.level = bool(levels & DE), int(bool(levels & DI))
        if self.first is None and self.driven:
            self.first = self.next_bit = clock
        if self.first is not None:
            self.edges.append((clock - self.first, self.driven, self.level if self.driven else None))

    def catch_up(self, clock):
        """Tells the encoder the bits that are over; each is looked at in its middle, and has to be whole."""
        while self.next_bit is not None and clock >= self.next_bit + BIT:
            if self.driven:
                answer = self.encoder.bit(self.next_bit, str(self.level))
                if answer:
                    self.answer, self.answer_at = answer, self.next_bit + 2 * BIT + CABLE_EIGHTHS * 2
            self.next_bit += BIT

    def inputs(self, clock):
        """RO: high while the master drives, for /RE is tied to DE."""
        if self.driven:
            return RO
        self.catch_up(clock)
        if self.answer and 0 <= clock - self.answer_at < len(self.answer) * BIT:
            return RO if self.answer[(clock - self.answer_at) // BIT] == "1" else 0
        return RO


def shaft(clock):
    """Where the shaft is so long after the first bit: faster and faster, of 2^32 positions on 4,096 turns."""
    seconds = clock / CLOCK_HZ
    return int(1_000_000 + 40_000_000 * seconds + 2_000_000_000 * seconds * seconds)


def flips(seed, one_in):
    """A wrong bit in one of so many answers: none gets through the checks of the acceleration."""
    numbers = random.Random(seed)

    def damage(bits):
        if numbers.randrange(one_in):
            return bits
        at = numbers.randrange(len(bits))
        return bits[:at] + "10"[int(bits[at])] + bits[at + 1 :]

    return damage


def run(image, damage_after=None, **speed):
    """One run of so many frames: the line, its frames, the margins, what the console said."""
    wrong = flips(1, 12)
    answers = itertools.count()
    line = Line(shaft, lambda bits: wrong(bits) if damage_after and next(answers) >= damage_after else bits)
    chip = Chip(image, line.inputs, line.changed, **speed)
    ring = chip.symbol(FRAMES_SYMBOL)
    told, begun, margins = {}, [], []

    def head_told(clock, address):
        told[(address - ring) // 4] = clock

    def channel_started(channel):
        if channel.number == 0:
            entry = len(begun) % (RING // 4)
            begun.append((chip.now, channel.left * 2))
            if entry in told and len(begun) > 1:
                margins.append((channel.left * 2, chip.now - told.pop(entry)))

    chip.watch(ring, RING, head_told)
    chip.dma.on_start = channel_started
    chip.run(40_000_000, lambda: len(begun) >= FRAMES)
    return line, chip, begun, margins


def check(name, line, chip, begun, margins, damaged=False):
    assert not chip.pio.fdebug >> 24 & 1, f"{name}: the player had nothing to play"
    for clock, _, _ in line.edges:
        assert clock % BIT == 0, f"{name}: an edge {clock % BIT} clocks beside its bit"
    lengths = [length for _, length in begun]
    assert set(lengths) <= {STARTING, RUNNING}, f"{name}: frames of {set(lengths)} bits"
    if not damaged:
        first = lengths.index(RUNNING)
        assert set(lengths[first:]) == {RUNNING}, f"{name}: the link was begun anew"
        assert len(lengths) - first > FRAMES // 2, f"{name}: {first} frames to start"
    least = {bits: min((m for b, m in margins if b == bits), default=None) for bits in (STARTING, RUNNING)}
    print(f"{name}: {len(begun)} frames, {line.encoder.answers} answers; a head is ready at the least", end=" ")
    print(", ".join(f"{clocks:.0f} clocks before a frame of {bits} bits" for bits, clocks in least.items() if clocks is not None), end="")
    spent = [core.clock / max(1, core.instructions) for core in chip.cores]
    print(f"; {spent[0]:.2f} clocks an instruction")
    return least


def positions(name, line, chip):
    """Every position that the console printed was one of the shaft at a sampling edge."""
    # The run ends anywhere in a line.
    said = bytes(chip.console).decode().split("\r\n")[:-1]
    assert said[0].startswith(FIRST) and said[0].endswith(f" {RATE} positions a second"), f"{name}: {said[0]}"
    printed = [int(text.removeprefix("position ")) for text in said if text.startswith("position ")]
    truth = set(line.encoder.truth)
    assert printed, f"{name}: no position, only {said}"
    for position in printed:
        assert position in truth, f"{name}: the shaft never was at {position}"
    assert not any("late" in text for text in said), f"{name}: {said}"


def watchdog(name, chip):
    """It is fed while both cores are at work, and not by core 1 alone."""
    assert chip.registers[0x400D8000] >> 30 & 1, f"{name}: no watchdog"
    assert chip.fed > FRAMES // 2, f"{name}: the watchdog was fed {chip.fed} times"
    core, fed = chip.cores[1], chip.fed
    core.run(core.clock + 10 * RUNNING * BIT)
    assert chip.fed <= fed + 1, f"{name}: core 1 feeds the watchdog while core 0 stands"


def main():
    image = sys.argv[1]
    assert round(CLOCK_HZ / BIT / RUNNING) == RATE
    runs = {
        "processors as they are": {},
        "twice as fast": {"scale": 0.5},
        "half as fast again": {"scale": 1.5},
        "slow flash": {"flash_clocks": 60},
        "slow DMA": {"dma_clocks": 12},
    }
    for damage_after in (None, 100):
        first = None
        for name, speed in runs.items():
            name = f"{name}, an answer in twelve damaged" if damage_after else name
            line, chip, begun, margins = run(image, damage_after, **speed)
            check(name, line, chip, begun, margins, damage_after is not None)
            positions(name, line, chip)
            watchdog(name, chip)
            edges = line.edges[: len(line.edges) - 200]
            first = first or edges
            same = min(len(first), len(edges))
            assert first[:same] == edges[:same], f"{name}: the line is another one"
    # What would be seen if it were not so: processors that are too slow begin anew and count it, and give no position.
    line, chip, begun, _ = run(image, scale=4.0)
    assert chip.load(chip.symbol("4LATE17h"), 4) > 0, "four times as slow, and nothing was late"
    assert b"\nposition" not in chip.console


if __name__ == "__main__":
    main()
