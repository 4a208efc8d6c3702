//! What the crate promises, seen from outside.
#![cfg(feature = "serde")]
#![allow(missing_docs, clippy::unwrap_used)]

mod serde;
