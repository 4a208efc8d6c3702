//! What the tests of both ends share.

pub mod exchanges;
pub mod line;
pub mod procedures;
pub mod sampled;
pub mod switches;

use nikon_aformat::{Command, EncoderId, Operation, U19, UserAddress};

/// One operation of each kind.
pub fn every(address: u8, bank: u8, data: u16, wide: u32) -> Vec<Operation> {
    let (id, coefficient) = (EncoderId::truncate(wide), U19::truncate(wide));
    let mut all: Vec<_> = Command::ALL.into_iter().filter_map(Operation::without_arguments).collect();
    all.extend([
        Operation::EepromRead { address },
        Operation::EepromWrite { address: UserAddress::new(address).unwrap_or_default(), data },
        Operation::IdWrite1 { id },
        Operation::IdWrite2 { id },
        Operation::SetAddress2 { id },
        Operation::EepromReadBank { bank, address },
        Operation::EepromWriteBank { bank, address, data },
        Operation::CoefficientRead,
        Operation::CoefficientWrite { coefficient },
    ]);
    all
}
