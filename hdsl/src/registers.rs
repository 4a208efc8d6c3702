//! The register map of the receiver: one byte per address; values of several bytes have the highest byte first.
//!
//! A [`Registers`] has the addresses of the Motor Control SDK (HDSL register list), whichever rule it follows. The SICK IP core
//! has its own map: 40h registers, a bank with those of safe channel 2, and separately POSTX and the flags of the online status.
//! [`Registers::from_core`] converts an image of it to this map; [`RemoteReceiver`] accesses either device by its own map.
//!
//! A [`Registers`] is an image of that map. If used with a [`Master`](crate::master::Master), [`Registers::apply`] keeps it up
//! to date and [`Registers::write`] takes what an application writes. [`Registers::from_bytes`] creates one from the image of
//! another receiver, for example the memory of the SDK's firmware.
//!
//! ```
//! use hdsl::Dialect;
//! use hdsl::registers::{Register, Registers};
//!
//! let mut memory = [0_u8; Registers::LEN];
//! memory[0x03] = 0x8f; // MASTER_QM
//! memory[0x10..0x15].copy_from_slice(&[0, 0x12, 0x34, 0x56, 0x78]); // POS
//! memory[0x50..0x52].copy_from_slice(&[0x18, 0x02]); // ONLINE_STATUS_D
//! let map = Registers::from_bytes(&Dialect::TI, memory);
//! assert_eq!((map.link(), map.quality(), map.pos()), (true, 15, None));
//! assert_eq!(map.online_d().to_string(), "FIX1 POS FREL");
//! // POS: the position is estimated or not aligned.
//! assert_eq!(map.get(Register::Pos), [0, 0x12, 0x34, 0x56, 0x78]);
//! ```

mod apply;
mod bus;
mod flags;
mod map;
mod pipe;
mod write;

pub use bus::{BusError, RegisterBus, RemoteReceiver};
pub use flags::{Event, EventS, Events, Interrupts, Online1, Online2, OnlineD, Status2};
pub use map::Register;
pub use pipe::{PipeFifo, PipeReading};

use crate::dialect::Dialect;
pub use crate::dialect::RegisterRule;
use crate::encoder_id::PositionBits;
use crate::fast::FastPosition;
use crate::position::{AlignmentStage, PositionTracker};
use crate::vframe::VFrame;

/// An image of the register map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Registers {
    bytes: [u8; Self::LEN],
    dialect: Dialect,
    pipe: PipeFifo,
    /// POS and VEL by the rule of the dialect.
    tracker: PositionTracker,
    /// Which of them may be used; none in the image of another receiver.
    fast: Option<FastPosition>,
    /// The blocks of a V-frame, which are shown one H-frame after its end.
    v_frame: Option<VFrame>,
    /// The last good safe position, or `None` because the encoder had none.
    last_safe: Option<u64>,
}

impl Registers {
    /// Number of bytes in the map.
    pub const LEN: usize = 0x56;

    /// Creates the map as it is after power-up: the flags of a restart are set.
    pub fn new(dialect: &Dialect) -> Self {
        let mut all = Self::from_bytes(dialect, [0; Self::LEN]);
        all.put(Register::Version, [0x10]);
        all.put(Register::Release, [1]);
        all.put(Register::Version2, [0x10]);
        all.put(Register::PcAdd, [0x80, 0x00]);
        all.put(Register::PcOff, [0x80, 0x00]);
        all.put(Register::AccErrCntThresh, [0x1f]);
        if dialect.registers == RegisterRule::Sick {
            all.put(Register::MaxAcc, [0xff]);
            all.put(Register::MaxDev, [0xff; 2]);
        }
        all.restart();
        all
    }

    /// Creates the map from an image that was read elsewhere.
    pub const fn from_bytes(dialect: &Dialect, bytes: [u8; Self::LEN]) -> Self {
        Self {
            bytes,
            dialect: *dialect,
            pipe: PipeFifo::new(),
            tracker: PositionTracker::new(PositionBits::MAX),
            fast: None,
            v_frame: None,
            last_safe: Some(0),
        }
    }

    /// Number of registers of the SICK core, without those of the encoder.
    pub const CORE_LEN: usize = 0x40;

    /// Creates the map from an image of the SICK core: its registers 00h..3Fh, and 00h..1Fh of the bank of safe channel 2 if
    /// that was read. The online status is not a register there. Of its flags, POS is set here, because it is unknown whether
    /// the fast position is aligned, so [`pos`](Self::pos) returns `None`; all others are clear.
    pub fn from_core(drive: &[u8; Self::CORE_LEN], safe2: Option<&[u8; 0x20]>) -> Self {
        let mut all = Self::from_bytes(&Dialect::SICK, [0; Self::LEN]);
        for (address, byte) in (0..).zip(drive) {
            all.set_byte(address, *byte);
        }
        all.put(Register::OnlineStatusD, OnlineD::POS.bits().to_be_bytes());
        let Some([.., version, _, _, _, id, _, _, _, _, _, _, _, _, s0, s1, s2, s3, s4, s5, s6, s7]) = safe2 else {
            return all;
        };
        all.put(Register::Version2, [*version, *id, *s0, *s1, *s2, *s3, *s4, *s5]);
        all.put(Register::VPosCrc2, [*s6, *s7]);
        all
    }

    /// All bytes.
    pub const fn as_bytes(&self) -> &[u8; Self::LEN] {
        &self.bytes
    }

    /// Returns one byte; `None` after the end of the map.
    pub fn byte(&self, address: u8) -> Option<u8> {
        self.bytes.get(usize::from(address)).copied()
    }

    /// Sets one byte; does nothing after the end of the map.
    fn set_byte(&mut self, address: u8, value: u8) {
        if let Some(byte) = self.bytes.get_mut(usize::from(address)) {
            *byte = value;
        }
    }

    /// Returns the bytes of a register that is `N` bytes wide, the highest first.
    #[inline]
    pub fn get<const N: usize>(&self, register: Register) -> [u8; N] {
        let bytes = self.bytes.get(register as usize..).and_then(<[u8]>::first_chunk);
        bytes.copied().unwrap_or([0; N])
    }

    #[inline]
    fn put<const N: usize>(&mut self, register: Register, value: [u8; N]) {
        if let Some(bytes) = self.bytes.get_mut(register as usize..).and_then(<[u8]>::first_chunk_mut) {
            *bytes = value;
        }
    }

    fn put40(&mut self, register: Register, value: u64) {
        let [_, _, _, bytes @ ..] = value.to_be_bytes();
        self.put::<5>(register, bytes);
    }

    fn get40(&self, register: Register) -> u64 {
        let [a, b, c, d, e] = self.get(register);
        u64::from_be_bytes([0, 0, 0, a, b, c, d, e])
    }

    /// LINK: the link is up.
    pub fn link(&self) -> bool {
        let [qm] = self.get(Register::MasterQm);
        qm & 0x80 != 0
    }

    /// The quality monitor, 0..=15.
    pub fn quality(&self) -> u8 {
        let [qm] = self.get(Register::MasterQm);
        qm & 15
    }

    /// POS4..POS0: the fast position, 40 bits, if it may be used: the link is up, POS is clear, and in a map that is kept up to
    /// date with [`apply`](Self::apply), [`Master::fast`](crate::master::Master::fast) returns the same position. A remote
    /// receiver can show an unaligned position without saying so.
    pub fn pos(&self) -> Option<u64> {
        self.shown().map(|(pos, _)| pos)
    }

    /// VEL2..VEL0: speed in steps per H-frame, if the position may be used.
    pub fn vel(&self) -> Option<i32> {
        self.shown().map(|(_, vel)| vel)
    }

    fn shown(&self) -> Option<(u64, i32)> {
        let pos = self.get40(Register::Pos);
        let [a, b, c] = self.get(Register::Vel);
        let vel = i32::from_be_bytes([a, b, c, 0]) >> 8;
        let claimed = self.link() && !self.online_d().contains(OnlineD::POS);
        let agrees = self.fast.is_none_or(|fast| fast.is_at(pos, vel));
        (claimed && agrees).then_some((pos, vel))
    }

    /// The stage of the alignment of POS with the safe position.
    pub const fn stage(&self) -> AlignmentStage {
        self.tracker.stage()
    }

    /// VPOS4..VPOS0: safe position 1, 40 bits: the last good one, of any age. For a position to use see
    /// [`Master::safe`](crate::master::Master::safe).
    pub fn vpos(&self) -> u64 {
        self.get40(Register::VPos)
    }

    /// VPOS24..VPOS20: safe position 2, 40 bits. Its relation to safe position 1 depends on the encoder.
    pub fn vpos2(&self) -> u64 {
        self.get40(Register::VPos2)
    }

    /// STATUS2.
    pub fn status_2(&self) -> Status2 {
        let [raw] = self.get(Register::Status2);
        Status2::from_bits_retain(raw)
    }

    /// EVENT_H and EVENT_L.
    pub fn event(&self) -> Event {
        Event::from_bits_retain(u16::from_be_bytes(self.get(Register::EventH)))
    }

    /// EVENT_S.
    pub fn event_s(&self) -> EventS {
        let [raw] = self.get(Register::EventS);
        EventS::from_bits_retain(raw)
    }

    /// ONLINE_STATUS_D.
    pub fn online_d(&self) -> OnlineD {
        OnlineD::from_bits_retain(u16::from_be_bytes(self.get(Register::OnlineStatusD)))
    }

    /// ONLINE_STATUS_1.
    pub fn online_1(&self) -> Online1 {
        Online1::from_bits_retain(u16::from_be_bytes(self.get(Register::OnlineStatus1)))
    }

    /// ONLINE_STATUS_2.
    pub fn online_2(&self) -> Online2 {
        Online2::from_bits_retain(u16::from_be_bytes(self.get(Register::OnlineStatus2)))
    }

    /// Takes the events that have occurred and clears them.
    pub fn take_events(&mut self) -> Events {
        let events = Events { drive: self.event(), safe: self.event_s() };
        self.put(Register::EventH, [0, 0]);
        self.put(Register::EventS, [0]);
        events
    }

    /// Returns whether ACC_ERR_CNT exceeds its threshold (`acc_thr_err` of the SICK core).
    pub fn too_many_acceleration_errors(&self) -> bool {
        let ([errors], [threshold]) = (self.get(Register::AccErrCnt), self.get(Register::AccErrCntThresh));
        errors > threshold
    }

    /// The interrupt lines that the events and their masks hold active.
    pub fn masked_events(&self) -> Interrupts {
        let mask = u16::from_be_bytes(self.get(Register::MaskH));
        let [mask_s] = self.get(Register::MaskS);
        let mut lines = Interrupts::empty();
        lines.set(Interrupts::EVENT, self.event().bits() & mask != 0);
        lines.set(Interrupts::SAFE_EVENT, self.event_s().bits() & mask_s != 0);
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_after_power_up() {
        let map = Registers::new(&Dialect::SICK);
        assert_eq!(map.get(Register::OnlineStatusD), [0x11, 0x04, 0x11, 0x04, 0x11, 0x04]);
        assert_eq!(map.get(Register::SlaveRegCtrl), [0x3f, 0x1f]);
        assert_eq!((map.link(), map.quality(), map.byte(0x55), map.byte(0x56)), (false, 0, Some(0x04), None));
        assert_eq!((map.event(), map.event_s()), (Event::PRST | Event::QMLW, EventS::PRST | EventS::QMLW));
        // VERSION 1.0, RELEASE 1, VERSION2
        assert_eq!((map.get(Register::Version), map.get(Register::Version2)), ([0x10, 1], [0x10]));
    }

    #[test]
    fn numbers_go_high_byte_first() {
        let mut map = Registers::new(&Dialect::TI);
        map.put40(Register::Pos, 0x12_3456_789a);
        map.put(Register::Vel, [0xff, 0xff, 0xfe]);
        assert_eq!((map.pos(), map.vel()), (None, None));
        map.put(Register::MasterQm, [0x88]);
        assert_eq!((map.pos(), map.vel()), (Some(0x12_3456_789a), Some(-2)));
        assert_eq!(map.byte(0x14), Some(0x9a));
        map.put(Register::EventH, [0x08, 0]);
        map.put(Register::EventS, [0x01]);
        map.put(Register::MaskH, [0x08, 0]);
        assert_eq!(map.masked_events(), Interrupts::EVENT);
        map.put(Register::MaskS, [0x01]);
        assert_eq!(map.masked_events().bits(), 0b1_0001);
    }

    #[test]
    fn a_foreign_image_comes_back() {
        let bytes = core::array::from_fn(|at| at as u8);
        let map = Registers::from_bytes(&Dialect::TI, bytes);
        assert_eq!(map.as_bytes(), &bytes);
        assert_eq!((map.vpos(), map.vpos2()), (0x19_1a1b_1c1d, 0x47_4849_4a4b));
    }
}
