#!/usr/bin/env python3
"""Whether the house stands as it is drawn.

    .ci/house.py               checks all crates of this repository
    .ci/house.py --self-test   checks that the checks can fail

1. No files of a crate import each other, neither two of them nor more in a circle. An import counts as one of the file in which the
   item is defined, whatever re-exports it passes. What a module takes from the modules that it lies in does not count, nor does
   `#[cfg(test)]`.
2. The drawing of the crates in README.md agrees with the manifests: every dependency follows the lines of the drawing downwards, and
   every line of the drawing is a dependency. Dependencies of tests do not count. An arrow leads to the name under it; if no other one
   leads to that row, to the whole row.
3. CONTRIBUTING.md lists the folder of every package.
4. The README of what is published is its page on docs.rs too, where no link leads out of the crate's folder; the paths of items that
   it names are in lib.rs, because elsewhere they lead nowhere. Its first screen of 45 lines shows what to call: code, or a table that
   begins with what one has.
5. Every public name has a user (`names.py`).
6. No two examples of the workspace have one name: cargo builds them into the same file, and warns of it.
7. Figures that the README of servowire-drivers repeats are those of their sources: the table of the images, `budget.toml`.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
import names as public_names  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent

# --- Rust sources ----------------------------------------------------------------------------------------------------

# What is no code: comments, strings, characters. A lifetime is neither.
NO_CODE = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(\#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^'\\\n])'""", re.DOTALL
)
TEST_ONLY = re.compile(r"#\[cfg\((?:test|all\(test\b[^\]]*)\)\]")
ATTRIBUTES = r"(?:#\[[^\]]*\]\s*)*"
MODULE = re.compile(r"(#\[path = (\S+)\]\s*)?(?:\bpub(?:\([^)]*\))?\s+)?\bmod\s+(\w+)\s*([;{])")
USE = re.compile(r"\buse\s+([^;]*);")
MACRO = re.compile(r"\bmacro_rules!\s*(\w+)")
PATH = re.compile(r"(?<![\w$:.])(\w+)((?:::\w+)+)(!?)")


def code_of(text):
    """The text without comments and strings; a string of `#[path]` stays."""
    kept = {}

    def keep(found):
        kept[len(kept)] = found[1]
        return f"#[path = @{len(kept) - 1}@]"

    text = NO_CODE.sub(" ", re.sub(r'#\[path = "([^"]*)"\]', keep, text))
    return re.sub(r"@(\d+)@", lambda found: kept[int(found[1])], text)


def end_of_item(text, at):
    """Where the item that begins there ends: behind its semicolon, or behind the brace that closes it."""
    depth = 0
    for at in range(at, len(text)):
        if text[at] in "([{":
            depth += 1
        elif text[at] in ")]}":
            depth -= 1
            if depth == 0 and text[at] == "}":
                return at + 1
        elif text[at] == ";" and depth == 0:
            return at + 1
    return len(text)


def without_tests(text):
    while found := TEST_ONLY.search(text):
        text = text[: found.start()] + text[end_of_item(text, found.end()) :]
    return text


def leaves(tree):
    """`a::{b, c as d, self}` as pairs of a path and the name that it gets here."""
    tree = tree.strip()
    if (open_ := tree.find("{")) >= 0:
        depth, parts = 0, [""]
        for c in tree[open_ + 1 : tree.rindex("}")]:
            depth += (c == "{") - (c == "}")
            if c == "," and depth == 0:
                parts.append("")
            else:
                parts[-1] += c
        front = [s.strip() for s in tree[:open_].split("::") if s.strip()]
        for part in parts:
            for path, name in leaves(part) if part.strip() else ():
                path = front + path
                if path[-1] == "self" and len(path) > 1:
                    path = path[:-1]
                    name = path[-1] if name == "self" else name
                yield path, name
        return
    path, _, name = tree.partition(" as ")
    path = [s.strip() for s in path.split("::") if s.strip()]
    yield path, name.strip() or path[-1]


class Module:
    """A module: where it stands, what is in it, and what it calls by which name."""

    def __init__(self, crate, parent, file, folder, text):
        self.crate, self.parent, self.file = crate, parent, file
        self.children, self.names, self.globs = {}, {}, []
        while found := MODULE.search(text):
            _, path, name, kind = found.groups()
            end = end_of_item(text, found.start())
            inside = text[found.end() : end - 1]
            text = text[: found.start()] + " " + text[end:]
            if kind == "{":
                self.children[name] = Module(crate, self, file, folder / name, inside)
                continue
            places = [file.parent / path] if path else [folder / f"{name}.rs", folder / name / "mod.rs"]
            place = next((place for place in places if place.is_file()), None)
            # A module of a macro, or one that the build makes.
            if place:
                below = place.parent if place.name == "mod.rs" or path else folder / name
                self.children[name] = Module(crate, self, place, below, without_tests(code_of(place.read_text())))
        for found in MACRO.finditer(text):
            crate.macros[found[1]] = file
        for found in USE.finditer(text):
            if "$" in found[1]:
                continue
            for path, name in leaves(found[1]):
                if name == "*":
                    self.globs.append(path[:-1])
                else:
                    self.names[name] = path
        self.text = USE.sub(" ", text)

    def walk(self):
        yield self
        for child in self.children.values():
            yield from child.walk()

    def lies_in(self, file):
        return self.parent is not None and (self.parent.file == file or self.parent.lies_in(file))

    def find(self, path, seen=()):
        """The file in which what this path leads to is defined; None outside of the crate."""
        at, first = self, True
        if (id(self), tuple(path)) in seen:
            return None
        seen = (*seen, (id(self), tuple(path)))
        for k, segment in enumerate(path):
            if segment == "crate" and first:
                at = self.crate.root
            elif segment == "super":
                at = at.parent or at
            elif segment == "self":
                pass
            elif segment in at.children and not (k + 1 == len(path) and segment in at.names):
                at = at.children[segment]
            elif segment in at.names and at.names[segment] != path:
                return at.find([*at.names[segment], *path[k + 1 :]], seen)
            elif first:
                return None
            else:
                return at.file
            first = False
        return at.file

    def imports(self):
        """Files that this module needs, by the first path that says so."""
        paths = [(path, "") for path in [*self.names.values(), *self.globs]]
        paths += [([found[1], *found[2].split("::")[1:]], found[3]) for found in PATH.finditer(self.text)]
        for path, bang in paths:
            if bang and path[0] == "crate" and path[-1] in self.crate.macros:
                yield self.crate.macros[path[-1]], path
            elif path and path[0] not in ("std", "core", "alloc") and (file := self.find(path)):
                yield file, path


class Crate:
    """The modules of one root file, and which file imports which."""

    def __init__(self, root):
        self.macros = {}
        self.root = Module(self, None, root, root.parent, without_tests(code_of(root.read_text())))
        self.edges = {}
        for module in self.root.walk():
            into = self.edges.setdefault(module.file, {})
            for file, path in module.imports():
                if file != module.file and not module.lies_in(file):
                    into.setdefault(file, "::".join(path))

    def reached(self, start):
        """All files that a file imports, straight or through others, each with the one from which it was first reached."""
        came, row = {}, [start]
        for file in row:
            for to in sorted(self.edges.get(file, ())):
                if to not in came:
                    came[to] = file
                    row.append(to)
        return came

    def circles(self):
        """Of each knot of files a shortest circle."""
        reached = {file: self.reached(file) for file in self.edges}
        knots = {file: frozenset(to for to in came if file in reached[to]) for file, came in reached.items()}
        for knot in sorted(set(knots.values()) - {frozenset()}, key=min):
            circles = []
            for start in sorted(knot):
                circle = [reached[start][start]]
                while circle[0] != start:
                    circle.insert(0, reached[start][circle[0]])
                circles.append(circle)
            yield min(circles, key=len), knot

    def told(self, circle):
        lines = [f"  {short(a)} uses {self.edges[a][b]}" for a, b in zip(circle, [*circle[1:], circle[0]])]
        return "\n".join(lines)


def short(path):
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path.name


def roots_of(packages):
    """The root files of all libraries and programs; of a package with both, each by itself."""
    kinds = {"lib", "bin", "staticlib", "cdylib", "rlib"}
    return sorted({Path(t["src_path"]) for p in packages for t in p["targets"] if kinds & set(t["kind"])})


def faults_of_imports(roots):
    for root in roots:
        crate = Crate(root)
        for circle, knot in crate.circles():
            rest = ", ".join(str(short(file)) for file in sorted(knot - set(circle)))
            rest = f"\n  and in other circles with them: {rest}" if rest else ""
            yield f"{short(root)}: {len(circle)} files import each other\n{crate.told(circle)}{rest}"


# --- the drawing -----------------------------------------------------------------------------------------------------

UP, DOWN, LEFT, RIGHT = (-1, 0), (1, 0), (0, -1), (0, 1)
LINES = {
    "│": (UP, DOWN),
    "─": (LEFT, RIGHT),
    "┌": (DOWN, RIGHT),
    "┐": (DOWN, LEFT),
    "└": (UP, RIGHT),
    "┘": (UP, LEFT),
    "├": (UP, DOWN, RIGHT),
    "┤": (UP, DOWN, LEFT),
    "┬": (DOWN, LEFT, RIGHT),
    "┴": (UP, LEFT, RIGHT),
    "┼": (UP, DOWN, LEFT, RIGHT),
    "▼": (UP, DOWN),
}


def drawn(text, names):
    """The drawing in a text: pairs of a name and of those to one of which a line leads down from it; and all names that are in it."""
    pictures = [p for p in re.findall(r"```text\n(.*?)```", text, re.DOTALL) if "▼" in p]
    if len(pictures) != 1:
        raise ValueError(f"{len(pictures)} drawings of the crates")
    rows, places = pictures[0].split("\n"), {}
    for y, row in enumerate(rows):
        # Without what stands in brackets, and without the words at the right.
        row = re.sub(r"\(.*?\)|\s{3,}\w+(?: [\w,;]+){2,}.*$", lambda found: " " * len(found[0]), row)
        for found in re.finditer(r"[\w-]+", row):
            if found[0] in names:
                places |= {(y, x): found[0] for x in range(*found.span())}

    def at(y, x):
        return rows[y][x] if 0 <= y < len(rows) and 0 <= x < len(rows[y]) else " "

    def under(y, x):
        if at(y - 1, x) == "▼" and rows[y - 1].count("▼") == 1:
            return frozenset(name for (y2, _), name in places.items() if y2 == y)
        return frozenset({places[y, x]} if (y, x) in places else ())

    pairs, seen = set(), set()
    for start in [(y, x) for y, row in enumerate(rows) for x in range(len(row)) if row[x] in LINES]:
        if start in seen:
            continue
        above, below, work = set(), set(), [start]
        seen.add(start)
        for y, x in work:
            for dy, dx in LINES[at(y, x)]:
                place = (y + dy, x + dx)
                if dy > 0 and under(*place):
                    below.add(under(*place))
                elif dy < 0 and place in places:
                    above.add(places[place])
                elif (-dy, -dx) in LINES.get(at(*place), ()) and place not in seen:
                    seen.add(place)
                    work.append(place)
        pairs |= {(upper, lower - {upper}) for upper in above for lower in below}
    return pairs, set(places.values())


def reach(edges):
    """All pairs that are joined in one step or several."""
    pairs = set(edges)
    while more := {(a, d) for a, b in pairs for c, d in pairs if b == c} - pairs:
        pairs |= more
    return pairs


def faults_of_drawing(text, real, names):
    """`real`: pairs of names, the one that depends first."""
    pairs, present = drawn(text, names)
    for name in sorted(set(names) - present):
        yield f"README.md: the drawing lacks {name}"
    downwards, needed = reach((a, b) for a, row in pairs for b in row), reach(real)
    for a, b in sorted(real):
        if {a, b} <= present and (a, b) not in downwards:
            yield f"README.md: {a} depends on {b}, and no line of the drawing leads down from the one to the other"
    for a, row in sorted((a, sorted(row)) for a, row in pairs):
        if not any((a, b) in needed for b in row):
            yield f"README.md: a line of the drawing leads from {a} to {', '.join(row)}, which it does not depend on"


# --- the repository --------------------------------------------------------------------------------------------------


def metadata(manifest):
    command = ["cargo", "metadata", "--no-deps", "--format-version", "1", "--manifest-path", str(manifest)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["packages"]


def name_of(package):
    """Under which name a package stands in the drawing: what is published under its own, the others under that of their folder."""
    folder = Path(package["manifest_path"]).parent.relative_to(ROOT).parts
    return package["name"] if package["publish"] is None else folder[min(len(folder), 2) - 1 if folder[0] == "examples" else 0]


def dependencies(packages):
    """Pairs of names of the drawing, the one that depends first."""
    names = {package["name"]: name_of(package) for package in packages}
    pairs = {
        (name_of(package), names[dependency["name"]])
        for package in packages
        for dependency in package["dependencies"]
        if dependency["kind"] != "dev" and dependency["name"] in names
    }
    return {(a, b) for a, b in pairs if a != b}


def faults_of_map(text, packages):
    for package in packages:
        folder = Path(package["manifest_path"]).parent.relative_to(ROOT)
        if not any(f"`{at}/`" in text for at in [folder, *folder.parents]):
            yield f"CONTRIBUTING.md: the map lacks {folder}/"


def faults_of_examples(packages):
    names = [target["name"] for package in packages for target in package["targets"] if target["kind"] == ["example"]]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"{names.count(name)} examples are called {name}"


def faults_of_links(name, text):
    for found in re.finditer(r"\]\((\.\./[^)]*|\w+(?:::|@)[^)]*)\)", text):
        yield f"{name}: the link {found[1]} leads nowhere {'on docs.rs' if found[1].startswith('.') else 'but in rustdoc'}"


def faults_of_first_screen(name, text):
    screen = "\n".join(text.split("\n")[:45])
    if not re.search(r"^(```(rust|c|console)$|\| you have \|)", screen, re.MULTILINE):
        yield f"{name}: nothing in the first 45 lines says what to call"


def cells_of(text):
    """The rows of all tables, by the name that stands in the first cell that has only one."""
    for row in re.findall(r"^\|(.*)\|$", text, re.MULTILINE):
        cells = [cell.strip() for cell in row.split("|")]
        name = next((found[1] for cell in cells if (found := re.fullmatch(r"\[?`([\w-]+)`(?:\]\(.*\))?", cell))), None)
        if name:
            yield name, cells


def faults_of_figures(text, images, budget):
    images = {name: cells[1:4] for name, cells in cells_of(images)}
    kernels = dict(re.findall(r"^(\w+) = \{ (O3 = [\d.]+, Os = [\d.]+)", budget, re.MULTILINE))
    for name, cells in cells_of(text):
        if name in images and cells[-3:] != images[name]:
            yield f"servowire-drivers/README.md: {name} has {images[name]} in the table of the images"
        if name in kernels:
            measured = [float(figure) for figure in re.findall(r"= ([\d.]+)", kernels[name])]
            said = [float(figure.replace(",", "")) for figure in cells[-1].split(";")]
            if len(said) != len(measured) or any(abs(a - b) > 0.05 * b for a, b in zip(said, measured)):
                yield f"servowire-drivers/README.md: {name} takes {measured}"


def check():
    workspace = metadata(ROOT / "Cargo.toml")
    others = [ROOT / "fuzz/Cargo.toml", ROOT / "tests/bare-metal/Cargo.toml", *ROOT.glob("examples/firmware/*/Cargo.toml")]
    packages = [*workspace, *(package for manifest in others for package in metadata(manifest))]
    roots = roots_of(packages)
    faults = [
        *faults_of_imports(roots),
        *faults_of_drawing((ROOT / "README.md").read_text(), dependencies(packages), {name_of(p) for p in packages}),
        *faults_of_map((ROOT / "CONTRIBUTING.md").read_text(), workspace),
        *faults_of_examples(workspace),
        *(
            fault
            for file in (Path(package["manifest_path"]).with_name("README.md") for package in workspace if package["publish"] is None)
            for fault in [*faults_of_links(short(file), file.read_text()), *faults_of_first_screen(short(file), file.read_text())]
        ),
        *faults_of_figures(
            (ROOT / "servowire-drivers/README.md").read_text(),
            (ROOT / "examples/firmware/README.md").read_text(),
            (ROOT / "tests/bare-metal/budget.toml").read_text(),
        ),
    ]
    public, idle, more = public_names.check(ROOT, packages, code_of, without_tests)
    faults += more
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"house: {len(roots)} crates, {public} public names ({len(idle)} used by nothing but their own crate), {len(faults)} faults")
    return not faults


# --- that it can fail ------------------------------------------------------------------------------------------------

# A circle of two through a re-export of the root, one of three through `super` and a path in an expression; what only looks like one:
# comments, strings, tests, a parent that only re-exports, and a name of another crate.
SOURCES = {
    "lib.rs": "mod a; mod b; mod c; mod d; mod e; mod quiet; pub use a::{A, Other as Renamed}; pub use quiet::*;",
    "a.rs": "use crate::b; pub struct A; pub struct Other; fn f() -> b::B { b::B }",
    "b.rs": "use crate::{Renamed, quiet::Quiet}; pub struct B;",
    "c.rs": "use super::d::{self}; pub fn c() { d::d() }",
    "d.rs": "pub fn d() -> u8 { let _: &'static str = \"crate::a::A\"; crate::e::inner::e() }",
    "e.rs": "pub mod inner { use super::super::c::c; pub fn e() -> u8 { c(); 1 } }",
    "quiet.rs": "mod low; mod high; pub use low::Low; pub use high::High; pub struct Quiet; // crate::a::A\n"
    "#[cfg(test)] mod tests { use crate::a::A; use super::*; }",
    "quiet/low.rs": "use core::fmt; pub struct Low; /* use super::High; */ fn b() { std::b::x() }",
    "quiet/high.rs": "use super::{Low, Quiet}; pub struct High(Low, Quiet);",
}

DRAWING = """
```text
 top (of all)   other      some words that say what
  │               │
  └────┬──────────┘
       ▼
 one   two                 three words more
  └─┬───┘
   low
```
"""


def self_test():
    def equal(what, want, got):
        if want != got:
            sys.exit(f"house.py: the check of {what} is broken: wanted {want}, got {got}")

    with tempfile.TemporaryDirectory() as folder:
        for name, text in SOURCES.items():
            path = Path(folder) / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        crate = Crate(Path(folder) / "lib.rs")
        circles = [[file.name for file in circle] for circle, _ in crate.circles()]
        equal("circles", [["a.rs", "b.rs"], ["c.rs", "d.rs", "e.rs"]], circles)
        (Path(folder) / "b.rs").write_text("pub struct B;")
        (Path(folder) / "e.rs").write_text("pub mod inner { pub fn e() -> u8 { 1 } }")
        equal("imports without circles", [], list(faults_of_imports([Path(folder) / "lib.rs"])))
    names = {"top", "other", "one", "two", "low", "three"}
    real = {("top", "two"), ("other", "one"), ("one", "low"), ("two", "low"), ("top", "low")}
    equal("a true drawing", ["README.md: the drawing lacks three"], list(faults_of_drawing(DRAWING, real, names)))
    names.remove("three")
    for wrong, extra, words in [
        (real | {("low", "two")}, set(), "low depends on two"),
        (real | {("one", "two")}, set(), "one depends on two"),
        (real, {"new"}, "lacks new"),
        (real - {("one", "low")}, set(), "from one to low"),
        (real - {("top", "two"), ("top", "low")}, set(), "from top to one, two"),
    ]:
        faults = list(faults_of_drawing(DRAWING, wrong, names | extra))
        equal(f"a drawing that is wrong ({words})", True, any(words in fault for fault in faults))
    places = [{"manifest_path": str(ROOT / name / "Cargo.toml")} for name in "ab"]
    equal("links", 2, len(list(faults_of_links("README.md", "[a](../b/README.md) [c](d.md) [e](https://f) [g](h::I)"))))
    equal("first screens", 1, sum(len(list(faults_of_first_screen("README.md", "\n" * n + "```rust"))) for n in (44, 45)))
    images, budget = "| [`one`](a/README.md) | 1 kB | 2 B | 3 B | 4 |", "two = { O3 = 1234.4, Os = 56.2, limit_O3 = 7 }"
    equal("true figures", [], list(faults_of_figures("| `one` | x | 1 kB | 2 B | 3 B |\n| y | `two` | 1,234; 56 |", images, budget)))
    equal("figures", 2, len(list(faults_of_figures("| `one` | x | 1 kB | 2 B | 4 B |\n| y | `two` | 1,234; 50 |", images, budget))))
    equal("examples", 1, len(list(faults_of_examples([{"targets": [{"name": "a", "kind": ["example"]}] * 2}]))))
    equal("the map", 1, len(list(faults_of_map("| `a/` |", places))))
    public_names.self_test(equal)
    print("house: the checks see what they look for")


if sys.argv[1:] == ["--self-test"]:
    self_test()
elif sys.argv[1:]:
    sys.exit(__doc__)
else:
    sys.exit(0 if check() else 1)
