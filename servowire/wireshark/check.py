#!/usr/bin/env python3
"""Runs the dissector of this folder over what `servowire cnc` writes, and recounts what `servowire cnc` prints.

    check.py [SERVOWIRE]        the program, target/release/servowire by default

1. tshark with sorte.lua takes every packet, finds every check right and nothing malformed; after a flip it finds that.
2. Everything that the report of `servowire cnc` says about steps, pulses and frames is counted again from the VCD and the
   pcapng, with a reader of both formats of its own and nothing from the program but its output files.

Needs tshark (apt-get install tshark). Exit code 0, or 1 with the first thing that differs.
"""

import re
import struct
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
BYTE = 80
PREAMBLE = 2
DEVICE_FRAME = 6
PERIOD = 4000
TRIGGER = 500


def fail(text):
    print(f"check.py: {text}", file=sys.stderr)
    sys.exit(1)


def same(what, want, got):
    if want != got:
        fail(f"{what}: the report says {want}, the recount {got}")


def cnc(program, folder, *arguments):
    """The report, with the files m.vcd and m.pcapng in `folder`. Both outcomes are fine here."""
    files = ["--vcd", folder / "m.vcd", "--pcapng", folder / "m.pcapng", "--record-cycles", "100000000"]
    run = subprocess.run([program, "cnc", *arguments, *files], capture_output=True, text=True)
    if run.returncode not in (0, 1):
        fail(run.stderr)
    return run.stdout, run.returncode


def tshark(path, *fields):
    command = ["tshark", "-X", f"lua_script:{HERE / 'sorte.lua'}", "-r", str(path), "-T", "fields"]
    for field in fields:
        command += ["-e", field]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode != 0:
        fail(run.stderr)
    return [line.split("\t") for line in run.stdout.splitlines()]


def dissected(folder, packets):
    rows = tshark(folder / "m.pcapng", "_ws.col.Protocol", "sorte.type", "sorte.io.address", "sorte.crc_good", "_ws.expert.message")
    if len(rows) != len(packets):
        fail(f"{len(rows)} of {len(packets)} packets dissected")
    for number, (row, (link, _, data)) in enumerate(zip(rows, packets), 1):
        protocol, code, address, good, expert = (row + [""] * 5)[:5]
        if protocol != "SORTE" or good not in ("1", "True") or expert:
            fail(f"packet {number}: {row}")
        if (code or address) != str(data[2] if link == 1 else data[0]):
            fail(f"packet {number} is {row}, its bytes begin {data[:4].hex()}")


def flipped(folder):
    whole = bytearray((folder / "m.pcapng").read_bytes())
    # The data of a packet in the middle, some bytes after its block header.
    at = whole.find(struct.pack("<I", 6), len(whole) // 2)
    while at % 4 or struct.unpack_from("<I", whole, at + 4)[0] > 200:
        at = whole.find(struct.pack("<I", 6), at + 1)
    whole[at + 30] ^= 1
    (folder / "flipped.pcapng").write_bytes(whole)
    rows = tshark(folder / "flipped.pcapng", "sorte.crc_good")
    bad = sum(row[0] not in ("1", "True") for row in rows)
    if bad != 1:
        fail(f"{bad} packets with a wrong check after one flip")


def read_pcapng(path):
    """(link type, time in ns, bytes) of each packet; all interfaces count in ns."""
    data, at, links, packets = path.read_bytes(), 0, [], []
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        if kind == 1:
            links.append(struct.unpack_from("<H", data, at + 8)[0])
        elif kind == 6:
            interface, high, low, captured = struct.unpack_from("<IIII", data, at + 8)
            packets.append((links[interface], high << 32 | low, data[at + 28 : at + 28 + captured]))
        at += length
    return packets


def read_vcd(path):
    """For each device: rises and falls of SYNC0, changes of DIR, last position."""
    names, scope, time, devices = {}, [], 0, {}
    for line in path.open():
        word = line.split()
        if not word:
            continue
        if word[0] == "$scope":
            scope.append(word[2])
        elif word[0] == "$upscope":
            scope.pop()
        elif word[0] == "$var":
            names[word[3]] = (scope[-1], word[4])
        elif word[0].startswith("#"):
            time = int(word[0][1:])
        elif word[0][0] in "01" and len(word) == 1:
            module, name = names[word[0][1:]]
            if module.startswith("device"):
                devices.setdefault(module, {"rise": [], "fall": [], "dir": [], "position": 0})
                level = word[0][0] == "1"
                if name == "SYNC0" and time > 0:
                    devices[module]["rise" if level else "fall"].append(time)
                elif name == "DIR" and time > 0:
                    devices[module]["dir"].append((time, level))
        elif word[0][0] == "b" and names[word[1]][1] == "position":
            value = int(word[0][1:], 2)
            devices[names[word[1]][0]]["position"] = value - (value >> 63 << 64)
    return [devices[f"device{k}"] for k in range(1, len(devices) + 1)]


def crc8(data):
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc


def table(report):
    rows = report.split("pulse error\n")[1].split("errors ")[0].splitlines()
    return [[int(n) for n in re.findall(r"-?\d+", row)] for row in rows if row.rstrip().endswith("ns")]


def recount(report, packets, traces, devices, tolerance):
    cycle_ns = int(re.search(r"fits (\d+) ns", report).group(1))
    io = [(time, data) for link, time, data in packets if link != 1]
    masters = [(time, data) for time, data in io if data[0] == 0 and len(data) > DEVICE_FRAME]
    same("cycles", int(re.search(r"exchange\s+(\d+) cycles", report).group(1)), len(masters))
    asked, expected = [0] * devices, [[] for _ in range(devices)]
    for time, data in masters:
        if crc8(data[:-3]) != data[-3]:
            fail("a master frame with a wrong CRC-8 was sent")
        for k in range(devices):
            pto = struct.unpack_from("<H", data, 2 + 4 * k)[0]
            if 1 <= pto & 0x7FFF <= 3990:
                asked[k] += 1
                expected[k].append(time - TRIGGER + cycle_ns + PERIOD + (pto & 0x7FFF))
    rows = table(report)
    same("axes", devices, len(rows))
    for k, row in enumerate(rows):
        axis, trace = f"axis {k + 1}", traces[k]
        _, r_asked, made, on_time, late, lost, caught_up, position, _, pulse_error = row
        same(f"{axis}: asked", r_asked, asked[k])
        same(f"{axis}: made", made, len(trace["rise"]))
        same(f"{axis}: position", position, trace["position"])
        if len(trace["rise"]) == len(expected[k]) and caught_up == 0:
            errors = [abs(rise - want) for rise, want in zip(trace["rise"], expected[k])]
            # The trace has whole ns.
            if abs(max(errors, default=0) - pulse_error) > 1:
                fail(f"{axis}: the largest pulse error is {max(errors)}, the report says {pulse_error}")
            same(f"{axis}: late", late, sum(error > tolerance + 1 for error in errors))
            same(f"{axis}: on time", on_time, len(errors) - late)
        widths = [fall - rise for rise, fall in zip(trace["rise"], trace["fall"])]
        if min(widths, default=2000) < 1900:
            fail(f"{axis}: a pulse of {min(widths)} ns")
        changes, at = trace["dir"], 0
        for rise in trace["rise"]:
            while at < len(changes) and changes[at][0] <= rise:
                at += 1
            near = [abs(changes[n][0] - rise) for n in (at - 1, at) if 0 <= n < len(changes)]
            if min(near, default=1000) < 199:
                fail(f"{axis}: DIR changed {min(near)} ns from a step")
    frames = sorted((time, data) for time, data in io if not (data[0] == 0 and len(data) > DEVICE_FRAME))
    if any(data[0] == 0 for _, data in frames) and "0 bits flipped" in report:
        fail("a device frame with address 0")
    gaps = []
    for (before, a), (time, b) in zip(frames, frames[1:]):
        if b[0] == a[0] + 1:
            gaps.append(time - before - (PREAMBLE + DEVICE_FRAME) * BYTE)
    told = re.search(r"smallest gap (\d+) ns", report)
    if told and "0 bits flipped" in report and abs(min(gaps) - int(told.group(1))) > 2:
        fail(f"the smallest gap is {min(gaps)}, the report says {told.group(1)}")
    bad = sum(crc8(data[:-1]) != data[-1] for _, data in frames)
    refused = int(re.search(r"the master (\d+);", report).group(1))
    start = Counter(data[2] for link, _, data in packets if link == 1)
    if not start[1] or bad > refused:
        fail(f"{bad} damaged device frames, the report says {refused}")


def main():
    program = Path(sys.argv[1] if len(sys.argv) > 1 else HERE.parent.parent / "target/release/servowire").resolve()
    runs = [
        (4, ["--steps", "3000", "--moves", "2"]),
        (4, ["--independent", "--steps", "2500", "--moves", "2", "--freq", "241000,187000,94570,201000"]),
        (2, ["--devices", "2", "--steps", "2000", "--asymmetry", "500"]),
        (7, ["--devices", "7", "--steps", "700"]),
        (4, ["--steps", "8000", "--bit-error-rate", "2e-6", "--seed", "4"]),
        (4, ["--steps", "4000", "--published-sync0"]),
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for devices, arguments in runs:
            report, _ = cnc(program, folder, *arguments)
            packets = read_pcapng(folder / "m.pcapng")
            recount(report, packets, read_vcd(folder / "m.vcd"), devices, 100 + 2 * devices)
            if "0 bits flipped" in report:
                dissected(folder, packets)
            print(f"check.py: {' '.join(arguments)}: {len(packets)} packets, all figures as recounted")
        flipped(folder)
    print("check.py: the dissector finds a flip")


main()
