//! T-Format: requests and answers in every form.

use nom::{IResult, Parser};
use servowire_core::{Angle, Words};
use tformat::{
    Abm, Abs, Adf, AllData, Almc, BitOrder, BitRate, ControlField, DataId, Doubt, Error, Evidence, Frame, Hint, Policy,
    Request, Resolution, Response, Sample, StatusField, Tolerated, VendorCommand, Window, crc, spi, stream,
};

use super::kernels;
use crate::self_test::tformat::{ANSWERS, Answer, FULL, FULL_FORMS, FullForms};

/// One request of each length.
const REQUESTS: [Request; 3] = [
    Request::ReadAll,
    Request::ReadEeprom { adf: Adf::from_bits(0x35) },
    Request::WriteEeprom { adf: Adf::from_bits(0x7f), edf: 1 },
];

/// Their fields, and how many there are.
const SENT: [([u8; 4], usize); 3] = [([0x1a, 0, 0, 0], 1), ([0xea, 0x35, 0xdf, 0], 3), ([0x32, 0x7f, 0x01, 0x4c], 4)];

/// A response to ID 3 without alarms, of an encoder of 23 and 16 bits with signed turns, and of one of 17 and 16 with unsigned
/// ones.
const POSITIONS: [(Resolution, Response); 2] = [
    (resolution(23, 16), all_data(0x3b_c029, 0x17, 0xfffe)),
    (resolution(17, 16).with_unsigned_turns(), all_data(0x1_c029, 0x11, 7)),
];

const fn all_data(abs: u32, enid: u8, abm: u32) -> Response {
    Response::ReadAll(AllData {
        sf: StatusField::empty(),
        abs: Abs::truncate(abs),
        enid,
        abm: Abm::truncate(abm),
        almc: Almc::empty(),
    })
}

/// Evidence sampled at 1 ms, the time at which it is judged, and the policy: a position that counts turns, and one that does
/// not; evidence that is too old, or has an alarm, is for the panic walk, which sees all paths.
const JUDGED: [(Evidence, u64, Policy); 2] = {
    let [(first, one), (second, other)] = POSITIONS;
    [
        (Evidence::of(one, first, 1_000_000), 1_090_000, Policy::new(125_000).tolerating(Tolerated::MULTI_TURN)),
        (Evidence::of(other, second, 1_000_000), 1_090_000, Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN)),
    ]
};

const fn resolution(abs_bits: u8, abm_bits: u8) -> Resolution {
    match Resolution::new(abs_bits, abm_bits) {
        Ok(resolution) => resolution,
        Err(_) => panic!("no such widths"),
    }
}

/// A logged answer to ID 3.
const LOGGED: [u8; 11] = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];

/// It as line bits.
const LINE: Window = {
    let (mut bits, mut field) = (0, 0);
    while field < 11 {
        bits |= ((LOGGED[field] as u128) << 1 | 1 << 9) << (10 * field);
        field += 1;
    }
    match Window::from_bits(bits, 110) {
        Some(line) => line,
        None => panic!("no frame is that long"),
    }
};

/// It as 10-bit SPI words: delimiter of the field before, start bit, data bits.
const SPI10: [u16; 11] = {
    let (mut words, mut field) = ([0; 11], 0);
    while field < 11 {
        words[field] = 0x200 | LOGGED[field].reverse_bits() as u16;
        field += 1;
    }
    words
};

/// It as the 16-bit words of the whole transaction, the first line bit in bit 15: 18 idle bits, then the frame.
const SPI16: [u16; 8] = {
    let (mut stream, mut words) = ((1_u128 << 18) - 1, [0; 8]);
    let mut at = 0;
    while at < 11 {
        stream = stream << 10 | (LOGGED[at].reverse_bits() as u128) << 1 | 1;
        at += 1;
    }
    at = 0;
    while at < 8 {
        words[at] = (stream >> (112 - 16 * at)) as u16;
        at += 1;
    }
    words
};

/// A command that is not Tamagawa's.
const VENDOR: VendorCommand = match VendorCommand::new(0x2a, 5) {
    Ok(command) => command,
    Err(_) => panic!("no such length"),
};

kernels! {
    /// The answer to ID 3 from its 110 line bits, least significant bit of a byte first, with all checks.
    fn tformat_id3_line_lsb(row: &FullForms) -> Result<AllData, Error> {
        AllData::parse_line(&row.lsb_first, BitOrder::LsbFirst)
    } over FULL_FORMS;

    /// The same from a shift register, most significant bit first.
    fn tformat_id3_line_msb(row: &FullForms) -> Result<AllData, Error> {
        AllData::parse_line(&row.msb_first, BitOrder::MsbFirst)
    } over FULL_FORMS;

    /// The answer to ID 3 from UART bytes.
    fn tformat_id3_uart(row: &FullForms) -> Result<AllData, Error> {
        AllData::parse(&row.uart)
    } over FULL_FORMS;

    /// The UART bytes of an answer to ID 3.
    fn tformat_id3_emit(full: &AllData) -> [u8; AllData::FIELDS] {
        full.emit()
    } over FULL;

    /// The line bits of an answer to ID 3.
    fn tformat_id3_emit_line(full: &AllData) -> [u8; Frame::MAX_LINE_BYTES] {
        full.emit_line(BitOrder::LsbFirst)
    } over FULL;

    /// The answers of all IDs from UART bytes.
    fn tformat_response_parse(row: &Answer) -> Result<Response, Error> {
        Response::parse(row.request, row.bytes)
    } over ANSWERS;

    /// The answers of all IDs from line bits.
    fn tformat_response_parse_line(row: &Answer) -> Result<Response, Error> {
        Response::parse_line(row.request, row.line)
    } over ANSWERS;

    /// The answer to ID 3 from a window of line bits, whichever ID is asked for.
    fn tformat_response_parse_line_id3((request, line): &(Request, Window)) -> Result<Response, Error> {
        Response::parse_line(*request, *line)
    } over [(Request::ReadAll, LINE)];

    /// The fields of the answers of all IDs.
    fn tformat_response_emit(row: &Answer) -> Frame {
        row.want.emit()
    } over ANSWERS;

    /// The fields of a request.
    fn tformat_request_emit(request: &Request) -> Frame {
        request.emit()
    } over REQUESTS;

    /// A request as an encoder receives it.
    fn tformat_request_parse((bytes, len): &([u8; 4], usize)) -> Result<Request, Error> {
        Request::parse(bytes.get(..*len).unwrap_or(bytes))
    } over SENT;

    /// A control field to its data ID.
    fn tformat_control_field(cf: &u8) -> Result<DataId, Error> {
        ControlField::parse(*cf).and_then(ControlField::data_id)
    } over [0x1a_u8, 0xba, 0x7a];

    /// A frame of any bytes.
    fn tformat_frame_new((bytes, len): &([u8; 4], usize)) -> Option<Frame> {
        Frame::new(bytes.get(..*len).unwrap_or(bytes))
    } over SENT;

    /// The line bits of a frame, and its fields back from them.
    fn tformat_frame_line(request: &Request) -> Result<Frame, Error> {
        let frame = request.emit();
        Frame::from_line(frame.line(), frame.fields())
    } over REQUESTS;

    /// The check field over as many bytes as there are.
    fn tformat_crc(row: &Answer) -> u8 {
        crc(row.bytes)
    } over ANSWERS;

    /// What a response says of the position, made where it is received.
    fn tformat_evidence((resolution, response): &(Resolution, Response)) -> Evidence {
        Evidence::of(*response, *resolution, 1_000_000)
    } over POSITIONS;

    /// The verdict, made where the position is used.
    fn tformat_evidence_at((evidence, now_ns, policy): &(Evidence, u64, Policy)) -> Result<Sample, Doubt> {
        evidence.at(*now_ns, *policy)
    } over JUDGED;

    /// Evidence as the words of a cell, and back.
    fn tformat_evidence_words((evidence, ..): &(Evidence, u64, Policy)) -> Evidence {
        Evidence::from_words(evidence.to_words())
    } over JUDGED;

    /// A position in the units of a controller, and the way from there to the zero point.
    fn tformat_sample((evidence, now_ns, policy): &(Evidence, u64, Policy)) -> (Angle, Option<i64>, i32) {
        match evidence.at(*now_ns, *policy) {
            Ok(sample) => {
                let way = POSITIONS[0].0.difference(sample.single_turn(), 0);
                (sample.angle(), sample.counts(), way)
            }
            Err(_) => (Angle::ZERO, None, 0),
        }
    } over JUDGED;

    /// What an encoder ID suggests.
    fn tformat_from_enid(enid: &u8) -> Option<Hint> {
        Resolution::from_enid(*enid)
    } over [0x17_u8, 0x11, 0x99];

    /// The alarms of an error byte, counted, and whether the status says the same.
    fn tformat_alarms(full: &AllData) -> (usize, bool) {
        let AllData { sf, almc, .. } = *full;
        let latched = almc.intersection(Almc::LATCHED).iter().count();
        (latched, sf.agrees_with(almc) && !StatusField::of_alarms(almc).intersects(StatusField::REQUEST_DAMAGED))
    } over FULL;

    /// How long a transaction takes on the line.
    fn tformat_transaction_time((rate, request): &(BitRate, Request)) -> u32 {
        rate.transaction_ns(request.data_id())
    } over [(BitRate::Mbit2_5, Request::ReadAll), (BitRate::Mbit5, Request::ReadSingleTurn)];

    /// A request as 10-bit SPI words.
    fn tformat_spi10_words(request: &Request) -> [u16; 4] {
        let mut words = [spi::SPI10_IDLE; 4];
        words.iter_mut().zip(spi::spi10_words(&request.emit())).for_each(|(to, from)| *to = from);
        words
    } over REQUESTS;

    /// The answer to ID 3 from 10-bit SPI words.
    fn tformat_spi10_parse((words, len): &([u16; 11], usize)) -> Result<Response, Error> {
        spi::parse_spi10(Request::ReadAll, words.get(..*len).unwrap_or(words))
    } over [(SPI10, SPI10.len())];

    /// The transmitted stream of a transaction in 16-bit words.
    fn tformat_spi16_words(request: &Request) -> [u16; spi::SPI16_MAX_WORDS] {
        let mut words = [u16::MAX; spi::SPI16_MAX_WORDS];
        words.iter_mut().zip(spi::spi16_words(*request)).for_each(|(to, from)| *to = from);
        words
    } over REQUESTS;

    /// The answer to ID 3 from the received stream in 16-bit words.
    fn tformat_spi16_parse((words, len): &([u16; 8], usize)) -> Result<Response, Error> {
        spi::parse_spi16(Request::ReadAll, words.get(..*len).unwrap_or(words))
    } over [(SPI16, SPI16.len())];

    /// A request off the front of a stream.
    fn tformat_stream_request((bytes, len): &([u8; 4], usize)) -> IResult<&'static [u8], Request, Error> {
        stream::request(bytes.get(..*len).unwrap_or(bytes))
    } over SENT;

    /// An answer off the front of a stream.
    fn tformat_stream_response(row: &Answer) -> IResult<&'static [u8], Response, Error> {
        stream::response(row.request).parse(row.bytes)
    } over ANSWERS;

    /// A vendor's own request with a body of two bytes.
    fn tformat_vendor_emit((command, body): &(VendorCommand, [u8; 2])) -> Option<Frame> {
        command.emit(body)
    } over [(VENDOR, [0x11, 0x22])];

    /// The answer to a vendor's own request.
    fn tformat_vendor_parse((command, bytes): &(VendorCommand, [u8; 5])) -> Result<&'static [u8], Error> {
        command.parse(bytes)
    } over [(VENDOR, [0x2a, 0x11, 0x22, 0x33, 0x2a])];
}
