//! Another Rust library of a firmware, with a panic handler of its own.
#![no_std]

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Divides, which may panic.
#[unsafe(no_mangle)]
pub extern "C" fn other_divide(a: u32, b: u32) -> u32 {
    a / b
}
