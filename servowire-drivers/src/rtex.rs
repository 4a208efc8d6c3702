//! RTEX drives: the master's exchange over the memory of the communication ASIC (MNM1221).
//!
//! The register map of the ASIC is not public, so access to its bus is a [`Port`] that you write from its data sheet: a state, a
//! table of slaves, and words to read and write. Everything else is here: phases, invalid data first, word packing, the bank
//! rules, the exchange in every update period, and late exchanges.
//!
//! ```text
//!             external timer                              internal timer
//!  main loop  control() until it gives Running, then interrupts on; control() and led() for ever
//!  XINTRX     priority above: frames.add(), then     priority below: frames.add()
//!             switch the reception bank
//!  NC         from the host's timer: exchange()           from the falling edge of XSYNC: exchange()
//! ```
//!
//! In the external-timer system the receive interrupt may switch the reception bank in the middle of an exchange, in the
//! internal-timer system the ASIC switches it at XSYNC if the exchange is late. Half of the blocks would then come from another
//! frame. The counter echoes of one frame are equal, so the exchange compares those of what it has read, reads one block
//! again, looks at [`FrameCount`] before and after, and reads once more if the blocks were not of one frame. If that fails
//! again, every block is read a third time, and one whose echo has changed is not taken, because it may be the halves of two; of
//! the others, each axis takes its block only if it is on time ([`Arrival`]). If the receive
//! interrupt came meanwhile, or XSYNC by the clock, none is taken: two frames have the same counter if there are two
//! communications per update period, or if an exchange was late. System Design Guide for Master, chapters 1 and 2. A drive whose echo
//! stands still looks like that in every exchange: on a bus so slow that three readings last until the frame is back, no axis has a
//! block then, and the ring stops for the first of them instead of for that drive.
//!
//! Every block that the port fails to read or write is tried again at once. If that fails too, a block that was not read counts
//! as a period without an answer from that drive, as counted by the echo watch of its axis. All others are read, and every place
//! is written whatever fails, so a servo-off reaches every drive that can be reached. A block that was not written is replaced
//! in the next period, and its axis goes on from the one before ([`Axis::not_sent`]).

#[cfg(feature = "async")]
pub mod asynch;
mod frame_count;
mod port;

use core::convert::Infallible;

use rtex_block::master::{Arrival, Asic, Axis, ControlError, ControlPhase, Heard, Led, Master, Ring, Sent, Slave};
use rtex_block::timing::TimerSystem;
use rtex_block::{BlockSize, Command32, Evidence, MacId, pack};
use servowire_core::{ClockCheck, ClockError};

use crate::clock::MAX_LOOKS;
use crate::{Clock, Error};
pub use frame_count::FrameCount;
pub use port::{Port, Word};

/// Why a call to a [`Driver`] failed.
pub type Failure<P> = Error<<P as Port>::Error, Infallible, ControlError, Infallible>;

/// Number of words in the longest block, on a bus of bytes.
const MOST_WORDS: usize = rtex_block::LEN32;
/// How many times an exchange reads the blocks if they are not of one frame.
const READS: u8 = 2;

/// Repeats an access if the port reports a fault, because half a command must not be sent.
fn twice<E>(mut transfer: impl FnMut() -> Result<(), E>) -> Result<(), E> {
    transfer().or_else(|_| transfer())
}

/// How an exchange went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Exchanged {
    /// Number of communication periods by which the commands are late, because the exchange ended after the next frame had begun.
    pub frames_late: u32,
    /// The blocks were never all of one frame, however often they were read, or the echo of a drive has stopped; blocks that
    /// were not on time were not taken.
    pub torn: bool,
}

/// The parts from which a [`Driver`] was created.
#[derive(Debug)]
pub struct Released<P, C, const N: usize> {
    /// The port of the ASIC.
    pub port: P,
    /// The clock.
    pub clock: C,
    /// The master.
    pub master: Master<N>,
}

/// A master of `N` axes, and the port of its ASIC.
#[derive(Debug)]
pub struct Driver<'r, P, C, const N: usize> {
    port: P,
    clock: C,
    check: ClockCheck,
    master: Master<N>,
    received: &'r FrameCount,
    /// Number of frames of `received` that were reported to the master.
    frames: u32,
    late: u32,
    torn: u32,
    /// When the period of the last exchange began.
    #[cfg(feature = "async")]
    began_ns: Option<u64>,
}

impl<'r, P: Port, C: Clock, const N: usize> Driver<'r, P, C, N> {
    /// Creates a driver in PH_INIT. The receive interrupt uses the same `received`.
    pub fn new(port: P, clock: C, master: Master<N>, received: &'r FrameCount) -> Self {
        Self {
            port,
            clock,
            check: ClockCheck::new(MAX_LOOKS),
            master,
            received,
            frames: received.get(),
            late: 0,
            torn: 0,
            #[cfg(feature = "async")]
            began_ns: None,
        }
    }

    /// Returns port, clock and master.
    pub fn release(self) -> Released<P, C, N> {
        Released { port: self.port, clock: self.clock, master: self.master }
    }

    /// Returns the master, for reading.
    pub const fn master(&self) -> &Master<N> {
        &self.master
    }

    /// Returns the axes, for set-points, requests, and switching on and off.
    pub const fn ring_mut(&mut self) -> &mut Ring<N> {
        self.master.ring_mut()
    }

    /// Number of exchanges that ended after the next frame had begun.
    pub const fn late(&self) -> u32 {
        self.late
    }

    /// Number of exchanges whose blocks did not all come from one frame.
    pub const fn torn(&self) -> u32 {
        self.torn
    }

    /// Returns what the COM LED shows `t_ms` after the start of a lit half-period.
    pub fn led(&self, t_ms: u64) -> Led {
        self.master.led(t_ms)
    }

    /// Returns what is known about the actual position, speed and torque of the axis at `place`; [`Evidence::NEVER`] for a
    /// place that the ring does not have. Its instant is the start of the frame that carried the last block on time, by the
    /// driver's clock.
    pub fn evidence(&self, place: usize) -> Evidence {
        self.master.ring().axes().get(place).map_or(Evidence::NEVER, Axis::evidence)
    }

    /// Runs one turn of the main loop. Keep interrupts off until it returns [`ControlPhase::Running`]; it writes the first
    /// transmit data itself, in the turn after [`ControlPhase::Prepare`], and stays in that phase until all are written.
    ///
    /// # Errors
    /// [`Error::Protocol`] with the fault of the phases; [`Error::Io`]; [`Error::Clock`].
    pub fn control(&mut self) -> Result<ControlPhase, Failure<P>> {
        if self.master.phase() == ControlPhase::Prepare {
            self.prepare()?;
        }
        let asic = self.port.state().map_err(Error::Io)?;
        let mut table = [Slave { mac_id: MacId::truncate(0), kind: 0 }; MacId::COUNT];
        let found = match (self.master.phase(), asic) {
            (ControlPhase::Waiting, Asic::Ready) => self.port.slaves(&mut table).map_err(Error::Io)?,
            _ => None,
        };
        let phase = self.master.control(asic, found.map(|count| table.get(..count).unwrap_or(&table)));
        match self.master.error() {
            Some(fault) => Err(Error::Protocol(fault)),
            None => Ok(phase),
        }
    }

    /// Repeats [`control`](Self::control) until the communication runs, for at most `limit_ns`; returns the phase that was reached.
    ///
    /// # Errors
    /// As [`control`](Self::control).
    pub fn start(&mut self, limit_ns: u64) -> Result<ControlPhase, Failure<P>> {
        let until_ns = self.now_ns()?.saturating_add(limit_ns);
        loop {
            let phase = self.control()?;
            if phase == ControlPhase::Running || self.now_ns()? >= until_ns {
                return Ok(phase);
            }
        }
    }

    /// Performs the exchange of an update period: reads the blocks of the last reception and writes the next commands. Call
    /// it from the NC interrupt, before anything else is calculated. `began_ns` is the start of the frame that began the
    /// period, by the driver's clock: the time of the interrupt.
    ///
    /// # Errors
    /// The first [`Error::Io`] or [`Error::Clock`]; every block that could be read or written was, and the next
    /// exchange continues.
    pub fn exchange(&mut self, began_ns: u64) -> Result<Exchanged, Failure<P>> {
        #[cfg(feature = "async")]
        {
            self.began_ns = Some(began_ns);
        }
        let Read { heard, torn, fault, clock } = self.read(began_ns);
        let frames = self.received.get();
        if frames != self.frames {
            self.frames = frames;
            self.master.frame_received();
        }
        self.torn = self.torn.saturating_add(torn.into());
        // The frame before brought them: rather too old than too young.
        let end_ns = began_ns.saturating_sub(self.master.config().periods.com_ns.into());
        let sent = self.master.ring().axes().each_ref().map(Axis::sent);
        let commands = self.master.exchange(&heard, end_ns);
        let written = self.write(&commands, &sent);
        let frames_late = self.frames_since(began_ns);
        self.late = self.late.saturating_add(frames_late.is_ok_and(|frames| frames > 0).into());
        fault.map_or(Ok(()), Err)?;
        written.map_err(Error::Io)?;
        clock.map_or(Ok(()), Err)?;
        Ok(Exchanged { frames_late: frames_late?, torn })
    }

    /// Leaves the stopped state after a time-out, an alarm or a stop by the caller; see [`Master::clear`].
    pub fn clear(&mut self) {
        self.master.clear();
    }

    /// Writes the first transmit data.
    fn prepare(&mut self) -> Result<(), Failure<P>> {
        let now_ns = self.now_ns()?;
        let sent = self.master.ring().axes().each_ref().map(Axis::sent);
        let commands = self.master.exchange(&[Heard::Nothing; N], now_ns);
        self.write(&commands, &sent).map_err(Error::Io)
    }

    /// Reads the blocks of one frame, if possible; otherwise those that are surely not halves of two.
    fn read(&mut self, began_ns: u64) -> Read<P, N> {
        let mut read = Read { heard: [Heard::Nothing; N], torn: false, fault: None, clock: None };
        let mut bank = (0, 0);
        for _ in 0..READS {
            bank = self.bank(began_ns, &mut read.clock);
            read.fault = None;
            for (place, heard) in read.heard.iter_mut().enumerate() {
                *heard = self.block(place).unwrap_or_else(|fault| {
                    read.fault.get_or_insert(Error::Io(fault));
                    Heard::Nothing
                });
            }
            let mixed = self.master.ring().is_torn(&read.heard) || self.has_changed(&read.heard);
            read.torn = mixed || self.bank(began_ns, &mut read.clock) != bank;
            if !read.torn {
                return read;
            }
        }
        for (place, heard) in read.heard.iter_mut().enumerate() {
            if !self.is_still(place, heard) {
                *heard = Heard::Nothing;
            }
        }
        if self.bank(began_ns, &mut read.clock) != bank {
            // They may look like one frame and are not.
            read.heard = [Heard::Nothing; N];
        }
        read
    }

    /// Returns what is another number once the bank may have been switched: the frames that have come and, if the ASIC switches it,
    /// those that have begun.
    fn bank(&mut self, began_ns: u64, fault: &mut Option<ClockError>) -> (u32, u32) {
        let begun = match self.master.config().timer {
            TimerSystem::External => Ok(0),
            TimerSystem::Internal => self.frames_since(began_ns),
        };
        let begun = begun.unwrap_or_else(|error| {
            fault.get_or_insert(error);
            u32::MAX
        });
        (self.received.get(), begun)
    }

    /// Returns the number of frames that have begun since the one at `began_ns`.
    fn frames_since(&mut self, began_ns: u64) -> Result<u32, ClockError> {
        let past_ns = self.now_ns()?.saturating_sub(began_ns);
        Ok(self.master.config().periods.frames_late(u32::try_from(past_ns).unwrap_or(u32::MAX)))
    }

    /// Reads the clock.
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.check.check(self.clock.now_ns()?)
    }

    /// Returns whether a block has another echo now, which means that the bank was switched, perhaps in the middle of the last block.
    /// The echo of a drive that was not on time before may stand still.
    fn has_changed(&mut self, heard: &[Heard; N]) -> bool {
        let axes = self.master.ring().axes();
        let mut good = heard.iter().enumerate().filter(|(_, heard)| heard.response().is_some());
        let lives = |place: usize| axes.get(place).is_some_and(|axis| axis.arrival() == Arrival::OnTime);
        let first = good.clone().find(|(place, _)| lives(*place)).or(good.next());
        first.is_some_and(|(place, before)| !self.is_still(place, before))
    }

    /// Returns whether a further reading of a block has the same echo. One that fails is no proof of that.
    fn is_still(&mut self, place: usize, before: &Heard) -> bool {
        let echo = |heard: &Heard| heard.response().map(|response| response.update_counter_echo);
        self.block(place).is_ok_and(|now| echo(&now) == echo(before))
    }

    fn block(&mut self, place: usize) -> Result<Heard, P::Error> {
        let (size, mut memory) = (self.master.config().size, [P::Word::default(); MOST_WORDS]);
        let words = words_of::<P>(size, &mut memory);
        twice(|| self.port.read(place, words))?;
        Ok(Heard::parse(size, words))
    }

    /// Writes every place, whatever fails, and tells its axis of each that was not written; returns the first fault.
    fn write(&mut self, commands: &[Command32; N], sent: &[Sent; N]) -> Result<(), P::Error> {
        let (size, mut result) = (self.master.config().size, Ok(()));
        for (place, (command, sent)) in commands.iter().zip(sent).enumerate() {
            let (mut memory, bytes) = ([P::Word::default(); MOST_WORDS], command.emit());
            let words = words_of::<P>(size, &mut memory);
            // The sizes agree.
            pack::to_words(bytes.get(..size.bytes()).unwrap_or_default(), words).unwrap_or(());
            let written = twice(|| self.port.write(place, words));
            if let (Err(_), Some(axis)) = (&written, self.master.ring_mut().axes_mut().get_mut(place)) {
                axis.not_sent(*sent);
            }
            result = result.and(written);
        }
        result
    }
}

/// The blocks of an exchange.
struct Read<P: Port, const N: usize> {
    heard: [Heard; N],
    torn: bool,
    fault: Option<Failure<P>>,
    clock: Option<ClockError>,
}

/// Returns as many of these words as a block has.
fn words_of<P: Port>(size: BlockSize, words: &mut [P::Word; MOST_WORDS]) -> &mut [P::Word] {
    let count = size.bytes().checked_div(P::Word::BYTES).unwrap_or(0);
    words.get_mut(..count).unwrap_or_default()
}
