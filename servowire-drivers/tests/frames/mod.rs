//! A-format encoders on a hostile line behind a port of frames whose time runs by the look at the clock.

#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use nikon_aformat::device::Device;
use nikon_aformat::master::Line;
use nikon_aformat::{BitRate, EncoderAddress, RequestFrame, Resolution};
use servowire_drivers::nikon::{Frame, blocking};
use servowire_drivers::{Clock, Timer};
use servowire_world::{Delivery, Event, Framing, Host, Id, Kind, Message, Rates, Scenario, Wire, World};

/// 2.5 Mbit/s: a frame is 7.2 us.
pub const RATE: BitRate = BitRate::Mbit2_5;
const WIRE: Wire = Wire { bit_ps: 400_000, framing: Framing::StartStop { width: 16 }, devices: 1 };
const LOOK_NS: u64 = 100;
pub const RATES: Rates = Rates { per_million: [6_000; Kind::ALL.len()], longest_ns: 60_000 };

pub struct Bench {
    pub world: World,
    pub encoders: Vec<Device<1>>,
    pub fifo: VecDeque<Frame>,
    /// Whether frames carry the time of their end.
    stamped: bool,
    /// The turn of the shaft; each frame on the line turns it on.
    pub shaft: u32,
    /// Where it was when the encoders heard the last request.
    pub asked_at: u32,
    pub request: Option<Id>,
}

pub type Shared = Rc<RefCell<Bench>>;

impl Bench {
    pub fn new(scenario: Scenario) -> Shared {
        Self::with(scenario, 1, false)
    }

    /// So many encoders, with the addresses from 0 up.
    pub fn with(scenario: Scenario, encoders: u8, stamped: bool) -> Shared {
        let encoder = |ea| Device::new(EncoderAddress::truncate(ea), Resolution::default(), RATE);
        Rc::new(RefCell::new(Self {
            world: World::new(Wire { devices: encoders, ..WIRE }, scenario),
            encoders: (0..encoders).map(encoder).collect(),
            fifo: VecDeque::new(),
            stamped,
            shaft: 0,
            asked_at: 0,
            request: None,
        }))
    }

    pub fn pass(&mut self, until_ns: u64) {
        loop {
            match self.world.next(until_ns) {
                Event::Time { .. } => return,
                Event::Delivered(block) => {
                    // The last of a block ended at its stamp, the ones before a frame earlier each.
                    let count = block.units.len();
                    let frames = block.units.iter().enumerate().map(|(at, unit)| {
                        let (content, framed) = unit.bits.content();
                        let end_ns = block.end_ns - 7_200 * (count - 1 - at) as u64;
                        Frame { content: content as u16, framed, end_ns: self.stamped.then_some(end_ns) }
                    });
                    self.fifo.extend(frames);
                }
                Event::Heard { device, unit } => {
                    let (content, framed) = unit.bits.content();
                    if device == 0 {
                        self.shaft += 1;
                    }
                    let Some(encoder) = self.encoders.get_mut(usize::from(device)) else { continue };
                    encoder.set_position(self.shaft, 3 + u32::from(device));
                    if !framed {
                        encoder.framing_error(unit.end_ns);
                    } else if let Some(answer) = encoder.frame(content as u16, unit.end_ns) {
                        self.asked_at = self.shaft;
                        let contents = answer.raw.contents().iter().map(|content| u64::from(*content));
                        let message = Message::frames(16, contents).tagged(self.shaft.into());
                        self.world.answer(device, unit.origin.transmission, &message, answer.at_ns);
                    }
                }
            }
        }
    }

    pub fn send(&mut self, frames: &[u16], gap_bits: u32) {
        let contents = frames.iter().map(|content| u64::from(*content));
        let message = Message::frames(16, contents).with_gap_bits(gap_bits as usize);
        let now_ns = self.world.now_ns();
        self.request = Some(self.world.send(&message, now_ns));
    }
}

/// Port, clock and timer.
#[derive(Clone)]
pub struct Port(pub Shared);

impl blocking::FramePort for Port {
    type Error = Infallible;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        let contents: Vec<_> = frames.iter().map(|frame| frame.content()).collect();
        self.0.borrow_mut().send(&contents, gap_bits);
        Ok(())
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        Ok(self.0.borrow_mut().fifo.pop_front())
    }
}

#[cfg(feature = "async")]
impl servowire_drivers::nikon::asynch::FramePort for Port {
    type Error = Infallible;

    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        blocking::FramePort::send(self, frames, gap_bits)
    }

    async fn take(&mut self) -> Result<Frame, Infallible> {
        poll_fn(|_| self.0.borrow_mut().fifo.pop_front().map_or(Poll::Pending, |frame| Poll::Ready(Ok(frame)))).await
    }
}

impl Clock for Port {
    fn now_ns(&mut self) -> u64 {
        let mut bench = self.0.borrow_mut();
        let until_ns = bench.world.now_ns() + LOOK_NS;
        bench.pass(until_ns);
        bench.world.now_ns()
    }
}

#[cfg(feature = "async")]
impl Timer for Port {
    async fn wait_until(&mut self, ns: u64) {
        poll_fn(|_| if self.now_ns() >= ns { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}

pub fn line() -> Line {
    Line::new(RATE).with_response_timeout_ns(20_000)
}

/// How a port hands frames over: one by one, in blocks of two, or when the line is idle; a FIFO of six frames.
pub fn deliveries() -> [Delivery; 3] {
    [Delivery::Each, Delivery::Blocks { units: 2, idle_ns: 8_000 }, Delivery::Idle { idle_ns: 8_000 }]
}

pub fn host(echo: bool, delivery: Delivery) -> Host {
    Host { echo, delivery, fifo: 6, ..Host::IDEAL }
}
