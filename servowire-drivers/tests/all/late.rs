//! A UART that another task keeps from its work: 10 ms pass while a request is handed to it, some of it may be refused, and the answer
//! is damaged in its middle, 15 us after the request.
use std::cell::RefCell;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use embedded_io::{ErrorKind, ErrorType};
use servowire_drivers::{Clock, ClockError};

/// What happens at the line.
#[derive(Default)]
pub struct World {
    pub now_ns: u64,
    /// Looks at the clock until 10 ms pass at one of them.
    pub stalls_in: Option<u32>,
    /// Whether 10 ms pass before each piece of the first request is taken.
    pub held_up: bool,
    /// Whether the UART refuses what comes after the first piece of a request, and how many pieces there are.
    pub refuses: bool,
    pub pieces: usize,
    /// When bytes of a request were taken, and in which call.
    pub written: Vec<(u32, u64)>,
    pub call: u32,
    pub fault_ns: Option<u64>,
}

impl World {
    /// The time of the last byte of a call, and of the first of the next one.
    pub fn between(&self) -> Option<(u64, u64)> {
        let last = self.written.iter().rev().find(|(call, _)| *call == 1)?.1;
        let next = self.written.iter().find(|(call, _)| *call == 2)?.1;
        Some((last, next))
    }
}

#[derive(Clone, Default)]
pub struct Late(pub Rc<RefCell<World>>);

impl Late {
    /// The clock, that goes on by 100 ns with every look.
    pub fn look(&self) -> u64 {
        let mut world = self.0.borrow_mut();
        world.stalls_in = world.stalls_in.and_then(|looks| looks.checked_sub(1));
        world.now_ns += if world.stalls_in == Some(0) { 10_000_000 } else { 100 };
        world.now_ns
    }

    pub fn take(&self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let mut world = self.0.borrow_mut();
        let call = world.call;
        let now_ns = world.now_ns + if world.held_up && call == 1 { 10_000_000 } else { 0 };
        if world.refuses && world.written.iter().any(|(before, _)| *before == call) {
            return Err(ErrorKind::Other);
        }
        world.now_ns = now_ns;
        world.written.push((call, now_ns));
        world.fault_ns = Some(now_ns + 15_000);
        Ok(bytes.len().div_ceil(world.pieces.max(1)))
    }

    /// Whether the damage is noticed now.
    pub fn complains(&self) -> bool {
        let mut world = self.0.borrow_mut();
        let now_ns = world.now_ns;
        world.fault_ns.take_if(|at_ns| *at_ns <= now_ns).is_some()
    }

    /// Ends when the damage is noticed.
    pub async fn damage(&self) -> ErrorKind {
        poll_fn(|_| if self.complains() { Poll::Ready(ErrorKind::Other) } else { Poll::Pending }).await
    }
}

impl Clock for Late {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(self.look())
    }
}

impl ErrorType for Late {
    type Error = ErrorKind;
}

impl embedded_io::Write for Late {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.take(bytes)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl embedded_io::ReadReady for Late {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        if self.complains() { Err(ErrorKind::Other) } else { Ok(false) }
    }
}

impl embedded_io::Read for Late {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        Err(ErrorKind::Other)
    }
}
