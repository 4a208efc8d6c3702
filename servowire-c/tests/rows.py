#!/usr/bin/env python3
"""All rows of the reference vectors through the C interface.

    tests/rows.py PROGRAM VECTORS

makes of each row of VECTORS/<protocol>/<topic>.jsonl a command with what it has to answer, and gives them to PROGRAM, which calls the
library. A row with a key that nobody reads fails, so does a topic that is neither known nor listed with its reason as one that is not
in the C interface, and one without rows.
"""

import importlib
import json
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))

# Prose that any row may have.
PROSE = ("note", "source")


class Row(dict):
    """A row that knows which of its keys were read."""

    def __init__(self, keys):
        super().__init__(keys)
        self.unread = set(keys)

    def __getitem__(self, key):
        self.unread.discard(key)
        return super().__getitem__(key)

    def get(self, key, default=None):
        self.unread.discard(key)
        return super().get(key, default)

    def ignore(self, *keys):
        """Keys that say how the row was made, or what is no matter of the C interface."""
        self.unread.difference_update(keys)


def rows_of(path):
    for line in path.read_text().splitlines():
        keys = json.loads(line)
        if "about" not in keys:
            for prose in PROSE:
                keys.pop(prose, None)
            yield keys.pop("name", None) or keys.pop("id", "?"), Row(keys)


def lines_of(protocol, topic, make, path):
    lines, told = [], Tally()
    for name, row in rows_of(path):
        commands = make(row)
        if row.unread:
            sys.exit(f"{protocol}/{topic} {name}: nobody reads {sorted(row.unread)}")
        told.rows += 1
        told.without += not commands
        lines += [f"{protocol}/{topic} {name}\t{command}\t{expected}\n" for command, expected in commands]
    if not lines:
        sys.exit(f"{protocol}/{topic}: no rows")
    return lines, told


class Tally:
    """Rows, and those of them that say nothing that C can call: no number that fits its types, no check that could be made."""

    def __init__(self):
        self.rows = self.without = self.elsewhere = 0

    def add(self, other):
        self.rows += other.rows
        self.without += other.without


def main():
    program, vectors = sys.argv[1], Path(sys.argv[2])
    failed, tally = False, Tally()
    for folder in sorted(path for path in vectors.iterdir() if path.is_dir()):
        protocol = folder.name
        if not (Path(__file__).parent / "protocols" / f"{protocol.replace('-', '_')}.py").exists():
            sys.exit(f"{protocol}: no file of tests/protocols reads its rows")
        module = importlib.import_module(f"protocols.{protocol.replace('-', '_')}")
        for path in sorted(folder.glob("*.jsonl")):
            topic = path.stem
            if reason := module.NOT_IN_C.get(topic):
                print(f"{protocol}/{topic}: not in the C interface: {reason}")
                tally.elsewhere += sum(1 for _ in rows_of(path))
                continue
            if (make := getattr(module, topic, None)) is None:
                sys.exit(f"{protocol}/{topic}: no function of this name")
            lines, told = lines_of(protocol, topic, make, path)
            tally.add(told)
            ended = subprocess.run([program], input="".join(lines), text=True, capture_output=True)
            if ended.returncode != 0:
                failed = True
                print(*ended.stderr.splitlines()[:30], sep="\n", file=sys.stderr)
            without = f", {told.without} rows have nothing for C" if told.without else ""
            print(f"{protocol}/{topic}: {ended.stdout.strip() or 'died'}{without}")
    print(f"rows through C: {tally.rows - tally.without} of {tally.rows + tally.elsewhere}; {tally.without} have nothing for C, "
          f"{tally.elsewhere} are of topics that are not in the C interface")
    sys.exit(failed)


if __name__ == "__main__":
    main()
