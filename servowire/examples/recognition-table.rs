//! How many random captures are decoded without a fault, by condition: `cargo run --release -p servowire --example
//! recognition-table [--from FIRST] [CAPTURES [WORDS...]]`.
//!
//! The captures are drawn from the tables of the protocols (`tests/random`), with none of the crates' encoders. *Right*
//! is a capture in which every line was found with no option, every frame came out as it was sent, and nothing else.
//! *Wrong* are values shown as `ok` that were never sent.
//!
//! Captures have numbers from 0 on; `--from` draws others than those that the program was built with.
#![allow(clippy::cast_precision_loss, clippy::arithmetic_side_effects, clippy::std_instead_of_core)]

#[path = "../tests/random/mod.rs"]
mod random;

use random::speech::Kind;
use random::table::{CONDITIONS, row};

fn main() {
    let mut arguments = std::env::args().skip(1).peekable();
    let first = arguments.next_if(|word| word == "--from").and_then(|_| arguments.next()?.parse().ok()).unwrap_or(0);
    let captures = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(100);
    let words: Vec<String> = arguments.collect();
    println!("{:<42} {:<14} {:>8} {:>7} {:>6}", "condition", "protocol", "captures", "right", "wrong");
    for condition in CONDITIONS {
        for kind in Kind::ALL {
            let title = format!("{} {}", condition.name, kind.name());
            if !words.iter().all(|word| title.contains(word)) {
                continue;
            }
            let row = row(condition, kind, first, captures);
            let right = 100.0 * f64::from(row.right) / f64::from(captures);
            println!("{:<42} {:<14} {captures:>8} {right:>6.1}% {:>6}", condition.name, kind.name(), row.wrong);
            for (seed, why, notes) in row.faults.iter().filter(|_| first > 0 || !words.is_empty()) {
                println!("    seed {seed}: {why}\n{notes}");
            }
        }
    }
}
