use crate::error::ErrorClass;

/// Good blocks, and refused ones by their class.
pub type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>;
