//! What holds for every frame.

use @snake@::stream;
use @snake@::{Error, Frame};

#[test]
fn each_value_comes_back() {
    for value in 0..=255 {
        assert_eq!(Frame::parse(&Frame { value }.emit()), Ok(Frame { value }));
    }
}

#[test]
fn each_wrong_bit_is_refused_by_the_check_that_it_breaks() {
    let sound = [0x5a, 0x01, 0x89];
    for bit in 0..24 {
        let mut bytes = sound;
        bytes[bit / 8] ^= 1 << (bit % 8);
        let error = Frame::parse(&bytes).unwrap_err();
        assert_eq!(matches!(error, Error::Header { .. }), bit < 8, "bit {bit}: {error}");
        assert_eq!(matches!(error, Error::Crc { .. }), bit >= 8, "bit {bit}: {error}");
    }
}

#[test]
fn another_length_is_refused() {
    assert_eq!(Frame::parse(&[0x5a, 1]), Err(Error::Truncated { got: 2, want: 3 }));
    assert_eq!(Frame::parse(&[0; 70_000]), Err(Error::TooLong { got: 65_535, want: 3 }));
}

#[test]
fn a_log_is_cut_into_frames() {
    let log = [0x5a, 0x01, 0x89, 0x5a];
    let (rest, frame) = stream::frame::<Error>(&log).unwrap();
    assert_eq!((rest, frame), (&[0x5a][..], Frame { value: 1 }));
    assert!(stream::frame::<Error>(rest).is_err_and(|error| error.is_incomplete()));
}
