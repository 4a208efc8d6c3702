use crate::error::ErrorClass;

/// Good blocks, and refused ones by their class, up to [`ErrorClass::NonCyclicCode`]: those that a response can be refused for. A
/// master decodes leniently, so what strict decoding refuses besides is not counted.
pub type Counters = servowire_core::Counters<6>;

const _: () = assert!(matches!(ErrorClass::ALL, [_, _, _, _, _, ErrorClass::NonCyclicCode, ..]));
