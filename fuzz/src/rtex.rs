//! RTEX blocks, the master around them, and the drive model.

use core::num::NonZeroU16;

use rtex_block::device::{Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::inspect::inspect;
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, Heard, Limits, Ring};
use rtex_block::{
    Alarm, Command, Command32, CommandBlock, ControlBits, Error, MacId, NonCyclicCode, NonCyclicCommand,
    NonCyclicResponse, Response, Response32, stream,
};

use crate::byte;

mod reference;

/// A block of either size and direction: what is accepted is what would be sent again, what is refused fails the check
/// that is named, and a decoder that takes bit after bit says the same.
pub fn block(data: &[u8]) {
    let report = inspect(data);
    assert_eq!(report.changes(&report).count(), 0);
    let response = data.first().is_some_and(|byte0| byte0 & 0x80 != 0);
    let usable = match (response, data.len() > 16) {
        (false, false) => command16(data),
        (false, true) => command32(data),
        (true, false) => response16(data),
        (true, true) => response32(data),
    };
    assert_eq!(report.is_usable(), usable);
    assert_eq!(report.is_response(), data.first().map(|_| response));
}

fn command16(data: &[u8]) -> bool {
    let strict = Command::parse_strict(data);
    let lenient = Command::parse(data);
    match lenient {
        Ok(command) => {
            let emitted = command.emit();
            assert_eq!(Command::parse_strict(&emitted).is_ok(), command.code().is_allowed());
            // Strict decoding takes a block only if it is what an encoder writes.
            assert_eq!(strict.is_ok(), emitted == data && command.code().is_allowed());
            reference::command(&emitted, &command);
            let view = CommandBlock::new(data).expect("it was decoded");
            assert_eq!(view.is_servo_off(), view.obeys_control() && !command.control.contains(ControlBits::SERVO_ON));
        }
        Err(error) => refused(data, 16, error),
    }
    if strict.is_ok() {
        assert_eq!(strict, lenient);
    }
    lenient.is_ok()
}

fn command32(data: &[u8]) -> bool {
    match Command32::parse(data) {
        Ok(command) => {
            assert_eq!(Command32::parse(&command.emit()), Ok(command));
            assert_eq!(Command::parse(&data[..16]), Ok(command.main));
            true
        }
        Err(error) => {
            refused(data, 32, error);
            false
        }
    }
}

fn response16(data: &[u8]) -> bool {
    match Response::parse(data) {
        Ok(response) => {
            assert_eq!(response.emit(), data);
            let noncyclic = response.noncyclic();
            assert_eq!(matches!(noncyclic, NonCyclicResponse::CommandError(_)), response.cmd_error);
            let again = response.with_noncyclic(&noncyclic);
            assert_eq!(again.noncyclic(), noncyclic);
            // An answer that is written again differs from what came in reserved bits only.
            assert!(again == response || Response::parse_strict(data).is_err());
            reference::response(data, &response);
            true
        }
        Err(error) => {
            refused(data, 16, error);
            false
        }
    }
}

fn response32(data: &[u8]) -> bool {
    match Response32::parse(data) {
        Ok(response) => {
            assert_eq!(response.emit(), data);
            true
        }
        Err(error) => {
            refused(data, 32, error);
            false
        }
    }
}

/// The reason of a refusal is so.
fn refused(data: &[u8], want: usize, error: Error) {
    match error {
        Error::Truncated { got, want: said } => {
            assert!(usize::from(got) == data.len() && usize::from(got) < want && usize::from(said) == want);
        }
        Error::TooLong { got, want: said } => {
            assert!(usize::from(got) == data.len().min(0xffff) && data.len() > want && usize::from(said) == want);
        }
        Error::CyclicCode { code } => assert!(code == data[1] >> 4 & 7 && code > 4),
        Error::NonCyclicCode { code } => assert!(code == data[1] & 15 && NonCyclicCode::from_code(code).is_none()),
        Error::SubChk { byte16 } => assert!(byte16 == data[16] && byte16 < 0x80),
        Error::SubCommandCode { code } => assert!(code == data[16] & 15 && ![0, 2, 10].contains(&code)),
        error => panic!("{error} is not an error of this block"),
    }
}

/// Blocks in a row: the parsers take them one by one, as if each were alone, and wait for the rest of the last.
pub fn log(mut data: &[u8]) {
    while data.len() >= 16 {
        let alone = Response::parse(&data[..16]);
        match stream::response::<Error>(data) {
            Ok((rest, response)) => {
                assert_eq!((Ok(response), rest.len()), (alone, data.len() - 16));
            }
            Err(nom::Err::Error(error)) => assert_eq!(Err(error), alone),
            Err(error) => panic!("{error:?} with a whole block there"),
        }
        data = &data[16..];
    }
    assert!(matches!(stream::response::<Error>(data), Err(nom::Err::Incomplete(_))));
}

const LIMIT: u16 = 4;

/// A master and two drives on a line that the input spoils: no NOP once started, nothing but servo-off after a failure, and
/// when all is well again the ring can be switched on.
///
/// ```text
/// two bytes an update period: what happens (low nibble) and to which drive (bit 4), its argument
/// ```
pub fn ring(mut data: &[u8]) {
    let limit = NonZeroU16::new(LIMIT).expect("not 0");
    let limits = Limits::new(limit, 20).with_ready(Some(60));
    let mac_id = |place| MacId::new(place).expect("below 32");
    let axis = |place| {
        let mode = ActiveCode::CyclicPosition;
        Axis::new(AxisConfig::new(mac_id(place), mode, 500_000, limits))
    };
    let drive = |place| {
        Drive::new(DriveConfig::new(mac_id(place), OpenCodes::INVENTED).with_fault_limit(LIMIT).with_lost_limit(LIMIT))
    };
    let mut ring = Ring::new([axis(0), axis(1)], 2).expect("two addresses");
    let mut drives = [drive(0), drive(1)];
    let mut responses = [Heard::Nothing; 2];
    let mut started = false;
    for _ in 0..256 {
        if data.is_empty() {
            break;
        }
        let (event, argument) = (byte(&mut data), byte(&mut data));
        let place = usize::from(event >> 4 & 1);
        act(event & 15, argument, &mut ring, place, &mut drives[place]);
        let commands = ring.update(&responses, 0);
        for (k, command) in commands.iter().enumerate() {
            let mut sent = command.main.emit();
            let view = CommandBlock::of(&sent).expect("a command");
            started |= view.obeys_control();
            assert_eq!(view.obeys_control(), started);
            assert!(ring.failure().is_none() || view.is_servo_off());
            responses[k] = match event & 15 {
                1 if k == place => {
                    drives[k].framing_error();
                    Heard::Nothing
                }
                2 if k == place => {
                    sent[usize::from(argument >> 3 & 15)] ^= 1 << (argument & 7);
                    Response::parse(&drives[k].hear(&sent).unwrap()).into()
                }
                3 if k == place => {
                    let mut received = drives[k].hear(&sent).unwrap();
                    received[usize::from(argument >> 3 & 15)] ^= 1 << (argument & 7);
                    Response::parse(&received).into()
                }
                _ => Response::parse(&drives[k].hear(&sent).unwrap()).into(),
            };
        }
    }
    recover(&mut ring, &mut drives, responses);
}

fn act(event: u8, argument: u8, ring: &mut Ring<2>, place: usize, drive: &mut Drive) {
    let [first, second] = ring.axes_mut();
    let axis = if place == 0 { first } else { second };
    match event {
        4 => _ = ring.switch_on().ok(),
        5 => ring.switch_off(),
        6 => ring.clear(),
        7 => drive.set_fault(Fault::Alarm(Alarm { main: argument, sub: 0 })),
        8 => drive.clear_alarm(),
        9 => drive.set_fault(if argument & 1 == 1 { Fault::None } else { Fault::NoMainPower }),
        10 => _ = axis.set_position(axis.setpoint().wrapping_add(i32::from(argument) << 11)),
        11 => {
            let code = NonCyclicCode::ALL[usize::from(argument) % 8];
            let _ = axis.ask(NonCyclicCommand::parse(code, [argument >> 3, 0, 0, 0, 0, 0, 0, 0]));
        }
        12 => _ = axis.take_outcome(),
        _ => {}
    }
}

/// With a good line, no alarms and power, every axis comes on within its limits.
fn recover(ring: &mut Ring<2>, drives: &mut [Drive; 2], mut responses: [Heard; 2]) {
    for round in 0..120 {
        if round % 60 == 0 {
            for drive in drives.iter_mut() {
                drive.clear_alarm();
                drive.set_fault(Fault::None);
            }
            ring.clear();
        }
        ring.switch_on().ok();
        let commands = ring.update(&responses, 0);
        for (k, command) in commands.iter().enumerate() {
            responses[k] = Response::parse(&drives[k].hear(&command.main.emit()).unwrap()).into();
        }
    }
    assert!(ring.all_are(AxisState::On), "{:?}", ring.failure());
    assert!(drives.iter().all(Drive::is_active));
}

/// Any blocks to a drive of either size: it never stops answering under its own address, and echoes the counter.
pub fn drive(data: &[u8]) {
    let mac_id = MacId::new(5).expect("below 32");
    let config = DriveConfig::new(mac_id, OpenCodes::INVENTED).with_sync_exchanges(2).with_servo_on_updates(1);
    let (mut short, mut long) = (Drive::new(config), Drive::new(config));
    for block in data.chunks_exact(16).filter_map(|block| block.first_chunk::<16>()) {
        let response = Response::parse_strict(&short.hear(block).expect("it is not silent"));
        let response = response.expect("an undefined code is echoed with CMD_Error only, reserved bits are 0");
        assert_eq!(response.mac_id, mac_id);
        assert_eq!(response.update_counter_echo.get(), block[0] >> 5 & 3);
        if short.is_active() {
            assert!(short.alarm().is_none());
        }
    }
    for block in data.chunks_exact(32).filter_map(|block| block.first_chunk::<32>()) {
        let response = Response32::parse_strict(&long.hear(block).expect("it is not silent"));
        let response = response.expect("a drive writes no reserved bits");
        assert_eq!(response.main.mac_id, mac_id);
    }
}
