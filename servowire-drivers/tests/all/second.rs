//! Encoders that use nothing of the crates under test: written from the tables of the documents, for a second opinion.

#[cfg(feature = "nikon")]
pub mod nikon;
#[cfg(feature = "tformat")]
pub mod tformat;
