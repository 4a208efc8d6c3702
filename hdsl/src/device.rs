//! The encoder as a machine without I/O: what a simulator or a test bench runs.
//!
//! In every H-frame it is given the line bits from SYNC to PARA and the position at the sampling edge, and gives the
//! answer, which begins one bit time after PARA. Where the manual leaves something to the encoder, the choice made here
//! is said at the item.

mod resources;

use nrz_line::Window;

pub use resources::{Resource, Resources};

use crate::acceleration::DeltaDelta;
use crate::answer::Content;
use crate::crc::crc16;
use crate::encoder_id::{EncoderId, PositionBits};
use crate::error::Error;
use crate::frame::{Head, V_FRAME};
use crate::message::{LongAnswer, Request, Responder};
use crate::parameter::{EncoderByte, MasterSymbol};
use crate::sampling::TEST_PATTERN;
use crate::symbol::{Character, Control, RunningDisparity};

/// What an encoder can be made to do wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Faults {
    /// It does not answer.
    pub silent: bool,
    /// VSYNC is never set.
    pub no_vsync: bool,
    /// The acceleration channel carries K29.7 K29.7.
    pub no_acceleration: bool,
    /// Safe channel 1 carries K29.7 in the place of a position.
    pub no_position: bool,
    /// Safe channel 2 begins with K27.7.
    pub no_position_2: bool,
    /// The CRC of safe channel 1 is wrong.
    pub bad_crc: bool,
    /// The CRC of safe channel 2 is wrong.
    pub bad_crc_2: bool,
    /// STATUS2 has TEST2 set.
    pub test_2: bool,
    /// Messages are received and not answered.
    pub mute: bool,
}

/// An encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Device {
    id: EncoderId,
    bits: PositionBits,
    /// What it does wrong.
    pub faults: Faults,
    /// Registers and resources that messages reach.
    pub resources: Resources,
    /// Byte for the pipe channel; `None` sends K30.7.
    pub pipe: Option<u8>,
    /// H-frames between a request and the first symbol of its answer.
    pub latency: u16,
    responder: Responder,
    waiting: Option<(Request, u16)>,
    disparity: RunningDisparity,
    /// Place in the V-frame; `None` before the first normal answer.
    at: Option<u8>,
    toggle: bool,
    /// Position and speed as the receiver can know them from the acceleration words.
    position: u64,
    velocity: i64,
    blocks: [[Character; 8]; 2],
}

impl Device {
    /// An encoder with this identifier, at rest at position 0. If the identifier asks for more than a receiver of this
    /// crate can do, the position has 40 bits.
    pub const fn new(id: EncoderId) -> Self {
        let bits = match id.check() {
            Ok(bits) => bits,
            Err(_) => PositionBits::MAX,
        };
        Self {
            id,
            bits,
            faults: Faults {
                silent: false,
                no_vsync: false,
                no_acceleration: false,
                no_position: false,
                no_position_2: false,
                bad_crc: false,
                bad_crc_2: false,
                test_2: false,
                mute: false,
            },
            resources: Resources::new(),
            pipe: None,
            latency: 4,
            responder: Responder::new(),
            waiting: None,
            disparity: RunningDisparity::Minus,
            at: None,
            toggle: false,
            position: 0,
            velocity: 0,
            blocks: [[Character::data(0); 8]; 2],
        }
    }

    /// Takes the head of an H-frame and the position at its sampling edge, and gives the 61 bits of the answer, the
    /// first line bit in bit 0; `None` if there is none.
    ///
    /// A head that cannot be read is not answered. A symbol of the master that has no meaning is passed over.
    pub fn answer(&mut self, head: Window, position: u64) -> Option<u64> {
        let before = self.position;
        let acceleration = self.measure(position & self.bits.mask());
        let byte = Head::parse(head).ok()?.byte;
        let symbol = byte.symbol();
        let start_up = !byte.first();
        let answer = match symbol {
            Ok(MasterSymbol::Reset | MasterSymbol::Sync) if start_up => {
                self.reset();
                return None;
            }
            Ok(MasterSymbol::Start | MasterSymbol::Learn | MasterSymbol::Check) if start_up => TEST_PATTERN,
            Ok(MasterSymbol::IdReq) if start_up => {
                let (bits, after) = self.id.to_answer(Character::data(0), self.disparity);
                self.disparity = after;
                bits
            }
            _ => self.normal(symbol, before, acceleration),
        };
        (!self.faults.silent).then_some(answer)
    }

    /// Messages, V-frame and running disparity as after power-up. The motion goes on.
    const fn reset(&mut self) {
        self.responder = Responder::new();
        self.waiting = None;
        self.disparity = RunningDisparity::Minus;
        self.at = None;
        self.toggle = false;
    }

    /// The second difference that takes the receiver to `position`. Beyond 11 bits the encoder sends the largest
    /// value and catches up in the following frames; the manual leaves that open.
    fn measure(&mut self, position: u64) -> DeltaDelta {
        let step = self.signed(position.wrapping_sub(self.position));
        let value = DeltaDelta::clamp(step.wrapping_sub(self.velocity));
        if self.at.is_none() {
            // Nobody listens yet: no need to limit.
            self.velocity = step;
            self.position = position;
            return DeltaDelta::ZERO;
        }
        self.velocity = self.velocity.wrapping_add(i64::from(value.get()));
        self.position = self.position.wrapping_add_signed(self.velocity) & self.bits.mask();
        value
    }

    /// A difference of positions, with its sign.
    fn signed(&self, difference: u64) -> i64 {
        let unused = 64_u32.saturating_sub(u32::from(self.bits.get()));
        i64::from_le_bytes((difference << unused).to_le_bytes()) >> unused
    }

    fn normal(&mut self, symbol: Result<MasterSymbol, Error>, before: u64, acceleration: DeltaDelta) -> u64 {
        let at = self.at.unwrap_or(0);
        if at == 0 {
            self.latch(before);
        }
        self.at = Some(at.saturating_add(1) % V_FRAME);
        let request = if let Ok(symbol) = symbol {
            self.responder.receive(symbol)
        } else {
            self.responder.receive_nothing();
            None
        };
        if symbol == Ok(MasterSymbol::Init) {
            self.waiting = None;
        }
        if let Some(request) = request.filter(|_| !self.faults.mute) {
            self.waiting = Some((request, self.latency));
        }
        self.serve();
        let [vertical, secondary] = self.blocks.map(|b| b.get(usize::from(at)).copied().unwrap_or(Character::data(0)));
        let content = Content {
            vertical,
            parameter: EncoderByte::of(self.responder.transmit(), at == 7 && !self.faults.no_vsync),
            pipe: self.pipe.map_or(Character::control(Control::K30_7), Character::data),
            acceleration: (!self.faults.no_acceleration).then_some(acceleration),
            secondary,
        };
        let (bits, after) = content.emit(self.disparity);
        self.disparity = after;
        bits
    }

    /// Answers the request that has waited long enough.
    fn serve(&mut self) {
        match self.waiting.take() {
            Some((request, left @ 1..)) => self.waiting = Some((request, left.saturating_sub(1))),
            Some((Request::Short(request), 0)) => self.responder.answer_short(self.resources.short(request)),
            Some((Request::Long(request), 0)) => {
                let result = self.resources.long(&request);
                self.responder.answer_long(&LongAnswer::to(&request, result));
            }
            None => {}
        }
    }

    /// The two safe blocks of a V-frame; `position` is that of the sampling edge before it. The second position is
    /// sent as the ones' complement of the first; the manual does not say which complement.
    fn latch(&mut self, position: u64) {
        let test = if self.faults.test_2 { 0x40 } else { 0 };
        let status = if self.toggle { 0x80 } else { 0 } | test | 0x1c;
        self.toggle = !self.toggle;
        let mut first = block(Character::data(self.resources.summary()), position, self.faults.bad_crc);
        if self.faults.no_position {
            first = marked(first, [Character::control(Control::K29_7); 5], self.faults.bad_crc);
        }
        let k28 = Character::new(status, true).unwrap_or(Character::data(status));
        let mut second = block(k28, !position & PositionBits::MAX.mask(), self.faults.bad_crc_2);
        if self.faults.no_position_2 {
            let [top, rest] = [Character::control(Control::K27_7), Character::data(0)];
            second = marked(second, [top, rest, rest, rest, rest], self.faults.bad_crc_2);
        }
        self.blocks = [first, second];
    }
}

fn block(status: Character, position: u64, bad_crc: bool) -> [Character; 8] {
    let [_, _, _, p4, p3, p2, p1, p0] = position.to_be_bytes().map(Character::data);
    marked([status; 8], [p4, p3, p2, p1, p0], bad_crc)
}

/// The block with another position and the CRC that belongs to it.
fn marked(block: [Character; 8], position: [Character; 5], bad_crc: bool) -> [Character; 8] {
    let [status, ..] = block;
    let [p4, p3, p2, p1, p0] = position;
    let crc = crc16(&[status, p4, p3, p2, p1, p0].map(Character::byte)) ^ u16::from(bad_crc);
    let [high, low] = crc.to_be_bytes().map(Character::data);
    [status, p4, p3, p2, p1, p0, high, low]
}
