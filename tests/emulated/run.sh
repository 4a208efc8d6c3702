#!/usr/bin/env bash
# Builds the RP2040 images and runs them in pairs: two chips and a wire. Installs what it needs by name: the target from
# rustup, the emulators from npm and PyPI at the versions of the lock files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

command -v node >/dev/null || { echo "run.sh: node 18 or newer, with npm, is missing" >&2; exit 1; }
rustup target list --installed | grep -qx thumbv6m-none-eabi || rustup target add thumbv6m-none-eabi
(cd ../../examples/firmware/rp2040 && cargo build --release --locked --bins)
[ -d node_modules/rp2040js ] || npm ci --silent --no-audit --no-fund
node --test --test-reporter=spec
