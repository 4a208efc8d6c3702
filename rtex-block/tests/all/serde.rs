//! No illegal value can be deserialised.

use core::fmt::Debug;

use rtex_block::master::{AxisConfig, Limits};
use rtex_block::position::Gear;
use rtex_block::{
    Code, Command, ControlBits, CyclicCode, Execution, LatchFlags, MacId, Nibble, NonCyclicCode, ProfileFlags,
    Response, StatusFlags, SubCode, TypeCode, UpdateCounter,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Of all numbers up to `end`, those that are taken come back as they were; gives how many.
fn taken<T: DeserializeOwned + Serialize>(end: u32) -> usize {
    (0..end)
        .filter(|number| match serde_json::from_str::<T>(&number.to_string()) {
            Ok(value) => {
                assert_eq!(serde_json::to_string(&value).unwrap(), number.to_string());
                true
            }
            Err(_) => false,
        })
        .count()
}

#[test]
fn numbers_and_flags_hold_what_their_field_holds() {
    assert_eq!(taken::<MacId>(300), 32);
    assert_eq!(taken::<UpdateCounter>(300), 4);
    assert_eq!(taken::<Code>(300), 128);
    assert_eq!(taken::<TypeCode>(70_000), 4_096);
    assert_eq!(taken::<Nibble>(300), 16);
    assert_eq!(taken::<ControlBits>(70_000), 1 << 10);
    assert_eq!(taken::<StatusFlags>(70_000), 1 << 16);
    assert_eq!(taken::<Execution>(300), 1 << 3);
    assert_eq!(taken::<LatchFlags>(300), 1 << 2);
    assert_eq!(taken::<ProfileFlags>(300), 1 << 4);
}

fn refused<T: DeserializeOwned + Debug>(text: &str) {
    let found = serde_json::from_str::<T>(text);
    assert!(found.is_err(), "{text}: {found:?}");
}

#[test]
fn names_and_pairs_hold_what_is_defined() {
    refused::<CyclicCode>("\"Five\"");
    refused::<NonCyclicCode>("\"Three\"");
    refused::<SubCode>("\"Alarm\"");
    for gear in ["[0,1]", "[1,0]", "[1]", "[1,4294967296]"] {
        refused::<Gear>(gear);
    }
    assert_eq!(serde_json::from_str::<Gear>("[3,2]").ok(), Gear::new(3, 2));
    refused::<Limits>(r#"{"echo":0,"ready":1,"active":1,"inactive":1,"answer":1,"stop":1,"command_errors":1}"#);
    let config = r#"{"mac_id":ID,"mode":"CyclicPosition","update_ns":500000,"gear":[1,1],
        "over_speed":null,"max_speed":null,"max_torque":5,"stop":"Two","deceleration":5,
        "limits":{"echo":1,"ready":1,"active":1,"inactive":1,"answer":1,"stop":1,"command_errors":1}}"#;
    assert!(serde_json::from_str::<AxisConfig>(&config.replace("ID", "31")).is_ok());
    refused::<AxisConfig>(&config.replace("ID", "32"));
}

#[test]
fn messages_come_back() {
    let command = Command { control: ControlBits::SERVO_ON, ..Command::idle(MacId::MAX, UpdateCounter::MAX) };
    let text = serde_json::to_string(&command).unwrap();
    assert_eq!(serde_json::from_str::<Command>(&text).unwrap(), command);
    refused::<Command>(&text.replace("\"mac_id\":31", "\"mac_id\":32"));
    refused::<Command>(&text.replace("\"control\":128", "\"control\":129"));
    let response = Response::parse(&[0xff; 16]).unwrap();
    let text = serde_json::to_string(&response).unwrap();
    assert_eq!(serde_json::from_str::<Response>(&text).unwrap(), response);
    refused::<Response>(&text.replace("\"code\":127", "\"code\":128"));
}
