//! Panasonic RTEX.

mod axis;
mod block;
mod block32;
mod control;
mod drive;
pub(crate) mod names;
mod pack;
mod procedure;
mod ring;

pub use axis::*;
pub use block::*;
pub use block32::*;
pub use control::*;
pub use drive::*;
pub use names::*;
pub use pack::*;
pub use procedure::*;
pub use ring::*;
