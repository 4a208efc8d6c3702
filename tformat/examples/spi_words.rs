//! T-Format through a shift register instead of a UART: `cargo run -p tformat --example spi_words`.
//!
//! TI's CLB designs clock requests out of an SPI and responses into it, in words of 10 or of 16 bits.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use tformat::spi::{parse_spi10, parse_spi16, spi10_words, spi16_words};
use tformat::{AllData, BitOrder, Request, Response, Window};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let request = Request::ReadAll;
    // Logged from a TS5700N8401.
    let data = AllData::parse(&[0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37])?;

    // Ten bits: one word a field.
    let sent: Vec<_> = spi10_words(&request.emit()).map(|word| format!("{word:03x}")).collect();
    let heard: Vec<_> = spi10_words(&Response::ReadAll(data).emit()).collect();
    println!("10 bits: {} -> {}", sent.join(" "), parse_spi10(request, &heard)?);

    // Sixteen bits: the stream of request, pause and response. The response begins at bit 18.
    let sent: Vec<_> = spi16_words(request).map(|word| format!("{word:04x}")).collect();
    let mut stream = [0xff; 16];
    let line = Window::read(&data.emit_line(BitOrder::MsbFirst), 0, 110, BitOrder::MsbFirst)?;
    line.write(&mut stream, 18, BitOrder::MsbFirst)?;
    let heard = stream.chunks(2).filter_map(|pair| pair.try_into().ok().map(u16::from_be_bytes)).collect::<Vec<_>>();
    println!("16 bits: {} -> {}", sent.join(" "), parse_spi16(request, &heard)?);
    assert_eq!(parse_spi16(request, &heard)?, Response::ReadAll(data));
    Ok(())
}
