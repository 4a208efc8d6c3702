use crate::header::MacId;

/// One entry of the slave information table.
///
/// The name of the error implies that the entry holds the MAC-ID and the kind of slave. The vendor's layout and its codes for
/// the kind could not be read, so the kind is a plain number that is only compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Slave {
    /// Its address.
    pub mac_id: MacId,
    /// What it is.
    pub kind: u16,
}

/// Outcome of the comparison of the slaves found with the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum SlaveInfo {
    /// All slaves are as in the table.
    Match,
    /// A slave is missing, superfluous or of a different kind, or a MAC-ID occurs twice.
    Mismatch,
}

/// Compares the slaves found on the ring with the table, which is in the order of the ring: it determines the place of each block.
pub fn compare(table: &[Slave], found: &[Slave]) -> SlaveInfo {
    let mut seen = 0_u32;
    let unique = found.iter().all(|slave| {
        let bit = 1_u32.wrapping_shl(slave.mac_id.get().into());
        let new = seen & bit == 0;
        seen |= bit;
        new
    });
    if unique && table == found { SlaveInfo::Match } else { SlaveInfo::Mismatch }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slave(mac_id: u8, kind: u16) -> Slave {
        Slave { mac_id: MacId::new(mac_id).unwrap(), kind }
    }

    #[test]
    fn every_difference_is_a_mismatch() {
        let table = [slave(0, 1), slave(31, 1), slave(7, 2)];
        let turned = [table[2], table[0], table[1]];
        assert_eq!(compare(&table, &table), SlaveInfo::Match);
        let [one, two, three] = table;
        for found in [&turned[..], &table[..2], &[one, two, two], &[one, two, slave(7, 3)], &[one, two, three, three]] {
            assert_eq!(compare(&table, found), SlaveInfo::Mismatch, "{found:?}");
        }
        let twice = [table[0], table[0]];
        assert_eq!(compare(&twice, &twice), SlaveInfo::Mismatch);
    }
}
