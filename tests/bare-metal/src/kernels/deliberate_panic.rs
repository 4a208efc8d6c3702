//! Kernels that can panic, each in its own way: `run.sh` has to find them all.

use super::kernels;

const BYTES: [u8; 3] = [0x1a, 0x20, 0x33];

kernels! {
    /// An index.
    fn panic_index(at: &usize) -> u8 {
        BYTES[*at]
    } over [0_usize, 1, 2];

    /// The ends of a range.
    fn panic_range((from, to): &(usize, usize)) -> &'static [u8] {
        &BYTES[*from..*to]
    } over [(0_usize, 2_usize)];

    /// A value that is not there.
    fn panic_unwrap(value: &Option<u8>) -> u8 {
        value.unwrap()
    } over [Some(1_u8)];

    /// A divisor of 0.
    fn panic_division((a, b): &(u32, u32)) -> u32 {
        a / b
    } over [(7_u32, 2_u32)];

    /// Slices of different lengths.
    fn panic_copy(len: &usize) -> [u8; 3] {
        let mut out = [0; 3];
        out.copy_from_slice(BYTES.get(..*len).unwrap_or(&[]));
        out
    } over [3_usize];

    /// An address of code that is only known at run time.
    fn panic_pointer(call: &fn(u8) -> u8) -> u8 {
        call(1)
    } over [u8::reverse_bits as fn(u8) -> u8];
}
