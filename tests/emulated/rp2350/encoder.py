"""An encoder with a HIPERFACE DSL interface, from the manual of the link (SICK 8017595) and the code tables by Franaszek and Widmer
(1983). It shares nothing with the receiver under test.

It hears the line bit by bit, answers one bit after PARA, and knows no messages: its parameter symbol is always IDLE, or INIT after
INIT.
"""

# 5b/6b and 3b/4b for a running disparity of -1, first bit on the line first.
SIX = """100111 011101 101101 110001 110101 101001 011001 111000 111001 100101 010101 110100 001101 101100 011100 010111
011011 100011 010011 110010 001011 101010 011010 111010 110011 100110 010110 110110 001110 101110 011110 101011""".split()
FOUR = "1011 1001 0101 1100 1101 1010 0110 1110".split()
SIX_K28 = "001111"
FOUR_K28 = "1011 0110 1010 1100 1101 0101 1001 0111".split()
ALTERNATE = "0111"

TEST_PATTERN = "0100110011001000000100010101110111111011001100110100010011001"
IDENTIFIER = 0x00153
POSITION_BITS = 32

RESET, SYNC, START, LEARN, CHECK, IDREQ, INIT = 0x1F, 0x19, 0x1A, 0x1B, 0x1C, 0x1D, 0x1E
IDLE, INIT_ANSWER = 0x10, 0x1F
NO_PIPE = 0xFE


def inverse(bits):
    return bits.translate(str.maketrans("01", "10"))


def ones(bits):
    return 2 * bits.count("1") - len(bits)


def encode(byte, disparity, control=False):
    """Ten bits and the running disparity behind them; K30.7 and K28.y are the control characters here."""
    x, y = byte & 31, byte >> 5
    six = SIX_K28 if control and x == 28 else SIX[x]
    if disparity > 0 and (ones(six) or x == 7):
        six = inverse(six)
    middle = disparity if ones(six) == 0 else -disparity
    if control and x == 28:
        four = FOUR_K28[y] if middle < 0 else inverse(FOUR_K28[y])
    else:
        alternate = control or y == 7 and x in ((17, 18, 20) if middle < 0 else (11, 13, 14))
        four = ALTERNATE if y == 7 and alternate else FOUR[y]
        if middle > 0 and (ones(four) or y == 3):
            four = inverse(four)
    return six + four, middle if ones(four) == 0 else -middle


def para():
    """All words of a parameter byte, in either polarity of both blocks."""
    table = {}
    for byte in range(256):
        x, y = byte & 31, byte >> 5
        six = SIX_K28 if x == 28 else SIX[x]
        for first in (six, inverse(six)):
            for second in (FOUR[y], inverse(FOUR[y])):
                if (first == six or ones(six) or x == 7) and (second == FOUR[y] or ones(second) or y == 3):
                    table[first + second] = byte
    return table


PARA = para()


def crc16(data):
    """90D9h, begun with 0, at the end 00FFh."""
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x90D9 if value & 0x8000 else 0)) & 0xFFFF
    return value ^ 0x00FF


def crc5(value):
    """05h over the eleven bits of an acceleration, begun with 0, at the end 1Fh."""
    check = 0
    for bit in range(10, -1, -1):
        check = (check << 1 ^ (0x05 if (check >> 4 ^ value >> bit) & 1 else 0)) & 0x1F
    return check ^ 0x1F


assert crc16(b"123456789") == 0x91C5
assert (0 << 5 | crc5(0), 1 << 5 | crc5(1), (-1 & 0x7FF) << 5 | crc5(-1 & 0x7FF)) == (0x001F, 0x003A, 0xFFF5)


class Encoder:
    """`position(clock)` is where its shaft is. `damage(answer)` may change an answer before it is sent."""

    def __init__(self, position, damage=lambda bits: bits):
        self.position, self.damage = position, damage
        self.heard = ""
        self.begun = None
        self.sampled, self.frame, self.answers = [], 0, 0
        # Position of the sampling edge in each frame that was answered as usual.
        self.truth = []
        self.toggle = 0

    def bit(self, clock, level):
        """A bit that the master drives, and its first clock. Where the last bit of PARA ends: the answer, or None."""
        self.heard = (self.heard + level)[-26:]
        if len(self.heard) < 26 or not self.heard.startswith("001011110110"):
            return None
        byte = PARA.get(self.heard[16:])
        assert byte is not None, f"PARA is no word: {self.heard[16:]}"
        self.heard = ""
        # The falling edge of SAMPLE is 18 bits before the end of PARA.
        return self.answer(byte, clock - 17 * 16)

    def answer(self, byte, edge):
        symbol, first = byte & 31, byte >> 7
        self.sampled = ([self.position(edge)] + self.sampled)[:3]
        if not first and symbol in (RESET, SYNC):
            self.frame = 0
            return None
        self.answers += 1
        if not first and symbol in (START, LEARN, CHECK):
            return self.damage(TEST_PATTERN)
        if not first and symbol == IDREQ:
            low, middle, high = IDENTIFIER & 0xFF, IDENTIFIER >> 8 & 0xFF, IDENTIFIER >> 16
            return self.damage(self.words([(low, 0), (middle, 0), (high << 4 | high, 0), (middle, 0), (low, 0), (0, 0)]))
        assert first, f"PARA {byte:#04x} is no parameter byte"
        return self.damage(self.usual(symbol))

    def usual(self, symbol):
        position, before, third = self.sampled
        self.truth.append(position)
        if self.frame == 0:
            # The safe position is that of the edge before the V-frame.
            self.vertical = [0] + list((before & (1 << 40) - 1).to_bytes(5, "big"))
            self.secondary = [self.toggle << 7 | 0x1C] + list((~before & (1 << 40) - 1).to_bytes(5, "big"))
            for block in (self.vertical, self.secondary):
                block += crc16(block).to_bytes(2, "big")
            self.toggle ^= 1
        at, self.frame = self.frame, (self.frame + 1) % 8
        acceleration = position - 2 * before + third
        assert -1024 <= acceleration < 1024, f"the shaft is moved too fast: {acceleration}"
        word = (acceleration & 0x7FF) << 5 | crc5(acceleration & 0x7FF)
        parameter = (0x80 if at == 7 else 0) | (INIT_ANSWER if symbol == INIT else IDLE)
        return self.words(
            [
                (self.vertical[at], False),
                (parameter, False),
                (NO_PIPE, True),
                (word >> 8, False),
                (word & 0xFF, False),
                (self.secondary[at], at == 0),
            ]
        )

    @staticmethod
    def words(characters):
        """Six words, and before the last of them the inverse of the bit before it."""
        disparity, bits = -1, ""
        for at, (byte, control) in enumerate(characters):
            if at == 5:
                bits += inverse(bits[-1])
            word, disparity = encode(byte, disparity, control)
            bits += word
        return bits
