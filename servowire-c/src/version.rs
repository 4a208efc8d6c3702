//! Which release this is.

/// The release of this header, before the first dot.
pub const SERVOWIRE_VERSION_MAJOR: u32 = 0;
/// The release of this header, between the dots.
pub const SERVOWIRE_VERSION_MINOR: u32 = 1;
/// The release of this header, after the second dot.
pub const SERVOWIRE_VERSION_PATCH: u32 = 0;
/// The release of this header as one number, 8 bits each: a later one is greater.
pub const SERVOWIRE_VERSION: u32 =
    SERVOWIRE_VERSION_MAJOR << 16 | SERVOWIRE_VERSION_MINOR << 8 | SERVOWIRE_VERSION_PATCH;

/// The release of the library: SERVOWIRE_VERSION, unless your program was compiled with the header of
/// another release. States and structs may then differ, so compare it once, before the first state is
/// started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_version() -> u32 {
    SERVOWIRE_VERSION
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn the_numbers_are_those_of_the_package() {
        let numbers =
            [SERVOWIRE_VERSION_MAJOR, SERVOWIRE_VERSION_MINOR, SERVOWIRE_VERSION_PATCH].map(|it| it.to_string());
        assert_eq!(numbers.join("."), env!("CARGO_PKG_VERSION"));
        assert_eq!(sw_version(), 0x00_01_00);
    }
}
