//! `RemoteReceiver` on buses that behave like the two devices: the memory that the firmware of the Motor Control SDK shares, and
//! the registers of the SICK IP core.

use core::convert::Infallible;

use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::{BusError, Event, EventS, Events, RegisterBus, Registers, RemoteReceiver};
use hdsl::{Dialect, Error};

/// Memory; the firmware reads and writes it too, a frame after the host.
pub(crate) struct Firmware {
    pub(crate) memory: [u8; 0x56],
    /// Events that come between a reading and a writing of the host.
    meanwhile: Option<(usize, u8)>,
    /// The encoder answers no messages.
    pub(crate) mute: bool,
    /// Frames until the encoder has answered INIT.
    init: u8,
}

impl Firmware {
    pub(crate) fn new() -> Self {
        let mut memory = [0; 0x56];
        (memory[0x40], memory[0x51], memory[0x53]) = (0x3f, 0x02, 0x01);
        Self { memory, meanwhile: None, mute: false, init: 0 }
    }

    /// The link restarts and locks again: messages are dropped, FREL and FRES are events of the lock.
    pub(crate) fn restart(&mut self) {
        self.memory[0x04] |= 0x01;
        self.memory[0x05] |= 0x02;
        self.memory[0x3d] |= 0x05;
        (self.memory[0x40], self.memory[0x2c], self.memory[0x51], self.memory[0x53]) = (0x3f, 0, 0x02, 0x01);
    }

    /// What the firmware does in its next frame.
    pub(crate) fn frame(&mut self) {
        // It comes some frames later, and lasts for three.
        let init = matches!(self.init, 1..=3);
        self.init = self.init.saturating_sub(1);
        self.memory[0x05] |= if init { 0x20 } else { 0 };
        if self.memory[0x00] & 0x40 != 0 {
            (self.memory[0x00], self.memory[0x40], self.memory[0x2c]) = (0, 0x3f, 0);
            (self.memory[0x51], self.memory[0x53], self.init) = (0x02, 0x01, 6);
            self.memory[0x05] |= 0x02;
            self.memory[0x3d] |= 0x01;
        }
        self.memory[0x53] = u8::from(self.memory[0x40] == 0x3f);
        self.memory[0x51] = if self.memory[0x2c] & 1 == 0 { 0x02 } else { 0 } | if init { 0x20 } else { 0 };
        if self.mute {
            return;
        }
        if self.memory[0x40] != 0x3f {
            if self.memory[0x40] & 0x80 != 0 {
                self.memory[0x37] = 0x5a;
            }
            (self.memory[0x40], self.memory[0x53]) = (0x3f, 0x01);
            self.memory[0x3d] |= 0x01;
        }
        if self.memory[0x2c] & 1 != 0 {
            (self.memory[0x2c], self.memory[0x51]) = (0, 0x02);
            self.memory[0x20..0x28].copy_from_slice(b"RESOLUTN");
            self.memory[0x05] |= 0x02;
        }
    }
}

impl RegisterBus for Firmware {
    type Error = Infallible;

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Infallible> {
        let from = usize::from(address);
        bytes.copy_from_slice(&self.memory[from..from + bytes.len()]);
        if let Some((at, event)) = self.meanwhile.take_if(|(at, _)| (from..from + bytes.len()).contains(at)) {
            self.memory[at] |= event;
        }
        Ok(())
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Infallible> {
        let from = usize::from(address);
        self.memory[from..from + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

/// The core: events are cleared by zeros and set by nothing that is written; what it shows cannot be written; the registers from
/// 40h on are the encoder's.
pub(crate) struct Core {
    pub(crate) registers: [u8; 0x40],
    encoder: [u8; 0x40],
    reading: Option<u8>,
    writing: bool,
    accesses: u32,
    /// The encoder answers no messages, and the core repeats them.
    pub(crate) mute: bool,
    /// Frames until the encoder has answered INIT.
    init: u8,
    /// It does, and the event cannot be cleared.
    min: bool,
}

impl Core {
    pub(crate) fn new() -> Self {
        let mut registers = [0; 0x40];
        (registers[0x39], registers[0x3a], registers[0x3b]) = (0xff, 0xff, 0xff);
        let encoder = core::array::from_fn(|at| at as u8);
        Self { registers, encoder, reading: None, writing: false, accesses: 0, mute: false, init: 0, min: false }
    }

    /// The link restarts and locks again: messages are dropped, FREL and FRES are events of the lock.
    pub(crate) fn restart(&mut self) {
        self.registers[0x04] |= 0x01;
        self.registers[0x05] |= 0x02;
        self.registers[0x3d] |= 0x05;
        (self.reading, self.writing, self.registers[0x2c]) = (None, false, 0);
    }

    pub(crate) fn frame(&mut self) {
        // It comes some frames later, and lasts for three.
        self.min = matches!(self.init, 1..=3);
        self.init = self.init.saturating_sub(1);
        self.registers[0x05] |= if self.min { 0x20 } else { 0 };
        if self.registers[0x00] & 0x40 != 0 {
            (self.registers[0x00], self.reading, self.writing, self.registers[0x2c]) =
                (self.registers[0x00] & 0x3f, None, false, 0);
            self.registers[0x05] |= 0x02;
            self.registers[0x3d] |= 0x01;
            self.init = 6;
        }
        if self.mute {
            return;
        }
        if core::mem::take(&mut self.writing) {
            self.registers[0x3d] |= 0x01;
        }
        if let Some(register) = self.reading.take() {
            self.registers[0x2f] = self.encoder[usize::from(register & 0x3f)];
            self.registers[0x3d] |= 0x01;
        }
        if self.registers[0x2c] & 1 != 0 {
            self.registers[0x2c] = 0;
            self.registers[0x20..0x28].copy_from_slice(b"RESOLUTN");
            self.registers[0x05] |= 0x02;
        }
    }
}

impl RegisterBus for Core {
    type Error = Infallible;

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Infallible> {
        for (address, byte) in (address..).zip(bytes) {
            if address < 0x40 {
                *byte = self.registers[usize::from(address)];
            } else {
                // A dummy; the answer comes later.
                (*byte, self.reading, self.accesses) = (0xee, Some(address), self.accesses + 1);
            }
        }
        Ok(())
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Infallible> {
        for (address, byte) in (address..).zip(bytes) {
            match address {
                0x05 if self.min => self.registers[0x05] &= byte | 0x20,
                0x04 | 0x05 | 0x3d => self.registers[usize::from(address)] &= byte,
                0x03 | 0x09..=0x1f | 0x2d..=0x2f | 0x36 => {}
                0x00..=0x3f => self.registers[usize::from(address)] = *byte,
                _ => {
                    self.encoder[usize::from(address & 0x3f)] = *byte;
                    self.writing = true;
                }
            }
        }
        Ok(())
    }
}

const NONE: Events = Events { drive: Event::empty(), safe: EventS::empty() };

/// What was taken is gone, what nobody read stays, and nothing comes that never happened.
#[test]
fn events_are_taken_once() {
    let mut remote = RemoteReceiver::new(Dialect::TI, Firmware::new());
    (remote.bus().memory[0x04], remote.bus().memory[0x05], remote.bus().memory[0x3d]) = (0x08, 0x22, 0x41);
    let events = Events { drive: Event::from_bits_retain(0x0822), safe: EventS::from_bits_retain(0x41) };
    assert_eq!(remote.take_events(), Ok(events));
    assert_eq!((remote.take_events(), remote.take_events()), (Ok(NONE), Ok(NONE)));
    assert_eq!((remote.bus().memory[0x04], remote.bus().memory[0x05], remote.bus().memory[0x3d]), (0, 0, 0));

    let mut remote = RemoteReceiver::new(Dialect::SICK, Core::new());
    (remote.bus().registers[0x04], remote.bus().registers[0x05], remote.bus().registers[0x3d]) = (0x08, 0x22, 0x41);
    assert_eq!(remote.take_events(), Ok(events));
    assert_eq!((remote.take_events(), remote.take_events()), (Ok(NONE), Ok(NONE)));
}

/// Messages take the events that they wait for and leave the others alone, those that come at the same time too.
#[test]
fn messages_leave_other_events_alone() {
    let mut remote = RemoteReceiver::new(Dialect::TI, Firmware::new());
    (remote.bus().memory[0x05], remote.bus().memory[0x3d]) = (0x30, 0x41);
    remote.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
    remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
    remote.bus().frame();
    assert_eq!(remote.poll_short(), Ok(Some(0x5a)));
    assert_eq!(remote.poll_long().unwrap().unwrap().as_bytes(), b"RESOLUTN");
    assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
    // ANS was cleared with the request.
    let left = Events { drive: Event::MIN, safe: EventS::SSUM };
    assert_eq!(remote.take_events(), Ok(left));
    // Set by the firmware between reading and writing: it is lost, and nothing else is made of it. The online status has it.
    (remote.bus().memory[0x05], remote.bus().meanwhile) = (0x02, Some((0x05, 0x04)));
    assert_eq!(remote.take_events().map(|events| events.drive), Ok(Event::FREL));
    assert_eq!(remote.take_events(), Ok(NONE));
}

/// The registers of an encoder are reached directly in the core; PC_DATA has what comes back.
#[test]
fn messages_of_the_core() {
    let mut remote = RemoteReceiver::new(Dialect::SICK, Core::new());
    remote.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
    assert_eq!(remote.start_short(ShortRequest::Read(RemoteRegister::PING)), Err(BusError::Link(Error::Busy)));
    assert_eq!(remote.poll_short(), Ok(None));
    remote.bus().frame();
    assert_eq!((remote.poll_short(), remote.bus().accesses), (Ok(Some(0x3c)), 1));
    remote.start_short(ShortRequest::Write(RemoteRegister::PING, 0xa5)).unwrap();
    assert_eq!((remote.bus().encoder[0x3f], remote.poll_short()), (0xa5, Ok(None)));
    remote.bus().frame();
    assert!(remote.poll_short().unwrap().is_some());
    remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    assert!(matches!(
        remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)),
        Err(BusError::Link(Error::Busy))
    ));
    assert_eq!(remote.poll_long(), Ok(None));
    remote.bus().frame();
    assert_eq!(remote.poll_long().unwrap().unwrap().as_bytes(), b"RESOLUTN");
    assert_eq!(remote.poll_long(), Ok(None));
}

/// An image of each: nothing of the encoder's registers is taken for the receiver's.
#[test]
fn images() {
    let mut remote = RemoteReceiver::new(Dialect::SICK, Core::new());
    remote.bus().registers[0x19..0x1e].copy_from_slice(&[0, 0, 0, 0x12, 0x34]);
    let map = remote.registers().unwrap();
    assert_eq!((map.vpos(), map.byte(0x46), map.byte(0x39), remote.bus().accesses), (0x1234, Some(0), Some(0xff), 0));
    // LINK and QM 15; whether the position is aligned is in the online status, which is no register.
    (remote.bus().registers[0x03], remote.bus().registers[0x14]) = (0x8f, 0x05);
    let map = remote.registers().unwrap();
    assert_eq!((map.link(), map.pos(), map.vel()), (true, None, None));
    let safe2 = core::array::from_fn(|at| at as u8);
    let map = Registers::from_core(&[0; 0x40], Some(&safe2));
    assert_eq!((map.byte(0x44), map.byte(0x46), map.vpos2()), (Some(0x0b), Some(0x18), 0x19_1a1b_1c1d));
    assert_eq!((map.byte(0x45), map.byte(0x4c), map.byte(0x4d)), (Some(0x0f), Some(0x1e), Some(0x1f)));
}

/// Reset values, PC_DATA and MSUM of the map by the manual's rules, which the SDK does not have.
#[test]
fn what_only_the_manual_has() {
    for (dialect, max, msum) in [(Dialect::SICK, [0xff; 3], 0x40), (Dialect::TI, [0; 3], 0x00)] {
        let mut map = Registers::new(&dialect);
        assert_eq!([0x39, 0x3a, 0x3b].map(|at| map.byte(at).unwrap()), max);
        let mut master = hdsl::master::Master::new(dialect);
        for mask in [0x10, 0x01, 0x80] {
            map.write(&mut master, 0x08, mask).unwrap();
            assert_eq!(map.byte(0x06), Some(msum));
        }
        // MSUM is the OR of MASK_SUM, whatever is written to it; in the SDK it is a bit of its own.
        for value in [0x4b, 0x0b, 0xff] {
            map.write(&mut master, 0x06, value).unwrap();
            assert_eq!(map.byte(0x06), Some(value & 0xbf | if msum == 0 { value & 0x40 } else { 0x40 }));
        }
        map.write(&mut master, 0x06, 0x00).unwrap();
        map.write(&mut master, 0x08, 0x00).unwrap();
        assert_eq!(map.byte(0x06), Some(0));
        map.write(&mut master, 0x06, 0x48).unwrap();
        assert_eq!(map.byte(0x06), Some(0x48 ^ msum));
        let mut bytes = [0; Registers::LEN];
        bytes[0x46] = 0x9c;
        assert_eq!(Registers::from_bytes(&dialect, bytes).status_2().bits(), 0x9c);
    }
}

/// Events are taken while messages are under way: their ends are seen, and the messages end all the same.
#[test]
fn taking_events_does_not_take_the_end_of_a_message_away() {
    fn ends<B: RegisterBus<Error = Infallible>>(mut remote: RemoteReceiver<B>, frame: fn(&mut B), value: u8) {
        for _ in 0..3 {
            remote.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
            remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
            assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
            frame(remote.bus());
            let events = remote.take_events().unwrap();
            assert_eq!(events, Events { drive: Event::FREL, safe: EventS::FRES });
            assert_eq!(remote.take_events(), Ok(NONE));
            assert_eq!(remote.poll_short(), Ok(Some(value)));
            let name = remote.poll_long().unwrap().unwrap();
            assert_eq!(name.as_bytes(), b"RESOLUTN");
            assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
        }
    }
    ends(RemoteReceiver::new(Dialect::TI, Firmware::new()), Firmware::frame, 0x5a);
    ends(RemoteReceiver::new(Dialect::SICK, Core::new()), Core::frame, 0x3c);
}

/// An answer that failed is told by ANS, which may have been taken too.
#[test]
fn a_failed_answer_is_known_after_its_event_was_taken() {
    let mut remote = RemoteReceiver::new(Dialect::TI, Firmware::new());
    remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    let failed = Event::FREL | Event::ANS;
    remote.bus().memory[0x05] |= failed.bits() as u8;
    assert_eq!(remote.take_events().map(|events| events.drive), Ok(failed));
    assert_eq!(remote.poll_long(), Err(BusError::Link(Error::NotAccepted { tries: 1 })));
    // Nothing of it is left for the next one.
    remote.bus().memory[0x2c] = 0;
    remote.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    assert_eq!(remote.poll_long(), Ok(None));
    remote.bus().frame();
    assert!(remote.poll_long().unwrap().is_some());
}

/// Memory with a record of what is written.
struct Memory {
    bytes: [u8; Registers::LEN],
    written: Vec<(u8, Vec<u8>)>,
}

impl RegisterBus for Memory {
    type Error = ();

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), ()> {
        let from = usize::from(address);
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), ()> {
        self.written.push((address, bytes.to_vec()));
        Ok(())
    }
}

/// What a remote receiver writes over its bus, byte for byte.
#[test]
fn accesses_of_a_remote_receiver() {
    let remote = |dialect: Dialect, bytes: &[(usize, u8)]| {
        let mut memory = Memory { bytes: [0; Registers::LEN], written: Vec::new() };
        for (address, value) in bytes {
            memory.bytes[*address] = *value;
        }
        RemoteReceiver::new(dialect, memory)
    };
    let written = |mut remote: RemoteReceiver<Memory>| core::mem::take(&mut remote.bus().written);

    // Events: those that were read are cleared.
    let mut bus = remote(Dialect::TI, &[(0x04, 0x08), (0x05, 0x22), (0x3d, 0x41)]);
    let events = Events { drive: Event::from_bits_retain(0x0822), safe: EventS::from_bits_retain(0x41) };
    assert_eq!(bus.take_events(), Ok(events));
    assert_eq!(written(bus), [(0x04, vec![0, 0]), (0x3d, vec![0])]);

    // Short messages, free (FRES, bit 0 of 53h) and not.
    let (read, write) = (ShortRequest::Read(RemoteRegister::SRSSI), ShortRequest::Write(RemoteRegister::PING, 0xa5));
    let mut bus = remote(Dialect::TI, &[(0x53, 0xfe)]);
    assert_eq!(bus.start_short(read), Err(BusError::Link(Error::Busy)));
    assert_eq!(written(bus), []);
    let mut bus = remote(Dialect::TI, &[(0x53, 0x01)]);
    bus.start_short(read).unwrap();
    bus.start_short(write).unwrap();
    let want = [(0x3d, vec![0]), (0x40, vec![0xfc]), (0x3d, vec![0]), (0x37, vec![0xa5]), (0x40, vec![0x7f])];
    assert_eq!(written(bus), want);
    let mut bus = remote(Dialect::TI, &[(0x3d, 0xfe), (0x37, 0x07)]);
    assert_eq!((bus.poll_short(), written(bus)), (Ok(None), vec![]));
    let mut bus = remote(Dialect::TI, &[(0x3d, 0x01), (0x37, 0x07)]);
    assert_eq!((bus.poll_short(), written(bus)), (Ok(Some(7)), vec![(0x3d, vec![0x00])]));

    // Long messages, free (FREL, bit 1 of 51h) and not.
    let request = crate::bench::write_file(6, b"42");
    let mut bus = remote(Dialect::TI, &[(0x51, 0xfd)]);
    assert_eq!(bus.start_long(&request), Err(BusError::Link(Error::Busy)));
    assert_eq!(written(bus), []);
    let mut bus = remote(Dialect::TI, &[(0x51, 0x02)]);
    bus.start_long(&request).unwrap();
    bus.start_long(&LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    let want = [
        (0x05, vec![0]),
        (0x20, b"42".to_vec()),
        (0x2a, vec![0x80, 0x06]),
        (0x28, vec![0xb5, 0x31]),
        (0x2c, vec![1]),
        (0x05, vec![0]),
        (0x28, vec![0xcc, 0x81]),
        (0x2c, vec![1]),
    ];
    assert_eq!(written(bus), want);
    let mut bus = remote(Dialect::TI, &[(0x05, 0xfd), (0x28, 0xcc)]);
    assert_eq!((bus.poll_long(), written(bus)), (Ok(None), vec![]));
    // ANS; the ends of reading 0, 2, 4 and 8 bytes, and of writing.
    let mut bus = remote(Dialect::TI, &[(0x05, 0x12)]);
    assert_eq!(bus.poll_long(), Err(BusError::Link(Error::NotAccepted { tries: 1 })));
    assert_eq!(written(bus), [(0x05, vec![0])]);
    for (header, len) in [(0xc0, 0), (0xc4, 2), (0xc8, 4), (0xcc, 8), (0x8c, 0)] {
        let mut bytes = vec![(0x05, 0x02), (0x28, header)];
        bytes.extend((0..8).map(|at| (0x20 + at, b'0' + u8::try_from(at).unwrap())));
        let mut bus = remote(Dialect::TI, &bytes);
        assert_eq!(bus.poll_long().unwrap().unwrap().as_bytes(), &b"01234567"[..len]);
        assert_eq!(written(bus), [(0x05, vec![0])]);
    }
    // A refusal: class and detail as the dialect orders them.
    for (dialect, first, second) in [(Dialect::SICK, 0x10, 0x40), (Dialect::TI, 0x40, 0x10)] {
        let mut bus = remote(dialect, &[(0x05, 0x02), (0x28, 0xe4), (0x20, first), (0x21, second)]);
        let error = hdsl::message::ResourceError::NOT_THERE;
        assert_eq!(bus.poll_long(), Err(BusError::Link(Error::Resource { error })));
    }
}
