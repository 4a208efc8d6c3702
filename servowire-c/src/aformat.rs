//! Nikon A-format.

mod bus;
mod codec;
mod device;
mod frame;
mod names;
mod procedure;
mod values;
mod words;

pub use bus::*;
pub use codec::*;
pub use device::*;
pub use frame::*;
pub use names::*;
pub use procedure::*;
pub use values::*;
pub use words::*;
