#!/usr/bin/env python3
"""Instructions that decoding takes per event and per sample, counted by callgrind and compared with figures.toml.

    run.py              counts and compares: exit code 1 where something needs 5 % more than is recorded
    run.py --record     counts and writes figures.toml
    run.py --self-test  whether the comparison can fail

Each line is decoded in two lengths, so that what happens once (start of the program, recognition of the line) is apart from what
each event takes. Instructions do not depend on the load of the machine; they do on the compiler, so another one than that of
figures.toml is told and nothing compared.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
FIGURES = HERE / "figures.toml"
BAND = 0.05
# Lines whose events are written as text too.
TEXT = ("tformat.packed",)
HEAD = """\
# Host instructions of decoding, by callgrind: per event and per sample with `--stats` or as text, and once for start and recognition.
# The lines have 8 samples a bit; captures as VCD hold edges, and their samples are those of the same line.
# `tests/speed/run.py --record` writes this file; a commit that raises a figure says why.
"""


def build():
    """The program, without what costs minutes and changes little."""
    environment = dict(os.environ, CARGO_PROFILE_RELEASE_LTO="off")
    command = ["cargo", "build", "--release", "-p", "servowire-speed"]
    subprocess.run(command, cwd=HERE, env=environment, check=True)
    metadata = ["cargo", "metadata", "--no-deps", "--format-version", "1"]
    text = subprocess.run(metadata, cwd=HERE, check=True, capture_output=True, text=True).stdout
    return pathlib.Path(re.search(r'"target_directory":"([^"]*)"', text)[1]) / "release" / "servowire-speed"


def compiler():
    return re.search(r"rustc (\S+)", subprocess.run(["rustc", "-V"], check=True, capture_output=True, text=True).stdout)[1]


def instructions(program, file, protocol, rate, output, events):
    """Of one run, whose events all have to be good."""
    run = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, "decode", file, protocol, rate, output]
    done = subprocess.run(run, capture_output=True, text=True)
    good = re.search(r"^(\d+) good, 0 not$", done.stderr, re.MULTILINE)
    if done.returncode != 0 or not good or int(good[1]) < events:
        sys.exit(f"{file}: not decoded as it should be\n{done.stderr}")
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def measure(program, folder):
    """The figures by line, format and output."""
    text = subprocess.run([program, "write", folder], check=True, capture_output=True, text=True).stdout
    rows = {name: rest for name, *rest in (row.split() for row in text.splitlines())}
    figures = {}
    for short in (name for name in rows if "-short." in name):
        name, long = short.replace("-short.", "."), short.replace("-short.", "-long.")
        for output in ("stats", "text") if name in TEXT else ("stats",):
            counts = []
            for file in (short, long):
                protocol, rate, samples, events = rows[file]
                count = instructions(program, f"{folder}/{file}", protocol, rate, output, int(events))
                counts.append((count, int(samples), int(events)))
            (few, samples, events), (many, more_samples, more_events) = counts
            event = (many - few) / (more_events - events)
            sample = (many - few) / (more_samples - samples)
            figures[f"{name}.{output}"] = {
                "event": round(event),
                "sample": round(sample, 2),
                "once": int(round(few - event * events, -5)),
            }
    return figures


def compare(recorded, measured):
    """What is wrong, and what could be recorded."""
    worse, better = [], []
    for name in sorted(recorded.keys() ^ measured.keys()):
        worse.append(f"{name}: {'not recorded' if name in measured else 'recorded, but not measured'}")
    for name in sorted(recorded.keys() & measured.keys()):
        for what, due in recorded[name].items():
            got = measured[name][what]
            if got > due * (1 + BAND):
                worse.append(f"{name}: {what} takes {got:,} instructions, {100 * got / due - 100:.1f} % more than {due:,}")
            elif got < due * (1 - BAND):
                better.append(f"{name}: {what} takes {got:,} instructions, less than {due:,}: record it")
    return worse, better


def self_test():
    due = {"line": {"event": 1000, "sample": 2.0, "once": 1000}}
    for event, sample, say in ((1000, 2.0, (0, 0)), (1049, 2.0, (0, 0)), (1051, 2.0, (1, 0)), (940, 2.2, (1, 1))):
        said = compare(due, {"line": {"event": event, "sample": sample, "once": 1000}})
        assert tuple(map(len, said)) == say, (event, sample, said)
    assert all(len(compare(*both)[0]) == 1 for both in ((due, {}), ({}, due)))


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    with tempfile.TemporaryDirectory() as folder:
        measured = measure(build(), folder)
    for name, row in measured.items():
        print(f"{name:<22}" + "".join(f"{what:>8} {count:>12,}" for what, count in row.items()))
    if sys.argv[1:] == ["--record"]:
        rows = [f"{name.replace('.', '-')} = {{ " + ", ".join(f"{k} = {v}" for k, v in row.items()) + " }\n" for name, row in measured.items()]
        FIGURES.write_text(HEAD + f'rustc = "{compiler()}"\n\n[instructions]\n' + "".join(rows))
        return None
    recorded = tomllib.loads(FIGURES.read_text())
    if recorded["rustc"] != compiler():
        print(f"recorded with Rust {recorded['rustc']}, this is {compiler()}: not compared")
        return None
    worse, better = compare(recorded["instructions"], {name.replace(".", "-"): row for name, row in measured.items()})
    print("\n".join(worse + better) or "as recorded")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
