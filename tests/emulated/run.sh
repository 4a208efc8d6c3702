#!/usr/bin/env bash
# Builds the RP2040 images and runs them in pairs: two chips and a wire. Then compares the PIO's scheduler with an independent
# emulator. Needs node and python3; installs the rest by name: the target from rustup, the emulators from npm and PyPI.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

for tool in node npm python3; do
    command -v "$tool" >/dev/null || { echo "run.sh: $tool is missing (node has to be 18 or newer)" >&2; exit 1; }
done
rustup target list --installed | grep -qx thumbv6m-none-eabi || rustup target add thumbv6m-none-eabi
(cd ../../examples/firmware/rp2040 && cargo build --release --locked --bins)
python3 size.py ../../examples/firmware/rp2040/target/thumbv6m-none-eabi/release/{t,a}format-{master,encoder}
[ -d node_modules/rp2040js ] || npm ci --silent --no-audit --no-fund
[ -x .venv/bin/python ] || python3 -m venv .venv
.venv/bin/python -c 'import pioemu' 2>/dev/null || .venv/bin/pip install --quiet rp2040-pio-emulator==0.88.0

node --test --test-reporter=spec
for image in tformat-master tformat-encoder-5m aformat-master aformat-encoder-2m5; do
    node waveform.mjs "$image" | .venv/bin/python compare.py
done
