//! The simulated encoder, by the frames that go in and the responses that come out.

use nikon_aformat::bus::{Addresses, Bus, Outcome};
use nikon_aformat::device::{
    Behaviour, Device, Ea, Encoders, Fault, FirstRead, Restart, ShownAddress, Shows, Transmission, Zero,
};
use nikon_aformat::{
    Alm, BitOrder, BitRate, Command, Data, EncoderAddress, EncoderId, EncoderStatus, Error, Expected, Layout,
    Operation, PmAlm, Request, Resolution, Response, Temperature, U10, U24, UserAddress, Window,
};

const RATE: BitRate = BitRate::Mbit4;
const EA: EncoderAddress = EncoderAddress::truncate(3);
/// A pause after which nothing is left of a request: longer than 18 bits and 20 us.
const LONG_NS: u64 = 1_000_000;

fn device() -> Device<2> {
    let mut device = Device::new(EA, Resolution::default(), RATE);
    device.set_position(0x1_2345, 7);
    device.set_id(EncoderId::truncate(0x11_2233));
    device
}

/// Sends a request, its frames 6 us apart; the answer and when the last frame ended.
fn send(device: &mut Device<2>, operation: Operation, now_ns: u64) -> (Option<Transmission>, u64) {
    let (mut at_ns, mut answer) = (now_ns, None);
    for frame in Request::new(EA, operation).emit().as_slice() {
        at_ns += 6_000;
        answer = device.hear(&[Some(frame.content())], at_ns);
    }
    (answer, at_ns)
}

fn ask(device: &mut Device<2>, operation: Operation, now_ns: u64) -> Option<Response> {
    let expected = Request::new(EA, operation).expected(Resolution::default()).any_address();
    send(device, operation, now_ns).0.map(|answer| Response::parse(&expected, &answer.frames).unwrap())
}

fn data(device: &mut Device<2>, operation: Operation, now_ns: u64) -> Data {
    ask(device, operation, now_ns).unwrap().data().unwrap()
}

#[test]
fn what_is_set_is_answered() {
    let mut device = device();
    device.set_motion(-1000, -5);
    device.set_pm_alm(PmAlm::IFW2);
    device.set_temperature(Temperature(U10::truncate(310)));
    device.raise_alarms(Alm::OVTEMP);
    let abs = U24::truncate(0x71_2345);
    let want = Data::Abs24VelAcc { abs, velocity: -1000, acceleration: -5 };
    assert_eq!(data(&mut device, Operation::Abs24VelAcc, LONG_NS), want);
    let want = Data::Status { alm: Alm::OVTEMP, pm_alm: PmAlm::IFW2 };
    assert_eq!(data(&mut device, Operation::Status, 2 * LONG_NS), want);
    let temperature = Temperature(U10::truncate(310));
    assert_eq!(data(&mut device, Operation::Temperature, 3 * LONG_NS), Data::Temperature { temperature });
    assert_eq!(device.eeprom(0, 0xf9), Some(310));
    // OVTEMP is ES2.
    assert_eq!(
        ask(&mut device, Operation::Status, 4 * LONG_NS).unwrap().es(),
        Some(EncoderStatus::from_bits_truncate(4))
    );
    let id = EncoderId::truncate(0x11_2233);
    assert_eq!(data(&mut device, Operation::IdRead1, 5 * LONG_NS), Data::Id { id });
}

/// A factory setting of version 3.0: the resets are answered with 24 bits of the position.
#[test]
fn resets_are_answered_in_the_layout_of_the_encoder() {
    let resolution = Resolution::default().with_position_in_resets();
    let mut device = Device::<1>::new(EA, resolution, RATE);
    device.set_position(0x55, 0);
    let request = Request::new(EA, Operation::ClearStatus);
    let answer = device.hear(&[Some(request.emit().as_slice()[0].content())], LONG_NS).unwrap();
    let response = Response::parse(&request.expected(resolution), &answer.frames).unwrap();
    assert_eq!(response.data(), Some(Data::Abs24 { abs: U24::truncate(0x55) }));
}

/// A turn-around time of 2.8 us, or the one that is set; on a bus 72 bits and 2 us for each place at 4 Mbit/s.
#[test]
fn when_it_answers() {
    let mut device = device();
    let begin = |device: &mut Device<2>, operation, now_ns| {
        let (answer, end_ns) = send(device, operation, now_ns);
        answer.unwrap().start_ns - end_ns
    };
    assert_eq!(begin(&mut device, Operation::Abs40, LONG_NS), 2_800);
    assert_eq!(begin(&mut device, Operation::Abs40Mt, 2 * LONG_NS), 2_800 + 3 * 20_000);
    device.set_behaviour(Behaviour::new().with_response_delay_ns(900).with_place(Some(1)));
    assert_eq!(begin(&mut device, Operation::Abs40Mt, 3 * LONG_NS), 900 + 20_000);
    assert_eq!(begin(&mut device, Operation::Abs40, 4 * LONG_NS), 900);
}

#[test]
fn faults_of_the_line() {
    let line = |fault| {
        let mut device = device();
        device.set_fault(fault);
        send(&mut device, Operation::Abs40, LONG_NS).0.map(|answer| answer.line)
    };
    let good = line(Fault::None).unwrap();
    assert_eq!((good.len(), line(Fault::Silent)), (72, None));
    for at in 0..72 {
        assert_eq!(line(Fault::FlipBit { at }).unwrap().bits(), good.bits() ^ 1 << at);
    }
    assert_eq!((line(Fault::FlipBit { at: 72 }), line(Fault::FlipBit { at: 133 })), (Some(good), Some(good)));
    assert_eq!(line(Fault::CutAfter { bits: 20 }), Window::from_bits(good.bits(), 20));
    assert_eq!(line(Fault::CutAfter { bits: 100 }), Some(good));
    // The last eight content bits: line bits 63 to 70, before the delimiter.
    assert_eq!(line(Fault::BadCrc).unwrap().bits(), good.bits() ^ 0xff << 63);
}

/// The rest of a damaged request is not taken for another one, and a later request is understood.
#[test]
fn a_damaged_request_is_not_answered() {
    let frames = Request::new(EA, Operation::EepromWrite { address: UserAddress::default(), data: 5 }).emit();
    let contents: Vec<u16> = frames.as_slice().iter().map(|frame| frame.content()).collect();
    let position = Request::new(EA, Operation::Abs40).emit().as_slice()[0].content();
    for wrong in 0..4 {
        for framed in [true, false] {
            let mut device = device();
            for (at, content) in contents.iter().enumerate() {
                let now_ns = LONG_NS + 6_000 * at as u64;
                let answer = match (at == wrong, framed) {
                    (true, false) => {
                        device.framing_error(now_ns);
                        None
                    }
                    (true, true) => device.hear(&[Some(content ^ 0x100)], now_ns),
                    _ => device.hear(&[Some(*content)], now_ns),
                };
                assert_eq!(answer, None, "frame {wrong}");
            }
            assert_eq!(device.eeprom(0, 0), Some(0xffff));
            let last_ns = LONG_NS + 18_000;
            // 18 bits and 20 us later it still counts as a part of it, if the damage was its last frame.
            if wrong == 3 {
                assert_eq!(device.hear(&[Some(position)], last_ns + 24_500), None);
                assert!(device.hear(&[Some(position)], last_ns + 24_500 + 24_501).is_some());
            } else {
                assert!(device.hear(&[Some(position)], last_ns + 24_501).is_some());
            }
        }
    }
}

/// Frames of a request up to 20 us apart belong together, later ones do not.
#[test]
fn a_request_that_is_not_ended_is_forgotten() {
    let frames = Request::new(EA, Operation::EepromRead { address: 9 }).emit();
    let [cdf, mdf] = frames.as_slice() else { panic!("two frames") };
    let mut device = device();
    assert_eq!(device.hear(&[Some(cdf.content())], LONG_NS), None);
    assert!(device.hear(&[Some(mdf.content())], LONG_NS + 24_500).is_some());
    assert_eq!(device.hear(&[Some(cdf.content())], 2 * LONG_NS), None);
    assert_eq!(device.hear(&[Some(mdf.content())], 2 * LONG_NS + 24_501), None);
}

/// What happens between two requests.
type Between<'a> = &'a dyn Fn(&mut Device<2>, u64);

/// After the eighth request in succession the single turn is 0; a damaged request in between starts the count again, unless
/// the encoder counts its own requests.
#[test]
fn the_count_of_a_reset() {
    let damaged = |device: &mut Device<2>, now_ns| {
        device.framing_error(now_ns);
    };
    let other = |device: &mut Device<2>, now_ns| {
        let request = Request::new(EncoderAddress::ZERO, Operation::Status);
        assert_eq!(device.hear(&[Some(request.emit().as_slice()[0].content())], now_ns), None);
    };
    let own = |device: &mut Device<2>, now_ns| {
        let _ = ask(device, Operation::Status, now_ns);
    };
    let nothing = |_: &mut Device<2>, _| {};
    let between: [(Between, bool, bool); 4] =
        [(&nothing, false, false), (&damaged, true, false), (&other, true, false), (&own, true, true)];
    for (between, restarts, restarts_own_count) in between {
        for own_count in [false, true] {
            let mut device = device();
            if own_count {
                device.set_behaviour(Behaviour::new().with_restart(Restart::Own));
            }
            let mut first_done = None;
            for k in 1..=20 {
                let now_ns = k * LONG_NS;
                let _ = ask(&mut device, Operation::ZeroPreset, now_ns);
                if k == 3 {
                    between(&mut device, now_ns + LONG_NS / 2);
                }
                if first_done.is_none() && device.zero() != Zero::default() {
                    first_done = Some(k);
                }
            }
            let restarts = if own_count { restarts_own_count } else { restarts };
            assert_eq!(first_done, Some(if restarts { 11 } else { 8 }));
            assert_eq!(device.zero(), Zero { single_turn: 0x1_2345, turns: 0 });
        }
    }
}

/// The response that shows it: STATUS after ClearStatus.
#[test]
fn a_reset_shows_in_the_eighth_or_in_the_ninth() {
    for eighth in [false, true] {
        let mut device = device();
        device.raise_alarms(Alm::BATT);
        device.end_alarms(Alm::BATT);
        if eighth {
            device.set_behaviour(Behaviour::new().with_reset_shows(Shows::Eighth));
        }
        let shown: Vec<bool> = (1..=9)
            .map(|k| ask(&mut device, Operation::ClearStatus, k * LONG_NS).unwrap().alm().unwrap().contains(Alm::BATT))
            .collect();
        assert_eq!(shown.iter().filter(|batt| **batt).count(), if eighth { 7 } else { 8 });
    }
}

/// What is written while the memory is busy is repeated in the response, and not done.
#[test]
fn nothing_is_written_while_it_is_busy() {
    let address = UserAddress::new(0x42).unwrap();
    let id = EncoderId::truncate(0x77_7777);
    for busy in [false, true] {
        let mut device = device();
        if busy {
            // A read makes it busy for 300 us.
            let _ = send(&mut device, Operation::EepromRead { address: 1 }, LONG_NS);
        }
        let now_ns = LONG_NS + 50_000;
        let word = data(&mut device, Operation::EepromWrite { address, data: 5 }, now_ns);
        assert_eq!(word, Data::Eeprom { data: 5, address: 0x42 });
        assert_eq!(device.eeprom(0, 0x42), Some(if busy { 0xffff } else { 5 }));
        // Of a write it is busy for 30 ms, of the read no longer.
        let at_ns = if busy { now_ns + 50_000 } else { now_ns + 100_000_000 };
        let _ = ask(&mut device, Operation::IdWrite1 { id }, at_ns);
        assert_eq!(device.id(), if busy { EncoderId::truncate(0x11_2233) } else { id });
        let coefficient = nikon_aformat::U19::truncate(99);
        let at_ns = if busy { at_ns + 50_000 } else { at_ns + 100_000_000 };
        let _ = ask(&mut device, Operation::CoefficientWrite { coefficient }, at_ns);
        assert_eq!(device.coefficient().get(), if busy { 0 } else { 99 });
        let moved = Operation::SetAddress2 { id: device.id() };
        let frames = Request::new(EncoderAddress::MAX, moved).emit();
        let mut at_ns = if busy { at_ns + 50_000 } else { at_ns + 100_000_000 };
        for frame in frames.as_slice() {
            at_ns += 6_000;
            let _ = device.hear(&[Some(frame.content())], at_ns);
        }
        assert_eq!(device.ea(), if busy { EA } else { EncoderAddress::MAX });
    }
}

/// A read lasts 300 us, a write 30 ms; until then no word comes, and ES0 shows it whatever the first response showed.
#[test]
fn how_long_the_memory_is_busy() {
    let read = Operation::EepromRead { address: 9 };
    for behaviour in [Behaviour::new(), Behaviour::new().with_first_read(FirstRead::Ready)] {
        let mut device = device();
        device.set_behaviour(behaviour.with_undetermined(0xdead));
        device.set_eeprom(0, 9, 0x1234);
        let (_, from_ns) = send(&mut device, read, LONG_NS);
        let busy = |device: &Device<2>, ns| device.alm(from_ns + ns) == Alm::MEMBUSY;
        assert_eq!((busy(&device, 299_999), busy(&device, 300_000)), (true, false));
        let again = ask(&mut device, read, LONG_NS + 100_000).unwrap();
        let undetermined = Some(Data::Eeprom { data: 0xdead, address: 9 });
        assert_eq!((again.data(), again.es()), (undetermined, Some(EncoderStatus::BUSY)));
        assert_eq!(data(&mut device, read, 2 * LONG_NS), Data::Eeprom { data: 0x1234, address: 9 });

        let write = Operation::EepromWrite { address: UserAddress::new(9).unwrap(), data: 5 };
        let written = ask(&mut device, write, 3 * LONG_NS).unwrap();
        assert_eq!(written.es(), Some(EncoderStatus::BUSY), "its response shows it");
        let from_ns = 3 * LONG_NS + 24_000;
        let busy = |ns| device.alm(from_ns + ns) == Alm::MEMBUSY;
        assert_eq!((busy(29_999_999), busy(30_000_000)), (true, false));
    }
}

/// What EA of a multi-response request means: the highest address that answers, or nothing.
#[test]
fn who_answers_a_multi_response_request() {
    for (all, want) in [(false, [false, false, true, true]), (true, [true; 4])] {
        let mut device = device();
        if all {
            device.set_behaviour(Behaviour::new().with_ea(Ea::All));
        }
        let answers = (1..).zip([0, 2, 3, 7]).map(|(k, ea)| {
            let request = Request::new(EncoderAddress::truncate(ea), Operation::Abs40Mt);
            device.hear(&[Some(request.emit().as_slice()[0].content())], k * LONG_NS).is_some()
        });
        assert!(answers.eq(want));
    }
}

/// The first response to a read is not determined, the second is; another address begins anew.
#[test]
fn an_eeprom_word_comes_with_the_second_response() {
    for clear in [false, true] {
        let mut device = device();
        let behaviour = Behaviour::new().with_undetermined(0xdead);
        device.set_behaviour(if clear { behaviour.with_first_read(FirstRead::Ready) } else { behaviour });
        device.set_eeprom(1, 9, 0x1234);
        let read = |address| Operation::EepromReadBank { bank: 1, address };
        let mut words = Vec::new();
        for (k, address) in [9, 8, 9, 9].into_iter().enumerate() {
            let response = ask(&mut device, read(address), (k as u64 + 1) * LONG_NS).unwrap();
            let Some(Data::EepromBank { data, bank_error: false, .. }) = response.data() else { panic!("{response}") };
            words.push((data, response.es() == Some(EncoderStatus::BUSY)));
        }
        let first = (0xdead, !clear);
        assert_eq!(words, [first, first, first, (0x1234, false)]);
        // A temperature is no read: its status shows that the memory is busy in either case.
        let _ = ask(&mut device, read(1), 9 * LONG_NS);
        let busy = ask(&mut device, Operation::Temperature, 9 * LONG_NS + 50_000).unwrap();
        assert_eq!(busy.es(), Some(EncoderStatus::BUSY));
        assert_eq!(device.alm(10 * LONG_NS), Alm::empty());
    }
}

#[test]
fn a_bank_that_is_not_there() {
    let mut device = device();
    for operation in
        [Operation::EepromReadBank { bank: 2, address: 1 }, Operation::EepromWriteBank { bank: 2, address: 1, data: 3 }]
    {
        let request = Request::new(EA, operation);
        let answer = send(&mut device, operation, LONG_NS).0.unwrap();
        assert_eq!(Response::parse(&request.expected(Resolution::default()), &answer.frames), Err(Error::BankError));
        assert_eq!(device.alm(LONG_NS + 100_000), Alm::empty(), "nothing is read or written");
    }
    let written = data(&mut device, Operation::EepromWriteBank { bank: 1, address: 0xff, data: 3 }, 50 * LONG_NS);
    assert_eq!(written, Data::EepromBank { data: 3, bank: 1, address: 0xff, bank_error: false });
    assert_eq!((device.eeprom(1, 0xff), device.eeprom(2, 0)), (Some(3), None));
}

#[test]
fn old_or_new_address() {
    for old in [false, true] {
        let mut device = device();
        if old {
            device.set_behaviour(Behaviour::new().with_shown_address(ShownAddress::Old));
        }
        let id = EncoderId::truncate(0x11_2233);
        let frames = Request::new(EncoderAddress::MAX, Operation::SetAddress2 { id }).emit();
        let mut answer = None;
        for (at, frame) in (1..).zip(frames.as_slice()) {
            answer = device.hear(&[Some(frame.content())], LONG_NS + at * 6_000);
        }
        let expected = Expected::new(Layout::Id, Command::SetAddress2);
        let shown = Response::parse(&expected, &answer.unwrap().frames).unwrap().ea;
        assert_eq!((shown, device.ea()), (if old { EA } else { EncoderAddress::MAX }, EncoderAddress::MAX));
        // Every other response shows its own.
        let request = Request::new(EncoderAddress::MAX, Operation::IdRead1);
        let answer = device.hear(&[Some(request.emit().as_slice()[0].content())], 100 * LONG_NS).unwrap();
        assert!(Response::parse(&request.expected(Resolution::default()), &answer.frames).is_ok());
    }
}

/// Requests are not answered while another encoder speaks, whose frames follow each other within four bits.
#[test]
fn it_does_not_listen_to_responses() {
    let mut device = device();
    let position = Request::new(EA, Operation::Abs40).emit().as_slice()[0].content();
    let other = Response::new(
        EncoderAddress::ZERO,
        Command::Status,
        EncoderStatus::empty(),
        Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() },
    );
    let first = other.emit().contents()[0];
    assert_eq!(device.hear(&[Some(first)], LONG_NS), None);
    // 18 + 4 bits at 4 Mbit/s.
    assert_eq!(device.hear(&[Some(position)], LONG_NS + 5_500), None);
    assert!(device.hear(&[Some(position)], LONG_NS + 5_500 + 5_501).is_some());
}

#[test]
fn a_framing_error_is_heard_by_all() {
    let mut encoders = Encoders { all: [device(), device()] };
    encoders.framing_error(LONG_NS);
    let position = Request::new(EA, Operation::Abs40).emit().as_slice()[0].content();
    assert!(encoders.hear(&[Some(position)], LONG_NS + 24_500).iter().all(Option::is_none));
    assert!(encoders.hear(&[Some(position)], LONG_NS + 100_000).iter().all(Option::is_some));
}

/// What a bus counts: damaged, never started, not asked.
#[test]
fn a_bus_counts() {
    let expected = Expected::new(Layout::Abs24, Command::Abs24LowMt);
    let mut bus = Bus::new(expected, Addresses::from_bits(0b111));
    assert_eq!((bus.arrived(), bus.damaged(), bus.not_started()), (0, 0, 3));
    bus.push_words(&[0; 3], BitOrder::LsbFirst);
    assert_eq!((bus.arrived(), bus.damaged(), bus.not_started()), (1, 1, 2));
    bus.push(Err(Error::NoResponse));
    assert_eq!((bus.arrived(), bus.damaged(), bus.not_started()), (2, 2, 1));
    let data = Data::Abs24 { abs: U24::truncate(1) };
    let response = Response::new(EncoderAddress::MAX, Command::Abs24LowMt, EncoderStatus::empty(), data);
    let first = bus.push(Ok(response.emit()));
    assert!(first.extra && !first.duplicate);
    bus.push(Ok(response.emit()));
    assert_eq!((bus.arrived(), bus.damaged(), bus.not_started()), (4, 2, 0));
    assert_eq!(bus.of(EncoderAddress::MAX), Outcome::Duplicate { first: response });
    assert_eq!(
        (bus.of(EncoderAddress::truncate(5)), bus.of(EncoderAddress::ZERO)),
        (Outcome::NotAsked, Outcome::Missing)
    );
}
