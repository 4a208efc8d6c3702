//! Checks the blocks of an FST file before the library reads them: the library trusts every length, so a file of a few
//! bytes could use up all memory or send it into an endless loop.

use std::io::SeekFrom;

use super::super::input::SeekRead;

/// An unpacked block is at most this many times as long as the packed one: more than deflate can achieve.
const PACKED: u64 = 1100;
/// Maximum size of a list of variables.
const MOST: u64 = 1 << 28;

/// Types of blocks.
const GEOMETRY: u8 = 3;
const HIERARCHY: [u8; 3] = [4, 6, 7];
const VALUES: [u8; 3] = [1, 5, 8];
const SKIP: u8 = 255;

/// Reports what is wrong with the lengths in a file; leaves the file at its beginning.
pub(super) fn check(file: &mut dyn SeekRead) -> Result<(), String> {
    let broken = |e: std::io::Error| format!("cannot be read: {}", e.to_string().to_lowercase());
    let end = file.seek(SeekFrom::End(0)).map_err(broken)?;
    let mut at = 0;
    while at < end {
        file.seek(SeekFrom::Start(at)).map_err(broken)?;
        let mut head = [0; 1 + 3 * 8];
        // A block may be shorter than this, but not than its type and length.
        let mut got = 0;
        while let Some(free) = head.get_mut(got..).filter(|free| !free.is_empty()) {
            match file.read(free).map_err(broken)? {
                0 => break,
                n => got += n,
            }
        }
        let number = |from: usize| {
            head.get(from..from + 8).and_then(|eight| eight.first_chunk()).map_or(0, |eight| u64::from_be_bytes(*eight))
        };
        let (kind, length) = (head[0], number(1));
        if kind == SKIP && length == 0 {
            break;
        }
        let after = (at + 1).checked_add(length).filter(|after| got > 8 && length >= 8 && *after <= end);
        let Some(after) = after else {
            return Err("incomplete: a block ends beyond the end of the file, so it was cut off or is damaged".into());
        };
        let too_large = |unpacked: u64| unpacked > MOST || unpacked > length * PACKED;
        // The number of variables, of which each takes a byte at least.
        let variables = if kind == GEOMETRY { number(17) } else { 0 };
        let lists = kind == GEOMETRY || HIERARCHY.contains(&kind);
        if lists && (too_large(number(9)) || variables > number(9)) {
            return Err("damaged: a list of variables is longer than its block can hold".into());
        }
        if VALUES.contains(&kind) {
            // The table of times stands last: its length unpacked, packed, and the number of times.
            let mut foot = [0; 24];
            file.seek(SeekFrom::Start(after.saturating_sub(24))).map_err(broken)?;
            file.read_exact(&mut foot).map_err(broken)?;
            let foot = u128::from_be_bytes(*foot.last_chunk().unwrap_or(&[0; 16]));
            let times = foot as u64;
            if too_large(times) {
                return Err("damaged: a table of times is longer than its block can hold".into());
            }
        }
        at = after;
    }
    file.seek(SeekFrom::Start(0)).map_err(broken)?;
    Ok(())
}
