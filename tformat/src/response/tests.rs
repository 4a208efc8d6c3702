use super::*;
use crate::request::tests::requests;
use crate::status::Almc;
use nrz_line::BitOrder;
use proptest::prelude::*;
use std::vec::Vec;

pub(crate) fn fulls() -> impl Strategy<Value = AllData> {
    (any::<[u8; 3]>(), any::<u32>(), any::<u32>()).prop_map(|([sf, enid, almc], abs, abm)| AllData {
        sf: StatusField::from_bits_retain(sf),
        abs: Abs::truncate(abs),
        enid,
        abm: Abm::truncate(abm),
        almc: Almc::from_bits_retain(almc),
    })
}

/// A request and a response that a sound encoder may give to it.
pub(crate) fn exchanges() -> impl Strategy<Value = (Request, Response)> {
    (requests(), fulls(), any::<bool>()).prop_map(|(request, full, busy)| (request, answer(request, full, busy)))
}

/// As [`exchanges`], with the information bits of SF at 0, as they are documented.
pub(crate) fn plain_exchanges() -> impl Strategy<Value = (Request, Response)> {
    let plain =
        fulls().prop_map(|data| AllData { sf: data.sf.intersection(StatusField::from_bits_retain(0xf0)), ..data });
    (requests(), plain, any::<bool>()).prop_map(|(request, data, busy)| (request, answer(request, data, busy)))
}

/// The response to `request` of an encoder that knows `full`.
fn answer(request: Request, full: AllData, busy: bool) -> Response {
    let single = SingleTurn { sf: full.sf, abs: full.abs };
    match request {
        Request::ReadSingleTurn => Response::ReadSingleTurn(single),
        Request::ReadMultiTurn => Response::ReadMultiTurn(MultiTurn { sf: full.sf, abm: full.abm }),
        Request::ReadEncoderId => Response::ReadEncoderId(Identification { sf: full.sf, enid: full.enid }),
        Request::ReadAll => Response::ReadAll(full),
        Request::WriteEeprom { adf, edf } => {
            Response::WriteEeprom(Memory { adf: Adf::answered(adf.address(), busy), edf })
        }
        Request::ResetErrors => Response::ResetErrors(single),
        Request::SetSingleTurnZero => Response::SetSingleTurnZero(single),
        Request::ResetTurnsAndErrors => Response::ResetTurnsAndErrors(single),
        Request::ReadEeprom { adf } => {
            Response::ReadEeprom(Memory { adf: Adf::answered(adf.address(), busy), edf: full.enid })
        }
    }
}

/// The published log of a TS5700N8401.
const LOGGED: [u8; 11] = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];

#[test]
fn a_logged_answer_in_every_form() {
    let full = AllData::parse(&LOGGED).unwrap();
    assert_eq!((full.abs.get(), full.enid, full.abm.get()), (3_915_817, 23, 0));
    assert_eq!((full.sf.bits(), full.almc.bits()), (0x20, 0xc8));
    assert!(full.sf.agrees_with(full.almc));
    assert_eq!(full.emit(), LOGGED);
    for order in [BitOrder::LsbFirst, BitOrder::MsbFirst] {
        assert_eq!(AllData::parse_line(&full.emit_line(order), order), Ok(full));
    }
}

proptest! {
    #[test]
    fn bytes_and_line_round_trip((request, response) in exchanges()) {
        let frame = response.emit();
        prop_assert_eq!(Response::parse(request, frame.as_bytes()), Ok(response));
        prop_assert_eq!(Response::parse_line(request, frame.line()), Ok(response));
        prop_assert_eq!(frame.fields(), request.data_id().response_fields());
        let fits = Request::answered_by(frame.as_bytes()).unwrap();
        prop_assert_eq!(Response::parse(fits, frame.as_bytes()), Ok(response));
    }

    #[test]
    fn bytes_after_the_response_are_left_alone((request, response) in exchanges(), tail: [u8; 4]) {
        let bytes = [response.emit().as_bytes(), &tail].concat();
        prop_assert_eq!(Response::parse(request, &bytes), Ok(response));
        let line = response.emit().line();
        let tail = u128::from(u32::from_le_bytes(tail) & 0x3ffff);
        let longer = Window::from_bits(line.bits() | tail << line.len(), line.len() + 18).unwrap();
        prop_assert_eq!(Response::parse_line(request, longer), Ok(response));
    }

    #[test]
    fn accepted_bytes_are_what_it_would_emit(request in requests(), mut bytes in prop::collection::vec(any::<u8>(), 11)) {
        let (cf, last) = (request.data_id().control_field().get(), usize::from(request.data_id().response_fields()) - 1);
        bytes[0] = cf;
        bytes[last] = crate::crc(&bytes[..last]);
        if let Ok(response) = Response::parse(request, &bytes) {
            let frame = response.emit();
            prop_assert_eq!(frame.as_bytes(), &bytes[..=last]);
        }
    }

    /// Every single wrong bit of the line is refused, by the check that covers it.
    #[test]
    fn single_flips_on_the_line((request, response) in exchanges()) {
        let line = response.emit().line();
        for at in 0..line.len() {
            let bad = Window::from_bits(line.bits() ^ 1 << at, line.len()).unwrap();
            let error = Response::parse_line(request, bad).unwrap_err();
            let field = (at / 10) as u8;
            let right = match (field, at % 10) {
                (_, 0) => error == Error::StartBit { field },
                (_, 9) => error == Error::Delimiter { field },
                (0, 1..=3) => matches!(error, Error::SinkCode { .. }),
                (0, _) => matches!(error, Error::Parity { .. }),
                _ => matches!(error, Error::Crc { .. }),
            };
            prop_assert!(right, "bit {}: {:?}", at, error);
        }
    }

    #[test]
    fn truncations((request, response) in exchanges()) {
        let frame = response.emit();
        let (bytes, want) = (frame.as_bytes(), frame.fields());
        for got in 0..want {
            let error = Err(Error::Truncated { got: got.into(), want: want.into() });
            prop_assert_eq!(Response::parse(request, &bytes[..usize::from(got)]), error);
            for bits in 0..10 {
                let short = Window::from_bits(frame.line().bits(), u32::from(got) * 10 + bits).unwrap();
                prop_assert_eq!(Response::parse_line(request, short), error);
            }
        }
    }

    /// An ID 3 frame to another request is a refusal, once it is complete and sound.
    #[test]
    fn rejections(request in requests(), full in fulls()) {
        prop_assume!(request != Request::ReadAll);
        let bytes = full.emit();
        let rejected = Err(Error::Rejected { sf: full.sf });
        prop_assert_eq!(Response::parse(request, &bytes), rejected);
        prop_assert_eq!(Response::parse_line(request, Frame::of11(bytes).line()), rejected);
        for got in 1..11_u8 {
            let cut = Response::parse(request, &bytes[..usize::from(got)]);
            prop_assert_eq!(cut, Err(Error::Truncated { got: got.into(), want: 11 }));
        }
        let mut bad = bytes;
        bad[5] ^= 4;
        let damaged = matches!(Response::parse(request, &bad), Err(Error::Crc { .. }));
        prop_assert!(damaged);
    }

    #[test]
    fn answers_to_other_requests((request, response) in exchanges(), other in requests()) {
        prop_assume!(request.data_id() != other.data_id() && response.data_id() != DataId::ReadAll);
        let error = Response::parse(other, response.emit().as_bytes());
        let (got, want) = (request.data_id().control_field().get(), other.data_id().control_field().get());
        prop_assert_eq!(error, Err(Error::CfMismatch { got, want }));
    }

    #[test]
    fn eeprom_echo(adf: u8, edf: u8, other: u8) {
        let (adf, other_adf) = (Adf::of(Adf::from_bits(adf).address()), Adf::of(Adf::from_bits(other).address()));
        let write = Request::WriteEeprom { adf, edf };
        let address = Response::parse(write, Response::WriteEeprom(Memory { adf: other_adf, edf }).emit().as_bytes());
        prop_assert_eq!(address.is_ok(), adf == other_adf);
        if adf != other_adf {
            let (got, want) = (other_adf.bits(), adf.bits());
            prop_assert_eq!(address, Err(Error::AddressMismatch { got, want }));
        }
        let data = Response::parse(write, Response::WriteEeprom(Memory { adf, edf: other }).emit().as_bytes());
        prop_assert_eq!(data.err(), (other != edf).then_some(Error::DataMismatch { got: other, want: edf }));
        // A busy memory did not write; its data byte is not compared.
        let busy = Memory { adf: Adf::of(adf.address()).with_busy(), edf: other };
        prop_assert_eq!(Response::parse(write, Response::WriteEeprom(busy).emit().as_bytes()), Ok(Response::WriteEeprom(busy)));
    }
}

/// Damage that the XOR cannot see is accepted: the limit is documented, not hidden.
#[test]
fn what_the_check_field_cannot_see_is_accepted() {
    let mut two_bits = LOGGED;
    two_bits[2] ^= 1;
    two_bits[3] ^= 1;
    assert_eq!(AllData::parse(&two_bits).map(|f| f.abs.get()), Ok(0x3b_c029 ^ 0x101));
    let all_ones: Vec<u8> = std::vec![0xff; 6];
    assert_eq!(Response::parse(Request::ReadSingleTurn, &all_ones), Err(Error::SinkCode { cf: 0xff }));
}

/// A control field without the sink code, whose bits are none of those that are wanted, and the start of a refusal.
#[test]
fn a_line_with_another_first_field_is_refused() {
    let parse = |bytes: &[u8]| Response::parse_line(Request::ReadSingleTurn, Frame::new(bytes).unwrap().line());
    assert!(
        matches!(parse(&[0x00, 1, 2, 3, 4, 4]), Err(Error::SinkCode { .. })),
        "{:?}",
        parse(&[0x00, 1, 2, 3, 4, 4])
    );
    assert_eq!(parse(&[CF3]), Err(Error::Truncated { got: 1, want: 11 }));
}

/// Two wrong bits of which one is a start bit or a delimiter: neither hides the other.
#[test]
fn no_wrong_framing_is_hidden_by_another_wrong_bit() {
    let full = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];
    let cases: [(Request, &[u8]); 3] = [
        (Request::ReadAll, &full),
        (Request::ReadSingleTurn, &[0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37]),
        (Request::ReadEncoderId, &[0x92, 0x00, 0x17, 0x85]),
    ];
    for (request, bytes) in cases {
        let line = Frame::new(bytes).unwrap().line();
        assert!(Response::parse_line(request, line).is_ok());
        for framing in (0..line.len()).filter(|bit| matches!(bit % 10, 0 | 9)) {
            for other in (0..line.len()).filter(|bit| *bit != framing) {
                let bad = Window::from_bits(line.bits() ^ 1 << framing ^ 1 << other, line.len()).unwrap();
                let error = Response::parse_line(request, bad).unwrap_err();
                let named = matches!(error, Error::StartBit { .. } | Error::Delimiter { .. } | Error::Truncated { .. });
                assert!(named, "{request}, bits {framing} and {other}: {error}");
            }
        }
    }
}
