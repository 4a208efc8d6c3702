use super::*;
use crate::expected::Echo;
use crate::operation::Operation;
use crate::request::Request;
use crate::request::tests::requests;
use crate::resolution::Resolution;
use proptest::prelude::*;
use std::vec::Vec;

/// Data of `layout` out of random numbers, never a bank error; `None` for the short form.
pub(crate) fn data(layout: Layout, a: u64, b: u64) -> Option<Data> {
    // Bit 48 is the bank error.
    let contents = [(a as u32) << 16, (a >> 16) as u32 & !(u32::from(layout == Layout::EepromBank) << 16), b as u32];
    Response::of_contents(&Expected::new(layout, Command::Abs40), contents).ok().and_then(Response::data)
}

/// The response of a sound encoder to `request`, its data out of random numbers and the arguments repeated.
pub(crate) fn answer(request: Request, resolution: Resolution, es: EncoderStatus, a: u64, b: u64) -> Response {
    let layout = request.layout(resolution);
    let Some(data) = data(layout, a, b) else {
        return Response::abs17(request.ea, es, U17::truncate(a as u32));
    };
    let data = match (request.operation, data) {
        (Operation::EepromRead { address }, Data::Eeprom { data, .. }) => Data::Eeprom { data, address },
        (Operation::EepromWrite { address, data }, _) => Data::Eeprom { data, address: address.get() },
        (Operation::EepromReadBank { bank, address }, Data::EepromBank { data, .. })
        | (Operation::EepromWriteBank { bank, address, data }, _) => {
            Data::EepromBank { data, bank, address, bank_error: false }
        }
        (Operation::IdWrite1 { id } | Operation::IdWrite2 { id } | Operation::SetAddress2 { id }, _) => Data::Id { id },
        (Operation::CoefficientWrite { coefficient }, _) => Data::Coefficient { coefficient },
        (_, data) => data,
    };
    Response::new(request.ea, request.command(), es, data)
}

pub(crate) fn resolutions() -> impl Strategy<Value = Resolution> {
    any::<[bool; 2]>().prop_map(|[low, reset]| {
        let resolution = Resolution::default();
        let resolution = if low { resolution.with_velocity_in_low() } else { resolution };
        if reset { resolution.with_position_in_resets() } else { resolution }
    })
}

/// A request, what is expected and an answer that a sound encoder may give.
pub(crate) fn exchanges() -> impl Strategy<Value = (Request, Expected, Response)> {
    (requests(), resolutions(), any::<(u8, u64, u64)>()).prop_map(|(request, resolution, (es, a, b))| {
        let response = answer(request, resolution, EncoderStatus::from_bits_truncate(es), a, b);
        (request, request.expected(resolution), response)
    })
}

fn flipped(line: Window, at: u32) -> Window {
    Window::from_bits(line.bits() ^ 1 << at, line.len()).unwrap()
}

/// Single-turn position, turns and CRC-8 of 16 responses to command 0 that a vendor's sample program logged
/// (20 + 20 bits, the turns 0x8888 in all). The log prints the CRC-8 least significant bit first.
const LOGGED: [(u64, u8); 2] = [(0xf_ffa5, 0x63), (0xf_ffb4, 0x49)];

#[test]
fn published_responses() {
    let expected = Expected::new(Layout::Abs24, Command::Abs24Low);
    let raw = Response::parse_words(&expected, &[0x3e03, 0x00ef, 0xdf35], BitOrder::MsbFirst).unwrap();
    assert_eq!((raw.ea.get(), raw.abs(), raw.es().map(|es| es.bits())), (7, Some(0xfb_f700), Some(0xc)));
    let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
    let raw = Response::parse_words(&expected, &[0x2085, 0xf64a, 0x8009, 0x80a1], BitOrder::MsbFirst).unwrap();
    assert_eq!((raw.ea.get(), raw.es().map(|es| es.bits())), (0, Some(0xa)));
    assert_eq!(raw.abs(), Some(51_200 << 17 | 0x1_526f));
    for (single, printed) in LOGGED {
        let data = Data::Abs40 { abs: U40::truncate(0x8888 << 20 | single) };
        let response = Response::new(EncoderAddress::ZERO, Command::Abs40, EncoderStatus::empty(), data);
        assert_eq!(response.emit().crc().want.reverse_bits(), printed, "{single:x}");
    }
}

proptest! {
    #[test]
    fn words_and_line_round_trip((request, expected, response) in exchanges(), tail: u16) {
        let raw = response.emit();
        prop_assert_eq!(Response::parse(&expected, &raw), Ok(response));
        prop_assert_eq!(raw.frames(), response.layout().frames());
        prop_assert_eq!(response.layout(), expected.layout());
        prop_assert_eq!(response.ea, request.ea);
        let line = raw.line();
        let after = Window::from_bits(line.bits() | u128::from(tail) << line.len(), (line.len() + 16).min(128)).unwrap();
        prop_assert_eq!(Response::parse_line(&expected, after), Ok(response));
        for order in [BitOrder::LsbFirst, BitOrder::MsbFirst] {
            let mut words: Vec<_> = raw.words(order).collect();
            words.push(tail);
            prop_assert_eq!(Response::parse_words(&expected, &words, order), Ok(response));
        }
    }

    /// What is accepted is what would be sent, but for unused bits.
    #[test]
    fn accepted_words_are_what_it_would_emit((_, expected, response) in exchanges(), noise: [u16; 6]) {
        let good = response.emit();
        let mut contents = [0; 6];
        for (k, to) in contents.iter_mut().enumerate().take(good.contents().len()) {
            *to = if k == 0 { good.contents()[0] } else { noise[k] };
        }
        let raw = RawResponse::of(contents, expected.layout()).sealed();
        let expected = expected.any_address().echoing(Echo::None);
        match Response::parse(&expected, &raw) {
            Ok(got) => {
                let again = got.emit();
                prop_assert_eq!(Response::parse(&expected, &again), Ok(got));
                let unused = [Layout::Temperature, Layout::Coefficient, Layout::Abs24Temp, Layout::EepromBank];
                prop_assert!(again == raw || unused.contains(&expected.layout()));
            }
            Err(error) => prop_assert_eq!(error, Error::BankError),
        }
    }

    /// Every single wrong bit of the line is refused, by the check that covers it.
    #[test]
    fn single_flips_on_the_line((_, expected, response) in exchanges()) {
        let line = response.emit().line();
        for at in 0..line.len() {
            let error = Response::parse_line(&expected, flipped(line, at)).unwrap_err();
            let frame = (at / 18) as u8;
            let right = match at % 18 {
                0 => error == Error::StartBit { frame },
                17 => error == Error::Delimiter { frame },
                _ => matches!(error, Error::Crc { .. }),
            };
            prop_assert!(right, "bit {}: {:?}", at, error);
        }
    }

    #[test]
    fn truncations((_, expected, response) in exchanges()) {
        let raw = response.emit();
        let line = raw.line();
        for got in 0..line.len() {
            let short = Window::from_bits(line.bits(), got).unwrap();
            let error = Error::Truncated { got: got as u16, want: line.len() as u16 };
            prop_assert_eq!(Response::parse_line(&expected, short), Err(error));
        }
        for got in 0..raw.frames() {
            let error = Error::Truncated { got: u16::from(got) * 18, want: line.len() as u16 };
            let words = &raw.contents()[..usize::from(got)];
            prop_assert_eq!(Response::parse_words(&expected, words, BitOrder::LsbFirst), Err(error));
        }
    }

    /// Wrong sync code, fixed bit, address or command under a good CRC-8, in the order of the checks.
    #[test]
    fn wrong_information_fields((_, expected, response) in exchanges(), first: u16) {
        let mut contents = [0; 6];
        contents[..usize::from(expected.layout().frames())].copy_from_slice(response.emit().contents());
        contents[0] = first;
        let raw = RawResponse::of(contents, expected.layout()).sealed();
        let full = expected.layout() != Layout::Abs17;
        let (sync, ea, cc) = ((first & 7) as u8, (first >> 3 & 7) as u8, (first >> 6 & 31) as u8);
        let got = Response::parse(&expected, &raw).err();
        let want = if sync != 4 {
            Some(Error::SyncCode { got: sync })
        } else if full && first >> 11 & 1 == 1 {
            Some(Error::FixedBit)
        } else if expected.ea().is_some_and(|want| want.get() != ea) {
            Some(Error::AddressMismatch { got: ea, want: response.ea.get() })
        } else if full && cc != expected.command().code() {
            Some(Error::CommandMismatch { got: cc, want: expected.command().code() })
        } else {
            None
        };
        prop_assert_eq!(got, want);
    }
}

/// Every single wrong bit and every truncation of the response to every operation: all fifteen layouts.
#[test]
fn every_flip_and_truncation_of_every_layout() {
    let odd = Resolution::default().with_velocity_in_low().with_position_in_resets();
    let mut seen = Vec::new();
    for resolution in [Resolution::default(), odd] {
        for operation in crate::request::tests::every(0x5a, 3, 0xbeef, 0x12_3456) {
            let request = Request::new(EncoderAddress::truncate(5), operation);
            let (expected, es) = (request.expected(resolution), EncoderStatus::from_bits_truncate(9));
            let line = answer(request, resolution, es, 0x0123_4567_89ab_cdef, 0xfedc_ba98_7654_3210).emit().line();
            seen.push(expected.layout());
            for at in (0..line.len()).step_by(if cfg!(miri) { 17 } else { 1 }) {
                let error = Response::parse_line(&expected, flipped(line, at)).unwrap_err();
                let frame = (at / 18) as u8;
                match at % 18 {
                    0 => assert_eq!(error, Error::StartBit { frame }),
                    17 => assert_eq!(error, Error::Delimiter { frame }),
                    _ => assert!(matches!(error, Error::Crc { .. }), "{operation:?}, bit {at}: {error}"),
                }
                let short = Window::from_bits(line.bits(), at).unwrap();
                let want = Error::Truncated { got: at as u16, want: line.len() as u16 };
                assert_eq!(Response::parse_line(&expected, short), Err(want));
            }
        }
    }
    assert!(Layout::ALL.into_iter().all(|layout| seen.contains(&layout)));
}

/// Each argument that a response repeats is compared, in the order address, bank, data; the data of a read are not sent.
#[test]
fn repeated_arguments() {
    use crate::error::EchoField::{self, Address, Bank, Coefficient, Id};
    /// The field that is wrong, what the response has, and what was sent.
    type Wrong = Option<(EchoField, u32, u32)>;
    let ea = EncoderAddress::truncate(5);
    let word = |data, address| Data::Eeprom { data, address };
    let of_bank = |data, bank, address| Data::EepromBank { data, bank, address, bank_error: false };
    let read = Operation::EepromRead { address: 0x42 };
    let address = crate::UserAddress::new(0x42).unwrap();
    let write = Operation::EepromWrite { address, data: 0x1234 };
    let bank_read = Operation::EepromReadBank { bank: 3, address: 0x42 };
    let bank_write = Operation::EepromWriteBank { bank: 3, address: 0x42, data: 0x1234 };
    let (id, other) = (EncoderId::truncate(0x12_3456), EncoderId::truncate(0x12_3457));
    let (coefficient, small) = (U19::truncate(0x4_0001), U19::truncate(1));
    let rows: [(Operation, Data, Wrong); 18] = [
        (read, word(0xbeef, 0x42), None),
        (read, word(0xbeef, 0x43), Some((Address, 0x43, 0x42))),
        (write, word(0x1234, 0x42), None),
        (write, word(0x1235, 0x42), Some((EchoField::Data, 0x1235, 0x1234))),
        (write, word(0x1235, 0x43), Some((Address, 0x43, 0x42))),
        (bank_read, of_bank(0xbeef, 3, 0x42), None),
        (bank_read, of_bank(0xbeef, 2, 0x42), Some((Bank, 2, 3))),
        (bank_read, of_bank(0xbeef, 2, 0x43), Some((Address, 0x43, 0x42))),
        (bank_write, of_bank(0x1234, 3, 0x42), None),
        (bank_write, of_bank(0x1234, 2, 0x42), Some((Bank, 2, 3))),
        (bank_write, of_bank(0x1235, 2, 0x42), Some((Bank, 2, 3))),
        (bank_write, of_bank(0x1235, 3, 0x42), Some((EchoField::Data, 0x1235, 0x1234))),
        (Operation::IdWrite1 { id }, Data::Id { id: other }, Some((Id, 0x12_3457, 0x12_3456))),
        (Operation::IdWrite2 { id }, Data::Id { id: other }, Some((Id, 0x12_3457, 0x12_3456))),
        (Operation::SetAddress2 { id }, Data::Id { id: other }, Some((Id, 0x12_3457, 0x12_3456))),
        (Operation::IdRead1, Data::Id { id: other }, None),
        (Operation::CoefficientWrite { coefficient }, Data::Coefficient { coefficient }, None),
        (
            Operation::CoefficientWrite { coefficient },
            Data::Coefficient { coefficient: small },
            Some((Coefficient, 1, 0x4_0001)),
        ),
    ];
    for (operation, data, wrong) in rows {
        let request = Request::new(ea, operation);
        let response = Response::new(ea, request.command(), EncoderStatus::empty(), data);
        let got = Response::parse(&request.expected(Resolution::default()), &response.emit());
        let want = wrong.map_or(Ok(response), |(field, got, want)| Err(Error::EchoMismatch { field, got, want }));
        assert_eq!(got, want, "{operation:?}");
    }
}

/// The whole position with the velocity after it: 40 bits and 32, least significant first, from bit 16 of the contents on.
#[test]
fn velocity_is_behind_the_position() {
    let abs40_vel = Data::Abs40Vel { abs: U40::truncate(0x12_3456_789a), velocity: -0x0102_0304 };
    let sent = Response::new(EncoderAddress::ZERO, Command::Abs24Low, EncoderStatus::empty(), abs40_vel);
    let raw = sent.emit();
    assert_eq!(raw.contents()[1..], [0x789a, 0x3456, 0xfc12, 0xfdfc, raw.contents()[5]]);
    assert_eq!(raw.contents()[5] & 0xff, 0xfe);
    let expected = Expected::new(Layout::Abs40Vel, Command::Abs24Low);
    assert_eq!(Response::parse(&expected, &raw), Ok(sent));
}

/// The encoder is the right one; what it answers is another command.
#[test]
fn the_command_that_was_answered_is_told() {
    let expected = Expected::new(Layout::Abs40, Command::Abs40).from_address(EncoderAddress::truncate(5));
    let data = Data::Abs40 { abs: U40::truncate(1) };
    let of = |ea, command| Response::new(EncoderAddress::truncate(ea), command, EncoderStatus::empty(), data).emit();
    let refused = |raw| Response::parse(&expected, &raw).unwrap_err();
    assert_eq!(refused(of(5, Command::Abs40Mt)), Error::CommandMismatch { got: 4, want: 0 });
    assert_eq!(refused(of(2, Command::Abs40Mt)), Error::AddressMismatch { got: 2, want: 5 });
}

/// Two wrong bits of which one is a start bit or a delimiter: neither hides the other.
#[test]
fn no_wrong_framing_is_hidden_by_another_wrong_bit() {
    let status = EncoderStatus::empty();
    let abs40 = Data::Abs40 { abs: U40::truncate(0x12_3456_789a) };
    let abs40_vel = Data::Abs40Vel { abs: U40::truncate(0x12_3456_789a), velocity: 0x0102_0304 };
    for (command, data) in [(Command::Abs40, abs40), (Command::Abs24Low, abs40_vel)] {
        let sent = Response::new(EncoderAddress::ZERO, command, status, data);
        let (line, expected) = (sent.emit().line(), Expected::new(data.layout(), command));
        assert_eq!(Response::parse_line(&expected, line), Ok(sent));
        for framing in (0..line.len()).filter(|bit| matches!(bit % 18, 0 | 17)) {
            for other in (0..line.len()).filter(|bit| *bit != framing) {
                let error = Response::parse_line(&expected, flipped(flipped(line, framing), other)).unwrap_err();
                let named = matches!(error, Error::StartBit { .. } | Error::Delimiter { .. });
                assert!(named, "bits {framing} and {other}: {error}");
            }
        }
    }
}

/// What is set twice stays set.
#[test]
fn the_same_twice_is_the_same() {
    let (ea, expected) = (EncoderAddress::truncate(5), Expected::new(Layout::Abs40, Command::Abs40));
    assert_eq!(expected.from_address(ea).from_address(ea), expected.from_address(ea));
    let of = crate::bus::Addresses::NONE.with(ea);
    assert_eq!(of.with(ea), of);
    let (status, alarms) = (EncoderStatus::all(), crate::Alm::all());
    let tolerated = crate::Tolerated::NOTHING.status(status).alarms(alarms);
    assert_eq!(tolerated.status(status).alarms(alarms), tolerated);
}
