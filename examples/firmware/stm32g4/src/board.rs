//! The board for which the images are built: they can use only the pins in its table.

#[cfg(feature = "b-g431b-esc1")]
compile_error!(
    "B-G431B-ESC1 is refused: its power stage hangs at the processor (PA8, PA9, PA10 switch the high sides, PC13, PA12, PB15 the low \
     sides), its crystal has 8 MHz, and no connector has the pins of an encoder with driver enable. Take a Nucleo-G474RE or G431RB."
);
#[cfg(not(any(feature = "b-g431b-esc1", feature = "nucleo-g431rb", feature = "nucleo-g474re")))]
compile_error!("choose a board: --features nucleo-g474re or --features nucleo-g431rb");

/// Pins that switch a phase, of what the processor of these images may be soldered to or stacked under by mistake: B-G431B-ESC1
/// (UM2516), X-NUCLEO-IHM07M1 (UM1943), IHM08M1 (UM1996), IHM16M1 (UM2415). An image drives none of them.
pub const POWER_STAGES: &[&str] =
    &["PA7", "PA8", "PA9", "PA10", "PA12", "PB0", "PB1", "PB13", "PB14", "PB15", "PC10", "PC11", "PC12", "PC13"];

/// Makes `BOARD`, `Parts` and `take` from one table, so that an image has no other pin.
macro_rules! board {
    ($name:literal, crystal $crystal_hz:literal Hz, $($field:ident: $pin:ident $signal:literal at $at:literal,)*) => {
        use embassy_stm32::{Peri, Peripherals, peripherals};
        use servowire_boards::{Board, Pin};

        /// The crystal, Hz.
        pub const CRYSTAL_HZ: u32 = $crystal_hz;

        /// The board and its pins, none of which switches a power stage.
        pub static BOARD: Board = const {
            Board {
                name: $name,
                crystal_hz: CRYSTAL_HZ,
                pins: &[$(Pin { name: stringify!($pin), signal: $signal, at: $at }),*],
                power_stage: super::POWER_STAGES,
            }
            .checked()
        };

        /// What an image may use of the chip.
        pub struct Parts {
            $(#[doc = $signal] pub $field: Peri<'static, peripherals::$pin>,)*
            /// T-Format.
            pub usart: Peri<'static, peripherals::USART2>,
            /// A-format.
            pub spi: Peri<'static, peripherals::SPI1>,
            /// Of the SPI.
            pub tx_dma: Peri<'static, peripherals::DMA1_CH1>,
            /// Of the SPI.
            pub rx_dma: Peri<'static, peripherals::DMA1_CH2>,
            /// The control interrupt.
            pub timer: Peri<'static, peripherals::TIM4>,
            /// The watchdog.
            pub watchdog: Peri<'static, peripherals::IWDG>,
        }

        pub(crate) fn take(p: Peripherals) -> Parts {
            Parts {
                $($field: p.$pin,)*
                usart: p.USART2,
                spi: p.SPI1,
                tx_dma: p.DMA1_CH1,
                rx_dma: p.DMA1_CH2,
                timer: p.TIM4,
                watchdog: p.IWDG,
            }
        }
    };
}

#[cfg(feature = "nucleo-g431rb")]
mod nucleo_g431rb;
#[cfg(feature = "nucleo-g474re")]
mod nucleo_g474re;

#[cfg(feature = "nucleo-g431rb")]
pub use nucleo_g431rb::*;
#[cfg(feature = "nucleo-g474re")]
pub use nucleo_g474re::*;
