//! Hands the linker its script, which is that of the HAL.

fn main() {
    println!("cargo:rustc-link-arg-bins=-Tlinkall.x");
}
