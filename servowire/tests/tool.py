"""Where the checks in Python find the program."""

import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def built() -> str:
    """The path of the program."""
    lines = subprocess.run(
        ["cargo", "build", "-p", "servowire", "--message-format", "json"], cwd=ROOT, stdout=subprocess.PIPE, check=True
    ).stdout.splitlines()
    messages = [json.loads(line) for line in lines]
    return next(m["executable"] for m in messages if m.get("target", {}).get("name") == "servowire" and m.get("executable"))
