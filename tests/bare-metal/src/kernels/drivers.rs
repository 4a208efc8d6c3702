//! The blocking drivers: a position from the call to its return, without the waiting, and every other call on a silent line. A driver waits
//! once for what was on the line before it, so the same one is called again and again.

use nikon_aformat::bus::Addresses;
use nikon_aformat::master::Cycle;
use nikon_aformat::{EncoderAddress, Operation};
use servowire_drivers::Automatic;
use servowire_drivers::{nikon, tformat::blocking::Driver};
use tformat::{Address, Page, Policy, Sample};

use super::kernels_on_states;
use crate::count::tenths_on;
use crate::self_test::drivers::{ABS40, ALL_DATA, LINE, RESOLUTION, SLOW, WIDTHS};
use crate::transport::{Port, Steps, Uart};

type Encoder = Driver<Uart, Automatic, Steps>;
type Encoders = nikon::blocking::Driver<Port, Steps>;

/// Calls besides the reading of a position.
const CALLS: [u8; 5] = [0, 1, 2, 3, 4];

/// A driver that is past its first call.
fn encoder(answer: &'static [u8]) -> Encoder {
    let mut encoder = Driver::new(Uart::new(answer), Automatic, Steps::new(4_000), LINE).expect("no pin");
    let _ = encoder.transact(tformat::Request::ReadAll);
    encoder
}

fn encoders(answer: &'static [u16]) -> Encoders {
    let mut encoders = nikon::blocking::Driver::new(Port::new(answer), Steps::new(7_200), WIDTHS, SLOW);
    let _ = encoders.read_abs40(EncoderAddress::ZERO);
    encoders
}

kernels_on_states! {
    /// A T-Format position with the blocking driver: request, eleven bytes one by one, all checks; a look at the clock for each.
    fn drivers_tformat_position(encoder: &mut Encoder, policy: &Policy) -> Option<Sample> {
        encoder.read_position(RESOLUTION, *policy).ok()
    } as {
        tenths_on(&mut encoder(ALL_DATA), drivers_tformat_position, const { &[Policy::new(1_000_000)] })
    }

    /// An A-format position with the blocking driver: request, four frames one by one, all checks; a look at the clock for each.
    fn drivers_nikon_position(encoders: &mut Encoders, policy: &nikon_aformat::Policy) -> Option<nikon_aformat::Sample> {
        encoders.read_position(EncoderAddress::truncate(1), *policy).ok()
    } as {
        tenths_on(&mut encoders(ABS40), drivers_nikon_position, const { &[nikon_aformat::Policy::new(1_000_000)] })
    }

    /// Every other call of the T-Format driver, with nobody at the line; the mean of them.
    fn drivers_tformat_silence(encoder: &mut Encoder, call: &u8) -> bool {
        let address = Address::truncate(5);
        match *call {
            0 => encoder.read_data().is_err(),
            1 => encoder.clear_errors().is_err(),
            2 => encoder.read_eeprom(Page::truncate(1), address).is_err(),
            3 => encoder.write_eeprom(Page::truncate(0), address, *call).is_err(),
            _ => encoder.transact(tformat::Request::ReadSingleTurn).is_err(),
        }
    } as {
        tenths_on(&mut encoder(&[]), drivers_tformat_silence, &CALLS)
    }

    /// The same of the A-format driver, a bus in its cycle among them.
    fn drivers_nikon_silence(encoders: &mut Encoders, call: &u8) -> bool {
        let ea = EncoderAddress::truncate(*call);
        match *call {
            0 => encoders.read_abs40(ea).is_err(),
            1 => encoders.read_bus(Operation::Abs40Mt, Addresses::first(8)).is_err(),
            2 => match Cycle::new(1_000_000, 900_000, 0) {
                Ok(mut cycle) => encoders.read_cycle(&mut cycle, Operation::Abs40Mt, Addresses::first(3)).is_err(),
                Err(_) => true,
            },
            3 => encoders.clear_status(ea).is_err(),
            _ => encoders.read_eeprom(ea, *call).is_err(),
        }
    } as {
        tenths_on(&mut encoders(&[]), drivers_nikon_silence, &CALLS)
    }
}
