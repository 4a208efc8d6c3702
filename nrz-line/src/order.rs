/// Which end of a byte was on the line first.
///
/// ```text
///              line, time →   t0 t1 t2 t3 t4 t5 t6 t7
/// LsbFirst     bit of byte     0  1  2  3  4  5  6  7     UART, sigrok, most DMA buffers
/// MsbFirst     bit of byte     7  6  5  4  3  2  1  0     SPI and other shift registers
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BitOrder {
    /// The first bit on the line is bit 0 of its byte.
    LsbFirst,
    /// The first bit on the line is bit 7 of its byte.
    MsbFirst,
}
