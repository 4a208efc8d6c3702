//! A tap on the line: what the published firmware sends, taken apart with the streaming parsers.
//!
//! The recording is made here: DISCOVERY on its way back past two devices, a cycle of the IO exchange, and the frame that a
//! published device would send if its routine were called.
//!
//! `cargo run -p sorte-proto --example tap`

use core::error::Error as AnyError;

use nom::Parser;
use sorte_proto::Place;
use sorte_proto::cut_through::Rewriter;
use sorte_proto::stream::{device_frame, long_frame, master_frame, preamble};
use sorte_proto::{
    DeviceAddress, DeviceFrame, Discovery, DiscoveryView, Entry, Error, FrameType, Member, Network, Preamble,
    PublishedDeviceFrame, Status, emit_master_frame_into,
};

fn recording() -> Result<Vec<u8>, Error> {
    let mut discovery = Discovery::published_request(Place::Last).emit();
    for adds in [Status::empty(), Status::LAST] {
        Rewriter::discovery(Entry::STOCK, adds).pass(&mut discovery)?;
    }
    let mut wire = Preamble::Long.bytes().to_vec();
    wire.extend(discovery);
    let mut master = [0; 21];
    emit_master_frame_into(&[7; 16], 40_500, &mut master)?;
    wire.extend(Preamble::Short.bytes());
    wire.extend(master);
    let mut device = [0; 6];
    DeviceFrame { address: DeviceAddress::FIRST, status: Status::empty(), payload: [0; 3] }.emit_into(&mut device)?;
    wire.extend(Preamble::Short.bytes());
    wire.extend(device);
    Ok(wire)
}

fn main() -> Result<(), Box<dyn AnyError>> {
    let wire = recording()?;
    let (rest, ((), frame)) =
        (preamble::<Error>, long_frame).parse(&wire).map_err(|error| format!("start-up: {error:?}"))?;
    println!("{frame}; type nibble {:x}h", frame.status().type_nibble());
    if frame.frame_type() == FrameType::Discovery {
        for Member { assignment: place, lengths: entry } in Network::new(DiscoveryView::of(frame)?)?.members() {
            println!("  device {}: {} bytes out from {}", place.address, entry.output, place.out_offset);
        }
    }

    let (rest, ((), view)) =
        (preamble::<Error>, master_frame(16)).parse(rest).map_err(|error| format!("master: {error:?}"))?;
    println!("{view}");
    // Nothing else checks the time stamp: it must be where the cycle is.
    for expected in [40_490, 36_500] {
        match view.check_time_stamp(expected, 100) {
            Ok(()) => println!("  stamped at its time, {expected} ns or nearly"),
            Err(error) => println!("  {error}"),
        }
    }
    let (rest, ((), view)) =
        (preamble::<Error>, device_frame(3)).parse(rest).map_err(|error| format!("device: {error:?}"))?;
    println!("{view}; {} bytes left", rest.len());

    // What the published routine builds: no check that could be made.
    let frame = PublishedDeviceFrame { address: DeviceAddress::FIRST, status: Status::LAST, drv8711_status: 0 };
    let [address, status, driver, zero] = frame.emit_without_crc();
    println!("{}", PublishedDeviceFrame::parse_unchecked(&[address, status, driver, zero, 0x5a])?);
    Ok(())
}
