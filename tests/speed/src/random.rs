//! The generator of the tool's own tests, which knows nothing of the codecs.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    clippy::unnecessary_wraps,
    clippy::unwrap_used,
    reason = "modules of several programs, each using a part of them"
)]

#[path = "../../../servowire/tests/random/dsl.rs"]
pub mod dsl;
#[path = "../../../servowire/tests/random/rng.rs"]
pub mod rng;
#[path = "../../../servowire/tests/random/speech.rs"]
pub mod speech;
#[path = "../../../servowire/tests/random/wire.rs"]
pub mod wire;
