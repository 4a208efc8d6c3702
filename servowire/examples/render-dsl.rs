//! Renders the bundled HIPERFACE DSL capture: `cargo run -p servowire --example render-dsl`.
//!
//! The line bits are the first row of `tests/vectors/hdsl/fw_startup.jsonl`: what the receiver firmware of the Motor
//! Control SDK sends, executed on a model of its core, and what the model of an encoder answers. The edges are made
//! here, without jitter; the answers come one and a half bits after PARA.
#![allow(clippy::std_instead_of_core, clippy::arithmetic_side_effects)]

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// The file below `captures/`.
pub(crate) const FILE: &str = "hdsl-fw-startup.vcd";

/// Picoseconds of three bits, which are 320 ns.
const THREE_BITS: u64 = 320_000;
/// Bits that the line is released for: switch bit, answer, reserve, two of TRAILER.
const RELEASED: u64 = 1 + 61 + 12 + 2;

fn main() -> Result<(), Box<dyn Error>> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = render(&package.join("../tests/vectors/hdsl/fw_startup.jsonl"))?;
    let path = package.join("../servowire-decode/captures").join(FILE);
    fs::write(&path, text)?;
    println!("{}", path.display());
    Ok(())
}

/// The content of the file.
pub(crate) fn render(rows: &Path) -> Result<String, Box<dyn Error>> {
    let rows = fs::read_to_string(rows)?;
    let row: serde_json::Value = serde_json::from_str(rows.lines().next().unwrap_or_default())?;
    let frames = row.get("frames").and_then(serde_json::Value::as_array).ok_or("no frames")?;
    let mut text =
        "$comment bits: receiver firmware of the Motor Control SDK and a model of an encoder; edges: rendered by \
                    servowire $end\n$timescale 1 ps $end\n$scope module line $end\n$var wire 1 ! DSL $end\n\
                    $upscope $end\n$enddefinitions $end\n#0\n1!\n"
            .to_owned();
    // Half bits since the beginning; a little idle line first.
    let (mut now, mut level) = (20_u64, true);
    let mut set = |at: u64, next: bool| {
        if next != level {
            level = next;
            // Writing to a string cannot fail.
            let _ = writeln!(text, "#{}\n{}!", at * THREE_BITS / 6, u8::from(next));
        }
    };
    for frame in frames {
        let bits = |at: usize| frame.get(at).and_then(serde_json::Value::as_str).ok_or("no line bits");
        for bit in bits(2)?.bytes() {
            set(now, bit == b'1');
            now += 2;
        }
        // The line idles high, with the answer in between.
        set(now, true);
        for (at, bit) in (now + 3..).step_by(2).zip(bits(3)?.bytes()) {
            set(at, bit == b'1');
        }
        set(now + 3 + 2 * 61, true);
        now += 2 * RELEASED;
    }
    let _ = writeln!(text, "#{}", now * THREE_BITS / 6);
    Ok(text)
}
