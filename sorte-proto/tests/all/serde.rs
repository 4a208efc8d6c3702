//! No illegal value can be deserialised.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sorte_proto::{DeviceAddress, MotorMask, Pto, Reserved, StartTime, Status, drv8711};

/// Every number: refused, or a value that is written back as this number.
fn only<T: Serialize + DeserializeOwned + Debug>(legal: impl Fn(u32) -> bool) {
    for number in 0..=0x1_0000_u32 {
        let value = serde_json::from_value::<T>(number.into());
        assert_eq!(value.is_ok(), legal(number), "{number}: {value:?}");
        if let Ok(value) = value {
            assert_eq!(serde_json::to_value(value).unwrap(), number, "given back");
        }
    }
    for other in ["-1", "1.5", "null", "\"1\""] {
        assert!(serde_json::from_str::<T>(other).is_err(), "{other}");
    }
}

#[test]
fn numbers_with_a_range() {
    only::<DeviceAddress>(|n| (1..=254).contains(&n));
    only::<StartTime>(|n| (1..=3990).contains(&n));
    only::<MotorMask>(|n| n <= 15);
}

#[test]
fn words_and_bytes_of_which_all_are_legal() {
    only::<Status>(|n| n <= 0xff);
    only::<drv8711::Status>(|n| n <= 0xff);
    only::<Pto>(|n| n <= 0xffff);
    only::<Reserved>(|n| matches!(n & 0x7fff, 3991..=0x7ffe) && n <= 0xffff || n == 0xffff);
}
