"""Compares `pio.py` with the independent rp2040-pio-emulator: the two programs of the HDSL image, found in it by their instructions, and
those of the T-Format master (`programs.py`) play the same pins and take the same samples in both, to the clock.

    python compare.py IMAGE
"""

import sys
from collections import deque

from pioemu import State, emulate

from pio import SYNCHRONISER, Pio
from programs import HEAR, SEND

# From the data sheet's tables, by hand: out pins, 2 [1]; then jmp x-- [15], in pins, 1 [1]
PLAY, SAMPLE = [0x6102], [0x0F40, 0x4101]
# That emulator has no flags: to wait for one and to set one take a cycle and do nothing, `mov y, y`, in both.
FLAGS, NOTHING = (0x20C0, 0xC000), 0xA042
# Ten bits, no wait; 40 bits, three cycles of wait.
MESSAGES = [9, 0, 0x2B4, 39, 3, 0x12345678, 0xF5]
WORDS = [0xAAAAFFFF, 0xFFFFAAAA, 0x0000AAAA, 0x00000000, 0x12345678, 0xDEADBEEF] * 4
# The other emulator begins to count with one.
FIRST = 1
CLOCKS = 32 * len(WORDS) - 4
WAIT = 26


def level(clock: int) -> int:
    """What is on the line: a pattern without a period."""
    return (clock * clock // 97 + clock // 5) & 1


def ours(program, wrap, shiftctrl, pinctrl, words, x, clocks):
    wave = []
    pio = Pio(lambda clock: level(clock + SYNCHRONISER), lambda clock, levels, _: wave.append((clock, levels)))
    machine = pio.machines[0]
    pio.memory[: len(program)] = program
    machine.execctrl, machine.shiftctrl, machine.pinctrl = wrap << 7 | len(program) - 1 << 12, shiftctrl, pinctrl
    machine.tx.extend(words)
    machine.x, machine.enabled, heard = x, True, []
    while machine.time <= clocks:
        pio.step(machine.time)
        while machine.rx:
            heard.append(machine.rx.popleft())
    return wave, heard


def theirs(program, wrap, words, x, clocks, **shift):
    wave, heard = [], []
    state = State(program_counter=0, pin_directions=0 if "auto_push" in shift else 3, transmit_fifo=deque(words), x_register=x)
    for before, after in emulate(
        program,
        stop_when=lambda _, state: state.clock > clocks,
        initial_state=state,
        input_source=level,
        wrap_target=wrap,
        wrap_top=len(program) - 1,
        **shift,
    ):
        if after.pin_values != before.pin_values:
            wave.append((before.clock - FIRST, after.pin_values))
        while after.receive_fifo:
            heard.append(after.receive_fifo.popleft())
    return wave, heard


def without_flags(program):
    return [NOTHING if code in FLAGS else code for code in program]


def sender():
    """Edges of pin 0 and of the driver, pin 1, from the first on."""
    program, clocks = without_flags(SEND), 900
    wave = []
    pio = Pio(lambda clock: 0, lambda clock, levels, _: wave.append((clock, levels)))
    machine = pio.machines[0]
    pio.memory[: len(program)] = program
    machine.execctrl, machine.shiftctrl = len(program) - 1 << 12, 1 << 17 | 1 << 19
    machine.pinctrl = 1 << 29 | 1 << 20 | 1 << 10
    machine.tx.extend(MESSAGES)
    machine.enabled = True
    while machine.time <= clocks:
        pio.step(machine.time)
    other = []
    start = State(program_counter=0, pin_directions=3, transmit_fifo=deque(MESSAGES))
    shape = {"out_base": 0, "out_count": 1, "side_set_base": 1, "side_set_count": 1}
    steps = emulate(
        program,
        stop_when=lambda _, state: state.clock > clocks,
        initial_state=start,
        auto_pull=True,
        wrap_target=0,
        wrap_top=len(program) - 1,
        **shape,
    )
    for before, after in steps:
        if after.pin_values != before.pin_values:
            other.append((before.clock - FIRST, after.pin_values))
    # When the first word is taken differs; from the first edge on nothing may.
    return [[(clock - edges[0][0], levels) for clock, levels in edges] for edges in (wave, other)]


def hearer():
    """What the receiver makes of a line that is no start-stop line at all, and of a word that it waits for."""
    program, clocks = without_flags(HEAR), 20_000
    heard = []
    pio = Pio(lambda clock: slow(clock + SYNCHRONISER), lambda *_: None)
    machine = pio.machines[0]
    pio.memory[: len(program)] = program
    machine.execctrl, machine.shiftctrl, machine.enabled = len(program) - 1 << 12, 1 << 18, True
    while machine.time <= clocks:
        pio.step(machine.time)
        while machine.rx:
            heard.append(machine.rx.popleft())
    other = []
    steps = emulate(
        program,
        stop_when=lambda _, state: state.clock > clocks,
        initial_state=State(program_counter=0),
        input_source=slow,
        shift_isr_right=True,
        wrap_target=0,
        wrap_top=len(program) - 1,
    )
    for _, after in steps:
        while after.receive_fifo:
            other.append(after.receive_fifo.popleft())
    return heard, other


def slow(clock: int) -> int:
    """A line whose levels last for some bits."""
    return level(clock // 17)


def main():
    image = open(sys.argv[1], "rb").read()
    for program in (PLAY, SAMPLE):
        assert b"".join(code.to_bytes(2, "little") for code in program) in image, "the image has another program"
    wave, other = sender()
    assert len(other) > 20 and wave[: len(other)] == other[: len(wave)], f"{wave[:8]} and {other[:8]}"
    heard, other = hearer()
    assert len(other) > 40 and heard[: len(other)] == other[: len(heard)], f"{heard[:3]} and {other[:3]}"
    print(f"rp2350: a transmitter's {len(wave)} edges and a receiver's {len(heard)} words as in rp2040-pio-emulator")
    wave, _ = ours(PLAY, 0, 1 << 17 | 1 << 19, 2 << 20, WORDS, 0, CLOCKS)
    other, _ = theirs(PLAY, 0, WORDS, 0, CLOCKS, auto_pull=True, out_base=0, out_count=2)
    count = min(len(wave), len(other))
    assert count > 50 and wave[:count] == other[:count], f"{len(wave)} and {len(other)}: {wave[:6]}, {other[:6]}"
    _, heard = ours(SAMPLE, 1, 1 << 16, 0, [], WAIT, 4_000)
    _, other = theirs(SAMPLE, 1, [], WAIT, 4_000, auto_push=True, push_threshold=32, shift_isr_right=False)
    assert len(heard) > 40 and heard[: len(other)] == other[: len(heard)], f"{heard[:3]} and {other[:3]}"
    print(f"rp2350: {count} edges and {len(heard)} words of samples as in rp2040-pio-emulator")


main()
