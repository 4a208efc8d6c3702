//! Values survive serde; values that cannot be written down in Rust cannot be read either.

use core::fmt::Debug;

use serde_json::{from_str, to_string};
use step_profile::{Command, Direction, Frequency, Microstep, Motors, Note, RampTable, Tone};

fn round_trip<T: PartialEq + Debug + serde::Serialize + serde::de::DeserializeOwned>(value: &T, text: &str) {
    assert_eq!(to_string(value).unwrap(), text);
    assert_eq!(&from_str::<T>(text).unwrap(), value);
}

#[test]
fn values_are_plain() {
    round_trip(&Motors::ALL, "15");
    round_trip(&Tone::Cis.frequency(), r#"{"numerator":13136900,"denominator":187}"#);
    round_trip(&Note::p125(Tone::A, 7), r#"{"speed":580294,"steps":14117,"pause":7}"#);
    round_trip(&Microstep::Div256, r#""Div256""#);
    let pulse = Command::Pulse { direction: Direction::Reverse, sync_time: 3999 };
    round_trip(&pulse, r#"{"Pulse":{"direction":"Reverse","sync_time":3999}}"#);
    let table = to_string(RampTable::SIN2).unwrap();
    round_trip(RampTable::SIN2, &table);
}

#[test]
fn illegal_values_are_refused() {
    assert!(from_str::<Motors>("16").is_err() && from_str::<Motors>("-1").is_err());
    assert!(from_str::<Microstep>(r#""Div512""#).is_err() && from_str::<Tone>(r#""B""#).is_err());
    assert!(from_str::<Frequency>("[1,0]").is_err());
    let mut entries = *RampTable::SIN2.entries();
    entries[31] = 999;
    let error = from_str::<RampTable>(&to_string(&entries).unwrap()).unwrap_err();
    assert!(error.to_string().contains("ramp entry 31 is 999, wanted 1000..=1002"), "{error}");
}
