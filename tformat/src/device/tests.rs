use super::*;
use crate::request::tests::requests;
use proptest::prelude::*;

fn encoder() -> Device<6> {
    let mut device = Device::new(0x17, BitRate::Mbit2_5);
    device.set_position(Abs::truncate(0x51_2345), Abm::truncate(0xfffe));
    device
}

fn encoder_with(behaviour: Behaviour) -> Device<6> {
    let mut device = encoder();
    device.set_behaviour(behaviour);
    device
}

/// Sends a request by bytes and gives the reply.
fn send(device: &mut Device<6>, bytes: &[u8], now_ns: u64) -> Option<Transmission> {
    (1..).zip(bytes).fold(None, |reply, (k, byte)| device.hear(&[*byte], now_ns + 4_000 * k).or(reply))
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
            let _ = if framed { device.hear(&[byte], now_ns) } else { device.framing_error(now_ns) };
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

/// Ten requests for ID C whose starts are `interval` apart, `disturb` after the sixth; whether they had their effect.
fn resets(behaviour: Behaviour, interval: u64, disturb: impl Fn(&mut Device<6>, u64)) -> bool {
    let mut device = encoder_with(behaviour);
    for k in 1..=10 {
        let now_ns = k * interval;
        let _ = send(&mut device, &[0x62], now_ns);
        if k == 6 {
            disturb(&mut device, now_ns + interval / 2);
        }
    }
    assert_eq!(device.effects(), u32::from(device.abm.get() == 0));
    device.abm.get() == 0
}

/// 40 us or more, from start to start or from the end of the response (3 us and six fields after the request).
#[test]
fn the_spacing_of_resets() {
    let nothing = |_: &mut Device<6>, _| {};
    let start = Behaviour::new();
    let end = Behaviour { reset_interval: Interval::EndToStart, ..start };
    assert!(resets(start, 40_000, nothing) && !resets(start, 39_999, nothing));
    assert!(resets(end, 71_000, nothing) && !resets(end, 70_999, nothing));
}

/// Whether another request, or a damaged one, starts the count again is a switch each.
#[test]
fn what_starts_the_count_of_resets_again() {
    let other = |device: &mut Device<6>, now_ns| _ = send(device, &[0x02], now_ns);
    let damaged = |device: &mut Device<6>, now_ns| _ = send(device, &[0x12], now_ns);
    let framing = |device: &mut Device<6>, now_ns| _ = device.framing_error(now_ns);
    let another_reset = |device: &mut Device<6>, now_ns| _ = send(device, &[0xba], now_ns);
    let strict = Behaviour::new();
    let lax = Behaviour { others_restart_count: false, damage_restarts_count: false, ..strict };
    assert!(!resets(strict, 100_000, other) && resets(lax, 100_000, other));
    assert!(!resets(strict, 100_000, damaged) && resets(lax, 100_000, damaged));
    assert!(!resets(strict, 100_000, framing) && resets(lax, 100_000, framing));
    assert!(!resets(lax, 100_000, another_reset));
}

/// The tenth response shows the position before, or the one after; then the zero is stored for 18 ms.
#[test]
fn the_tenth_response_and_storing() {
    for (shows, silent) in [(false, false), (true, true)] {
        let behaviour = Behaviour { tenth_shows_effect: shows, silent_while_storing: silent, ..Behaviour::new() };
        let mut device = encoder_with(behaviour);
        let mut tenth = None;
        for k in 1..=10 {
            tenth = send(&mut device, &[0xc2], k * 100_000);
        }
        let tenth = Response::parse(Request::SetSingleTurnZero, tenth.unwrap().frame.as_bytes()).unwrap();
        assert_eq!(tenth.abs().map(Abs::get), Some(if shows { 0 } else { 0x51_2345 }));
        // The request for ID 0 ends 1 ns before the 18 ms are over, and then.
        let mut earlier = device;
        assert_eq!(send(&mut earlier, &[0x02], 18_999_999).is_none(), silent);
        assert!(send(&mut device, &[0x02], 19_000_000).is_some());
    }
}

/// A write keeps the memory busy until 18 ms after its request; then it can be written again.
#[test]
fn the_memory_is_busy_for_18_ms() {
    for (data, behaviour) in [
        (0x00, Behaviour::new()),
        (0xff, Behaviour { busy_data: BusyData::Ones, ..Behaviour::new() }),
        (0x5a, Behaviour { busy_data: BusyData::Cell, ..Behaviour::new() }),
    ] {
        let mut device = encoder_with(behaviour);
        let address = Address::truncate(5);
        let memory = |busy, edf| Memory { adf: Adf::answered(address, busy), edf };
        let write = |edf| Request::write_eeprom(address, edf);
        assert_eq!(device.answer(write(0x5a), 100), Some(Response::WriteEeprom(memory(false, 0x5a))));
        let read = Request::read_eeprom(address);
        assert_eq!(device.answer(read, 18_000_099), Some(Response::ReadEeprom(memory(true, data))));
        assert_eq!(device.answer(write(0x77), 18_000_099), Some(Response::WriteEeprom(memory(true, 0x77))));
        assert_eq!(device.answer(read, 18_000_100), Some(Response::ReadEeprom(memory(false, 0x5a))));
        assert_eq!(device.answer(write(0x77), 18_000_100), Some(Response::WriteEeprom(memory(false, 0x77))));
        assert_eq!(device.eeprom_mut()[0][5], 0x77);
    }
}

#[test]
fn the_page_register() {
    let select = |page| Request::write_eeprom(Address::PAGE_REGISTER, page);
    for (absent, page) in [(AbsentPage::Ignored, 2), (AbsentPage::Wrapped, 3)] {
        let mut device = encoder_with(Behaviour { absent_page: absent, ..Behaviour::new() });
        let _ = device.answer(select(2), 100);
        assert_eq!(device.page(), 2);
        // Six pages are numbered 0 to 5.
        let mut last = device;
        let _ = last.answer(select(5), 200);
        assert_eq!(last.page(), 5);
        let _ = last.answer(select(6), 300);
        assert_eq!(last.page(), if absent == AbsentPage::Ignored { 5 } else { 0 });
        let _ = device.answer(select(9), 200);
        assert_eq!(device.page(), page);
        // Selecting takes no time; while the memory is busy it is ignored.
        let _ = device.answer(Request::write_eeprom(Address::truncate(0), 1), 300);
        let memory = Memory { adf: Adf::of(Address::PAGE_REGISTER).with_busy(), edf: 4 };
        assert_eq!(device.answer(select(4), 400), Some(Response::WriteEeprom(memory)));
        assert_eq!(device.page(), page);
    }
    let mut slow = encoder_with(Behaviour { page_select_is_busy: true, ..Behaviour::new() });
    let _ = slow.answer(select(2), 100);
    let answered = slow.answer(Request::read_eeprom(Address::PAGE_REGISTER), 200);
    assert!(matches!(answered, Some(Response::ReadEeprom(memory)) if memory.adf.busy()));
}

/// What follows a request that was judged is not heard until the line has been idle for half a field.
#[test]
fn deaf_time() {
    for (gap, heard) in [(6_000, false), (6_001, true)] {
        let mut device = encoder();
        assert!(device.hear(&[0x12], 4_000).is_some());
        assert_eq!(device.hear(&[0x02], 4_000 + gap).is_some(), heard);
    }
}

#[test]
fn what_is_not_answered_is_a_switch() {
    let usual = Behaviour::new();
    let unusual =
        Behaviour { answers_wrong_sink: true, answers_delimiter_error: false, leaves_status_zero: true, ..usual };
    for (behaviour, sink, delimiter, status) in [(usual, false, true, 0x20), (unusual, true, false, 0x00)] {
        let mut device = encoder_with(behaviour);
        device.raise_alarms(Almc::BA);
        assert_eq!(send(&mut device, &[0x1b], 100_000).is_some(), sink);
        assert_eq!(device.framing_error(200_000).is_some(), delimiter);
        let response =
            Response::parse(Request::ReadSingleTurn, send(&mut device, &[0x02], 300_000).unwrap().frame.as_bytes());
        assert_eq!(response.unwrap().status().map(|sf| sf.bits()), Some(status));
    }
}

/// The documents' numbers: 3 us, six fields of 4 us, or of 2 us at the fast rate.
#[test]
fn the_response_begins_3_us_after_the_request() {
    let mut device = encoder();
    assert_eq!(send(&mut device, &[0x02], 0).map(|sent| sent.start_ns), Some(7_000));
    let mut late = encoder_with(Behaviour::new().with_response_delay_ns(9_000));
    assert_eq!(send(&mut late, &[0x02], 0).map(|sent| sent.start_ns), Some(13_000));
    for number in 0..Behaviour::NUMBERED {
        assert!((1_700..=9_000).contains(&Behaviour::numbered(number).response_delay_ns));
    }
    assert_eq!(Behaviour::numbered(0), Behaviour::default());
}

#[test]
fn bit_by_bit_is_the_same() {
    let request = Request::write_eeprom(Address::new(9).unwrap(), 0x5a);
    let mut by_bits = encoder();
    let line = request.emit().line();
    let mut reply = None;
    for at in 0..line.len() {
        let now_ns = 400 * u64::from(at + 1);
        reply = by_bits.hear_bit(line.get(at).unwrap(), now_ns).or(reply);
    }
    let mut by_bytes = encoder();
    assert_eq!(reply, send(&mut by_bytes, request.emit().as_bytes(), 0));
    assert!(reply.is_some());
}

/// What leaves with each fault, for a request for ID 0 that is answered by six fields.
#[test]
fn faults_that_are_switched_on() {
    let sound = send(&mut encoder(), &[0x02], 0).unwrap();
    assert_eq!((sound.frame.fields(), sound.line.len()), (6, 60));
    let with = |fault| {
        let mut device = encoder();
        device.set_fault(fault);
        send(&mut device, &[0x02], 0)
    };
    assert_eq!(with(Fault::None), Some(sound));
    assert_eq!(with(Fault::Silent), None);
    for at in [0, 17, 59] {
        let sent = with(Fault::FlipBit { at }).unwrap();
        assert_eq!(sent.line.bits() ^ sound.line.bits(), 1 << at);
    }
    // It ends with bit 59.
    for at in [60, 133] {
        assert_eq!(with(Fault::FlipBit { at }), Some(sound));
    }
    let wrong = with(Fault::BadCrc).unwrap();
    assert_eq!(wrong.frame.as_bytes()[..5], sound.frame.as_bytes()[..5]);
    assert_eq!(wrong.frame.as_bytes()[5], !sound.frame.as_bytes()[5]);
    let read = |sent: Transmission| Response::parse(Request::ReadSingleTurn, sent.frame.as_bytes());
    assert!(matches!(read(wrong), Err(Error::Crc { .. })));
    for fields in 1..6 {
        let cut = with(Fault::CutAfter { fields }).unwrap();
        assert_eq!(cut.frame.as_bytes(), &sound.frame.as_bytes()[..usize::from(fields)]);
        assert_eq!(cut.line.len(), u32::from(fields) * 10);
    }
    for fields in [0, 6, 7] {
        assert_eq!(with(Fault::CutAfter { fields }), Some(sound));
    }
    let refused = with(Fault::RejectAll).unwrap();
    assert_eq!(read(refused), Err(Error::Rejected { sf: StatusField::empty() }));
    assert_eq!((refused.frame.fields(), refused.frame.as_bytes()[0]), (11, 0x1a));
}

/// Over-speed is latched until ten requests for ID 7 or ID C find its cause gone; the battery alarm goes with its cause.
#[test]
fn alarms_and_their_causes() {
    for cf in [0xba, 0x62] {
        let mut device = encoder();
        device.raise_alarms(Almc::OS | Almc::CE | Almc::BA);
        device.end_alarms(Almc::OS | Almc::BA);
        assert_eq!(device.almc(), Almc::OS | Almc::CE);
        for k in 1..=10 {
            assert_eq!(device.effects(), 0);
            let _ = send(&mut device, &[cf], k * 100_000);
        }
        // The counting error is still there.
        assert_eq!((device.almc(), device.effects()), (Almc::CE, 1));
        assert_eq!((device.abs().get(), device.abm().get()), (0x51_2345, if cf == 0x62 { 0 } else { 0xfffe }));
    }
}

/// Encoder ID 11h: 17 bits. An unknown one: all 24.
#[test]
fn the_position_has_the_width_that_the_encoder_id_names() {
    for (enid, abs) in [(0x11, 0x1_2345), (0x17, 0x51_2345), (0x7f, 0xd1_2345)] {
        let mut device = Device::<6>::new(enid, BitRate::Mbit2_5);
        device.set_position(Abs::truncate(0xd1_2345), Abm::truncate(3));
        assert_eq!(device.abs().get(), abs);
    }
}
