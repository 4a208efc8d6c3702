//! What the crate promises, seen from outside.
#![allow(missing_docs, clippy::arithmetic_side_effects, clippy::cast_possible_truncation, clippy::cast_precision_loss)]
#![allow(clippy::cast_sign_loss, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod axes_late;
mod axes_requests;
mod axes_turns;
mod axis_blocks;
mod axis_requests;
mod bounds;
mod brakes;
mod changes;
mod halts;
mod homing;
mod joints;
mod laws;
mod lines;
mod looks;
mod machine;
mod mover_places;
mod nearly;
mod overrides;
mod path_laws;
mod path_places;
mod path_queue;
mod path_rests;
mod path_stops;
mod paths;
mod plans;
mod queue;
mod replans;
mod requests;
#[cfg(feature = "serde")]
mod serde;
mod stops;
mod straight;
mod streams;
mod toolpaths;
mod turns;
