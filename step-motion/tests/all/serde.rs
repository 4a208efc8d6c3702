//! Values survive serde; values that cannot be written down in Rust cannot be read either.

use core::fmt::Debug;

use serde_json::{from_str, to_string};
use step_motion::{Clock, Limits};

fn round_trip<T: PartialEq + Debug + serde::Serialize + serde::de::DeserializeOwned>(value: &T, text: &str) {
    assert_eq!(to_string(value).unwrap(), text);
    assert_eq!(&from_str::<T>(text).unwrap(), value);
}

#[test]
fn limits_and_clocks_are_plain() {
    round_trip(&Clock::MICROSECONDS, "1000000");
    let limits = Limits::new(20_000, 50_000).unwrap();
    round_trip(&limits, "[20000,50000,null]");
    round_trip(&limits.with_jerk(1 << 33).unwrap(), "[20000,50000,8589934592]");
}

#[test]
fn illegal_values_are_refused() {
    for clock in ["999", "1073741824", "-1"] {
        assert!(from_str::<Clock>(clock).is_err(), "{clock}");
    }
    for limits in ["[0,1,null]", "[1,0,null]", "[1,2147483648,null]", "[1,1,0]", "[1,1,17592186044416]"] {
        assert!(from_str::<Limits>(limits).is_err(), "{limits}");
    }
}
