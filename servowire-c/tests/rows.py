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
    lines = []
    for name, row in rows_of(path):
        commands = make(row)
        if row.unread:
            sys.exit(f"{protocol}/{topic} {name}: nobody reads {sorted(row.unread)}")
        lines += [f"{protocol}/{topic} {name}\t{command}\t{expected}\n" for command, expected in commands]
    if not lines:
        sys.exit(f"{protocol}/{topic}: no rows")
    return lines


def main():
    program, vectors = sys.argv[1], Path(sys.argv[2])
    failed = False
    for folder in sorted(path for path in vectors.iterdir() if path.is_dir()):
        protocol = folder.name
        if not (Path(__file__).parent / "protocols" / f"{protocol.replace('-', '_')}.py").exists():
            print(f"{protocol}: not in the C interface")
            continue
        module = importlib.import_module(f"protocols.{protocol.replace('-', '_')}")
        for path in sorted(folder.glob("*.jsonl")):
            topic = path.stem
            if reason := module.NOT_IN_C.get(topic):
                print(f"{protocol}/{topic}: not in the C interface: {reason}")
                continue
            if (make := getattr(module, topic, None)) is None:
                sys.exit(f"{protocol}/{topic}: no function of this name")
            lines = lines_of(protocol, topic, make, path)
            ended = subprocess.run([program], input="".join(lines), text=True, capture_output=True)
            if ended.returncode != 0:
                failed = True
                print(*ended.stderr.splitlines()[:30], sep="\n", file=sys.stderr)
            print(f"{protocol}/{topic}: {ended.stdout.strip() or 'died'}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
