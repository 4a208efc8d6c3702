//! The layouts once more, bit by bit out of one number: slow, and nothing shared with the crate.

use rtex_block::{Command, ControlBits, NonCyclicCommand, Response};

/// `len` bits of a block from bit `first` of byte `byte` on; the block is one number, low byte first.
fn bits(block: &[u8], byte: u32, first: u32, len: u32) -> u64 {
    (0..len).fold(0, |value, k| {
        let at = 8 * byte + first + k;
        value | u64::from(block[(at / 8) as usize] >> (at % 8) & 1) << k
    })
}

fn signed(block: &[u8], byte: u32) -> i64 {
    let value = i64::try_from(bits(block, byte, 0, 32)).expect("32 bits");
    if value >= 1 << 31 { value - (1 << 32) } else { value }
}

pub(super) fn command(block: &[u8], command: &Command) {
    let is = |name, want: u64, real: u64| assert_eq!(want, real, "{name}");
    is("MAC-ID", bits(block, 0, 0, 5), command.mac_id.get().into());
    is("Update_Counter", bits(block, 0, 5, 2), command.update_counter.get().into());
    is("C/R", bits(block, 0, 7, 1), 0);
    is("non-cyclic code", bits(block, 1, 0, 4), command.noncyclic.code() as u64);
    is("cyclic code", bits(block, 1, 4, 3), command.cyclic as u64);
    is("TMG_CNT", bits(block, 1, 7, 1), command.tmg_cnt.into());
    is("Servo_On", bits(block, 2, 7, 1), command.control.contains(ControlBits::SERVO_ON).into());
    is("Gain_SW", bits(block, 2, 4, 1), command.control.contains(ControlBits::GAIN_SW).into());
    is("Hard_Stop", bits(block, 3, 7, 1), command.control.contains(ControlBits::HARD_STOP).into());
    is("EX-OUT1", bits(block, 3, 0, 1), command.control.contains(ControlBits::EX_OUT1).into());
    is("reserved", bits(block, 2, 0, 2) | bits(block, 2, 5, 2) | bits(block, 3, 2, 1) | bits(block, 3, 4, 1), 0);
    assert_eq!(signed(block, 4), i64::from(command.command_data1));
    match command.noncyclic {
        NonCyclicCommand::Normal { command_data2, command_data3 } => {
            assert_eq!((signed(block, 8), signed(block, 12)), (command_data2.into(), command_data3.into()));
        }
        NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data } => {
            is("Type_Code", bits(block, 8, 0, 8), type_code.into());
            is("Latch_Sel1", bits(block, 10, 0, 4), latch_sel1.get().into());
            is("Latch_Sel2", bits(block, 10, 4, 4), latch_sel2.get().into());
            is("Monitor_Sel", bits(block, 11, 0, 8), monitor_sel.into());
            assert_eq!(signed(block, 12), i64::from(setting_data));
        }
        NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, target_speed } => {
            is("Type_Code", bits(block, 8, 0, 8), type_code.into());
            is("Latch_Sel1", bits(block, 10, 0, 8), latch_sel1.get().into());
            is("Monitor_Sel", bits(block, 11, 0, 8), monitor_sel.into());
            assert_eq!(signed(block, 12), i64::from(target_speed));
        }
        NonCyclicCommand::Reset(a)
        | NonCyclicCommand::SystemId(a)
        | NonCyclicCommand::Alarm(a)
        | NonCyclicCommand::Parameter(a)
        | NonCyclicCommand::Monitor(a) => {
            is("Type_Code", bits(block, 8, 0, 16), a.type_code.get().into());
            is("Index", bits(block, 10, 0, 16), a.index.into());
            assert_eq!(signed(block, 12), i64::from(a.data));
        }
    }
}

pub(super) fn response(block: &[u8], response: &Response) {
    let is = |name, want: u64, real: u64| assert_eq!(want, real, "{name}");
    is("Actual_MAC-ID", bits(block, 0, 0, 5), response.mac_id.get().into());
    is("Update_Counter_Echo", bits(block, 0, 5, 2), response.update_counter_echo.get().into());
    is("code", bits(block, 1, 0, 7), response.code.get().into());
    is("CMD_Error", bits(block, 1, 7, 1), response.cmd_error.into());
    is("status", bits(block, 2, 0, 16), response.status.bits().into());
    assert_eq!(signed(block, 4), i64::from(response.response_data1));
    assert_eq!(signed(block, 8), i64::from(response.response_data2));
    assert_eq!(signed(block, 12), i64::from(response.response_data3));
}
