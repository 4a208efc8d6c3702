//! A kernel that can panic: `run.sh` has to find it.

use super::kernels;

kernels! {
    /// Indexes a slice without knowing its length.
    fn deliberate_panic(at: &usize) -> u8 {
        [0x1a, 0x20, 0x33][*at]
    } over [0_usize, 1, 2];
}
