"""An RP2350 that runs an unmodified image: both Cortex-M33 in `unicorn` over one memory, PIO 0, DMA, the FIFOs and spin locks of SIO,
a timer, the SysTicks, a UART, and as much of clocks and resets as a start needs.

Time is clocks of the system. What an instruction takes is a table (`clocks_of`), times a scale; a branch that is taken costs two
more; flash costs `flash` clocks more for each eight bytes that were not read lately. That is not true to the cycle, so a test
asks for the same result over a range of scales.

Left out: contention on the bus, dual issue, interrupts, sleeping (WFE is made a NOP), the time that the UART needs.
"""

import ctypes
from collections import deque

from elftools.elf.elffile import ELFFile
from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB, UC_PROT_ALL, Uc, UcError
from unicorn.arm_const import UC_ARM_REG_FPEXC, UC_ARM_REG_PC, UC_ARM_REG_SP, UC_CPU_ARM_CORTEX_M33

from dma import Dma
from pio import Pio

FLASH, RAM = 0x10000000, 0x20000000
FLASH_BYTES, RAM_BYTES = 0x200000, 0x82000
CLOCK_HZ = 150_000_000
# Clocks for which one core runs before the other does.
TURN = 64
WFE = b"\x20\xbf"
# SYST_CVR of either core.
SYSTICK_NOW = 0xE000E018


def clocks_of(code):
    """Clocks of an instruction, without what a taken branch adds."""
    first = code[0] | code[1] << 8
    if len(code) == 2:
        if first >> 9 in (0b1011010, 0b1011110):
            return 1 + (first & 0x1FF).bit_count()
        if first >> 12 == 0b1100:
            return 1 + (first & 0xFF).bit_count()
        loads = first >> 11 in (0b01001, 0b01101, 0b01111, 0b10001, 0b10011) or first >> 9 in range(0b0101011, 0b0110000)
        return 2 if loads else 1
    second = code[2] | code[3] << 8
    if first & 0xFE40 == 0xE800:
        return 1 + second.bit_count()
    if first & 0xFE40 == 0xE840:
        return 3
    if first & 0xFE10 == 0xF810:
        return 2
    if first & 0xFF80 == 0xFB80:
        return 8 if second & 0xF0 == 0xF0 else 2
    return 1


class Core:
    """One processor."""

    def __init__(self, chip, number):
        self.chip, self.number = chip, number
        self.clock, self.stop, self.after = 0.0, 0.0, None
        self.instructions = 0
        self.costs, self.waits, self.lately = {}, set(), deque(maxlen=2048)
        self.cached = set()
        self.ticked = 0
        uc = self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M33)
        uc.mem_map_ptr(FLASH, FLASH_BYTES, UC_PROT_ALL, ctypes.addressof(chip.flash))
        uc.mem_map_ptr(RAM, RAM_BYTES, UC_PROT_ALL, ctypes.addressof(chip.ram))
        for base, size in ((0x40000000, 0x170000), (0x50000000, 0x500000), (0xD0000000, 0x40000), (0xE0000000, 0x100000)):
            uc.mmio_map(base, size, self.read, base, self.write, base)
        uc.hook_add(UC_HOOK_CODE, self.instruction)
        uc.reg_write(UC_ARM_REG_FPEXC, 0x40000000)

    def instruction(self, uc, address, size, _):
        cost = self.costs.get(address)
        if cost is None:
            code = bytes(uc.mem_read(address, size))
            cost = self.costs[address] = clocks_of(code) * self.chip.scale
            if code == WFE:
                self.waits.add(address)
        if address in self.waits:
            # Nothing would wake it; whoever waits looks again.
            uc.reg_write(UC_ARM_REG_PC, address + size | 1)
        if address != self.after:
            cost += 2 * self.chip.scale
        if address < RAM and self.chip.flash_clocks:
            cost += self.fetch(address >> 3)
        self.after = address + size
        self.clock += cost
        self.instructions += 1
        if self.clock >= self.stop:
            uc.emu_stop()

    def systick(self):
        """Counts 24 bits down with the clock, from the last write on."""
        return (self.ticked - int(self.clock)) & 0xFFFFFF

    def fetch(self, line):
        """What it costs to have these eight bytes of flash."""
        if line in self.cached:
            return 0
        if len(self.lately) == self.lately.maxlen:
            self.cached.discard(self.lately[0])
        self.lately.append(line)
        self.cached.add(line)
        return self.chip.flash_clocks

    def run(self, until):
        self.stop = until
        if self.clock < until:
            try:
                self.uc.emu_start(self.uc.reg_read(UC_ARM_REG_PC) | 1, 0)
            except UcError as error:
                raise AssertionError(f"core {self.number}: {error} at {self.uc.reg_read(UC_ARM_REG_PC):#x}") from error

    def read(self, _uc, offset, size, base):
        return self.chip.load(self, base + offset, size)

    def write(self, _uc, offset, size, value, base):
        self.chip.store(self, base + offset, size, value)


class Chip:
    """The whole. `changed(clock, levels, directions)` is told of pins that PIO 0 drives, `inputs(clock)` gives all levels."""

    def __init__(self, path, inputs, changed, scale=1.0, flash_clocks=0, dma_clocks=4, hz=CLOCK_HZ):
        self.hz = hz
        self.scale, self.flash_clocks = scale, flash_clocks
        self.flash, self.ram = (ctypes.c_ubyte * FLASH_BYTES)(), (ctypes.c_ubyte * RAM_BYTES)()
        self.elf = ELFFile(open(path, "rb"))
        for segment in self.elf.iter_segments():
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                data = segment.data()
                ctypes.memmove(ctypes.addressof(self.flash) + segment["p_paddr"] - FLASH, data, len(data))
        self.symbols = {s.name: s["st_value"] for s in self.elf.get_section_by_name(".symtab").iter_symbols()}
        self.registers = {}
        self.fifos = [deque(), deque()]
        self.locks = [False] * 32
        self.launched, self.launching = False, []
        self.console = bytearray()
        self.fed = 0
        self.pio = Pio(inputs, changed)
        self.dma = Dma(self, self.request, dma_clocks)
        self.now = 0
        self.cores = [Core(self, 0), Core(self, 1)]
        table = self.elf.get_section_by_name(".vector_table")["sh_addr"] - FLASH
        stack, entry = (int.from_bytes(bytes(self.flash[table + at : table + at + 4]), "little") for at in (0, 4))
        self.cores[0].uc.reg_write(UC_ARM_REG_SP, stack)
        self.cores[0].uc.reg_write(UC_ARM_REG_PC, entry | 1)

    def symbol(self, part):
        """The address of the one symbol whose name has this part."""
        found = {value for name, value in self.symbols.items() if part in name}
        assert len(found) == 1, f"{len(found)} symbols are called {part}"
        return found.pop()

    def watch(self, address, size, told):
        """`told(clock, address)` for each word that a processor writes there."""
        for core in self.cores:
            hook = lambda _uc, _kind, at, _size, _value, core: told(core.clock, at)
            core.uc.hook_add(UC_HOOK_MEM_WRITE, hook, core, address, address + size - 1)

    def run(self, clocks, done):
        """Until `done()` says so, at most for so many clocks more."""
        end = self.now + clocks
        while not done():
            assert self.now < end, f"not done after {clocks} clocks; console: {bytes(self.console)!r}"
            until = self.now + TURN
            self.cores[0].run(until)
            if self.launched:
                self.cores[1].run(until)
            self.advance(until)

    def advance(self, until):
        """PIO and DMA."""
        pio, dma = self.pio, self.dma
        while True:
            first, transfer = pio.earliest(), dma.earliest(self.now)
            if transfer is not None and transfer <= until and (first is None or transfer <= first):
                self.now = max(self.now, transfer)
                dma.step(transfer)
            elif first is not None and first <= until:
                self.now = max(self.now, first)
                pio.step(first)
            else:
                break
        self.now = max(self.now, until)

    def request(self, number):
        """Requests 0 to 3: room in the FIFO to a machine of PIO 0; 4 to 7: words from one."""
        assert number < 8, f"request {number} is not modelled"
        machine = self.pio.machines[number % 4]
        return bool(machine.rx) if number >= 4 else len(machine.tx) < machine.depth("tx")

    def load(self, core, address=None, size=4):
        """A read by a processor, or by DMA: `load(address, size)`."""
        if not isinstance(core, Core):
            core, address, size = None, core, address
            if RAM <= address < RAM + RAM_BYTES:
                return int.from_bytes(bytes(self.ram[address - RAM : address - RAM + size]), "little")
        else:
            self.advance(int(core.clock))
        if address >> 28 == 0xD:
            return self.sio(core, address & 0xFFF)
        if address == SYSTICK_NOW:
            return core.systick()
        block, offset = address & ~0x3FFF, address & 0xFFF
        if block == 0x50000000:
            return self.dma.load(offset)
        if block == 0x50200000:
            return self.pio.read(offset)
        return self.plain(address, block, offset, core)

    def plain(self, address, block, offset, core):
        """What a start asks of clocks, resets and the rest."""
        value = self.registers.get(block | offset, 0)
        if block == 0x40020000 and offset == 0x08:
            return 0xFFFFFFFF
        if block == 0x40048000 and offset == 0x04:
            return 1 << 31 | 1 << 12
        if block in (0x40050000, 0x40058000) and offset == 0:
            return value | 1 << 31
        if block == 0x40010000 and offset in (0x38, 0x44):
            return 1 << (self.registers.get(block | offset - 8, 0) & 3)
        if block == 0x400B0000 and offset in (0x24, 0x28):
            micros = int(core.clock) * 1_000_000 // self.hz
            return micros >> 32 if offset == 0x24 else micros & 0xFFFFFFFF
        if block == 0x40070000 and offset == 0x18:
            return 0x90
        return value

    def store(self, core, address, size, value=None):
        """A write by a processor, or by DMA: `store(address, size, value)`."""
        if not isinstance(core, Core):
            core, address, size, value = None, core, address, size
            if RAM <= address < RAM + RAM_BYTES:
                self.ram[address - RAM : address - RAM + size] = value.to_bytes(4, "little")[:size]
                return
        else:
            self.advance(int(core.clock))
        if address >> 28 == 0xD:
            self.store_sio(core, address & 0xFFF, value)
            return
        if address == SYSTICK_NOW:
            core.ticked = int(core.clock)
            return
        block, offset, kind = address & ~0x3FFF, address & 0xFFF, address >> 12 & 3
        if kind:
            old = self.load(block | offset, 4) if block >> 28 == 5 else self.registers.get(block | offset, 0)
            value = (None, old ^ value, old | value, old & ~value)[kind]
        if block == 0x50000000:
            self.dma.store(offset, value)
        elif block == 0x50200000:
            self.pio.write(offset, value, self.now)
        elif block == 0x40070000 and offset == 0:
            self.console.append(value & 0xFF)
        else:
            self.fed += (block, offset) == (0x400D8000, 0x04)
            self.registers[block | offset] = value

    def sio(self, core, offset):
        if offset == 0:
            return core.number
        mine, other = self.fifos[core.number], self.fifos[1 - core.number]
        if offset == 0x50:
            return bool(mine) | (len(other) < 4) << 1
        if offset == 0x58:
            return mine.popleft() if mine else 0
        if 0x100 <= offset < 0x180:
            at = (offset - 0x100) // 4
            taken, self.locks[at] = self.locks[at], True
            return 0 if taken else 1 << at
        return 0

    def store_sio(self, core, offset, value):
        if offset == 0x54 and core.number == 0 and not self.launched:
            self.launch(value)
        elif offset == 0x54:
            self.fifos[1 - core.number].append(value)
        elif 0x100 <= offset < 0x180:
            self.locks[(offset - 0x100) // 4] = False

    def launch(self, value):
        """The boot ROM of core 1 gives each word back, and starts after 0, 0, 1, vector table, stack, entry."""
        self.fifos[0].append(value)
        self.launching = (self.launching + [value])[-6:]
        if self.launching[:3] == [0, 0, 1] and len(self.launching) == 6:
            uc = self.cores[1].uc
            uc.reg_write(UC_ARM_REG_SP, self.launching[4])
            uc.reg_write(UC_ARM_REG_PC, self.launching[5] | 1)
            self.cores[1].clock = self.cores[0].clock
            self.launched = True
