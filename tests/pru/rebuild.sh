#!/bin/sh
# Rebuilds the GNU assembler and simulator for the PRU from Debian's source packages, and repeats the proof there:
#
#   1. step_core.s assembles to the words of step_core.words, one by one;
#   2. the simulator, running them, gives the registers of every row of step_trace.jsonl and step_trace_edge.jsonl.
#
# usage: tests/pru/rebuild.sh [FOLDER]     FOLDER (default target/pru) keeps the build: 1 GB, 3 minutes of one core
#
# Debian has no binutils or gcc for the PRU, but the sources of its binutils and gdb know it. Needed beforehand:
#   apt-get install bison flex m4 gcc make libgmp-dev zlib1g-dev xz-utils python3
# The source packages themselves are only downloaded and unpacked in FOLDER, not installed.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
build=${1:-$here/../../target/pru}
mkdir -p "$build"
build=$(cd "$build" && pwd)
jobs=$(nproc)
export CFLAGS="-O0 -g0" CXXFLAGS="-O0 -g0" # quick to build; the programs run for a second

for tool in bison flex m4 gcc make xz python3 apt-get dpkg-deb; do
    command -v "$tool" >/dev/null || { echo "$tool is missing" >&2; exit 1; }
done

# unpack PACKAGE PATTERN: the newest archive of the package that matches, as FOLDER/PACKAGE/src
unpack() {
    [ -d "$build/$1/src" ] && return
    mkdir -p "$build/$1"
    (cd "$build/$1" && apt-get download "$1" && dpkg-deb -x "$1"_*.deb .)
    archive=$(find "$build/$1/usr/src" -name "$2" | sort | tail -n 1)
    mkdir "$build/$1/src.part"
    tar -xf "$archive" -C "$build/$1/src.part" --strip-components=1
    mv "$build/$1/src.part" "$build/$1/src"
}

# Assembler, linker, objcopy. bison, flex and m4 have to be there before configure runs.
unpack binutils-source 'binutils-*.tar.xz'
as=$build/as/gas/as-new
ld=$build/as/ld/ld-new
objcopy=$build/as/binutils/objcopy
if [ ! -x "$ld" ] || [ ! -x "$objcopy" ] || [ ! -x "$as" ]; then
    mkdir -p "$build/as"
    (
        cd "$build/as"
        "$build/binutils-source/src/configure" --target=pru-elf --disable-nls --disable-gprofng --disable-gprof \
            --disable-werror MAKEINFO=true
        make -j "$jobs" all-gas all-ld all-binutils MAKEINFO=true
    ) >"$build/as.log" 2>&1 || { echo "binutils: see $build/as.log" >&2; exit 1; }
fi

# Simulator.
unpack gdb-source 'gdb*.tar.xz'
run=$build/sim/sim/pru/run
if [ ! -x "$run" ]; then
    mkdir -p "$build/sim"
    (
        cd "$build/sim"
        "$build/gdb-source/src/configure" --target=pru-elf --disable-nls --disable-werror --disable-gdb \
            --disable-gdbserver --disable-gdbsupport --disable-binutils --disable-gas --disable-ld --enable-sim \
            MAKEINFO=true
        make -j "$jobs" all-sim MAKEINFO=true
    ) >"$build/sim.log" 2>&1 || { echo "simulator: see $build/sim.log" >&2; exit 1; }
fi

cd "$build"

# 1. The words.
"$as" "$here/step_core.s" -o step_core.o
"$ld" --no-warn-mismatch step_core.o -o step_core.elf
"$objcopy" -O binary -j .text step_core.elf step_core.bin
od -A n -t x4 -v --endian=little -w4 step_core.bin | tr -d ' ' >step_core.words
diff "$here/step_core.words" step_core.words
echo "step_core.s assembles to step_core.words: $(wc -l <step_core.words) words"

# 2. The traces: the core without its labels and directives, and with a jump past its end for HALT.
sed -e '/^[[:space:]]*\.\(text\|globl\)/d' -e '/^_start:/d' -e 's/^\([[:space:]]*\)halt/core_end:/' \
    "$here/step_core.s" >core.inc
"$as" -I . "$here/replay.s" -o replay.o
"$ld" --no-warn-mismatch replay.o -o replay.elf
python3 - "$here/../vectors/step-profile" "$run" <<'EOF'
import json, pathlib, struct, subprocess, sys

folder, run = pathlib.Path(sys.argv[1]), sys.argv[2]
rows = []
for name in ("step_trace.jsonl", "step_trace_edge.jsonl"):
    rows += [json.loads(line) for line in (folder / name).read_text().splitlines() if line.strip()]
rows = [row for row in rows if "about" not in row]
records = b"".join(struct.pack("<3I", row["entry"], row["speed"], row["prev"]) for row in rows)
# A file, not a pipe: the program wants whole records.
pathlib.Path("operands.bin").write_bytes(records)
with open("operands.bin", "rb") as operands:
    out = subprocess.run([run, "replay.elf"], stdin=operands, stdout=subprocess.PIPE, check=True).stdout
assert len(out) == 24 * len(rows), f"{len(out)} bytes for {len(rows)} rows"
keys = ("t_step", "cnt_raw", "t_4us_cnt", "sync_raw", "cnt", "sync")
wrong = 0
for row, got in zip(rows, struct.iter_unpack("<6I", out)):
    want = tuple(row[key] for key in keys)
    if got != want:
        wrong += 1
        print("differs:", row["entry"], row["speed"], row["prev"], "row", want, "simulator", got)
print(f"{len(rows)} step records replayed in the simulator, {wrong} differ")
sys.exit(wrong > 0)
EOF
