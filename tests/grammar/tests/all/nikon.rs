use core::convert::Infallible;

use nikon_aformat::device::Device;
use nikon_aformat::master::{Line, Reset};
use nikon_aformat::{
    BitOrder, BitRate, Command, EncoderAddress, EncoderStatus, Error, Evidence, Expected, Layout, Operation,
    RawResponse, Request, Resolution, Response, Window,
};

const EA: EncoderAddress = EncoderAddress::ZERO;

/// Command 0 answered by the encoder at address 0, sampled MSB first: no status, turn 5, 4711 counts.
const SOUND: [u16; 4] = [0x2000, 0xe648, 0x5000, 0x0003];
const DAMAGED: [u16; 4] = [0x2000, 0xe648, 0x5000, 0x0002];

fn request() -> Request {
    Request::new(EA, Operation::Abs40)
}

fn resolution() -> Resolution {
    Resolution::new(17, 16).unwrap()
}

fn expected() -> Expected {
    request().expected(resolution())
}

fn raw(words: [u16; 4]) -> RawResponse {
    RawResponse::from_words(Layout::Abs40, &words, BitOrder::MsbFirst).unwrap()
}

fn heard() -> Vec<Option<u16>> {
    raw(SOUND).contents().iter().copied().map(Some).collect()
}

fn window(words: [u16; 4]) -> Window {
    raw(words).line()
}

fn evidence() -> Evidence {
    Evidence::of(Response::parse(&expected(), &raw(SOUND)).unwrap(), resolution(), 5_000_000_000)
}

#[test]
fn the_words_are_what_they_are_said_to_be() {
    let sample = evidence().at(5_000_000_000, nikon_aformat::Policy::new(0)).unwrap();
    assert_eq!((sample.single_turn(), sample.turns()), (4711, Some(5)));
    assert_eq!(Response::parse(&expected(), &raw(SOUND)).unwrap().es(), Some(EncoderStatus::empty()));
    assert_eq!(request().command(), Command::Abs40);
}

decode! { nikon_aformat::Response(&Expected, &RawResponse); with (&expected()); sound &raw(SOUND); damaged &raw(DAMAGED) => "crc" }
encode! { nikon_aformat::Request = request() }
code! { nikon_aformat::Command: 3; unknown 31 }
exchange! {
    nikon_aformat::Transaction::start(request = request(), resolution = resolution(), line = Line::new(BitRate::Mbit4));
    heard &heard(); "&[Option<u16>]", at 60_000
}
procedure! { nikon_aformat::Reset = Reset::clear_status(EA); lost Error::NoResponse }
feedback! { nikon_aformat: evidence(), sampled at 5_000_000_000; "`exchange.evidence(resolution)`" }
device! {
    nikon_aformat::"Device::<BANKS>::new(ea, resolution, rate)" = Device::<1>::new(EA, resolution(), BitRate::Mbit4);
    with Behaviour::new().with_response_delay_ns(4_000);
    heard |at| (request().emit().units().as_slice(), at); "&[Option<u16>], end_ns)`, of a request `emit().units().as_slice()"
}
inspect! {
    nikon_aformat::inspect(request = request(), resolution = resolution(); line);
    damaged window(DAMAGED) => "crc"
}
log! { nikon_aformat: Request, Response, nikon_aformat::master::Exchange, Command }
counters! { nikon_aformat }
