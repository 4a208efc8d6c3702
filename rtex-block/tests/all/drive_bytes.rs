//! The modelled drive by the bytes that it takes and gives; nothing of the crate's codec is used.

mod motion;

use crate::common::CODES;
use rtex_block::device::{Behaviour, Drive, DriveConfig, Fault, Quirks, check};
use rtex_block::{Alarm, BlockSize, MacId};

const ON: [u8; 2] = [0x80, 0];
const OFF: [u8; 2] = [0, 0];
const NOTHING: [u8; 8] = [0; 8];

struct Raw {
    drive: Drive,
    counter: u8,
}

fn config() -> DriveConfig {
    DriveConfig::new(MacId::new(9).unwrap(), CODES).with_sync_exchanges(2).with_servo_on_updates(0)
}

/// Bytes 8-15 with type code, index and data.
fn about(type_code: u16, index: u16, data: i32) -> [u8; 8] {
    let ([a, b], [c, d], [e, f, g, h]) = (type_code.to_le_bytes(), index.to_le_bytes(), data.to_le_bytes());
    [a, b, c, d, e, f, g, h]
}

fn number(block: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(block[at..at + 4].try_into().unwrap())
}

impl Raw {
    fn new(config: DriveConfig) -> Self {
        Self { drive: Drive::new(config), counter: 0 }
    }

    /// Energised, in the mode of this code.
    fn on(config: DriveConfig, code: u8) -> Self {
        let mut raw = Self::new(config);
        raw.hold(6, code, ON, 0, NOTHING);
        assert!(raw.drive.is_active());
        raw
    }

    fn block(&mut self, code: u8, control: [u8; 2], data1: i32, tail: [u8; 8]) -> [u8; 16] {
        self.counter = (self.counter + 1) % 4;
        let mut block = [0; 16];
        block[..4].copy_from_slice(&[self.counter << 5 | 9, code, control[0], control[1]]);
        block[4..8].copy_from_slice(&data1.to_le_bytes());
        block[8..].copy_from_slice(&tail);
        block
    }

    /// Sends a command; the response is to the one before.
    fn send(&mut self, code: u8, control: [u8; 2], data1: i32, tail: [u8; 8]) -> [u8; 16] {
        let block = self.block(code, control, data1, tail);
        let response = self.drive.hear(&block).unwrap();
        assert_eq!(response[0], 0x80 | block[0]);
        response
    }

    /// Sends the same command again and again, and gives the last response.
    fn hold(&mut self, times: usize, code: u8, control: [u8; 2], data1: i32, tail: [u8; 8]) -> [u8; 16] {
        (0..times).map(|_| self.send(code, control, data1, tail)).last().unwrap()
    }

    /// A request with the servo off, and its answer.
    fn ask(&mut self, code: u8, tail: [u8; 8]) -> [u8; 16] {
        self.hold(2, code & 0xf0, OFF, 0, NOTHING);
        self.hold(12, code, OFF, 0, tail)
    }

    fn write(&mut self, index: u16, value: i32) {
        let answer = self.ask(0x26, about(0x11, index, value));
        assert_eq!((answer[1], answer[9], number(&answer, 12)), (0x26, 0, value));
        self.hold(2, 0x20, OFF, 0, NOTHING);
    }

    fn monitor(&mut self, code: u8, control: [u8; 2], data1: i32, type_code: u16) -> i32 {
        let answer = self.hold(2, code, control, data1, about(type_code, 0, 0));
        assert_eq!((answer[1], answer[8], answer[9]), (code, type_code.to_le_bytes()[0], 0), "{type_code:x}");
        number(&answer, 12)
    }
}

/// Each fault of the model, by its bytes.
#[test]
fn faults_byte_by_byte() {
    let mut raw = Raw::on(config().with_lost_limit(3), 0x20);
    let good = raw.hold(3, 0x20, ON, 0, NOTHING);
    raw.drive.set_fault(Fault::WrongMacId(MacId::new(30).unwrap()));
    let block = raw.block(0x20, ON, 0, NOTHING);
    assert_eq!(raw.drive.hear(&block).unwrap()[..3], [0x9e | block[0] & 0x60, 0x20, good[2]]);
    // Its processing stands still: the same bytes, whatever is sent, and the motor as it was.
    raw.drive.set_fault(Fault::None);
    let last = raw.send(0x20, ON, 0, NOTHING);
    raw.drive.set_fault(Fault::StaleEcho);
    for _ in 0..9 {
        let block = raw.block(0x20, OFF, 0, NOTHING);
        assert_eq!(raw.drive.hear(&block), Some(last));
    }
    assert!(raw.drive.is_active());
    // Off the ring it says nothing, and misses the frames as it does without any.
    raw.drive.set_fault(Fault::Silent);
    for period in 0..3 {
        assert!(raw.drive.is_active(), "{period}");
        assert_eq!(raw.drive.hear(&block), None);
    }
    assert_eq!((raw.drive.is_active(), raw.drive.alarm()), (false, Some(Alarm { main: 80, sub: 0 })));
    raw.drive.set_fault(Fault::None);
    assert!(raw.drive.alarm().is_some());
}

/// Ready as soon as as many exchanges are over as it needs for synchronisation.
#[test]
fn ready_when_it_is_synchronised() {
    let mut raw = Raw::new(config().with_sync_exchanges(5));
    let ready: Vec<_> = (0..7).map(|_| raw.send(0x20, OFF, 0, NOTHING)[2] & 0x40 != 0).collect();
    assert_eq!(ready, [false, false, false, false, false, true, true]);
}

#[test]
fn status_byte_by_byte() {
    let mut raw = Raw::new(config());
    // Neither ready nor in any way else but in position, until it is synchronised.
    assert_eq!(raw.send(0x20, OFF, 0, NOTHING), [0xa9, 0x00, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(raw.hold(3, 0x20, OFF, 0, NOTHING)[1..4], [0x20, 0x41, 0]);
    raw.drive.set_warning(0xa0);
    raw.drive.set_inputs(0x5a);
    assert_eq!(raw.send(0x20, OFF, 0, NOTHING)[2..4], [0x51, 0x5a]);
    raw.drive.set_warning(0);
    raw.drive.set_inputs(0);
    assert_eq!(raw.hold(4, 0x20, ON, 0, NOTHING)[2], 0xc1);
    // Main power that comes again takes nothing away; main power that goes releases the motor at once.
    raw.drive.set_fault(Fault::None);
    assert!(raw.drive.is_active());
    raw.drive.set_fault(Fault::NoMainPower);
    assert!(!raw.drive.is_active());
    assert_eq!(raw.send(0x20, OFF, 0, NOTHING)[2], 0x01);
    raw.drive.set_fault(Fault::None);
    assert_eq!(raw.ask(0x24, about(0x21, 0, 500))[2], 0x45);
    assert_eq!(raw.drive.position(), 500);
    raw.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
    assert_eq!(raw.send(0x20, OFF, 0, NOTHING)[2], 0x25);
    // An unknown homing type is refused.
    let refused = raw.ask(0x24, about(0xee, 0, 0));
    assert_eq!((refused[1], &refused[8..12]), (0xa4, &[0x31, 0, 0, 0][..]));
}

#[test]
fn faults_count_from_synchronisation_on() {
    for spoil in [|block: &mut [u8; 16]| block[0] |= 0x80, |block: &mut [u8; 16]| block[0] = 0x29] {
        let mut raw = Raw::new(config().with_sync_exchanges(16).with_fault_limit(1).with_counter_limit(1));
        for k in 1..=16 {
            assert_eq!(raw.drive.alarm(), None, "{k}");
            let mut block = raw.block(0x20, OFF, 0, NOTHING);
            spoil(&mut block);
            raw.drive.hear(&block).unwrap();
        }
        assert!(matches!(raw.drive.alarm(), Some(Alarm { main: 86, sub: 0 | 2 })));
    }
}

#[test]
fn sub_blocks_byte_by_byte() {
    let mut raw = Raw::on(config(), 0x20);
    let mut both = |at, byte16: u8| {
        let mut block = [0; 32];
        for _ in 0..2 {
            block[..16].copy_from_slice(&raw.block(0x20, ON, at, NOTHING));
            block[16..18].copy_from_slice(&[byte16, 0x07]);
            raw.drive.hear(&block).unwrap();
        }
        block[..16].copy_from_slice(&raw.block(0x20, ON, at, NOTHING));
        (raw.drive.hear(&block).unwrap()[16..20].to_vec(), raw.drive.position())
    };
    // Sub_Chk = 0: the main command is not executed either.
    assert_eq!(both(400, 0x0a), (vec![0x8a, 0, 0x12, 0], 0));
    assert_eq!(both(0, 0x85), (vec![0x85, 0, 0x22, 0], 0));
    assert_eq!(both(400, 0x85).1, 231);
    assert_eq!(both(400, 0x8a).0, [0x0a, 0x07, 0, 0]);
    let verdict = |block: &[u8], size| check(block, size, MacId::new(9).unwrap());
    let mut block = [0; 32];
    (block[0], block[1], block[16]) = (9, 0x20, 0x85);
    let found = verdict(&block, BlockSize::Bytes32);
    assert_eq!((found.sub_error.map(|code| code.0), found.alarm, found.is_discarded()), (Some(0x22), None, false));
    block[0] = 0x89;
    assert!(verdict(&block, BlockSize::Bytes32).is_discarded());
    // A block of another size is not for this drive.
    assert_eq!(verdict(&block[..16], BlockSize::Bytes32).error.map(|code| code.0), Some(0x11));
    assert_eq!(verdict(&block, BlockSize::Bytes16).error.map(|code| code.0), Some(0x11));
    assert_eq!(verdict(&block[..1], BlockSize::Bytes16).error.map(|code| code.0), Some(0x11));
}

/// Pr7.35: 0 nothing, 1 velocity, 2 torque up to 300 %.
#[test]
fn feed_forward_in_its_range() {
    let mut raw = Raw::new(config());
    raw.hold(3, 0x20, OFF, 0, NOTHING);
    let feed = |raw: &mut Raw, value| {
        let answer = raw.hold(2, 0x20, OFF, 0, about(0, 0, value));
        (answer[1], answer[8], raw.drive.feed_forward())
    };
    assert_eq!(feed(&mut raw, 1), (0xa0, 0x32, 0));
    raw.write(0x0723, 2);
    assert_eq!(feed(&mut raw, 3_000), (0x20, 0, 3_000));
    assert_eq!(feed(&mut raw, 3_001), (0xa0, 0x34, 3_000));
    assert_eq!(feed(&mut raw, -3_000), (0x20, 0, -3_000));
    assert_eq!(feed(&mut raw, -3_001), (0xa0, 0x34, -3_000));
    raw.write(0x0723, 1);
    assert_eq!(feed(&mut raw, 70_000), (0x20, 0, 70_000));
    // Homing types that need bytes 12-15 leave it, others carry it.
    raw.hold(3, 0x24, OFF, 0, about(0x21, 0, 5));
    assert_eq!(raw.drive.feed_forward(), 70_000);
    raw.hold(3, 0x24, OFF, 0, about(0x50, 0, 6));
    assert_eq!(raw.drive.feed_forward(), 6);
    raw.write(0x0723, 0);
    assert_eq!(feed(&mut raw, 0), (0x20, 0, 0));
}

#[test]
fn resets() {
    let behaviour = Behaviour::new().with_quirks(Quirks::PARAMETERS_AFTER_RESET);
    for (type_code, clears) in [(0x01, true), (0x11, false)] {
        let mut raw = Raw::on(config(), 0x20);
        raw.drive.set_behaviour(behaviour);
        // Not while the servo is on.
        let answer = raw.hold(12, 0x21, ON, 0, about(type_code, 0, 0));
        assert_eq!((answer[1], answer[9]), (0x21, 0x80));
        raw.drive.set_fault(Fault::Alarm(Alarm { main: 16, sub: 0 }));
        let refused = raw.ask(0x21, about(0x02, 0, 0));
        assert_eq!((refused[1], refused[8]), (0xa1, 0x31));
        let refused = raw.ask(0x21, about(type_code, 1, 0));
        assert_eq!((refused[1], refused[8]), (0xa1, 0x32));
        raw.write(0x0723, 1);
        assert_eq!(raw.hold(2, 0x20, OFF, 0, about(0, 0, 7))[1], 0xa0);
        let answer = raw.ask(0x21, about(type_code, 0, 0));
        assert_eq!((answer[1], &answer[8..]), (0x21, &[type_code.to_le_bytes()[0], 0, 0, 0, 0, 0, 0, 0][..]));
        assert_eq!(raw.drive.alarm().is_none(), clears);
        assert_eq!(raw.hold(2, 0x20, OFF, 0, about(0, 0, 7))[1], 0x20);
        assert_eq!(raw.drive.feed_forward(), 7);
        raw.send(0x21, OFF, 0, about(type_code, 0, 7));
        assert_eq!(raw.drive.feed_forward(), if clears { 0 } else { 7 });
    }
}

/// A forgetful drive answers a new request as often as it was told with what it was asked before.
#[test]
fn stale_answers_are_counted() {
    let behaviour = Behaviour::new().with_stale_answers(3);
    let mut raw = Raw::new(config());
    raw.drive.set_behaviour(behaviour);
    raw.hold(3, 0x20, OFF, 0, NOTHING);
    let types = |raw: &mut Raw, code, tail| {
        (0..8)
            .map(|_| raw.send(code, OFF, 0, tail))
            .filter(|answer| answer[1] == code)
            .map(|answer| (answer[8], answer[10]))
            .collect::<Vec<_>>()
    };
    assert_eq!(types(&mut raw, 0x2a, about(0x07, 0, 0)), [vec![(0x06, 0); 3], vec![(0x07, 0); 4]].concat());
    // Another one at once: the old one is the one before.
    let next = types(&mut raw, 0x2a, about(0x01, 0, 0));
    assert_eq!(next[..6], [vec![(0x07, 0); 4], vec![(0x01, 0); 2]].concat());
    // One of another kind has nothing to do with it: its layout would be another.
    assert_eq!(types(&mut raw, 0x22, about(0x01, 1, 0)), [(0x01, 1); 7]);
    // Texts and parameters differ by the index.
    raw.hold(2, 0x20, OFF, 0, NOTHING);
    assert_eq!(types(&mut raw, 0x22, about(0x01, 1, 0))[..4], [(0x01, 0), (0x01, 0), (0x01, 0), (0x01, 1)]);
    // None is stale without that manner, nor busy.
    let mut raw = Raw::new(config());
    raw.hold(3, 0x20, OFF, 0, NOTHING);
    assert_eq!(types(&mut raw, 0x2a, about(0x07, 0, 0)), [(0x07, 0); 7]);
}

/// Busy for four exchanges, without data, whatever else changes in a monitor command meanwhile; a parameter with other data
/// is another command.
#[test]
fn busy_and_then_done() {
    let mut raw = Raw::new(config());
    raw.drive.set_behaviour(Behaviour::new().with_quirks(Quirks::ALWAYS_BUSY));
    raw.hold(3, 0x20, OFF, 0, NOTHING);
    let read = |raw: &mut Raw, code, tails: &[[u8; 8]]| {
        let answers = tails.iter().map(|tail| raw.send(code, OFF, 0, *tail)).collect::<Vec<_>>();
        let answers = answers.into_iter().filter(|answer| answer[1] == code);
        answers.map(|answer| (answer[9], number(&answer, 12))).collect::<Vec<_>>()
    };
    let want = [(0x10, 0), (0x10, 0), (0x10, 0), (0x10, 0), (0, 1_000), (0, 1_000)];
    assert_eq!(read(&mut raw, 0x26, &[about(0xc0, 0x0801, 0); 7]), want);
    raw.hold(2, 0x20, OFF, 0, NOTHING);
    raw.write(0x0723, 1);
    let fed = [1, 2, 3, 4, 5, 6, 7].map(|feed| about(0xc0, 0x0801, feed));
    // Data that a read does not need is feed-forward, but the command is another one each time.
    assert_eq!(read(&mut raw, 0x26, &fed), [(0x10, 0); 6]);
    raw.hold(2, 0x20, OFF, 0, NOTHING);
    let fed = [1, 2, 3, 4, 5, 6, 7].map(|feed| about(0x11, 0, feed));
    assert_eq!(
        read(&mut raw, 0x2a, &fed).iter().map(|(nine, _)| *nine).collect::<Vec<_>>(),
        [0x10, 0x10, 0x10, 0x10, 0, 0]
    );
    // Another type without the normal command in between is another request.
    let answers = read(&mut raw, 0x2a, &[about(0x12, 0, 0); 3]);
    assert_eq!(answers, [(0, 0), (0x10, 0), (0x10, 0)]);
}
