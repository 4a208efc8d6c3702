//! No illegal value can be deserialised: `cargo test -p nikon-aformat --features serde`.

use core::fmt::Debug;

use nikon_aformat::bus::{Outcome, Verdict};
use nikon_aformat::inspect::{Cause, Findings, LineCause, inspect};
use nikon_aformat::master::Exchange;
use nikon_aformat::{
    Alm, Doubt, EncoderAddress, EncoderId, EncoderStatus, Error, Evidence, Operation, PmAlm, Policy, Request,
    RequestFrame, Resolution, Response, Temperature, Tolerated, U10, U17, U19, U24, U40, UserAddress, Version,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// `legal` is read, and written again as it was; each of `illegal` is refused.
fn limits<T: DeserializeOwned + Serialize + Debug>(legal: &[&str], illegal: &[&str]) {
    for text in legal {
        let value: T = serde_json::from_str(text).unwrap_or_else(|error| unreachable!("{text}: {error}"));
        assert_eq!(&serde_json::to_string(&value).unwrap(), text);
    }
    for text in illegal {
        let read = serde_json::from_str::<T>(text);
        assert!(read.is_err(), "{text} became {read:?}");
    }
}

#[test]
fn numbers() {
    limits::<U10>(&["0", "1023"], &["1024", "65536", "-1"]);
    limits::<U17>(&["131071"], &["131072"]);
    limits::<U19>(&["524287"], &["524288"]);
    limits::<U24>(&["16777215"], &["16777216"]);
    limits::<U40>(&["1099511627775"], &["1099511627776"]);
    limits::<EncoderAddress>(&["0", "7"], &["8", "255", "256"]);
    limits::<EncoderId>(&["16777215"], &["16777216"]);
    limits::<UserAddress>(&["0", "239"], &["240", "255"]);
    limits::<Temperature>(&["1023"], &["1024"]);
}

#[test]
fn flags() {
    limits::<EncoderStatus>(&["0", "15"], &["16", "255"]);
    limits::<Alm>(&["65535"], &["65536"]);
    limits::<PmAlm>(&["255"], &["256"]);
}

/// Sync code and CRC-3 of a frame are checked.
#[test]
fn frames() {
    let legal = (0..=u16::MAX).filter(|content| serde_json::from_str::<RequestFrame>(&content.to_string()).is_ok());
    assert_eq!(legal.count(), 1024);
}

#[test]
fn widths() {
    let text = |st: u32, mt: u32, version: &str, low: bool| {
        format!(
            r#"{{"st_bits":{st},"mt_bits":{mt},"version":"{version}","low_with_velocity":{low},"resets_with_position":false}}"#
        )
    };
    for st in 0..=40 {
        for mt in 0..=40 {
            let possible = (1..=32).contains(&st) && mt <= 32 && st + mt <= 40;
            assert_eq!(
                serde_json::from_str::<Resolution>(&text(st, mt, "V2_1", false)).is_ok(),
                possible,
                "{st} + {mt}"
            );
        }
    }
    // A factory setting of version 3.0 cannot be one of an encoder of version 2.1.
    let read: Resolution = serde_json::from_str(&text(20, 16, "V2_1", true)).unwrap();
    assert!(!read.has_velocity_in_low() || read.version() == Version::V3_0);
}

/// What holds numbers holds no illegal ones.
#[test]
fn requests() {
    let write = Request::new(EncoderAddress::MAX, Operation::EepromWrite { address: UserAddress::MAX, data: 1 });
    let text = serde_json::to_string(&write).unwrap();
    assert_eq!(serde_json::from_str::<Request>(&text).unwrap(), write);
    assert!(serde_json::from_str::<Request>(&text.replace("239", "240")).is_err());
    assert!(serde_json::from_str::<Request>(&text.replace("\"ea\":7", "\"ea\":8")).is_err());
}

/// What a master gives, and by what it is judged, come back as they were.
#[test]
fn readings_and_doubts() {
    let es = EncoderStatus::BATT;
    let response = Response::abs17(EncoderAddress::MAX, es, U17::truncate(77));
    let exchange = Exchange { response, sampled_ns: 7_200, began_ns: 10_000 };
    assert_eq!(exchange.to_string(), "from 7: ABS17 ES any ABS 0x0004d, sampled from 7200 to 10000 ns");
    round_trip(exchange);
    round_trip(Outcome::Duplicate { first: response });
    round_trip(Verdict { outcome: Err(Error::Crc { got: 1, want: 2 }), duplicate: false, extra: true });
    for doubt in [Doubt::Status { es }, Doubt::AnyStatus, Doubt::Alarms { alarms: Alm::BATT }, Doubt::Absent] {
        round_trip(doubt);
    }
    let policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN.status(EncoderStatus::all()));
    round_trip(policy);
    let evidence = exchange.evidence(Resolution::new(17, 16).unwrap());
    let sample = serde_json::to_value(evidence.at(132_200, policy).unwrap()).unwrap();
    assert_eq!((&sample["single_turn"], &sample["sampled_ns"]), (&serde_json::json!(77), &serde_json::json!(7_200)));
    assert_eq!(serde_json::to_value(Evidence::NEVER).unwrap()["sampled_ns"], 0);
    let tolerated = serde_json::to_string(&Tolerated::SINGLE_TURN).unwrap();
    assert_eq!(tolerated, r#"{"status":2,"alarms":1,"any_turns":true}"#);
}

/// A report is written as what it found; what is read back is its parts.
#[test]
fn reports() {
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs17);
    let answer = Response::abs17(EncoderAddress::ZERO, EncoderStatus::empty(), U17::truncate(77));
    let report = inspect(request, Resolution::default(), answer.emit().line().inverted());
    assert_eq!(
        report.to_string(),
        "frame 0: the start bit is 1; likely cause: the line is inverted: exchange A and B, or the polarity of the input"
    );
    let written = serde_json::to_value(report).unwrap();
    assert_eq!(serde_json::from_value::<Findings>(written["findings"].clone()).unwrap(), report.findings());
    assert_eq!(written["cause"], serde_json::json!({ "Line": "LineInverted" }));
    assert_eq!(serde_json::from_value::<Response>(written["response"].clone()).unwrap(), answer);
    round_trip(Cause::Line(LineCause::Shifted { bits: -2 }));
}

fn round_trip<T: Serialize + DeserializeOwned + PartialEq + Debug + Copy>(value: T) {
    let text = serde_json::to_string(&value).unwrap();
    assert_eq!(serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
}
