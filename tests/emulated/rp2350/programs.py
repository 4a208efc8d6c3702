"""The PIO programs of `pico2-tformat-master`, from the data sheet's tables, by hand; jumps are counted from the begin of each.

`masters.py` finds them in the memory of the image's PIO, `compare.py` runs them in another emulator too.
"""

# The transmitter, 12 cycles a bit: out x, 32; out y, 32; wait 1 irq 0; jmp y-- 3; out pins, 1 side 1 [10]; jmp x-- 4 side 1;
# out null, 32 side 1
SEND = [0x6020, 0x6040, 0x20C0, 0x0083, 0x7A01, 0x1044, 0x7060]
# The receiver of bytes: wait 1 pin 0; wait 0 pin 0; set y, 7 [15]; in pins, 1 [8]; pull noblock; mov x, osr; jmp y-- 3; in pins, 1;
# mov y, isr; jmp x!=y 11; irq set 0; push
HEAR = [0x20A0, 0x2020, 0xEF47, 0x4801, 0x8080, 0xA027, 0x0083, 0x4001, 0xA046, 0x00AB, 0xC000, 0x8020]


def loaded(memory, program):
    """Whether a PIO block has this program, at whatever place."""

    def at(origin):
        return [code + origin if code >> 13 == 0 else code for code in program]

    return any(memory[origin : origin + len(program)] == at(origin) for origin in range(len(memory)))
