#!/usr/bin/env bash
# What `servowire-decode` says on wasm32, in node, against what it says natively: every capture of the repository, and 300 damaged.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

target=${CARGO_TARGET_DIR:-target}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# Without what costs minutes and changes nothing here.
export CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16
# A library of C only here: natively, the linker trips over names that defmt exports.
cargo rustc --release -p servowire-wasm --lib --crate-type cdylib --target wasm32-unknown-unknown
mapfile -t captures < <(git ls-files 'servowire-decode/captures/*.vcd' 'servowire/tests/samples/*' 'fuzz/corpus/capture_*' | grep -v '\.md$')
cargo run --release -q -p servowire-wasm -- "$folder" "${captures[@]}"
node tests/wasm/compare.mjs "$target/wasm32-unknown-unknown/release/servowire_wasm.wasm" "$folder"
