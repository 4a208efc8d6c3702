//! The register map: what an application writes and reads, and what the receiver shows, address by address.

use hdsl::device::{Device, Fault};
use hdsl::master::{HFrame, Master, RestartReason, State};
use hdsl::message::RemoteRegister;
use hdsl::registers::{Event, EventS, Events, Interrupts, Online1, OnlineD, Registers};
use hdsl::registers::{PipeFifo, Status2};
use hdsl::symbol::{Character, Control, RunningDisparity, Word};
use hdsl::{Dialect, EncoderId, Error, MasterSymbol, Rule};

const DIALECTS: [Dialect; 2] = [Dialect::SICK, Dialect::TI];

/// Both ends, and the map beside the receiver.
pub(crate) struct Desk {
    pub(crate) master: Master,
    pub(crate) map: Registers,
    pub(crate) device: Device,
    lines: Interrupts,
    /// The end of the last window.
    pub(crate) now_ns: u64,
}

impl Desk {
    /// With a link that runs and events that were read.
    pub(crate) fn new(dialect: Dialect, id: u32) -> Self {
        let device = Device::new(EncoderId::new(id).unwrap());
        let (master, map, lines) = (Master::new(dialect), Registers::new(&dialect), Interrupts::empty());
        let mut desk = Self { master, map, device, lines, now_ns: 0 };
        desk.frames(61 + 48);
        let _ = desk.map.take_events();
        assert_eq!((desk.master.state(), desk.map.quality(), desk.map.link()), (State::Running, 15, true));
        desk
    }

    pub(crate) fn frame(&mut self) -> HFrame {
        let answer = self.device.set_position(0x8765_4321).hear(self.master.transmission().head.bits());
        self.now_ns += 11_520;
        let report = *self.master.hear_bits(answer.map_or(u64::MAX, |answer| answer.bits), None, self.now_ns);
        self.lines = self.map.apply(&report);
        report
    }

    pub(crate) fn frames(&mut self, count: u32) {
        for _ in 0..count {
            let _ = self.frame();
        }
    }

    /// Up to the frame that shows the V-frame that begins at the next boundary; all interrupt lines of the way.
    pub(crate) fn v_frame(&mut self) -> Interrupts {
        while self.master.frame() != 0 {
            let _ = self.frame();
        }
        let mut lines = Interrupts::empty();
        for _ in 0..9 {
            let _ = self.frame();
            lines |= self.lines;
        }
        lines
    }

    pub(crate) fn write(&mut self, address: u8, value: u8) {
        self.map.write(&mut self.master, address, value).unwrap();
    }

    pub(crate) fn byte(&self, address: u8) -> u8 {
        self.map.byte(address).unwrap()
    }
}

/// SICK manual, p. 41-54: what only the receiver writes; the SDK's map is memory (exceptions list, no. 7).
#[test]
fn write_protection() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        for address in 0..0x56 {
            // Control, events, messages and thresholds do something: see below.
            if matches!(address, 0x00 | 0x01 | 0x04..=0x06 | 0x08 | 0x28 | 0x2c | 0x35 | 0x38 | 0x3d | 0x40 | 0x41) {
                continue;
            }
            let protected = matches!(address, 0x03 | 0x09..=0x1f | 0x2d..=0x2f | 0x36 | 0x44..=0x55);
            for value in [0xa5, 0x5a] {
                let before = desk.byte(address);
                desk.write(address, value);
                let want = if protected && dialect == Dialect::SICK { before } else { value };
                assert_eq!(desk.byte(address), want, "{address:02x}");
            }
        }
        assert_eq!(desk.map.write(&mut desk.master, 0x56, 0), Err(Error::NoRegister { address: 0x56 }));
        assert_eq!((desk.map.read(0x55).is_some(), desk.map.read(0x56)), (true, None));
        // PC_ADD_H bit 7 always reads 1 (p. 50).
        desk.write(0x28, 0x4c);
        assert_eq!(desk.byte(0x28), if dialect == Dialect::SICK { 0xcc } else { 0x4c });
        desk.write(0x28, 0xe4);
        assert_eq!(desk.byte(0x28), 0xe4);
        // ACC_ERR_CNT: a write sets the threshold, up to 31; in the SDK the counter is memory.
        desk.write(0x38, 40);
        assert_eq!((desk.byte(0x38), desk.byte(0x41)), if dialect == Dialect::SICK { (0, 31) } else { (40, 31) });
        desk.write(0x41, 200);
        assert_eq!(desk.byte(0x41), if dialect == Dialect::SICK { 31 } else { 200 });
    }
}

/// By TI's rule any register takes what is written; LINK and the quality are those of the receiver from the next frame on, in
/// the start-up too.
#[test]
fn no_link_by_a_write() {
    for dialect in DIALECTS {
        let mut master = Master::new(dialect);
        let mut map = Registers::new(&dialect);
        for _ in 0..20 {
            map.write(&mut master, 0x03, 0xff).unwrap();
            let report = *master.hear_bits(u64::MAX, None, 0);
            let _ = map.apply(&report);
            assert_eq!((map.link(), map.quality()), (false, 0), "{dialect:?} {:?}", report.state);
        }
    }
}

/// Events are cleared by writing 0. Writing 1 sets nothing in the core (p. 36); the SDK has memory there, which holds what is
/// written.
#[test]
fn events_are_cleared_by_zeros() {
    for dialect in DIALECTS {
        let mut bytes = [0; Registers::LEN];
        (bytes[0x04], bytes[0x05], bytes[0x3d]) = (0x4a, 0x36, 0x7f);
        let mut map = Registers::from_bytes(&dialect, bytes);
        let mut master = Master::new(dialect);
        for (address, value, want) in
            [(0x04, 0xfd, 0x48), (0x04, 0x0f, 0x08), (0x05, 0xcf, 0x06), (0x3d, 0x80, 0x00), (0x3d, 0xff, 0x00)]
        {
            map.write(&mut master, address, value).unwrap();
            assert_eq!(map.byte(address), Some(if dialect == Dialect::SICK { want } else { value }));
        }
    }
}

/// Either channel becomes free by a message reset, and its event says so; a message that was dropped has no bad answer.
#[test]
fn a_reset_frees_both_channels() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.write(0x40, 0xfc);
        desk.write(0x28, 0xcc);
        desk.write(0x2c, 0x01);
        desk.frames(3);
        let _ = desk.map.take_events();
        desk.write(0x00, 0x40);
        let _ = desk.frame();
        assert!(desk.map.online_d().contains(OnlineD::FREL) && desk.map.online_1().contains(Online1::FRES));
        let events = desk.map.take_events();
        assert!(events.drive.contains(Event::FREL) && events.safe.contains(EventS::FRES), "{events:?}");
        assert!(!events.drive.contains(Event::ANS) && !desk.map.online_d().contains(OnlineD::ANS));
    }
}

/// PRST and MRST, in both control registers; the other bits do nothing.
#[test]
fn resets() {
    for dialect in DIALECTS {
        for address in [0x00, 0x35] {
            let mut desk = Desk::new(dialect, 0x00153);
            desk.write(address, 0x3f);
            assert_eq!(desk.byte(address), 0);
            let report = desk.frame();
            assert_eq!(report.restarted, None);
            assert_eq!(desk.master.transmission().head.byte().symbol(), Ok(MasterSymbol::Idle));
            // MRST: a short message that was started is gone, INIT is sent once, the encoder answers it.
            desk.write(0x40, 0xfc);
            assert_eq!(desk.byte(0x40), 0xfc);
            desk.write(address, 0x40);
            assert_eq!((desk.byte(address), desk.byte(0x40), desk.byte(0x2c)), (0, 0x3f, 0));
            let symbols = [(); 4].map(|()| {
                let _ = desk.frame();
                desk.master.transmission().head.byte().symbol().unwrap()
            });
            assert_eq!(symbols.iter().filter(|symbol| **symbol == MasterSymbol::Init).count(), 1);
            assert!(desk.map.event().contains(Event::MIN) && desk.map.event_s().contains(EventS::MIN));
            // PRST: shown until the link is started anew.
            desk.write(address, 0x80);
            assert_eq!(desk.byte(address), 0x80);
            assert_eq!(desk.frame().restarted, Some(RestartReason::Requested));
            assert_eq!((desk.byte(address), desk.map.link(), desk.master.state()), (0, false, State::Reset));
            // Before the lock there is no message to drop.
            desk.write(0x40, 0x3f);
            desk.write(address, 0x40);
            assert_eq!(desk.master.state(), State::Reset);
        }
    }
}

/// A short message by SLAVE_REG_CTRL: bit 7 reads, 0 writes S_PC_DATA; 3Fh is the idle mark. FRES alone goes meanwhile.
#[test]
fn short_messages() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.write(0x40, 0x3f);
        assert_eq!(desk.map.online_1(), Online1::FIX1 | Online1::FRES);
        desk.write(0x37, 0xa5);
        // PING, 7Fh; bit 6 is not looked at.
        desk.write(0x40, 0x7f);
        assert_eq!((desk.map.online_1(), desk.map.online_d()), (Online1::FIX1, OnlineD::FIX1 | OnlineD::FREL));
        assert_eq!(desk.map.write(&mut desk.master, 0x40, 0xfc), Err(Error::Busy));
        assert_eq!(desk.byte(0x40), 0x7f);
        desk.frames(40);
        assert_eq!(desk.device.resources().register(RemoteRegister::PING), 0xa5);
        assert_eq!((desk.byte(0x40), desk.map.event_s()), (0x3f, EventS::FRES));
        assert_eq!(desk.map.online_1(), Online1::FIX1 | Online1::FRES);
        desk.write(0x40, 0xfc);
        desk.frames(40);
        assert_eq!((desk.byte(0x37), desk.byte(0x40)), (7, 0x3f));
    }
}

/// A long message by PC_ADD, PC_OFF, PC_BUFFER and LSTA: direct and indirect, with and without an offset, reading and writing.
/// FREL alone goes meanwhile.
#[test]
fn long_messages() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        // Without LSTA nothing begins.
        desk.write(0x2c, 0xfe);
        assert!(desk.map.online_d().contains(OnlineD::FREL));
        let mut run = |bytes: &[(u8, u8)], want: &[u8]| {
            for (address, value) in bytes {
                desk.write(*address, *value);
            }
            desk.write(0x2c, 1);
            assert_eq!((desk.map.online_d(), desk.byte(0x2c)), (OnlineD::FIX1, 1));
            assert_eq!(desk.map.online_1(), Online1::FIX1 | Online1::FRES);
            assert_eq!(desk.map.write(&mut desk.master, 0x2c, 1), Err(Error::Busy));
            desk.frames(80);
            assert_eq!((desk.map.online_d(), desk.byte(0x2c)), (OnlineD::FIX1 | OnlineD::FREL, 0));
            assert_eq!(desk.map.take_events(), Events { drive: Event::FREL, safe: EventS::empty() });
            assert_eq!(&desk.map.as_bytes()[0x20..0x20 + want.len()], want);
        };
        // Direct read of 081h, 8 bytes; attribute 3 of it, 2 bytes.
        run(&[(0x28, 0xcc), (0x29, 0x81)], b"RESOLUTN");
        run(&[(0x28, 0xe4), (0x29, 0x81), (0x2a, 0x80), (0x2b, 0x03)], &[0, 15]);
        // Indirect write of 4 bytes at offset 2 of 131h, and the whole of it.
        let data = [(0x20, 1), (0x21, 2), (0x22, 3), (0x23, 4)];
        run(&[&[(0x28, 0xb9), (0x29, 0x31), (0x2b, 0x02)][..], &data].concat(), &[]);
        run(&[(0x28, 0xdd), (0x29, 0x31)], &[0, 0, 1, 2, 3, 4, 0, 0]);
        // A refusal: 200h is not there. Bit 5 of PC_ADD_H, two bytes.
        let codes = if dialect == Dialect::SICK { [0x10, 0x40] } else { [0x40, 0x10] };
        run(&[(0x28, 0xc6), (0x29, 0x00)], &codes);
        assert_eq!(desk.byte(0x28), 0xe6);
    }
}

/// SYNC_CTRL takes 0 to 10, if a frame of 112 to 273 bits comes of it: of 125 us with 5 to 10.
#[test]
fn frames_for_a_pulse() {
    let mut desk = Desk::new(Dialect::SICK, 0x00153);
    assert_eq!(desk.map.write(&mut desk.master, 0x01, 11), Err(Error::ExtraOutOfRange { extra: 11 }));
    assert_eq!(desk.map.write(&mut desk.master, 0x01, 4), Err(Error::NoPulse));
    assert_eq!(desk.byte(0x01), 0);
    desk.master.set_pulse_period(9374);
    for es in (1..=10).rev() {
        let result = desk.map.write(&mut desk.master, 0x01, es);
        assert_eq!(result.is_ok(), es >= 5, "{es}");
        assert_eq!(desk.byte(0x01), es.max(5));
    }
    desk.write(0x01, 8);
    desk.write(0x01, 0);
    assert_eq!(desk.byte(0x01), 0);
}

/// ENC_ID2 has the nibble of bits 19:16 twice; VPOS, VEL, SUMMARY at their addresses.
#[test]
fn what_is_shown() {
    let mut desk = Desk::new(Dialect::SICK, 0x7_0153);
    assert_eq!([0x0d, 0x0e, 0x0f].map(|address| desk.byte(address)), [0x77, 0x01, 0x53]);
    assert_eq!((desk.map.vpos(), desk.map.pos()), (0x8765_4321, Some(0x8765_4321)));
    assert_eq!(desk.map.vpos2(), 0xff_789a_bcde);
    desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, 1);
    desk.v_frame();
    assert_eq!((desk.byte(0x36), desk.map.online_1().contains(Online1::SSUM)), (1, true));
    let before = Registers::new(&Dialect::SICK);
    assert!(!before.link());
}

/// Interrupt lines: every new frame and position has one; events only where their mask has a one.
#[test]
fn interrupt_lines() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        let new = Interrupts::H_FRAME | Interrupts::VPOS | Interrupts::VPOS2;
        assert_eq!(desk.v_frame(), new);
        // An event without a mask, masks without an event.
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, 1);
        assert_eq!(desk.v_frame(), new);
        desk.write(0x08, 0x01);
        for (address, value) in [(0x06, 0x40), (0x07, 0x00), (0x3e, 0x40)] {
            desk.write(address, value);
        }
        let _ = desk.map.take_events();
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, 0);
        let _ = desk.v_frame();
        let _ = desk.map.take_events();
        assert_eq!(desk.v_frame(), new);
        desk.device.resources_mut().set_register(RemoteRegister::ENC_ST0, 1);
        assert_eq!(desk.v_frame(), new | Interrupts::EVENT | Interrupts::SAFE_EVENT);
        // No position: no line for channel 1.
        desk.write(0x08, 0);
        desk.write(0x06, 0);
        desk.write(0x3e, 0);
        desk.device.set_fault(Fault::NoPosition);
        let _ = desk.v_frame();
        assert_eq!(desk.v_frame(), Interrupts::H_FRAME | Interrupts::VPOS2);
    }
}

/// SUM goes by MASK_SUM. By the manual it is raised when a masked bit arises, in the SDK in every V-frame while one is set.
#[test]
fn sum_events() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        let [st0, st1] = [0x40, 0x41].map(|at| RemoteRegister::new(at).unwrap());
        let event = |desk: &mut Desk| {
            let _ = desk.v_frame();
            desk.map.take_events().drive.contains(Event::SUM)
        };
        desk.write(0x08, 0x02);
        desk.device.resources_mut().set_register(st0, 1);
        assert!(!event(&mut desk));
        desk.device.resources_mut().set_register(st1, 1);
        assert!(event(&mut desk));
        assert_eq!(event(&mut desk), dialect == Dialect::TI);
        desk.device.resources_mut().set_register(st1, 0);
        let _ = event(&mut desk);
        assert!(!event(&mut desk));
        desk.device.resources_mut().set_register(st1, 1);
        assert!(event(&mut desk));
    }
}

/// SCE and VPOS go with the next good block.
#[test]
fn flags_of_channel_1_go() {
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        desk.device.set_fault(Fault::NoPosition);
        let _ = (desk.v_frame(), desk.v_frame());
        assert!(desk.map.online_1().contains(Online1::VPOS));
        desk.device.set_fault(Fault::None);
        let _ = (desk.v_frame(), desk.v_frame());
        assert_eq!(desk.map.online_1(), Online1::FIX1 | Online1::FRES);
        desk.device.set_fault(Fault::BadCrc);
        let _ = desk.v_frame();
        desk.device.set_fault(Fault::None);
        while !desk.map.online_1().contains(Online1::SCE) {
            let _ = desk.frame();
        }
        let _ = (desk.v_frame(), desk.v_frame());
        assert!(!desk.map.online_1().contains(Online1::SCE));
    }
}

/// FIX2 is 11100b (register list).
#[test]
fn fixed_bits_of_channel_2() {
    for raw in 0..=255_u8 {
        assert_eq!(Status2::from_bits_retain(raw).is_fixed_part_right(), raw % 32 == 28);
    }
}

fn word(character: Character) -> hdsl::symbol::Reading {
    character.encode(RunningDisparity::Minus).word.read(Rule::Strict)
}

/// PIPE_S and PIPE_D.
fn take(fifo: &mut PipeFifo) -> (u8, u8) {
    let entry = fifo.take();
    (entry.status, entry.data)
}

/// The FIFO of the pipe (p. 52-53): order, eight places, what is dropped, what is said with each entry.
#[test]
fn pipe_fifo() {
    let mut fifo = PipeFifo::new();
    assert_eq!((take(&mut fifo), fifo.len(), fifo.is_empty()), ((4, 0), 0, true));
    // Three times round, so that the places wrap.
    for round in 0..3 {
        for byte in 0..5 {
            fifo.put(word(Character::data(byte)));
            fifo.put(word(Character::control(Control::K30_7)));
        }
        assert_eq!((fifo.len(), fifo.is_empty()), (5, false));
        for byte in 0..5 {
            assert_eq!(take(&mut fifo), (0, byte), "{round}");
        }
    }
    // Ten entries: the two oldest are gone, and that is said once, besides what the entry is.
    fifo.put(word(Character::data(0x70)));
    fifo.put(word(Character::data(0x71)));
    fifo.put(word(Character::control(Control::K28_0)));
    fifo.put(Word::truncate(0).read(Rule::Strict));
    for byte in 0..6 {
        fifo.put(word(Character::data(byte)));
    }
    assert_eq!(fifo.len(), 8);
    assert_eq!((take(&mut fifo), take(&mut fifo).0), ((9, 0x1c), 2));
    for byte in 0..6 {
        assert_eq!(take(&mut fifo), (0, byte));
    }
    assert_eq!(take(&mut fifo), (4, 0));
    // Over the bus: PIPE_S takes an entry out and freezes it for PIPE_D; in the SDK PIPE_D is the last byte.
    for dialect in DIALECTS {
        let mut desk = Desk::new(dialect, 0x00153);
        for byte in [1, 2] {
            desk.device.set_pipe(Some(byte));
            let _ = desk.frame();
        }
        let read = [0x2d, 0x2e, 0x2e, 0x2d, 0x2e, 0x2d].map(|address| desk.map.read(address).unwrap());
        assert_eq!(read, if dialect == Dialect::SICK { [0, 1, 1, 0, 2, 4] } else { [0, 2, 2, 0, 2, 0] });
    }
}
