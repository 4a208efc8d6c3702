//! All tests of the crate through its public interface, in one binary.
#![allow(clippy::arithmetic_side_effects, clippy::indexing_slicing, clippy::unwrap_used, missing_docs)]

mod laws;
