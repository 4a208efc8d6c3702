//! A-format.

pub mod world;

use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::device::{Device, Encoders};
use nikon_aformat::inspect::inspect as report;
use nikon_aformat::master::{BusTransaction, Line, Progress, Transaction};
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{
    BitOrder, BitRate, Command, Crc8, EncoderAddress, EncoderId, Error, Expected, Layout, Operation, RawResponse,
    Request, RequestFrame, Resolution, Response, U19, UserAddress, Window, stream as parsers,
};
use nom::{Err, Parser};
use nrz_line::Samples;

use crate::byte;

/// The request that the first three bytes choose: address and kind, two bytes of arguments.
fn chosen(data: &mut &[u8]) -> Request {
    let (kind, low, high) = (byte(data), byte(data), byte(data));
    let ea = EncoderAddress::truncate(kind);
    let wide = u32::from_le_bytes([low, high, low ^ high, 0]);
    let (id, word) = (EncoderId::truncate(wide), u16::from_le_bytes([low, high]));
    let user = UserAddress::new(low).unwrap_or_default();
    let operation = match kind >> 3 {
        31 => Operation::CoefficientWrite { coefficient: U19::truncate(wide) },
        code => match Command::ALL[usize::from(code)] {
            Command::EepromRead if high & 1 == 0 => Operation::EepromRead { address: low },
            Command::EepromRead => Operation::EepromReadBank { bank: high, address: low },
            Command::EepromWrite if high & 1 == 0 => Operation::EepromWrite { address: user, data: word },
            Command::EepromWrite => Operation::EepromWriteBank { bank: high, address: low, data: word },
            Command::IdRead1 if high & 1 == 1 => Operation::CoefficientRead,
            Command::IdWrite1 => Operation::IdWrite1 { id },
            Command::IdWrite2 => Operation::IdWrite2 { id },
            Command::SetAddress2 => Operation::SetAddress2 { id },
            command => Operation::without_arguments(command).expect("the others take no arguments"),
        },
    };
    Request::new(ea, operation)
}

/// Words of two bytes, the first line bit in bit 7.
fn words(data: &[u8]) -> impl Iterator<Item = u16> {
    data.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]]))
}

/// A request as an encoder receives it: what is accepted would be sent again, and the parser for streams says the same.
pub fn request(data: &[u8]) {
    let frames: Vec<Result<RequestFrame, Error>> =
        words(data).map(|word| RequestFrame::from_word(word, BitOrder::MsbFirst)).collect();
    for (frame, word) in frames.iter().zip(words(data)) {
        match frame {
            Ok(frame) => assert_eq!(frame.word(BitOrder::MsbFirst), word),
            Err(Error::Crc3 { got, want }) => assert_ne!(got, want),
            Err(Error::SyncCode { got }) => assert_ne!(*got, RequestFrame::SYNC_CODE),
            Err(error) => panic!("{error} is not an error of a frame"),
        }
    }
    let good: Vec<RequestFrame> = frames.iter().map_while(|frame| frame.ok()).collect();
    let parsed = Request::parse(&good);
    if let Ok(request) = parsed {
        assert!(good.starts_with(request.emit().as_slice()));
    }
    match (parsers::request::<Error>(BitOrder::MsbFirst).parse(data), parsed) {
        (Ok((rest, request)), parsed) => {
            assert_eq!(Ok(request), parsed);
            assert_eq!(rest.len(), data.len() - 2 * request.emit().as_slice().len());
        }
        (Err(Err::Incomplete(_)), parsed) => assert!(matches!(parsed, Err(Error::Truncated { .. }))),
        (Err(_), parsed) => assert!(parsed.is_err()),
    }
}

/// A reply by bits, one after the other, as the text has it.
fn by_the_text(request: Request, bits: &[bool]) -> Result<(), Error> {
    let expected = request.expected(Resolution::default());
    let (layout, command) = (expected.layout(), expected.command());
    let want = layout.line_bits() as usize;
    if bits.len() < want {
        return Err(Error::Truncated { got: bits.len() as u16, want: want as u16 });
    }
    let mut content = Vec::new();
    for (frame, bits) in (0..).zip(bits[..want].chunks(18)) {
        if bits[0] {
            return Err(Error::StartBit { frame });
        }
        if !bits[17] {
            return Err(Error::Delimiter { frame });
        }
        content.extend(&bits[1..17]);
    }
    let number = |from: usize, len: usize| (0..len).fold(0_u64, |n, k| n | u64::from(content[from + k]) << k);
    let crc = content[..content.len() - 8].iter().fold(Crc8::new(), |crc, bit| crc.bit(*bit)).get();
    let got = content[content.len() - 8..].iter().fold(0, |crc, bit| crc << 1 | u8::from(*bit));
    if got != crc {
        return Err(Error::Crc { got, want: crc });
    }
    if number(0, 3) != 4 {
        return Err(Error::SyncCode { got: number(0, 3) as u8 });
    }
    let full = layout != Layout::Abs17;
    if full && content[11] {
        return Err(Error::FixedBit);
    }
    if command.answers_with_own_address() && number(3, 3) != u64::from(request.ea.get()) {
        return Err(Error::AddressMismatch { got: number(3, 3) as u8, want: request.ea.get() });
    }
    if full && number(6, 5) != u64::from(command.code()) {
        return Err(Error::CommandMismatch { got: number(6, 5) as u8, want: command.code() });
    }
    if layout == Layout::EepromBank && content[16 + 32] {
        return Err(Error::BankError);
    }
    Ok(())
}

/// The decoder against one that takes one bit after the other; memory arguments are left to the vectors.
///
/// ```text
/// 0..3  request      3  bit offset (0..=63) and order of the bits (bit 7)      4..  line bits
/// ```
pub fn reply(mut data: &[u8]) {
    let request = chosen(&mut data);
    let place = byte(&mut data);
    let order = if place & 0x80 == 0 { BitOrder::LsbFirst } else { BitOrder::MsbFirst };
    let offset = usize::from(place & 63);
    let len = (data.len() * 8).saturating_sub(offset).min(128) as u32;
    let Ok(line) = Window::read(data, offset, len, order) else { return };
    let bits: Vec<bool> = (0..line.len()).filter_map(|at| line.get(at)).collect();
    let expected = request.expected(Resolution::default());
    let got = Response::parse_line(&expected, line);
    if !matches!(got, Err(Error::EchoMismatch { .. })) {
        assert_eq!(got.map(|_| ()), by_the_text(request, &bits));
    }
    if let Ok(response) = got {
        assert_eq!(response.layout(), expected.layout());
        assert_eq!(Response::parse(&expected, &response.emit()), Ok(response));
    }
}

/// Reception by samples and by words of samples gives the same, strict and tolerant, and the bus accounts for all of it.
///
/// ```text
/// 0  layout      1  samples a bit, and whether idle bits may stand between frames (bit 7)      2..  samples, LSB first
/// ```
pub fn reception(mut data: &[u8]) {
    let layout = Layout::ALL[usize::from(byte(&mut data)) % Layout::ALL.len()];
    let how = byte(&mut data);
    let receiver = match how & 0x7f {
        0..4 => LineReceiver::bits(layout),
        samples => match LineReceiver::oversampled(samples.into(), layout) {
            Ok(receiver) => receiver,
            Err(_) => return,
        },
    };
    let receiver = if how & 0x80 == 0 { receiver } else { receiver.allowing_idle_between_frames() };
    let (mut by_sample, mut by_word) = (receiver, receiver);
    let mut bus = Bus::new(Expected::new(layout, Command::Abs40Mt), Addresses::ALL);
    let mut one = Vec::new();
    for byte in data {
        one.extend((0..8).filter_map(|k| by_sample.push(byte >> k & 1 == 1)));
    }
    let mut other = Vec::new();
    for eight in data.chunks(8) {
        let word = eight.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte));
        let mut samples = Samples::partial(word, eight.len() as u32 * 8);
        while !samples.is_empty() {
            other.extend(by_word.feed(&mut samples));
        }
    }
    one.extend(by_sample.finish().map(Err));
    other.extend(by_word.finish().map(Err));
    assert_eq!(one, other);
    for reply in one.iter().take(200) {
        bus.push(*reply);
    }
    assert_eq!(usize::from(bus.arrived()), one.len().min(200));
    assert!(bus.damaged() <= bus.arrived());
    assert!(
        bus.asked()
            .iter()
            .all(|ea| { bus.response(ea).is_some() != (bus.missing().contains(ea) || bus.duplicates().contains(ea)) })
    );
}

/// Transactions end, stay as they ended, and give no value that the reply does not hold.
///
/// ```text
/// 0..3  request      then four bytes an event: a frame's content, what it is, time since the last
/// ```
pub fn master(mut data: &[u8]) {
    let request = chosen(&mut data);
    let line = Line::new(BitRate::Mbit8);
    let resolution = Resolution::default();
    let mut single = Transaction::start(request, resolution, line, 0);
    let mut bus = BusTransaction::start(request, resolution, Addresses::first(3), line, 0);
    let mut now_ns = 0;
    for event in data.chunks_exact(4) {
        now_ns += u64::from(event[3]) * 100;
        let before = single.progress();
        let content = u16::from_le_bytes([event[0], event[1]]);
        // The lowest bits say how many frames come at once, and since when.
        let block = [Some(content), None, Some(!content), Some(content)];
        let block = &block[..=usize::from(event[2] >> 3 & 3)];
        let since_ns = if event[2] & 0x80 == 0 { 0 } else { now_ns };
        let after = match event[2] {
            0 => single.framing_error(now_ns),
            1 => single.poll(now_ns),
            2 => single.hear_since(block, since_ns, now_ns),
            _ => single.hear(&[Some(content)], now_ns),
        };
        if !matches!(before, Progress::Pending { .. }) {
            assert_eq!(before, after);
        }
        let over = !matches!(bus.poll(now_ns), Progress::Pending { .. });
        let heard = *bus.bus();
        let _ = match event[2] {
            0 => bus.framing_error(now_ns),
            2 => bus.hear_since(block, since_ns, now_ns),
            _ => bus.hear(&[Some(content)], now_ns),
        };
        if over {
            assert_eq!(heard, *bus.bus());
        }
    }
    assert!(!matches!(single.poll(u64::MAX), Progress::Pending { .. }));
    assert!(!matches!(bus.poll(u64::MAX), Progress::Pending { .. }));
    if let Progress::Done { value: response, .. } = single.progress() {
        assert_eq!(Response::parse(&request.expected(resolution), &response.response.emit()), Ok(response.response));
        assert!(response.began_ns >= response.sampled_ns);
    }
}

/// Encoders answer nothing or a sound reply to whatever comes, and later understand a good request.
///
/// ```text
/// four bytes an event: a frame's content, what it is, time since the last
/// ```
pub fn device(data: &[u8]) {
    let resolution = Resolution::default();
    let mut encoders = Encoders {
        all: [0, 1, 7].map(|ea| Device::<2>::new(EncoderAddress::truncate(ea), resolution, BitRate::Mbit4)),
    };
    let mut now_ns = 0;
    for event in data.chunks_exact(4) {
        now_ns += u64::from(event[3]) * 1000;
        if event[2] == 0 {
            encoders.framing_error(now_ns);
            continue;
        }
        for answer in encoders.hear(&[Some(u16::from_le_bytes([event[0], event[1]]))], now_ns).into_iter().flatten() {
            let crc = answer.frames.crc();
            assert_eq!(crc.got, crc.want);
            assert!(answer.start_ns > now_ns && answer.line == answer.frames.line());
            assert!(RawResponse::from_line(Layout::Abs17, answer.line).is_ok());
        }
    }
    now_ns += 1_000_000_000;
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let answers = encoders.hear(&[Some(request.emit().as_slice()[0].content())], now_ns);
    assert!(answers.iter().all(Option::is_some));
}

/// Any line gives a report; a value in it without a cause only if nothing is wrong.
///
/// ```text
/// 0..3  request      3  bits, 0..=128      4..20  line bits, LSB first
/// ```
pub fn inspect(mut data: &[u8]) {
    let request = chosen(&mut data);
    let len = u32::from(byte(&mut data)).min(128);
    let mut bytes = [0; 16];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let line = Window::from_bits(u128::from_le_bytes(bytes), len).expect("128 bits at most");
    let report = report(request, Resolution::default(), line);
    let parsed = Response::parse_line(&request.expected(Resolution::default()), line);
    assert_eq!(report.error(), parsed.err());
    assert_eq!(report.error().is_none(), report.response().is_some() && report.cause().is_none());
    assert!(parsed.is_err() || report.findings().is_empty());
    assert!(report.error().is_none() || !report.findings().is_empty());
}
