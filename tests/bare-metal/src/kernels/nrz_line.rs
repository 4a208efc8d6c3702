//! Windows at any offset, and start-stop reception of one field at 8 samples a bit.

use nrz_line::{BitOrder, Field, Format, OutOfBounds, Receiver, Samples, Wave, Window};

use super::kernels;

/// 20 bytes, and the bit at which a window begins.
pub(crate) type Buffer = ([u8; 20], usize);

pub(crate) const BUFFERS: [Buffer; 3] = [([0x5a; 20], 0), ([0x35; 20], 13), ([0xc6; 20], 50)];

/// A receiver at rest, and 96 samples: idle line, a field with the content 0x35, idle line.
type Line<Samples> = (Receiver, Samples);

pub(crate) const RECEIVER: Receiver = match Format::new(8, 8) {
    Ok(format) => Receiver::new(format),
    Err(_) => panic!("8 samples a bit are possible"),
};

/// The content of the field.
pub(crate) const CONTENT: u16 = 0x35;

/// An idle bit, start bit, content and delimiter, the first in bit 0.
const BITS: u32 = 1 << 10 | (CONTENT as u32) << 2 | 1;

/// The samples, the oldest in bit 0.
const SAMPLES: u128 = {
    let (mut samples, mut bit) = (!0, 0);
    while bit < 11 {
        if BITS >> bit & 1 == 0 {
            samples &= !(0xff << (8 * bit));
        }
        bit += 1;
    }
    samples
};

pub(crate) const WORDS: [u64; 2] = [SAMPLES as u64, (SAMPLES >> 64) as u64];

pub(crate) const LEVELS: [bool; 96] = {
    let mut levels = [true; 96];
    let mut at = 0;
    while at < 96 {
        levels[at] = SAMPLES >> at & 1 == 1;
        at += 1;
    }
    levels
};

/// Idle line, the edges of the field, idle line.
pub(crate) const RUNS: [(bool, u64); 9] =
    [(true, 8), (false, 8), (true, 8), (false, 8), (true, 8), (false, 8), (true, 16), (false, 16), (true, 16)];

kernels! {
    /// A window of 110 bits at any offset.
    fn nrz_line_window_lsb((bytes, offset): &Buffer) -> Result<Window, OutOfBounds> {
        Window::read(bytes, *offset, 110, BitOrder::LsbFirst)
    } over BUFFERS;

    /// The same, most significant bit first.
    fn nrz_line_window_msb((bytes, offset): &Buffer) -> Result<Window, OutOfBounds> {
        Window::read(bytes, *offset, 110, BitOrder::MsbFirst)
    } over BUFFERS;

    /// 40 bits over those of a buffer, the buffer copied first.
    fn nrz_line_write((bytes, offset): &Buffer) -> Result<[u8; 20], OutOfBounds> {
        let mut out = *bytes;
        let window = Window::from_bits(0x35_c600_ff5a, 40).and_then(|w| w.skip(0)).unwrap_or(Window::EMPTY);
        window.inverted().write(&mut out, *offset, BitOrder::MsbFirst).map(|()| out)
    } over BUFFERS;

    /// A format from two numbers.
    fn nrz_line_format((samples, bits): &(u32, u32)) -> Option<Receiver> {
        Format::new(*samples, *bits).ok().map(Receiver::new)
    } over [(8, 8), (4, 16), (3, 8)];

    /// One field, sample by sample: 96 calls.
    fn nrz_line_push((receiver, levels): &Line<&'static [bool]>) -> Option<Field> {
        let mut receiver = *receiver;
        let mut found = None;
        for level in *levels {
            if let Some(field) = receiver.push(*level) {
                found = Some(field);
            }
        }
        found
    } over [(RECEIVER, &LEVELS)];

    /// One field as runs of equal samples: 9 calls.
    fn nrz_line_run((receiver, runs): &Line<&'static [(bool, u64)]>) -> Option<Field> {
        let mut receiver = *receiver;
        let mut found = None;
        for (level, len) in *runs {
            if let Some(field) = receiver.run(*level, *len) {
                found = Some(field);
            }
        }
        found
    } over [(RECEIVER, &RUNS)];

    /// One field in packed words: 2 words.
    fn nrz_line_feed((receiver, words): &Line<[u64; 2]>) -> Option<Field> {
        let mut receiver = *receiver;
        let mut found = None;
        for word in words {
            let mut samples = Samples::new(*word);
            while let Some(field) = receiver.feed(&mut samples) {
                found = Some(field);
            }
        }
        found
    } over [(RECEIVER, WORDS)];

    /// When a bit of a simulated transmitter is first seen.
    fn nrz_line_wave((samples, ppm, bit): &(u32, i32, u64)) -> u64 {
        Wave::new(*samples, *ppm, 0).first_sample(*bit)
    } over [(8, 0, 10), (16, 20_000, 100)];
}
