#!/usr/bin/env python3
"""sigrok-cli as the source of servowire: a capture that it passes on in every form, and its demo device live.

Builds the program itself. What goes through sigrok-cli has to be the same frames as without it; in the patterns of the demo
device nobody speaks a protocol, so nothing may be found in them.
"""

import json
import subprocess
import sys

from tool import ROOT, built

CAPTURE = ROOT / "servowire-decode/captures/hpm-uart-readme.vcd"
FORMS = ["vcd", "bits", "hex", "ascii", "ols", "binary"]


def decoded(tool: str, source: list[str], options: list[str]) -> tuple[int, list[dict], str]:
    """Exit code, frames and messages of what `source` writes into a pipe."""
    sent = subprocess.Popen(source, stdout=subprocess.PIPE)
    run = subprocess.run([tool, "decode", "--json", *options, "-"], stdin=sent.stdout, capture_output=True, text=True)
    sent.stdout.close()
    if sent.wait() != 0:
        sys.exit(f"{' '.join(source)} failed")
    return run.returncode, [json.loads(line) for line in run.stdout.splitlines()], run.stderr


def said(frames: list[dict]) -> list[tuple]:
    """What does not depend on the names of channels."""
    return [(f["start_ps"], f.get("direction"), f["kind"], json.dumps(f["fields"]), f["verdict"]) for f in frames]


def main() -> None:
    tool = built()
    code, frames, _ = decoded(tool, ["cat", str(CAPTURE)], [])
    if code != 0 or not frames:
        sys.exit("the capture itself is not decoded")
    for form in FORMS:
        source = ["sigrok-cli", "-i", str(CAPTURE), "-I", "vcd", "-O", form]
        code, passed, errors = decoded(tool, source, [])
        if code != 0 or said(passed) != said(frames):
            sys.exit(f"-O {form}: exit code {code}, {len(passed)} of {len(frames)} frames, or not the same\n{errors}")
    for form in FORMS:
        source = ["sigrok-cli", "--driver", "demo", "--config", "samplerate=20M", "--channels", "D0,D1,D2,D3"]
        rate = ["--rate", "20M"] if form == "binary" else []
        code, found, errors = decoded(tool, [*source, "--samples", "100k", "-O", form], rate)
        if code != 1 or found or "error: standard input" not in errors:
            sys.exit(f"demo device, -O {form}: exit code {code}, {len(found)} frames\n{errors}")
    print(f"sigrok-cli: {len(frames)} frames through {len(FORMS)} forms, and nothing in those of its demo device")


if __name__ == "__main__":
    main()
