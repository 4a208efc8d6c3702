//! The encoder's side without I/O, for simulators and test benches.
//!
//! A [`Device`] receives a request as bytes or bits and returns what it answers and when. Position, turns and alarms
//! are set from outside; the EEPROM, the ten-fold resets and the reaction to damaged requests are built in. Faults can be
//! switched on to see how a master handles them.
//!
//! It is written from the documents with its own constants, independent of the [`master`](crate::master) that it tests. Each
//! point that the documents leave open is a switch of its [`Behaviour`]. By default a damaged or unknown request is answered
//! with ID 3, with CA0 for a parity error, CA1 for a delimiter error and neither for a wrong check field or data ID; a
//! wrong sink code is not answered. A write makes the EEPROM busy for 18 ms. During this time writes are ignored and every
//! access is answered with the busy flag; a read returns data 0. Selecting a page takes no time. After power-on the page is 0
//! and unwritten bytes are 0xff.
//!
//! ```
//! use tformat::device::Device;
//! use tformat::{Abm, Abs, BitRate};
//!
//! let mut encoder = Device::<6>::new(0x17, BitRate::Mbit2_5);
//! encoder.set_position(Abs::truncate(0x12_3456), Abm::truncate(7));
//! // the request for ID 3, its delimiter at 4 us
//! let sent = encoder.hear(&[0x1a], 4_000).expect("a response");
//! assert_eq!((sent.start_ns, sent.end_ns), (7_000, 51_000));
//! assert_eq!(sent.frame.as_bytes()[2..9], [0x56, 0x34, 0x12, 0x17, 0x07, 0x00, 0x00]);
//! ```

mod behaviour;

use nrz_line::{Field, Format, Receiver, Window};

use crate::address::{Address, Adf};
use crate::count::{Abm, Abs};
use crate::data_id::DataId;
use crate::error::Error;
use crate::frame::Frame;
use crate::message::{AllData, Identification, Memory, MultiTurn, SingleTurn};
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;
use crate::status::{Almc, StatusField};
use crate::timing::BitRate;

pub use behaviour::{AbsentPage, Behaviour, BusyData, Interval};

/// A fault that the encoder or its line can be made to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Fault {
    /// None.
    #[default]
    None,
    /// The encoder does not answer.
    Silent,
    /// Bit `at` of the response's line bits is inverted; nothing happens if the response is shorter.
    FlipBit {
        /// Index, 0..=109.
        at: u8,
    },
    /// The response ends after this many fields.
    CutAfter {
        /// Number of fields that are sent, 1 or more.
        fields: u8,
    },
    /// The response's check field is inverted.
    BadCrc,
    /// Every request is treated as damaged.
    RejectAll,
}

/// What an encoder sends, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// The fields, as a UART sends them. A fault in a start bit or delimiter shows only in [`line`](Self::line).
    pub frame: Frame,
    /// The line bits.
    pub line: Window,
    /// When the first start bit is on the line, in ns.
    pub start_ns: u64,
    /// When the last bit ends, in ns.
    pub end_ns: u64,
}

/// Time for which a write keeps the EEPROM busy, and for which a single-turn zero is stored: 18 ms.
const STORING_NS: u64 = 18_000_000;

/// An encoder with `PAGES` pages of EEPROM (6 in Tamagawa's encoders).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Device<const PAGES: usize> {
    behaviour: Behaviour,
    rate: BitRate,
    enid: u8,
    abs: Abs,
    zero: Abs,
    abm: Abm,
    /// Alarms that are set, and alarms whose cause is still present.
    almc: Almc,
    causes: Almc,
    fault: Fault,
    eeprom: [[u8; 127]; PAGES],
    page: u8,
    busy_until_ns: u64,
    storing_until_ns: u64,
    effects: u32,
    repeated: Option<DataId>,
    repeats: u8,
    /// Start of the last reset request and end of its response.
    last_reset_start_ns: u64,
    last_reset_end_ns: u64,
    received: [u8; 4],
    len: u8,
    /// A request has been judged, and no pause has come since.
    deaf: bool,
    last_byte_ns: u64,
    bits: Receiver,
}

/// Receives line bits at one sample each, for [`Device::hear_bit`].
const PLAIN_BITS: Format = match Format::new(1, 8) {
    Ok(format) => format,
    Err(_) => panic!(),
};

impl<const PAGES: usize> Device<PAGES> {
    /// Creates an encoder at position 0 without alarms, as after power-on.
    pub const fn new(enid: u8, rate: BitRate) -> Self {
        Self {
            behaviour: Behaviour::new(),
            rate,
            enid,
            abs: Abs::truncate(0),
            zero: Abs::truncate(0),
            abm: Abm::truncate(0),
            almc: Almc::empty(),
            causes: Almc::empty(),
            fault: Fault::None,
            eeprom: [[0xff; 127]; PAGES],
            page: 0,
            busy_until_ns: 0,
            storing_until_ns: 0,
            effects: 0,
            repeated: None,
            repeats: 0,
            last_reset_start_ns: 0,
            last_reset_end_ns: 0,
            received: [0; 4],
            len: 0,
            deaf: false,
            last_byte_ns: 0,
            bits: Receiver::new(PLAIN_BITS),
        }
    }

    /// Sets the points that the documents leave open; takes effect at once.
    pub const fn set_behaviour(&mut self, behaviour: Behaviour) {
        self.behaviour = behaviour;
    }

    /// How many times a reset of any kind has taken effect since power-on.
    pub const fn effects(&self) -> u32 {
        self.effects
    }

    /// Turns the shaft: sets ABS before the single-turn zero is applied, and ABM.
    pub const fn set_position(&mut self, abs: Abs, abm: Abm) {
        self.abs = abs;
        self.abm = abm;
    }

    /// Starts the cause of these alarms, which sets the alarms.
    pub const fn raise_alarms(&mut self, alarms: Almc) {
        self.causes = self.causes.union(alarms);
        self.almc = self.almc.union(alarms);
    }

    /// Ends the cause of these alarms. A latched alarm stays set until a reset finds its cause gone.
    pub const fn end_alarms(&mut self, alarms: Almc) {
        self.causes = self.causes.difference(alarms);
        self.almc = self.almc.difference(alarms.difference(Almc::LATCHED));
    }

    /// Switches a fault on, or off with [`Fault::None`].
    pub const fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Returns the error byte that the encoder would send now.
    pub const fn almc(&self) -> Almc {
        self.almc
    }

    /// Returns the ABS that the encoder would send now: relative to the zero set by ID 8, in the width that the encoder ID
    /// names.
    pub const fn abs(&self) -> Abs {
        self.single_turn()
    }

    /// Returns the ABM that the encoder would send now.
    pub const fn abm(&self) -> Abm {
        self.abm
    }

    /// The selected EEPROM page.
    pub const fn page(&self) -> u8 {
        self.page
    }

    /// The EEPROM, page by page, for preparing and inspecting it.
    pub const fn eeprom_mut(&mut self) -> &mut [[u8; 127]; PAGES] {
        &mut self.eeprom
    }

    /// Takes bytes that were received back to back without a framing error; the delimiter of the last one ended at `end_ns`.
    /// Returns the response once a request is complete.
    pub fn hear(&mut self, bytes: &[u8], end_ns: u64) -> Option<Transmission> {
        let field_ns = u64::from(self.rate.fields_ns(1));
        let (mut reply, mut after) = (None, bytes.len() as u64);
        for byte in bytes {
            after = after.saturating_sub(1);
            reply = self.byte(*byte, end_ns.saturating_sub(field_ns.saturating_mul(after))).or(reply);
        }
        reply
    }

    fn byte(&mut self, byte: u8, end_ns: u64) -> Option<Transmission> {
        if self.is_deaf(end_ns) {
            return None;
        }
        *self.received.get_mut(usize::from(self.len))? = byte;
        self.len = self.len.saturating_add(1);
        let received = self.received;
        let request = Request::parse(received.get(..usize::from(self.len))?);
        let response = match request {
            Err(Error::Truncated { .. }) => return None,
            Ok(request) => self.answer(request, end_ns),
            Err(error) => {
                self.damaged();
                match error {
                    Error::SinkCode { .. } if !self.behaviour.answers_wrong_sink => None,
                    Error::Parity { .. } => self.unless_silent(self.rejection(StatusField::CA0), end_ns),
                    _ => self.unless_silent(self.rejection(StatusField::empty()), end_ns),
                }
            }
        };
        self.deaf = true;
        self.transmission(response?, end_ns)
    }

    /// Reports a framing error in the byte that ended at `end_ns`: the request is damaged.
    pub fn framing_error(&mut self, end_ns: u64) -> Option<Transmission> {
        if self.is_deaf(end_ns) {
            return None;
        }
        self.deaf = true;
        self.damaged();
        if !self.behaviour.answers_delimiter_error {
            return None;
        }
        let response = self.unless_silent(self.rejection(StatusField::CA1), end_ns)?;
        self.transmission(response, end_ns)
    }

    fn damaged(&mut self) {
        if self.behaviour.damage_restarts_count {
            self.repeated = None;
        }
    }

    /// Returns whether the data arriving now is the rest of a request that was already judged. A pause of half a field begins a
    /// new request, so nothing after a damaged control field is ever taken for another command.
    fn is_deaf(&mut self, now_ns: u64) -> bool {
        let longest_gap_ns = u64::from(self.rate.fields_ns(1)).saturating_mul(3) / 2;
        if now_ns.saturating_sub(self.last_byte_ns) > longest_gap_ns {
            self.len = 0;
            self.deaf = false;
        }
        self.last_byte_ns = now_ns;
        self.deaf
    }

    /// Takes one line bit, which ended at `end_ns`; the line idles high.
    #[inline]
    pub fn hear_bit(&mut self, level: bool, end_ns: u64) -> Option<Transmission> {
        let field = self.bits.push(level)?;
        self.field(field, end_ns)
    }

    /// Handles the end of a field. It is kept out of the path of the other bits, because at most one bit in ten ends a field.
    #[inline(never)]
    fn field(&mut self, field: Field, end_ns: u64) -> Option<Transmission> {
        let [byte, _] = field.content.to_le_bytes();
        if field.delimiter { self.byte(byte, end_ns) } else { self.framing_error(end_ns) }
    }

    /// Executes a valid request that ended at `now_ns` and returns the response; `None` if the encoder is silent. Faults of
    /// single line bits have no effect here.
    pub fn answer(&mut self, request: Request, now_ns: u64) -> Option<Response> {
        let response = match self.fault {
            Fault::RejectAll => self.rejection(StatusField::empty()),
            _ => self.obey(request, now_ns),
        };
        self.unless_silent(response, now_ns)
    }

    /// An encoder that is set to be silent, or that is busy, sends nothing.
    fn unless_silent(&self, response: Response, now_ns: u64) -> Option<Response> {
        // The request that completes the ten is still answered.
        let storing = now_ns < self.storing_until_ns && now_ns.saturating_add(STORING_NS) > self.storing_until_ns;
        let silent = self.fault == Fault::Silent || storing && self.behaviour.silent_while_storing;
        (!silent).then_some(response)
    }

    fn obey(&mut self, request: Request, now_ns: u64) -> Response {
        let before = SingleTurn { sf: self.sf(), abs: self.single_turn() };
        self.count_resets(request.data_id(), now_ns);
        let after = SingleTurn { sf: self.sf(), abs: self.single_turn() };
        let reset = if self.behaviour.tenth_shows_effect { after } else { before };
        match request {
            Request::ReadSingleTurn => Response::ReadSingleTurn(after),
            Request::ReadMultiTurn => Response::ReadMultiTurn(MultiTurn { sf: self.sf(), abm: self.abm }),
            Request::ReadEncoderId => Response::ReadEncoderId(Identification { sf: self.sf(), enid: self.enid }),
            Request::ReadAll => Response::ReadAll(self.all_data(self.sf())),
            Request::WriteEeprom { adf, edf } => Response::WriteEeprom(self.write(adf.address(), edf, now_ns)),
            Request::ResetErrors => Response::ResetErrors(reset),
            Request::SetSingleTurnZero => Response::SetSingleTurnZero(reset),
            Request::ResetTurnsAndErrors => Response::ResetTurnsAndErrors(reset),
            Request::ReadEeprom { adf } => Response::ReadEeprom(self.read(adf.address(), now_ns)),
        }
    }

    fn sf(&self) -> StatusField {
        if self.behaviour.leaves_status_zero { StatusField::empty() } else { StatusField::of_alarms(self.almc) }
    }

    /// Returns ABS relative to the zero set by ID 8, in the width that the encoder ID names (24 bits for an unknown ID).
    const fn single_turn(&self) -> Abs {
        let bits = match Resolution::from_enid(self.enid) {
            Some(hint) => hint.resolution.abs_bits(),
            None => 24,
        };
        let mask = 1_u32.wrapping_shl(bits as u32).wrapping_sub(1);
        Abs::truncate(self.abs.get().wrapping_sub(self.zero.get()) & mask)
    }

    fn all_data(&self, sf: StatusField) -> AllData {
        AllData { sf, abs: self.single_turn(), enid: self.enid, abm: self.abm, almc: self.almc }
    }

    /// Returns the ID 3 frame that answers a damaged request.
    fn rejection(&self, damage: StatusField) -> Response {
        Response::ReadAll(self.all_data(self.sf().union(damage)))
    }

    /// Counts a reset request: ten equal ones in a row, at least 40 us apart, take effect.
    fn count_resets(&mut self, id: DataId, now_ns: u64) {
        if !matches!(id, DataId::ResetErrors | DataId::SetSingleTurnZero | DataId::ResetTurnsAndErrors) {
            if self.behaviour.others_restart_count {
                self.repeated = None;
            }
            return;
        }
        let field_ns = u64::from(self.rate.fields_ns(1));
        let begin_ns = now_ns.saturating_sub(field_ns);
        let since_ns = begin_ns.saturating_sub(match self.behaviour.reset_interval {
            Interval::StartToStart => self.last_reset_start_ns,
            Interval::EndToStart => self.last_reset_end_ns,
        });
        let response_ns = u64::from(self.behaviour.response_delay_ns).saturating_add(field_ns.saturating_mul(6));
        self.last_reset_start_ns = begin_ns;
        self.last_reset_end_ns = now_ns.saturating_add(response_ns);
        let continues = self.repeated == Some(id) && since_ns >= 40_000;
        self.repeats = if continues { self.repeats.saturating_add(1) } else { 1 };
        self.repeated = Some(id);
        if self.repeats < 10 {
            return;
        }
        self.repeated = None;
        self.effects = self.effects.saturating_add(1);
        match id {
            DataId::SetSingleTurnZero => {
                self.zero = self.abs;
                self.storing_until_ns = now_ns.saturating_add(STORING_NS);
            }
            DataId::ResetTurnsAndErrors => {
                self.abm = Abm::truncate(0);
                self.almc = self.causes;
            }
            _ => self.almc = self.causes,
        }
    }

    fn write(&mut self, address: Address, edf: u8, now_ns: u64) -> Memory {
        let busy = now_ns < self.busy_until_ns;
        if !busy {
            if address == Address::PAGE_REGISTER {
                self.select(edf);
            } else if let Some(cell) = self.cell(address) {
                *cell = edf;
            }
            if address != Address::PAGE_REGISTER || self.behaviour.page_select_is_busy {
                self.busy_until_ns = now_ns.saturating_add(STORING_NS);
            }
        }
        Memory { adf: Adf::answered(address, busy), edf }
    }

    fn select(&mut self, page: u8) {
        let pages = u8::try_from(PAGES).unwrap_or(u8::MAX);
        match self.behaviour.absent_page {
            AbsentPage::Wrapped => self.page = page.checked_rem(pages).unwrap_or(0),
            AbsentPage::Ignored if page < pages => self.page = page,
            AbsentPage::Ignored => {}
        }
    }

    /// Returns a cell of the selected page.
    fn cell(&mut self, address: Address) -> Option<&mut u8> {
        self.eeprom.get_mut(usize::from(self.page))?.get_mut(usize::from(address.get()))
    }

    fn read(&mut self, address: Address, now_ns: u64) -> Memory {
        let page = self.page;
        let held = self.cell(address).map_or(page, |cell| *cell);
        let busy = now_ns < self.busy_until_ns;
        let edf = match self.behaviour.busy_data {
            BusyData::Zeros if busy => 0,
            BusyData::Ones if busy => 0xff,
            _ => held,
        };
        Memory { adf: Adf::answered(address, busy), edf }
    }

    /// Returns the response as it is sent, including the fault that is switched on.
    fn transmission(&self, response: Response, end_ns: u64) -> Option<Transmission> {
        let sound = response.emit();
        let line = sound.line();
        let line = match self.fault {
            Fault::FlipBit { at } if u32::from(at) < line.len() => flipped(line, 1_u128.wrapping_shl(at.into()))?,
            Fault::BadCrc => flipped(line, 0x1fe_u128.wrapping_shl(line.len().saturating_sub(Frame::FIELD_BITS)))?,
            Fault::CutAfter { fields } if (1..sound.fields()).contains(&fields) => {
                Window::from_bits(line.bits(), u32::from(fields).saturating_mul(Frame::FIELD_BITS))?
            }
            _ => line,
        };
        let fields = u8::try_from(line.len() / Frame::FIELD_BITS).ok()?;
        let frame = Frame::from_line(line, fields).unwrap_or(sound);
        let start_ns = end_ns.saturating_add(self.behaviour.response_delay_ns.into());
        let bits_ns = u64::from(line.len()).saturating_mul(self.rate.bit_ns().into());
        Some(Transmission { frame, line, start_ns, end_ns: start_ns.saturating_add(bits_ns) })
    }
}

const fn flipped(line: Window, bits: u128) -> Option<Window> {
    Window::from_bits(line.bits() ^ bits, line.len())
}

#[cfg(test)]
mod tests;
