//! A receiver that is elsewhere: typed access to its registers over a bus.

use core::fmt;

use super::{Event, EventS, Events, Register, RegisterRule, Registers};
use crate::dialect::Dialect;
use crate::error::Error;
use crate::message::{Access, Data, Length, LongRequest, ResourceError, ShortRequest};

/// How the registers of a receiver are reached: the memory that a PRU shares, SPI or a parallel bus to an FPGA.
pub trait RegisterBus {
    /// What can go wrong on the way.
    type Error;

    /// Reads registers from `address` on.
    ///
    /// # Errors
    /// Those of the bus.
    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes registers from `address` on, in the order of their addresses.
    ///
    /// # Errors
    /// Those of the bus.
    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Self::Error>;
}

/// Why an access to a receiver failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusError<E> {
    /// The bus failed.
    Bus(E),
    /// The receiver did not take the request, or the encoder refused it.
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

/// A receiver that is reached over a [`RegisterBus`], for example the firmware of the Motor Control SDK or the SICK IP core in the map of
/// the SDK.
///
/// Messages are started with `start_...` and asked for with `poll_...` until they give something; their ends are known by
/// the events FRES and FREL, which are taken then.
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
}

impl<B: RegisterBus> RemoteReceiver<B> {
    /// Over a bus; the dialect says in which order error codes stand.
    pub const fn new(dialect: Dialect, bus: B) -> Self {
        Self { bus, dialect }
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

    /// All registers. The bytes are not of one instant: for a position read only POS or VPOS.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn registers(&mut self) -> Result<Registers, BusError<B::Error>> {
        let mut bytes = [0; Registers::LEN];
        self.bus.read(0, &mut bytes).map_err(BusError::Bus)?;
        Ok(Registers::from_bytes(&self.dialect, bytes))
    }

    /// Takes the events that happened: reads them, and clears those that were read.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn take_events(&mut self) -> Result<Events, BusError<B::Error>> {
        let [high, low] = self.get(Register::EventH)?;
        let [safe] = self.get(Register::EventS)?;
        self.put(Register::EventH, &[!high, !low])?;
        self.put(Register::EventS, &[!safe])?;
        let drive = Event::from_bits_retain(u16::from_be_bytes([high, low]));
        Ok(Events { drive, safe: EventS::from_bits_retain(safe) })
    }

    /// Starts a short message.
    ///
    /// # Errors
    /// [`Error::Busy`] while one is under way; those of the bus.
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), BusError<B::Error>> {
        if self.get::<2>(Register::OnlineStatus1)?.last().is_none_or(|low| low & 1 == 0) {
            return Err(BusError::Link(Error::Busy));
        }
        self.put(Register::EventS, &[!EventS::FRES.bits()])?;
        let (read, register) = match request {
            ShortRequest::Read(register) => (0x80, register),
            ShortRequest::Write(register, value) => {
                self.put(Register::SPcData, &[value])?;
                (0, register)
            }
        };
        // With bit 6 set, which is not looked at: 3Fh is the idle mark and no write to 7Fh.
        self.put(Register::SlaveRegCtrl, &[read | register.address()])
    }

    /// Whether the short message has ended, and the data that it brought if it was a reading.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn poll_short(&mut self) -> Result<Option<u8>, BusError<B::Error>> {
        let [events] = self.get(Register::EventS)?;
        if events & EventS::FRES.bits() == 0 {
            return Ok(None);
        }
        self.put(Register::EventS, &[!EventS::FRES.bits()])?;
        let [data] = self.get(Register::SPcData)?;
        Ok(Some(data))
    }

    /// Starts a long message.
    ///
    /// # Errors
    /// [`Error::Busy`] while one is under way; those of the bus.
    pub fn start_long(&mut self, request: &LongRequest) -> Result<(), BusError<B::Error>> {
        if self.get::<2>(Register::OnlineStatusD)?.last().is_none_or(|low| low & 2 == 0) {
            return Err(BusError::Link(Error::Busy));
        }
        self.put(Register::EventL, &[!(Event::FREL | Event::ANS).bits().to_le_bytes()[0]])?;
        if let Access::Write(data) = &request.access {
            self.put(Register::PcBuffer, data.as_bytes())?;
        }
        if let Some(offset) = request.offset {
            self.put(Register::PcOff, &(offset.get() | 0x8000).to_be_bytes())?;
        }
        self.put(Register::PcAdd, &request.header())?;
        self.put(Register::PcCtrl, &[1])
    }

    /// Whether the long message has ended, and what it brought: nothing after a write.
    ///
    /// # Errors
    /// [`Error::NotAccepted`] if the answer failed (ANS), [`Error::Resource`] if the encoder refused; those of the bus.
    pub fn poll_long(&mut self) -> Result<Option<Data>, BusError<B::Error>> {
        let [events] = self.get(Register::EventL)?;
        let [frel, ans] = [Event::FREL, Event::ANS].map(|event| event.bits().to_le_bytes()[0]);
        if events & frel == 0 {
            return Ok(None);
        }
        self.put(Register::EventL, &[!(frel | ans)])?;
        if events & ans != 0 {
            return Err(BusError::Link(Error::NotAccepted { tries: 1 }));
        }
        let [header, _] = self.get(Register::PcAdd)?;
        let buffer: [u8; 8] = self.get(Register::PcBuffer)?;
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
