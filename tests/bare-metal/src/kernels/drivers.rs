//! The blocking drivers: a position from the call to its return, without the waiting, and every other call on a silent line.

use nikon_aformat::bus::Addresses;
use nikon_aformat::master::Cycle;
use nikon_aformat::{EncoderAddress, Operation};
use servowire_drivers::Automatic;
use servowire_drivers::{nikon, tformat::blocking::Driver};
use tformat::{Address, Page, Policy, Sample};

use super::kernels;
use crate::self_test::drivers::{ABS40, ALL_DATA, LINE, RESOLUTION, SLOW, WIDTHS};
use crate::transport::{Port, Uart, steps};

type Bytes = &'static [u8];
type Frames = &'static [u16];

/// Calls besides the reading of a position.
const CALLS: [u8; 5] = [0, 1, 2, 3, 4];

kernels! {
    /// A T-Format position with the blocking driver: request, eleven bytes one by one, all checks; a look at the clock for each.
    fn drivers_tformat_position(answer: &Bytes) -> Option<Sample> {
        let mut encoder = Driver::new(Uart::new(answer), Automatic, steps(4_000), LINE).ok()?;
        encoder.read_position(RESOLUTION, Policy::new(1_000_000)).ok()
    } over [ALL_DATA];

    /// An A-format position with the blocking driver: request, four frames one by one, all checks; a look at the clock for each.
    fn drivers_nikon_position(answer: &Frames) -> Option<nikon_aformat::Sample> {
        let mut master = nikon::blocking::Driver::new(Port::new(answer), steps(7_200), WIDTHS, SLOW);
        master.read_position(EncoderAddress::truncate(1), nikon_aformat::Policy::new(1_000_000)).ok()
    } over [ABS40];

    /// Every other call of the T-Format driver, with nobody at the line; the mean of them.
    fn drivers_tformat_silence(call: &u8) -> bool {
        let Ok(mut encoder) = Driver::new(Uart::new(&[]), Automatic, steps(4_000), LINE) else { return false };
        let address = Address::truncate(5);
        match *call {
            0 => encoder.read_data().is_err(),
            1 => encoder.clear_errors().is_err(),
            2 => encoder.read_eeprom(Page::truncate(1), address).is_err(),
            3 => encoder.write_eeprom(Page::truncate(0), address, *call).is_err(),
            _ => encoder.transact(tformat::Request::ReadSingleTurn).is_err(),
        }
    } over CALLS;

    /// The same of the A-format driver, a bus in its cycle among them.
    fn drivers_nikon_silence(call: &u8) -> bool {
        let mut master = nikon::blocking::Driver::new(Port::new(&[]), steps(7_200), WIDTHS, SLOW);
        let ea = EncoderAddress::truncate(*call);
        match *call {
            0 => master.read_abs40(ea).is_err(),
            1 => master.read_bus(Operation::Abs40Mt, Addresses::first(8)).is_err(),
            2 => match Cycle::new(1_000_000, 900_000, 0) {
                Ok(mut cycle) => master.read_cycle(&mut cycle, Operation::Abs40Mt, Addresses::first(3)).is_err(),
                Err(_) => true,
            },
            3 => master.clear_status(ea).is_err(),
            _ => master.read_eeprom(ea, *call).is_err(),
        }
    } over CALLS;
}
