//! A-format: requests and replies in every form.

use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::{
    Abs40, Alm, BitOrder, BitRate, Command, Crc, Crc3, Crc8, Doubt, EncoderAddress, EncoderStatus, Error, Evidence,
    Expected, Frames, Operation, Policy, RawResponse, Request, RequestFrame, Resolution, Response, Sample, Tolerated,
    TypeWord, U24, U40, UserAddress, Version, Window, crc3, crc8, stream,
};
use nom::{IResult, Parser};
use servowire_core::Words;

use super::kernels;
use crate::self_test::nikon::{REPLIES, Replied, WHOLE, Whole};

/// One request of each length.
const REQUESTS: [Request; 5] = [
    request(Operation::Abs40),
    request(Operation::EepromRead { address: 0xf6 }),
    request(Operation::EepromReadBank { bank: 1, address: 2 }),
    request(Operation::EepromWrite { address: user(0x21), data: 0xbeef }),
    request(Operation::EepromWriteBank { bank: 1, address: 2, data: 0xbeef }),
];

const fn request(operation: Operation) -> Request {
    Request::new(EncoderAddress::MAX, operation)
}

const fn user(address: u8) -> UserAddress {
    match UserAddress::new(address) {
        Some(address) => address,
        None => panic!("no such address"),
    }
}

const fn resolution(st_bits: u8, mt_bits: u8) -> Resolution {
    match Resolution::new(st_bits, mt_bits) {
        Ok(resolution) => resolution,
        Err(_) => panic!("no such widths"),
    }
}

/// Profiles and positions.
const POSITIONS: [(Resolution, Response); 3] =
    [(resolution(17, 16), EMITTED[0]), (resolution(20, 16), EMITTED[1]), (resolution(24, 0), EMITTED[2])];

const POLICY: Policy = Policy::new(125_000);

/// Evidence, and when and by whom it is used.
const JUDGED: [(Evidence, u64, Policy); 2] = [
    (whole(EncoderStatus::empty()), 1_040_000, POLICY),
    (whole(EncoderStatus::BATT), 1_040_000, POLICY.tolerating(Tolerated::SINGLE_TURN)),
];

const DOUBTED: [(Evidence, u64, Policy); 3] = [
    (whole(EncoderStatus::BATT), 1_040_000, POLICY),
    (whole(EncoderStatus::empty()), 1_200_000, POLICY),
    (Evidence::NEVER, 1_040_000, POLICY),
];

const fn whole(es: EncoderStatus) -> Evidence {
    let data = nikon_aformat::Data::Abs40 { abs: U40::truncate(0x1_2345_6789) };
    Evidence::of(Response::new(EncoderAddress::ZERO, Command::Abs40, es, data), resolution(20, 16), 1_000_000)
}

/// The bytes of a request, two a frame, and how many.
const SENT: [([u8; 4], usize); 2] = [([0x44, 0x03, 0, 0], 2), ([0x40, 0xb0, 0x5b, 0x78], 4)];

kernels! {
    /// The reply with the whole position from its 72 line bits, least significant bit of a byte first, all checks.
    fn nikon_abs40_line_lsb(row: &Whole) -> Result<Abs40, Error> {
        Abs40::parse_line(&row.expected, &row.lsb_first, BitOrder::LsbFirst)
    } over WHOLE;

    /// The same from a shift register, most significant bit first.
    fn nikon_abs40_line_msb(row: &Whole) -> Result<Abs40, Error> {
        Abs40::parse_line(&row.expected, &row.msb_first, BitOrder::MsbFirst)
    } over WHOLE;

    /// Replies of all layouts from line bits.
    fn nikon_response_parse_line(row: &Replied) -> Result<Response, Error> {
        Response::parse_line(&row.expected, row.line)
    } over REPLIES;

    /// Replies of all layouts from words.
    fn nikon_response_parse_words(row: &Replied) -> Result<Response, Error> {
        Response::parse_words(&row.expected, row.words, BitOrder::MsbFirst)
    } over REPLIES;

    /// The reply with the whole position from words, all checks.
    fn nikon_abs40_words(words: &[u16; 4]) -> Result<Response, Error> {
        Response::parse_words(&WHOLE_MT, words, BitOrder::MsbFirst)
    } over EIGHT;

    /// The replies of eight encoders from words, each found under its address.
    fn nikon_bus_of_eight(words: &[[u16; 4]; 8]) -> Addresses {
        let mut bus = Bus::new(WHOLE_MT, Addresses::ALL);
        for four in words {
            let _ = bus.push_words(four, BitOrder::MsbFirst);
        }
        bus.missing()
    } over [EIGHT];

    /// The frames of the replies of all layouts.
    fn nikon_response_emit(row: &Emitted) -> RawResponse {
        row.emit()
    } over EMITTED;

    /// The line bits of an ABS40 reply.
    fn nikon_abs40_emit_line(row: &Whole) -> [u8; Abs40::LINE_BYTES] {
        let reply = Abs40 { ea: EncoderAddress::ZERO, es: EncoderStatus::empty(), abs: U40::truncate(row.lsb_first.len() as u64) };
        reply.emit_line(BitOrder::LsbFirst, &row.expected)
    } over WHOLE;

    /// Frames of a reply, their check field and line bits.
    fn nikon_reply(row: &Replied) -> Option<(Crc, Window, u16)> {
        let reply = RawResponse::from_words(row.expected.layout(), row.words, BitOrder::MsbFirst).ok()?;
        Some((reply.crc(), reply.line(), reply.words(BitOrder::MsbFirst).fold(0, |all, word| all ^ word)))
    } over REPLIES;

    /// The frames of a request.
    fn nikon_request_emit(request: &Request) -> Frames {
        request.emit()
    } over REQUESTS;

    /// A request as an encoder receives it.
    fn nikon_request_parse(request: &Request) -> Result<Request, Error> {
        Request::parse(request.emit().as_slice())
    } over REQUESTS;

    /// A request as line bits with gaps.
    fn nikon_request_line(request: &Request) -> Option<([u8; 24], u32)> {
        let mut bytes = [0xff; 24];
        let bits = request.emit().write_line(&mut bytes, 3, BitRate::Mbit8.bits(1000), BitOrder::MsbFirst).ok()?;
        Some((bytes, bits))
    } over REQUESTS;

    /// What the reply to a request has to be.
    fn nikon_expected(request: &Request) -> Result<Expected, Error> {
        request.check(Resolution::default()).map(|request| request.expected(resolution(17, 16)))
    } over REQUESTS;

    /// A request frame from line bits, and its transmit word.
    fn nikon_request_frame(line: &Window) -> Result<u32, Error> {
        RequestFrame::from_line(*line).map(RequestFrame::transmit_word)
    } over LINES;

    /// A command from its code, in a version.
    fn nikon_command(code: &u8) -> Option<Command> {
        Command::from_code(*code).filter(|command| command.is_in(Version::V2_1))
    } over [0_u8, 24, 31];

    /// CRC-8 of a whole reply's bytes, by bit, byte and word, and a CRC-3.
    fn nikon_crc(bytes: &[u8; 7]) -> (u8, u8, u8) {
        let [a, b, c, ..] = *bytes;
        let mixed = Crc8::new().bit(a & 1 == 1).byte(b).word(u16::from_be_bytes([b, c])).get();
        (crc8(bytes), mixed, crc3(u16::from(a)) ^ Crc3::new().bit(b & 1 == 1).get())
    } over [[0x20, 0x85, 0xf6, 0x4a, 0x80, 0x09, 0x80]];

    /// What a response says of the position, for the one who uses it.
    fn nikon_evidence_of((resolution, response): &(Resolution, Response)) -> Evidence {
        Evidence::of(*response, *resolution, 1_000_000)
    } over POSITIONS;

    /// The verdict, made where the position is used.
    fn nikon_evidence_at((evidence, now_ns, policy): &(Evidence, u64, Policy)) -> Result<Sample, Doubt> {
        evidence.at(*now_ns, *policy)
    } over JUDGED;

    /// The same where the position must not be used: old, with alarms, none at all.
    fn nikon_evidence_doubted((evidence, now_ns, policy): &(Evidence, u64, Policy)) -> Option<Doubt> {
        evidence.at(*now_ns, *policy).err()
    } over DOUBTED;

    /// Evidence through the words of a cell.
    fn nikon_evidence_words((evidence, _, _): &(Evidence, u64, Policy)) -> Evidence {
        Evidence::from_words(evidence.to_words())
    } over JUDGED;

    /// Angles of a sample.
    fn nikon_sample((evidence, now_ns, policy): &(Evidence, u64, Policy)) -> Option<(u32, u32, i32, Option<i64>)> {
        let sample = evidence.at(*now_ns, *policy).ok()?;
        let (resolution, single) = (resolution(20, 16), sample.single_turn());
        let angle = (sample.angle().to_bits(), resolution.milli_degrees(single), resolution.difference(single, 0));
        Some((angle.0, angle.1, angle.2, sample.counts()))
    } over JUDGED;

    /// The type word as a resolution.
    fn nikon_type_word(word: &u16) -> Option<Resolution> {
        TypeWord(*word).resolution()
    } over [0x0011_u16, 0x0007];

    /// The alarms of an alarm field, counted, and their summary.
    fn nikon_alarms(raw: &u16) -> (usize, EncoderStatus) {
        let alm = Alm::from_bits_retain(*raw) | Alm::BATT;
        ((alm & Alm::known(Version::V3_0)).iter_names().count(), EncoderStatus::of_alarms(alm))
    } over [0_u16, 0x0755];

    /// The halves of a position joined.
    fn nikon_halves((low, high): &(u32, u32)) -> Option<U40> {
        U40::from_halves(U24::truncate(*low), U24::truncate(*high))
    } over [(0x48_0000, 0x00_7048), (1, 0xff)];

    /// How long a transaction takes on the line.
    fn nikon_times(rate: &BitRate) -> (u32, u32) {
        (rate.transaction_ns(nikon_aformat::Layout::Abs40, 8), rate.bits(1000))
    } over BitRate::ALL;

    /// A request off the front of a stream.
    fn nikon_stream_request((bytes, len): &([u8; 4], usize)) -> IResult<&'static [u8], Request, Error> {
        stream::request(BitOrder::MsbFirst).parse(bytes.get(..*len).unwrap_or(bytes))
    } over SENT;

    /// A reply off the front of a packed line.
    fn nikon_stream_line(row: &Whole) -> IResult<stream::Bits<'static>, Response, Error> {
        stream::line_response(row.expected, BitOrder::LsbFirst).parse((&row.lsb_first, 0))
    } over WHOLE;
}

/// What eight encoders answer to command 4.
const WHOLE_MT: Expected = Expected::new(nikon_aformat::Layout::Abs40, Command::Abs40Mt);

const EIGHT: [[u16; 4]; 8] = [
    [0x2080, 0x2c48, 0x4200, 0xa006],
    [0x3080, 0x8148, 0xc200, 0xa035],
    [0x2880, 0x7348, 0x2200, 0xa089],
    [0x3880, 0xd8c8, 0xa200, 0xa0ee],
    [0x2480, 0x16c8, 0x6200, 0xa0e6],
    [0x3480, 0xadc8, 0xe200, 0xa05a],
    [0x2c80, 0x4028, 0x1200, 0xa087],
    [0x3c80, 0xf228, 0x9200, 0xa026],
];

/// Something to send.
type Emitted = Response;

const EMITTED: [Response; 3] = [
    Response::new(
        EncoderAddress::MAX,
        Command::Abs40,
        EncoderStatus::empty(),
        nikon_aformat::Data::Abs40 { abs: U40::truncate(0x1_2345_6789) },
    ),
    Response::new(
        EncoderAddress::MAX,
        Command::Abs24VelAcc,
        EncoderStatus::empty(),
        nikon_aformat::Data::Abs24VelAcc { abs: U24::truncate(77), velocity: -5, acceleration: 9 },
    ),
    Response::abs17(EncoderAddress::ZERO, EncoderStatus::empty(), nikon_aformat::U17::truncate(0x1_5555)),
];

/// The line bits of request frames, the last one damaged.
const LINES: [Window; 3] = [window(0x2_0004), window(0x2_e028), window(0x2_0014)];

const fn window(bits: u128) -> Window {
    match Window::from_bits(bits, 18) {
        Some(window) => window,
        None => panic!("18 bits fit"),
    }
}
