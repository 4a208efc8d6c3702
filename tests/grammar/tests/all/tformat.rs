use core::convert::Infallible;

use tformat::device::Device;
use tformat::master::{Line, Reset};
use tformat::{BitRate, Error, Request, Resolution, Response, Window};

/// The response to ID 3 of a TS5700N8401, without its alarms.
const ALL: [u8; 11] = [0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x05, 0x00, 0x00, 0x00, 0xda];

const DAMAGED: [u8; 11] = [0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x05, 0x00, 0x00, 0x00, 0xdb];

fn line() -> Line {
    Line::new(BitRate::Mbit2_5)
}

fn window(bytes: &[u8]) -> Window {
    tformat::Frame::new(bytes).unwrap().line()
}

fn evidence() -> tformat::Evidence {
    let response = Response::parse(Request::ReadAll, &ALL).unwrap();
    tformat::Evidence::of(response, Resolution::new(23, 16).unwrap(), 5_000_000_000)
}

decode! { tformat::Response(Request, &[u8]); with (Request::ReadAll); sound &ALL; damaged &DAMAGED => "crc" }
encode! { tformat::Request = Request::ReadAll }
code! { tformat::DataId: 3; unknown 4 }
exchange! { tformat::Transaction::start(request = Request::ReadAll, line = line()); heard &ALL; "&[u8]", at 55_000 }
procedure! { tformat::Reset = Reset::clear_errors(); lost Error::NoResponse { echo: false } }
feedback! { tformat: evidence(), sampled at 5_000_000_000; "`exchange.evidence(resolution)`" }
device! {
    tformat::"Device::<PAGES>::new(enid, rate)" = Device::<6>::new(0x17, BitRate::Mbit2_5);
    with Behaviour::new().with_response_delay_ns(5_000);
    heard |at| (&[0x1a], at); "&[u8], end_ns)"
}
inspect! { tformat::inspect(request = Request::ReadAll; line); damaged window(&DAMAGED) => "crc" }
log! { tformat: Request, Response, tformat::master::Exchange, tformat::DataId }
counters! { tformat }
