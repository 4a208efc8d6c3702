//! The encoder as a state machine without I/O, for simulators and test benches.
//!
//! In every H-frame it receives the line bits from SYNC to PARA and the position at the sampling edge, and returns the
//! answer, which begins one bit time after PARA. It is an absolute encoder: its safe position is the true one, whatever the
//! acceleration channel could carry.
//!
//! On a sampled line [`Heard::on_line`] finds the bits and, to an eighth of a bit, the edge;
//! [`Device::sampling_instant`] is when to take the position.
//!
//! It shares no protocol rule with the receiver: code, test pattern, symbols, messages, checks and limits are implemented
//! separately here. Each point that the documents leave to the encoder is a switch in [`Behaviour`]; each way in which it can
//! fail is a [`Fault`].
//!
//! ```
//! use hdsl::EncoderId;
//! use hdsl::device::{Device, Heard};
//! use hdsl::master::Master;
//! use hdsl::sampling::line;
//! use hdsl::{Dialect, Policy};
//!
//! let mut master = Master::new(Dialect::SICK);
//! let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
//! for frame in 0..150_u64 {
//!     let sent: Vec<u8> = master.transmission().head.samples().collect();
//!     let heard = Heard::on_line(&sent).ok_or("no head")?;
//!     // 864 eighths of a bit a frame; the shaft turns by two steps in each.
//!     let instant = 864 * frame + u64::from(encoder.sampling_instant(&heard));
//!     let answer = encoder.set_position(2 * instant).hear(heard.bits);
//!     // The answer comes 9 eighths of a bit late.
//!     let samples = answer.map_or([0xff; 72], |answer| line(answer.bits, 9));
//!     master.hear(&samples, 11_520 * frame + 10_560)?;
//! }
//! let fast = master.fast().at(11_520 * 150, Policy::new(20_000))?;
//! assert_eq!(fast.velocity(), 2 * 864);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod behaviour;
mod channel;
mod code;
mod hearing;
mod resources;

use nrz_line::Window;

pub use behaviour::{Acknowledgement, BadHead, Behaviour, Complement, Disparity, Fault, Overload};
pub use hearing::Heard;
pub use resources::{Resource, Resources};

use crate::encoder_id::EncoderId;
use crate::symbol::RunningDisparity;
use channel::Channel;
use code::Symbol;

/// The test pattern, first line bit in bit 0: 0100110011001000000100010101110111111011001100110100010011001.
const PATTERN: u64 = 0x1322_ccdf_ba88_1332;

/// What an encoder sends in an H-frame. The answer begins one bit after PARA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Transmission {
    /// The 61 bits of the answer, the first line bit in bit 0.
    pub bits: u64,
}

/// An encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Device {
    /// ENC_ID, 20 bits.
    id: u32,
    behaviour: Behaviour,
    fault: Fault,
    resources: Resources,
    pipe: Option<u8>,
    channel: Channel,
    /// Number of requests so far, to decide which to forget.
    requests: u16,
    disparity: RunningDisparity,
    /// Number of SYNC frames since the last RESET.
    synchronised: u8,
    /// Place in the V-frame; `None` before the first normal answer.
    at: Option<u8>,
    toggle: bool,
    /// True position at the next sampling edge.
    shaft: u64,
    /// True position at the last sampling edge.
    position: u64,
    /// Position and speed as a receiver derives them from the acceleration words.
    told: u64,
    velocity: i64,
    blocks: [[Symbol; 8]; 2],
}

impl Device {
    /// Creates an encoder with this identifier, at position 0. If the identifier asks for a position of more than 40 bits, it
    /// has 40.
    pub const fn new(id: EncoderId) -> Self {
        Self {
            id: id.get(),
            behaviour: Behaviour::new(),
            fault: Fault::None,
            resources: Resources::new(),
            pipe: None,
            channel: Channel::new(),
            requests: 0,
            disparity: RunningDisparity::Minus,
            synchronised: 0,
            at: None,
            toggle: false,
            shaft: 0,
            position: 0,
            told: 0,
            velocity: 0,
            blocks: [[Symbol::data(0); 8]; 2],
        }
    }

    /// Sets its behaviour in the points that the documents leave open.
    pub const fn set_behaviour(&mut self, behaviour: Behaviour) {
        self.behaviour = behaviour;
    }

    /// Sets its fault; takes effect at once.
    pub const fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Sets the byte for the pipe channel in the next answers; `None` sends K30.7 (no data).
    pub const fn set_pipe(&mut self, byte: Option<u8>) {
        self.pipe = byte;
    }

    /// Registers and resources that messages reach.
    pub const fn resources(&self) -> &Resources {
        &self.resources
    }

    /// The same registers and resources, for changing them from inside the encoder.
    pub const fn resources_mut(&mut self) -> &mut Resources {
        &mut self.resources
    }

    /// Turns the shaft: the position in steps at the sampling edge of the next head. Bits beyond the width of the encoder are
    /// dropped.
    pub const fn set_position(&mut self, position: u64) -> &mut Self {
        self.shaft = position;
        self
    }

    /// Takes the head of an H-frame and returns the answer; `None` if the encoder sends none.
    ///
    /// Before it has seen RESET and enough SYNC frames, it does not answer. A head that cannot be read is not answered; a symbol
    /// of the master that has no meaning is ignored.
    pub fn hear(&mut self, head: Window) -> Option<Transmission> {
        let before = self.position;
        self.position = self.shaft & self.mask();
        let acceleration = self.measure();
        let Some(byte) = code::parameter(head) else {
            if self.behaviour.bad_head == BadHead::Counts {
                self.go_on(before);
            }
            return None;
        };
        let symbol = byte & 0x1f;
        // FIRST is 0.
        let start_up = byte & 0x80 == 0;
        match symbol {
            // RESET
            0x1f if start_up => {
                self.reset();
                return None;
            }
            // SYNC
            0x19 if start_up => {
                let frames = self.synchronised.saturating_add(1);
                self.reset();
                self.synchronised = frames;
                return None;
            }
            _ if self.synchronised < self.behaviour.sync_frames => return None,
            _ => {}
        }
        let answer = match symbol {
            // START, LEARN, CHECK
            0x1a..=0x1c if start_up => PATTERN,
            // IDREQ
            0x1d if start_up => {
                let [low, middle, high, _] = self.id.to_le_bytes().map(Symbol::data);
                let both = Symbol::data(high.byte << 4 | high.byte);
                self.emit([low, middle, both, middle, low, Symbol::data(0)])
            }
            _ => self.normal(symbol, before, acceleration),
        };
        (self.fault != Fault::Silent).then_some(Transmission { bits: answer })
    }

    /// Returns when to take the position for [`hear`](Self::hear), in eighths of a bit (13.333 ns) on the time base of the
    /// samples in which the head was heard: at the sampling edge, plus [`Behaviour::sampling_lag`].
    pub const fn sampling_instant(&self, heard: &Heard) -> u32 {
        (heard.edge as u32).saturating_add(self.behaviour.sampling_lag as u32)
    }

    /// Resets messages, V-frame, clock and running disparity as after power-up. The motion continues.
    const fn reset(&mut self) {
        self.channel = Channel::new();
        self.disparity = RunningDisparity::Minus;
        self.synchronised = 0;
        self.at = None;
        self.toggle = false;
    }

    /// The running disparity with which an answer begins.
    const fn column(&self) -> RunningDisparity {
        match self.behaviour.disparity {
            Disparity::CarriedOn => self.disparity,
            Disparity::EachAnswer(column) => column,
        }
    }

    fn emit(&mut self, symbols: [Symbol; 6]) -> u64 {
        let (bits, plus) = code::answer(symbols, self.column() == RunningDisparity::Plus);
        self.disparity = if plus { RunningDisparity::Plus } else { RunningDisparity::Minus };
        bits
    }

    /// Returns the second difference that takes the receiver to the present position; `None` if the encoder reports that it has
    /// none.
    fn measure(&mut self) -> Option<i16> {
        let step = self.signed(self.position.wrapping_sub(self.told));
        if self.at.is_none() {
            // Nobody listens yet: no need to limit.
            self.velocity = step;
            self.told = self.position;
            return Some(0);
        }
        let wanted = step.wrapping_sub(self.velocity);
        let value = wanted.clamp(-1024, 1023);
        if wanted != value && self.behaviour.overload == Overload::NoValue {
            self.velocity = step;
            self.told = self.position;
            return None;
        }
        self.velocity = self.velocity.wrapping_add(value);
        self.told = self.told.wrapping_add_signed(self.velocity) & self.mask();
        i16::try_from(value).ok()
    }

    /// Returns the number of bits of the position: the bits of the acceleration, which are 8 plus bits 3:0 of the identifier,
    /// plus bits 9:4; 40 at most.
    fn bits(&self) -> u32 {
        (self.id & 15).wrapping_add(8).wrapping_add(self.id >> 4 & 0x3f).min(40)
    }

    fn mask(&self) -> u64 {
        !(u64::MAX << self.bits())
    }

    /// Returns a difference of positions, with its sign.
    fn signed(&self, difference: u64) -> i64 {
        let unused = 64_u32.saturating_sub(self.bits());
        i64::from_le_bytes((difference << unused).to_le_bytes()) >> unused
    }

    /// Counts a frame whose head could not be read.
    fn go_on(&mut self, before: u64) {
        if let Some(at) = self.at {
            if at == 0 {
                self.latch(before);
            }
            self.at = Some(at.wrapping_add(1) & 7);
            self.channel.miss();
        }
    }

    fn normal(&mut self, symbol: u8, before: u64, acceleration: Option<i16>) -> u64 {
        let at = self.at.unwrap_or(self.behaviour.first_place & 7);
        if at == 0 || self.at.is_none() {
            self.latch(before);
        }
        self.at = Some(at.wrapping_add(1) & 7);
        self.take(symbol);
        self.serve();
        let [vertical, secondary] = self.blocks.map(|b| b.get(usize::from(at)).copied().unwrap_or(Symbol::data(0)));
        let vsync = if at == 7 && self.fault != Fault::NoVsync { 0x80 } else { 0 };
        let parameter = self.channel.speak() | vsync | (self.behaviour.reserved_bits & 3) << 5;
        // K30.7: no data.
        let pipe = self.pipe.map_or(Symbol::special(0xfe), Symbol::data);
        let [high, low] = match acceleration.filter(|_| self.fault != Fault::NoAcceleration) {
            Some(value) => acceleration_word(value).to_be_bytes().map(Symbol::data),
            // K29.7 twice: no value.
            None => [Symbol::special(0xfd); 2],
        };
        self.emit([vertical, Symbol::data(parameter), pipe, high, low, secondary])
    }

    /// Takes the master's symbol; a complete request is queued to be answered, unless it is forgotten.
    fn take(&mut self, symbol: u8) {
        let Some(request) = self.channel.hear(symbol) else { return };
        self.requests = self.requests.wrapping_add(1);
        let forgotten = self.requests.checked_rem(self.behaviour.forgets_every) == Some(0);
        if self.fault != Fault::Mute && !forgotten {
            self.channel.wait(request, self.behaviour.latency_frames);
        }
    }

    /// Answers the requests that have waited long enough.
    fn serve(&mut self) {
        for request in self.channel.due().into_iter().flatten() {
            let answer = self.resources.answer(&request, self.behaviour.acknowledgement);
            self.channel.answer(answer);
        }
    }

    /// Creates the two safe blocks of a V-frame; `position` is the position at the sampling edge before it.
    fn latch(&mut self, position: u64) {
        let test = if self.fault == Fault::Test2 { 0x40 } else { 0 };
        let error = if self.fault == Fault::Error2 { 0x20 } else { 0 };
        let status = if self.toggle { 0x80 } else { 0 } | test | error | 0x1c;
        self.toggle = self.toggle == (self.fault == Fault::StuckToggle);
        // Bit 10: positions have a sign.
        let sign =
            if self.id >> 10 & 1 == 1 { self.signed(position) } else { i64::from_le_bytes(position.to_le_bytes()) };
        let [bad_crc, bad_crc_2] = [Fault::BadCrc, Fault::BadCrc2].map(|fault| self.fault == fault);
        let mut first = block(Symbol::data(self.resources.summary()), sign, bad_crc);
        if self.fault == Fault::NoPosition {
            first = marked(first, [Symbol::special(0xfd); 5], bad_crc);
        }
        // FIX2 is 28: a K28 character.
        let k28 = Symbol::special(status);
        let coarse = sign >> (self.behaviour.second_shift & 31);
        let second = match self.behaviour.complement {
            Complement::Ones => !coarse,
            Complement::Twos => coarse.wrapping_neg(),
        };
        let mut second = block(k28, second, bad_crc_2);
        if self.fault == Fault::NoPosition2 {
            let [top, rest] = [Symbol::special(0xfb), Symbol::data(0)];
            second = marked(second, [top, rest, rest, rest, rest], bad_crc_2);
        }
        self.blocks = [first, second];
    }
}

fn block(status: Symbol, position: i64, bad_crc: bool) -> [Symbol; 8] {
    let [_, _, _, p4, p3, p2, p1, p0] = position.to_be_bytes().map(Symbol::data);
    marked([status; 8], [p4, p3, p2, p1, p0], bad_crc)
}

/// Returns the block with its position replaced and a matching CRC.
fn marked(block: [Symbol; 8], position: [Symbol; 5], bad_crc: bool) -> [Symbol; 8] {
    let [status, ..] = block;
    let [p4, p3, p2, p1, p0] = position;
    let crc = check(&[status, p4, p3, p2, p1, p0].map(|symbol| symbol.byte)) ^ u16::from(bad_crc);
    let [high, low] = crc.to_be_bytes().map(Symbol::data);
    [status, p4, p3, p2, p1, p0, high, low]
}

/// Appends the CRC-5 to eleven bits, by long division: the remainder modulo x^5 + x^2 + 1, with its five bits inverted.
fn acceleration_word(value: i16) -> u16 {
    let [high, low] = value.to_be_bytes();
    let word = u16::from_be_bytes([high, low]) << 5;
    let mut rest = word;
    for step in 0..11_u32 {
        if rest << step & 0x8000 != 0 {
            rest ^= (0b10_0101 << 10) >> step;
        }
    }
    word | (rest ^ 0x1f) & 0x1f
}

/// Computes the CRC-16 by long division: x^16 + x^15 + x^12 + x^7 + x^6 + x^4 + x^3 + 1, then the low byte inverted.
fn check(bytes: &[u8]) -> u16 {
    let mut rest = 0_u16;
    for byte in bytes {
        rest ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            rest = if rest & 0x8000 != 0 { (rest << 1) ^ 0x90d9 } else { rest << 1 };
        }
    }
    rest ^ 0x00ff
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::TEST_PATTERN;

    /// What both ends wrote down agrees with what the documents print.
    #[test]
    fn literals() {
        let printed = "0100110011001000000100010101110111111011001100110100010011001";
        let bits = printed.bytes().rev().fold(0_u64, |bits, c| bits << 1 | u64::from(c == b'1'));
        assert_eq!((PATTERN, TEST_PATTERN), (bits, bits));
        for (value, word) in [(0, 0x001f), (1, 0x003a), (-1, 0xfff5), (-5, 0xff61), (1023, 0x7fea), (-1024, 0x8000)] {
            assert_eq!(acceleration_word(value), word, "{value}");
        }
        assert_eq!((check(b"123456789"), check(&[0x00, 0x00, 0x12, 0x34, 0x56, 0x78])), (0x91c5, 0x3227));
    }
}
