//! No illegal value can be deserialised.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sorte_proto::iep::{Edge, Events};
use sorte_proto::sync0::{Register, Write};
use sorte_proto::{
    DeviceAddress, Discovery, DiscoveryView, Entry, MotorMask, Network, Param, ParamView, Parameters, Place, Preamble,
    Pto, Reserved, StartTime, Status, Sync, SyncView, drv8711,
};

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

fn round<T: Serialize + DeserializeOwned + Debug + PartialEq + Copy>(value: T) {
    assert_eq!(serde_json::from_value::<T>(serde_json::to_value(value).unwrap()).unwrap(), value);
}

/// A line of two devices, as a frame and as the master knows it; a table without room for itself, and totals that are no sums.
#[test]
fn a_network_is_read_back_if_it_can_be() {
    let mut frame = Discovery::request(Place::Last);
    frame.entries[0] = Entry { input: 3, output: 4 };
    frame.entries[1] = Entry { input: 5, output: 6 };
    (frame.count, frame.input_total, frame.output_total) = (2, 8, 10);
    round(frame);
    round(Discovery::published_request(Place::Inner));
    let bytes = frame.emit();
    let network = Network::new(DiscoveryView::parse(&bytes).unwrap()).unwrap();
    round(network);
    let text = serde_json::to_string(&network).unwrap();
    let two = r#"[{"input":3,"output":4},{"input":5,"output":6}]"#;
    assert_eq!(text, format!(r#"{{"devices":2,"input_total":8,"output_total":10,"entries":{two}}}"#));
    for (from, to) in
        [("\"devices\":2", "\"devices\":255"), ("\"devices\":2", "\"devices\":1"), (":8", ":9"), (":10", ":11")]
    {
        assert!(serde_json::from_str::<Network>(&text.replace(from, to)).is_err(), "{to}");
    }
    let many = vec![Entry::STOCK; 255];
    let many = text.replace(two, &serde_json::to_string(&many).unwrap());
    assert!(serde_json::from_str::<Network>(&many).is_err());
}

#[test]
fn small_values_are_read_back_and_views_are_written_as_their_values() {
    round(Edge { ns: 5, high: true });
    round(Events { cmp6: true, ..Events::default() });
    round(Write { register: Register::Cmp6, value: 600 });
    round(Preamble::Middle);
    let (sync, param) = (Sync::of_master(500, 76, Place::Last), Param::request(Parameters::CNC, Place::Last));
    let (sync_bytes, param_bytes) = (sync.emit(), param.emit());
    let views = (SyncView::parse(&sync_bytes).unwrap(), ParamView::parse(&param_bytes).unwrap());
    assert_eq!(serde_json::to_value(views.0).unwrap(), serde_json::to_value(sync).unwrap());
    assert_eq!(serde_json::to_value(views.1).unwrap(), serde_json::to_value(param).unwrap());
}
