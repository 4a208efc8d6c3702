#!/usr/bin/env bash
# The C side of this crate: `.ci/run c` runs all of it.
#
#   servowire-c/check.sh           all steps
#   servowire-c/check.sh STEP...   header (writes include/servowire.h), stale, host, rows, hostile, targets, flash, emulated, cost, archive
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

built=$(cargo metadata --no-deps --format-version 1 | python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
out=$built/c
# Programs that are made stand where no header of another step is.
mkdir -p "$out/made"

strict=(-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wundef -Werror -Iinclude)
sanitized=(-g -O1 -fsanitize=address,undefined -fno-sanitize-recover=all)

fail() {
    echo "servowire-c/check.sh: $1" >&2
    exit 1
}

# made_header FILE: every warning of cbindgen is an error, for what it does not find it leaves out; but what is private it may.
made_header() {
    local said
    said=$(cbindgen --config cbindgen.toml --output "$1" src/lib.rs 2>&1) || fail "$said"
    ! grep -v 'Skip .* (not `pub`)' <<<"$said" | grep . || fail "cbindgen warns"
}

header() { made_header include/servowire.h; }

stale() {
    made_header "$out/servowire.h"
    diff -u include/servowire.h "$out/servowire.h" ||
        fail "include/servowire.h is not what the sources say: servowire-c/check.sh header"
}

# The static library of the host, as a C program links it.
library() {
    cargo rustc --quiet --release --lib --crate-type staticlib --features std
    cp "$built/release/libservowire_c.a" "$out/"
}

# The header by itself and the tests, as C99, C11 and C++11, with address and undefined-behaviour sanitizers.
host() {
    library
    local standard test
    for standard in c99 c11; do
        gcc -std=$standard -Wstrict-prototypes "${strict[@]}" -fsyntax-only -x c include/servowire.h
    done
    g++ -std=c++11 "${strict[@]}" -fsyntax-only -x c++ include/servowire.h
    for test in border motion both_ends; do
        gcc -std=c99 -Wstrict-prototypes "${strict[@]}" "${sanitized[@]}" "tests/c/$test.c" "$out/libservowire_c.a" -o "$out/$test"
        "$out/$test"
        g++ -std=c++11 "${strict[@]}" -x c++ "tests/c/$test.c" -x none "$out/libservowire_c.a" -o "$out/$test++"
        "$out/$test++"
    done
    # What the README promises to somebody who has nothing but it, the header and the library.
    python3 tests/readme.py README.md >"$out/made/readme.c"
    gcc -std=c99 -Wall -Wextra -Wpedantic -Wconversion -Werror -Iinclude "$out/made/readme.c" "$out/libservowire_c.a" -Wl,--gc-sections -o "$out/readme"
    "$out/readme"
    g++ -std=c++11 -Wall -Wextra -Wpedantic -Wconversion -Werror -Iinclude -x c++ "$out/made/readme.c" -x none "$out/libservowire_c.a" -o "$out/readme"
    "$out/readme"
}

# All rows of the vectors through the C interface.
rows() {
    [ -e "$out/libservowire_c.a" ] || library
    gcc -std=c99 -Wstrict-prototypes "${strict[@]}" "${sanitized[@]}" tests/c/rows.c tests/c/rows_*.c "$out/libservowire_c.a" -o "$out/rows"
    python3 tests/rows.py "$out/rows" ../tests/vectors
}

# Every function as nobody should call it: tests/hostile.py. The library too is built with the sanitizer, and its arithmetic is checked: a sum
# that overflows ends the program.
hostile() {
    local host seed
    host=$(rustc -vV | sed -n 's/^host: //p')
    python3 tests/hostile.py include/servowire.h >"$out/made/hostile.c"
    CARGO_PROFILE_RELEASE_LTO=false RUSTFLAGS="-Zsanitizer=address -Cdebug-assertions=yes -Coverflow-checks=yes" cargo +nightly rustc --quiet --release \
        --lib --crate-type staticlib --features std --target "$host" --target-dir "$built/sanitized"
    gcc -std=c99 -Wstrict-prototypes "${strict[@]}" "${sanitized[@]}" "$out/made/hostile.c" "$built/sanitized/$host/release/libservowire_c.a" -lm \
        -o "$out/hostile"
    for seed in 1 2 3; do "$out/hostile" "${HOSTILE_ROUNDS:-1000}" "$seed"; done
}

targets=(thumbv6m-none-eabi thumbv7em-none-eabihf thumbv8m.main-none-eabihf riscv32imac-unknown-none-elf)
# A target that comes without a built core library.
bare_target=armv7r-none-eabihf

# The static libraries of the targets, as they are released; no symbol of a panic is left where C takes it over.
targets() {
    local target
    for target in "${targets[@]}"; do
        cargo rustc --quiet --release --lib --crate-type staticlib --features panic-handler --target "$target"
        mkdir -p "$out/lib/$target"
        cp "$built/$target/release/libservowire_c.a" "$out/lib/$target/"
    done
    cargo +nightly rustc --quiet --release --lib --crate-type staticlib --features panic-handler --target "$bare_target" -Zbuild-std=core
    mkdir -p "$out/lib/$bare_target"
    cp "$built/$bare_target/release/libservowire_c.a" "$out/lib/$bare_target/"
}

m4=(-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16)
firmware=(-std=c11 -Os -ffunction-sections -fdata-sections -ffreestanding -nostartfiles -nostdlib -Wstrict-prototypes "${strict[@]}"
    -T tests/firmware/link.ld -Wl,--gc-sections -Wl,--no-warn-rwx-segments -Wl,-z,noexecstack tests/firmware/start.c)
# The C library's memcpy in place of the larger one of Rust, whichever stands first.
small=(-Wl,-u,__aeabi_memcpy,-u,__aeabi_memcpy4,-u,__aeabi_memcpy8,-u,__aeabi_memmove,-u,__aeabi_memmove4,-u,__aeabi_memset)
small+=(-Wl,-u,__aeabi_memclr,-u,__aeabi_memclr4,-u,__aeabi_memclr8,-u,__aeabi_lmul -lc_nano -lgcc)

# image NAME SOURCE...: a firmware of a Cortex-M4 in which nothing of a panic is linked
image() {
    arm-none-eabi-gcc "${m4[@]}" "${firmware[@]}" "${@:2}" "${small[@]}" "$out/lib/thumbv7em-none-eabihf/libservowire_c.a" \
        -lc_nano -lgcc -o "$out/$1.elf"
    ! arm-none-eabi-nm "$out/$1.elf" | grep -i 'panic\|unwind' || fail "$1 can panic"
}

bytes_of() { arm-none-eabi-size "$out/$1.elf" | awk 'NR == 2 { print $1 + $2 }'; }

# What a program pays for the calls that it makes, in bytes of a Cortex-M4.
flash() {
    local name limit empty
    image flash-none tests/firmware/flash/none.c
    empty=$(bytes_of flash-none)
    while read -r name limit; do
        image "flash-$name" "tests/firmware/flash/$name.c"
        local bytes=$(($(bytes_of "flash-$name") - empty))
        printf 'flash: %-12s %6d bytes of %d\n' "$name" "$bytes" "$limit"
        [ "$bytes" -le "$limit" ] || fail "$name takes too much"
    done <tests/firmware/flash/limits
}

# The example and its encoder in an emulated Cortex-M4; then once more with another Rust library beside this one.
emulated() {
    local example
    for example in examples/*.c; do
        arm-none-eabi-gcc "${m4[@]}" -std=c99 -Os -Wstrict-prototypes "${strict[@]}" -c "$example" -o "$out/example.o"
    done
    local sources=(examples/tformat_uart.c tests/firmware/run_tformat.c)
    image tformat "${sources[@]}"
    run_image tformat
    cost
    rustc --edition 2024 --crate-type staticlib --target thumbv7em-none-eabihf -C panic=abort -O -o "$out/libother.a" tests/firmware/other.rs
    arm-none-eabi-gcc "${m4[@]}" "${firmware[@]}" "${sources[@]}" -Wl,-u,other_divide "$out/libother.a" \
        "$out/lib/thumbv7em-none-eabihf/libservowire_c.a" -lc_nano -lgcc -o "$out/two.elf"
    run_image two
}

# The instructions of a call, and of the same call of the crates in the same image.
cost() {
    local target=thumbv7em-none-eabihf
    cargo rustc --quiet --release --example cost --features panic-handler --target "$target"
    arm-none-eabi-gcc "${m4[@]}" "${firmware[@]}" tests/firmware/cost.c "${small[@]}" "$built/$target/release/examples/libcost.a" \
        -lc_nano -lgcc -o "$out/cost.elf"
    run_image cost -icount shift=0
}

run_image() {
    timeout 60 qemu-system-arm -machine mps2-an386 -display none -serial none -monitor none -semihosting-config enable=on,target=native \
        "${@:2}" -kernel "$out/$1.elf" || fail "$1 ended with $?"
}

# The release archive, and programs that find it by CMake and by pkg-config.
archive() {
    local version host tree
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml)
    host=$(rustc -vV | sed -n 's/^host: //p')
    grep -qx "Version: $version" package/servowire.pc || fail "package/servowire.pc has another version"
    tree=$out/servowire-c-$version
    rm -rf "$tree" "$out/consumer"
    mkdir -p "$tree/include" "$tree/lib/cmake/servowire" "$tree/lib/pkgconfig" "$tree/lib/$host"
    cp include/servowire.h "$tree/include/"
    cp package/servowire-config.cmake "$tree/lib/cmake/servowire/"
    cp package/servowire.pc "$tree/lib/pkgconfig/"
    cp README.md CHANGELOG.md LICENSE-* "$tree/"
    cp -r "$out"/lib/* "$tree/lib/"
    cp "$out/libservowire_c.a" "$tree/lib/$host/"
    cmake -S tests/consumer -B "$out/consumer" -DCMAKE_PREFIX_PATH="$tree" >"$out/cmake.log" || fail "$(cat "$out/cmake.log")"
    cmake --build "$out/consumer" >"$out/cmake.log" || fail "$(cat "$out/cmake.log")"
    "$out/consumer/consumer" || fail "the program of CMake"
    # shellcheck disable=SC2046
    gcc -Wall -Werror tests/consumer/main.c $(PKG_CONFIG_PATH=$tree/lib/pkgconfig pkg-config --cflags --libs servowire) -o "$out/consumer/other"
    "$out/consumer/other" || fail "the program of pkg-config"
    tar -C "$out" -czf "$out/servowire-c-$version.tar.gz" "servowire-c-$version"
    ls -sh "$out/servowire-c-$version.tar.gz"
}

[ "$#" -gt 0 ] || set -- stale host rows hostile targets flash emulated archive
for step; do "$step"; done
