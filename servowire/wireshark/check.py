#!/usr/bin/env python3
"""Runs the dissector of this folder over what `servowire cnc` writes, and recounts what `servowire cnc` prints.

    check.py [SERVOWIRE]        the program; without it cargo builds one

1. tshark with sorte.lua takes every packet, finds every check right and nothing malformed; after a flip it finds that. Frames
   without FCS, padded, cut, with impossible contents and foreign ones are what they are, and thousands that are damaged at
   random bring no error of the script.
2. Everything that the report of `servowire cnc` says about steps, pulses and frames is counted again from the VCD and the
   pcapng, with a reader of both formats of its own and nothing from the program but its output files.

Needs tshark (apt-get install tshark). Exit code 0, or 1 with the first thing that differs.
"""

import bisect
import json
import random
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
BYTE = 80
PREAMBLE = 2
DEVICE_FRAME = 6
PERIOD = 4000
TRIGGER = 500
TRANSIT = 355
CABLE = 85
SLOT = 880
# Send times of the published device, by address.
SEND_AT = {1: 500, 2: 900, 3: 1360, 4: 1800}
KINDS = {"DISCOVERY": 1, "PARAM": 2, "DELAY_REQ": 3, "SYNC": 5}
DRIVER_OFF = 0x7FFF


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
    for number, (row, (link, _, data, _)) in enumerate(zip(rows, packets), 1):
        protocol, code, address, good, expert = (row + [""] * 5)[:5]
        if protocol != "SORTE" or good not in ("1", "True") or expert:
            fail(f"packet {number}: {row}")
        if (code or address) != str(data[2] if link == 1 else data[0]):
            fail(f"packet {number} is {row}, its bytes begin {data[:4].hex()}")


def flipped(folder):
    whole = bytearray((folder / "m.pcapng").read_bytes())
    # The data of a packet in the middle, some bytes after its block header.
    at = 0
    while at < len(whole) // 2 or struct.unpack_from("<I", whole, at)[0] != 6:
        at += struct.unpack_from("<I", whole, at + 4)[0]
    whole[at + 30] ^= 1
    (folder / "flipped.pcapng").write_bytes(whole)
    rows = tshark(folder / "flipped.pcapng", "sorte.crc_good")
    bad = sum(row[0] not in ("1", "True") for row in rows)
    if bad != 1:
        fail(f"{bad} packets with a wrong check after one flip")


def write_pcapng(path, packets):
    """(link type, bytes) of each packet, or (link type, bytes, length before the capture cut it), a microsecond apart."""
    block = lambda kind, body: struct.pack("<II", kind, len(body) + 12) + body + struct.pack("<I", len(body) + 12)
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    for link in (1, 147):
        out += block(1, struct.pack("<HHI", link, 0, 0) + struct.pack("<HHB3xHH", 9, 1, 9, 0, 0))
    for number, (link, data, *whole) in enumerate(packets):
        padded = data + bytes(-len(data) % 4)
        lengths = len(data), whole[0] if whole else len(data)
        out += block(6, struct.pack("<IIIII", link != 1, 0, 1000 * number, *lengths) + padded)
    path.write_bytes(out)


def with_fcs(body):
    return body + struct.pack("<I", zlib.crc32(body))


def contents(folder):
    """Frames as network cards give them, frames that cannot be, and other traffic: what tshark says of each."""
    delay, sync = bytes([255, 0, 3, 0x20]), bytes([255, 0, 5, 0x40]) + struct.pack("<IH", 856, 76)
    param = bytes([255, 0, 2, 0x10]) + struct.pack("<IIHBBIIIIBBBB", 4000, 0, 1000, 16, 1, 320, 52, 0, 0, 0, 0, 0, 0x33)
    table = lambda count, total: bytes([255, 0, 1, 1]) + struct.pack("<HHH", count, total, total) + bytes([4, 0, 4, 0]) * 254
    master = lambda pto: bytes([0, 0x30]) + struct.pack("<HH", pto, 0) + bytes(12)
    io = lambda body, stamp=bytes(2): body + bytes([crc8(body)]) + (stamp if body[0] == 0 else b"")
    answer = lambda a: io(bytes([a, 0, 0, 0, 0]))
    arp = bytes([255] * 6 + [2, 0, 0, 0, 0, 1, 8, 6, 0, 1, 8, 0, 6, 4, 0, 1]) + bytes(32)
    llc = bytes([1, 0x80, 0xC2, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 38, 0x42, 0x42, 3]) + bytes(43)
    cases = [
        (1, with_fcs(sync), ["SORTE", "5", "1", "", "", ""]),
        (1, sync, ["SORTE", "5", "", "1", "", ""]),
        (1, delay, ["SORTE", "3", "", "1", "", ""]),
        (1, sync + bytes(50), ["SORTE", "5", "", "1", "", ""]),
        (1, with_fcs(sync) + bytes(46), ["SORTE", "5", "1", "", "", ""]),
        (1, param + bytes(24), ["SORTE", "2", "", "1", "", ""]),
        (1, param[:20], ["SORTE", "2", "", "", "20 bytes, the type has 40", ""]),
        (1, table(4, 16), ["SORTE", "1", "", "1", "", ""]),
        (1, table(300, 16), ["SORTE", "1", "", "1", "300 devices, 254 can be", ""]),
        (1, table(4, 16)[:6] + struct.pack("<HH", 17, 16) + table(4, 16)[10:], ["SORTE", "1", "", "1", "17 input bytes in all, the entries sum to 16", ""]),
        (1, arp, ["ARP", "", "", "", "", ""]),
        (1, llc, ["STP", "", "", "", None, ""]),
        (147, io(master(500)), ["SORTE", "", "1", "", "", ""]),
        (147, answer(1), ["SORTE", "", "1", "", "", ""]),
        (147, answer(2), ["SORTE", "", "1", "", "", ""]),
        (147, io(master(0x0FFF)), ["SORTE", "", "1", "", "PTO 0FFFh has no meaning", ""]),
        (147, answer(1), ["SORTE", "", "1", "", "", ""]),
        (147, io(master(0)), ["SORTE", "", "1", "", "no frame of device 2 in cycle 2", "2"]),
        (147, bytes([0, 0x30]), ["SORTE", "", "", "", "2 bytes are no frame of the exchange", ""]),
    ]
    path = folder / "contents.pcapng"
    write_pcapng(path, [(link, data) for link, data, _ in cases])
    fields = ["_ws.col.Protocol", "sorte.type", "sorte.crc_good", "sorte.no_fcs", "_ws.expert.message", "sorte.io.missing"]
    true = lambda text: {"True": "1", "False": "0"}.get(text, text)
    for (_, data, want), row in zip(cases, tshark(path, *fields)):
        got = [true(text) for text in (row + [""] * 6)[:6]]
        if any(w is not None and w != g for w, g in zip(want, got)):
            fail(f"{data[:12].hex()}: tshark says {got}, it is {want}")
    for rule, count in [("sorte.discovery.devices > 254", 1), ("sorte.io.missing == 2", 1), ("sorte.to_master == 1", 6), ("sorte.no_fcs", 7), ("sorte.io.cycle == 2", 2), ("sorte.discovery.entry.input == 4 && sorte.discovery.address == 3", 3), ("sorte.io.late > 0", 0)]:
        command = ["tshark", "-X", f"lua_script:{HERE / 'sorte.lua'}", "-r", str(path), "-Y", rule]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode or len(run.stdout.splitlines()) != count:
            fail(f"{rule}: {len(run.stdout.splitlines())} packets, {count} are such; {run.stderr}")


def damaged(folder, packets, seed, count=4000):
    """Packets cut, lengthened, flipped and made up at random, among other traffic: the script never fails."""
    chance, out = random.Random(seed), []
    other = bytes([2] * 6 + [3] * 6 + [8, 0, 0x45, 0, 0, 60, 0, 0, 0, 0, 64, 17]) + bytes(40)
    for _ in range(count):
        link, _, data, _ = chance.choice(packets) if chance.randrange(4) else (1, 0, other, 0)
        data = bytearray(data)
        if chance.randrange(3) == 0:
            # As `tcpdump -s` does.
            out.append((link, bytes(data[: chance.randrange(len(data))]), len(data)))
            continue
        for _ in range(chance.randrange(4)):
            what = chance.randrange(5)
            if what == 0:
                del data[chance.randrange(len(data) + 1) :]
            elif what == 1:
                data += chance.randbytes(chance.randrange(80))
            elif what == 2 and data:
                data[chance.randrange(len(data))] = chance.randrange(256)
            elif what == 3:
                data = bytearray([255, 0, chance.randrange(12)]) + chance.randbytes(chance.choice([0, 1, 5, 60, 1023, 1100]))
            elif what == 4:
                link = 148 - link
        out.append((link, bytes(data)))
    path = folder / "damaged.pcapng"
    write_pcapng(path, out)
    command = ["tshark", "-X", f"lua_script:{HERE / 'sorte.lua'}", "-r", str(path), "-V", "-2"]
    run = subprocess.run(command, capture_output=True, text=True, errors="replace")
    if run.returncode or "Lua Error" in run.stdout + run.stderr or ".lua:" in run.stdout + run.stderr:
        lines = [line for line in (run.stdout + run.stderr).splitlines() if ".lua" in line or "Lua Error" in line]
        fail(f"seed {seed}: {lines[:3]}")
    return run.stdout.count("TI SORTE, ") + run.stdout.count("TI SORTE\n")


def read_pcapng(path):
    """(link type, time in ns, bytes, sent by the master) of each packet; all interfaces count in ns."""
    data, at, links, packets = path.read_bytes(), 0, [], []
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        if kind == 1:
            links.append(struct.unpack_from("<H", data, at + 8)[0])
        elif kind == 6:
            interface, high, low, captured = struct.unpack_from("<IIII", data, at + 8)
            flags, option = 0, at + 28 + (captured + 3 & ~3)
            while option < at + length - 4:
                code, size = struct.unpack_from("<HH", data, option)
                if code == 2:
                    flags = struct.unpack_from("<I", data, option + 4)[0]
                option += 4 + (size + 3 & ~3)
            packets.append((links[interface], high << 32 | low, data[at + 28 : at + 28 + captured], flags & 3 == 2))
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


def start_up(report, packets, masters, devices):
    """The start-up and the time plan, from the frames and from the numbers of the published firmware."""
    sent = Counter(data[2] for link, _, data, sent in packets if link == 1 and sent)
    for name, code in KINDS.items():
        same(name, int(re.search(rf"{name} (\d+)", report).group(1)), sent[code])
    same("first cycle", re.search(r"first cycle after ([\d.]+) ms", report).group(1), f"{masters[0][0] / 1e6:.2f}")
    size = len(masters[0][1]) + PREAMBLE
    told = re.search(r"master frame (\d+) bytes, at the last device after (\d+) ns; last .* after (\d+) ns", report)
    out = TRIGGER + size * BYTE + devices * CABLE + (devices - 1) * TRANSIT
    frame = (PREAMBLE + DEVICE_FRAME) * BYTE
    if devices <= 4:
        # The published table, and the way of each.
        back = max(SEND_AT[a] + a * CABLE + (a - 1) * TRANSIT + frame for a in range(1, devices + 1))
    else:
        back = TRIGGER + (devices - 1) * SLOT + frame + CABLE
    same("time plan", [int(n) for n in told.groups()], [size, out, back])
    same("shortest cycle", int(re.search(r"shortest cycle (\d+) ns", report).group(1)), max(out, back))
    for address, first, end, measured, at in re.findall(
        r"address (\d+), output bytes (\d+)\.\.(\d+), cable 85 ns, measured (\d+) ns, sends at (\d+) ns", report
    ):
        a = int(address)
        same(f"slice of device {a}", [int(first), int(end)], [4 * a - 4, 4 * a])
        want = SEND_AT[a] if devices <= 4 else TRIGGER + (a - 1) * (SLOT - TRANSIT - CABLE)
        # The measured delays are a few ns off in each hop.
        if abs(int(at) - want) > (0 if devices <= 4 else 8 * a):
            fail(f"device {a} sends at {at} ns, {want} are planned")


def around(times, time):
    """The last of `times` before `time`, and the first after it."""
    at = bisect.bisect(times, time)
    return times[max(at - 1, 0) : at + 1]


def recount(report, packets, traces, devices, tolerance):
    cycle_ns = int(re.search(r"fits (\d+) ns", report).group(1))
    masters = [(time, data) for link, time, data, sent in packets if link != 1 and sent]
    frames = sorted((time, data) for link, time, data, sent in packets if link != 1 and not sent)
    same("cycles", int(re.search(r"exchange\s+(\d+) cycles", report).group(1)), len(masters))
    seconds = re.search(r"cycles, ([\d.]+) s of machine time", report).group(1)
    same("machine time", seconds, f"{len(masters) * cycle_ns * 1e-9:.3f}")
    start_up(report, packets, masters, devices)
    off = re.search(r"drivers\s+(\d+) words", report)
    words = [struct.unpack_from("<H", data, 2 + 4 * k)[0] for _, data in masters for k in range(devices)]
    same("driver-off words", int(off.group(1)) if off else 0, words.count(DRIVER_OFF))
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
    bad = sum(row[5] + row[4] for row in rows)
    share = re.search(r"([\d.]+) % of the steps were late or lost", report)
    # Of what the devices ordered: what was made or lost, and nothing is under way at the end.
    ordered = sum(row[2] + row[5] for row in rows)
    if (float(share.group(1)) if share else 0) != round(100 * bad / max(ordered, 1), 2):
        fail(f"{bad} of {ordered} steps late or lost, the report says {share and share.group(1)} %")
    for k, row in enumerate(rows):
        axis, trace = f"axis {k + 1}", traces[k]
        _, r_asked, made, on_time, late, lost, caught_up, position, clock_error, pulse_error = row
        # Two ticks of the generator, and rounding.
        if not lost and not late and pulse_error > clock_error + 12:
            fail(f"{axis}: a pulse is {pulse_error} ns off, its clock only {clock_error}")
        same(f"{axis}: asked", r_asked, asked[k])
        same(f"{axis}: made", made, len(trace["rise"]))
        same(f"{axis}: position", position, trace["position"])
        if not late and not lost:
            # A pulse that no master frame asked for at its time makes up for one whose frame was lost.
            near = [min(abs(rise - want) for want in around(expected[k], rise)) for rise in trace["rise"]]
            same(f"{axis}: caught up", caught_up, sum(error > tolerance + 1 for error in near))
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
    if any(data[0] == 0 for _, data in frames) and "0 bits flipped" in report:
        fail("a device frame with address 0")
    gaps = []
    for (before, a), (time, b) in zip(frames, frames[1:]):
        if b[0] == a[0] + 1:
            gaps.append(time - before - (PREAMBLE + DEVICE_FRAME) * BYTE)
    told = re.search(r"smallest gap (\d+) ns", report)
    if told and "0 bits flipped" in report and abs(min(gaps) - int(told.group(1))) > 2:
        fail(f"the smallest gap is {min(gaps)}, the report says {told.group(1)}")
    bad = [crc8(data[:-1]) != data[-1] for _, data in frames]
    broken = sum(zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0] for link, _, data, sent in packets if link == 1 and not sent)
    same("frames that the master refused", int(re.search(r"the master (\d+);", report).group(1)), sum(bad) + broken)
    # The frames of the last cycle are not asked for any more.
    begins = [time - TRIGGER for time, _ in masters]
    heard = [set() for _ in masters]
    for (time, data), damaged in zip(frames, bad):
        if not damaged:
            heard[bisect.bisect_right(begins, time) - 1].add(data[0])
    # In the first one all devices are silent.
    missing = sum(len(addresses) < devices for addresses in heard[1:-1])
    same("cycles with a frame missing", int(re.search(r"(\d+) cycles with a frame missing", report).group(1)), missing)


def built():
    """The program as cargo builds it for tests."""
    manifest = ["--manifest-path", str(HERE.parent / "Cargo.toml")]
    subprocess.run(["cargo", "build", "--quiet", *manifest, "--bin", "servowire"], check=True)
    run = subprocess.run(["cargo", "metadata", "--no-deps", "--format-version", "1", *manifest], check=True, capture_output=True)
    return Path(json.loads(run.stdout)["target_directory"]) / "debug/servowire"


def main():
    program = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else built()
    runs = [
        (4, ["--steps", "3000", "--moves", "2"]),
        (4, ["--independent", "--steps", "2500", "--moves", "2", "--freq", "241000,187000,94570,201000"]),
        (2, ["--devices", "2", "--steps", "2000", "--asymmetry", "500"]),
        (7, ["--devices", "7", "--steps", "700"]),
        (4, ["--steps", "8000", "--bit-error-rate", "2e-6", "--seed", "4"]),
        (4, ["--steps", "4000", "--published-sync0"]),
        (4, ["--independent", "--steps", "2000", "--moves", "2", "--power-save", "50"]),
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
        contents(folder)
        seen = sum(damaged(folder, packets, seed) for seed in range(5))
    print(f"check.py: the dissector finds a flip, and takes 20000 damaged packets ({seen} of them as SORTE) without an error")


main()
