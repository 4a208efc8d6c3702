use super::*;
use crate::request::tests::requests;
use proptest::prelude::*;

fn encoder() -> Device<6> {
    let mut device = Device::new(0x17, BitRate::Mbit2_5);
    device.set_position(U24::truncate(0x51_2345), U24::truncate(0xfffe));
    device
}

/// Sends a request by bytes and gives the reply.
fn send(device: &mut Device<6>, bytes: &[u8], now_ns: u64) -> Option<Transmission> {
    (1..).zip(bytes).fold(None, |reply, (k, byte)| device.byte(*byte, now_ns + 4_000 * k).or(reply))
}

proptest! {
    /// No damaged request moves anything in the encoder.
    #[test]
    fn damaged_requests_change_nothing(request in requests(), bit in 0..32usize) {
        let mut device = encoder();
        let mut bytes = request.emit().as_bytes().to_vec();
        let bit = bit % (bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        let before = device;
        let reply = send(&mut device, &bytes, 0);
        prop_assert_eq!((device.eeprom, device.page, device.zero, device.abm), (before.eeprom, before.page, before.zero, before.abm));
        if let Some(reply) = reply {
            prop_assert_eq!(AllData::parse(reply.frame.as_bytes()).map(|f| f.sf.contains(StatusField::CA1)), Ok(false));
        }
    }

    /// Whatever arrives, in whatever rhythm, the encoder takes it.
    #[test]
    fn any_bytes(bytes in prop::collection::vec((any::<u8>(), 0..9_000_u64, any::<bool>()), 0..60)) {
        let mut device = encoder();
        let mut now_ns = 0;
        for (byte, gap, framed) in bytes {
            now_ns += gap;
            let _ = if framed { device.byte(byte, now_ns) } else { device.framing_error(now_ns) };
        }
    }
}

#[test]
fn damage_is_told_in_the_status() {
    let mut device = encoder();
    let sf = |reply: Option<Transmission>| reply.map(|r| AllData::parse(r.frame.as_bytes()).unwrap().sf.bits());
    assert_eq!(sf(send(&mut device, &[0x12], 0)), Some(0x40));
    assert_eq!(sf(send(&mut device, &[0xa2], 100_000)), Some(0x00));
    assert_eq!(sf(send(&mut device, &[0xea, 0x01, 0xea], 200_000)), Some(0x00));
    assert_eq!(sf(device.framing_error(300_000)), Some(0x80));
    assert_eq!(send(&mut device, &[0x1b], 400_000), None);
    // A request that stops half way is forgotten.
    assert_eq!(send(&mut device, &[0xea, 0x01], 500_000), None);
    assert_eq!(sf(send(&mut device, &[0x1a], 600_000)), Some(0x00));
}

#[test]
fn another_request_or_a_short_pause_starts_the_count_again() {
    for disturb in [true, false] {
        let mut device = encoder();
        for k in 0..10 {
            let now_ns = k * 80_000;
            let _ = device.answer(Request::ResetTurnsAndErrors, now_ns);
            if disturb && k == 5 {
                let _ = device.answer(Request::ReadSingleTurn, now_ns + 40_000);
            }
        }
        assert_eq!(device.abm.get(), if disturb { 0xfffe } else { 0 });
    }
    let mut hasty = encoder();
    for k in 0..10 {
        let _ = hasty.answer(Request::ResetTurnsAndErrors, k * 39_999);
    }
    assert_eq!(hasty.abm.get(), 0xfffe);
}

#[test]
fn bit_by_bit_is_the_same() {
    let request = Request::write_eeprom(Address::new(9).unwrap(), 0x5a);
    let mut by_bits = encoder();
    let line = request.emit().line();
    let mut reply = None;
    for at in 0..line.len() {
        let now_ns = 400 * u64::from(at + 1);
        reply = by_bits.bit(line.get(at).unwrap(), now_ns).or(reply);
    }
    let mut by_bytes = encoder();
    assert_eq!(reply, send(&mut by_bytes, request.emit().as_bytes(), 0));
    assert!(reply.is_some());
}
