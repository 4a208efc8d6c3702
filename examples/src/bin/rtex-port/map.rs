//! The part that you write from the data sheet of the ASIC, which is not public: addresses, codes, layouts. **All of these
//! numbers are invented**, for the simulated ASIC of this example.

use rtex_block::MacId;
use rtex_block::master::{Asic, Slave};

/// Register with the state.
pub(crate) const STATE: usize = 0x000;
/// How many slaves the ring configuration has found, and from there on a word for each.
pub(crate) const SLAVES: usize = 0x010;
/// Memory of reception and of transmission, as the host sees their banks: 16 bytes a drive.
pub(crate) const RX: usize = 0x200;
pub(crate) const TX: usize = 0x400;
/// The host is at its transmission bank: the ASIC does not switch it.
pub(crate) const TX_BUSY: usize = 0x002;

/// A servo drive, in the slave table.
pub(crate) const KIND_SERVO: u16 = 1;

/// The state by its code; a code that is not in the data sheet is like no ring.
pub(crate) const fn state(code: u16) -> Asic {
    match code {
        1 => Asic::RingConfig,
        2 => Asic::Ready,
        3 => Asic::Running,
        _ => Asic::Initial,
    }
}

/// An entry of the slave table.
pub(crate) fn slave(word: u16) -> Slave {
    let [mac_id, kind] = word.to_le_bytes();
    Slave { mac_id: MacId::truncate(mac_id), kind: kind.into() }
}
