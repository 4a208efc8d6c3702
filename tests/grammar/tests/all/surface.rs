//! What a public signature must not have: a `bool` whose meaning is not at the place of the call, and a tuple whose parts have
//! no names. Exceptions are listed with their reasons in `exceptions.txt`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const CRATES: &[&str] = &[
    "servowire-core",
    "nrz-line",
    "tformat",
    "nikon-aformat",
    "hdsl",
    "rtex-block",
    "sorte-proto",
    "step-motion",
    "step-profile",
    "servowire-decode",
    "servowire-drivers",
];

/// `FILE FUNCTION kind: reason`, a line each.
const EXCEPTIONS: &str = include_str!("../../exceptions.txt");

/// A public function: its name, what is between the parentheses, and what it gives.
#[derive(Debug, PartialEq, Eq)]
struct Signature {
    name: String,
    arguments: String,
    gives: String,
}

/// The public functions of a source file, those of its unit tests left out.
fn signatures(text: &str) -> Vec<Signature> {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or(text);
    let mut found = Vec::new();
    for (at, _) in code.match_indices("pub ") {
        let line_start = code[..at].rfind('\n').map_or(0, |at| at + 1);
        if !code[line_start..at].trim().is_empty() {
            continue;
        }
        let rest = code[at + 4..].trim_start_matches("const ").trim_start_matches("async ");
        let Some(rest) = rest.strip_prefix("fn ") else { continue };
        let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let Some(open) = rest.find('(') else { continue };
        let Some(close) = matching(&rest[open..]) else { continue };
        let after = &rest[open + close + 1..];
        let body = after.find('{').unwrap_or(after.len());
        let gives = after[..body].trim().trim_start_matches("->").trim();
        found.push(Signature {
            name,
            arguments: rest[open + 1..open + close].to_owned(),
            gives: gives.split(" where").next().unwrap_or(gives).split("\nwhere").next().unwrap_or("").to_owned(),
        });
    }
    found
}

/// Place of the parenthesis that closes the one at the beginning.
fn matching(text: &str) -> Option<usize> {
    let mut depth = 0;
    text.char_indices().find_map(|(at, c)| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        (depth == 0).then_some(at)
    })
}

/// The arguments, taken apart at the commas that stand in no brackets.
fn apart(arguments: &str) -> Vec<String> {
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for c in arguments.chars() {
        depth += i32::from("([<".contains(c)) - i32::from(")]>".contains(c));
        match parts.last_mut() {
            Some(last) if c != ',' || depth > 0 => last.push(c),
            _ => parts.push(String::new()),
        }
    }
    parts
}

/// An argument that is a `bool`, or has one in it; a closure that answers yes or no is no such argument.
fn has_bool(arguments: &str) -> bool {
    apart(arguments).iter().filter(|argument| !argument.contains("Fn")).any(|argument| {
        argument
            .split_once(':')
            .is_some_and(|(_, kind)| kind.split(|c: char| !c.is_alphanumeric()).any(|word| word == "bool"))
    })
}

/// A tuple with two parts or more among what is given; that of a `nom` parser, rest and value, is its own.
fn has_tuple(gives: &str) -> bool {
    let gives = gives.split("Fn").next().unwrap_or(gives);
    !gives.contains("IResult")
        && gives.match_indices('(').any(|(at, _)| {
            let before = gives[..at].chars().next_back().unwrap_or(' ');
            let inside = matching(&gives[at..]).map_or("", |end| &gives[at + 1..at + end]);
            !before.is_alphanumeric() && inside.contains(',')
        })
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|end| end == "rs") && !path.ends_with("tests.rs") {
            into.push(path);
        }
    }
}

fn found() -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut found = BTreeMap::new();
    for name in CRATES {
        let mut files = Vec::new();
        sources(&root.join(name).join("src"), &mut files);
        assert!(!files.is_empty(), "{name} has no sources");
        for file in files {
            for signature in signatures(&fs::read_to_string(&file).unwrap()) {
                let place = file.strip_prefix(&root).unwrap_or(&file).display();
                let mut report = |kind: &str, text: &str| {
                    found.insert(format!("{place} {} {kind}", signature.name), text.trim().to_owned());
                };
                if has_bool(&signature.arguments) {
                    report("bool", &signature.arguments);
                }
                if has_tuple(&signature.gives) {
                    report("tuple", &signature.gives);
                }
            }
        }
    }
    found
}

#[test]
fn no_bare_bool_and_no_tuple_without_its_reason() {
    let mut found = found();
    let mut stale = Vec::new();
    for line in EXCEPTIONS.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (what, reason) = line.split_once(": ").unwrap_or_else(|| panic!("no reason: {line}"));
        assert!(reason.len() > 10, "no reason: {line}");
        if found.remove(what).is_none() {
            stale.push(what);
        }
    }
    assert!(found.is_empty(), "give the argument or the parts a name:\n{found:#?}");
    assert!(stale.is_empty(), "exceptions for what is no longer there: {stale:?}");
}

#[test]
fn the_check_sees_what_it_looks_for() {
    let text = "
    /// Doc.
    pub const fn both(self, last: bool) -> (u8, u8) {
        todo()
    }

    pub fn several(
        list: &[(u8, bool)],
        far: u8,
    ) -> Option<(u8, u16)>
    where
        u8: Copy,
    {
    }

    pub fn none(&self, ask: impl FnMut(bool) -> bool, word: Boolean) -> Result<[u8; 2], Error<(u8)>> {}
    pub(crate) fn inner(last: bool) -> (u8, u8) {}
    fn own(last: bool) -> (u8, u8) {}
#[cfg(test)]
mod tests {
    pub fn helper(last: bool) -> (u8, u8) {}
}
";
    let seen: Vec<_> =
        signatures(text).iter().map(|s| (s.name.clone(), has_bool(&s.arguments), has_tuple(&s.gives))).collect();
    let want = [("both", true, true), ("several", true, true), ("none", false, false)];
    assert_eq!(seen, want.map(|(name, bool, tuple)| (name.to_owned(), bool, tuple)));
}
