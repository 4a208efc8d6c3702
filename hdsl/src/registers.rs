//! The register map of the receiver: one byte an address, several bytes with the highest first.
//!
//! Addresses and bits are those of the Motor Control SDK (HDSL register list); where the SICK IP core differs, the
//! register says so. The map is kept in memory: everything can be read, and what the receiver does not write keeps
//! what the application wrote.

/// Address of a register of one byte, or of the first of several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum Register {
    /// SYS_CTRL: bit 7 PRST (protocol reset), bit 6 MRST (message reset); both are cleared when done.
    SysCtrl = 0x00,
    /// SYNC_CTRL: ES, 0 free running.
    SyncCtrl = 0x01,
    /// MASTER_QM: bit 7 LINK, bits 3:0 quality monitor.
    MasterQm = 0x03,
    /// EVENT_H, see [`Event`].
    EventH = 0x04,
    /// EVENT_L, see [`Event`].
    EventL = 0x05,
    /// MASK_H: which events interrupt.
    MaskH = 0x06,
    /// MASK_L.
    MaskL = 0x07,
    /// MASK_SUM: which bits of SUMMARY make the event SUM.
    MaskSum = 0x08,
    /// EDGES: bit n is set when an edge was seen in sample period n of the last answer. Not filled by the SDK.
    Edges = 0x09,
    /// DELAY: bits 7:4 RSSI, bits 3:0 cable delay in bits.
    Delay = 0x0a,
    /// VERSION: 10h here and in the SDK.
    Version = 0x0b,
    /// ENC_ID2..ENC_ID0; ENC_ID2 holds its nibble twice.
    EncId = 0x0d,
    /// POS4..POS0: fast position.
    Pos = 0x10,
    /// VEL2..VEL0: speed in steps an H-frame.
    Vel = 0x15,
    /// VPOS4..VPOS0: safe position 1.
    VPos = 0x19,
    /// VPOSCRC_H, VPOSCRC_L: as received.
    VPosCrc = 0x1e,
    /// PC_BUFFER0..7: data of long messages.
    PcBuffer = 0x20,
    /// PC_ADD_H, PC_ADD_L: header of a long message; bit 5 of PC_ADD_H in an answer marks an error.
    PcAdd = 0x28,
    /// PC_OFF_H, PC_OFF_L: offset; without an offset in the request it is not used.
    PcOff = 0x2a,
    /// PC_CTRL: bit 0 LSTA starts a long message.
    PcCtrl = 0x2c,
    /// PIPE_D: last byte of the pipe channel.
    PipeD = 0x2e,
    /// SAFE_CTRL: like SYS_CTRL.
    SafeCtrl = 0x35,
    /// SAFE_SUM: SUMMARY of the last V-frame.
    SafeSum = 0x36,
    /// S_PC_DATA: data of short messages.
    SPcData = 0x37,
    /// ACC_ERR_CNT: acceleration words in a row that could not be used.
    AccErrCnt = 0x38,
    /// EVENT_S, see [`EventS`].
    EventS = 0x3d,
    /// MASK_S: which safe events interrupt.
    MaskS = 0x3e,
    /// SLAVE_REG_CTRL: bit 7 read, bits 5:0 register of the encoder less 40h; writing starts a short message. 3Fh when
    /// idle. In the SICK core the registers of the encoder are at 40h..7Fh of this map.
    SlaveRegCtrl = 0x40,
    /// ACC_ERR_CNT_THRESH: restart threshold, 1Fh at first.
    AccErrCntThresh = 0x41,
    /// VERSION2.
    Version2 = 0x44,
    /// STATUS2: bit 7 TOG2, 6 TEST2, 5 ERR2, 4:0 FIX2 = 11100b.
    Status2 = 0x46,
    /// VPOS24..VPOS20: safe position 2.
    VPos2 = 0x47,
    /// VPOSCRC2_H, VPOSCRC2_L.
    VPosCrc2 = 0x4c,
    /// POSTX: 0 request sent, 2 fast position ready, 3 safe positions ready.
    PosTx = 0x4e,
    /// ONLINE_STATUS_D_H, see [`OnlineD`].
    OnlineStatusD = 0x50,
    /// ONLINE_STATUS_1_H, see [`Online1`].
    OnlineStatus1 = 0x52,
    /// ONLINE_STATUS_2_H, see [`Online2`].
    OnlineStatus2 = 0x54,
}

/// Makes a set of flags in a register.
macro_rules! flags {
    ($(#[$doc:meta])* $name:ident($raw:ty) { $($(#[$bit_doc:meta])* $bit:ident = $at:expr,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        pub struct $name($raw);

        impl $name {
            $($(#[$bit_doc])* pub const $bit: Self = Self(1 << $at);)*

            /// Any value.
            pub const fn new(raw: $raw) -> Self {
                Self(raw)
            }

            /// The value of the register.
            pub const fn raw(self) -> $raw {
                self.0
            }

            /// Whether one of these flags is set.
            pub const fn has(self, flags: Self) -> bool {
                self.0 & flags.0 != 0
            }

            /// The flags of both.
            pub const fn with(self, flags: Self) -> Self {
                Self(self.0 | flags.0)
            }

            /// The flags that are not in the other.
            pub const fn without(self, flags: Self) -> Self {
                Self(self.0 & !flags.0)
            }

            /// The same with these flags set or cleared.
            pub const fn set(self, flags: Self, on: bool) -> Self {
                if on { self.with(flags) } else { self.without(flags) }
            }
        }
    };
}

flags! {
    /// EVENT_H and EVENT_L: what happened since the application wrote 0 to the flag. MASK_H and MASK_L have the same
    /// places.
    Event(u16) {
        /// A bit of SUMMARY that MASK_SUM lets through.
        SUM = 14,
        /// The fast position is not reliable.
        POS = 11,
        /// The link was restarted.
        PRST = 8,
        /// The encoder answered INIT.
        MIN = 5,
        /// A long message was not answered well: LNAK or a wrong CRC.
        ANS = 4,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// A long message is done; also at lock.
        FREL = 1,
    }
}

flags! {
    /// EVENT_S: safe events. MASK_S has the same places.
    EventS(u8) {
        /// SUMMARY is not 0.
        SSUM = 6,
        /// Wrong CRC of safe channel 1.
        SCE = 5,
        /// No safe position.
        VPOS = 4,
        /// The quality monitor is below 14.
        QMLW = 3,
        /// The link was restarted.
        PRST = 2,
        /// The encoder answered INIT.
        MIN = 1,
        /// A short message is done; also at lock.
        FRES = 0,
    }
}

flags! {
    /// ONLINE_STATUS_D: how things are now, for the drive.
    OnlineD(u16) {
        /// SUMMARY is not 0.
        SUM = 14,
        /// Always 1.
        ONE = 12,
        /// The fast position is not reliable.
        POS = 11,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The encoder answers INIT.
        MIN = 5,
        /// The last long message was not answered well.
        ANS = 4,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// No long message is under way.
        FREL = 1,
    }
}

flags! {
    /// ONLINE_STATUS_1: how things are now, for safe channel 1.
    Online1(u16) {
        /// SUMMARY is not 0.
        SSUM = 14,
        /// Wrong CRC; goes with the next right one.
        SCE = 13,
        /// Always 1.
        ONE = 12,
        /// No safe position; goes with the next good one.
        VPOS = 10,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The encoder answers INIT.
        MIN = 5,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// No short message is under way.
        FRES = 0,
    }
}

flags! {
    /// ONLINE_STATUS_2: how things are now, for safe channel 2.
    Online2(u16) {
        /// TEST2 or ERR2 of STATUS2.
        SUM2 = 14,
        /// Wrong CRC.
        SCE2 = 13,
        /// Always 1.
        ONE = 12,
        /// No safe position.
        VPOS2 = 10,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The quality monitor is below 14.
        QMLW = 2,
    }
}

flags! {
    /// The interrupt lines of the SDK, in the order of their numbers.
    Interrupts(u8) {
        /// 0: an event that MASK_H and MASK_L let through.
        EVENT = 0,
        /// 1: a new safe position 1.
        VPOS = 1,
        /// 2: a new safe position 2.
        VPOS2 = 2,
        /// 3: an H-frame was received.
        H_FRAME = 3,
        /// 4: a safe event that MASK_S lets through.
        SAFE_EVENT = 4,
    }
}

/// The bytes of the register map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Registers([u8; Self::LEN]);

impl Default for Registers {
    fn default() -> Self {
        Self::new()
    }
}

impl Registers {
    /// Bytes of the map.
    pub const LEN: usize = 0x56;

    /// As after power-up: the restart flags are set.
    pub fn new() -> Self {
        let mut all = Self([0; Self::LEN]);
        all.put(Register::Version, [0x10]);
        all.put(Register::Version2, [0x10]);
        all.put(Register::PcAdd, [0x80, 0x00]);
        all.put(Register::PcOff, [0x80, 0x00]);
        all.put(Register::AccErrCntThresh, [0x1f]);
        all.restarted();
        all
    }

    /// The online status and the cleared values of a restart.
    pub(crate) fn restarted(&mut self) {
        for status in [Register::OnlineStatusD, Register::OnlineStatus1, Register::OnlineStatus2] {
            self.put(status, [0x11, 0x04]);
        }
        self.put(Register::MasterQm, [0]);
        self.put(Register::AccErrCnt, [0]);
        self.put(Register::Pos, [0; 5]);
        self.put(Register::Vel, [0; 3]);
        self.put(Register::SlaveRegCtrl, [0x3f]);
    }

    /// One byte; `None` behind the end of the map.
    pub fn byte(&self, address: u8) -> Option<u8> {
        self.0.get(usize::from(address)).copied()
    }

    /// Sets one byte. Behind the end of the map nothing happens.
    pub(crate) fn set_byte(&mut self, address: u8, value: u8) {
        if let Some(byte) = self.0.get_mut(usize::from(address)) {
            *byte = value;
        }
    }

    /// The bytes of a register that is `N` wide, the highest first.
    pub fn get<const N: usize>(&self, register: Register) -> [u8; N] {
        let bytes = self.0.get(register as usize..).and_then(<[u8]>::first_chunk);
        bytes.copied().unwrap_or([0; N])
    }

    pub(crate) fn put<const N: usize>(&mut self, register: Register, value: [u8; N]) {
        if let Some(bytes) = self.0.get_mut(register as usize..).and_then(<[u8]>::first_chunk_mut) {
            *bytes = value;
        }
    }

    pub(crate) fn put40(&mut self, register: Register, value: u64) {
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

    /// Fast position, 40 bits.
    pub fn position(&self) -> u64 {
        self.get40(Register::Pos)
    }

    /// Speed in steps an H-frame.
    pub fn velocity(&self) -> i32 {
        let [a, b, c] = self.get(Register::Vel);
        i32::from_be_bytes([a, b, c, 0]) >> 8
    }

    /// Safe position 1, 40 bits: the last good one.
    pub fn safe_position(&self) -> u64 {
        self.get40(Register::VPos)
    }

    /// Safe position 2, 40 bits: the last one. Its relation to safe position 1 depends on the encoder.
    pub fn safe_position_2(&self) -> u64 {
        self.get40(Register::VPos2)
    }

    /// EVENT_H and EVENT_L.
    pub fn event(&self) -> Event {
        Event(u16::from_be_bytes(self.get(Register::EventH)))
    }

    /// EVENT_S.
    pub fn event_s(&self) -> EventS {
        let [raw] = self.get(Register::EventS);
        EventS(raw)
    }

    /// ONLINE_STATUS_D.
    pub fn online_d(&self) -> OnlineD {
        OnlineD(u16::from_be_bytes(self.get(Register::OnlineStatusD)))
    }

    /// ONLINE_STATUS_1.
    pub fn online_1(&self) -> Online1 {
        Online1(u16::from_be_bytes(self.get(Register::OnlineStatus1)))
    }

    /// ONLINE_STATUS_2.
    pub fn online_2(&self) -> Online2 {
        Online2(u16::from_be_bytes(self.get(Register::OnlineStatus2)))
    }

    pub(crate) fn raise(&mut self, event: Event) {
        let all = self.event().with(event);
        self.put(Register::EventH, all.0.to_be_bytes());
    }

    pub(crate) fn raise_s(&mut self, event: EventS) {
        let all = self.event_s().with(event);
        self.put(Register::EventS, [all.0]);
    }

    pub(crate) fn set_d(&mut self, flags: OnlineD, on: bool) {
        let all = self.online_d().set(flags, on);
        self.put(Register::OnlineStatusD, all.0.to_be_bytes());
    }

    pub(crate) fn set_1(&mut self, flags: Online1, on: bool) {
        let all = self.online_1().set(flags, on);
        self.put(Register::OnlineStatus1, all.0.to_be_bytes());
    }

    pub(crate) fn set_2(&mut self, flags: Online2, on: bool) {
        let all = self.online_2().set(flags, on);
        self.put(Register::OnlineStatus2, all.0.to_be_bytes());
    }

    /// The interrupt lines that the events and their masks hold active.
    pub fn masked_events(&self) -> Interrupts {
        let mask = u16::from_be_bytes(self.get(Register::MaskH));
        let [mask_s] = self.get(Register::MaskS);
        let event = Interrupts::default().set(Interrupts::EVENT, self.event().0 & mask != 0);
        event.set(Interrupts::SAFE_EVENT, self.event_s().0 & mask_s != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_after_power_up() {
        let map = Registers::new();
        assert_eq!(map.get(Register::OnlineStatusD), [0x11, 0x04, 0x11, 0x04, 0x11, 0x04]);
        assert_eq!(map.get(Register::SlaveRegCtrl), [0x3f, 0x1f]);
        assert_eq!((map.link(), map.quality(), map.byte(0x55), map.byte(0x56)), (false, 0, Some(0x04), None));
    }

    #[test]
    fn numbers_go_high_byte_first() {
        let mut map = Registers::new();
        map.put40(Register::Pos, 0x12_3456_789a);
        map.put(Register::Vel, [0xff, 0xff, 0xfe]);
        assert_eq!((map.position(), map.velocity()), (0x12_3456_789a, -2));
        assert_eq!(map.byte(0x14), Some(0x9a));
        map.raise(Event::POS);
        map.raise_s(EventS::FRES);
        map.put(Register::MaskH, [0x08, 0]);
        assert_eq!(map.masked_events(), Interrupts::EVENT);
        map.put(Register::MaskS, [0x01]);
        assert_eq!(map.masked_events().raw(), 0b1_0001);
    }

    /// The places of all flags, as the register list prints them.
    #[test]
    fn places() {
        let online =
            [OnlineD::SUM, OnlineD::ONE, OnlineD::POS, OnlineD::PRST, OnlineD::MIN, OnlineD::ANS, OnlineD::QMLW];
        assert_eq!(online.map(OnlineD::raw), [0x4000, 0x1000, 0x0800, 0x0100, 0x20, 0x10, 4]);
        assert_eq!((Online1::SCE.raw(), Online1::VPOS.raw(), Online1::FRES.raw()), (0x2000, 0x0400, 1));
        assert_eq!((Online2::SUM2.raw(), Online2::SCE2.raw(), Online2::VPOS2.raw()), (0x4000, 0x2000, 0x0400));
        assert_eq!((Event::PRST.raw(), EventS::SSUM.raw(), OnlineD::FREL.raw()), (0x0100, 0x40, 2));
    }
}
