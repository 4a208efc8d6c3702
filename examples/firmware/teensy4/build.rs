//! Hands the linker its script, which is that of the board's crate.

fn main() {
    println!("cargo:rustc-link-arg-bins=-Tt4link.x");
}
