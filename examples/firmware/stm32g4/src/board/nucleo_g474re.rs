//! NUCLEO-G474RE: MB1367, UM2505. No power stage of its own.

board! {
    "NUCLEO-G474RE", crystal 24_000_000 Hz,
    uart_tx: PB3 "DI of T-Format, SCK of A-format" at "D3",
    ro: PB4 "RO" at "D5",
    spi_mosi: PB5 "DI of A-format" at "D4",
    de: PA1 "DE and /RE" at "A1",
    enable: PA5 "ENABLE" at "D13, LD2",
}
