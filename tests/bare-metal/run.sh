#!/usr/bin/env bash
# Builds an image for each protocol at opt-level 3 and s, runs it under QEMU, and checks: vector rows, instruction counts and
# stacks against budget.toml, and that no panic can be reached from any kernel. Some protocols also for a Cortex-M0+. Two
# images are built again from a copy of the repository in another folder, and have to be the same.
#
#   run.sh             check
#   run.sh --record    the same, and write the measured figures into budget.toml
set -euo pipefail
# A folder of its own there: code that was built without rustc.sh must not get into the images.
CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-$(dirname "$0")/target}")/measured
# Incremental code is other code.
export CARGO_TARGET_DIR CARGO_INCREMENTAL=0
cd "$(dirname "$0")"

target=thumbv7em-none-eabihf
# The Cortex-M0+, and what is measured for it. The Cortex-M4 that QEMU emulates executes its code too.
target_m0=thumbv6m-none-eabi
protocols_m0=(step-motion servowire-core hdsl step-profile)
images=$CARGO_TARGET_DIR/images
# The default features are the protocols.
protocols=$(sed -n 's/^default = \[\(.*\)\]$/\1/p' Cargo.toml | tr -d '",')
# First the one whose run takes longest.
protocols="step-motion ${protocols/step-motion/}"

fail() {
    echo "$(basename "$0"): $1" >&2
    exit 1
}

need() {
    command -v "$1" >/dev/null || fail "$1 is missing: $2"
}

# build LEVEL FEATURES IMAGE: the image as $images/IMAGE.elf
build() {
    local profile=release triple=$target
    [ "$1" != Os ] || profile=small
    [ "$1" != M0 ] || triple=$target_m0
    RUSTC_WRAPPER=$PWD/rustc.sh cargo build --locked --quiet --target "$triple" --profile "$profile" --no-default-features \
        --features "$2"
    cp "$CARGO_TARGET_DIR/$triple/$profile/bare-metal" "$images/$3.elf"
}

# Copies the repository, without what git ignores, into the folder $elsewhere.
copy_elsewhere() {
    elsewhere=$(mktemp -d)
    trap 'rm -rf "$elsewhere"' EXIT
    git -C ../.. ls-files -z --cached --others --exclude-standard |
        tar -C ../.. --null --files-from=- --ignore-failed-read -c | tar -C "$elsewhere" -x
}

# same_elsewhere LEVEL PROTOCOL: that the copy gives the same image, to the byte
same_elsewhere() {
    (
        cd "$elsewhere/tests/bare-metal"
        CARGO_TARGET_DIR=$elsewhere/target
        build "$1" "$2" "$2-$1-elsewhere"
    )
    cmp "$images/$2-$1.elf" "$images/$2-$1-elsewhere.elf" || fail "the image of $2 at $1 depends on the folder: see rustc.sh"
    echo "built in another folder, the same: $2 at $1"
}

# run IMAGE: what it prints as $images/IMAGE.txt; report.py judges it. The one that takes minutes runs beside the others.
run() {
    case $1 in
        step-motion-*) emulate "$1" & ;;
        *) emulate "$1" ;;
    esac
}

emulate() {
    timeout 1800 qemu-system-arm -machine mps2-an386 -display none -serial none -monitor none \
        -icount shift=0 -semihosting-config enable=on,target=native -kernel "$images/$1.elf" \
        >"$images/$1.txt" || echo "$1: QEMU ended with code $?" >&2
}

need cargo "install Rust from https://rustup.rs"
need qemu-system-arm "apt-get install qemu-system-arm"
need python3 "apt-get install python3"
need git "apt-get install git"
python3 -c 'import tomllib' 2>/dev/null || fail "python3 is older than 3.11"
for triple in "$target" "$target_m0"; do
    [ -d "$(rustc --print target-libdir --target "$triple")" ] || fail "target missing: rustup target add $triple"
done
objdump=$(dirname "$(rustc --print target-libdir)")/bin/llvm-objdump
[ -x "$objdump" ] || fail "llvm-objdump is missing: rustup component add llvm-tools"

rm -rf "$images"
mkdir -p "$images"
for level in O3 Os; do
    # First, that the walk can fail: the kernels of src/kernels/deliberate_panic.rs are found at either level.
    build "$level" deliberate-panic,nrz-line "panics-$level"
    for kernel in panic_{index,range,unwrap,division,copy,pointer}; do
        path=$(python3 report.py walk "$objdump" "$images/panics-$level.elf" "$kernel" || true)
        [[ $path == "$kernel -> "* ]] || fail "the walk does not see that $kernel can panic at $level"
        echo "self-check $level: $path"
    done
    for protocol in $protocols; do
        build "$level" "$protocol" "$protocol-$level"
        run "$protocol-$level"
    done
    build "$level" stack,sorte-proto "stack-$level"
    run "stack-$level"
done
for protocol in "${protocols_m0[@]}"; do
    build M0 "$protocol" "$protocol-M0"
    run "$protocol-M0"
done
copy_elsewhere
same_elsewhere Os sorte-proto
same_elsewhere O3 tformat
wait
python3 report.py table "$objdump" "$images" "$@"
