//! A driver that is made anew, after a restart of the controller or because its port was needed elsewhere, knows nothing of
//! the line: the answer to a request that left before is nobody's.

use embedded_io::Write;
use nikon_aformat::{EncoderAddress, Operation, Request, Resolution};
use servowire_drivers::Automatic;
use servowire_drivers::nikon::blocking::{Driver as Encoders, FramePort};
use servowire_drivers::tformat::blocking::Driver;
use servowire_world::{Scenario, Verdict};

use crate::bench::{Bench, Misframed, Uart, Watch, line};
use crate::frames;

#[test]
fn tformat() {
    for gap_ns in (0..80_000).step_by(700) {
        let bench = Bench::new(Scenario::quiet(), Misframed::Dropped);
        Uart(bench.clone()).write_all(&[0x1a]).unwrap();
        let now_ns = bench.borrow().now_ns();
        bench.borrow_mut().pass(now_ns + gap_ns);
        let mut driver = Driver::new(Uart(bench.clone()), Automatic, Watch(bench.clone()), line()).unwrap();
        let data = driver.read_data().unwrap();
        let bench = bench.borrow();
        let verdict = bench.truth().verdict(bench.request.unwrap(), data.abs.get().into());
        assert_eq!((verdict, bench.truth().clashes()), (Verdict::Fresh, 0), "{gap_ns} ns after a request");
    }
}

#[test]
fn nikon() {
    let request = Request::new(EncoderAddress::ZERO, Operation::Abs40);
    for gap_ns in (0..80_000).step_by(700) {
        let bench = frames::Bench::new(Scenario::quiet());
        let mut port = frames::Port(bench.clone());
        port.send(request.emit().as_slice(), 3).unwrap();
        let now_ns = bench.borrow().world.now_ns();
        bench.borrow_mut().pass(now_ns + gap_ns);
        let mut driver = Encoders::new(port.clone(), port, Resolution::default(), frames::line());
        let exchange = driver.read_abs40(EncoderAddress::ZERO).unwrap();
        let (bench, shaft) = (bench.borrow(), frames::shaft(exchange.response));
        let verdict = bench.world.truth().verdict(bench.request.unwrap(), shaft.into());
        assert_eq!((verdict, bench.world.truth().clashes()), (Verdict::Fresh, 0), "{gap_ns} ns after a request");
    }
}
