//! Details that a slip would change without anybody noticing.

use crate::bench::Bench;
use crate::cable::{Cable, Disturbance};
use hdsl::device::{Behaviour, Fault, Resources, Transmission};
use hdsl::message::{
    Access, Data, Length, Limits, LongAnswer, LongRequest, RemoteRegister, Requester, ResourceAddress, Responder,
    ShortAnswer, ShortRequest,
};
use hdsl::registers::{Event, OnlineD, Register};
use hdsl::{Dialect, EncoderSymbol, Error, MasterSymbol, crc16};

/// What one gets without asking.
#[test]
fn defaults() {
    assert_eq!(Dialect::default(), Dialect::SICK);
    assert_eq!(Limits::default(), Limits::DEFAULT);
    assert_eq!(Responder::default(), Responder::new());
    assert_eq!((Behaviour::default(), Resources::default()), (Behaviour::new(), Resources::new()));
}

/// The offset of a long message comes from PC_OFF, if PC_ADD_H asks for one.
#[test]
fn an_offset_in_the_registers() {
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.lock();
    let write = crate::bench::write_file(0, b"MOTOR 42");
    bench.master.start_long(write).unwrap();
    bench.frames(100);
    // Indirect read of two bytes of 131h, with and without the offset 6 that stands in PC_OFF.
    for (header, want) in [(0xf5, b"42"), (0xd5, b"MO")] {
        for (register, value) in [(0x2a, 0x80), (0x2b, 0x06), (0x28, header), (0x29, 0x31), (0x2c, 0x01)] {
            bench.map.write(&mut bench.master, register, value).unwrap();
        }
        bench.frames(100);
        assert_eq!(&bench.map.get::<2>(Register::PcBuffer), want);
    }
}

/// A long message that is not answered: time-out to the frame, ANS as event and as status, and gone with a good answer.
#[test]
fn a_long_message_without_an_answer() {
    let mut dialect = Dialect::SICK;
    dialect.messages.long_frames = 100;
    let mut bench = Bench::on_cable(dialect, 0);
    bench.lock();
    bench.device.set_fault(Fault::Mute);
    bench.write(Register::PcAdd, 0xcc);
    bench.map.write(&mut bench.master, 0x29, 0x81).unwrap();
    bench.write(Register::PcCtrl, 1);
    let _ = bench.map.take_events();
    // Two frames until the first nibble, 8 nibbles, an IDLE; then 101 frames in which nothing comes.
    let frames = (1..200).find(|_| bench.frame().finished.long.is_some());
    assert!((108..=112).contains(&frames.unwrap()), "{frames:?}");
    assert!(bench.map.event().contains(Event::ANS | Event::FREL) && bench.map.online_d().contains(OnlineD::ANS));
    bench.device.set_fault(Fault::None);
    bench.write(Register::PcCtrl, 1);
    bench.frames(100);
    assert!(!bench.map.online_d().contains(OnlineD::ANS) && bench.map.online_d().contains(OnlineD::FREL));
}

/// An answer counts only for the request that it belongs to: address, direction, LIND.
#[test]
fn an_answer_to_another_request() {
    let request = LongRequest::read(ResourceAddress::RWFILE, Length::Two);
    let answer = |request: &LongRequest| LongAnswer::to(request, Ok(Data::new(&[1, 2]).unwrap())).emit();
    assert!(request.parse_answer(answer(&request).as_bytes()).is_ok());
    for other in [
        LongRequest { indirect: false, ..request },
        LongRequest { address: ResourceAddress::DIR, ..request },
        LongRequest { access: Access::Write(Data::NONE), ..request },
    ] {
        assert!(matches!(request.parse_answer(answer(&other).as_bytes()), Err(Error::Header { .. })));
    }
    let read = ShortRequest::Read(RemoteRegister::PING);
    let written = ShortAnswer { register: RemoteRegister::PING, data: None }.emit();
    assert!(read.parse_answer(written.as_bytes()).is_err());
    // The machine too: the acknowledgement of a write does not end a read.
    let mut requester = Requester::new(Dialect::SICK.messages);
    requester.start_short(read).unwrap();
    while requester.transmit() != MasterSymbol::Idle {}
    for at in 0..6 {
        let finished = requester.receive(written.nibble(at).map(EncoderSymbol::Data));
        assert!(finished.short.is_none());
    }
    assert!(!requester.is_short_free());
}

/// Every wrong bit of either byte of a CRC, nibble by nibble.
#[test]
fn both_bytes_of_the_check() {
    let answer = [0x7f, 0x5a];
    let crc = crc16(&answer);
    for flip in 0..=16 {
        let [high, low] = (crc ^ 1_u16.checked_shl(flip).unwrap_or(0)).to_be_bytes();
        let mut requester = Requester::new(Dialect::SICK.messages);
        requester.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
        while requester.transmit() != MasterSymbol::Idle {}
        let nibbles = [answer[0], answer[1], high, low].into_iter().flat_map(|byte| [byte >> 4, byte & 15]);
        let mut ended = false;
        for nibble in nibbles {
            let symbol = EncoderSymbol::Data(hdsl::Nibble::truncate(nibble));
            ended |= requester.receive(Some(symbol)).short.is_some();
        }
        assert_eq!(ended, flip == 16, "{flip}");
    }
}

/// INIT drops what the encoder was about to answer, and it says so once.
#[test]
fn a_message_reset_at_the_encoder() {
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.lock();
    bench.device.set_behaviour(Behaviour::new().with_latency_frames(40));
    bench.master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    bench.frames(30);
    let dropped = bench.master.reset_messages().unwrap();
    assert_eq!(dropped.long, Some(Err(Error::Dropped)));
    let (mut inits, mut symbols) = (0, 0);
    for _ in 0..100 {
        let report = bench.frame();
        inits += u32::from(report.init);
        symbols += u32::from(report.finished.long.is_some());
    }
    assert_eq!((inits, symbols), (1, 0));
}

/// A slow clock of the encoder makes its bits longer: the last edge comes later.
#[test]
fn the_sign_of_the_clock_offset() {
    // One edge, up at bit 60 or sample 480: 484.8 and 475.2.
    let place = |ppm| {
        let samples =
            Cable::new(Disturbance::default().with_clock_ppm(ppm), 1).up(Some(Transmission { bits: 1 << 60 }));
        samples.iter().map(|byte| byte.count_zeros()).sum::<u32>()
    };
    assert_eq!((place(0), place(10_000), place(-10_000)), (480, 484, 475));
}

/// What the receiver does by itself: three tries of 64 H-frames for a short message, 32,000 H-frames for a long one, 369 ms free
/// running.
#[test]
fn how_long_a_message_is_waited_for() {
    let limits = Dialect::SICK.messages;
    assert_eq!((limits.short_tries, limits.short_frames, limits.long_frames), (3, 64, 32_000));
    assert_eq!(Dialect::TI.messages, limits);
}

/// A V-frame with a wrong CRC aligns nothing: the default dialect begins anew and says so, the SDK's firmware compares with
/// the last good position.
#[test]
fn a_safe_position_of_before() {
    for (dialect, phase, doubtful) in
        [(Dialect::SICK, hdsl::AlignmentStage::Position, true), (Dialect::TI, hdsl::AlignmentStage::Check, false)]
    {
        let mut bench = Bench::on_cable(dialect, 10);
        bench.lock();
        bench.frames(40);
        bench.device.set_fault(Fault::BadCrc);
        while bench.master.counters().safe1 == 0 {
            let _ = bench.frame();
        }
        assert_eq!((bench.map.stage(), bench.map.online_d().contains(OnlineD::POS)), (phase, doubtful));
    }
}

/// A request that the encoder has not answered yet is dropped by INIT: nothing comes afterwards.
#[test]
fn a_request_that_waits_at_the_encoder() {
    let mut bench = Bench::on_cable(Dialect::SICK, 10);
    bench.lock();
    bench.device.set_behaviour(Behaviour::new().with_latency_frames(40));
    bench.master.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
    // Six nibbles and an IDLE: the encoder has it.
    bench.frames(10);
    bench.master.reset_messages().unwrap();
    for _ in 0..120 {
        let head = bench.master.transmission().head.bits();
        let bits = bench.device.set_position(bench.position as u64).hear(head).unwrap().bits;
        let symbol = hdsl::Answer::from_bits(hdsl::Rule::Strict, bits).parameter().unwrap().symbol();
        assert!(matches!(symbol, Ok(EncoderSymbol::Idle | EncoderSymbol::Init)), "{symbol:?}");
        bench.master.hear_bits(bits, None, 0);
    }
}
