#![doc = include_str!("../README.md")]
#![no_std]
#![allow(non_camel_case_types, reason = "names as C writes them")]

#[cfg(any(test, feature = "std"))]
extern crate std;

pub mod aformat;
mod border;
mod clock;
pub mod hdsl;
pub mod motion;
pub mod nrz;
mod procedure;
mod result;
pub mod rtex;
pub mod sorte;
pub mod step;
#[cfg(test)]
mod tests;
pub mod tformat;
mod version;

pub use clock::{SW_NO_TIME, sw_clock_ns, sw_clock_start, sw_clock_t};
pub use result::{sw_code_t, sw_result_t, sw_text};
pub use version::{
    SERVOWIRE_VERSION, SERVOWIRE_VERSION_MAJOR, SERVOWIRE_VERSION_MINOR, SERVOWIRE_VERSION_PATCH, sw_version,
};

/// Never called: no function of this library can panic, and the tests of the library look for it.
#[cfg(all(feature = "panic-handler", not(feature = "std"), not(test)))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
