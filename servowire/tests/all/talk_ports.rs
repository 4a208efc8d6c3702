//! `talk` at ports of which the time is known: adapters that hold answers back, and ports that go away.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::rc::Rc;
use std::thread;
use std::time::Duration;

use servowire::talk::link::Link;
use servowire::talk::port::Port;
use servowire_world::{Cable, Kind, Rates, Scenario};
use tformat::device::Device;
use tformat::{Abm, Abs, Almc, BitRate, Request, Response};

/// An adapter that holds each answer back for some time, and may hear itself. Its time runs while somebody waits.
struct Holding {
    device: Device<6>,
    echo: bool,
    held: Duration,
    /// Requests so far: the shaft moves with each.
    asked: u32,
    /// What is on its way, and for how long.
    coming: Vec<(Duration, Vec<u8>)>,
    longest: Duration,
}

#[derive(Clone)]
struct Adapter(Rc<RefCell<Holding>>);

impl Read for Adapter {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let mut holding = self.0.borrow_mut();
        let longest = holding.longest;
        let first = holding.coming.first_mut();
        if let Some((left, _)) = first.filter(|(left, _)| *left > longest) {
            *left -= longest;
        } else if !holding.coming.is_empty() {
            let (_, answer) = holding.coming.remove(0);
            bytes[..answer.len()].copy_from_slice(&answer);
            return Ok(answer.len());
        }
        thread::sleep(longest);
        Err(std::io::ErrorKind::TimedOut.into())
    }
}

impl Write for Adapter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut holding = self.0.borrow_mut();
        assert_eq!(bytes, [0x1a]);
        holding.asked += 1;
        let (asked, held) = (holding.asked, holding.held);
        holding.device.set_position(Abs::truncate(asked), Abm::truncate(2));
        let mut answer = if holding.echo { bytes.to_vec() } else { Vec::new() };
        answer.extend(holding.device.hear(&bytes[..1], u64::from(asked) * 1_000_000).unwrap().frame.as_bytes());
        holding.coming.push((held, answer));
        Ok(1)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Port for Adapter {
    fn wait(&mut self, longest: Duration) -> std::io::Result<()> {
        self.0.borrow_mut().longest = longest;
        Ok(())
    }

    fn forget(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// An adapter holds answers back for longer than the program waits: the answer to a request that was given up does not answer the next one.
/// Nor is one to a request of somebody before.
#[test]
fn a_late_answer_is_none_to_the_next_request() {
    for echo in [false, true] {
        let ms = Duration::from_millis;
        let device = Device::new(0x17, BitRate::Mbit2_5);
        let holding = Holding { device, echo, held: ms(16), asked: 0, coming: Vec::new(), longest: ms(1) };
        let mut port = Adapter(Rc::new(RefCell::new(holding)));
        let bench = port.0.clone();
        // Somebody has asked and gone away.
        port.write_all(&[0x1a]).unwrap();
        bench.borrow_mut().held = ms(0);
        let mut link = Link::open(port, ms(10)).map_err(|fault| fault.to_string()).unwrap();
        assert_eq!((link.echo(), bench.borrow().asked), (echo, if echo { 2 } else { 3 }));
        for held in [16, 16, 0, 12, 14, 16, 0] {
            bench.borrow_mut().held = ms(held);
            let answer = link.exchange(Request::ReadAll);
            match answer {
                Ok(Response::ReadAll(all)) => assert_eq!(all.abs.get(), bench.borrow().asked, "held back {held} ms"),
                other => assert!(held > 0, "{other:?}"),
            }
        }
    }
}

/// What has come while the program was kept from running is taken before the clock is asked.
#[test]
fn an_answer_that_is_there_is_not_late() {
    let device = Device::new(0x17, BitRate::Mbit2_5);
    let longest = Duration::from_millis(1);
    let holding = Holding { device, echo: false, held: Duration::ZERO, asked: 0, coming: Vec::new(), longest };
    let port = Adapter(Rc::new(RefCell::new(holding)));
    assert!(Link::open(port, Duration::ZERO).is_ok());
}

/// An encoder at the end of a line with faults. Its time runs while somebody waits, so nothing comes later than the faults
/// make it, however busy the machine is.
struct Faulty {
    device: Device<6>,
    echo: bool,
    line: Cable,
    now_ns: u64,
    shaft: u32,
    coming: VecDeque<(u64, Vec<u8>)>,
    longest: Duration,
}

impl Faulty {
    fn hear(&mut self, byte: u8) {
        if self.echo {
            self.coming.push_back((self.now_ns, vec![byte]));
        }
        self.shaft += 1;
        self.device.set_position(Abs::truncate(self.shaft), Abm::truncate(2));
        let Some(answer) = self.device.hear(&[byte], self.now_ns) else { return };
        let mut at_ns = self.now_ns;
        for arrival in self.line.carry(answer.frame.as_bytes(), self.now_ns) {
            // In two pieces, as USB likes it.
            let (first, second) = arrival.bytes.split_at(arrival.bytes.len() / 3);
            at_ns = at_ns.max(arrival.at_ns);
            self.coming.extend([(at_ns, first.to_vec()), (at_ns + 200_000, second.to_vec())]);
            at_ns += 200_000;
        }
    }

    /// What comes until then; otherwise it is then.
    fn until(&mut self, then_ns: u64) -> Option<Vec<u8>> {
        let (at_ns, _) = self.coming.front().filter(|(at_ns, _)| *at_ns <= then_ns)?;
        self.now_ns = self.now_ns.max(*at_ns);
        self.coming.pop_front().map(|(_, piece)| piece)
    }
}

#[derive(Clone)]
struct Line(Rc<RefCell<Faulty>>);

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let mut line = self.0.borrow_mut();
        let then_ns = line.now_ns + u64::try_from(line.longest.as_nanos()).unwrap();
        if let Some(piece) = line.until(then_ns) {
            bytes[..piece.len()].copy_from_slice(&piece);
            return Ok(piece.len());
        }
        line.now_ns = then_ns;
        thread::sleep(line.longest);
        Err(std::io::ErrorKind::TimedOut.into())
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut line = self.0.borrow_mut();
        for byte in bytes {
            line.hear(*byte);
        }
        line.coming.retain(|(_, piece)| !piece.is_empty());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Port for Line {
    fn wait(&mut self, longest: Duration) -> std::io::Result<()> {
        self.0.borrow_mut().longest = longest;
        Ok(())
    }

    fn forget(&mut self) -> std::io::Result<()> {
        let mut line = self.0.borrow_mut();
        let now_ns = line.now_ns;
        line.coming.retain(|(at_ns, _)| *at_ns > now_ns);
        Ok(())
    }
}

/// Whatever the line does, a value that is accepted was sent, and the next exchange on a good line is good.
#[test]
fn faults_are_refused_and_over_with_the_next_exchange() {
    let rates = Rates { longest_ns: 2_000_000, ..Rates::QUIET }
        .with(Kind::Drop, 50_000)
        .with(Kind::Flip, 100_000)
        .with(Kind::Cut, 100_000)
        .with(Kind::Delay, 100_000)
        .with(Kind::Repeat, 50_000)
        .with(Kind::Noise, 50_000);
    for echo in [false, true] {
        let mut device = Device::new(0x17, BitRate::Mbit2_5);
        device.raise_alarms(Almc::OS);
        device.end_alarms(Almc::OS);
        let line = Cable::new(0, Scenario::random(7, rates));
        let (coming, longest) = (VecDeque::new(), Duration::ZERO);
        let faulty = Faulty { device, echo, line, now_ns: 0, shaft: 0, coming, longest };
        let port = Line(Rc::new(RefCell::new(faulty)));
        let mut link = (0..5).find_map(|_| Link::open(port.clone(), Duration::from_millis(15)).ok()).unwrap();
        assert_eq!(link.echo(), echo);
        let (mut good, mut last) = (0, 0);
        for _ in 0..150 {
            if let Ok(Response::ReadAll(all)) = link.exchange(Request::ReadAll) {
                assert!(all.abs.get() > last, "{} after {last}: an old answer", all.abs);
                assert_eq!((all.abm.get(), all.enid), (2, 0x17));
                (good, last) = (good + 1, all.abs.get());
            }
        }
        println!("{good} of 150 good; {}", port.0.borrow().line.tally);
        assert!(good > 75);
    }
}

/// A port that is gone, as its reads say by giving nothing.
#[derive(Debug)]
struct Gone;

impl Read for Gone {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        Ok(0)
    }
}

impl Write for Gone {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Port for Gone {
    fn wait(&mut self, _: Duration) -> std::io::Result<()> {
        Ok(())
    }

    fn forget(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_port_that_is_gone_is_said_to_be_gone() {
    let fault = Link::open(Gone, Duration::from_millis(10)).unwrap_err();
    assert!(fault.to_string().starts_with("the port is gone or refused: "), "{fault}");
}
