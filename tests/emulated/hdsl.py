"""The PIO program of the RP2350 HDSL receiver in the independent rp2040-pio-emulator: every edge and every sample, to the clock.

    python hdsl.py IMAGE

The program is looked for in the ELF file by its instructions, encoded here by hand from the data sheet. It uses nothing that the RP2040
does not have.
"""

import sys
from collections import deque

from pioemu import State, emulate

# side-set: bit 12 is DE, bits 11 to 8 are the delay
PROGRAM = [
    0x7001,  # 0 send:  out pins, 1    side 1
    0x1040,  # 1        jmp x-- 0      side 1
    0x7160,  # 2        out null, 32   side 1 [1]
    0x7020,  # 3        out x, 32      side 1
    0x102A,  # 4        jmp !x 10      side 1
    0xB142,  # 5        mov y, y       side 1 [1]
    0xAF42,  # 6        mov y, y       side 0 [15]
    0x4001,  # 7 take:  in pins, 1     side 0
    0x0047,  # 8        jmp x-- 7      side 0
    0x6020,  # 9 begin: out x, 32      side 0
    0x7020,  # 10 more: out x, 32      side 1
    0x1000,  # 11       jmp 0          side 1
]
SEND, BEGIN = 0, 9
DI, DE = 2, 4  # the input is pin 0
CLOCKS, SAMPLES = 16, 8  # of a bit
WINDOW = 72
TAIL = "000011" + "001011" * 21
HEADS = ["00101111011000000101001011", "00101111011011010101001010"]
FILLER = "01" * 37


def message(bits, listen):
    """How many samples, the samples, how many to take. The last sample is held for six clocks, so three are left out."""
    samples = "".join(bit * SAMPLES for bit in bits)
    words = [int(samples[at : at + 32][::-1], 2) for at in range(0, len(samples), 32)]
    return [len(samples) - 3 - 1, *words, WINDOW * SAMPLES - 1 if listen else 0]


def answer(clock: int) -> int:
    """What is on the line: a pattern without a period, a level a clock."""
    return (clock * clock // 97 + clock // 5) & 1


def run(words, clocks):
    """Pins clock by clock, and what was received."""
    wave, heard = [], []
    steps = emulate(
        PROGRAM,
        stop_when=lambda _, state: state.clock > clocks,
        initial_state=State(program_counter=BEGIN, pin_values=DI, pin_directions=DI | DE, transmit_fifo=deque(words)),
        input_source=answer,
        auto_pull=True,
        auto_push=True,
        push_threshold=32,
        shift_isr_right=False,
        out_base=1,
        out_count=1,
        side_set_base=2,
        side_set_count=1,
        wrap_target=SEND,
        wrap_top=BEGIN,
    )
    for before, after in steps:
        wave += [after.pin_values & (DI | DE)] * (after.clock - before.clock)
        while after.receive_fifo:
            heard.append(after.receive_fifo.popleft())
    return wave, heard


def check(wave, heard, at, bits):
    """One answered message: bits from clock `at` on, released for a bit, then samples. Where it ends."""
    for number, bit in enumerate(bits):
        want = DE | (DI if bit == "1" else 0)
        for clock in range(at + number * CLOCKS, at + (number + 1) * CLOCKS):
            assert wave[clock] == want, f"clock {clock}, bit {number}: {wave[clock]} instead of {want}"
    released = at + len(bits) * CLOCKS
    first = released + CLOCKS
    end = first + 2 * WINDOW * SAMPLES
    assert not any(pins & DE for pins in wave[released:end]), "the driver is on while it should listen"
    want = "".join(str(answer(first + 2 * sample)) for sample in range(WINDOW * SAMPLES))
    got = "".join(f"{heard.popleft():032b}" for _ in range(WINDOW * SAMPLES // 32))
    assert got == want, f"samples are not where they should be: {want[:32]} {got[:32]}"
    return end


def main():
    image = open(sys.argv[1], "rb").read()
    assert b"".join(code.to_bytes(2, "little") for code in PROGRAM) in image, "the image has another program"
    words = message(HEADS[0], True)
    words += message(TAIL, False) + message(HEADS[1] + FILLER, False)
    words += message("00" + TAIL, False) + message(HEADS[0], True)
    clocks = (26 + 1 + 72 + 132 + 100 + 134 + 26 + 1 + 72 + 8) * CLOCKS
    wave, heard = run(words, clocks)
    heard = deque(heard)
    begin = next(clock for clock, pins in enumerate(wave) if pins & DE)
    end = check(wave, heard, begin, HEADS[0])
    again = next(clock for clock in range(end, len(wave)) if wave[clock] & DE)
    assert again - end <= 2, "the next message waits"
    check(wave, heard, again, TAIL + HEADS[1] + FILLER + "00" + TAIL + HEADS[0])
    assert not heard
    print(f"hdsl: {len(PROGRAM)} instructions are in the image; {len(wave)} clocks, every edge on its bit, two answers sampled")


main()
