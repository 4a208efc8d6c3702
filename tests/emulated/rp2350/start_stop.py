"""Encoders at the other end of a start-stop line, written from the documents of their protocols and for this test alone, and the line
between them and the pins of an image.

Both shafts turn by a step with every answer.
"""

DI, DE, RO = 1 << 2, 1 << 3, 1 << 4


class TFormat:
    """All data (ID 3) of an encoder with 23 bits a turn: CF, SF, ABS0 to ABS2, ENID 17h, ABM0 to ABM2, ALMC, CRC (x^8 + 1)."""

    bits, turn_us = 8, 3.0
    enid, almc = 0x17, 0

    def __init__(self):
        self.counts = 0x12_3456

    def answer(self, request):
        """Units of the answer and what a master has to print of it; None: the request is not for this encoder."""
        if request != [0x1A]:
            return None
        self.counts = (self.counts + 0x1_2345) % (1 << 23)
        units = [0x1A, 0, *self.counts.to_bytes(3, "little"), self.enid, 7, 0, 0, self.almc]
        check = 0
        for unit in units:
            check ^= unit
        return units + [check], f"turn 7, {self.counts} counts at "


class AFormat:
    """The whole position (command 0) of encoder 0 with 20 bits a turn: four frames, the last eight bits a CRC-8 (1Dh)."""

    bits, turn_us = 16, 2.8

    def __init__(self):
        self.counts = 0x1_2345

    def answer(self, request):
        # Sync code 0, 1, 0; frame code, address, command and their CRC-3 are 0.
        if request != [0b010]:
            return None
        self.counts = (self.counts + 0x1235) % (1 << 20)
        position = 7 << 20 | self.counts
        # Sync code 0, 0, 1; address, command, the fixed bit and the status are 0. All fields begin with their lowest bit.
        line = [0, 0, 1] + [0] * 13 + [position >> k & 1 for k in range(40)]
        check = 0
        for bit in line:
            check = check << 1 & 0xFF ^ (0x1D if check >> 7 ^ bit else 0)
        # The CRC begins with its highest.
        line += [check >> 7 - k & 1 for k in range(8)]
        units = [sum(bit << k for k, bit in enumerate(line[at : at + 16])) for at in range(0, 64, 16)]
        return units, f"turn 7, {self.counts} counts at "


class Exchange:
    """A request and what came of it; times in clocks."""

    def __init__(self, begin):
        self.begin, self.end = begin, None
        self.edges = []
        self.asked, self.units, self.value = None, None, None
        self.answer_at = self.answer_end = None


class Line:
    """A line of `clocks` clocks a bit: a transceiver whose receiver is off while it drives, a pull-up, and an encoder. `faults` has, by the
    number of an exchange, functions that hurt it: `fault(line, exchange)` when the request has ended."""

    def __init__(self, encoder, clocks, us, faults):
        self.encoder, self.clocks, self.us, self.faults = encoder, clocks, us, faults
        self.unit = (encoder.bits + 2) * clocks
        self.driven, self.level = False, 1
        self.exchanges = []
        # Clocks by which the answer is late; what becomes of a level at a clock; whether the encoder hears.
        self.late, self.change, self.deaf = 0, None, False

    def changed(self, clock, levels, _directions):
        """PIO drives these levels now."""
        driven, level = bool(levels & DE), int(bool(levels & DI))
        if driven and not self.driven:
            self.exchanges.append(Exchange(clock))
        if driven and (level != self.level or not self.driven):
            self.exchanges[-1].edges.append((clock, level))
        if self.driven and not driven:
            self.asked(self.exchanges[-1], clock)
        self.driven, self.level = driven, level

    def asked(self, exchange, clock):
        """The driver went off."""
        exchange.end = clock
        exchange.asked = self.units(exchange.edges)
        self.late, self.change, self.deaf = 0, None, False
        fault = self.faults.get(len(self.exchanges) - 1)
        if fault:
            fault(self, exchange)
        answer = None if self.deaf else self.encoder.answer([value for _, value, _ in exchange.asked])
        if answer:
            exchange.units, exchange.value = answer
            exchange.answer_at = exchange.asked[-1][0] + self.unit + round(self.encoder.turn_us * self.us) + self.late
            exchange.answer_end = exchange.answer_at + len(exchange.units) * self.unit

    def units(self, edges):
        """Start-stop units: the clock of the start bit, the value, whether the stop bit is 1."""

        def level(at):
            return next((level for clock, level in reversed(edges) if clock <= at), 1)

        found, after = [], -1
        for at, high in edges:
            if high or at < after:
                continue
            middle = [at + k * self.clocks + self.clocks // 2 for k in range(self.encoder.bits + 2)]
            found.append((at, sum(level(clock) << k for k, clock in enumerate(middle[1:-1])), level(middle[-1])))
            after = middle[-1]
        return found

    def inputs(self, clock):
        """RO: high while the master drives, for /RE is tied to DE, and while nobody does."""
        if self.driven or not self.exchanges:
            return RO
        exchange, level = self.exchanges[-1], 1
        if exchange.answer_at is not None and exchange.answer_at <= clock < exchange.answer_end:
            unit, at = divmod(clock - exchange.answer_at, self.unit)
            at //= self.clocks
            level = 0 if at == 0 else 1 if at > self.encoder.bits else exchange.units[unit] >> at - 1 & 1
        if self.change:
            level = self.change(clock, level)
        return RO if level else 0
