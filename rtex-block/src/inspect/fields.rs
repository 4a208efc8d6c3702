use core::fmt;

use crate::block::LEN;
use crate::code::{Code, CyclicCode};
use crate::command::CommandBlock;
use crate::control::ControlBits;
use crate::error_code::{Alarm, ErrorCode};
use crate::execution::{Execution, LatchFlags, ProfileFlags};
use crate::header::Header;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::{NonCyclicResponse, Results};
use crate::response::ResponseBlock;
use crate::status::StatusFlags;
use crate::sub::{SubResponse, split32};

/// A value of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Value {
    /// A number, shown in decimal.
    Number(i64),
    /// A code, shown as hex digits with an `h`.
    Hex(u16),
    /// A flag.
    Bit(bool),
    /// Bits 6-0 of byte 1.
    Code(Code),
    /// Error_Code or Sub_Error_Code.
    Error(ErrorCode),
    /// Bytes 12-15 of an alarm answer. The manual of the drive says which type codes ask for alarm and warning, and which
    /// for attributes.
    AlarmData([u8; 4]),
    /// Four characters of a text.
    Text([u8; 4]),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Hex(code) => write!(f, "{code:02X}h"),
            Self::Bit(bit) => write!(f, "{}", u8::from(bit)),
            Self::Code(code) => code.write(f),
            Self::Error(code) => code.fmt(f),
            Self::AlarmData([main, sub, low, high]) => {
                let alarm = Alarm { main, sub };
                write!(f, "{alarm}")?;
                if let Some(meaning) = alarm.meaning() {
                    write!(f, " ({meaning})")?;
                }
                write!(f, " warning {high:02X}{low:02X}h, or attributes {high:02X}{low:02X}{sub:02X}{main:02X}h")
            }
            Self::Text(group) => write!(f, "\"{}\"", group.as_slice().escape_ascii()),
        }
    }
}

/// A field of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Field {
    /// Its name in the vendor documents.
    pub name: &'static str,
    /// Its first byte in the block.
    pub first: u8,
    /// Its last byte in the block.
    pub last: u8,
    /// Its value.
    pub value: Value,
}

/// The most fields that a block has: 4 of bytes 0-1, 16 flags, 1, 11 of a profile answer, 10 of the sub block.
const MOST: usize = 42;

/// The fields of a block, in the order of the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fields([Option<Field>; MOST]);

#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for Fields {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl Fields {
    pub(super) fn iter(&self) -> impl Iterator<Item = Field> {
        self.0.into_iter().flatten()
    }

    pub(super) fn of(bytes: &[u8]) -> Self {
        let mut list = List { fields: [None; MOST], len: 0 };
        let (main, sub) = match split32(bytes) {
            Ok((main, sub)) => (Some(main), Some(sub)),
            Err(_) => (bytes.first_chunk::<LEN>(), None),
        };
        if let Some(main) = main {
            if let Ok(block) = CommandBlock::of(main) {
                list.command(block);
                if let Some(sub) = sub {
                    list.sub_command(sub);
                }
            } else if let Ok(block) = ResponseBlock::of(main) {
                list.response(block);
                if let Some(sub) = sub {
                    list.sub_response(sub);
                }
            }
        }
        Self(list.fields)
    }
}

struct List {
    fields: [Option<Field>; MOST],
    len: usize,
}

impl List {
    fn add(&mut self, name: &'static str, first: u8, last: u8, value: Value) {
        if let Some(place) = self.fields.get_mut(self.len) {
            *place = Some(Field { name, first, last, value });
            self.len = self.len.saturating_add(1);
        }
    }

    fn word(&mut self, name: &'static str, first: u8, value: i32) {
        self.add(name, first, first.saturating_add(3), Value::Number(value.into()));
    }

    fn byte(&mut self, name: &'static str, at: u8, value: u8) {
        self.add(name, at, at, Value::Hex(value.into()));
    }

    fn bit(&mut self, name: &'static str, at: u8, value: bool) {
        self.add(name, at, at, Value::Bit(value));
    }

    fn flags(&mut self, at: u8, flags: impl Iterator<Item = (&'static str, bool)>) {
        flags.for_each(|(name, value)| self.bit(name, at, value));
    }

    fn header(&mut self, byte0: u8, counter: &'static str, mac_id: &'static str) {
        let header = Header::parse(byte0);
        self.add(counter, 0, 0, Value::Number(header.update_counter.get().into()));
        self.add(mac_id, 0, 0, Value::Number(header.mac_id.get().into()));
    }

    fn command(&mut self, block: CommandBlock<'_>) {
        self.header(block.bytes()[0], "Update_Counter", "MAC-ID");
        self.bit("TMG_CNT", 1, block.tmg_cnt());
        self.add("Command_Code", 1, 1, Value::Code(block.code()));
        for (name, flag) in ControlBits::all().iter_names() {
            let [low, _] = flag.to_bytes();
            self.bit(name, if low == 0 { 3 } else { 2 }, block.control().contains(flag));
        }
        let name = match block.code().cyclic() {
            Some(CyclicCode::ProfilePosition) => "Target_Position",
            Some(CyclicCode::CyclicPosition) => "Command_Position",
            Some(CyclicCode::CyclicVelocity) => "Command_Speed",
            Some(CyclicCode::CyclicTorque) => "Command_Torque",
            Some(CyclicCode::Nop) | None => "Command_Data1",
        };
        self.word(name, 4, block.command_data1());
        if let Some(code) = block.code().noncyclic() {
            self.request(&NonCyclicCommand::parse(code, block.noncyclic_bytes()));
        }
    }

    fn request(&mut self, request: &NonCyclicCommand) {
        match *request {
            NonCyclicCommand::Normal { command_data2, command_data3 } => {
                self.word("Command_Data2", 8, command_data2);
                self.word("Command_Data3", 12, command_data3);
            }
            NonCyclicCommand::Reset(a)
            | NonCyclicCommand::SystemId(a)
            | NonCyclicCommand::Alarm(a)
            | NonCyclicCommand::Monitor(a) => {
                self.arguments(a, "Command_Data3");
            }
            NonCyclicCommand::Parameter(a) => self.arguments(a, "Setting_Data"),
            NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data } => {
                self.byte("Type_Code", 8, type_code);
                self.byte("Latch_Sel1", 10, latch_sel1.get());
                self.byte("Latch_Sel2", 10, latch_sel2.get());
                self.byte("Monitor_Sel", 11, monitor_sel);
                self.word("Setting_Data", 12, setting_data);
            }
            NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, target_speed } => {
                self.byte("Type_Code", 8, type_code);
                self.byte("Latch_Sel1", 10, latch_sel1.get());
                self.byte("Monitor_Sel", 11, monitor_sel);
                self.word("Target_Speed", 12, target_speed);
            }
        }
    }

    fn arguments(&mut self, a: Arguments, data: &'static str) {
        self.add("Type_Code", 8, 9, Value::Hex(a.type_code.get()));
        self.add("Index", 10, 11, Value::Hex(a.index));
        self.word(data, 12, a.data);
    }

    fn response(&mut self, block: ResponseBlock<'_>) {
        self.header(block.bytes()[0], "Update_Counter_Echo", "Actual_MAC-ID");
        self.bit("CMD_Error", 1, block.cmd_error());
        self.add("Command_Code_Echo", 1, 1, Value::Code(block.code()));
        for (name, flag) in StatusFlags::all().iter_names() {
            let [low, _] = flag.to_bytes();
            self.bit(name, if low == 0 { 3 } else { 2 }, block.status().contains(flag));
        }
        self.word("Response_Data1", 4, block.response_data1());
        self.noncyclic(&block.noncyclic());
    }

    fn noncyclic(&mut self, noncyclic: &NonCyclicResponse) {
        match *noncyclic {
            NonCyclicResponse::CommandError(code) => self.add("Error_Code", 8, 9, Value::Error(code)),
            NonCyclicResponse::Normal { response_data2, response_data3 } => {
                self.word("Response_Data2", 8, response_data2);
                self.word("Response_Data3", 12, response_data3);
            }
            NonCyclicResponse::Reset(r) | NonCyclicResponse::Parameter(r) | NonCyclicResponse::Monitor(r) => {
                self.results(r);
                self.word("Monitor_Data", 12, r.data);
            }
            NonCyclicResponse::SystemId(r) => {
                self.results(r);
                self.add("ASCII", 12, 15, Value::Text(r.characters()));
            }
            NonCyclicResponse::Alarm(r) => {
                self.results(r);
                self.add("Alarm_Data", 12, 15, Value::AlarmData(r.data.to_le_bytes()));
            }
            NonCyclicResponse::Homing {
                execution,
                type_code,
                latch,
                latch_sel1,
                latch_sel2,
                monitor_sel,
                monitor_data,
            } => {
                self.byte("Type_Code_Echo", 8, type_code);
                self.execution(execution);
                self.flags(9, LatchFlags::all().iter_names().map(|(name, flag)| (name, latch.contains(flag))));
                self.byte("Latch_Sel2_Echo", 10, latch_sel2.get());
                self.byte("Latch_Sel1_Echo", 10, latch_sel1.get());
                self.byte("Monitor_Sel_Echo", 11, monitor_sel);
                self.word("Monitor_Data", 12, monitor_data);
            }
            NonCyclicResponse::Profile { execution, type_code, flags, latch_sel1, monitor_sel, monitor_data } => {
                self.byte("Type_Code_Echo", 8, type_code);
                self.execution(execution);
                self.flags(9, ProfileFlags::all().iter_names().map(|(name, flag)| (name, flags.contains(flag))));
                self.byte("Latch_Sel1_Echo", 10, latch_sel1.get());
                self.byte("Monitor_Sel_Echo", 11, monitor_sel);
                self.word("Monitor_Data", 12, monitor_data);
            }
            NonCyclicResponse::Undefined { bytes: [b8, b9, b10, b11, data @ ..], .. } => {
                self.word("bytes 8-11", 8, i32::from_le_bytes([b8, b9, b10, b11]));
                self.word("bytes 12-15", 12, i32::from_le_bytes(data));
            }
        }
    }

    fn results(&mut self, results: Results) {
        self.add("Type_Code_Echo", 8, 9, Value::Hex(results.type_code.get()));
        self.execution(results.execution);
        self.add("Index_Echo", 10, 11, Value::Hex(results.index));
    }

    fn execution(&mut self, execution: Execution) {
        self.flags(9, Execution::all().iter_names().map(|(name, flag)| (name, execution.contains(flag))));
    }

    fn sub_command(&mut self, sub: &[u8; LEN]) {
        let like = SubResponse::parse(sub);
        // The flags of a response are where a command has Sub_Chk and reserved bits.
        self.bit("Sub_Chk", 16, like.cmd_error);
        self.byte("Sub_Command_Code", 16, like.code.get());
        self.byte("Sub_Type_Code", 17, like.type_code);
        self.add("Sub_Index", 18, 19, Value::Hex(like.index));
        self.word("Sub_Command_Data1", 20, like.data1);
        self.word("Sub_Command_Data2", 24, like.data2);
        self.word("Sub_Command_Data3", 28, like.data3);
    }

    fn sub_response(&mut self, sub: &[u8; LEN]) {
        let sub = SubResponse::parse(sub);
        self.bit("Sub_CMD_Err", 16, sub.cmd_error);
        self.bit("Sub_ERR", 16, sub.execution.contains(Execution::ERR));
        self.bit("Sub_WNG", 16, sub.execution.contains(Execution::WNG));
        self.bit("Sub_Busy", 16, sub.execution.contains(Execution::BUSY));
        self.byte("Sub_Command_Code_Echo", 16, sub.code.get());
        self.byte("Sub_Type_Code_Echo", 17, sub.type_code);
        match sub.error_code() {
            Some(code) => self.add("Sub_Error_Code", 18, 19, Value::Error(code)),
            None => self.add("Sub_Index_Echo", 18, 19, Value::Hex(sub.index)),
        }
        self.word("Sub_Response_Data1", 20, sub.data1);
        self.word("Sub_Response_Data2", 24, sub.data2);
        self.word("Sub_Response_Data3", 28, sub.data3);
    }
}
