//! All tests that see the crate from outside, as one binary.
#![allow(missing_docs, clippy::arithmetic_side_effects, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]
#![allow(clippy::duplicate_mod, reason = "the generator of the golden traces brings its cable along")]
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss)]

mod ahead;
mod bench;
mod both_ends;
mod cable;
mod commutation;
mod complaints;
mod dialects;
mod encoder;
mod events;
mod golden;
mod hostile;
mod instant;
mod line;
mod lost_frames;
mod message_rules;
mod position_laws;
mod receiver;
mod register_map;
mod remote;
mod remote_resets;
#[cfg(feature = "serde")]
mod serde;
mod settings;
mod small_print;
mod world;
