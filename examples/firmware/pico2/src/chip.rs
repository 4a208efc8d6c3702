//! Code specific to the RP2350 and its board.

pub use rp235x_hal as hal;
use servowire_boards::{Board, Pin};

/// The crystal, Hz.
pub const CRYSTAL_HZ: u32 = 12_000_000;

/// The pins, of a Raspberry Pi Pico 2; no power stage is near.
pub static BOARD: Board = Board::plain(
    "Raspberry Pi Pico 2",
    CRYSTAL_HZ,
    &[Pin::new("GPIO 2", "DI", "pin 4"), Pin::new("GPIO 3", "DE and /RE", "pin 5"), Pin::new("GPIO 4", "RO", "pin 6")],
);

/// CHn_CTRL: enabled, words, the write address runs in a ring of 256 bytes, at the pace of the receiver; chained to channel 0, which is
/// itself, that is to none.
pub const fn dma_control(dreq: u8) -> u32 {
    const ENABLE: u32 = 1;
    const SIZE_WORD: u32 = 2 << 2;
    const INCREMENT_WRITE: u32 = 1 << 6;
    const RING_256: u32 = 8 << 8;
    const RING_WRITE: u32 = 1 << 12;
    const TREQ: u32 = 17;
    const QUIET: u32 = 1 << 23;
    ENABLE | SIZE_WORD | INCREMENT_WRITE | RING_256 | RING_WRITE | (dreq as u32) << TREQ | QUIET
}

/// The USB device, from all peripherals and its clock.
macro_rules! usb_bus {
    ($peripherals:ident, $clock:expr) => {{
        let (registers, memory) = ($peripherals.USB, $peripherals.USB_DPRAM);
        let bus = $crate::hal::usb::UsbBus::new(registers, memory, $clock, true, &mut $peripherals.RESETS);
        $crate::chip::connect_usb();
        bus
    }};
}
pub(crate) use usb_bus;

/// Ends the isolation of the USB transceiver, which follows a reset of the controller; rp235x-hal 0.4 leaves it on, and nobody would be
/// heard.
pub fn connect_usb() {
    // SAFETY: the bus, which owns the registers, exists and is not used yet; this bit is its own no more.
    let usb = unsafe { &*hal::pac::USB::ptr() };
    usb.main_ctrl().modify(|_, w| w.phy_iso().clear_bit());
}

/// The block that the boot ROM requires.
#[unsafe(link_section = ".start_block")]
#[used]
pub static IMAGE_DEF: hal::block::ImageDef = hal::block::ImageDef::secure_exe();
