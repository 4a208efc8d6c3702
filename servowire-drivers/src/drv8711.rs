//! The DRV8711 stepper driver: registers, SPI words, the set-up sequence, and a [`Driver`] over an SPI.
//!
//! ```text
//!  bit 15    14 13 12  11 ............ 0
//!      read  address   data               MSB first, SPI mode 0, chip select high, taken when it falls
//! ```
//!
//! Based on the DRV8711 data sheet (SLVSC40), section 7.6, and the design guide of the 4-axis CNC router (TIDEP-0061),
//! section 2.1.
//!
//! ```
//! use servowire_drivers::drv8711::{Configuration, Ctrl, Register, StepMode};
//! let mut setup = Configuration::default();
//! setup.ctrl = Ctrl { enable: true, mode: StepMode::Div256, ..setup.ctrl };
//! assert_eq!(setup.value(Register::Ctrl), 0xc41);
//! assert_eq!(Register::Ctrl.write(setup.value(Register::Ctrl)).bits(), 0x0c41);
//! ```

mod apply;
mod codes;
mod current;
mod driver;
mod error;
mod fields;
mod registers;
mod word;

pub use apply::Apply;
pub use codes::{
    DeadTime, DecayMode, DriveTime, IsGain, OcpDeglitch, OcpThreshold, SampleThreshold, SinkCurrent, SourceCurrent,
    StallCount, StallDivider, StepMode,
};
pub use current::{full_scale_microamps, torque_for_microamps};
pub use driver::{Driver, Failure};
pub use error::{Error, ErrorClass};
pub use fields::Field;
pub use registers::{Blank, Configuration, Ctrl, Decay, Drive, Off, Stall, Torque};
pub use sorte_proto::drv8711::{DIR_SETUP_HOLD_NS, MAX_STEP_HZ, STEP_NS, Status, WAKE_NS};
pub use word::{Register, Word};
