//! A ring with its communication ASIC: banks of memory, frames, interrupts, and time that goes on with every access.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::marker::PhantomData;
use std::rc::Rc;

use rtex_block::MacId;
use rtex_block::device::{Drive, DriveConfig, OpenCodes};
use rtex_block::master::{Asic, Slave};
use servowire_drivers::rtex::{FrameCount, Port, Word};
use servowire_drivers::{Clock, ClockError};

pub const AXES: usize = 3;
/// Communication period.
pub const COM_NS: u64 = 500_000;
/// A frame with three axes, by the straight line of the guide.
const FRAME_NS: u64 = 29_600;
/// An access to the bus.
const ACCESS_NS: u64 = 110;

/// The switches of the drives, in the order of the ring.
pub const SWITCHES: [u8; AXES] = [4, 0, 31];

/// A frame has gone round: what each drive has answered, and when.
#[derive(Debug, Clone, Copy)]
struct Answers {
    frame: u32,
    blocks: [[u8; 32]; AXES],
}

pub struct Ring {
    pub now_ns: u64,
    pub drives: [Drive; AXES],
    pub external: bool,
    pub wide: bool,
    pub state: Asic,
    looks: u32,
    /// Blocks that the host has written, and those that the next frame carries.
    tx: [[u8; 32]; AXES],
    on_line: [[u8; 32]; AXES],
    writing: bool,
    wrote: bool,
    /// What the host sees, and what the switch of the bank makes it see.
    seen: Answers,
    hidden: Answers,
    next_frame_ns: u64,
    /// When the frame under way comes back.
    back_ns: Option<u64>,
    frames: u32,
    reception: &'static FrameCount,
    /// How late the NC interrupt is noticed.
    pub late_ns: u64,
    /// An interrupt that waits for the exchange to end (internal timer).
    pub in_exchange: bool,
    pub interrupt_waits: bool,
    /// The receive interrupt does not come any more.
    pub masked: bool,
    /// Blocks that the host has written in full.
    pub written: u32,
    /// Frames of which the host has read blocks since the exchange began.
    pub read_of: Vec<u32>,
    /// The positions in the blocks of the last frames.
    pub positions: VecDeque<[i32; AXES]>,
    /// Faults: calls of the port until one fails, frames that are lost, a stall at an access.
    pub fail_in: Option<u32>,
    /// The call after the one that fails does so too.
    pub fail_again: bool,
    /// Places that cannot be written, or read, at all.
    pub dead: Option<usize>,
    pub deaf: Option<usize>,
    pub lose_frames: u32,
    pub stall_in: Option<(u32, u64)>,
    pub found: [Slave; AXES],
}

pub type Shared = Rc<RefCell<Ring>>;

impl Ring {
    pub fn new(external: bool, wide: bool) -> Shared {
        let none = Answers { frame: 0, blocks: [[0; 32]; AXES] };
        let drive = |switches: u8| {
            let config = DriveConfig::new(MacId::new(switches).unwrap(), OpenCodes::INVENTED);
            Drive::new(if external { config.with_communications(2) } else { config })
        };
        Rc::new(RefCell::new(Self {
            now_ns: 0,
            drives: SWITCHES.map(drive),
            external,
            wide,
            state: Asic::Initial,
            looks: 0,
            tx: [[0; 32]; AXES],
            on_line: [[0; 32]; AXES],
            writing: false,
            wrote: false,
            seen: none,
            hidden: none,
            next_frame_ns: 0,
            back_ns: None,
            frames: 0,
            reception: Box::leak(Box::new(FrameCount::new())),
            late_ns: 0,
            in_exchange: false,
            interrupt_waits: false,
            masked: false,
            written: 0,
            read_of: Vec::new(),
            positions: VecDeque::new(),
            fail_in: None,
            fail_again: false,
            dead: None,
            deaf: None,
            lose_frames: 0,
            stall_in: None,
            found: SWITCHES.map(|switches| Slave { mac_id: MacId::new(switches).unwrap(), kind: 1 }),
        }))
    }

    pub fn reception(&self) -> &'static FrameCount {
        self.reception
    }

    pub fn next_frame_ns(&self) -> u64 {
        self.next_frame_ns
    }

    /// Time goes on, and what happens meanwhile happens.
    pub fn pass(&mut self, until_ns: u64) {
        while self.state == Asic::Running {
            let back = self.back_ns.filter(|at| *at <= until_ns);
            match back {
                Some(at) if at <= self.next_frame_ns => self.frame_is_back(at),
                _ if self.next_frame_ns <= until_ns => self.frame_begins(),
                _ => break,
            }
        }
        self.now_ns = self.now_ns.max(until_ns);
    }

    fn frame_begins(&mut self) {
        self.now_ns = self.now_ns.max(self.next_frame_ns);
        // Half-written commands do not go out: the switch of the bank is put off.
        if !self.writing {
            self.on_line = self.tx;
        }
        if !self.external {
            // The ASIC switches the reception bank by itself, at the falling edge of XSYNC.
            self.seen = self.hidden;
        }
        self.back_ns = Some(self.next_frame_ns + FRAME_NS);
        self.next_frame_ns += COM_NS;
    }

    fn frame_is_back(&mut self, at_ns: u64) {
        self.now_ns = self.now_ns.max(at_ns);
        self.back_ns = None;
        if self.lose_frames > 0 {
            self.lose_frames -= 1;
            self.drives.iter_mut().for_each(Drive::framing_error);
            return;
        }
        self.frames += 1;
        let mut blocks = [[0; 32]; AXES];
        for ((drive, command), block) in self.drives.iter_mut().zip(&self.on_line).zip(&mut blocks) {
            if self.wide {
                *block = drive.hear(command).unwrap();
            } else {
                block[..16].copy_from_slice(&drive.hear::<16>(command[..16].try_into().unwrap()).unwrap());
            }
        }
        self.hidden = Answers { frame: self.frames, blocks };
        self.positions.truncate(15);
        self.positions.push_front(blocks.map(|block| i32::from_le_bytes([block[4], block[5], block[6], block[7]])));
        if self.masked {
            return;
        }
        if self.external {
            // The receive interrupt has the highest priority.
            self.reception.add();
            self.seen = self.hidden;
        } else {
            self.interrupt_waits = true;
            self.let_in();
        }
    }

    /// The receive interrupt of the internal-timer system, whose priority is below that of the exchange.
    pub fn let_in(&mut self) {
        if self.interrupt_waits && !self.in_exchange {
            self.interrupt_waits = false;
            self.reception.add();
        }
    }

    /// An access of the host.
    fn access(&mut self, words: usize) -> Result<(), ()> {
        let stall_ns = match &mut self.stall_in {
            Some((0, ns)) => std::mem::take(ns),
            Some((left, _)) => {
                *left -= 1;
                0
            }
            None => 0,
        };
        self.pass(self.now_ns + stall_ns + ACCESS_NS * words as u64);
        match &mut self.fail_in {
            Some(0) => {
                self.fail_in = std::mem::take(&mut self.fail_again).then_some(0);
                Err(())
            }
            Some(left) => {
                *left -= 1;
                Ok(())
            }
            None => Ok(()),
        }
    }
}

pub struct Bus<W>(pub Shared, pub PhantomData<W>);

/// A word from its bytes and back, by the drawing of the guide.
pub trait Drawn: Word {
    fn of(bytes: &[u8]) -> Self;
    fn to(self, bytes: &mut [u8]);
}

macro_rules! drawn {
    ($($word:ty),*) => {$(
        impl Drawn for $word {
            fn of(bytes: &[u8]) -> Self {
                bytes.iter().enumerate().map(|(k, byte)| Self::from(*byte) << (8 * k)).sum()
            }

            fn to(self, bytes: &mut [u8]) {
                for (k, byte) in bytes.iter_mut().enumerate() {
                    *byte = (self >> (8 * k) & 0xff) as u8;
                }
            }
        }
    )*};
}
drawn!(u8, u16, u32);

impl<W: Drawn> Port for Bus<W> {
    type Word = W;
    type Error = ();

    fn state(&mut self) -> Result<Asic, ()> {
        let mut ring = self.0.borrow_mut();
        ring.access(1)?;
        ring.looks += 1;
        ring.state = match ring.state {
            Asic::Initial if ring.looks > 3 => Asic::RingConfig,
            Asic::RingConfig if ring.looks > 6 => Asic::Ready,
            Asic::Ready if ring.wrote => {
                ring.next_frame_ns = ring.now_ns + COM_NS;
                Asic::Running
            }
            state => state,
        };
        Ok(ring.state)
    }

    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, ()> {
        let mut ring = self.0.borrow_mut();
        ring.access(AXES)?;
        found[..AXES].copy_from_slice(&ring.found);
        Ok(Some(AXES))
    }

    fn read(&mut self, place: usize, words: &mut [W]) -> Result<(), ()> {
        let mut ring = self.0.borrow_mut();
        if ring.deaf == Some(place) {
            return Err(());
        }
        let width = size_of::<W>();
        for (k, word) in words.iter_mut().enumerate() {
            ring.access(1)?;
            *word = W::of(&ring.seen.blocks[place][width * k..width * (k + 1)]);
            let frame = ring.seen.frame;
            ring.read_of.push(frame);
        }
        Ok(())
    }

    fn write(&mut self, place: usize, words: &[W]) -> Result<(), ()> {
        let mut ring = self.0.borrow_mut();
        ring.writing = ring.dead != Some(place);
        if !ring.writing {
            return Err(());
        }
        let (width, mut block) = (size_of::<W>(), ring.tx[place]);
        for (k, word) in words.iter().enumerate() {
            ring.access(1).inspect_err(|()| ring.writing = false)?;
            word.to(&mut block[width * k..width * (k + 1)]);
        }
        // A block that was not written in full is the old one.
        ring.tx[place] = block;
        ring.written += 1;
        ring.writing = place + 1 < AXES;
        ring.wrote |= !ring.writing;
        Ok(())
    }
}

#[derive(Clone)]
pub struct Watch(pub Shared);

impl Clock for Watch {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut ring = self.0.borrow_mut();
        let until_ns = ring.now_ns + 100;
        ring.pass(until_ns);
        Ok(ring.now_ns)
    }
}
