"""A T-Format or A-format master of the Pico 2 on an emulated RP2350, with an encoder at the other end.

    python masters.py FOLDER

FOLDER has the images, which run unmodified, with processors at half speed more and less, with slow flash and slow DMA. In each run some
exchanges are hurt. Every edge has to be a whole number of bits from the first one of its request, the driver on from a bit before the
start bit to at most a bit behind the stop bit; every position that the console prints was on the line, and each fault costs its own
exchange and no other.
"""

import sys
from pathlib import Path

from chip import Chip
from programs import HEAR, SEND, loaded
from start_stop import AFormat, Line, TFormat

HZ = 120_000_000
US = HZ // 1_000_000
EXCHANGES = 70
# An encoder, clocks a bit, by how much an answer is later than the master waits (in us), and the request. A master that has begun to take an
# answer when its time is over takes it to the end.
MASTERS = {
    "pico2-tformat-master": (TFormat, 48, 16, [0x1A]),
    "pico2-tformat-master-5m": (TFormat, 24, 16, [0x1A]),
    "pico2-aformat-master": (AFormat, 15, 62, [0b010]),
    "pico2-aformat-master-2m5": (AFormat, 48, 110, [0b010]),
}
SPEEDS = {
    "processors as they are": {},
    "twice as fast": {"scale": 0.5},
    "half as fast again": {"scale": 1.5},
    "slow flash": {"flash_clocks": 60},
    "slow DMA": {"dma_clocks": 12},
}


def faults(late_us):
    """What happens to the line, by the number of the exchange."""

    def silence(line, _):
        line.deaf = True

    def late(line, _):
        line.late = late_us * US

    def wrong_bit(line, exchange):
        start = answer_start(line, exchange) + line.unit + 5 * line.clocks
        line.change = lambda clock, level: 1 - level if start <= clock < start + line.clocks else level

    def noise_before(line, exchange):
        start = answer_start(line, exchange) - US
        line.change = lambda clock, level: 0 if start <= clock < start + US // 2 else level

    def hole(line, exchange):
        start = answer_start(line, exchange) + line.unit
        line.change = lambda clock, level: 1 if start <= clock < start + 2 * line.unit else level

    def damaged_request(_, exchange):
        at, value, stop = exchange.asked[0]
        exchange.asked[0] = at, value ^ 6, stop

    return {5: silence, 10: wrong_bit, 15: late, 20: noise_before, 25: hole, 30: damaged_request}


def answer_start(line, exchange):
    return exchange.asked[-1][0] + line.unit + round(line.encoder.turn_us * US)


def run(image, encoder, clocks, late_us, **speed):
    """The line, and the lines of the console with the clock at which each was whole."""
    line = Line(encoder(), clocks, US, faults(late_us))
    chip = Chip(image, line.inputs, line.changed, hz=HZ, **speed)
    said, taken = [], 0

    def done():
        nonlocal taken
        while (end := chip.console.find(b"\n", taken)) >= 0:
            said.append((chip.now, chip.console[taken:end].decode().rstrip("\r")))
            taken = end + 1
        return len(line.exchanges) > EXCHANGES

    chip.run(40_000_000, done)
    assert chip.fed > 10, "the watchdog is not fed"
    if encoder is TFormat and clocks == 48:
        assert all(loaded(chip.pio.memory, program) for program in (SEND, HEAR)), "the image has other programs"
    return line, said


def check_line(name, line, request):
    """The edges of all requests, and the driver."""
    for exchange in line.exchanges[:-1]:
        first = exchange.asked[0][0]
        # A fault may have changed what the encoder heard; the line itself is what is looked at.
        sent = line.units(exchange.edges)
        assert [value for _, value, _ in sent] == request, f"{name}: the request {sent}"
        assert all(stop for _, _, stop in sent), f"{name}: a stop bit of 0"
        for clock, _ in exchange.edges[1:]:
            assert (clock - first) % line.clocks == 0, f"{name}: an edge {(clock - first) % line.clocks} clocks beside its bit"
        lead, tail = first - exchange.begin, exchange.end - (sent[-1][0] + line.unit)
        assert line.clocks <= lead < 2 * line.clocks, f"{name}: the driver is on {lead} clocks before the start bit"
        assert 0 <= tail <= line.clocks, f"{name}: the driver is off {tail} clocks behind the stop bit"


def check_console(name, image, line, said, hurt, cold):
    """What the console says against what was on the line. `cold`: the flash is slow, so the first position may be too old when it has been
    fetched from there how to judge it."""
    text = "\n".join(said for _, said in said)
    first = f"{image} 0.1.0, {HZ // line.clocks} bit/s, core {HZ} Hz of the crystal of 12000000 Hz, Raspberry Pi Pico 2, "
    assert said[0][1].startswith(first), f"{name}: {said[0][1]}"
    last = line.exchanges[-1].begin
    printed = [(clock, text) for clock, text in said if text.startswith("turn ") and clock < last]
    failed = [text for clock, text in said if text.startswith("fault") and clock < last]
    old = [text for clock, text in said if text.startswith("no position: the position is ") and " ns old, 1 good" in text]
    assert len(old) <= cold, f"{name}: {text}"
    assert len(printed) >= EXCHANGES // 16 - cold, f"{name}: {text}"
    for clock, position in printed:
        answered = [x for x in line.exchanges if x.answer_end is not None and x.answer_end <= clock]
        assert position.startswith(answered[-1].value), f"{name}: {position}, the line carried {answered[-1].value}"
    assert len(failed) == hurt, f"{name}: {hurt} faults on the line\n{text}"
    assert printed[-1][1].endswith(f", {hurt} bad"), f"{name}: {printed[-1][1]}"
    assert len(printed) + len(failed) + len(old) == len([1 for clock, _ in said[1:] if clock < last]), f"{name}: {text}"
    return len(printed)


def main():
    folder = Path(sys.argv[1])
    for image, (encoder, clocks, late_us, request) in MASTERS.items():
        counts = []
        for speed, how in SPEEDS.items():
            name = f"{image}, {speed}"
            line, said = run(folder / image, encoder, clocks, late_us, **how)
            check_line(name, line, request)
            counts.append(check_console(name, image, line, said, len(faults(late_us)), "flash_clocks" in how))
        print(f"{image}: {len(SPEEDS)} runs of {EXCHANGES} exchanges, in each {len(faults(late_us))} hurt and {min(counts)} positions printed")


if __name__ == "__main__":
    main()
