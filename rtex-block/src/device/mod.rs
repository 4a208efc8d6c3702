//! The drive's side: what a simulator or a test bench runs.

mod check;

pub use check::{Verdict, check};
