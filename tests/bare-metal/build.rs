//! Turns vector rows into Rust tables for the self-test and the kernels, and places the image in memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::{env, io};

use serde_json::Value;

#[path = "build/hdsl.rs"]
mod hdsl;
#[path = "build/nikon.rs"]
mod nikon;
#[path = "build/rtex.rs"]
mod rtex;
#[path = "build/sorte.rs"]
mod sorte;
#[path = "build/step_profile.rs"]
mod step_profile;
#[path = "../../step-motion/tests/all/toolpaths/ten.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
#[expect(clippy::cast_precision_loss, clippy::cast_sign_loss, reason = "small positive numbers of a generator")]
mod ten;
#[path = "build/tformat.rs"]
mod tformat;
#[path = "build/toolpaths.rs"]
#[expect(clippy::cast_sign_loss, reason = "limits and feeds are positive")]
mod toolpaths;

/// A protocol's folder under `tests/vectors` and what makes its tables, from a reader of topics.
type Protocol = (&'static str, fn(&dyn Fn(&str) -> Vec<Value>) -> String);

const PROTOCOLS: &[Protocol] = &[
    ("hdsl", hdsl::tables),
    ("nikon", nikon::tables),
    ("rtex", rtex::tables),
    ("sorte", sorte::tables),
    ("step-profile", step_profile::tables),
    ("tformat", tformat::tables),
];

fn main() -> io::Result<()> {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    for (name, tables) in PROTOCOLS {
        let folder = here.join("../vectors").join(name);
        println!("cargo:rerun-if-changed={}", folder.display());
        fs::write(out.join(format!("{name}.rs")), tables(&|topic| rows(&folder, topic)))?;
    }
    fs::write(out.join("toolpaths.rs"), toolpaths::tables())?;
    println!("cargo:rerun-if-changed=../../step-motion/tests/all/toolpaths/ten.rs");
    fs::copy(here.join("memory.x"), out.join("memory.x"))?;
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    Ok(())
}

/// The rows of `folder/topic.jsonl`, without the `about` line.
fn rows(folder: &Path, topic: &str) -> Vec<Value> {
    let path = folder.join(topic).with_extension("jsonl");
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let row = |line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().map(row).filter(|row: &Value| row.get("about").is_none()).collect()
}

/// `pub(crate) static HEAD = &[item of each row];`
fn table<'a>(head: &str, rows: impl IntoIterator<Item = &'a Value>, item: impl Fn(&Value) -> String) -> String {
    let items: String = rows.into_iter().map(|row| item(row) + ",\n").collect();
    format!("pub(crate) static {head} = &[\n{items}];\n")
}

/// The text of a key.
fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().unwrap_or_else(|| panic!("{row}: no text under {key:?}"))
}

/// The number of a key.
fn number(row: &Value, key: &str) -> u64 {
    row[key].as_u64().unwrap_or_else(|| panic!("{row}: no number under {key:?}"))
}

/// `"0220b4"` as `[0x02,0x20,0xb4,]`.
fn bytes(hex: &str) -> String {
    let digits: Vec<char> = hex.chars().collect();
    let bytes: String = digits.chunks(2).map(|pair| format!("0x{},", String::from_iter(pair))).collect();
    format!("[{bytes}]")
}

/// Line bits in time order as a number with the first in bit 0.
fn line(bits: &str) -> String {
    format!("0b{}", bits.chars().rev().collect::<String>())
}

/// Line bits in time order as a call of the table's `window(bits, len)`.
fn window(bits: &str) -> String {
    format!("window({}, {})", line(bits), bits.len())
}

/// Line bits in time order as an array of bytes, each made by `byte` of its eight bits; unused bits are 0.
fn line_bytes(bits: &str, byte: impl Fn(&str) -> String) -> String {
    let padded = format!("{bits:0<width$}", width = bits.len().next_multiple_of(8));
    let bytes: String = (0..padded.len()).step_by(8).map(|at| byte(&padded[at..at + 8]) + ",").collect();
    format!("[{bytes}]")
}

/// `"start_bit"` as `StartBit`.
fn pascal(name: &str) -> String {
    let word = |word: &str| word[..1].to_uppercase() + &word[1..];
    name.split('_').map(word).collect()
}
