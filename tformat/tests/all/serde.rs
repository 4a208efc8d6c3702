//! No illegal value can be deserialised, and every legal one comes back as it was.

use core::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use tformat::master::Exchange;
use tformat::{
    Abm, Abs, Address, Adf, AllData, Almc, BitRate, ControlField, DataId, Doubt, Error, ErrorClass, Evidence, Page,
    Policy, Request, Resolution, Response, StatusField, Tolerated, VendorCommand,
};

fn refused<T: DeserializeOwned + Debug>(json: &str) -> String {
    serde_json::from_str::<T>(json).expect_err("an illegal value").to_string()
}

fn round_trip<T: Serialize + DeserializeOwned + PartialEq + Debug + Copy>(value: T) {
    let json = serde_json::to_string(&value).unwrap();
    assert_eq!(serde_json::from_str::<T>(&json).unwrap(), value, "{json}");
}

#[test]
fn numbers_outside_their_range_are_refused() {
    assert!(refused::<Address>("128").contains("128 is out of range, the limit is 127"));
    assert!(refused::<Page>("8").contains("8 is out of range, the limit is 7"));
    assert!(refused::<Abs>("16777216").contains("out of range"));
    assert!(refused::<Abm>("16777216").contains("out of range"));
    let inside = [serde_json::from_str::<Address>("127").is_ok(), serde_json::from_str::<Page>("7").is_ok()];
    assert_eq!(inside, [true, true]);
}

/// Of the 256 bytes sixteen are control fields.
#[test]
fn malformed_control_fields_are_refused() {
    let legal = (0..=255_u8).filter(|cf| serde_json::from_str::<ControlField>(&cf.to_string()).is_ok()).count();
    assert_eq!(legal, 16);
    assert!(refused::<ControlField>("3").contains("sink code"));
    assert!(refused::<ControlField>("130").contains("parity"));
    assert!(refused::<DataId>("\"Id4\"").contains("unknown variant"));
}

#[test]
fn impossible_resolutions_are_refused() {
    let json = |abs: u8, abm: u8, pages: u8| {
        format!(r#"{{"abs_bits":{abs},"abm_bits":{abm},"signed_turns":true,"checks_upper_bits":true,"pages":{pages}}}"#)
    };
    for (abs, abm, pages) in [(0, 16, 6), (25, 16, 6), (17, 25, 6), (17, 16, 0), (17, 16, 9)] {
        assert!(refused::<Resolution>(&json(abs, abm, pages)).contains("out of range"));
    }
    let whole: Resolution = serde_json::from_str(&json(23, 16, 8)).unwrap();
    assert_eq!((whole.abs_bits(), whole.abm_bits(), whole.pages()), (23, 16, 8));
    let without_pages = r#"{"abs_bits":23,"abm_bits":16,"signed_turns":true,"checks_upper_bits":true}"#;
    assert_eq!(serde_json::from_str::<Resolution>(without_pages).unwrap().pages(), 6);
}

#[test]
fn impossible_vendor_commands_are_refused() {
    for fields in [0, 1, 12, 255] {
        assert!(
            refused::<VendorCommand>(&format!(r#"{{"cf":20,"response_fields":{fields}}}"#)).contains("out of range")
        );
    }
    round_trip(VendorCommand::new(20, 11).unwrap());
}

/// A position is written down with all that it says; only evidence makes one.
#[test]
fn samples_and_evidence_are_written_down() {
    let data = AllData::parse(&[0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0, 0, 0, 0xc8, 0x37]).unwrap();
    let evidence = Evidence::of(Response::ReadAll(data), Resolution::new(23, 16).unwrap(), 480);
    let policy = Policy::new(0).tolerating(Tolerated::SINGLE_TURN);
    let json = serde_json::to_value(evidence.at(480, policy).unwrap()).unwrap();
    let want = serde_json::json!({"sampled_ns": 480, "single_turn": 3_915_817, "turns": null, "abs_bits": 23});
    assert_eq!(json, want);
    assert_eq!(serde_json::to_value(evidence).unwrap()["sampled_ns"], 480);
    round_trip(policy);
    for doubt in [Doubt::Never, Doubt::Old { age_ns: u64::MAX }, evidence.at(480, Policy::new(0)).unwrap_err()] {
        round_trip(doubt);
    }
    round_trip(Exchange { response: Response::ReadAll(data), sampled_ns: 4_480, began_ns: 7_000 });
}

#[test]
fn legal_values_come_back() {
    for bits in 0..=255 {
        round_trip(StatusField::from_bits_retain(bits));
        round_trip(Almc::from_bits_retain(bits));
        round_trip(Adf::from_bits(bits));
    }
    for id in DataId::ALL {
        round_trip(id);
        round_trip(id.control_field());
        round_trip(Request::of(id, Adf::from_bits(0x85), 0x5a));
    }
    round_trip(Response::ReadAll(AllData::parse(&[0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0, 0, 0, 0xc8, 0x37]).unwrap()));
    round_trip(Resolution::new(17, 16).unwrap().with_unsigned_turns().with_upper_bits_ignored());
    round_trip(Error::Rejected { sf: StatusField::CA0 });
    for class in ErrorClass::ALL {
        round_trip(*class);
    }
    for rate in BitRate::ALL {
        round_trip(rate);
    }
}
