//! The words through which the background and the interrupt know of each other. In tests the interrupt may come before any access to
//! one of them.

#[cfg(not(test))]
pub(crate) use core::sync::atomic::AtomicU32 as Word;

#[cfg(test)]
mod tests;
#[cfg(test)]
mod watched;
#[cfg(test)]
pub(crate) use watched::Word;
