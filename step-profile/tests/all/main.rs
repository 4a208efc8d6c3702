//! What the crate promises, seen from outside.
#![allow(missing_docs, clippy::unwrap_used)]

mod bounds;
#[cfg(feature = "serde")]
mod serde;
