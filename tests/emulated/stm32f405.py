"""Runs the STM32F405 image under QEMU against the encoder model of `tformat`, and hurts the line between them.

    python3 stm32f405.py IMAGE ENCODER

IMAGE is the ELF file, ENCODER a program that answers requests at standard input and output. QEMU's USART has no bit time, so this
proves what is said and that faults are over with the next exchange, and nothing about time.
"""

import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time

EXCHANGES = 120
# How long the line takes, as the image believes an answer to be older than its request if it comes at once.
LINE_S = 0.002
READ_ALL, READ_EEPROM = b"\x1a", b"\xea"


def connect(path):
    """The socket that QEMU opens soon."""
    end = time.monotonic() + 30
    while True:
        line = socket.socket(socket.AF_UNIX)
        try:
            line.connect(path)
            return line
        except OSError:
            line.close()
            assert time.monotonic() < end, "QEMU does not open " + path
            time.sleep(0.05)


# By the number of the exchange. Noise before or behind an answer is noticed or not, or in the next exchange, by how QEMU hands the
# bytes over.
NOTICED, PERHAPS = {10, 20, 30}, {40, 50, 51}


def hurt(number, answer):
    """What becomes of the answer to exchange `number`."""
    return {
        10: b"",
        20: answer[:5] + bytes([answer[5] ^ 0x04]) + answer[6:],
        30: answer[:7],
        40: b"\x00" + answer,
        50: answer + b"\x55\xaa",
    }.get(number, answer)


class Line(threading.Thread):
    """The wire: requests to the encoder, answers back, some of them hurt."""

    def __init__(self, wire, encoder):
        super().__init__(daemon=True)
        self.wire, self.encoder = wire, encoder
        self.requests, self.answers = 0, []

    def run(self):
        try:
            while self.exchange():
                pass
        except OSError:
            pass  # the test is over

    def exchange(self):
        """One request and its answer; False at the end."""
        request = self.wire.recv(1)
        if request == READ_EEPROM:
            request += self.wire.recv(2, socket.MSG_WAITALL)
        self.encoder.stdin.write(request)
        self.encoder.stdin.flush()
        if request == READ_ALL:
            answer = self.encoder.stdout.read(11)
            if len(answer) < 11:
                return False  # the encoder has ended, as at the end of the test
            self.answers.append(answer)
            answer = hurt(self.requests, answer)
            self.requests += 1
        else:
            answer = self.encoder.stdout.read(4)
        time.sleep(LINE_S)
        self.wire.sendall(answer)
        return bool(request)


def main():
    image, program = sys.argv[1:]
    folder = tempfile.mkdtemp()
    wire, console = os.path.join(folder, "wire"), os.path.join(folder, "console")
    qemu = subprocess.Popen(
        ["qemu-system-arm", "-machine", "netduinoplus2", "-display", "none", "-monitor", "none"]
        + ["-chardev", f"socket,id=wire,path={wire},server=on,wait=on", "-serial", "chardev:wire"]
        + ["-chardev", f"file,id=console,path={console}", "-serial", "chardev:console", "-kernel", image]
    )
    encoder = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        line = Line(connect(wire), encoder)
        line.start()
        end = time.monotonic() + 60
        while line.requests < EXCHANGES and time.monotonic() < end:
            time.sleep(0.05)
            assert qemu.poll() is None, "QEMU has ended"
        said = open(console, encoding="ascii", errors="replace").read()
    finally:
        qemu.kill()
        encoder.kill()
        qemu.wait()
        encoder.wait()
    check(said, line)


def check(said, line):
    assert line.requests >= EXCHANGES, f"{line.requests} exchanges\n{said}"
    assert said.startswith("stm32f405: no clock gets ready, so no rate is right\nEEPROM 0: ff\n"), said
    carried = set()
    for answer in line.answers:
        parity = 0
        for byte in answer:
            parity ^= byte
        assert parity == 0 and answer[:1] == READ_ALL, answer.hex()
        carried.add((int.from_bytes(answer[2:5], "little"), int.from_bytes(answer[6:9], "little"), answer[5] == 0x17))
    printed = re.findall(r"^turn (\d+), (\d+) counts at \d+ ns, (\d+) good, (\d+) bad\nstack (\d+) bytes$", said, re.M)
    assert len(printed) >= 6, said
    values = [int(abs_) for _, abs_, *_ in printed]
    assert values == sorted(set(values)), values
    for abm, abs_, *_ in printed:
        assert (int(abs_), int(abm), True) in carried, f"{abs_} was not on the wire"
    failed = re.findall(r"^fault: .*, (\d+) good, (\d+) bad$", said, re.M)
    numbers = {int(good) + int(bad) - 1 for good, bad in failed}
    assert NOTICED <= numbers <= NOTICED | PERHAPS, f"a fault costs its own exchange and no other: {said}"
    stack = max(int(stack) for *_, stack in printed)
    if "FIGURES" in os.environ:
        with open(os.environ["FIGURES"], "a", encoding="ascii") as figures:
            figures.write(f"servowire-stm32f405\tstack\t{stack}\n")
    print(f"stm32f405: {line.requests} exchanges, {len(failed)} of 5 hurt ones noticed, the rest good; stack {stack} bytes")
    print("\n".join("  " + line for line in said.splitlines() if line.startswith("fault")))


main()
