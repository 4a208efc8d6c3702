#!/usr/bin/env bash
# Builds the firmware images and runs those for which there is an emulator: RP2040s in pairs, two chips and a wire, with their PIO's
# scheduler compared with an independent emulator; the RP2350 with its processors, PIO and DMA against encoders; the STM32F405 under QEMU;
# and the images that move stepper motors, whose pulses are compared with what is due.
# Needs node, python3 and qemu-system-arm; installs the rest by name: targets from rustup, the emulators from npm and PyPI.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

for tool in node npm python3 qemu-system-arm; do
    command -v "$tool" >/dev/null || { echo "run.sh: $tool is missing (node has to be 18 or newer)" >&2; exit 1; }
done
firmware=../../examples/firmware

# target TRIPLE
target() { rustup target list --installed | grep -qx "$1" || rustup target add "$1"; }

# build IMAGES [ARGUMENT...]
build() { (cd "$firmware/$1" && cargo build --release --locked --bins "${@:2}"); }

# built FOLDER: where cargo puts what it builds there
built() {
    (cd "$1" && cargo metadata --no-deps --format-version 1) |
        python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])'
}

objdump=$(dirname "$(rustc --print target-libdir)")/bin/llvm-objdump
[ -x "$objdump" ] || rustup component add llvm-tools
# What the runs note: image, what, number.
FIGURES=$(mktemp)
export FIGURES PYTHONDONTWRITEBYTECODE=1
trap 'rm -f "$FIGURES"' EXIT

target thumbv6m-none-eabi
target thumbv7em-none-eabihf
target thumbv8m.main-none-eabihf
target riscv32imc-unknown-none-elf
for image in rp2040 stm32f405 rp2350-hdsl pico2 teensy4 esp32c3; do
    build "$image"
done
# One board after the other in a folder; the figures in the README are those of the first. The last has a power stage.
build stm32g4 --no-default-features --features nucleo-g431rb
if refused=$(cd "$firmware/stm32g4" && cargo check --release --locked --no-default-features --features b-g431b-esc1 2>&1) ||
    ! grep -q 'B-G431B-ESC1 is refused: its power stage' <<<"$refused"; then
    printf 'run.sh: B-G431B-ESC1 is not refused\n%s\n' "$refused" >&2
    exit 1
fi
build stm32g4

[ -d node_modules/rp2040js ] || npm ci --silent --no-audit --no-fund
[ -x .venv/bin/python ] || python3 -m venv .venv
.venv/bin/python -c 'import pioemu, unicorn, elftools' 2>/dev/null ||
    .venv/bin/pip install --quiet rp2040-pio-emulator==0.88.0 unicorn==2.1.4 pyelftools==0.33

node --test --test-reporter=spec
for image in tformat-master tformat-encoder-5m aformat-master aformat-encoder-2m5; do
    node waveform.mjs "$image" | .venv/bin/python compare.py
done

# As many side by side as there are processors.
hdsl=$(built "$firmware/rp2350-hdsl")/thumbv8m.main-none-eabihf/release/servowire-rp2350-hdsl
pico2=$(built "$firmware/pico2")/thumbv8m.main-none-eabihf/release
printf '%s\n' rp2350/hdsl.py "$hdsl" rp2350/hdsl_mistakes.py "$hdsl" rp2350/compare.py "$hdsl" \
    rp2350/masters.py "$pico2" rp2350/mistakes.py "$pico2" |
    xargs -d '\n' -n 2 -P "$(nproc)" .venv/bin/python

.venv/bin/python motion/check.py rp2040 "$(built "$firmware/rp2040")/thumbv6m-none-eabi/release/motion"
.venv/bin/python motion/check.py stm32f405 \
    "$(built "$firmware/stm32f405")/thumbv7em-none-eabihf/release/stm32f405-motion"

build stm32f405 --features emulated
(cd ../.. && cargo build -p servowire-examples --bin tformat-encoder)
python3 stm32f405.py "$(built "$firmware/stm32f405")/thumbv7em-none-eabihf/release/servowire-stm32f405" \
    "$(built ../..)/debug/tformat-encoder"
# Its figures are those of the image that is flashed.
build stm32f405

python3 figures.py "$objdump" "$FIGURES"
