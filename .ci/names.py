"""Check 5 of house.py: a public name has a user.

A public name that nothing outside the sources of its crate uses, not even a test, is one that nobody can judge: it becomes private, or
it gets an example or a test. Those that stay although nothing uses them stand in `names.txt` with their reasons:

    FILE NAME: why it is public

A user is code of a package that depends on the crate, of the crate's own tests, examples and doctests, or what its README names.
A type that stands in a public signature needs no user of its own. Comments, strings and the crate's own unit tests do not count.
"""

import re
from pathlib import Path

ITEM = re.compile(r"^[ \t]*pub\s+(?:(?:const|async|unsafe)\s+)*(fn|struct|enum|trait|type|static|const|mod)\s+(\w+)([^;{]*)", re.MULTILINE)
FIELD = re.compile(r"^[ \t]*pub\s+\w+\s*:([^,\n]*)", re.MULTILINE)
EXPORTED = re.compile(r"#\[macro_export\]\s*(?:#\[[^\]]*\]\s*)*macro_rules!\s*(\w+)")
# What a variant or a macro's argument carries, what a trait or its implementation gives.
INSIDE = re.compile(r"^[ \t]*(?:\w+\s*[({][^\n]*|type\s+\w+\s*(?::|=)[^;]*;)", re.MULTILINE)
TRAIT = re.compile(r"^pub trait\b", re.MULTILINE)
TYPES = {"struct", "enum", "trait", "type"}
WORD = re.compile(r"\w+")


def words(text):
    return set(WORD.findall(text))


def examples_in(text):
    """The code in the documentation of a source file."""
    lines, inside = [], False
    for line in text.split("\n"):
        found = re.match(r"\s*//[/!] ?(.*)", line)
        if not found:
            inside = False
        elif found[1].startswith("```"):
            inside = not inside
        elif inside:
            lines.append(found[1])
    return "\n".join(lines)


def code_in(text):
    """The code in a README: its blocks, and what stands between backticks."""
    blocks = re.findall(r"```.*?```", text, re.DOTALL)
    return "\n".join(blocks + re.findall(r"`[^`\n]+`", re.sub(r"```.*?```", "", text, flags=re.DOTALL)))


def is_source(path):
    return not path.name.startswith("tests") and "tests" not in path.parts


def public_names(texts):
    """Of the sources of a crate, without comments and tests: each public name with the files and kinds it is defined as, and all words of
    public signatures."""
    names, signatures = {}, set()
    for file, text in texts.items():
        for kind, name, rest in ITEM.findall(text):
            names.setdefault(name, set()).add((file, kind))
            signatures |= words(rest)
        for found in TRAIT.finditer(text):
            signatures |= words(text[found.start() : text.find("\n}", found.end())])
        for name in EXPORTED.findall(text):
            names.setdefault(name, set()).add((file, "macro"))
        for rest in [*FIELD.findall(text), *INSIDE.findall(text)]:
            signatures |= words(rest)
    return names, signatures


def without_user(texts, used):
    names, signatures = public_names(texts)
    for name, places in sorted(names.items()):
        if name not in used and not (name in signatures and all(kind in TYPES for _, kind in places)):
            for file, _ in sorted(places):
                yield f"{file} {name}"


def faults(found, exceptions):
    """`found`: names without a user; `exceptions`: the lines of names.txt."""
    found, listed = set(found), {}
    for line in exceptions:
        if line and not line.startswith("#"):
            what, _, reason = line.partition(": ")
            listed[what] = reason
            if len(reason) < 10:
                yield f"names.txt: no reason: {line}"
    for what in sorted(found - set(listed)):
        yield f"{what} is public and nothing uses it: make it private, or add a test or an example"
    for what in sorted(set(listed) - found):
        yield f"names.txt: an exception that nothing needs: {what}"


def check(root, packages, code_of, without_tests):
    """`packages`: all packages as cargo tells them; those that are published are looked at, but for the C interface."""
    packages = {package["name"]: package for package in packages}.values()
    folders = {package["name"]: Path(package["manifest_path"]).parent for package in packages}

    def rust(folder):
        others = [other for other in folders.values() if folder in other.parents]
        for path in sorted(folder.rglob("*.rs")):
            if "target" not in path.parts and not any(other in path.parents for other in others):
                yield path

    code = {name: {path: code_of(path.read_text()) for path in rust(folder)} for name, folder in folders.items()}
    total, found = 0, []
    for package in packages:
        name = package["name"]
        libraries = [target for target in package["targets"] if "lib" in target["kind"]]
        if package["publish"] is not None or not libraries or name in ("servowire", "servowire-c"):
            continue
        src = folders[name] / "src"
        own = {
            path: without_tests(text)
            for path, text in code[name].items()
            if src in path.parents and is_source(path.relative_to(src))
        }
        used = words(code_in((folders[name] / "README.md").read_text()))
        for path in own:
            used |= words(examples_in(path.read_text()))
        for path, text in code[name].items():
            if src not in path.parents:
                used |= words(text)
        for other in packages:
            if other["name"] != name and any(dependency["name"] == name for dependency in other["dependencies"]):
                for text in code[other["name"]].values():
                    used |= words(text)
        texts = {path.relative_to(root): text for path, text in own.items()}
        total += len(public_names(texts)[0])
        found += without_user(texts, used)
    exceptions = (root / ".ci/names.txt").read_text().splitlines()
    return total, found, list(faults(found, exceptions))


def self_test(equal):
    texts = {
        "a.rs": "pub fn used() -> Given {}\npub fn idle(a: u8) {}\npub(crate) fn inner() {}\n    pub const fn method(&self) {}\n",
        "b.rs": "pub struct Given;\npub struct Lonely;\npub enum Kind {\n    Of(Carried),\n}\npub struct Carried;\npub const N: u8 = 1;",
    }
    found = list(without_user(texts, {"used", "method", "Kind"}))
    equal("names without a user", ["a.rs idle", "b.rs Lonely", "b.rs N"], sorted(found))
    equal("exceptions", [], list(faults(["a.rs idle"], ["# of", "a.rs idle: a code of the source"])))
    for exceptions, told in [([], "is public"), (["a.rs idle: so"], "no reason"), (["a.rs idle: a code of it", "b.rs N: a code of it"], "nothing needs")]:
        equal(f"names ({told})", [True], [told in fault for fault in faults(["a.rs idle"], exceptions)])
    equal("examples", "a();", examples_in("/// Text b\n/// ```\n/// a();\n/// ```\npub fn c() {}"))
    equal("code of a README", {"a", "b"}, words(code_in("of\n```\na\n```\nis `b`, not c")))
