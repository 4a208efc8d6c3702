//! HIPERFACE DSL.

use hdsl::Error;

use crate::border::Refused;
use crate::result::{Protocol, refused};

mod answer;
mod device;
mod fast;
mod head;
mod message;
mod names;
mod receiver;
mod registers;
mod sampling;
mod word;

pub use answer::*;
pub use device::*;
pub use fast::*;
pub use head::*;
pub use message::*;
pub use names::*;
pub use receiver::*;
pub use registers::*;
pub use sampling::*;
pub use word::*;

fn error(error: Error) -> Refused {
    refused(Protocol::Hdsl, error.class().number())
}
