"""Channels of DMA of the RP2350, as far as its data sheet (chapter DMA) tells it and images here need it: requests of one PIO block,
chains, rings on either address, the aliases that start a channel, reload of the count.

One transfer at a time for all channels, each in `clocks`. Left out: the sniffer, interrupts, priorities.
"""

ALIASES = [
    # read, write, count, control of the four aliases; the last register of each starts the channel
    ("read", "write", "count", "control"),
    ("control", "read", "write", "count"),
    ("control", "count", "read", "write"),
    ("control", "write", "count", "read"),
]
PERMANENT = 0x3F


class Channel:
    """Registers of one channel."""

    def __init__(self, number):
        self.number = number
        self.read = self.write = self.count = self.left = self.control = 0
        self.busy = False


class Dma:
    """All channels. `bus` has `load(address, size)` and `store(address, size, value)`; `request(number)` says whether a
    peripheral asks for a transfer."""

    def __init__(self, bus, request, clocks):
        self.channels = [Channel(number) for number in range(16)]
        self.bus, self.request, self.clocks = bus, request, clocks
        # When it is free again.
        self.time = 0
        self.order = 0
        # Called with the channel when one starts.
        self.on_start = None

    def start(self, channel):
        if channel.control & 1 and not channel.busy:
            channel.busy, channel.left = True, channel.count & 0x0FFFFFFF
            if self.on_start:
                self.on_start(channel)

    def earliest(self, now):
        """When the next transfer can be made; None: none is asked for."""
        if any(self.wants(channel) for channel in self.channels[:4]):
            return max(now, self.time)
        return None

    def wants(self, channel):
        if not channel.busy:
            return False
        wanted = channel.control >> 17 & 0x3F
        return wanted == PERMANENT or self.request(wanted)

    def step(self, now):
        """One transfer of the channel whose turn it is."""
        for k in range(4):
            channel = self.channels[(self.order + k) % 4]
            if self.wants(channel):
                self.order = (channel.number + 1) % 4
                self.time = now + self.clocks
                self.transfer(channel)
                return

    def transfer(self, channel):
        size = 1 << (channel.control >> 2 & 3)
        value = self.bus.load(channel.read, size)
        if channel.control >> 24 & 1:
            value = int.from_bytes(value.to_bytes(size, "little"), "big")
        target = channel.write
        channel.left -= 1
        done = channel.left == 0
        if channel.control >> 4 & 1:
            channel.read = self.next(channel, channel.read, size, 0)
        if channel.control >> 6 & 1:
            channel.write = self.next(channel, channel.write, size, 1)
        if done:
            channel.busy = False
        self.bus.store(target, size, value)
        if done:
            chained = channel.control >> 13 & 15
            if chained != channel.number:
                self.start(self.channels[chained])

    @staticmethod
    def next(channel, address, size, which):
        """The next address; it wraps in the ring if this one does."""
        ring = channel.control >> 8 & 15
        if ring == 0 or channel.control >> 12 & 1 != which:
            return address + size
        mask = (1 << ring) - 1
        return address & ~mask | address + size & mask

    def registers(self, offset):
        channel, register = self.channels[offset // 0x40], offset % 0x40 // 4
        return channel, ALIASES[register // 4][register % 4], register % 4 == 3

    def load(self, offset):
        if offset < 0x400:
            channel, name, _ = self.registers(offset)
            if name == "control":
                return channel.control | channel.busy << 26
            return channel.left if name == "count" else getattr(channel, name)
        return 0

    def store(self, offset, value):
        if offset < 0x400:
            channel, name, starts = self.registers(offset)
            if name == "control":
                value &= ~(1 << 26)
            setattr(channel, name, value)
            if starts and value:
                self.start(channel)
        elif offset == 0x450:
            for channel in self.channels:
                if value >> channel.number & 1:
                    self.start(channel)
        elif offset == 0x464:
            for channel in self.channels:
                if value >> channel.number & 1:
                    channel.busy = False
