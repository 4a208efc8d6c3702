//! The protocol crates on a Cortex-M4: every number of the vectors' tables is decoded again here, and the
//! instructions of each entry point that firmware calls are counted.
//!
//! `run.sh` builds an image for each protocol at two levels of optimisation, runs it under QEMU and reads what it prints:
//!
//! ```text
//! self-test   <topic>    <rows passed>     <rows failed>
//! kernel      <symbol>   <instructions>
//! stack       <name>     <bytes>
//! end
//! ```
#![no_std]
#![no_main]

mod count;
mod kernels;
mod self_test;
#[cfg(feature = "stack")]
mod stack;
#[cfg(feature = "servowire-drivers")]
mod transport;

use core::panic::PanicInfo;

use cortex_m::peripheral::Peripherals;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[entry]
fn main() -> ! {
    let mut failed = 0;
    for topics in self_test::ALL {
        for (topic, test) in *topics {
            let tally = test();
            hprintln!("self-test\t{}\t{}\t{}", topic, tally.passed, tally.failed);
            failed += tally.failed;
        }
    }
    if let Some(peripherals) = Peripherals::take() {
        count::start(peripherals.SYST);
        // An image of its own measures stacks: what calls more would move the figures of the kernels.
        let kernels: &[_] = if cfg!(feature = "stack") { &[] } else { kernels::ALL };
        for kernel in kernels.iter().copied().flatten() {
            let tenths = (kernel.tenths)();
            hprintln!("kernel\t{}\t{}.{}", kernel.name, tenths / 10, tenths % 10);
        }
        #[cfg(feature = "stack")]
        for stack in stack::ALL {
            hprintln!("stack\t{}\t{}", stack.name, (stack.bytes)());
        }
        hprintln!("end");
    }
    exit(failed == 0)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    hprintln!("{}", info);
    exit(false)
}

fn exit(good: bool) -> ! {
    loop {
        debug::exit(if good { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    }
}
