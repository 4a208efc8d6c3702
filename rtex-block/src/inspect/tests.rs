use super::*;
use crate::header::{MacId, UpdateCounter};
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;

fn swapped(bytes: &[u8], width: usize) -> Vec<u8> {
    bytes.chunks(width).flat_map(|c| c.iter().rev().copied()).collect()
}

#[test]
fn causes() {
    let command = Command { command_data1: 1_000, ..Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO) };
    let block = Command { control: ControlBits::SERVO_ON, ..command }.emit();
    assert_eq!(inspect(&block).cause(), None);
    assert_eq!(inspect(&swapped(&block, 2)).cause(), Some(Cause::SwappedWords16));
    assert_eq!(inspect(&swapped(&block, 4)).cause(), Some(Cause::SwappedWords32));
    let mut stray = block;
    stray[2] |= 0x03;
    assert_eq!(inspect(&stray).cause(), None);
    assert_eq!(inspect(&[0; 16]).cause(), Some(Cause::AllZero));
    assert_eq!(inspect(&[0xff; 32]).cause(), Some(Cause::AllOnes));
    for size in (0..40).filter(|n| ![16, 32].contains(n)) {
        let report = inspect(&[0x20; 40][..size]);
        assert_eq!(report.cause(), Some(Cause::OtherSize));
        assert!(matches!(report.error(), Some(Error::Truncated { .. } | Error::TooLong { .. })) && !report.is_usable());
    }
}

#[test]
fn every_finding_is_listed() {
    let mut block = [0; 32];
    block[..4].copy_from_slice(&[0x05, 0x52, 0x02, 0x10]);
    block[9] = 0x30;
    block[16] = 0x41;
    let want = [
        Error::CyclicCode { code: 5 },
        Error::SubChk { byte16: 0x41 },
        Error::SubCommandCode { code: 1 },
        Error::Reserved { byte: 2, bits: 0x02 },
        Error::Reserved { byte: 3, bits: 0x10 },
        Error::Reserved { byte: 9, bits: 0x30 },
        Error::Reserved { byte: 16, bits: 0x40 },
    ];
    assert!(inspect(&block).errors().eq(want));
    // A non-cyclic code without a layout, and what is wrong beside it.
    let mut block = [0; 16];
    block[..4].copy_from_slice(&[0x05, 0x23, 0x02, 0x10]);
    let want = [
        Error::NonCyclicCode { code: 3 },
        Error::Reserved { byte: 2, bits: 0x02 },
        Error::Reserved { byte: 3, bits: 0x10 },
    ];
    assert_eq!(inspect(&block).errors().collect::<Vec<_>>(), want);
}

#[test]
fn values_and_one_line() {
    let report = inspect(&[0xc5, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!((report.response().map(|r| r.response_data1), report.command()), (Some(998), None));
    assert_eq!((report.findings(), report.sub_response()), (Findings::NONE, None));
    assert_eq!(report.to_string(), "from 5 #2 CP normal (20h) [SERVO_ACTIVE SERVO_READY IN_POSITION] 998, 0 0");
    let mut stray =
        Command32 { main: Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO), sub: SubCommand::IDLE }.emit();
    stray[2] = 0x01;
    let report = inspect(&stray);
    assert_eq!(report.findings().iter().collect::<Vec<_>>(), [ErrorClass::Reserved]);
    assert_eq!((report.command().is_some(), report.sub_command()), (true, Some(SubCommand::IDLE)));
    assert!(report.to_string().ends_with("; byte 2 has reserved bits 0x01 set"), "{report}");
    assert_eq!(inspect(&[]).to_string(), "not usable; 0 bytes, a block has 16; the size is neither 16 nor 32 bytes");
}

/// Notes of a response, from its main half and from its sub half.
#[test]
fn what_a_reader_should_know() {
    let block = |one: u8, status: u8, nine: u8, sixteen: u8| {
        let mut block = [0; 32];
        (block[0], block[1], block[2], block[9], block[16]) = (0x85, one, status, nine, sixteen);
        inspect(&block).notes().collect::<Vec<_>>()
    };
    assert_eq!(block(0x20, 0xc1, 0, 0), []);
    assert_eq!(block(0xa0, 0xc1, 0, 0), [Note::NotAccepted]);
    // The sub half: Sub_CMD_Err is bit 7 of byte 16, Sub_ERR bit 6.
    assert_eq!(block(0x20, 0xc1, 0, 0x8a), [Note::NotAccepted]);
    assert_eq!(block(0x20, 0xc1, 0, 0x4a), [Note::FailedToExecute]);
    // ERR of a monitor answer is bit 7 of byte 9.
    assert_eq!(block(0x2a, 0xc1, 0x80, 0), [Note::FailedToExecute]);
    assert_eq!(block(0x20, 0xe1, 0, 0), [Note::Alarm]);
    let command = |one: u8, two: u8| {
        let mut block = [0; 16];
        (block[0], block[1], block[2]) = (5, one, two);
        inspect(&block).notes().collect::<Vec<_>>()
    };
    assert_eq!(command(0x20, 0x80), []);
    assert_eq!((command(0, 0x80), command(0, 0)), (vec_of(Note::ServoOnIgnored), vec_of(Note::NopIsNotServoOff)));
}

fn vec_of(note: Note) -> Vec<Note> {
    [note].into_iter().collect()
}

/// Direction, use, and the half of 32 bytes.
#[test]
fn what_a_block_is() {
    for (byte0, response) in [(0x05, false), (0x85, true), (0xe5, true), (0x65, false)] {
        assert_eq!(inspect(&[byte0; 1]).is_response(), Some(response));
    }
    assert_eq!(inspect(&[]).is_response(), None);
    let mut block = [0; 32];
    (block[0], block[1], block[16], block[20]) = (0x85, 0x20, 0x0a, 7);
    let report = inspect(&block);
    assert_eq!((report.is_usable(), report.sub_response().map(|sub| sub.data1)), (true, Some(7)));
    assert_eq!(inspect(&block[..16]).sub_response(), None);
    block[0] = 0x05;
    assert_eq!(inspect(&block).sub_response(), None);
}

/// Names and places of the fields, by the code of the block.
#[test]
fn every_layout_names_its_bytes() {
    let names = |zero: u8, one: u8, from: u8| {
        let mut block = [0; 32];
        (block[0], block[1]) = (zero, one);
        let report = inspect(&block);
        report.fields().filter(|field| field.first >= from).map(|field| field.name).collect::<Vec<_>>()
    };
    let sub = [
        "Sub_Chk",
        "Sub_Command_Code",
        "Sub_Type_Code",
        "Sub_Index",
        "Sub_Command_Data1",
        "Sub_Command_Data2",
        "Sub_Command_Data3",
    ];
    for (code, mine) in [
        (0x20, &["Command_Data2", "Command_Data3"][..]),
        (0x21, &["Type_Code", "Index", "Command_Data3"]),
        (0x26, &["Type_Code", "Index", "Setting_Data"]),
        (0x24, &["Type_Code", "Latch_Sel1", "Latch_Sel2", "Monitor_Sel", "Setting_Data"]),
        (0x17, &["Type_Code", "Latch_Sel1", "Monitor_Sel", "Target_Speed"]),
    ] {
        assert_eq!(names(5, code, 8), [mine, &sub].concat(), "{code:x}");
    }
    let results = ["Type_Code_Echo", "ERR", "WNG", "BUSY", "Index_Echo", "Monitor_Data"];
    assert_eq!(names(0x85, 0x2a, 8)[..6], results);
    // Bits of byte 2, then of byte 3.
    for (zero, first, second) in [(5, "SERVO_ON", "HARD_STOP"), (0x85, "SERVO_ACTIVE", "")] {
        let block = [zero, 0x20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let report = inspect(&block);
        let at = |name: &str| report.fields().find(|field| field.name == name).map(|field| field.first);
        assert_eq!(at(first), Some(2));
        assert!(second.is_empty() || at(second) == Some(3));
    }
}

#[test]
fn changes_from_block_to_block() {
    let first = Command { command_data1: 1_000, ..Command::idle(MacId::new(5).unwrap(), UpdateCounter::ZERO) };
    let second = Command {
        command_data1: 1_010,
        control: ControlBits::SERVO_ON,
        update_counter: first.update_counter.next(),
        ..first
    };
    let (before, after) = (inspect(&first.emit()), inspect(&second.emit()));
    let changes: Vec<_> = after
        .changes(&before)
        .map(|c| (c.field.name, c.before.unwrap().to_string(), c.field.value.to_string()))
        .collect();
    let text: Vec<_> = changes.iter().map(|(n, a, b)| (*n, a.as_str(), b.as_str())).collect();
    assert_eq!(text, [("Update_Counter", "0", "1"), ("SERVO_ON", "0", "1"), ("Command_Position", "1000", "1010")]);
    assert_eq!(after.changes(&after).count(), 0);
    assert_eq!(inspect(&[0; 16]).notes().collect::<Vec<_>>(), [Note::NopIsNotServoOff]);
}

/// The longest list: a profile answer with a sub block.
#[test]
fn no_field_is_left_out() {
    let mut block = [0; 32];
    block[0] = 0x80;
    block[1] = 0x17;
    let report = inspect(&block);
    assert_eq!((report.fields().count(), report.fields().last().unwrap().name), (42, "Sub_Response_Data3"));
}

proptest! {
    /// Never fails, and agrees with the decoders.
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..48)) {
        let report = inspect(&bytes);
        prop_assert_eq!(report.error(), strict(&bytes).err());
        prop_assert!(report.is_usable() || report.error().is_some());
        // The list is long enough: one place is always left.
        prop_assert!(report.errors().count() < MOST_FINDINGS);
        prop_assert_eq!(report.changes(&report).count(), 0);
        if bytes.len() >= LEN {
            prop_assert!(report.fields().count() >= 5);
        }
        for field in report.fields() {
            prop_assert!(usize::from(field.last) < bytes.len() && field.first <= field.last);
        }
    }
}
