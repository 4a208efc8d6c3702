//! A remote receiver: typed access to its registers over a bus.

use core::fmt;

use super::{Event, EventS, Events, Register, RegisterRule, Registers};
use crate::dialect::Dialect;
use crate::error::Error;
use crate::message::{Access, Data, Length, LongRequest, ResourceError, ShortRequest};

/// How the registers of a receiver are accessed: memory shared with a PRU, or SPI or a parallel bus to an FPGA.
pub trait RegisterBus {
    /// The error of the bus.
    type Error;

    /// Reads registers, starting at `address`.
    ///
    /// # Errors
    /// The errors of the bus.
    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes registers, starting at `address`, in the order of their addresses.
    ///
    /// # Errors
    /// The errors of the bus.
    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Self::Error>;
}

/// The end of a long message in EVENT_L.
const END_OF_LONG: u8 = (Event::FREL.bits() | Event::ANS.bits()).to_le_bytes()[0];
/// The link was restarted, in EVENT_H, and the encoder sends INIT, in EVENT_L.
const RESTARTED: u8 = Event::PRST.bits().to_be_bytes()[0];
const INIT: u8 = Event::MIN.bits().to_le_bytes()[0];
/// Message reset in SYS_CTRL.
const MRST: u8 = 0x40;

/// Why an access to a receiver failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusError<E> {
    /// The bus failed.
    Bus(E),
    /// The receiver did not accept the request, or the encoder refused it.
    Link(Error),
}

impl<E: fmt::Display> fmt::Display for BusError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => error.fmt(f),
            Self::Link(error) => error.fmt(f),
        }
    }
}

impl<E: core::error::Error> core::error::Error for BusError<E> {}

/// A receiver that is accessed over a [`RegisterBus`]: the firmware of the Motor Control SDK, or the SICK IP core.
///
/// The two are different devices:
///
/// | | SDK, [`RegisterRule::Ti`] | IP core, [`RegisterRule::Sick`] |
/// |---|---|---|
/// | map | 56h bytes of memory | 40h registers; those of the encoder are at 40h..7Fh |
/// | an event is cleared | by writing back the register without it; a 1 that is written is an event | by writing 0 to it; 1 changes nothing |
/// | short message | SLAVE_REG_CTRL, S_PC_DATA | an access to the encoder's register; PC_DATA |
/// | under way | FRES, FREL in the online status | what was started here |
///
/// The firmware of the SDK also sets its events by reading and writing. If both access them at the same time, an event can be
/// lost or come twice; rely on the online status.
///
/// Messages are started with `start_...` and polled with `poll_...` until there is a result; the end of a message is
/// recognised by the event FRES or FREL, which is then cleared. A restart of the link ends them too. A message to an encoder
/// that does not answer has no end of its own (the core repeats it for ever, p. 72):
/// [`reset_messages`](RemoteReceiver::reset_messages) drops it.
///
/// ```
/// use hdsl::Dialect;
/// use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
/// use hdsl::registers::{RegisterBus, RemoteReceiver, Registers};
///
/// /// Memory that a receiver shares; here one that answers at once.
/// struct Shared([u8; Registers::LEN]);
///
/// impl RegisterBus for Shared {
///     type Error = core::convert::Infallible;
///
///     fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Self::Error> {
///         let from = usize::from(address);
///         bytes.copy_from_slice(&self.0[from..from + bytes.len()]);
///         Ok(())
///     }
///
///     fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Self::Error> {
///         let from = usize::from(address);
///         self.0[from..from + bytes.len()].copy_from_slice(bytes);
///         match (address, bytes) {
///             // SLAVE_REG_CTRL: S_PC_DATA is 07h, event FRES.
///             (0x40, _) => (self.0[0x37], self.0[0x3d]) = (7, 0x01),
///             // LSTA in PC_CTRL: PC_BUFFER, event FREL.
///             (0x2c, [1]) => {
///                 self.0[0x20..0x28].copy_from_slice(b"RESOLUTN");
///                 self.0[0x05] = 0x02;
///             }
///             _ => {}
///         }
///         Ok(())
///     }
/// }
///
/// let mut memory = [0; Registers::LEN];
/// // FREL and FRES in the online status.
/// (memory[0x51], memory[0x53]) = (0x02, 0x01);
/// let mut remote = RemoteReceiver::new(Dialect::TI, Shared(memory));
///
/// remote.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
/// assert_eq!(remote.poll_short(), Ok(Some(7)));
/// remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
/// let name = loop {
///     if let Some(data) = remote.poll_long().unwrap() {
///         break data;
///     }
/// };
/// assert_eq!(name.as_bytes(), b"RESOLUTN");
/// ```
#[derive(Debug)]
pub struct RemoteReceiver<B> {
    bus: B,
    dialect: Dialect,
    /// The short and the long message that were started here.
    under_way: [bool; 2],
    /// Their ends, if they were taken along with other events: FRES; FREL and ANS.
    ended: [u8; 2],
    /// Whether the link has restarted since then.
    dropped: [bool; 2],
    /// The messages were reset, and INIT has not yet been seen to come and go.
    reset: Reset,
    /// Events that were cleared in the receiver and not yet returned.
    kept: [u8; 3],
}

/// How far a reset of the messages is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reset {
    Done,
    Asked,
    /// The encoder sends INIT.
    Answered,
}

impl<B: RegisterBus> RemoteReceiver<B> {
    /// Creates the access over a bus; the dialect determines the order of error codes.
    pub const fn new(dialect: Dialect, bus: B) -> Self {
        let (under_way, ended) = ([false; 2], [0; 2]);
        Self { bus, dialect, under_way, ended, dropped: [false; 2], reset: Reset::Done, kept: [0; 3] }
    }

    /// The bus.
    pub const fn bus(&mut self) -> &mut B {
        &mut self.bus
    }

    fn get<const N: usize>(&mut self, register: Register) -> Result<[u8; N], BusError<B::Error>> {
        let mut bytes = [0; N];
        self.bus.read(register as u8, &mut bytes).map_err(BusError::Bus)?;
        Ok(bytes)
    }

    fn put(&mut self, register: Register, bytes: &[u8]) -> Result<(), BusError<B::Error>> {
        self.bus.write(register as u8, bytes).map_err(BusError::Bus)
    }

    const fn is_core(&self) -> bool {
        matches!(self.dialect.registers, RegisterRule::Sick)
    }

    /// Reads all registers; for the IP core, all but the bank of safe channel 2. The bytes are not from the same
    /// instant; to get a position, read only POS or VPOS.
    ///
    /// # Errors
    /// The errors of the bus.
    pub fn registers(&mut self) -> Result<Registers, BusError<B::Error>> {
        if self.is_core() {
            let mut bytes = [0; Registers::CORE_LEN];
            self.bus.read(0, &mut bytes).map_err(BusError::Bus)?;
            return Ok(Registers::from_core(&bytes, None));
        }
        let mut bytes = [0; Registers::LEN];
        self.bus.read(0, &mut bytes).map_err(BusError::Bus)?;
        Ok(Registers::from_bytes(&self.dialect, bytes))
    }

    /// Clears events; `present` holds those that were read.
    fn clear<const N: usize>(
        &mut self,
        register: Register,
        present: [u8; N],
        taken: [u8; N],
    ) -> Result<(), BusError<B::Error>> {
        let mut written = taken.map(|taken| !taken);
        if !self.is_core() {
            for (byte, present) in written.iter_mut().zip(present) {
                *byte &= present;
            }
        }
        self.put(register, &written)
    }

    /// Takes the events that have occurred: reads them, and clears those that were read. The end of a message is among them,
    /// and it is still found by `poll_...`. If the bus fails, the next call returns them.
    ///
    /// # Errors
    /// The errors of the bus.
    pub fn take_events(&mut self) -> Result<Events, BusError<B::Error>> {
        let [high, low] = self.get(Register::EventH)?;
        let [safe] = self.get(Register::EventS)?;
        self.note([high, low, safe]);
        let [kept_high, kept_low, kept_safe] = &mut self.kept;
        (*kept_high, *kept_low, *kept_safe) = (*kept_high | high, *kept_low | low, *kept_safe | safe);
        self.clear(Register::EventH, [high, low], [high, low])?;
        self.clear(Register::EventS, [safe], [safe])?;
        let [high, low, safe] = core::mem::take(&mut self.kept);
        let drive = Event::from_bits_retain(u16::from_be_bytes([high, low]));
        Ok(Events { drive, safe: EventS::from_bits_retain(safe) })
    }

    /// Notes what EVENT_H, EVENT_L and EVENT_S say about the messages.
    fn note(&mut self, [high, low, safe]: [u8; 3]) {
        let ([short, long], [short_ended, long_ended]) = (self.under_way, &mut self.ended);
        if short {
            *short_ended |= safe & EventS::FRES.bits();
        }
        if long {
            *long_ended |= low & END_OF_LONG;
        }
        if high & RESTARTED != 0 || safe & EventS::PRST.bits() != 0 {
            self.dropped = self.under_way;
            self.reset = Reset::Done;
        } else if low & INIT != 0 && self.reset == Reset::Asked {
            self.reset = Reset::Answered;
        }
    }

    /// Clears the events that a message waits for, before it is started: its end, and a restart of the link. The event of a
    /// restart is kept for [`take_events`](Self::take_events).
    fn prepare(&mut self, message: usize, end: [u8; 3]) -> Result<(), BusError<B::Error>> {
        let [high, low] = self.get(Register::EventH)?;
        let [safe] = self.get(Register::EventS)?;
        self.note([high, low, safe]);
        let (high_taken, safe_taken) = (high & RESTARTED, safe & EventS::PRST.bits());
        let [kept_high, kept_low, kept_safe] = &mut self.kept;
        (*kept_high, *kept_safe) = (*kept_high | high_taken, *kept_safe | safe_taken);
        let [_, end_low, end_safe] = end;
        // INIT is raised again while it lasts.
        let low_taken = end_low | if self.reset == Reset::Done { 0 } else { low & INIT };
        *kept_low |= low_taken & INIT;
        if high_taken != 0 {
            self.clear(Register::EventH, [high], [high_taken])?;
        }
        if low_taken != 0 {
            self.clear(Register::EventL, [low], [low_taken])?;
        }
        if end_safe | safe_taken != 0 {
            self.clear(Register::EventS, [safe], [end_safe | safe_taken])?;
        }
        if self.reset == Reset::Answered && low & INIT == 0 && !self.is_init_shown()? {
            self.reset = Reset::Done;
        }
        if self.reset != Reset::Done {
            return Err(BusError::Link(Error::Busy));
        }
        if let (Some(ended), Some(dropped)) = (self.ended.get_mut(message), self.dropped.get_mut(message)) {
            (*ended, *dropped) = (0, false);
        }
        Ok(())
    }

    /// Returns whether the online status says that the encoder sends INIT. (The core raises the event again at once.)
    fn is_init_shown(&mut self) -> Result<bool, BusError<B::Error>> {
        Ok(!self.is_core() && self.get::<2>(Register::OnlineStatusD)?[1] & INIT != 0)
    }

    /// Drops the messages under way (MRST), for an encoder that does not answer. No other message can be started until the
    /// encoder has answered INIT or the link has restarted.
    ///
    /// # Errors
    /// The errors of the bus.
    pub fn reset_messages(&mut self) -> Result<(), BusError<B::Error>> {
        let [low] = self.get(Register::EventL)?;
        if low & INIT != 0 {
            self.kept[1] |= INIT;
            self.clear(Register::EventL, [low], [INIT])?;
        }
        let [control] = self.get(Register::SysCtrl)?;
        self.put(Register::SysCtrl, &[control | MRST])?;
        (self.under_way, self.ended, self.dropped) = ([false; 2], [0; 2], [false; 2]);
        self.reset = Reset::Asked;
        Ok(())
    }

    /// Starts a short message.
    ///
    /// # Errors
    /// [`Error::Busy`] while one is under way or the messages are being reset; the errors of the bus.
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), BusError<B::Error>> {
        let [short, _] = self.under_way;
        if if self.is_core() { short } else { self.get::<2>(Register::OnlineStatus1)?[1] & 1 == 0 } {
            return Err(BusError::Link(Error::Busy));
        }
        self.prepare(0, [0, 0, EventS::FRES.bits()])?;
        match (request, self.is_core()) {
            // What this reading returns means nothing.
            (ShortRequest::Read(register), true) => {
                self.bus.read(register.address(), &mut [0]).map_err(BusError::Bus)?;
            }
            (ShortRequest::Write(register, value), true) => {
                self.bus.write(register.address(), &[value]).map_err(BusError::Bus)?;
            }
            // With bit 6 set, which is not looked at: 3Fh is the idle mark and no write to 7Fh.
            (ShortRequest::Read(register), false) => self.put(Register::SlaveRegCtrl, &[0x80 | register.address()])?,
            (ShortRequest::Write(register, value), false) => {
                self.put(Register::SPcData, &[value])?;
                self.put(Register::SlaveRegCtrl, &[register.address()])?;
            }
        }
        self.under_way[0] = true;
        Ok(())
    }

    /// Returns whether the short message has ended, and its data if it was a read.
    ///
    /// # Errors
    /// [`Error::Dropped`] if the link was restarted meanwhile: it is not known whether the encoder has received the message; the
    /// errors of
    /// the bus.
    pub fn poll_short(&mut self) -> Result<Option<u8>, BusError<B::Error>> {
        let [safe] = self.get(Register::EventS)?;
        self.note([0, 0, safe]);
        if core::mem::take(&mut self.dropped[0]) {
            self.under_way[0] = false;
            return Err(BusError::Link(Error::Dropped));
        }
        if (safe | self.ended[0]) & EventS::FRES.bits() == 0 {
            return Ok(None);
        }
        self.clear(Register::EventS, [safe], [EventS::FRES.bits()])?;
        let [data] = self.get(if self.is_core() { Register::PcData } else { Register::SPcData })?;
        (self.under_way[0], self.ended[0]) = (false, 0);
        Ok(Some(data))
    }

    /// Starts a long message.
    ///
    /// # Errors
    /// [`Error::Busy`] while one is under way or the messages are being reset; the errors of the bus.
    pub fn start_long(&mut self, request: &LongRequest) -> Result<(), BusError<B::Error>> {
        let [_, long] = self.under_way;
        if if self.is_core() { long } else { self.get::<2>(Register::OnlineStatusD)?[1] & 2 == 0 } {
            return Err(BusError::Link(Error::Busy));
        }
        self.prepare(1, [0, END_OF_LONG, 0])?;
        if let Access::Write(data) = &request.access {
            self.put(Register::PcBuffer, data.as_bytes())?;
        }
        if let Some(offset) = request.offset {
            self.put(Register::PcOff, &(offset.get() | 0x8000).to_be_bytes())?;
        }
        self.put(Register::PcAdd, &request.header())?;
        self.put(Register::PcCtrl, &[1])?;
        self.under_way[1] = true;
        Ok(())
    }

    /// Returns whether the long message has ended, and its data: none after a write.
    ///
    /// # Errors
    /// [`Error::Dropped`] if the link was restarted meanwhile, [`Error::NotAccepted`] if the answer failed (ANS),
    /// [`Error::Resource`] if the encoder refused; the errors of the bus.
    pub fn poll_long(&mut self) -> Result<Option<Data>, BusError<B::Error>> {
        let [high, low] = self.get(Register::EventH)?;
        self.note([high, low, 0]);
        if core::mem::take(&mut self.dropped[1]) {
            self.under_way[1] = false;
            return Err(BusError::Link(Error::Dropped));
        }
        let ended = Event::from_bits_retain((low | self.ended[1]).into());
        if !ended.contains(Event::FREL) {
            return Ok(None);
        }
        self.clear(Register::EventL, [low], [END_OF_LONG])?;
        if ended.contains(Event::ANS) {
            (self.under_way[1], self.ended[1]) = (false, 0);
            return Err(BusError::Link(Error::NotAccepted { tries: 1 }));
        }
        let [header, _] = self.get(Register::PcAdd)?;
        let buffer: [u8; 8] = self.get(Register::PcBuffer)?;
        (self.under_way[1], self.ended[1]) = (false, 0);
        if header & 0x20 != 0 {
            let [first, second, ..] = buffer;
            let error = match self.dialect.registers {
                RegisterRule::Sick => ResourceError::new(second, first),
                RegisterRule::Ti => ResourceError::new(first, second),
            };
            return Err(BusError::Link(Error::Resource { error }));
        }
        let length = if header & 0x40 != 0 { Length::in_header(header) } else { Length::None };
        Data::new(buffer.get(..length.bytes()).unwrap_or(&buffer)).map(Some).map_err(BusError::Link)
    }
}
