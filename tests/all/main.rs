//! The vectors, the runner that holds the crates to them, the fuzz targets on their corpora, and a move from its profile to the
//! edges of STEP.
#![allow(clippy::arithmetic_side_effects, clippy::std_instead_of_core, clippy::unwrap_used)]

mod corpora;
mod motion;
mod runner;
mod vectors;
