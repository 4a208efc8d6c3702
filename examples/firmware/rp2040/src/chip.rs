//! Code specific to the RP2040 and its board.

pub use rp2040_hal as hal;
use servowire_boards::{Board, Pin};

/// The crystal, Hz.
pub const CRYSTAL_HZ: u32 = 12_000_000;

/// The pins, of a Raspberry Pi Pico; no power stage is near.
pub static BOARD: Board = Board::plain(
    "Raspberry Pi Pico",
    CRYSTAL_HZ,
    &[Pin::new("GPIO 2", "DI", "pin 4"), Pin::new("GPIO 3", "DE and /RE", "pin 5"), Pin::new("GPIO 4", "RO", "pin 6")],
);

/// CHn_CTRL: enabled, words, the write address runs in a ring of 256 bytes, at the pace of the receiver; chained to itself,
/// that is to none.
pub const fn dma_control(dreq: u8) -> u32 {
    const ENABLE: u32 = 1;
    const SIZE_WORD: u32 = 2 << 2;
    const INCREMENT_WRITE: u32 = 1 << 5;
    const RING_256: u32 = 8 << 6;
    const RING_WRITE: u32 = 1 << 10;
    const TREQ: u32 = 15;
    const QUIET: u32 = 1 << 21;
    ENABLE | SIZE_WORD | INCREMENT_WRITE | RING_256 | RING_WRITE | (dreq as u32) << TREQ | QUIET
}

/// The USB device, from all peripherals and its clock.
macro_rules! usb_bus {
    ($peripherals:ident, $clock:expr) => {
        $crate::hal::usb::UsbBus::new(
            $peripherals.USBCTRL_REGS,
            $peripherals.USBCTRL_DPRAM,
            $clock,
            true,
            &mut $peripherals.RESETS,
        )
    };
}
pub(crate) use usb_bus;

/// The second boot stage: sets up the flash.
#[unsafe(link_section = ".boot2")]
#[used]
pub static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;
