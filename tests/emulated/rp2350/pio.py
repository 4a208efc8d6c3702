"""A PIO block of the RP2350, as far as its data sheet (chapter PIO) tells it and programs here need it: four state machines with
automatic push and pull, joined FIFOs, side-set, delays, whole clock dividers and the flags between machines, to the clock.

Left out, and refused when met: fractional clock dividers, MOV to and from FIFO words, EXEC of stalling instructions, flags of a machine's
own (REL) and of other blocks.
"""

from collections import deque

MASK = 0xFFFFFFFF
FIFO = 4
# RO passes two flip-flops before a state machine sees it.
SYNCHRONISER = 2


class StateMachine:
    """One machine; `pins` is the block, which knows levels."""

    def __init__(self, number, block):
        self.number, self.block = number, block
        self.clkdiv, self.execctrl, self.shiftctrl, self.pinctrl = 0x10000, 0x1F000, 0xC0000, 0x14000000
        self.tx, self.rx = deque(), deque()
        self.enabled = False
        self.time = 0
        self.restart()
        self.pc = self.x = self.y = 0

    def restart(self):
        """Shift counters and the output register are empty."""
        self.isr = self.isr_bits = self.osr = 0
        self.osr_bits = 32

    def depth(self, direction):
        """Words of the FIFO to or from the machine, with both joined or not."""
        join_tx, join_rx = self.shiftctrl >> 30 & 1, self.shiftctrl >> 31 & 1
        if direction == "tx":
            return 0 if join_rx else 2 * FIFO if join_tx else FIFO
        return 0 if join_tx else 2 * FIFO if join_rx else FIFO

    def set_shiftctrl(self, value):
        """A change of the joining empties the FIFOs."""
        if (value ^ self.shiftctrl) >> 30:
            self.tx.clear()
            self.rx.clear()
        self.shiftctrl = value

    def threshold(self, shift):
        return self.shiftctrl >> shift & 31 or 32

    def step(self):
        """One instruction at `time`, which moves on; a machine that stalls tries again a cycle later."""
        assert self.clkdiv & 0xFF00 == 0, "a machine with a fractional clock divider"
        cycle = self.clkdiv >> 16 or 0x10000
        code = self.block.memory[self.pc]
        done = self.execute(code)
        self.block.tell(self.time)
        if done:
            top, bottom = self.execctrl >> 12 & 31, self.execctrl >> 7 & 31
            if not self.jumped:
                self.pc = bottom if self.pc == top else self.pc + 1 & 31
            self.time += cycle * (1 + (code >> 8 & (1 << 5 - self.side_bits()) - 1))
        else:
            self.time += cycle

    def side_bits(self):
        """How many bits of the delay field are side-set."""
        return self.pinctrl >> 29

    def execute(self, code):
        """Whether the instruction was done. Its side-set takes place even if it stalls."""
        if self.side_bits():
            assert self.execctrl >> 29 & 3 == 0, "side-set that is optional, or of directions"
            self.block.drive(self.pinctrl >> 10 & 31, self.side_bits(), (code >> 8 & 31) >> 5 - self.side_bits())
        self.jumped = False
        kind, operand, data = code >> 13, code >> 5 & 7, code & 31
        if kind == 0:
            return self.jump(operand, data)
        if kind == 1:
            return self.wait(code >> 7 & 1, code >> 5 & 3, data)
        if kind == 2 and operand == 0:
            return self.take(data or 32)
        if kind == 3:
            return self.put(operand, data or 32)
        if kind == 4 and data == 0:
            return self.pull_word(operand & 3) if operand >> 2 else self.push_word(operand & 3)
        if kind == 5:
            return self.move(operand, data)
        if kind == 6 and operand & 6 == 0 and data < 8:
            assert operand == 0, "an IRQ instruction that waits"
            self.block.flags |= 1 << data
            return True
        if kind == 7:
            return self.set(operand, data)
        raise AssertionError(f"instruction {code:#06x} is not modelled")

    def wait(self, polarity, source, index):
        """WAIT PIN, counted from the first input pin, and WAIT IRQ, which takes the flag away."""
        if source == 1:
            level = self.block.inputs(self.time - SYNCHRONISER) >> (self.pinctrl >> 15 & 31) + index & 1
            return level == polarity
        assert source == 2 and polarity == 1 and index < 8, f"WAIT for source {source} is not modelled"
        came = self.block.flags >> index & 1
        self.block.flags &= ~(came << index)
        return bool(came)

    def pull_word(self, how):
        """PULL, which gives X if it does not block and nothing is there."""
        assert how >> 1 == 0, "PULL IFEMPTY is not modelled"
        if not self.tx and how & 1:
            return False
        self.osr, self.osr_bits = self.tx.popleft() if self.tx else self.x, 0
        return True

    def push_word(self, how):
        """PUSH that blocks."""
        assert how == 1, "only PUSH BLOCK is modelled"
        return self.push()

    def move(self, target, data):
        """MOV without an operation between X, Y, OSR and ISR."""
        assert data >> 3 == 0, "MOV with an operation is not modelled"
        value = {1: self.x, 2: self.y, 3: 0, 6: self.isr, 7: self.osr}[data & 7]
        assert target in (1, 2), f"MOV to {target} is not modelled"
        if target == 1:
            self.x = value
        else:
            self.y = value
        return True

    def jump(self, condition, target):
        if condition == 0:
            taken = True
        elif condition == 2:
            taken, self.x = self.x != 0, self.x - 1 & MASK
        elif condition == 4:
            taken, self.y = self.y != 0, self.y - 1 & MASK
        elif condition == 5:
            taken = self.x != self.y
        else:
            raise AssertionError(f"condition {condition} is not modelled")
        if taken:
            self.pc, self.jumped = target, True
        return True

    def take(self, count):
        """IN PINS, with automatic push."""
        if self.shiftctrl >> 16 & 1 and self.isr_bits >= self.threshold(20):
            # The push of the last word is still to be done.
            if not self.push():
                return False
        value = self.block.inputs(self.time - SYNCHRONISER) >> (self.pinctrl >> 15 & 31) & (1 << count) - 1
        if self.shiftctrl >> 18 & 1:
            self.isr = self.isr >> count | value << 32 - count
        else:
            self.isr = (self.isr << count | value) & MASK
        self.isr_bits = min(32, self.isr_bits + count)
        if self.shiftctrl >> 16 & 1 and self.isr_bits >= self.threshold(20):
            self.push()
        return True

    def push(self):
        if len(self.rx) >= self.depth("rx"):
            self.block.fdebug |= 1 << self.number
            return False
        self.rx.append(self.isr)
        self.isr = self.isr_bits = 0
        return True

    def put(self, target, count):
        """OUT, with automatic pull."""
        if self.osr_bits >= self.threshold(25) and self.shiftctrl >> 17 & 1:
            if not self.tx:
                self.block.fdebug |= 1 << 24 + self.number
                return False
            self.osr, self.osr_bits = self.tx.popleft(), 0
        assert self.shiftctrl >> 19 & 1, "out to the left is not modelled"
        value, self.osr = self.osr & (1 << count) - 1, self.osr >> count
        self.osr_bits = min(32, self.osr_bits + count)
        if target == 0:
            self.block.drive(self.pinctrl & 31, self.pinctrl >> 20 & 63, value)
        elif target == 1:
            self.x = value
        elif target == 2:
            self.y = value
        elif target != 3:
            raise AssertionError(f"OUT to {target} is not modelled")
        return True

    def set(self, target, data):
        if target == 0:
            self.block.drive(self.pinctrl >> 5 & 31, self.pinctrl >> 26 & 7, data)
        elif target == 1:
            self.x = data
        elif target == 2:
            self.y = data
        elif target == 4:
            self.block.direct(self.pinctrl >> 5 & 31, self.pinctrl >> 26 & 7, data)
        else:
            raise AssertionError(f"SET {target} is not modelled")
        return True


class Pio:
    """The block: its registers, and the pins. `line(time, levels, directions)` is told each change, `inputs(time)` asks."""

    def __init__(self, inputs, changed):
        self.memory = [0] * 32
        self.machines = [StateMachine(number, self) for number in range(4)]
        self.inputs, self.changed = inputs, changed
        self.levels = self.directions = self.fdebug = self.flags = 0
        self.told = 0
        self.time = 0

    def drive(self, base, count, value):
        mask = ((1 << count) - 1) << base
        self.levels = self.levels & ~mask | value << base & mask

    def tell(self, time):
        """An instruction changes the pins of its side-set and its own at once."""
        if self.levels != self.told:
            self.told = self.levels
            self.changed(time, self.levels, self.directions)

    def direct(self, base, count, value):
        mask = ((1 << count) - 1) << base
        self.directions = self.directions & ~mask | value << base & mask

    def earliest(self):
        """When the next instruction is due; None: nothing runs."""
        return min((machine.time for machine in self.machines if machine.enabled), default=None)

    def step(self, time):
        """The instructions that are due at this clock."""
        for machine in self.machines:
            if machine.enabled and machine.time <= time:
                machine.step()

    def read(self, offset):
        machines = self.machines
        if offset == 0x00:
            return sum(machine.enabled << machine.number for machine in machines)
        if offset == 0x04:
            return sum(
                (len(m.rx) >= m.depth("rx")) << m.number
                | (not m.rx) << 8 + m.number
                | (len(m.tx) >= m.depth("tx")) << 16 + m.number
                | (not m.tx) << 24 + m.number
                for m in machines
            )
        if offset == 0x08:
            return self.fdebug
        if offset == 0x30:
            return self.flags
        if 0x20 <= offset < 0x30:
            rx = machines[(offset - 0x20) // 4].rx
            return rx.popleft() if rx else 0
        if 0xC8 <= offset < 0x128:
            number, register = divmod(offset - 0xC8, 0x18)
            machine = machines[number]
            values = [machine.clkdiv, machine.execctrl, machine.shiftctrl, machine.pc, 0, machine.pinctrl]
            return values[register // 4]
        return 0

    def write(self, offset, value, now):
        machines = self.machines
        if offset == 0x00:
            for machine in machines:
                if value >> 4 + machine.number & 1:
                    machine.restart()
                on = bool(value >> machine.number & 1)
                if on and not machine.enabled:
                    machine.time = now + 1
                machine.enabled = on
        elif offset == 0x08:
            self.fdebug &= ~value
        elif 0x10 <= offset < 0x20:
            machine = machines[(offset - 0x10) // 4]
            if len(machine.tx) < machine.depth("tx"):
                machine.tx.append(value)
        elif offset == 0x30:
            self.flags &= ~value
        elif offset == 0x34:
            self.flags |= value & 0xFF
        elif 0x48 <= offset < 0xC8:
            self.memory[(offset - 0x48) // 4] = value & 0xFFFF
        elif 0xC8 <= offset < 0x128:
            number, register = divmod(offset - 0xC8, 0x18)
            machine = machines[number]
            if register == 0x00:
                machine.clkdiv = value
            elif register == 0x04:
                machine.execctrl = value
            elif register == 0x08:
                machine.set_shiftctrl(value)
            elif register == 0x10:
                machine.time = now
                assert machine.execute(value & 0xFFFF), "an instruction that was executed at once stalls"
                self.tell(now)
            elif register == 0x14:
                machine.pinctrl = value
