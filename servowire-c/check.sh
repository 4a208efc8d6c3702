#!/usr/bin/env bash
# The C side of this crate: `.ci/run c` runs all of it.
#
#   servowire-c/check.sh           all steps
#   servowire-c/check.sh STEP...   header (writes include/servowire.h), stale, host, rows
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

built=$(cargo metadata --no-deps --format-version 1 | python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
out=$built/c
mkdir -p "$out"

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
    local standard
    for standard in c99 c11; do
        gcc -std=$standard -Wstrict-prototypes "${strict[@]}" -fsyntax-only -x c include/servowire.h
    done
    g++ -std=c++11 "${strict[@]}" -fsyntax-only -x c++ include/servowire.h
    gcc -std=c99 -Wstrict-prototypes "${strict[@]}" "${sanitized[@]}" tests/c/border.c "$out/libservowire_c.a" -o "$out/border"
    "$out/border"
    g++ -std=c++11 "${strict[@]}" -x c++ tests/c/border.c -x none "$out/libservowire_c.a" -o "$out/border++"
    "$out/border++"
}

# All rows of the vectors through the C interface.
rows() {
    [ -e "$out/libservowire_c.a" ] || library
    gcc -std=c99 -Wstrict-prototypes "${strict[@]}" "${sanitized[@]}" tests/c/rows.c tests/c/rows_*.c "$out/libservowire_c.a" -o "$out/rows"
    python3 tests/rows.py "$out/rows" ../tests/vectors
}

[ "$#" -gt 0 ] || set -- stale host rows
for step; do "$step"; done
