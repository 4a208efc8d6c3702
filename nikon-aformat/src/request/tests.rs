use super::*;
use proptest::prelude::*;
use std::vec::Vec;

/// One operation of each kind.
pub(crate) fn every(address: u8, bank: u8, data: u16, wide: u32) -> Vec<Operation> {
    let (id, coefficient) = (EncoderId::truncate(wide), U19::truncate(wide));
    let mut all: Vec<_> = Command::ALL.into_iter().filter_map(Operation::without_arguments).collect();
    all.extend([
        Operation::EepromRead { address },
        Operation::EepromWrite { address: UserAddress::new(address).unwrap_or_default(), data },
        Operation::IdWrite1 { id },
        Operation::IdWrite2 { id },
        Operation::SetAddress2 { id },
        Operation::EepromReadBank { bank, address },
        Operation::EepromWriteBank { bank, address, data },
        Operation::CoefficientRead,
        Operation::CoefficientWrite { coefficient },
    ]);
    all
}

pub(crate) fn requests() -> impl Strategy<Value = Request> {
    (0..8_u8, any::<prop::sample::Index>(), any::<(u8, u8, u16, u32)>()).prop_map(|(ea, which, (a, b, d, w))| {
        let all = every(a, b, d, w);
        Request::new(EncoderAddress::truncate(ea), all[which.index(all.len())])
    })
}

/// The command data frames of all 31 commands to all eight encoders, as published drivers send them.
#[test]
fn all_command_data_frames() {
    let to_encoder_0 = [
        0x4000, 0x4081, 0x4045, 0x40c4, 0x4027, 0x40a6, 0x4062, 0x40e3, 0x4016, 0x4097, 0x4053, 0x40d2, 0x4031, 0x40b0,
        0x4074, 0x40f5, 0x400b, 0x408a, 0x404e, 0x40cf, 0x402c, 0x40ad, 0x4069, 0x40e8, 0x401d, 0x409c, 0x4058, 0x40d9,
        0x403a, 0x40bb, 0x407f,
    ];
    for (command, word) in Command::ALL.into_iter().zip(to_encoder_0) {
        for ea in EncoderAddress::ALL {
            let cdf = RequestFrame::cdf(FrameCode::Fc0, ea, command.code());
            assert_eq!((cdf.ea(), cdf.code()), (ea, command.code()));
            if ea == EncoderAddress::ZERO {
                assert_eq!(cdf.word(BitOrder::MsbFirst), word);
            }
        }
    }
}

#[test]
fn every_operation_has_its_command() {
    for operation in every(1, 2, 3, 4) {
        let arguments = Operation::without_arguments(operation.command());
        let plain = operation.frame_code() == FrameCode::Fc0 && arguments.is_some();
        assert!(!plain || arguments == Some(operation));
    }
    assert_eq!(Command::ALL.into_iter().filter_map(Operation::without_arguments).count(), 26);
}

/// What no request begins with is refused: frame codes 1 and 2, code 31, frame code 3 with other commands.
#[test]
fn all_beginnings_are_judged() {
    for frame_code in FrameCode::MDF {
        for code in 0..32 {
            let cdf = RequestFrame::cdf(frame_code, EncoderAddress::ZERO, code);
            let got = Request::expected_frames(cdf);
            let refused = Error::FrameCode { frame: 0, got: frame_code.code(), want: 0 };
            match (frame_code, code) {
                (FrameCode::Fc0, 31) => assert_eq!(got, Err(Error::UnknownCommand { code })),
                (FrameCode::Fc0, _) | (FrameCode::Fc3, 13 | 14 | 16 | 18) => assert!(matches!(got, Ok(1..=5))),
                _ => assert_eq!(got, Err(refused)),
            }
        }
    }
}

#[test]
fn arguments_out_of_range() {
    let cdf = |fc, code| RequestFrame::cdf(fc, EncoderAddress::MAX, code);
    let write = [cdf(FrameCode::Fc0, 14), mdf0(1), mdf1(2), mdf2(0xf0)];
    assert_eq!(Request::parse(&write), Err(Error::AddressRange { got: 0xf0 }));
    let coefficient = [cdf(FrameCode::Fc3, 18), mdf0(0), mdf1(0), mdf2(8)];
    assert_eq!(Request::parse(&coefficient), Err(Error::DataRange { got: 0x8_0000 }));
}

proptest! {
    #[test]
    fn round_trip(request in requests(), tail in any::<u8>()) {
        let frames = request.emit();
        let frames = frames.as_slice();
        prop_assert_eq!(Request::parse(frames), Ok(request));
        prop_assert_eq!(Request::expected_frames(frames[0]).map(usize::from), Ok(frames.len()));
        let mut more = frames.to_vec();
        more.push(mdf2(tail));
        prop_assert_eq!(Request::parse(&more), Ok(request));
        for short in 0..frames.len() {
            let want = if short == 0 { 18 } else { frames.len() as u16 * 18 };
            let error = Error::Truncated { got: short as u16 * 18, want };
            prop_assert_eq!(Request::parse(&frames[..short]), Err(error));
        }
    }

    #[test]
    fn accepted_frames_are_what_it_would_emit(codes in prop::collection::vec((0..4_usize, any::<u8>()), 1..6)) {
        let frames: Vec<_> = codes.iter().map(|(k, b)| RequestFrame::mdf(FrameCode::MDF[*k], *b)).collect();
        if let Ok(request) = Request::parse(&frames) {
            let emitted = request.emit();
            prop_assert_eq!(emitted.as_slice(), &frames[..emitted.as_slice().len()]);
        }
    }

    #[test]
    fn lines_with_any_gap(request in requests(), gap in 0..300_u32, offset in 0..9_usize, lsb: bool) {
        let order = if lsb { BitOrder::LsbFirst } else { BitOrder::MsbFirst };
        let frames = request.emit();
        let mut bytes = [0; 200];
        let bits = frames.write_line(&mut bytes, offset, gap, order).unwrap();
        prop_assert_eq!(bits, frames.line_bits(gap));
        let mut at = offset;
        for (k, frame) in frames.as_slice().iter().enumerate() {
            if k > 0 {
                let idle = (0..gap as usize).all(|g| Window::read(&bytes, at + g, 1, order).unwrap().bits() == 1);
                prop_assert!(idle);
                at += gap as usize;
            }
            let line = Window::read(&bytes, at, 18, order).unwrap();
            prop_assert_eq!(RequestFrame::from_line(line), Ok(*frame));
            at += 18;
        }
        prop_assert_eq!(at, offset + bits as usize);
        let mut short = std::vec![0x5a; (offset + bits as usize).div_ceil(8) - 1];
        let before = short.clone();
        prop_assert!(frames.write_line(&mut short, offset, gap, order).is_err());
        prop_assert_eq!(short, before);
    }
}

/// A buffer of just the bits of a request is long enough for it.
#[test]
fn a_request_fits_where_it_just_fits() {
    let frames = Request::new(EncoderAddress::ZERO, Operation::EepromRead { address: 7 }).emit();
    for gap_bits in [0, 4] {
        let bits = 36 + gap_bits;
        let mut bytes = [0; 5];
        assert_eq!(frames.write_line(&mut bytes, (40 - bits) as usize, gap_bits, BitOrder::LsbFirst), Ok(bits));
    }
    assert!(frames.write_line(&mut [0; 5], 1, 4, BitOrder::LsbFirst).is_err());
}

/// Memory frames in another order are no request: MDF0 has frame code 1, MDF1 2, MDF3 0 and MDF2 3.
#[test]
fn memory_frames_in_another_order_are_refused() {
    let write = Request::new(EncoderAddress::ZERO, Operation::EepromWriteBank { bank: 1, address: 2, data: 3 }).emit();
    let mut frames = write.as_slice().to_vec();
    frames.swap(1, 2);
    assert_eq!(Request::parse(&frames), Err(Error::FrameCode { frame: 1, got: 2, want: 1 }));
}
