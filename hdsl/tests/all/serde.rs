//! What serde may make: no illegal value can be deserialised.

use core::fmt::Debug;

use hdsl::frame::{Extra, Stuffing, Tail, Trailer};
use hdsl::message::{Data, LongRequest, Offset, RemoteRegister, ResourceAddress, ResourceError, ShortRequest};
use hdsl::registers::Event;
use hdsl::rssi::Rssi;
use hdsl::sampling::{Alignment, Delay, SampleIndex};
use hdsl::symbol::{Character, Control, Word};
use hdsl::sync::Es;
use hdsl::{DeltaDelta, Dialect, EncoderId, Error, Nibble, PositionBits};
use serde::{Serialize, de::DeserializeOwned};

fn read<T: DeserializeOwned>(text: &str) -> Option<T> {
    serde_json::from_str(text).ok()
}

/// All whole numbers from `-1` to past the end: `legal` says which are values.
fn numbers<T: DeserializeOwned + Serialize + Debug>(legal: core::ops::RangeInclusive<i64>, beyond: i64) {
    for number in [legal.start() - 1, *legal.start(), *legal.end(), legal.end() + 1, beyond] {
        let value = read::<T>(&number.to_string());
        assert_eq!(value.is_some(), legal.contains(&number), "{} {number}", core::any::type_name::<T>());
        if let Some(value) = value {
            assert_eq!(serde_json::to_string(&value).unwrap(), number.to_string());
        }
    }
}

#[test]
fn numbers_out_of_range() {
    numbers::<Nibble>(0..=15, 255);
    numbers::<Word>(0..=1023, 65_535);
    numbers::<EncoderId>(0..=0xf_ffff, 0xffff_ffff);
    numbers::<PositionBits>(8..=40, 255);
    numbers::<DeltaDelta>(-1024..=1023, 32_767);
    numbers::<SampleIndex>(0..=7, 255);
    numbers::<Delay>(0..=11, 255);
    numbers::<Rssi>(0..=12, 255);
    numbers::<Extra>(24..=72, 255);
    numbers::<Stuffing>(0..=26, 255);
    numbers::<Es>(1..=10, 255);
    numbers::<RemoteRegister>(0x40..=0x7f, 255);
    numbers::<ResourceAddress>(0..=0x3ff, 65_535);
    numbers::<Offset>(0..=0x7fff, 65_535);
}

#[test]
fn values_made_of_them() {
    assert!(read::<Tail>(r#"{"trailer":"Whole","stuffing":26}"#).is_some());
    assert!(read::<Tail>(r#"{"trailer":"Whole","stuffing":27}"#).is_none());
    assert!(read::<Alignment>(r#"{"index":7,"delay":11}"#).is_some());
    assert!(read::<Alignment>(r#"{"index":8,"delay":11}"#).is_none());
    assert!(read::<Alignment>(r#"{"index":7,"delay":12}"#).is_none());
    // A special character that the code does not have.
    assert!(read::<Character>("[253,true]").is_some() && read::<Character>("[252,false]").is_some());
    assert!(read::<Character>("[1,true]").is_none());
    // Data after their end.
    assert!(read::<Data>(r#"["Two",[1,2,0,0,0,0,0,0]]"#).is_some());
    assert!(read::<Data>(r#"["Two",[1,2,3,0,0,0,0,0]]"#).is_none());
    assert!(read::<Data>(r#"["None",[0,0,0,0,0,0,0,1]]"#).is_none());
    assert!(read::<ShortRequest>(r#"{"Read":63}"#).is_none());
}

#[test]
fn what_is_written_comes_back() {
    fn back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
        assert_eq!(read::<T>(&serde_json::to_string(value).unwrap()).as_ref(), Some(value));
    }
    back(&Character::control(Control::K28_5));
    back(&Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::MAX });
    back(&Dialect::TI);
    back(&Error::Resource { error: ResourceError::FILE_EXISTS });
    back(&Error::Crc { got: 1, want: 2 });
    back(&LongRequest::parse(&[0xe4, 0x81, 0x80, 0x03, 0x14, 0x13]).unwrap());
    back(&Event::from_bits_retain(0xffff));
    assert_eq!(serde_json::to_string(&Data::new(&[1, 2]).unwrap()).unwrap(), r#"["Two",[1,2,0,0,0,0,0,0]]"#);
}
