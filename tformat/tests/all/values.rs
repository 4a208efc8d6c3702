//! Numbers, each with literals of its own.

use tformat::{BitRate, Request, Resolution};

#[test]
fn rates_widths_and_bytes() {
    assert_eq!(BitRate::ALL.map(BitRate::bits_per_second), [2_500_000, 5_000_000]);
    let signed = Resolution::new(17, 16).unwrap();
    assert_eq!((signed.counts_per_turn(), Resolution::new(23, 16).unwrap().counts_per_turn()), (131_072, 8_388_608));
    assert_eq!((signed.has_signed_turns(), signed.with_unsigned_turns().has_signed_turns()), (true, false));
    // Control field and check field of ID D for address 1, then zeros.
    let frame = Request::read_eeprom(tformat::Address::new(1).unwrap()).emit();
    assert_eq!(frame.to_array(), [0xea, 0x01, 0xeb, 0, 0, 0, 0, 0, 0, 0, 0]);
}
