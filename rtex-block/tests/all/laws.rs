//! Laws of the codec: exhaustive where the domain is small, drawn otherwise.

use proptest::prelude::*;
use rtex_block::master::{Acknowledgement, Checked, Expected};
use rtex_block::{
    Alarm, AlarmAndWarning, Arguments, BlockSize, Code, Command, Command32, CommandBlock, ControlBits, CyclicCode,
    Error, ErrorCode, Execution, LatchFlags, MacId, Nibble, NonCyclicCode, NonCyclicCommand, NonCyclicResponse,
    ProfileFlags, Response, Response32, ResponseBlock, Results, StatusFlags, SubCode, SubCommand, SubResponse,
    TypeCode, UpdateCounter,
};

fn mac_id() -> impl Strategy<Value = MacId> {
    (0..32u8).prop_map(|v| MacId::new(v).unwrap())
}

fn counter() -> impl Strategy<Value = UpdateCounter> {
    (0..4u8).prop_map(|v| UpdateCounter::new(v).unwrap())
}

fn nibble() -> impl Strategy<Value = Nibble> {
    (0..16u8).prop_map(|v| Nibble::new(v).unwrap())
}

fn type_code() -> impl Strategy<Value = TypeCode> {
    (0..0x1000u16).prop_map(|v| TypeCode::new(v).unwrap())
}

fn execution() -> impl Strategy<Value = Execution> {
    any::<u8>().prop_map(Execution::from_bits_truncate)
}

fn arguments() -> impl Strategy<Value = Arguments> {
    (type_code(), any::<u16>(), any::<i32>()).prop_map(|(type_code, index, data)| Arguments { type_code, index, data })
}

/// A request by its code: any bytes, read by the layout, make one.
fn request() -> impl Strategy<Value = NonCyclicCommand> {
    (proptest::sample::select(&NonCyclicCode::ALL[..]), any::<[u8; 8]>())
        .prop_map(|(code, bytes)| NonCyclicCommand::parse(code, bytes))
}

fn command() -> impl Strategy<Value = Command> {
    let cyclic = proptest::sample::select(&CyclicCode::ALL[..]);
    (mac_id(), counter(), any::<bool>(), cyclic, any::<u16>(), any::<i32>(), request()).prop_map(
        |(mac_id, update_counter, tmg_cnt, cyclic, control, command_data1, noncyclic)| Command {
            mac_id,
            update_counter,
            tmg_cnt,
            cyclic,
            control: ControlBits::from_bits_truncate(control),
            command_data1,
            noncyclic,
        },
    )
}

fn sub_command() -> impl Strategy<Value = SubCommand> {
    let code = proptest::sample::select(&[SubCode::Normal, SubCode::SystemId, SubCode::Monitor][..]);
    (code, any::<u8>(), any::<u16>(), any::<(i32, i32, i32)>()).prop_map(
        |(code, type_code, index, (data1, data2, data3))| SubCommand { code, type_code, index, data1, data2, data3 },
    )
}

fn answer() -> impl Strategy<Value = NonCyclicResponse> {
    let reply = || {
        (execution(), arguments()).prop_map(|(execution, Arguments { type_code, index, data })| Results {
            execution,
            type_code,
            index,
            data,
        })
    };
    prop_oneof![
        any::<u16>().prop_map(|code| NonCyclicResponse::CommandError(ErrorCode(code))),
        any::<(i32, i32)>()
            .prop_map(|(response_data2, response_data3)| NonCyclicResponse::Normal { response_data2, response_data3 }),
        reply().prop_map(NonCyclicResponse::Reset),
        reply().prop_map(NonCyclicResponse::SystemId),
        reply().prop_map(NonCyclicResponse::Alarm),
        reply().prop_map(NonCyclicResponse::Parameter),
        reply().prop_map(NonCyclicResponse::Monitor),
        (execution(), any::<(u8, u8)>(), nibble(), nibble(), any::<u8>(), any::<i32>()).prop_map(
            |(execution, (type_code, latch), latch_sel1, latch_sel2, monitor_sel, monitor_data)| {
                let latch = LatchFlags::from_bits_truncate(latch);
                NonCyclicResponse::Homing {
                    execution,
                    type_code,
                    latch,
                    latch_sel1,
                    latch_sel2,
                    monitor_sel,
                    monitor_data,
                }
            }
        ),
        (execution(), any::<(u8, u8)>(), nibble(), any::<u8>(), any::<i32>()).prop_map(
            |(execution, (type_code, flags), latch_sel1, monitor_sel, monitor_data)| {
                let flags = ProfileFlags::from_bits_truncate(flags);
                NonCyclicResponse::Profile { execution, type_code, flags, latch_sel1, monitor_sel, monitor_data }
            }
        ),
    ]
}

fn noncyclic_of(answer: &NonCyclicResponse) -> NonCyclicCode {
    match answer {
        NonCyclicResponse::CommandError(_) | NonCyclicResponse::Normal { .. } | NonCyclicResponse::Undefined { .. } => {
            NonCyclicCode::Normal
        }
        NonCyclicResponse::Reset(_) => NonCyclicCode::Reset,
        NonCyclicResponse::SystemId(_) => NonCyclicCode::SystemId,
        NonCyclicResponse::Homing { .. } => NonCyclicCode::Homing,
        NonCyclicResponse::Alarm(_) => NonCyclicCode::Alarm,
        NonCyclicResponse::Parameter(_) => NonCyclicCode::Parameter,
        NonCyclicResponse::Profile { .. } => NonCyclicCode::Profile,
        NonCyclicResponse::Monitor(_) => NonCyclicCode::Monitor,
    }
}

proptest! {
    #[test]
    fn commands_come_back(main in command(), sub in sub_command()) {
        prop_assert_eq!(Command::parse(&main.emit()), Ok(main));
        let strict = Command::parse_strict(&main.emit());
        if main.code().is_allowed() {
            prop_assert_eq!(strict, Ok(main));
        } else {
            prop_assert_eq!(strict, Err(Error::CodePair { code: main.code().get() }));
        }
        let whole = Command32 { main, sub };
        prop_assert_eq!(Command32::parse(&whole.emit()), Ok(whole));
        prop_assert_eq!(Command32::parse_strict(&whole.emit()).is_ok(), main.code().is_allowed());
    }

    /// Lenient decoding drops reserved bits and nothing else: emitting gives the same block with those bits 0.
    #[test]
    fn command_bytes_come_back_without_reserved_bits(block: [u8; 16]) {
        let Ok(command) = Command::parse(&block) else { return Ok(()) };
        let (nine, ten) = match command.noncyclic {
            NonCyclicCommand::Normal { .. } => (0xff, 0xff),
            NonCyclicCommand::Homing { .. } => (0x00, 0xff),
            NonCyclicCommand::Profile { .. } => (0x00, 0x0f),
            _ => (0x0f, 0xff),
        };
        let mut want = block;
        want[2] &= !0x63;
        want[3] &= !0x14;
        want[9] &= nine;
        want[10] &= ten;
        prop_assert_eq!(command.emit(), want);
        prop_assert_eq!(Command::parse_strict(&block).is_ok(), want == block && command.code().is_allowed());
    }

    #[test]
    fn response_bytes_come_back(main: [u8; 16], sub: [u8; 16]) {
        let mut whole = [0; 32];
        whole[..16].copy_from_slice(&main);
        whole[16..].copy_from_slice(&sub);
        if main[0] & 0x80 == 0 {
            prop_assert_eq!(Response::parse(&main), Err(Error::Direction { byte0: main[0] }));
            prop_assert_eq!(Response32::parse(&whole), Err(Error::Direction { byte0: main[0] }));
        } else {
            prop_assert_eq!(Response::parse(&main).unwrap().emit(), main);
            prop_assert_eq!(Response32::parse(&whole).unwrap().emit(), whole);
            prop_assert_eq!(SubResponse::parse(&sub).emit(), sub);
        }
    }

    #[test]
    fn answers_come_back(answer in answer(), mac_id in mac_id(), counter in counter(), status: u16, data: i32) {
        let blank = Response {
            mac_id,
            update_counter_echo: counter,
            cmd_error: false,
            code: Code::of(CyclicCode::ProfilePosition, noncyclic_of(&answer)),
            status: StatusFlags::from_bits_retain(status),
            response_data1: data,
            response_data2: 0,
            response_data3: 0,
        };
        let response = blank.with_noncyclic(&answer);
        let block = response.emit();
        prop_assert_eq!(Response::parse_strict(&block), Ok(response));
        prop_assert_eq!(response.noncyclic(), answer);
        let view = ResponseBlock::new(&block).unwrap();
        prop_assert_eq!((view.noncyclic(), view.to_owned(), view.status()), (answer, response, response.status));
    }

    /// A view gives what the owned form holds.
    #[test]
    fn command_view_and_value_agree(command in command()) {
        let block = command.emit();
        let view = CommandBlock::new(&block).unwrap();
        prop_assert_eq!(view.to_owned(), Ok(command));
        prop_assert_eq!((view.mac_id(), view.update_counter()), (command.mac_id, command.update_counter));
        prop_assert_eq!((view.code(), view.tmg_cnt()), (command.code(), command.tmg_cnt));
        prop_assert_eq!((view.control(), view.command_data1()), (command.control, command.command_data1));
        let off = command.cyclic != CyclicCode::Nop && command.code().is_allowed() && !command.control.contains(ControlBits::SERVO_ON);
        prop_assert_eq!(view.is_servo_off(), off);
    }
}

/// Every value of bytes 0 and 1, as a command and as a response.
#[test]
fn all_values_of_bytes_0_and_1() {
    let mut accepted = (0, 0);
    for word in 0..=u16::MAX {
        let [zero, one] = word.to_le_bytes();
        let mut block = [0; 16];
        block[0] = zero;
        block[1] = one;
        match Command::parse(&block) {
            Ok(command) => {
                accepted.0 += 1;
                assert_eq!(command.emit(), block);
            }
            Err(Error::Direction { byte0 }) => assert!(byte0 == zero && zero >= 0x80),
            Err(Error::CyclicCode { code }) => assert!(code == one >> 4 & 7 && code > 4),
            Err(Error::NonCyclicCode { code }) => assert_eq!(code, one & 15),
            Err(other) => panic!("{other}"),
        }
        match Response::parse(&block) {
            Ok(response) => {
                accepted.1 += 1;
                assert_eq!(response.emit(), block);
                assert_eq!(matches!(response.noncyclic(), NonCyclicResponse::CommandError(_)), one >= 0x80);
            }
            Err(e) => assert_eq!((e, zero < 0x80), (Error::Direction { byte0: zero }, true)),
        }
    }
    // 128 headers each; 5 x 8 pairs with either TMG_CNT, and every byte 1 in a response.
    assert_eq!(accepted, (128 * 5 * 8 * 2, 128 * 256));
}

#[test]
fn every_wrong_length_is_refused() {
    let bytes = vec![0x80; 70_000];
    let refusal = |got: usize, want: u16| match u16::try_from(got) {
        Ok(got) if got < want => Error::Truncated { got, want },
        Ok(got) => Error::TooLong { got, want },
        Err(_) => Error::TooLong { got: 65_535, want },
    };
    for got in (0..=64).chain([65_535, 65_536, 70_000]) {
        let slice = &bytes[..got];
        if got != 16 {
            assert_eq!(Response::parse(slice), Err(refusal(got, 16)));
            assert_eq!(Command::parse(slice), Err(refusal(got, 16)));
        }
        if got != 32 {
            assert_eq!(Response32::parse(slice), Err(refusal(got, 32)));
            assert_eq!(Command32::parse(slice), Err(refusal(got, 32)));
        }
    }
}

/// One line for each message, with what a person looks for in a log.
#[test]
fn messages_print_in_one_line() {
    let block = [0xc5, 0x20, 0xc1, 0, 0xe6, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];
    let response = Response::parse(&block).unwrap();
    assert_eq!(
        response.to_string(),
        "from 5 #2 CP normal (20h) [SERVO_ACTIVE SERVO_READY IN_POSITION] 998, 10000 -100"
    );
    let refused = response.with_noncyclic(&NonCyclicResponse::CommandError(ErrorCode::ARGUMENT));
    assert!(refused.to_string().ends_with("998, not accepted: 0032h (index or data out of range)"), "{refused}");
    let alarm = Results {
        execution: Execution::WNG,
        type_code: TypeCode::short(1),
        index: 2,
        data: Results::alarm_data(Alarm { main: 86, sub: 1 }, 0xa0),
    };
    assert_eq!(
        NonCyclicResponse::Alarm(alarm).to_string(),
        "type 01h index 2 Err86.1 warning A0h (or attributes 00A00156h) WNG"
    );
    let arguments = Arguments { type_code: TypeCode::short(0x11), index: 0x0714, data: -1 };
    let idle = Command::idle(MacId::MAX, UpdateCounter::MAX);
    let write = Command { noncyclic: NonCyclicCommand::Parameter(arguments), control: ControlBits::SERVO_ON, ..idle };
    assert_eq!(write.to_string(), "to 31 #3 CP parameter (26h) [SERVO_ON] 0, type 11h Pr7.20 data -1");
    let whole = Command32 { main: idle, sub: SubCommand::IDLE };
    assert_eq!(whole.to_string(), "to 31 #3 CP normal (20h) [-] 0, 0 0; sub normal type 00h index 0, 0 0 0");
    let sub = SubResponse::parse(&[0xca, 0, 0x22, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    assert_eq!(sub.to_string(), "sub monitor not accepted: 0022h (non-cyclic code not defined), 0 1 2 ERR");
}

/// Each reserved bit of a command is ignored leniently and named strictly.
#[test]
fn reserved_bits_of_a_command() {
    let arguments = Arguments { type_code: TypeCode::short(7), index: 0, data: 0 };
    let idle = Command::idle(MacId::default(), UpdateCounter::ZERO);
    let clean = Command { noncyclic: NonCyclicCommand::Monitor(arguments), ..idle };
    for (byte, mask) in [(2, 0x63), (3, 0x14), (9, 0xf0)] {
        for bit in (0..8).map(|k| 1 << k).filter(|bit| mask & bit != 0) {
            let mut block = clean.emit();
            block[usize::from(byte)] |= bit;
            assert_eq!(Command::parse(&block), Ok(clean));
            assert_eq!(Command::parse_strict(&block), Err(Error::Reserved { byte, bits: bit }));
        }
    }
    let mut whole = Command32 { main: clean, sub: SubCommand::IDLE }.emit();
    whole[16] |= 0x40;
    assert!(Command32::parse(&whole).is_ok());
    assert_eq!(Command32::parse_strict(&whole), Err(Error::Reserved { byte: 16, bits: 0x40 }));
    whole[16] = 0x00;
    assert_eq!(Command32::parse(&whole), Err(Error::SubChk { byte16: 0 }));
    whole[16] = 0x85;
    assert_eq!(Command32::parse(&whole), Err(Error::SubCommandCode { code: 5 }));
}

/// Reserved bits of each response layout, by strict decoding.
#[test]
fn reserved_bits_of_a_response() {
    let cases: [(u8, &[(u8, u8)]); 5] = [
        (0x20, &[]),
        (0x2a, &[(9, 0x20)]),
        (0x24, &[(9, 0x2c)]),
        (0x17, &[(9, 0x20), (10, 0xf0)]),
        (0xa0, &[(10, 0xff), (11, 0xff), (12, 0xff), (13, 0xff), (14, 0xff), (15, 0xff)]),
    ];
    for (byte1, reserved) in cases {
        for bit in 64..128 {
            let mut block = [0; 16];
            block[0] = 0x80;
            block[1] = byte1;
            block[bit / 8] = 1 << (bit % 8);
            let (byte, bits) = (bit as u8 / 8, 1 << (bit % 8));
            let refused = reserved.iter().any(|&(at, mask)| at == byte && mask & bits != 0);
            let want = if refused { Err(Error::Reserved { byte, bits }) } else { Ok(()) };
            assert_eq!(Response::parse_strict(&block).map(|_| ()), want, "{byte1:02x} bit {bit}");
            assert!(Response::parse(&block).is_ok());
        }
    }
}

/// What can be noticed without a check sum: 16 of the 128 single flips, those in bytes 0 and 1.
#[test]
fn flips_that_can_be_noticed() {
    let expected = Expected {
        size: BlockSize::Bytes16,
        mac_id: MacId::new(9).unwrap(),
        update_counter: UpdateCounter::new(2).unwrap(),
        code: Code::CYCLIC_POSITION,
    };
    let base = [0xc9, 0x20, 0xc1, 0x00, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
    assert!(matches!(expected.check(&base), Ok(Checked { acknowledgement: Acknowledgement::Accepted, .. })));
    let noticed = |bit: usize| {
        let mut block = base;
        block[bit / 8] ^= 1 << (bit % 8);
        !matches!(expected.check(&block), Ok(Checked { acknowledgement: Acknowledgement::Accepted, .. }))
    };
    assert!((0..16).all(noticed));
    assert!(!(16..128).any(noticed));
}

#[test]
fn alarm_data_come_back() {
    let alarm = Alarm { main: 86, sub: 1 };
    let data = Results::alarm_data(alarm, 0xa5c3);
    assert_eq!(data.to_le_bytes(), [86, 1, 0xc3, 0xa5]);
    let reply = Results { execution: Execution::default(), type_code: TypeCode::short(0), index: 0, data };
    assert_eq!(reply.alarm(), AlarmAndWarning { alarm, warning: 0xa5c3 });
    assert_eq!(
        format!("{alarm} {}", ErrorCode::CYCLIC_MODE),
        "Err86.1 002Eh (cyclic command not possible in this mode)"
    );
}

#[test]
fn a_block_of_zeros_is_not_a_servo_off() {
    let zeros = [0; 16];
    assert!(!CommandBlock::of(&zeros).unwrap().is_servo_off());
    assert_eq!(Command::parse(&zeros).map(|c| c.control), Ok(ControlBits::empty()));
}
