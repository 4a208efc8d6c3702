use crate::error::ErrorClass;

/// Counts good blocks, and refused blocks by their class up to [`ErrorClass::NonCyclicCode`]: the classes for which a
/// response can be refused. A master decodes leniently, so blocks that only strict decoding refuses are not counted.
pub type Counters = servowire_core::Counters<6>;

const _: () = assert!(matches!(ErrorClass::ALL, [_, _, _, _, _, ErrorClass::NonCyclicCode, ..]));
