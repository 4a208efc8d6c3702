//! RTEX: blocks both ways, checks, master and drive.

use core::num::NonZeroU16;

use nom::IResult;
use rtex_block::device::{self, Drive, DriveConfig, OpenCodes};
use rtex_block::inspect::{self, Report};
use rtex_block::master::{
    ActiveCode, Asic, Axis, AxisConfig, Checked, CommandCounter, ControlError, ControlPhase, EchoWatch, Expected,
    Handshake, Heard, Inputs, Led, Limits, PhaseControl, ProfileMove, Progress, Ring, ServoOff, Slave, SlaveInfo, Turn,
    compare, led,
};
use rtex_block::position::{self, Gear};
use rtex_block::timing::{FrameTime, Periods, timer_reload};
use rtex_block::{
    Arguments, BlockSize, Code, Command, Command32, CommandBlock, CyclicCode, Doubt, Error, MacId, NonCyclicCommand,
    NonCyclicResponse, Policy, Response, Response32, ResponseBlock, Sample, SubCommand, TypeCode, UpdateCounter, pack,
    stream,
};

use super::kernels;
use crate::self_test::rtex::{COMMANDS, Command16, RESPONSES, Response16};

/// A response of drive 5 to the normal command of cyclic position, and to a monitor command.
const NORMAL: [u8; 16] = [0xc5, 0x20, 0xc1, 0, 0xe8, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff];
const MONITOR: [u8; 16] = [0xe5, 0x2a, 0xc1, 0, 0xe8, 0x03, 0, 0, 0x07, 0, 0, 0, 0xe8, 0x03, 0, 0];

const VIEW: ResponseBlock<'static> = match ResponseBlock::of(&NORMAL) {
    Ok(view) => view,
    Err(_) => panic!("C/R is 1"),
};

const RESPONSE: Response = VIEW.to_owned();

const MAC_ID: MacId = match MacId::new(5) {
    Some(mac_id) => mac_id,
    None => panic!("below 32"),
};

const COUNTER: UpdateCounter = UpdateCounter::ZERO.next();

const READ: Arguments = Arguments { type_code: TypeCode::short(7), index: 0, data: 0 };

const COMMAND: Command = Command { command_data1: 1_000, ..Command::idle(MAC_ID, COUNTER) };

const ASKING: Command = Command { noncyclic: NonCyclicCommand::Monitor(READ), ..COMMAND };

const EXPECTED: Expected =
    Expected { size: BlockSize::Bytes16, mac_id: MAC_ID, update_counter: COUNTER.next(), code: Code::CYCLIC_POSITION };

const LIMIT: NonZeroU16 = NonZeroU16::MIN.saturating_add(7);

const AXIS: Axis = axis(5);

const fn axis(mac_id: u8) -> Axis {
    let limits = Limits::new(LIMIT, 100);
    Axis::new(AxisConfig::new(MacId::truncate(mac_id), ActiveCode::CyclicPosition, 500_000, limits))
}

const HANDSHAKE: Handshake =
    match Handshake::new(MAC_ID, CyclicCode::CyclicPosition, NonCyclicCommand::Monitor(READ), 100) {
        Some(handshake) => handshake,
        None => panic!("a monitor command has an answer"),
    };

const POLICY: Policy = Policy::new(1_000_000);

const DRIVE: Drive = Drive::new(DriveConfig::new(MAC_ID, OpenCodes::INVENTED));

const BLOCK32: [u8; 32] = {
    let (mut block, mut at) = ([0; 32], 0);
    while at < 16 {
        block[at] = NORMAL[at];
        at += 1;
    }
    block[16] = 0x8a;
    block
};

const SLAVES: [Slave; 4] = [slave(0), slave(1), slave(2), slave(5)];

const fn slave(mac_id: u8) -> Slave {
    match MacId::new(mac_id) {
        Some(mac_id) => Slave { mac_id, kind: 1 },
        None => panic!("below 32"),
    }
}

kernels! {
    /// A response from its bytes, every field.
    fn rtex_response(block: &[u8; 16]) -> Result<Response, Error> {
        ResponseBlock::of(block).map(ResponseBlock::to_owned)
    } over [NORMAL, MONITOR];

    /// The actual position of a response that was checked.
    fn rtex_position(view: &ResponseBlock<'static>) -> i32 {
        view.response_data1()
    } over [VIEW];

    /// A response of any kind from a slice, with what bytes 8-15 say.
    fn rtex_noncyclic(row: &Response16) -> Option<(Response, NonCyclicResponse)> {
        Response::parse(&row.block).ok().map(|response| (response, response.noncyclic()))
    } over RESPONSES;

    /// The same, with the reserved bits checked.
    fn rtex_response_strict(row: &Response16) -> Result<Response, Error> {
        Response::parse_strict(&row.block)
    } over RESPONSES;

    /// A response of any kind into its bytes.
    fn rtex_response_emit((response, answer): &(Response, NonCyclicResponse)) -> [u8; 16] {
        response.with_noncyclic(answer).emit()
    } over [(RESPONSE, RESPONSE.noncyclic())];

    /// A command into its bytes.
    fn rtex_command_emit(command: &Command) -> [u8; 16] {
        command.emit()
    } over [COMMAND, ASKING];

    /// A command of any kind from its bytes.
    fn rtex_command(row: &Command16) -> Result<Command, Error> {
        Command::parse(&row.block)
    } over COMMANDS;

    /// The same, with pairs of codes and reserved bits checked.
    fn rtex_command_strict(row: &Command16) -> Result<Command, Error> {
        Command::parse_strict(&row.block)
    } over COMMANDS;

    /// Whether a block switches the servo off.
    fn rtex_is_servo_off(row: &Command16) -> bool {
        CommandBlock::of(&row.block).is_ok_and(CommandBlock::is_servo_off)
    } over COMMANDS;

    /// The servo-off that follows a command.
    fn rtex_servo_off(command: &Command) -> Option<[u8; 16]> {
        ServoOff::after(command).map(|off| off.emit())
    } over [COMMAND, ASKING];

    /// A 32-byte command into its bytes and back.
    fn rtex_command32(command: &Command) -> Result<Command32, Error> {
        Command32::parse_strict(&Command32 { main: *command, sub: SubCommand::IDLE }.emit())
    } over [COMMAND, ASKING];

    /// A 32-byte response from its bytes, strictly.
    fn rtex_response32(block: &[u8; 32]) -> Result<[u8; 32], Error> {
        Response32::parse_strict(block).map(|response| response.emit())
    } over [BLOCK32];

    /// The checks of a master.
    fn rtex_master_check((expected, block): &(Expected, [u8; 16])) -> Result<Checked, Error> {
        expected.check(block)
    } over [(EXPECTED, NORMAL), (EXPECTED, MONITOR)];

    /// The checks of a drive.
    fn rtex_device_check(row: &Command16) -> device::Verdict {
        device::check(&row.block, BlockSize::Bytes16, MAC_ID)
    } over COMMANDS;

    /// A block into 32-bit words.
    fn rtex_words32(block: &[u8; 16]) -> Option<[u32; 4]> {
        let mut words = [0; 4];
        pack::to_words(block, &mut words).ok().map(|()| words)
    } over [NORMAL];

    /// A block from 16-bit words.
    fn rtex_from_words16(words: &[u16; 8]) -> Option<[u8; 16]> {
        let mut block = [0; 16];
        pack::from_words(words, &mut block).ok().map(|()| block)
    } over [[0x20c5, 0x00c1, 1_000, 0, 10_000, 0, 0xff9c, 0xffff]];

    /// A block from a stream.
    fn rtex_stream(log: &[u8; 32]) -> IResult<&'static [u8], Response, Error> {
        stream::response(log)
    } over [BLOCK32];

    /// An update period of the counter and of its watch.
    fn rtex_counter((counter, watch): &(CommandCounter, EchoWatch)) -> (Turn, bool) {
        let (mut counter, mut watch) = (*counter, *watch);
        (counter.next(), watch.sample(Some(counter.last())))
    } over [(CommandCounter::new(0), EchoWatch::new(LIMIT)), (CommandCounter::new(1), EchoWatch::new(LIMIT))];

    /// An update period of a request.
    fn rtex_handshake((handshake, response): &(Handshake, Option<Response>)) -> Progress<NonCyclicResponse> {
        let mut handshake = *handshake;
        handshake.receive(response.as_ref())
    } over [(HANDSHAKE, Some(RESPONSE)), (HANDSHAKE, None)];

    /// An update period of a profile motion.
    fn rtex_profile_move((motion, response): &(ProfileMove, Response)) -> NonCyclicCommand {
        let mut motion = *motion;
        let _ = motion.receive(Some(response));
        motion.request()
    } over [(ProfileMove::new(MAC_ID, 0x11, 1_000, 500, 100), RESPONSE)];

    /// An update period of one axis: response in, command out.
    fn rtex_axis((axis, received): &(Axis, Heard)) -> Command32 {
        let mut axis = *axis;
        axis.hear(Turn::Valid(COUNTER), received, 500_000);
        let _ = axis.set_position(1_010);
        axis.transmission(Turn::Valid(COUNTER))
    } over [(AXIS, Heard::Main(RESPONSE)), (AXIS, Heard::Nothing)];

    /// The position for control, or why there is none.
    fn rtex_axis_position(axis: &Axis) -> Result<Sample, Doubt> {
        axis.evidence().at(2_000_000, POLICY)
    } over [AXIS];

    /// An update period of a ring of four axes.
    fn rtex_ring((axes, received): &([Axis; 4], [Heard; 4])) -> Option<[Command32; 4]> {
        let mut ring = Ring::new(*axes, 0).ok()?;
        let _ = ring.switch_on();
        Some(ring.update(received, 1_000_000))
    } over [([axis(5), axis(6), axis(7), axis(8)], [Heard::Main(RESPONSE); 4])];

    /// An exchange with the drive model.
    fn rtex_drive((drive, command): &(Drive, Command)) -> Option<[u8; 16]> {
        let mut drive = *drive;
        drive.hear(&command.emit())
    } over [(DRIVE, COMMAND), (DRIVE, ASKING)];

    /// A step of the phases.
    fn rtex_phase(inputs: &Inputs) -> (ControlPhase, Option<ControlError>) {
        let mut control = PhaseControl::new();
        control.step(*inputs);
        (control.phase(), control.error())
    } over [Inputs { asic: Asic::Initial, slave_info: None, tx_ready: false, timeout: false }];

    /// What the COM LED shows.
    fn rtex_led((phase, fault, t_ms): &(ControlPhase, Option<ControlError>, u64)) -> Led {
        led(*phase, *fault, *t_ms)
    } over [(ControlPhase::Prepare, None, 1_700), (ControlPhase::Running, Some(ControlError::Timeout), 20_000)];

    /// The slaves found against the table.
    fn rtex_slaves(found: &[Slave; 4]) -> SlaveInfo {
        compare(&SLAVES, found)
    } over [SLAVES];

    /// Periods from the drive's parameters.
    fn rtex_periods((pr7_20, pr7_21, pr7_91): &(i32, i32, Option<i64>)) -> Option<Periods> {
        Periods::from_a6n(*pr7_20, *pr7_21, *pr7_91)
    } over [(-1, 1, Some(500_000)), (3, 2, None)];

    /// Reload value of a timer.
    fn rtex_timer_reload((timer_hz, period_ns): &(u32, u32)) -> Option<u32> {
        timer_reload(*timer_hz, *period_ns)
    } over [(50_000_000, 500_000), (25_000_000, 62_500)];

    /// Frame time, and how many axes fit.
    fn rtex_frame_time((axes, com_ns): &(u32, u32)) -> (u64, u32) {
        (FrameTime::GUIDE.estimate_ns(*axes), FrameTime::GUIDE.axes_within(*com_ns))
    } over [(1, 62_500), (32, 500_000)];

    /// Whether a step is small enough.
    fn rtex_step((old, new): &(i32, i32)) -> bool {
        position::is_within_limit(position::step(*old, *new), 500_000, Gear::UNITY)
    } over [(i32::MAX, i32::MIN), (0, 200_001)];

    /// All that can be said about a block.
    fn rtex_inspect(block: &[u8; 16]) -> Report {
        inspect::inspect(block)
    } over [NORMAL, MONITOR];
}
