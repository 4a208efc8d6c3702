use std::string::{String, ToString};
use std::vec::Vec;

use super::*;
use crate::address::DeviceAddress;
use crate::cut_through::Rewriter;
use crate::delay_req::DelayReq;
use crate::discovery::{Discovery, Entry};
use crate::exchange::{DeviceFrame, emit_master_frame_into};
use crate::param::{Param, Parameters};
use crate::place::Place;
use crate::preamble::Preamble;
use crate::status::Status;
use crate::sync::Sync;

/// DISCOVERY behind one device.
fn answer() -> Discovery {
    let mut bytes = Discovery::request(Place::Last).emit();
    Rewriter::discovery(Entry::STOCK, Status::LAST).pass(&mut bytes).unwrap();
    Discovery::parse(&bytes).unwrap()
}

/// As the master and the devices of the published firmware send them.
fn start_up() -> [Vec<u8>; 4] {
    [
        answer().emit().to_vec(),
        Param::request(Parameters::STOCK, Place::Inner).emit().to_vec(),
        DelayReq::of_master(Place::Inner).emit().to_vec(),
        Sync::of_master(500, 76, Place::Inner).emit().to_vec(),
    ]
}

fn exchange() -> [Vec<u8>; 2] {
    let (mut master, mut device) = ([0; 21], [0; 6]);
    emit_master_frame_into(&[0; 16], 500, &mut master).unwrap();
    DeviceFrame { address: DeviceAddress::FIRST, status: Status::LAST, payload: [0; 3] }
        .emit_into(&mut device)
        .unwrap();
    [master.to_vec(), device.to_vec()]
}

/// Kind, findings and cause.
fn said(during: During, bytes: &[u8]) -> (&'static str, String, Option<Cause>) {
    let report = inspect(during, bytes);
    (report.kind().name(), report.findings().to_string(), report.cause())
}

#[test]
fn sound_frames_have_values_and_no_findings() {
    let names = ["DISCOVERY", "PARAM", "DELAY_REQ", "SYNC"];
    for (name, bytes) in names.into_iter().zip(start_up()) {
        assert_eq!(said(During::StartUp, &bytes), (name, "-".into(), None));
        let report = inspect(During::StartUp, &bytes);
        assert!(report.error().is_none() && report.to_string().starts_with(name), "{report}");
        let kind = match report.frame().unwrap() {
            Frame::Discovery(_) => "DISCOVERY",
            Frame::Param(_) => "PARAM",
            Frame::DelayReq(_) => "DELAY_REQ",
            Frame::Sync(_) => "SYNC",
            other => panic!("{other}"),
        };
        assert_eq!(kind, name);
    }
    let texts = ["master, 16 output bytes at 500, STATUS 30h", "device 1, [00, 00, 00], STATUS LAST"];
    for ((name, text), bytes) in ["master", "device"].into_iter().zip(texts).zip(exchange()) {
        assert_eq!(said(During::Exchange, &bytes), (name, "-".into(), None));
        assert_eq!(inspect(During::Exchange, &bytes).to_string(), text);
    }
}

#[test]
fn what_network_cards_do_to_a_frame() {
    for bytes in start_up() {
        let (len, sound) = (bytes.len(), inspect(During::StartUp, &bytes).frame());
        let texts = |report: Report<'_>| (report.cause(), report.frame().map(|frame| frame.to_string()));
        let want = sound.map(|frame| frame.to_string());
        assert_eq!(texts(inspect(During::StartUp, &bytes[..len - 4])), (Some(Cause::FcsMissing), want.clone()));
        let padded = [&bytes[..], &[0; 9]].concat();
        assert_eq!(texts(inspect(During::StartUp, &padded)), (Some(Cause::Padded { bytes: 9 }), want.clone()));
        let wire = [Preamble::Middle.bytes(), &bytes].concat();
        assert_eq!(texts(inspect(During::StartUp, &wire)), (Some(Cause::PreambleLeft), want.clone()));
        let inverted: Vec<u8> = bytes.iter().map(|byte| !byte).collect();
        assert_eq!(texts(inspect(During::StartUp, &inverted)), (Some(Cause::Inverted), None));
        assert_eq!(said(During::StartUp, &bytes[..len - 3]).1, "truncated bad_fcs");
        let cut = inspect(During::StartUp, &bytes[..len - 3]);
        assert_eq!(texts(cut), (Some(Cause::Cut { missing: 3 }), None));
        let mut damaged = bytes.clone();
        damaged[len - 6] ^= 4;
        // DELAY_REQ has its TYPE there.
        let cause = if len == 8 { None } else { Some(Cause::Disturbed) };
        assert_eq!(inspect(During::StartUp, &damaged).cause().filter(|cause| *cause == Cause::Disturbed), cause);
        assert_eq!(said(During::Exchange, &bytes).2, Some(Cause::StartUpFrame));
    }
    let mut padded = start_up()[3][..10].to_vec();
    padded.resize(60, 0);
    assert_eq!(said(During::StartUp, &padded).2, Some(Cause::FcsMissingAndPadded));
    padded[59] = 1;
    assert_eq!(said(During::StartUp, &padded), ("SYNC", "bad_fcs too_long".into(), Some(Cause::Disturbed)));
}

#[test]
fn every_fault_of_a_long_header_frame_is_found() {
    let bytes = [254, 0, 11, 0, 1, 2, 3, 4, 5];
    let all = "bad_fcs wrong_destination unknown_type";
    assert_eq!(said(During::StartUp, &bytes), ("?", all.into(), Some(Cause::NotSorte)));
    assert_eq!(inspect(During::StartUp, &bytes).error().map(Error::class), Some(ErrorClass::BadFcs));
    assert_eq!(said(During::StartUp, &bytes[..3]), ("?", "truncated".into(), Some(Cause::NotSorte)));
    assert_eq!(said(During::StartUp, &[]), ("?", "truncated".into(), Some(Cause::NotSorte)));
    for frame in exchange() {
        assert_eq!(said(During::StartUp, &frame).2, Some(Cause::ExchangeFrame));
    }
}

/// Four bytes a device of up to four devices may be the CNC machine; nothing else is taken for it.
#[test]
fn slices_of_the_cnc_machine() {
    for (len, slices) in [(0, Some(0)), (4, Some(1)), (6, None), (16, Some(4)), (20, None)] {
        let output: Vec<u8> = (1..=len).collect();
        let mut bytes = std::vec![0; usize::from(len) + 5];
        emit_master_frame_into(&output, 500, &mut bytes).unwrap();
        let report = inspect(During::Exchange, &bytes);
        let got: Option<Vec<_>> = report.frame().unwrap().cnc_slices().map(Iterator::collect);
        assert_eq!(got.as_ref().map(Vec::len), slices, "{len}");
        let first = got.and_then(|slices| slices.first().copied());
        assert_eq!(first.map(|slice| slice.command), (slices > Some(0)).then_some(0x0403));
    }
    let [_, device] = exchange();
    assert!(inspect(During::Exchange, &device).frame().unwrap().cnc_slices().is_none());
}

/// 254 devices fit, 255 do not; the length of a frame has a name.
#[test]
fn the_longest_line_and_wrong_lengths() {
    let mut frame = Discovery { count: 254, ..Discovery::request(Place::Last) };
    assert_eq!(said(During::StartUp, &frame.emit()).1, "-");
    frame.count = 300;
    assert_eq!(said(During::StartUp, &frame.emit()).1, "too_many_devices");
    for bytes in start_up() {
        let mut long = [&bytes[..], &[7]].concat();
        crate::frame::refresh_fcs(&mut long);
        assert_eq!(said(During::StartUp, &long).1, "too_long");
    }
}

/// The shortest frames that can have been one of the exchange: a header and a checksum are none.
#[test]
fn the_shortest_disturbed_frames() {
    // Master: header, CRC-8 and stamp are five bytes; device: header and CRC-8 are three.
    let cause = |bytes: &[u8]| said(During::Exchange, bytes).2;
    assert_eq!(cause(&[0, 0x30, 1, 2, 3]), None);
    assert_eq!(cause(&[0, 0x30, 1, 2, 3, 4]), Some(Cause::Disturbed));
    assert_eq!(cause(&[1, 0, 0]), None);
    assert_eq!(cause(&[1, 0, 7, 0]), Some(Cause::Disturbed));
}

/// A decoder gives these values; only an inspection says that they cannot be.
#[test]
fn contents_that_cannot_be_are_findings() {
    let mut frame = answer();
    frame.output_total = 5;
    let bytes = frame.emit();
    let report = inspect(During::StartUp, &bytes);
    assert_eq!((report.error(), report.findings().to_string()), (None, "table_mismatch".into()));
    assert_eq!(report.to_string(), "DISCOVERY 1 devices, in 4, out 5, STATUS LAST STATE_CHANGE, with table_mismatch");
    frame.count = 255;
    assert_eq!(said(During::StartUp, &frame.emit()), ("DISCOVERY", "too_many_devices".into(), None));
    let mut bytes = [0; 21];
    for (word, findings) in
        [(3990_u16, "-"), (3991, "reserved_pto_value"), (0x7fff, "-"), (0xffff, "reserved_pto_value")]
    {
        let mut output = [0; 16];
        output[4..6].copy_from_slice(&word.to_le_bytes());
        emit_master_frame_into(&output, 500, &mut bytes).unwrap();
        assert_eq!(said(During::Exchange, &bytes), ("master", findings.into(), None));
        // Of twenty bytes nobody knows what they are.
        let mut long = [0; 25];
        emit_master_frame_into(&[&output[..], &[0; 4]].concat(), 500, &mut long).unwrap();
        assert_eq!(said(During::Exchange, &long), ("master", "-".into(), None));
    }
}

#[test]
fn a_disturbed_frame_of_the_exchange() {
    for mut bytes in exchange() {
        bytes[3] ^= 1;
        let report = inspect(During::Exchange, &bytes);
        assert_eq!((report.findings().to_string(), report.cause()), ("bad_crc8".into(), Some(Cause::Disturbed)));
        assert!(report.frame().is_none());
        bytes[1] = 0xff;
        assert_eq!(inspect(During::Exchange, &bytes).cause(), None);
    }
}
