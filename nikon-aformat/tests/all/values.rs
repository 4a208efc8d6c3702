//! Names, numbers and what a response says of itself, each with literals of its own.

use nikon_aformat::device::{Behaviour, Device, Fault};
use nikon_aformat::inspect::inspect;
use nikon_aformat::{
    Alm, BitRate, Body, Command, Data, EncoderAddress, EncoderStatus, Layout, Operation, PmAlm, Request, RequestFrame,
    Resolution, Response, Temperature, TypeWord, U10, U17, U19, U24, U40, UserAddress,
};

const EA: EncoderAddress = EncoderAddress::truncate(3);

fn twenty() -> Resolution {
    Resolution::new(20, 16).unwrap()
}

fn said(es: u8, data: Data) -> Response {
    Response::new(EA, Command::Status, EncoderStatus::from_bits_truncate(es), data)
}

#[test]
fn rates_and_times() {
    assert_eq!(BitRate::ALL.map(BitRate::bits_per_second), [2_500_000, 4_000_000, 6_666_667, 8_000_000, 16_000_000]);
    // A request of 18 bits, a response of 72, at 250 ns; a turn-around of 4 us; 10 us before the next request.
    assert_eq!(BitRate::Mbit4.min_cycle_ns(Layout::Abs40, 1, 4_000), 90 * 250 + 4_000 + 10_000);
}

#[test]
fn an_angle_with_single_precision() {
    let degrees = [0, 0x2_0000, 0x4_0000, 0xc_0000].map(|at| twenty().degrees_f32(at));
    assert_eq!(degrees.map(f32::to_bits), [0.0_f32, 45.0, 90.0, 270.0].map(f32::to_bits));
}

#[test]
fn names() {
    assert_eq!(
        [Layout::Abs40, Layout::Abs24High, Layout::EepromBank, Layout::Coefficient].map(Layout::name),
        ["ABS40", "ABS24H", "EEPROM_BANK", "VELCOEF"]
    );
    let (address, coefficient) = (UserAddress::new(1).unwrap(), U19::truncate(1));
    for (operation, name) in [
        (Operation::EepromReadBank { bank: 1, address: 2 }, "EEPROM_READ_BANK"),
        (Operation::EepromWriteBank { bank: 1, address: 2, data: 3 }, "EEPROM_WRITE_BANK"),
        (Operation::CoefficientRead, "VELCOEF_READ"),
        (Operation::CoefficientWrite { coefficient }, "VELCOEF_WRITE"),
        // These share their codes.
        (Operation::EepromRead { address: 2 }, Command::EepromRead.name()),
        (Operation::EepromWrite { address, data: 3 }, Command::EepromWrite.name()),
        (Operation::IdRead1, Command::IdRead1.name()),
    ] {
        assert_eq!(operation.name(), name);
    }
    assert_ne!(Command::EepromRead.name(), Command::EepromWrite.name());
}

/// Commands 21 and 22 only.
#[test]
fn two_commands_have_short_information() {
    let short: Vec<_> =
        (0..31).filter(|code| Command::from_code(*code).is_some_and(Command::has_short_information)).collect();
    assert_eq!(short, [21, 22]);
}

/// Commands 0, 1 and 3 to encoder 0: their words as vendors print them, first bit in bit 15, the check in bits 2 to 0.
#[test]
fn request_frames() {
    for (code, word) in [(0, 0x4000_u16), (1, 0x4081), (3, 0x40c4)] {
        let frame = RequestFrame::from_content(word.reverse_bits()).unwrap();
        assert_eq!((frame.code(), u16::from(frame.crc3()), u16::from(frame)), (code, word & 7, word.reverse_bits()));
    }
    let write = Operation::EepromWrite { address: UserAddress::new(0x42).unwrap(), data: 0x1234 };
    let frames = Request::new(EA, write).emit();
    let contents: Vec<_> = frames.as_slice().iter().map(|frame| Some(frame.content())).collect();
    assert!(contents.len() == 4 && frames.units().as_slice() == contents);
}

#[test]
fn what_a_response_says_of_itself() {
    let short = |es_any| Response { ea: EA, body: Body::Abs17 { es_any, abs: U17::truncate(1) } };
    let status = Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() };
    assert_eq!(
        [short(false), short(true), said(0, status), said(4, status)].map(Response::has_status),
        [false, true, false, true]
    );
    let (temperature, abs, velocity) = (Temperature(U10::truncate(0x155)), U24::truncate(1), -70_000);
    for (data, want) in [
        (Data::Temperature { temperature }, (Some(temperature), None)),
        (Data::Abs24Temp { abs, temperature }, (Some(temperature), None)),
        (Data::Abs24Vel { abs, velocity }, (None, Some(velocity))),
        (Data::Abs24VelAcc { abs, velocity, acceleration: 1 }, (None, Some(velocity))),
        (Data::Abs40Vel { abs: U40::truncate(1), velocity }, (None, Some(velocity))),
        (status, (None, None)),
    ] {
        assert_eq!((said(0, data).temperature(), said(0, data).velocity()), want, "{data:?}");
    }
}

#[test]
fn how_a_battery_is_connected() {
    use nikon_aformat::Battery;
    let battery = [0, 1, 2, 3].map(|code| TypeWord(code << 5).battery());
    assert_eq!(battery, [Battery::None, Battery::Separate, Battery::Common, Battery::Unknown(3)]);
}

/// The encoder as it is made: what it answers, on the line and as it left it, and what an inspection shows of its check.
#[test]
fn an_answer_on_the_line() {
    assert_eq!(Behaviour::default(), Behaviour::new());
    let request = Request::new(EA, Operation::Abs40);
    let mut encoder = Device::<1>::new(EA, twenty(), BitRate::Mbit4);
    let answer = encoder.answer(request, 1_000_000).unwrap();
    assert_eq!(answer.ea, EA);
    let sent = encoder.hear(request.emit().units().as_slice(), 2_000_000).unwrap();
    let contents: Vec<_> = sent.frames.contents().iter().copied().map(Some).collect();
    assert_eq!(sent.units().as_slice(), contents);
    let crc = inspect(request, twenty(), sent.line).crc().unwrap();
    assert_eq!(crc.got, crc.want);
    assert!(inspect(request, twenty(), sent.line.padded(80).unwrap().skip(20).unwrap()).crc().is_none());
    // A start bit that is 1, and a delimiter that is 0.
    for (at, now_ns) in [(18, 3_000_000), (35, 4_000_000)] {
        encoder.set_fault(Fault::FlipBit { at });
        let sent = encoder.hear(request.emit().units().as_slice(), now_ns).unwrap();
        let framed: Vec<_> = sent.units().as_slice().iter().map(Option::is_some).collect();
        assert_eq!(framed, [true, false, true, true], "{at}");
    }
    encoder.set_fault(Fault::Silent);
    assert_eq!(encoder.answer(request, 5_000_000), None);
}
