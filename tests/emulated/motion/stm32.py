"""An STM32F405 that runs the motion image: a Cortex-M4 in `unicorn`, TIM2, USART1, port C, and as much of clocks as a start needs, from
the reference manual RM0090.

Time is clocks of the core. What an instruction takes in a handler is the table of `rp2350/chip.py`; the background is counted with
`BACKGROUND` clocks for each, in turns of `TURN` instructions at the most. That is not true to the cycle; the timer, whose interrupt
comes at its clock, is what the pulses are measured by.

A handler runs on a second `unicorn` over the same memory, so that its instructions, and they alone, can be counted one by one.
"""

import ctypes
import sys
from pathlib import Path

from elftools.elf.elffile import ELFFile
from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_MODE_MCLASS, UC_MODE_THUMB, UC_PROT_ALL, Uc
from unicorn.arm_const import (
    UC_ARM_REG_FPEXC,
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_PRIMASK,
    UC_ARM_REG_SP,
    UC_CPU_ARM_CORTEX_M4,
)

sys.path.insert(0, str(Path(__file__).parent.parent / "rp2350"))
from chip import clocks_of  # noqa: E402

HZ = 160_000_000
FLASH, RAM = 0x08000000, 0x20000000
FLASH_BYTES, RAM_BYTES = 0x100000, 0x20000
# Clocks of an instruction of the background, and how many of them run between two looks at the peripherals: less than the 25 us that
# the first event is ahead.
BACKGROUND, TURN = 1.5, 2000
# What the processor takes to enter a handler, and its frame with the floating-point registers.
ENTRY, FRAME = 12, 104
# The handler's return, where no code is.
RETURN = FLASH + FLASH_BYTES - 0x100
# Clocks of the core in a tick of TIM2, and in a character at 1,000,000 baud.
TICK, CHARACTER = 2, HZ // 100_000
TIM2, USART1, GPIOC, RCC, NVIC = 0x40000000, 0x40011000, 0x40020800, 0x40023800, 0xE000E100
TIM2_IRQ, USART1_IRQ = 28, 37
DIER, SR, EGR, CNT, CCR1, CCR2 = 0x0C, 0x10, 0x14, 0x24, 0x34, 0x38
TXE, TC, RXNE, RXNEIE = 1 << 7, 1 << 6, 1 << 5, 1 << 5
BSRR = 0x18
# Pins of port C: STEP of three axes, then their DIR.
AXES = 3


class Chip:
    def __init__(self, path, slower=1.0):
        self.slower = slower
        self.flash, self.ram = (ctypes.c_ubyte * FLASH_BYTES)(), (ctypes.c_ubyte * RAM_BYTES)()
        elf = ELFFile(open(path, "rb"))
        for segment in elf.iter_segments():
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                data = segment.data()
                ctypes.memmove(ctypes.addressof(self.flash) + segment["p_paddr"] - FLASH, data, len(data))
        self.registers, self.costs = {}, {}
        self.clock, self.executed, self.longest = 0.0, 0, 0
        self.flags, self.matches = 0, {CCR1: None, CCR2: None}
        # How long the present handler waited for the one before.
        self.waited = 0
        self.heard, self.coming, self.sent = [], [], 0.0
        self.console, self.edges, self.levels, self.after = bytearray(), [], 0, None
        self.background, self.handler = self.core(), self.core()
        self.handler.hook_add(UC_HOOK_CODE, self.count)
        self.background.reg_write(UC_ARM_REG_SP, self.vector(0))
        self.pc, self.deepest = self.vector(1), self.vector(0)

    def core(self):
        uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        uc.mem_map_ptr(FLASH, FLASH_BYTES, UC_PROT_ALL, ctypes.addressof(self.flash))
        uc.mem_map_ptr(RAM, RAM_BYTES, UC_PROT_ALL, ctypes.addressof(self.ram))
        for base, size in ((0x40000000, 0x80000), (0xE0000000, 0x100000)):
            uc.mmio_map(base, size, self.load, base, self.store, base)
        uc.reg_write(UC_ARM_REG_FPEXC, 0x40000000)
        return uc

    def vector(self, number):
        return int.from_bytes(bytes(self.flash[4 * number : 4 * number + 4]), "little")

    def count(self, uc, address, size, _):
        """Time, in a handler."""
        cost = self.costs.get(address)
        if cost is None:
            cost = self.costs[address] = clocks_of(bytes(uc.mem_read(address, size)))
        self.clock += (cost + 2 * (address != self.after)) * self.slower
        self.after = address + size
        self.executed += 1
        self.deepest = min(self.deepest, uc.reg_read(UC_ARM_REG_SP))

    # The peripherals.

    def ticks(self):
        return int(self.clock // TICK)

    def advance(self):
        """Flags of what has happened until now."""
        for bit, register in ((1, CCR1), (2, CCR2)):
            at = self.matches[register]
            if at is not None and self.ticks() >= at:
                self.flags |= 1 << bit
                self.matches[register] = at + (1 << 32)
        if self.coming and self.clock >= self.coming[0][0]:
            assert not self.heard, "a character was overrun"
            self.heard.append(self.coming.pop(0)[1])

    def load(self, _uc, offset, _size, base):
        self.advance()
        address = base + offset
        value = self.registers.get(address, 0)
        if address == TIM2 + CNT:
            return self.ticks() & 0xFFFFFFFF
        if address == TIM2 + SR:
            return self.flags
        if address == USART1:
            return (TXE | TC if self.clock >= self.sent else 0) | (RXNE if self.heard else 0)
        if address == USART1 + 4:
            return self.heard.pop() if self.heard else 0
        if address == RCC:
            # Whatever is switched on is ready.
            return value | (value & 0x01010001) << 1
        if address == RCC + 8:
            return value | (value & 3) << 2
        return value

    def store(self, _uc, offset, _size, value, base):
        self.advance()
        address = base + offset
        if address == TIM2 + SR:
            self.flags &= value
        elif address == TIM2 + EGR:
            self.flags |= value & 0x1E
        elif address in (TIM2 + CCR1, TIM2 + CCR2):
            ahead = (value - self.ticks()) & 0xFFFFFFFF
            self.matches[address - TIM2] = self.ticks() + (ahead or 1 << 32)
        elif address == USART1 + 4:
            self.console.append(value & 0xFF)
            self.sent = self.clock + CHARACTER
        elif address == GPIOC + BSRR:
            levels = (self.levels & ~(value >> 16) | value) & 0xFFFF
            if levels != self.levels:
                self.edges.append((self.clock, levels & 7, levels >> AXES & 7, self.waited))
            self.levels = levels
        elif NVIC <= address < NVIC + 0x20:
            value |= self.registers.get(address, 0)
        self.registers[address] = value

    # The processor.

    def pending(self):
        """The interrupt that is to be taken."""
        self.advance()
        enabled = self.registers.get(NVIC, 0) | self.registers.get(NVIC + 4, 0) << 32
        if self.flags & self.registers.get(TIM2 + DIER, 0) & 0x1E and enabled >> TIM2_IRQ & 1:
            return TIM2_IRQ
        if self.heard and self.registers.get(USART1 + 0x0C, 0) & RXNEIE and enabled >> USART1_IRQ & 1:
            return USART1_IRQ
        return None

    def interrupts(self):
        """All that are pending, one behind the other."""
        behind = False
        while self.background.reg_read(UC_ARM_REG_PRIMASK) & 1 == 0 and (number := self.pending()) is not None:
            late = (self.ticks() - self.registers.get(TIM2 + CCR1, 0)) & 0xFFFFFFFF
            self.waited, behind = late * TICK if behind and late >> 31 == 0 else 0, True
            self.clock += ENTRY * self.slower
            uc = self.handler
            uc.reg_write(UC_ARM_REG_SP, (self.background.reg_read(UC_ARM_REG_SP) - FRAME) & ~7)
            uc.reg_write(UC_ARM_REG_LR, RETURN | 1)
            self.executed = 0
            uc.emu_start(self.vector(16 + number) | 1, RETURN)
            self.longest = max(self.longest, self.executed)

    def next_event(self):
        times = [at * TICK for at in self.matches.values() if at is not None] + [at for at, _ in self.coming[:1]]
        return min(times, default=float("inf"))

    def turn(self):
        """Some instructions of the background, and the interrupts that are due then."""
        cost = BACKGROUND * self.slower
        left = (self.next_event() - self.clock) / cost
        count = max(1, min(TURN, int(left) + 1 if left < TURN else TURN))
        self.background.emu_start(self.pc | 1, 0, count=count)
        self.pc = self.background.reg_read(UC_ARM_REG_PC)
        self.clock += count * cost
        self.deepest = min(self.deepest, self.background.reg_read(UC_ARM_REG_SP))
        self.interrupts()

    def type(self, text):
        at = self.clock
        for byte in text.encode() + b"\n":
            at += CHARACTER
            self.coming.append((at, byte))


def run(image, lines, rests, stall=None, slower=1.0):
    """As rp2040.mjs does: what was said and typed, and the edges; and of each edge how long its handler waited for another."""
    chip = Chip(image, slower)
    said, typed, steps, seen, taken, answered, rested = [], [], 0, 0, 0, True, 0.0
    last = 0
    while len([text for _, text in said if text.startswith("rest")]) < rests or chip.clock < rested + 0.005 * HZ:
        assert chip.clock < 3 * HZ, f"it comes to no end: {said}"
        chip.turn()
        for _, levels, *_ in chip.edges[seen:]:
            steps += levels & ~last & 1
            last = levels
        seen = len(chip.edges)
        while (end := chip.console.find(b"\n", taken)) >= 0:
            text = chip.console[taken:end].decode()
            said.append((chip.clock, text))
            taken = end + 1
            answered |= not text.startswith("rest")
            rested = chip.clock
        if said and answered and len(typed) < len(lines):
            condition, text = lines[len(typed)]
            rests_so_far = sum(text.startswith("rest") for _, text in said)
            if steps >= condition.get("steps", 0) and rests_so_far >= condition.get("rests", 0):
                typed.append((chip.clock, text))
                chip.type(text)
                answered = False
        if stall and steps >= stall["steps"]:
            # The processor stands still.
            chip.clock += stall["clocks"]
            stall = None
    stack = chip.vector(0) - chip.deepest
    return {"hz": HZ, "said": said, "typed": typed, "edges": chip.edges, "stack": stack, "interrupt": chip.longest}
