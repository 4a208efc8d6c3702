//! Messages over the parameters channel: one nibble per H-frame in each direction.
//!
//! ```text
//!  first byte   bit 7   0 short, 1 long       bit 6   1 read, 0 write
//!
//!  short read   40h|reg              CRC CRC    ->   40h|reg  data      CRC CRC
//!  short write  reg      data        CRC CRC    ->   reg                CRC CRC
//!  long         ADD_H ADD_L [OFF_H OFF_L] [data] CRC CRC
//!                                               ->   ADD_H ADD_L [data] CRC CRC
//! ```
//!
//! Each byte is sent high nibble first, with at least one IDLE between two messages. There is no limit to the time that an
//! encoder takes to answer.

#[cfg(feature = "files")]
mod access;
mod bytes;
#[cfg(feature = "files")]
mod file;
mod limits;
mod long;
mod nibbles;
mod requester;
mod responder;
mod short;

pub use crate::resource::{Offset, ResourceAddress, ResourceError, ResourceErrorClass};
#[cfg(feature = "files")]
#[cfg_attr(docsrs, doc(cfg(feature = "files")))]
pub use access::AccessLevel;
pub use bytes::MessageBytes;
#[cfg(feature = "files")]
#[cfg_attr(docsrs, doc(cfg(feature = "files")))]
pub use file::{FileName, FileStatus};
pub use limits::Limits;
pub use long::{Access, Data, Length, LongAnswer, LongRequest};
pub use requester::{Finished, Requester};
pub use responder::{Request, Responder};
pub use short::{RemoteRegister, ShortAnswer, ShortRequest};
