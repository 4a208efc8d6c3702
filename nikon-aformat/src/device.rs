//! The encoder's side without I/O, for simulators and test benches.
//!
//! A [`Device`] receives a request, frame by frame or all at once, and returns what it answers and when; [`Encoders`] holds
//! several of them on one line. Position, alarms, temperature and the rest are set from outside; EEPROM, addresses, eight-fold
//! resets and busy times are built in. Faults can be switched on to see how a master handles them.
//!
//! The points that the documents leave open are set by a [`Behaviour`]. A damaged request, a command of a later version and
//! a write to the maker's addresses are not answered. A reset takes effect with the eighth request in succession; the
//! responses of other encoders do not restart the count. While the encoder is busy, writes are repeated in the response but
//! not carried out. An EEPROM access without a bank uses bank 0.
//!
//! ```
//! use nikon_aformat::device::Device;
//! use nikon_aformat::{BitRate, EncoderAddress, Operation, Resolution, Request};
//!
//! let mut encoder = Device::<1>::new(EncoderAddress::ZERO, Resolution::default(), BitRate::Mbit4);
//! encoder.set_position(0x1_2345, 7);
//! let request = Request::new(EncoderAddress::ZERO, Operation::Abs40);
//! // the delimiter of its only frame at 4.5 us
//! let answer = encoder.hear(request.emit().units().as_slice(), 4_500).expect("an answer");
//! assert_eq!((answer.start_ns, answer.end_ns), (7_300, 25_300));
//! assert_eq!(answer.frames.frames(), 4);
//! ```

mod behaviour;
mod encoders;
mod memory;
mod transmission;

pub use behaviour::{Behaviour, Ea, FirstRead, Restart, ShownAddress, Shows};
pub use encoders::Encoders;
pub use transmission::{Fault, Transmission};

use nrz_line::Window;

use crate::command::Command;
use crate::data::Data;
use crate::device::memory::Memory;
use crate::error::Error;
use crate::frame::RequestFrame;
use crate::layout::FRAME_BITS;
use crate::number::{EncoderAddress, EncoderId, U10, U19};
use crate::operation::Operation;
use crate::request::{Frames, Request};
use crate::resolution::Resolution;
use crate::response::Response;
use crate::status::{Alm, EncoderStatus, PmAlm};
use crate::temperature::Temperature;
use crate::timing::BitRate;
use crate::type_word::TypeWord;

/// The pause after which a frame begins a new request. No upper limit is documented for the gap between the frames of a
/// request; early drivers left 10 us.
const MAX_FRAME_GAP_NS: u32 = 20_000;

/// How long an encoder is busy with a write, an address setting or a reset: the longest time of "Nikon Protocol Design".
const BUSY_NS: u32 = 30_000_000;

/// The largest distance, in bits, between frames of another encoder's response.
const RESPONSE_PAUSE_BITS: u32 = 4;

/// The values that the resets of an encoder have set to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Zero {
    /// The single-turn position to be reported as 0.
    pub single_turn: u32,
    /// The turn to be reported as 0.
    pub turns: u32,
}

/// An encoder with `BANKS` banks of 256 EEPROM words; version 2.1 has one bank.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Device<const BANKS: usize> {
    ea: EncoderAddress,
    resolution: Resolution,
    rate: BitRate,
    id: EncoderId,
    single_turn: u32,
    turns: u32,
    /// The zeros, which are subtracted from the position.
    zero: Zero,
    velocity: i32,
    acceleration: i16,
    coefficient: U19,
    temperature: Temperature,
    /// Alarms that are set, and alarms whose cause is still present.
    alm: Alm,
    causes: Alm,
    pm_alm: PmAlm,
    memory: Memory<BANKS>,
    fault: Fault,
    behaviour: Behaviour,
    repeated: Option<Request>,
    repeats: u8,
    received: [RequestFrame; Frames::MAX],
    len: u8,
    /// Frames that follow within this time are not judged; it is counted in ns from delimiter to delimiter.
    deaf_ns: Option<u32>,
    last_frame_ns: u64,
}

impl<const BANKS: usize> Device<BANKS> {
    /// Creates an encoder at position 0 without alarms, at 25 degrees Celsius, with the type word of its resolution.
    pub const fn new(ea: EncoderAddress, resolution: Resolution, rate: BitRate) -> Self {
        let mut memory = Memory::new();
        memory.set(0, TypeWord::EEPROM_ADDRESS, TypeWord::of(resolution).0);
        Self {
            ea,
            resolution,
            rate,
            id: EncoderId::truncate(0),
            single_turn: 0,
            turns: 0,
            zero: Zero { single_turn: 0, turns: 0 },
            velocity: 0,
            acceleration: 0,
            coefficient: U19::truncate(0),
            temperature: Temperature(U10::truncate(100)),
            alm: Alm::empty(),
            causes: Alm::empty(),
            pm_alm: PmAlm::empty(),
            memory,
            fault: Fault::None,
            behaviour: Behaviour::new(),
            repeated: None,
            repeats: 0,
            received: [RequestFrame::mdf(crate::frame::FrameCode::Fc0, 0); Frames::MAX],
            len: 0,
            deaf_ns: None,
            last_frame_ns: 0,
        }
    }

    /// Its address.
    pub const fn ea(&self) -> EncoderAddress {
        self.ea
    }

    /// Turns the shaft: sets counts and turns before the resets are applied.
    pub const fn set_position(&mut self, single_turn: u32, turns: u32) {
        self.single_turn = single_turn;
        self.turns = turns;
    }

    /// Sets velocity and acceleration of version 3.0.
    pub const fn set_motion(&mut self, velocity: i32, acceleration: i16) {
        self.velocity = velocity;
        self.acceleration = acceleration;
    }

    /// Sets the velocity coefficient of version 3.0.
    pub const fn coefficient(&self) -> U19 {
        self.coefficient
    }

    /// Sets the temperature, which EEPROM word 0xf9 also shows.
    pub const fn set_temperature(&mut self, temperature: Temperature) {
        self.temperature = temperature;
        self.memory.set(0, Temperature::EEPROM_ADDRESS, temperature.raw());
    }

    /// The identification code.
    pub const fn id(&self) -> EncoderId {
        self.id
    }

    /// Sets the identification code.
    pub const fn set_id(&mut self, id: EncoderId) {
        self.id = id;
    }

    /// Sets the predictive maintenance notices of version 3.0.
    pub const fn set_pm_alm(&mut self, pm_alm: PmAlm) {
        self.pm_alm = pm_alm;
    }

    /// Starts the cause of these alarms, which sets the alarms.
    pub const fn raise_alarms(&mut self, alarms: Alm) {
        self.causes = self.causes.union(alarms);
        self.alm = self.alm.union(alarms);
    }

    /// Ends the cause of these alarms. An alarm stays set until a reset finds its cause gone; BUSY clears by itself.
    pub const fn end_alarms(&mut self, alarms: Alm) {
        self.causes = self.causes.difference(alarms);
        self.alm = self.alm.difference(alarms.intersection(Alm::BUSY.union(Alm::BUSY_S)));
    }

    /// Sets the points that the documents leave open; takes effect at once.
    pub const fn set_behaviour(&mut self, behaviour: Behaviour) {
        self.behaviour = behaviour;
    }

    /// Switches a fault on, or off with [`Fault::None`].
    pub const fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Returns the alarms that the encoder would report at `now_ns`.
    pub const fn alm(&self, now_ns: u64) -> Alm {
        if self.memory.is_busy(now_ns) { self.alm.union(Alm::MEMBUSY) } else { self.alm.difference(Alm::MEMBUSY) }
    }

    /// Returns a word of the EEPROM, for inspecting it.
    pub const fn eeprom(&self, bank: u8, address: u8) -> Option<u16> {
        self.memory.get(bank, address)
    }

    /// Sets a word of the EEPROM, for preparing it.
    pub const fn set_eeprom(&mut self, bank: u8, address: u8, data: u16) {
        self.memory.set(bank, address, data);
    }

    /// The values that the resets have set to 0.
    pub const fn zero(&self) -> Zero {
        self.zero
    }

    /// Returns the position as a response carries it.
    pub const fn abs(&self) -> crate::number::U40 {
        let Zero { single_turn, turns } = self.zero;
        self.resolution.compose(self.single_turn.wrapping_sub(single_turn), self.turns.wrapping_sub(turns))
    }

    /// Takes frames that were received back to back, the last delimiter at `end_ns`: content bits, the first on the line in bit
    /// 0, or `None` for a frame whose delimiter reads 0. Returns the answer once a request is complete.
    pub fn hear(&mut self, frames: &[Option<u16>], end_ns: u64) -> Option<Transmission> {
        let frame_ns = u64::from(self.rate.bits_ns(FRAME_BITS));
        let (mut answer, mut left) = (None, u64::try_from(frames.len()).unwrap_or(u64::MAX));
        for frame in frames {
            left = left.saturating_sub(1);
            let ended_ns = end_ns.saturating_sub(frame_ns.saturating_mul(left));
            match *frame {
                Some(content) => answer = self.frame(content, ended_ns).or(answer),
                None => self.framing_error(ended_ns),
            }
        }
        answer
    }

    fn frame(&mut self, content: u16, now_ns: u64) -> Option<Transmission> {
        if self.is_deaf(now_ns) {
            return None;
        }
        if content & 7 == u16::from(Response::SYNC_CODE) && self.len == 0 {
            // Another encoder speaks.
            self.deaf_ns = Some(self.rate.bits_ns(FRAME_BITS.saturating_add(RESPONSE_PAUSE_BITS)));
            return None;
        }
        let Ok(frame) = RequestFrame::from_content(content) else {
            self.misheard();
            return None;
        };
        *self.received.get_mut(usize::from(self.len))? = frame;
        self.len = self.len.saturating_add(1);
        match Request::parse(self.received.get(..usize::from(self.len))?) {
            Err(Error::Truncated { .. }) => None,
            Err(_) => {
                self.misheard();
                None
            }
            Ok(request) => {
                self.len = 0;
                let response = self.act(request, now_ns)?;
                self.send(request, response, now_ns)
            }
        }
    }

    /// Takes a frame whose delimiter, at `end_ns`, reads 0: the request is damaged.
    pub fn framing_error(&mut self, end_ns: u64) {
        if !self.is_deaf(end_ns) {
            self.misheard();
        }
    }

    /// Handles damage: the rest of a damaged request is not judged, and the count of a reset restarts.
    fn misheard(&mut self) {
        self.deaf_ns = Some(self.rate.bits_ns(FRAME_BITS).saturating_add(MAX_FRAME_GAP_NS));
        if self.behaviour.restart == Restart::Any {
            self.repeated = None;
            self.repeats = 0;
        }
        self.len = 0;
    }

    /// Returns whether the data arriving now belong to a part that is not judged.
    fn is_deaf(&mut self, now_ns: u64) -> bool {
        let pause_ns = now_ns.saturating_sub(self.last_frame_ns);
        self.last_frame_ns = now_ns;
        if self.deaf_ns.is_some_and(|deaf_ns| pause_ns <= deaf_ns.into()) {
            return true;
        }
        self.deaf_ns = None;
        let longest_gap_ns = self.rate.bits_ns(FRAME_BITS).saturating_add(MAX_FRAME_GAP_NS);
        if pause_ns > longest_gap_ns.into() {
            self.len = 0;
        }
        false
    }

    /// Executes a valid request and returns the answer; `None` if it is for another encoder or not understood, or with
    /// [`Fault::Silent`].
    pub fn answer(&mut self, request: Request, now_ns: u64) -> Option<Response> {
        self.act(request, now_ns).filter(|_| self.fault != Fault::Silent)
    }

    fn act(&mut self, request: Request, now_ns: u64) -> Option<Response> {
        self.count(request);
        if request.check(self.resolution).is_err() || !self.is_meant(request) {
            return None;
        }
        let old = self.ea;
        let takes_effect = request.command().is_reset() && self.repeats == request.command().repeats();
        if takes_effect && self.behaviour.reset_shows == Shows::Eighth {
            self.reset(request, now_ns);
        }
        let response = self.respond(request, old, now_ns);
        if takes_effect && self.behaviour.reset_shows == Shows::Ninth {
            self.reset(request, now_ns);
        }
        response
    }

    fn respond(&mut self, request: Request, old: EncoderAddress, now_ns: u64) -> Option<Response> {
        let is_first_read = request.command() == Command::EepromRead && !self.memory.is_busy(now_ns);
        let es = EncoderStatus::of_alarms(self.alm(now_ns));
        let layout = request.layout(self.resolution);
        let abs = self.abs();
        let (velocity, alm, temperature) = (self.velocity, self.alm(now_ns), self.temperature);
        let status = Data::Status { alm, pm_alm: self.pm_alm };
        let data = match request.operation {
            Operation::Abs17 | Operation::Abs17Mt => return Some(Response::abs17(self.ea, es, abs.low17())),
            Operation::Abs40 | Operation::Abs40Mt => Data::Abs40 { abs },
            Operation::Abs24Low | Operation::Abs24LowMt => match layout {
                crate::layout::Layout::Abs40Vel => Data::Abs40Vel { abs, velocity },
                _ => Data::Abs24 { abs: abs.low24() },
            },
            Operation::Abs24High | Operation::Abs24HighMt => Data::Abs24High { abs: abs.high24() },
            Operation::Status | Operation::StatusMt => status,
            Operation::ClearStatus
            | Operation::ClearMultiturn
            | Operation::ClearStatusMultiturn
            | Operation::SetAddress1
            | Operation::ZeroPreset => match layout {
                crate::layout::Layout::Abs24 => Data::Abs24 { abs: abs.low24() },
                _ => status,
            },
            Operation::Temperature => Data::Temperature { temperature },
            Operation::Abs24Vel | Operation::Abs24VelMt => Data::Abs24Vel { abs: abs.low24(), velocity },
            Operation::Abs24VelAcc | Operation::Abs24VelAccMt => {
                Data::Abs24VelAcc { abs: abs.low24(), velocity, acceleration: self.acceleration }
            }
            Operation::Abs24Status | Operation::Abs24StatusMt => Data::Abs24Status { abs: abs.low24(), alm },
            Operation::Abs24Temp | Operation::Abs24TempMt => Data::Abs24Temp { abs: abs.low24(), temperature },
            memory => self.access(memory, request.ea, now_ns)?,
        };
        // An access makes the memory busy, and its response shows it.
        let hidden = is_first_read && self.behaviour.first_read == FirstRead::Ready;
        let alm = if hidden { self.alm } else { self.alm(now_ns) };
        let ea = match request.command() {
            Command::SetAddress1 | Command::SetAddress2 if self.behaviour.shown_address == ShownAddress::New => {
                request.ea
            }
            Command::SetAddress1 | Command::SetAddress2 => old,
            _ => self.ea,
        };
        Some(Response::new(ea, request.command(), EncoderStatus::of_alarms(alm), data))
    }

    /// Returns whether this encoder is addressed.
    fn is_meant(&self, request: Request) -> bool {
        match request.operation {
            Operation::SetAddress1 | Operation::IdRead2 | Operation::IdWrite2 { .. } => true,
            Operation::SetAddress2 { id } => id == self.id,
            _ if request.command().is_multi_response() => self.behaviour.ea == Ea::All || self.ea <= request.ea,
            _ => self.ea == request.ea,
        }
    }

    /// Counts how many times the same request has come in succession.
    fn count(&mut self, request: Request) {
        if self.behaviour.restart == Restart::Own && !self.is_meant(request) {
            return;
        }
        if self.repeated != Some(request) {
            self.repeats = 0;
        }
        self.repeated = Some(request);
        self.repeats = self.repeats.saturating_add(1);
    }

    /// Applies the effect of the eighth request of a reset.
    fn reset(&mut self, request: Request, now_ns: u64) {
        let command = request.command();
        self.repeats = 0;
        self.memory.busy(now_ns, BUSY_NS);
        match command {
            Command::ZeroPreset => self.zero.single_turn = self.single_turn,
            Command::SetAddress1 => self.ea = request.ea,
            _ => {}
        }
        if matches!(command, Command::ClearMultiturn | Command::ClearStatusMultiturn) {
            self.zero.turns = self.turns;
        }
        if matches!(command, Command::ClearStatus | Command::ClearStatusMultiturn) {
            self.alm = self.causes;
        }
    }

    /// Handles EEPROM, identification code, address and coefficient.
    fn access(&mut self, operation: Operation, ea: EncoderAddress, now_ns: u64) -> Option<Data> {
        let busy = self.memory.is_busy(now_ns);
        Some(match operation {
            Operation::EepromRead { address } => Data::Eeprom {
                data: self.memory.read(0, address, now_ns).unwrap_or(self.behaviour.undetermined),
                address,
            },
            Operation::EepromReadBank { bank, address } => {
                let bank_error = !Memory::<BANKS>::has(bank);
                let data = self.memory.read(bank, address, now_ns).unwrap_or(self.behaviour.undetermined);
                Data::EepromBank { data, bank, address, bank_error }
            }
            Operation::EepromWrite { address, data } => {
                self.memory.write(0, address.get(), data, now_ns);
                Data::Eeprom { data, address: address.get() }
            }
            Operation::EepromWriteBank { bank, address, data } => {
                self.memory.write(bank, address, data, now_ns);
                Data::EepromBank { data, bank, address, bank_error: !Memory::<BANKS>::has(bank) }
            }
            Operation::IdRead1 | Operation::IdRead2 => Data::Id { id: self.id },
            Operation::IdWrite1 { id } | Operation::IdWrite2 { id } => {
                if !busy {
                    self.id = id;
                    self.memory.busy(now_ns, BUSY_NS);
                }
                Data::Id { id }
            }
            Operation::SetAddress2 { id } => {
                if !busy {
                    self.ea = ea;
                    self.memory.busy(now_ns, BUSY_NS);
                }
                Data::Id { id }
            }
            Operation::CoefficientRead => Data::Coefficient { coefficient: self.coefficient },
            Operation::CoefficientWrite { coefficient } => {
                if !busy {
                    self.coefficient = coefficient;
                    self.memory.busy(now_ns, BUSY_NS);
                }
                Data::Coefficient { coefficient }
            }
            // Never: the caller has answered all others.
            _ => return None,
        })
    }

    /// Returns the line bits of an answer with the fault that is switched on.
    fn send(&self, request: Request, response: Response, now_ns: u64) -> Option<Transmission> {
        let frames = response.emit();
        let good = frames.line();
        let crc = 0xff << good.len().saturating_sub(9);
        let line = match self.fault {
            Fault::Silent => None,
            Fault::FlipBit { at } if u32::from(at) < good.len() => {
                Window::from_bits(good.bits() ^ 1_u128.wrapping_shl(at.into()), good.len())
            }
            Fault::None | Fault::FlipBit { .. } => Some(good),
            Fault::CutAfter { bits } => Window::from_bits(good.bits(), good.len().min(bits.into())),
            Fault::BadCrc => Window::from_bits(good.bits() ^ crc, good.len()),
        }?;
        let place = self.behaviour.place.unwrap_or(self.ea.get());
        let slot = if request.command().is_multi_response() { place } else { 0 };
        let slot_ns = self.rate.bits_ns(good.len()).saturating_add(self.rate.response_gap_ns());
        let wait = self.behaviour.response_delay_ns.saturating_add(slot_ns.saturating_mul(slot.into()));
        let start_ns = now_ns.saturating_add(wait.into());
        let end_ns = start_ns.saturating_add(self.rate.bits_ns(line.len()).into());
        Some(Transmission { frames, line, start_ns, end_ns })
    }
}
