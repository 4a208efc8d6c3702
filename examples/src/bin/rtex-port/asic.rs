//! A simulated ASIC with three drives, in place of the chip's bus. Time advances with every access.

use std::sync::{Mutex, PoisonError};

use rtex_block::MacId;
use rtex_block::device::{Drive, DriveConfig, Fault, OpenCodes};

use crate::{AXES, DRIVES, map};

const PERIOD_NS: u64 = 500_000;
/// A frame with three axes, by the straight line of the guide, and an access to the bus.
const FRAME_NS: u64 = 29_600;
const ACCESS_NS: u64 = 110;

/// What makes the processor leave what it is at.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Interrupt {
    /// Falling edge of XSYNC: a frame begins, and the banks are switched.
    Xsync {
        /// When that was.
        began_ns: u64,
    },
    /// A frame has come back.
    Xintrx,
}

pub(crate) struct Asic {
    now_ns: u64,
    state: u16,
    looks: u32,
    drives: [Drive; AXES],
    /// What the host has written, what goes round, what came back, and what the host sees.
    tx: [[u8; 16]; AXES],
    busy: bool,
    line: [[u8; 16]; AXES],
    back: [[u8; 16]; AXES],
    rx: [[u8; 16]; AXES],
    next_ns: u64,
    back_ns: Option<u64>,
    xsync: Option<u64>,
    xintrx: bool,
}

static ASIC: Mutex<Option<Asic>> = Mutex::new(None);

impl Asic {
    pub(crate) fn with<T>(work: impl FnOnce(&mut Self) -> T) -> T {
        let mut asic = ASIC.lock().unwrap_or_else(PoisonError::into_inner);
        work(asic.get_or_insert_with(Self::new))
    }

    fn new() -> Self {
        let drive = |id| Drive::new(DriveConfig::new(MacId::truncate(id), OpenCodes::INVENTED));
        Self {
            now_ns: 0,
            state: 0,
            looks: 0,
            drives: DRIVES.map(drive),
            tx: [[0; 16]; AXES],
            busy: false,
            line: [[0; 16]; AXES],
            back: [[0; 16]; AXES],
            rx: [[0; 16]; AXES],
            next_ns: u64::MAX,
            back_ns: None,
            xsync: None,
            xintrx: false,
        }
    }

    /// A look at the clock takes time too.
    pub(crate) fn now_ns(&mut self) -> u64 {
        self.pass(self.now_ns + ACCESS_NS);
        self.now_ns
    }

    pub(crate) fn idle(&mut self) {
        self.pass(self.now_ns + 1_000_000);
    }

    /// Until the next interrupt.
    pub(crate) fn wait(&mut self) -> Interrupt {
        loop {
            if let Some(interrupt) = self.pending() {
                return interrupt;
            }
            self.pass(self.back_ns.unwrap_or(self.next_ns).max(self.now_ns + 1));
        }
    }

    /// The interrupt of the highest priority that has come.
    pub(crate) fn pending(&mut self) -> Option<Interrupt> {
        if let Some(began_ns) = self.xsync.take() {
            return Some(Interrupt::Xsync { began_ns });
        }
        core::mem::take(&mut self.xintrx).then_some(Interrupt::Xintrx)
    }

    pub(crate) fn silence(&mut self, place: usize) {
        self.drives[place].set_fault(Fault::Silent);
    }

    /// Of the drives that hear.
    pub(crate) fn all_off(&self) -> bool {
        self.drives.iter().all(|drive| !drive.is_active())
    }

    pub(crate) fn read(&mut self, address: usize) -> u16 {
        self.pass(self.now_ns + ACCESS_NS);
        match address {
            map::STATE => {
                self.looks += 1;
                self.state = self.state.max(u16::from(self.looks > 3)).max(2 * u16::from(self.looks > 6));
                self.state
            }
            map::SLAVES => AXES as u16,
            _ if (map::SLAVES..map::RX).contains(&address) => {
                let place = (address - map::SLAVES) / 2 - 1;
                DRIVES.get(place).map_or(0, |id| u16::from_le_bytes([*id, map::KIND_SERVO as u8]))
            }
            map::RX..map::TX => {
                let block = &self.rx[(address - map::RX) / 16];
                u16::from_le_bytes([block[address % 16], block[address % 16 + 1]])
            }
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, address: usize, word: u16) {
        self.pass(self.now_ns + ACCESS_NS);
        match address {
            map::TX_BUSY => {
                self.busy = word != 0;
                if !self.busy && self.state == 2 {
                    // The first commands are there: cyclic transmission begins.
                    (self.state, self.next_ns) = (3, self.now_ns + PERIOD_NS);
                }
            }
            map::TX.. => {
                let block = &mut self.tx[(address - map::TX) / 16];
                [block[address % 16], block[address % 16 + 1]] = word.to_le_bytes();
            }
            _ => {}
        }
    }

    fn pass(&mut self, until_ns: u64) {
        loop {
            match self.back_ns {
                Some(at_ns) if at_ns <= until_ns && at_ns <= self.next_ns => self.frame_is_back(at_ns),
                _ if self.next_ns <= until_ns => self.frame_begins(),
                _ => break,
            }
        }
        self.now_ns = self.now_ns.max(until_ns);
    }

    fn frame_begins(&mut self) {
        if !self.busy {
            self.line = self.tx;
        }
        self.rx = self.back;
        self.xsync = Some(self.next_ns);
        self.back_ns = Some(self.next_ns + FRAME_NS);
        self.next_ns += PERIOD_NS;
    }

    fn frame_is_back(&mut self, at_ns: u64) {
        self.now_ns = self.now_ns.max(at_ns);
        (self.back_ns, self.xintrx) = (None, true);
        for (drive, (command, back)) in self.drives.iter_mut().zip(self.line.iter().zip(&mut self.back)) {
            // What a silent drive has said last stays in the memory.
            if let Some(block) = drive.hear(command) {
                *back = block;
            }
        }
    }
}
