//! T-Format.

use nom::{Err, Parser};
use tformat::{Adf, AllData, BitOrder, ControlField, DataId, Error, Frame, Request, Response, Window, crc};

use crate::byte;

pub mod ends;
mod reference;
pub mod world;

/// The request that the first three bytes choose: kind, ADF, EDF.
fn chosen(data: &mut &[u8]) -> Request {
    let (kind, adf, edf) = (byte(data), Adf::from_bits(byte(data)), byte(data));
    Request::of(DataId::ALL[usize::from(kind) % 9], adf, edf)
}

/// A request as an encoder receives it: what is accepted would be sent again, what is refused fails the check that is
/// named.
pub fn request(data: &[u8]) {
    match Request::parse(data) {
        Ok(request) => {
            let frame = request.emit();
            assert!(data.starts_with(frame.as_bytes()));
            assert_eq!(Frame::from_line(frame.line(), frame.fields()), Ok(frame));
        }
        Err(Error::Truncated { got, want }) => assert!(usize::from(got) == data.len() && got < want),
        Err(Error::SinkCode { cf }) => assert!(cf == data[0] && cf & 7 != 2),
        Err(Error::Parity { cf }) => assert!(cf == data[0] && (cf >> 3).count_ones() % 2 == 1),
        Err(Error::UnknownDataId { code }) => assert_eq!(ControlField::compose(code).get(), data[0]),
        Err(Error::Crc { got, want }) => {
            let id = ControlField::parse(data[0]).and_then(ControlField::data_id).expect("a known request");
            let last = usize::from(id.request_fields()) - 1;
            assert!(got == data[last] && want == crc(&data[..last]) && got != want);
        }
        Err(error) => panic!("{error} is not an error of a request"),
    }
}

/// An answer from bytes and from a line at any bit offset: what is accepted is what the encoder would send.
///
/// ```text
/// 0..3  request      3  bit offset (0..=63) and order of the bits (bit 7)      4..  bytes, or line bits
/// ```
pub fn response(mut data: &[u8]) {
    let request = chosen(&mut data);
    let place = byte(&mut data);
    match Response::parse(request, data) {
        Ok(response) => {
            assert!(data.starts_with(response.emit().as_bytes()));
            assert_eq!(response.data_id(), request.data_id());
        }
        Err(error) => refused(request, error),
    }
    let order = if place & 0x80 == 0 { BitOrder::LsbFirst } else { BitOrder::MsbFirst };
    let offset = usize::from(place & 63);
    let len = (data.len() * 8).saturating_sub(offset).min(128) as u32;
    let Ok(line) = Window::read(data, offset, len, order) else { return };
    match Response::parse_line(request, line) {
        Ok(response) => {
            let sent = response.emit().line();
            assert_eq!(Window::from_bits(line.bits(), sent.len()), Some(sent));
            assert_eq!(Response::parse(request, response.emit().as_bytes()), Ok(response));
        }
        Err(Error::StartBit { field }) => assert_eq!(line.get(10 * u32::from(field)), Some(true)),
        Err(Error::Delimiter { field }) => assert_eq!(line.get(10 * u32::from(field) + 9), Some(false)),
        Err(error) => refused(request, error),
    }
}

/// An answer is refused for reasons that an answer can have, and the reason says something that can be so.
fn refused(request: Request, error: Error) {
    match error {
        Error::Truncated { got, want } => assert!(got < want && want <= 11),
        Error::SinkCode { cf } => assert_ne!(cf & 7, 2),
        Error::Parity { cf } => assert_eq!((cf >> 3).count_ones() % 2, 1),
        Error::CfMismatch { got, want } => assert!(got != want && want == request.data_id().control_field().get()),
        Error::Rejected { .. } => assert_ne!(request, Request::ReadAll),
        Error::Crc { got, want } | Error::AddressMismatch { got, want } | Error::DataMismatch { got, want } => {
            assert_ne!(got, want);
        }
        _ => panic!("{error} is not an error of an answer"),
    }
}

/// The kernels against a decoder that takes one bit after the other and follows the text.
///
/// ```text
/// 0..3  request      3  bits that are cut off the end, 0..=127      4..20  line bits, LSB first
/// ```
pub fn differential(mut data: &[u8]) {
    let request = chosen(&mut data);
    let cut = u32::from(byte(&mut data) & 127);
    let mut bytes = [0; 16];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let line = Window::from_bits(u128::from_le_bytes(bytes), 128 - cut).expect("128 bits at most");
    let bits: Vec<bool> = (0..line.len()).filter_map(|at| line.get(at)).collect();
    assert_eq!(Response::parse_line(request, line), reference::response(request, &bits));

    // The kernel for the longest frame has 110 bits in 14 bytes in either order.
    let lsb: [u8; Frame::MAX_LINE_BYTES] = *bytes.first_chunk().expect("14 of 16 bytes");
    let bits: Vec<bool> = (0..110).map(|at| lsb[at / 8] >> (at % 8) & 1 == 1).collect();
    let want = reference::response(Request::ReadAll, &bits);
    assert_eq!(AllData::parse_line(&lsb, BitOrder::LsbFirst).map(Response::ReadAll), want);
    assert_eq!(AllData::parse_line(&lsb.map(u8::reverse_bits), BitOrder::MsbFirst).map(Response::ReadAll), want);
    if let Ok(Response::ReadAll(full)) = want {
        assert_eq!(crc(&full.emit()), 0);
        let unused = [0xff_u8, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x3f];
        let sent = full.emit_line(BitOrder::LsbFirst);
        assert!(sent.iter().zip(lsb).zip(unused).all(|((sent, got), mask)| *sent == got & mask));
    }
}

/// Streams: however the bytes arrive, the same frames come out at the same places.
///
/// ```text
/// 0..3  request      3  bytes that arrive at once      4..  answers, one after the other
/// ```
pub fn stream(mut data: &[u8]) {
    let asked = chosen(&mut data);
    let step = usize::from(byte(&mut data) % 16) + 1;
    in_parts(data, step, |input| tformat::stream::response::<Error>(asked).parse(input));
    in_parts(data, step, tformat::stream::request::<Error>);
}

/// Parses all frames off the front of `data` at once and in steps.
fn in_parts<'a, T: PartialEq + std::fmt::Debug>(
    data: &'a [u8],
    step: usize,
    parse: impl Fn(&'a [u8]) -> nom::IResult<&'a [u8], T, Error>,
) {
    let mut whole = Vec::new();
    let mut rest = data;
    let end = loop {
        match parse(rest) {
            Ok((after, value)) => {
                assert!(after.len() < rest.len() && data.ends_with(after));
                whole.push((data.len() - after.len(), value));
                rest = after;
            }
            Err(error) => break error,
        }
    };
    if let Err::Incomplete(nom::Needed::Size(more)) = end {
        assert!(more.get() <= 11);
    }

    let (mut parts, mut begin, mut arrived) = (Vec::new(), 0, 0);
    let mut stop = None;
    while arrived < data.len() && stop.is_none() {
        arrived = (arrived + step).min(data.len());
        loop {
            match parse(&data[begin..arrived]) {
                Ok((after, value)) => {
                    begin = arrived - after.len();
                    parts.push((begin, value));
                }
                Err(Err::Incomplete(_)) => break,
                Err(error) => {
                    stop = Some(error);
                    break;
                }
            }
        }
    }
    assert_eq!(parts, whole);
    match (stop, end) {
        (Some(stop), end) => assert_eq!(stop, end),
        (None, end) => assert!(end.is_incomplete()),
    }
}
