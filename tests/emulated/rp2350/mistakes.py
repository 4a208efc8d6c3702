"""The table "If nothing arrives" of the Pico 2's README: each mistake is made, and the master has to say what stands there.

    python mistakes.py FOLDER

FOLDER has the images, which run unmodified.
"""

import re
import sys
from pathlib import Path

from chip import Chip
from start_stop import DE, RO, AFormat, Line, TFormat

HZ = 120_000_000
US = HZ // 1_000_000
MS = 1000 * US
README = Path(__file__).parents[3] / "examples/firmware/pico2/README.md"


class OtherEncoder(TFormat):
    enid = 0x11


class NoBattery(TFormat):
    """ALMC.6, BE."""

    almc = 0x40


# Master, clocks of its bits and how it is wired: `encoder` and `hears` are what is at the other end and the clocks of its bits, `enable` is
# what becomes of the master's DE, `echo` a /RE at GND.
TFORMAT, TFORMAT_5M, AFORMAT = ("pico2-tformat-master", 48), ("pico2-tformat-master-5m", 24), ("pico2-aformat-master-2m5", 48)
MISTAKES = {
    "A and B exchanged": (*TFORMAT, {"crossed": True}),
    "an encoder of 5 Mbit/s at a master of 2.5": (*TFORMAT, {"hears": 24}),
    "an encoder of 2.5 Mbit/s at a master of 5": (*TFORMAT_5M, {"hears": 48}),
    "an A-format encoder": (*TFORMAT, {"encoder": AFormat}),
    "a T-Format encoder at an A-format master": (*AFORMAT, {"encoder": TFormat}),
    "DE always on": (*TFORMAT, {"enable": lambda _: True}),
    "DE always off, or not wired": (*TFORMAT, {"enable": lambda _: False}),
    "no supply at the encoder, or no encoder": (*TFORMAT, {"silent": True}),
    "the same, and /RE at GND": (*TFORMAT, {"silent": True, "echo": True}),
    "nothing but /RE at GND": (*TFORMAT, {"echo": True}),
    "an encoder that calls itself 11h": (*TFORMAT, {"encoder": OtherEncoder}),
    "no battery at the encoder": (*TFORMAT, {"encoder": NoBattery}),
    "a bit of each second answer is wrong": (*TFORMAT, {"damaged": 2}),
}


class Wiring(Line):
    """A line with a mistake."""

    def __init__(self, sends, *, encoder=None, hears=None, crossed=False, enable=lambda on: on, echo=False, silent=False, damaged=0):
        super().__init__((encoder or TFormat)(), hears or sends, US, {})
        self.crossed, self.enable, self.echo, self.silent, self.damaged = crossed, enable, echo, silent, damaged

    def changed(self, clock, levels, directions):
        driven = self.enable(bool(levels & DE))
        super().changed(clock, levels | DE if driven else levels & ~DE, directions)

    def asked(self, exchange, clock):
        if self.crossed:
            exchange.edges = [(at, 1 - level) for at, level in exchange.edges]
        super().asked(exchange, clock)
        if self.damaged and len(self.exchanges) % self.damaged == 0:
            exchange.units = [*exchange.units[:4], exchange.units[4] ^ 1, *exchange.units[5:]]
        if self.silent:
            exchange.answer_at = exchange.answer_end = None

    def inputs(self, clock):
        if self.driven and self.echo:
            return RO if self.level else 0
        levels = super().inputs(clock)
        answers = self.exchanges and (at := self.exchanges[-1].answer_at) is not None and at <= clock < self.exchanges[-1].answer_end
        return levels ^ RO if self.crossed and answers and not self.driven else levels


def said(image, sends, mistake):
    """What the console says behind the first line, without its numbers."""
    line = Wiring(sends, **mistake)
    chip = Chip(image, line.inputs, line.changed, hz=HZ)
    chip.run(20 * MS, lambda: chip.console.count(b"\n") > 8 or chip.now > 12 * MS)
    first, *rest = chip.console.decode().splitlines()[:-1]
    assert first.startswith(f"{image.name} 0.1.0, "), first
    assert len(rest) > 2, f"{image.name} says no more than\n{first}"
    short = (re.sub(r", \d+ good.*| at \d+ ns.*", "", one) for one in rest)
    return list(dict.fromkeys(re.sub(r"\d+(?= counts)|(?<=field is )\w+|(?<=computed )\w+", "...", one) for one in short))


def main():
    folder, readme = Path(sys.argv[1]), README.read_text()
    missing = []
    for mistake, (image, sends, how) in MISTAKES.items():
        row = f"| {mistake} | {', '.join(f'`{one}`' for one in said(folder / image, sends, how))} |"
        print(row, flush=True)
        if row not in readme:
            missing.append(row)
    assert not missing, "the README has no line\n" + "\n".join(missing)


if __name__ == "__main__":
    main()
