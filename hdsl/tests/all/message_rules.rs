//! Messages nibble by nibble: what ends one, what is not one, and how long one is waited for; and the estimate of a position.

use hdsl::message::{
    Access, Data, Length, Limits, LongAnswer, LongRequest, Offset, RemoteRegister, Requester, ResourceAddress,
    ResourceError, Responder, ShortAnswer, ShortRequest,
};
use hdsl::{
    AlignmentStage, DeltaDelta, EncoderSymbol, Error, MasterSymbol, Nibble, PositionBits, PositionTracker, crc16,
};

const PING: RemoteRegister = RemoteRegister::PING;

fn nibbles(bytes: &[u8]) -> Vec<Nibble> {
    bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]).map(Nibble::truncate).collect()
}

/// How many requests an encoder finds in these symbols; `None` for one that could not be read.
fn requests(symbols: &[Option<MasterSymbol>]) -> usize {
    let mut encoder = Responder::new();
    let mut found = 0;
    for symbol in symbols {
        match symbol {
            Some(symbol) => found += usize::from(encoder.receive(*symbol).is_some()),
            None => encoder.receive_nothing(),
        }
    }
    found
}

/// At least one IDLE is between two messages; an IDLE or a hole in a message ends it, wherever it is.
#[test]
fn where_a_request_ends() {
    let request: Vec<_> =
        nibbles(&[0x7c, 0xab, 0xf6]).into_iter().map(|nibble| Some(MasterSymbol::Data(nibble))).collect();
    let idle = [Some(MasterSymbol::Idle)];
    assert_eq!(requests(&request), 1);
    assert_eq!(requests(&[&request[..], &request].concat()), 1);
    assert_eq!(requests(&[&request[..], &idle, &request].concat()), 2);
    for at in 1..6 {
        let (first, second) = request.split_at(at);
        assert_eq!(requests(&[first, &idle, second].concat()), 0, "{at}");
        assert_eq!(requests(&[first, &[None], second].concat()), 0, "{at}");
        assert_eq!(requests(&[first, &idle, &request].concat()), 1, "{at}");
        // After a hole what comes up to the next IDLE is no message.
        assert_eq!(requests(&[first, &[None], &request].concat()), 0, "{at}");
        assert_eq!(requests(&[first, &[None], &idle, &request].concat()), 1, "{at}");
    }
}

/// The same for answers.
#[test]
fn where_an_answer_ends() {
    let answer: Vec<_> = nibbles(&[0x7c, 0x07, 0x53, 0x3f]).into_iter().map(|n| Some(EncoderSymbol::Data(n))).collect();
    let idle = [Some(EncoderSymbol::Idle)];
    let ends = |symbols: &[Option<EncoderSymbol>]| {
        let mut master = Requester::new(Limits::DEFAULT);
        master.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
        while master.transmit() != MasterSymbol::Idle {}
        symbols.iter().any(|symbol| master.receive(*symbol).short.is_some())
    };
    assert!(ends(&answer));
    for at in 1..8 {
        let (first, second) = answer.split_at(at);
        assert!(!ends(&[first, &idle, second].concat()) && !ends(&[first, &[None], second].concat()), "{at}");
        assert!(ends(&[first, &idle, &answer].concat()) && !ends(&[first, &[None], &answer].concat()), "{at}");
        assert!(ends(&[first, &[None], &idle, &answer].concat()), "{at}");
    }
}

/// 64 frames without an answer may pass for a short message, and as many as were set for a long one; the next one ends it.
#[test]
fn how_long_to_wait() {
    let limits = Limits::DEFAULT.with_short_tries(1).with_short_frames(64).with_long_frames(100);
    let mut master = Requester::new(limits);
    master.start_short(ShortRequest::Read(PING)).unwrap();
    while master.transmit() != MasterSymbol::Idle {}
    let waited = (0..200).take_while(|_| master.receive(Some(EncoderSymbol::Idle)).short.is_none()).count();
    assert_eq!(waited, 64);
    master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    while master.transmit() != MasterSymbol::Idle {}
    let waited = (0..200).take_while(|_| master.receive(Some(EncoderSymbol::Idle)).long.is_none()).count();
    assert_eq!(waited, 100);
}

/// The acknowledgement of a write carries no data, whatever its LLEN; its header says none.
#[test]
fn acknowledgements() {
    let write = crate::bench::write_file(0, b"42");
    for llen in 0..4 {
        let first = 0x91 | llen << 2;
        let [high, low] = hdsl::crc16(&[first, 0x31]).to_be_bytes();
        // What comes after it is no part of it.
        let bytes = [first, 0x31, high, low, 0xaa, 0xaa];
        assert_eq!(write.parse_answer(&bytes), Ok(Data::NONE), "{llen}");
    }
    let answer = LongAnswer::to(&write, Ok(Data::new(b"42").unwrap())).emit();
    assert_eq!(answer.as_bytes()[..2], [0x91, 0x31]);
    assert_eq!(answer.as_bytes().len(), 4);
    // An error carries two bytes in both directions.
    let refused = LongAnswer::to(&write, Err(ResourceError::WRITE_DENIED)).emit();
    assert_eq!(refused.as_bytes()[..4], [0xb5, 0x31, 0x12, 0x41]);
}

/// A write without an offset: its first two bytes are data.
#[test]
fn a_write_without_an_offset() {
    let request = LongRequest {
        address: ResourceAddress::RWFILE,
        indirect: true,
        offset: None,
        access: Access::Write(Data::new(&[0x80, 0x01, 0x80, 0x02]).unwrap()),
    };
    let bytes = request.emit();
    assert_eq!(bytes.as_bytes()[..6], [0x99, 0x31, 0x80, 0x01, 0x80, 0x02]);
    assert_eq!(LongRequest::parse(bytes.as_bytes()), Ok(request));
}

/// OFF_H is 1 and bits 14 to 8 of the offset; without that 1 it is not an offset.
#[test]
fn the_marker_of_an_offset() {
    let request = LongRequest {
        address: ResourceAddress::RWFILE,
        indirect: false,
        offset: Some(Offset::new(0x1234).unwrap()),
        access: Access::Read(Length::Two),
    };
    let bytes = request.emit().as_bytes().to_vec();
    assert_eq!(bytes[..4], [0xe5, 0x31, 0x92, 0x34]);
    assert_eq!(LongRequest::parse(&bytes), Ok(request));
    let mut unmarked = bytes[..2].to_vec();
    unmarked.extend([0x12, 0x34]);
    unmarked.extend(crc16(&unmarked).to_be_bytes());
    assert_eq!(LongRequest::parse(&unmarked), Err(Error::ShortMessageStart { first: 0x12 }));
}

/// LLEN is two bits: 0, 2, 4, 8 bytes; data of another length do not exist.
#[test]
fn lengths() {
    for (code, bytes) in [(0, Some(0)), (1, Some(2)), (2, Some(4)), (3, Some(8)), (4, None), (0xfd, None)] {
        assert_eq!(Length::from_code(code).map(Length::bytes), bytes);
    }
    let four = Data::new(&[1, 2, 3, 4]).unwrap();
    assert_eq!((four.padded(), four.length()), ([1, 2, 3, 4, 0, 0, 0, 0], Length::Four));
    assert_eq!(Data::try_from((Length::Four, [1, 2, 3, 4, 0, 0, 0, 0])), Ok(four));
    assert_eq!(Data::try_from((Length::Four, [1, 2, 3, 4, 0, 0, 0, 5])), Err(Error::DataLength { len: 8 }));
    assert_eq!(Data::new(&[1, 2, 3]), Err(Error::DataLength { len: 3 }));
}

/// Two answers at an encoder: the short one goes first.
#[test]
fn a_short_answer_goes_first() {
    let mut encoder = Responder::new();
    let long = LongRequest::read(ResourceAddress::RESOLUTN, Length::Two);
    encoder.answer_long(&LongAnswer::to(&long, Ok(Data::new(&[1, 2]).unwrap())));
    encoder.answer_short(ShortAnswer { register: PING, data: None });
    let symbols: Vec<_> = (0..6).map(|_| encoder.transmit()).collect();
    assert_eq!(symbols[0], EncoderSymbol::Data(Nibble::truncate(3)));
    assert_eq!((0..2).map(|_| encoder.transmit()).collect::<Vec<_>>()[0], EncoderSymbol::Idle);
}

/// The estimator of the design document: last + (16 d0 + 8 d1 + 4 d2 + 2 d3 + d4) / 32, rounded down.
#[test]
fn estimates() {
    let estimate = |values: &[i16]| {
        let mut tracker = PositionTracker::new(PositionBits::MAX);
        for value in values {
            tracker.step(Some(DeltaDelta::try_from(*value).unwrap()));
        }
        let before = tracker.registers().vel;
        tracker.step(None);
        tracker.registers().vel - before
    };
    // Differences of 32 in all five places: 160 + 31.
    assert_eq!(estimate(&[0, 32, 64, 96, 128, 160]), 160 + 31);
    // One difference in each place: 16/32, 8/32 ... of 64, then of -64, and -1/32 rounds to -1.
    assert_eq!(estimate(&[0, 0, 0, 0, 0, 64]), 64 + 32);
    assert_eq!(estimate(&[0, 0, 0, 0, 64, 64]), 64 + 16);
    assert_eq!(estimate(&[0, 0, 0, 64, 64, 64]), 64 + 8);
    assert_eq!(estimate(&[0, 0, 64, 64, 64, 64]), 64 + 4);
    assert_eq!(estimate(&[0, 64, 64, 64, 64, 64]), 64 + 2);
    assert_eq!(estimate(&[0, -64, -64, -64, -64, -64]), -64 - 2);
    assert_eq!(estimate(&[0, -1, -1, -1, -1, -1]), -1 - 1);
    // Not beyond 11 bits.
    assert_eq!(estimate(&[0, 1000]), 1023);
    assert_eq!(estimate(&[0, -1000]), -1024);
}

/// A safe position that does not agree begins the alignment anew.
#[test]
fn a_safe_position_that_does_not_agree() {
    let mut tracker = PositionTracker::new(PositionBits::MAX);
    for _ in 0..5 {
        for _ in 0..8 {
            tracker.step(Some(DeltaDelta::ZERO));
        }
        tracker.align(0);
    }
    assert_eq!((tracker.stage(), tracker.registers().pos_flag), (AlignmentStage::Check, false));
    for _ in 0..8 {
        tracker.step(Some(DeltaDelta::ZERO));
    }
    tracker.align(1);
    assert_eq!((tracker.stage(), tracker.registers().pos_flag), (AlignmentStage::Position, true));
}
