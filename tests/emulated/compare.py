"""Compares chip.mjs with the independent rp2040-pio-emulator: the same programs, edge for edge and word for word.

    node waveform.mjs IMAGE | python compare.py
"""

import json
import sys
from collections import deque

from pioemu import State, emulate

DI, DE = 1, 2
# That emulator has no flags: waiting for the one between the machines and setting it take a cycle and do nothing, `mov y, y`.
FLAGS, NOTHING = {0x20C0, 0xC000}, 0xA042


def program(run):
    return [NOTHING | opcode & 0x1F00 if opcode & 0xE0FF in FLAGS else opcode for opcode in run["program"]]


def transmissions(wave):
    """What is sent while the driver is on: for each, the levels cycle by cycle."""
    found, now = [], []
    for pins in wave:
        if pins & DE:
            now.append(pins & DI)
        elif now:
            found.append(now)
            now = []
    return found


def transmitter(run):
    tx = run["tx"]
    cycles = len(run["waves"])
    steps = emulate(
        program(run),
        stop_when=lambda _, state: state.clock > cycles,
        initial_state=State(program_counter=tx["wrapTarget"], pin_values=DI, transmit_fifo=deque(run["words"])),
        auto_pull=True,
        out_base=0,
        out_count=1,
        side_set_base=1,
        side_set_count=1,
        wrap_target=tx["wrapTarget"],
        wrap_top=tx["wrapTop"],
    )
    wave = []
    for before, after in steps:
        wave += [after.pin_values & (DI | DE)] * (after.clock - before.clock)
    return wave


def receiver(run):
    rx = run["rx"]
    line = [pins & DI if pins & DE else 1 for pins in run["waves"]]

    def pin(clock: int) -> int:
        return line[min(clock, len(line) - 1)]

    heard = []
    steps = emulate(
        program(run),
        stop_when=lambda _, state: state.clock >= len(line),
        initial_state=State(program_counter=rx["wrapTarget"]),
        input_source=pin,
        auto_push=True,
        push_threshold=rx["push"],
        wrap_target=rx["wrapTarget"],
        wrap_top=rx["wrapTop"],
    )
    for _, after in steps:
        while after.receive_fifo:
            heard.append(after.receive_fifo.popleft())
    return heard


def main():
    run = json.load(sys.stdin)
    ours, theirs = transmissions(run["waves"]), transmissions(transmitter(run))
    edges = sum(a != b for sent in theirs for a, b in zip(sent, sent[1:]))
    assert len(ours) == 2 and edges > 20, (len(ours), edges)
    # A machine that waits for its first word may begin a cycle later; from the first bit on nothing may differ.
    for mine, other in zip(ours, theirs, strict=True):
        assert abs(len(mine) - len(other)) <= 1, (len(mine), len(other))
        length = min(len(mine), len(other))
        assert mine[-length:] == other[-length:], "the waveforms differ"
    heard = receiver(run)
    assert heard == run["heard"] and len(heard) > 3, (heard, run["heard"])
    print(f"{run['image']}: {edges} edges and {len(heard)} received words are those of rp2040-pio-emulator")


main()
