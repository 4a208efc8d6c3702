use super::*;
use crate::error_code::ErrorCode;
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

/// A block that makes sense, but for a stray bit, keeps its order though it would make sense in another one; so does a sound NOP.
#[test]
fn no_cause_where_none_is_needed() {
    let mut stray = [0; 16];
    stray[..4].copy_from_slice(&[0x12, 0x20, 0x01, 0]);
    assert_eq!(inspect(&swapped(&stray, 2)).error(), None);
    assert_eq!(inspect(&stray).error(), Some(Error::Reserved { byte: 2, bits: 0x01 }));
    assert_eq!(inspect(&stray).cause(), None);
    let mut nop = [0; 16];
    nop[0] = 0x10;
    assert_eq!((inspect(&nop).error(), inspect(&swapped(&nop, 2)).error()), (None, None));
    assert_eq!(inspect(&nop).cause(), None);
}

/// What is repaired to look further brings no finding of its own, and hides none.
#[test]
fn a_finding_brings_no_other() {
    let found = |changes: &[(usize, u8)], size: usize| {
        let mut block = [0; 32];
        (block[0], block[1], block[16]) = (5, 0x20, 0x80);
        for (at, byte) in changes {
            block[*at] = *byte;
        }
        inspect(&block[..size]).errors().collect::<Vec<_>>()
    };
    let (cyclic, noncyclic) = (Error::CyclicCode { code: 5 }, Error::NonCyclicCode { code: 3 });
    assert_eq!(found(&[(1, 0x53)], 16), [cyclic, noncyclic]);
    assert_eq!(found(&[(1, 0x23), (9, 0xf0)], 16), [noncyclic]);
    assert_eq!(found(&[(16, 0)], 32), [Error::SubChk { byte16: 0 }]);
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

/// Each byte of this block is its own number, apart from the header, the nibbles of bytes 9 and 10, and byte 16: every value says where
/// it stands.
fn numbered(zero: u8, one: u8) -> Report {
    let mut block = core::array::from_fn::<u8, 32, _>(|byte| byte as u8);
    (block[0], block[1], block[9], block[10], block[16]) = (zero, one, 0x91, 0xba, 0xda);
    inspect(&block)
}

/// Name, first and last byte, and value of what stands in bytes 0, 1 and from 4 on.
fn placed(report: &Report) -> Vec<(&'static str, u8, u8, Value)> {
    let fields = report.fields().filter(|field| !matches!(field.first, 2 | 3));
    fields.map(|field| (field.name, field.first, field.last, field.value)).collect()
}

/// Bytes of a command, by the layouts of the document.
#[test]
fn every_field_of_a_command_stands_in_its_bytes() {
    use Value::{Bit, Code, Hex, Number};
    let sub = [
        ("Sub_Chk", 16, 16, Bit(true)),
        ("Sub_Command_Code", 16, 16, Hex(0x0a)),
        ("Sub_Type_Code", 17, 17, Hex(0x11)),
        ("Sub_Index", 18, 19, Hex(0x1312)),
        ("Sub_Command_Data1", 20, 23, Number(0x1716_1514)),
        ("Sub_Command_Data2", 24, 27, Number(0x1b1a_1918)),
        ("Sub_Command_Data3", 28, 31, Number(0x1f1e_1d1c)),
    ];
    let generic =
        |data| [("Type_Code", 8, 9, Hex(0x108)), ("Index", 10, 11, Hex(0x0bba)), (data, 12, 15, Number(0x0f0e_0d0c))];
    let homing = [
        ("Type_Code", 8, 8, Hex(8)),
        ("Latch_Sel1", 10, 10, Hex(0x0a)),
        ("Latch_Sel2", 10, 10, Hex(0x0b)),
        ("Monitor_Sel", 11, 11, Hex(0x0b)),
        ("Setting_Data", 12, 15, Number(0x0f0e_0d0c)),
    ];
    let profile = [homing[0], homing[1], homing[3], ("Target_Speed", 12, 15, Number(0x0f0e_0d0c))];
    let normal = [("Command_Data2", 8, 11, Number(0x0bba_9108)), ("Command_Data3", 12, 15, Number(0x0f0e_0d0c))];
    for (one, data1, own) in [
        (0xa0, "Command_Position", &normal[..]),
        (0xb0, "Command_Speed", &normal),
        (0xc0, "Command_Torque", &normal),
        (0x90, "Target_Position", &normal),
        (0xa1, "Command_Position", &generic("Command_Data3")),
        (0xa2, "Command_Position", &generic("Command_Data3")),
        (0xa4, "Command_Position", &homing),
        (0xa5, "Command_Position", &generic("Command_Data3")),
        (0xa6, "Command_Position", &generic("Setting_Data")),
        (0xaa, "Command_Position", &generic("Command_Data3")),
        (0x97, "Target_Position", &profile),
    ] {
        let head = [
            ("Update_Counter", 0, 0, Number(2)),
            ("MAC-ID", 0, 0, Number(5)),
            ("TMG_CNT", 1, 1, Bit(true)),
            ("Command_Code", 1, 1, Code(crate::code::Code::truncate(one))),
            (data1, 4, 7, Number(0x0706_0504)),
        ];
        assert_eq!(placed(&numbered(0x45, one)), [&head[..], own, &sub].concat(), "{one:x}");
    }
}

/// Bytes of a response.
#[test]
fn every_field_of_a_response_stands_in_its_bytes() {
    use Value::{AlarmData, Bit, Code, Hex, Number, Text};
    let sub = [
        ("Sub_CMD_Err", 16, 16, Bit(true)),
        ("Sub_ERR", 16, 16, Bit(true)),
        ("Sub_WNG", 16, 16, Bit(false)),
        ("Sub_Busy", 16, 16, Bit(true)),
        ("Sub_Command_Code_Echo", 16, 16, Hex(0x0a)),
        ("Sub_Type_Code_Echo", 17, 17, Hex(0x11)),
        ("Sub_Error_Code", 18, 19, Value::Error(ErrorCode(0x1312))),
        ("Sub_Response_Data1", 20, 23, Number(0x1716_1514)),
        ("Sub_Response_Data2", 24, 27, Number(0x1b1a_1918)),
        ("Sub_Response_Data3", 28, 31, Number(0x1f1e_1d1c)),
    ];
    let executed = [("ERR", 9, 9, Bit(true)), ("WNG", 9, 9, Bit(false)), ("BUSY", 9, 9, Bit(true))];
    let (code, index) = (("Type_Code_Echo", 8, 9, Hex(0x108)), ("Index_Echo", 10, 11, Hex(0x0bba)));
    let results = |name, data| [&[code], &executed[..], &[index, (name, 12, 15, data)]].concat();
    let echo = ("Type_Code_Echo", 8, 8, Hex(8));
    let selected = [
        ("Latch_Sel1_Echo", 10, 10, Hex(0x0a)),
        ("Monitor_Sel_Echo", 11, 11, Hex(0x0b)),
        ("Monitor_Data", 12, 15, Number(0x0f0e_0d0c)),
    ];
    let latches =
        [("LATCH_COMP2", 9, 9, Bit(false)), ("LATCH_COMP1", 9, 9, Bit(true)), ("Latch_Sel2_Echo", 10, 10, Hex(0x0b))];
    let limits = [
        ("PSL", 9, 9, Bit(false)),
        ("NSL", 9, 9, Bit(false)),
        ("NEAR", 9, 9, Bit(false)),
        ("LATCH_COMP1", 9, 9, Bit(true)),
    ];
    let normal = [("Response_Data2", 8, 11, Number(0x0bba_9108)), ("Response_Data3", 12, 15, Number(0x0f0e_0d0c))];
    let monitored = results("Monitor_Data", Number(0x0f0e_0d0c));
    for (one, own) in [
        (0x20, normal.to_vec()),
        (0x21, monitored.clone()),
        (0x22, results("ASCII", Text([12, 13, 14, 15]))),
        (0x24, [&[echo], &executed[..], &latches, &selected].concat()),
        (0x25, results("Alarm_Data", AlarmData([12, 13, 14, 15]))),
        (0x26, monitored.clone()),
        (0x2a, monitored),
        (0x17, [&[echo], &executed[..], &limits, &selected].concat()),
        (0x23, [("bytes 8-11", 8, 11, normal[0].3), ("bytes 12-15", 12, 15, normal[1].3)].to_vec()),
        (0xa6, [("Error_Code", 8, 9, Value::Error(ErrorCode(0x9108)))].to_vec()),
    ] {
        let head = [
            ("Update_Counter_Echo", 0, 0, Number(2)),
            ("Actual_MAC-ID", 0, 0, Number(5)),
            ("CMD_Error", 1, 1, Bit(one > 0x7f)),
            ("Command_Code_Echo", 1, 1, Code(crate::code::Code::truncate(one))),
            ("Response_Data1", 4, 7, Number(0x0706_0504)),
        ];
        assert_eq!(placed(&numbered(0xc5, one)), [&head[..], &own, &sub].concat(), "{one:x}");
    }
    // Without an error of the sub-command, its index.
    let mut block = [0; 32];
    (block[0], block[1], block[16], block[18], block[19]) = (0xc5, 0x20, 0x2a, 0x12, 0x13);
    let fields = placed(&inspect(&block));
    let [error, _, warning, busy] = ["Sub_CMD_Err", "Sub_ERR", "Sub_WNG", "Sub_Busy"];
    for (name, value) in [(error, Bit(false)), (warning, Bit(true)), (busy, Bit(false))] {
        assert!(fields.contains(&(name, 16, 16, value)), "{name}");
    }
    assert!(fields.contains(&("Sub_Index_Echo", 18, 19, Hex(0x1312))));
}

/// Bytes 2 and 3, bit by bit.
#[test]
fn every_flag_stands_in_its_byte() {
    let second = ["SERVO_ON", "GAIN_SW", "TL_SW", "HOMING_CTRL"];
    let third = ["HARD_STOP", "SMOOTH_STOP", "PAUSE", "SL_SW", "EX_OUT2", "EX_OUT1"];
    let status = [
        [
            "SERVO_ACTIVE",
            "SERVO_READY",
            "ALARM",
            "WARNING",
            "TORQUE_LIMITED",
            "HOMING_COMPLETE",
            "IN_PROGRESS",
            "IN_POSITION",
        ],
        ["SI_MON5", "SI_MON4", "SI_MON3", "SI_MON2", "SI_MON1", "HOME", "POT", "NOT"],
    ];
    for (zero, want) in [(0x05, [&second[..], &third]), (0x85, [&status[0], &status[1]])] {
        let report = numbered(zero, 0x20);
        for (byte, want) in [2, 3].into_iter().zip(want) {
            let at = report.fields().filter(|field| (field.first, field.last) == (byte, byte));
            assert_eq!(at.map(|field| field.name).collect::<Vec<_>>(), want);
        }
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
