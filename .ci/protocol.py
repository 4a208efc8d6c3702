#!/usr/bin/env python3
"""A protocol crate and all that belongs to it.

    .ci/protocol.py new NAME TITLE   makes a protocol from .ci/template: the crate, and its entry in every place that has one
    .ci/protocol.py check            what a protocol crate lacks; exit code 1 if there is anything
    .ci/protocol.py prove            makes a protocol in a copy of the repository, builds and tests it there, takes each part away
                                     again, and expects that `check` names it

NAME is that of the package, as `my-bus`; TITLE as people write it, as "My Bus".
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEMPLATE = ROOT / ".ci/template"
# Libraries for firmware that are no protocol.
OTHERS = {"nrz-line", "servowire-core", "servowire-c", "servowire-drivers", "step-motion", "step-profile"}
FIGURES = "tests/bare-metal/budget.toml"


def snake(name):
    return name.replace("-", "_")


def short_of(name):
    """What its folder of vectors and its modules are called: the whole name, or its first word."""
    words = [name, snake(name), name.split("-")[0]]
    return next((word for word in words if (ROOT / "tests/vectors" / word).is_dir()), name)


def read(path):
    file = ROOT / path
    return file.read_text() if file.is_file() else ""


# --- what belongs to a protocol --------------------------------------------------------------------------------------


def parts(name, short):
    """Pairs: where something has to be, and the expression that is found there; without one, the file only has to exist."""
    crate = re.escape(name)
    module = snake(short)
    for file in ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "src/lib.rs", "src/error.rs", "tests/all/main.rs"]:
        yield f"{name}/{file}", ""
    for key in ["description", "readme", "keywords", "categories"]:
        yield f"{name}/Cargo.toml", rf"^{key} = "
    for section in [r"\[package\.metadata\.docs\.rs\]", r"\[lints\]"]:
        yield f"{name}/Cargo.toml", f"^{section}"
    for feature in ["std", "defmt", "serde", "arbitrary"]:
        yield f"{name}/Cargo.toml", rf"^{feature} = \["
    yield f"{name}/README.md", "not affiliated"
    yield f"{name}/src/lib.rs", r'include_str!\("\.\./README\.md"\)'
    yield f"{name}/src/error.rs", "errors!"
    yield "Cargo.toml", rf'^ +"{crate}",$'
    yield "Cargo.toml", rf"^{crate} = \{{"
    yield "README.md", rf"^\| \[`{crate}`\]"
    yield "CONTRIBUTING.md", rf"`{crate}/`"
    yield ".ci/nightly", rf"^libraries=\(.*\b{crate}\b"
    yield f"tests/vectors/{short}/README.md", ""
    yield "tests/vectors/README.md", rf"`{re.escape(short)}`"
    yield f"tests/src/protocols/{module}.rs", ""
    yield "tests/src/protocols.rs", rf"{module}::TOPICS"
    yield f"tests/grammar/tests/all/{module}.rs", ""
    yield "tests/grammar/tests/all/table.rs", rf"{module}::\$row"
    yield "tests/grammar/tests/all/error_numbers.rs", rf'"{crate}"'
    yield "tests/grammar/tests/all/surface.rs", rf'"{crate}"'
    yield "tests/grammar/error-numbers.txt", rf"^{crate} \d"
    yield f"tests/bare-metal/src/self_test/{module}.rs", ""
    yield "tests/bare-metal/src/self_test.rs", rf"{module}::TOPICS"
    yield "tests/bare-metal/src/kernels.rs", rf"{module}::KERNELS"
    yield "tests/bare-metal/Cargo.toml", rf'^default = .*"{crate}"'
    yield FIGURES, rf"^{module}_"
    yield f"fuzz/corpus/{module}_*", ""
    yield "fuzz/src/lib.rs", rf"{module}::"
    yield "fuzz/examples/seed_corpus.rs", rf"{module}::SOURCES"
    yield f"servowire-decode/src/protocols/{module}.rs", ""
    yield "servowire-decode/src/protocols.rs", rf"&{module}::"


def protocols():
    command = ["cargo", "metadata", "--no-deps", "--format-version", "1", "--manifest-path", str(ROOT / "Cargo.toml")]
    packages = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["packages"]
    firmware = (p["name"] for p in packages if p["publish"] is None and "no-std::no-alloc" in p["categories"])
    return sorted(set(firmware) - OTHERS)


def lacking(name):
    for path, expression in parts(name, short_of(name)):
        if not list(ROOT.glob(path)):
            yield f"{name}: {path} is missing"
        elif expression and not re.search(expression, read(path), re.M):
            yield f"{name}: {path} has nothing that matches {expression}"


def check():
    names = protocols()
    faults = [fault for name in names for fault in lacking(name)]
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"protocols: {', '.join(names)}; parts missing: {len(faults)}")
    return faults


# --- a new one -------------------------------------------------------------------------------------------------------


def edit(path, *changes):
    """Each change: an expression, and what takes the place of its first match."""
    text = read(path)
    for expression, by in changes:
        text, count = re.subn(expression, lambda found: found.expand(by), text, count=1, flags=re.M)
        if count == 0:
            sys.exit(f"protocol.py: {path} has no place for a new protocol: nothing matches {expression}")
    (ROOT / path).write_text(text)


def draw(text, name):
    """The drawing of the crates in README.md with one more protocol, at the right of its row."""
    lines = text.split("\n")
    row = next(y for y, line in enumerate(lines) if line.lstrip().startswith("tformat ") and "step-motion" in line)
    at = lines[row].index("step-motion") + len("step-motion")
    middle = 3 + len(name) // 2
    pieces = ["   " + name, " " * middle + "│", " " * middle + "│"]
    for y, piece in enumerate(pieces, row):
        lines[y] = (lines[y][:at].ljust(at) + piece.ljust(len(name) + 3) + lines[y][at:]).rstrip()
    end = lines[row + 3].rindex("┘")
    line = "┴" + "─" * (at + middle - end - 1) + "┘"
    rest = lines[row + 3][end + 1 :]
    lines[row + 3] = (lines[row + 3][:end] + line + rest[at - end + middle - len(name) - 3 :]).rstrip()
    return "\n".join(lines)


def column(text, head, cells):
    """One more column in the table that begins with `head`; the last cell is repeated."""
    lines = text.split("\n")
    start = next(y for y, line in enumerate(lines) if line.startswith(head))
    for k, y in enumerate(range(start, len(lines))):
        if not lines[y].startswith("|"):
            break
        cell = "---|" if k == 1 else f" {cells[min(k, len(cells) - 1)]} |"
        lines[y] += cell
    return "\n".join(lines)


def new(name, title):
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        sys.exit(f"protocol.py: {name!r} is not a package name: lower-case letters, digits and hyphens")
    if (ROOT / name).exists():
        sys.exit(f"protocol.py: {name}/ exists already")
    module = snake(name)
    camel = "".join(word.capitalize() for word in name.split("-"))
    fill = {"@name@": name, "@snake@": module, "@short@": name, "@Title@": title, "@Camel@": camel}

    def put(source, target):
        text = (TEMPLATE / source).read_text()
        for key, value in fill.items():
            text = text.replace(key, value)
        (ROOT / target).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / target).write_text(text)

    for file in (TEMPLATE / "crate").rglob("*"):
        if file.is_file():
            put(file.relative_to(TEMPLATE), Path(name) / file.relative_to(TEMPLATE / "crate"))
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"]:
        shutil.copy(ROOT / licence, ROOT / name)
    put("vectors/README.md", f"tests/vectors/{name}/README.md")
    put("vectors/frames.jsonl", f"tests/vectors/{name}/frames.jsonl")
    put("conformance/adapter.rs", f"tests/src/protocols/{module}.rs")
    put("grammar/programs.rs", f"tests/grammar/tests/all/{module}.rs")
    put("bare-metal/tables.rs", f"tests/bare-metal/build/{module}.rs")
    put("bare-metal/self_test.rs", f"tests/bare-metal/src/self_test/{module}.rs")
    put("bare-metal/kernels.rs", f"tests/bare-metal/src/kernels/{module}.rs")
    put("fuzz/target.rs", f"fuzz/fuzz_targets/{module}_frame.rs")
    put("fuzz/body.rs", f"fuzz/src/{module}.rs")
    put("fuzz/seeds.rs", f"fuzz/examples/seed_corpus/{module}.rs")
    put("decode/codec.rs", f"servowire-decode/src/protocols/{module}.rs")
    seeds = ROOT / f"fuzz/corpus/{module}_frame"
    seeds.mkdir(parents=True)
    (seeds / "one.seed").write_bytes(bytes([0x5A, 0x01, 0x89]))
    enter(name, title, module, camel)
    for manifest in ["Cargo.toml", "tests/bare-metal/Cargo.toml", "fuzz/Cargo.toml"]:
        command = ["cargo", "metadata", "--format-version", "1", "--manifest-path", str(ROOT / manifest)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cargo", "fmt", "--all"], cwd=ROOT, check=True)
    for folder in ["tests/bare-metal", "fuzz"]:
        subprocess.run(["cargo", "fmt"], cwd=ROOT / folder, check=True)


def enter(name, title, module, camel):
    """A line in every list of protocols."""
    edit("Cargo.toml", (r'^    "tformat",$', rf'\g<0>\n    "{name}",'))
    edit("Cargo.toml", (r"^tformat = \{.*$", rf'\g<0>\n{name} = {{ version = "0.1.0", path = "{name}" }}'))
    edit("README.md", (r"^\| \[`step-profile`\]", rf"| [`{name}`]({name}/README.md) | {title} | codec |\n\g<0>"))
    (ROOT / "README.md").write_text(draw(read("README.md"), name))
    edit("CONTRIBUTING.md", (r"^\| `tformat/`, ", rf"\g<0>`{name}/`, "))
    cells = [f"`{name}`", "", "`Frame::parse(&[u8])`", "`Frame::emit()`", "not yet"]
    text = column(read("CONTRIBUTING.md"), "| act |", cells)
    (ROOT / "CONTRIBUTING.md").write_text(column(text, "| | `tformat`", [f"`{name}`", "", "`Frame`", "-"]))
    edit(".ci/nightly", (r"^libraries=\(servowire-core", rf"\g<0> {name}"))
    edit("tests/vectors/README.md", (r"`tformat`, `nikon`", rf"`{name}`, \g<0>"))
    edit("tests/Cargo.toml", (r"^tformat\.workspace = true$", rf"\g<0>\n{name}.workspace = true"))
    edit("tests/src/protocols.rs", (r"^mod tformat;$", rf"\g<0>\nmod {module};"))
    edit("tests/src/protocols.rs", (r"^const ALL.*\n", rf'\g<0>    ("{name}", {module}::TOPICS),\n'))
    edit("tests/grammar/Cargo.toml", (r"^tformat = .*$", rf'\g<0>\n{name} = {{ workspace = true, features = ["defmt", "serde"] }}'))
    edit("tests/grammar/tests/all/main.rs", (r"^mod tformat;$", rf"\g<0>\nmod {module};"))
    edit(
        "tests/grammar/tests/all/table.rs",
        (r"^use crate::\{", rf"\g<0>{module}, "),
        (r"sorte::\$row", rf"\g<0>, {module}::$row"),
        (r"`sorte-proto` \|", rf"\g<0> `{name}` |"),
        (r"\|---\|---\|", r"\g<0>---|"),
    )
    edit(
        "tests/grammar/tests/all/error_numbers.rs",
        (r"^( +)\.collect\(\);", rf'\1.chain(lines::<{module}::ErrorClass>("{name}"))\n\g<0>'),
    )
    edit("tests/grammar/tests/all/surface.rs", (r"^const CRATES.*$", rf'\g<0>\n    "{name}",'))
    classes = enumerate(["truncated", "too_long", "header", "crc", "combinator"], 1)
    numbers = "".join(f"{name} {number} {word}\n" for number, word in classes)
    (ROOT / "tests/grammar/error-numbers.txt").write_text(read("tests/grammar/error-numbers.txt") + numbers)
    edit(
        "tests/bare-metal/Cargo.toml",
        (r'^default = \[(.*)"tformat"', rf'\g<0>, "{name}"'),
        (r"^tformat = \[\]$", rf"\g<0>\n{name} = []"),
        (r"^tformat = \{.*$", rf'\g<0>\n{name} = {{ path = "../../{name}" }}'),
    )
    edit(
        "tests/bare-metal/build.rs",
        (r"^mod tformat;$", rf'\g<0>\n#[path = "build/{module}.rs"]\nmod {module};'),
        (r'^    \("tformat", tformat::tables\),$', rf'\g<0>\n    ("{name}", {module}::tables),'),
    )
    for file, what, seen in [("self_test", "TOPICS", "pub(crate) "), ("kernels", "KERNELS", "")]:
        edit(
            f"tests/bare-metal/src/{file}.rs",
            (rf"^{re.escape(seen)}mod tformat;$", rf'\g<0>\n#[cfg(feature = "{name}")]\nmod {module};'),
            (rf"^    tformat::{what},$", rf'\g<0>\n    #[cfg(feature = "{name}")]\n    {module}::{what},'),
        )
    edit(
        "fuzz/Cargo.toml",
        (r"^tformat = .*$", rf'\g<0>\n{name} = {{ path = "../{name}" }}'),
        (
            r"\Z",
            rf'\n[[bin]]\nname = "{module}_frame"\npath = "fuzz_targets/{module}_frame.rs"\n'
            r'test = false\ndoc = false\nrequired-features = ["libfuzzer"]\n',
        ),
    )
    edit(
        "fuzz/src/lib.rs",
        (r"^pub mod tformat;$", rf"\g<0>\npub mod {module};"),
        (r"^pub const TARGETS.*$", rf'\g<0>\n    ("{module}_frame", {module}::frame),'),
    )
    edit(
        "fuzz/examples/seed_corpus.rs",
        (r"^mod tformat;$", rf'\g<0>\n#[path = "seed_corpus/{module}.rs"]\nmod {module};'),
        (r"^    tformat::SOURCES,$", rf"\g<0>\n    {module}::SOURCES,"),
    )
    edit("servowire-decode/Cargo.toml", (r"^tformat = .*$", rf'\g<0>\n{name} = {{ workspace = true, features = ["std"] }}'))
    edit(
        "servowire-decode/src/protocols.rs",
        (r"^pub mod tformat;$", rf"\g<0>\nmod {module};"),
        (r"&sorte::Sorte", rf"\g<0>, &{module}::{camel}"),
    )


# --- the proof -------------------------------------------------------------------------------------------------------


def copy_to(folder):
    """The repository without what git ignores."""
    command = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    for name in subprocess.run(command, check=True, capture_output=True).stdout.decode().split("\0"):
        source, target = ROOT / name, Path(folder) / name
        if name and source.is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)


def prove():
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
    with tempfile.TemporaryDirectory() as folder:
        copy_to(folder)

        def run(*command, code=0):
            environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
            if done.returncode != code:
                sys.exit(f"protocol.py: {' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
            return done.stderr

        script = f"{folder}/.ci/protocol.py"
        run(script, "new", "made-up", "Made Up")
        # The figures are measured, so a new crate has none yet.
        missing = run(script, "check", code=1).splitlines()
        if missing != [f"made-up: {FIGURES} has nothing that matches ^made_up_"]:
            sys.exit("protocol.py: other parts are missing than the figures:\n" + "\n".join(missing))
        budget = Path(folder) / FIGURES
        budget.write_text(budget.read_text() + "made_up_parse = { O3 = 20 }\n")
        run(script, "check")
        run(f"{folder}/.ci/house.py")
        run("cargo", "test", "--quiet", "-p", "made-up", "--all-features")
        run("cargo", "run", "--quiet", "-p", "conformance", "--", "--protocol", "made-up", "tests/vectors/made-up")
        run("cargo", "test", "--quiet", "-p", "servowire-grammar")
        run("cargo", "check", "--quiet", "-p", "servowire-decode")
        run("cargo", "check", "--quiet", "--no-default-features", "--examples", "--manifest-path", "fuzz/Cargo.toml")
        run(
            *["cargo", "check", "--quiet", "--manifest-path", "tests/bare-metal/Cargo.toml", "--no-default-features"],
            *["--features", "made-up", "--target", "thumbv7em-none-eabihf"],
        )
        count = take_away(Path(folder), lambda: run(script, "check", code=1))
    print(f"protocols: one was made from the template, built and tested; each of its {count} parts was missed when it was gone")


# What makes it a package of this repository: without it, it cannot be told that there is a protocol.
ESSENTIAL = {"Cargo.toml", "made-up/Cargo.toml", "made-up/src/lib.rs"}


def take_away(folder, check):
    """Takes away each part of the made-up protocol, one after the other; how many there were."""
    found = [(path, expression) for path, expression in parts("made-up", "made-up") if path not in ESSENTIAL]
    for path, expression in found:
        (file,) = folder.glob(path)
        if expression:
            text = file.read_text()
            file.write_text(re.sub(expression, "", text, flags=re.M))
            faults = check()
            file.write_text(text)
        else:
            aside = file.rename(file.with_name("aside"))
            faults = check()
            aside.rename(file)
        if f"made-up: {path}" not in faults:
            sys.exit(f"protocol.py: nobody misses {path} {expression}")
    return len(found)


if sys.argv[1:2] == ["new"] and len(sys.argv) == 4:
    new(*sys.argv[2:])
    print(f"{sys.argv[2]}/ is there, and its entry in every place that has one. Next:")
    print("  tests/bare-metal/run.sh --record    measures its kernels")
    print("  .ci/protocol.py check               says what is missing")
elif sys.argv[1:] == ["check"]:
    sys.exit(1 if check() else 0)
elif sys.argv[1:] == ["prove"]:
    prove()
else:
    sys.exit(__doc__)
