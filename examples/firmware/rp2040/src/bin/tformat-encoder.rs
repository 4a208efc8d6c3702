//! A T-Format encoder at 2.5 Mbit/s whose shaft turns on by one with every answer.
//!
//! The answer has to begin 3 us after the request, and this processor needs longer to make one. So the answers to the four
//! read requests are made ahead, while the one before is sent; a request that has one only starts it. EEPROM accesses and
//! resets are answered when they are ready.
#![no_std]
#![no_main]

use core::fmt::Write;

use panic_halt as _;
use servowire_rp2040::board::Board;
use servowire_rp2040::port::Prepared;
use servowire_rp2040::programs::Rate;
use tformat::device::Device;
use tformat::{BitRate, Request, U24};

/// Cycles that the transmitter waits before a prepared answer: what the way through the processor leaves of 3 us.
const WAIT_CYCLES: u32 = 50;
/// A field that comes later than this is not of the request before.
const FIELD_GAP_NS: u64 = 8_000;
const ENCODER_ID: u8 = 0x17;

#[rp2040_hal::entry]
fn main() -> ! {
    let Board { mut console, mut clock, mut transmitter, mut receiver, .. } = Board::new(Rate::MBIT2_5, 8);
    let mut device = Device::<6>::new(ENCODER_ID, BitRate::Mbit2_5);
    let mut position = 0x12_3456;
    let mut answers = prepared(&mut device, &mut position);
    let (mut inside, mut last_ns) = (false, 0);
    let _ = writeln!(console, "T-Format encoder, 2.5 Mbit/s, {} requests prepared", answers.len());
    loop {
        let Some(unit) = receiver.take() else {
            inside = inside && clock.now_ns() - last_ns < FIELD_GAP_NS;
            continue;
        };
        let byte = unit.content as u8;
        let answer = answers.iter().find(|(cf, _)| !inside && unit.framed && *cf == byte);
        if let Some((_, answer)) = answer {
            transmitter.send(answer);
        }
        let sent = answer.is_some();
        last_ns = clock.now_ns();
        let reply = if unit.framed { device.byte(byte, last_ns) } else { device.framing_error(last_ns) };
        inside = reply.is_none();
        if let Some(reply) = reply.filter(|_| !sent) {
            transmitter.send(&Prepared::new(reply.line.bits(), reply.line.len(), 0));
        }
        if sent {
            answers = prepared(&mut device, &mut position);
        }
    }
}

/// The shaft moves, and the answers to the read requests are made anew.
fn prepared(device: &mut Device<6>, position: &mut u32) -> [(u8, Prepared); 4] {
    *position += 1;
    device.set_position(U24::truncate(*position), U24::truncate(7));
    [Request::Id0, Request::Id1, Request::Id2, Request::Id3].map(|request| {
        let cf = request.emit().as_bytes().first().copied().unwrap_or_default();
        let answer = device.answer(request, 0).emit().line();
        (cf, Prepared::new(answer.bits(), answer.len(), WAIT_CYCLES))
    })
}
