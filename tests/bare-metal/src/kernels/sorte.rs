//! SORTE: frames, both ends, time, the step pulse, the motor driver.

use core::hint::black_box;

use nom::{IResult, Parser};
use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::cut_through::{Passed, Rewriter};
use sorte_proto::device::{self, Device, Forwarding, FrameTimes, Passage, Path, PortId, Reaction};
use sorte_proto::follow::{Asked, Follower, InputSlice};
use sorte_proto::iep::{Channel, Edge};
use sorte_proto::master::{self, Action, Master, Outgoing};
use sorte_proto::sync0::{Sync0, Variant, Write, Writes};
use sorte_proto::timing::{Budget, Misfit, Timing};
use sorte_proto::{
    Clock, Correction, DelayModel, DelayReq, DeviceAddress, DeviceFrame, DeviceFrameView, Direction, Discovery,
    DiscoveryView, Entry, Error, LineDelay, LongFrame, MasterFrameView, MotorMask, Network, OutOfRange, Param,
    Parameters, Payload, Pto, Slice, StartTime, Status, Sync, crc8, emit_master_frame_into, fcs, stream,
    strip_preamble,
};

use super::kernels;

/// Room for a master frame of four devices, in whole words.
#[repr(align(4))]
struct Buffer([u8; 24]);

/// Output bytes and time stamps.
const OUTPUTS: [([u8; 16], u16); 2] = [([0x5a; 16], 0x1234), ([0; 16], 0xffff)];

/// A good master frame and two with a flip.
const FRAMES: [[u8; 21]; 3] = [
    [
        0x00, 0x30, 0x3f, 0xd7, 0x8e, 0x73, 0x62, 0xf2, 0xd6, 0x20, 0x2c, 0x0d, 0x9f, 0x07, 0x91, 0x3a, 0xa0, 0x15,
        0xdd, 0xee, 0x4d,
    ],
    [
        0x00, 0x30, 0x3f, 0xd7, 0x8e, 0x73, 0x62, 0xf2, 0xd6, 0x20, 0x2c, 0x0d, 0x9f, 0x07, 0x91, 0x3a, 0xa1, 0x15,
        0xdd, 0xee, 0x4d,
    ],
    [
        0x00, 0x30, 0x0d, 0x04, 0x8a, 0x6e, 0x35, 0x33, 0xe1, 0xc3, 0xfd, 0x1c, 0xaf, 0x75, 0x4a, 0x33, 0x66, 0xa2,
        0x5b, 0xfa, 0x56,
    ],
];

const DEVICE_FRAMES: [[u8; 6]; 2] = [[0x01, 0x04, 0x3d, 0, 0, 0x4a], [0xfa, 0x04, 0xc8, 0x76, 0x91, 0x72]];

/// SYNC and DELAY_REQ as the published master sends them.
const SYNC: [u8; 14] = [0xff, 0, 5, 0x40, 0x58, 3, 0, 0, 0x4c, 0, 0x3c, 0x34, 0x97, 0xf5];
const DELAY_REQ: [u8; 8] = [0xff, 0, 3, 0x20, 0xe6, 0xaa, 0x02, 0xef];

const START: Option<StartTime> = StartTime::new(1234);
const OVERLAPPING: Option<StartTime> = StartTime::new(2600);

/// The generator idle, with a pulse programmed, with one programmed and one deferred, and the same with overlaps.
const GENERATORS: [Sync0; 10] = {
    let states = generators(Variant::Lossless);
    let published = generators(Variant::Published);
    [
        states[0],
        states[1],
        states[2],
        states[3],
        states[4],
        published[0],
        published[1],
        published[2],
        published[3],
        published[4],
    ]
};

const fn generators(variant: Variant) -> [Sync0; 5] {
    let idle = Sync0::new(variant);
    let mut pending = idle;
    let _ = pending.cmp7(START);
    let mut deferred = pending;
    let _ = deferred.cmp7(START);
    let mut overlapping = idle;
    let _ = overlapping.cmp7(OVERLAPPING);
    let mut both = overlapping;
    let _ = both.cmp7(OVERLAPPING);
    [idle, pending, deferred, overlapping, both]
}

/// Head of DISCOVERY; the check is not looked at until its end.
const DISCOVERY: [u8; 1030] = {
    let mut frame = [0; 1030];
    frame[0] = 0xff;
    frame[2] = 1;
    frame
};

/// Bytes through a device, one after the other; the last that it sends.
fn through(frame: &[u8]) -> (u8, Option<Path>) {
    let mut device = Device::new(device::Config::new());
    device.set_links(Link::Up, Link::Down);
    let mut passage = device.passage(PortId::A);
    let mut last = 0;
    for byte in frame {
        last = pass(&mut passage, *byte);
    }
    (last, passage.path())
}

/// A byte, as an interrupt brings it: the passage is in memory between two of them.
#[inline(never)]
fn pass(passage: &mut Passage, byte: u8) -> u8 {
    passage.byte(byte)
}

kernels! {
    /// The master frame of four devices, into a buffer as firmware has it.
    fn sorte_master_frame_build((output, time_stamp): &([u8; 16], u16)) -> Buffer {
        let mut buffer = Buffer([0; 24]);
        let _ = emit_master_frame_into(output, *time_stamp, &mut buffer.0);
        buffer
    } over OUTPUTS;

    /// The check of a master frame, the slice of device 3, and the reference time.
    fn sorte_master_frame_check(frame: &[u8; 21]) -> Result<([u8; 4], u32), Error> {
        let view = MasterFrameView::parse(16, frame)?;
        match view.slice(8, 4)?.first_chunk() {
            Some(slice) => Ok((*slice, view.reference_ns(440))),
            None => Err(Error::OutsideOutput { offset: 8, len: 4 }),
        }
    } over FRAMES;

    /// A device frame.
    fn sorte_device_frame_build(payload: &[u8; 3]) -> [u8; 6] {
        let mut frame = [0; 6];
        let _ = DeviceFrame { address: DeviceAddress::FIRST, status: Status::LAST, payload: *payload }.emit_into(&mut frame);
        frame
    } over [[1, 2, 3], [0, 0, 0]];

    /// The check of a device frame.
    fn sorte_device_frame_check(frame: &[u8; 6]) -> Result<DeviceFrameView<'static>, Error> {
        DeviceFrameView::parse(3, frame)
    } over DEVICE_FRAMES;

    /// CMP6 of the step pulse generator, from all of its states.
    fn sorte_sync0_cmp6(generator: &Sync0) -> (Sync0, Writes) {
        let mut generator = *generator;
        let writes = generator.cmp6();
        (generator, writes)
    } over GENERATORS;

    /// CMP0.
    fn sorte_sync0_cmp0(generator: &Sync0) -> (Sync0, Writes) {
        let mut generator = *generator;
        let writes = generator.cmp0();
        (generator, writes)
    } over GENERATORS;

    /// CMP7 with a pulse.
    fn sorte_sync0_cmp7(generator: &Sync0) -> (Sync0, Writes) {
        let mut generator = *generator;
        let writes = generator.cmp7(START);
        (generator, writes)
    } over GENERATORS;

    /// CMP6 with its register writes in order.
    fn sorte_sync0_writes(generator: &Sync0) -> [Option<Write>; 7] {
        let mut generator = *generator;
        let mut writes = [None; 7];
        writes.iter_mut().zip(generator.cmp6()).for_each(|(to, write)| *to = Some(write));
        writes
    } over GENERATORS;

    /// A word to its meaning and back, and a step to a word.
    fn sorte_pto(word: &u16) -> (Pto, u16, Result<Pto, OutOfRange>) {
        let pto = Pto::from_word(*word);
        (pto, pto.word(), Pto::from_step(u32::from(*word), Direction::High))
    } over [0_u16, 1234, 0x89ab, 0x7fff, 0xffff];

    /// The payload of four motors with one sequence.
    fn sorte_payload((word, mask): &(u16, u8)) -> [u8; 16] {
        Payload::shared(Pto::from_word(*word), MotorMask::from_bits_truncate(*mask)).emit()
    } over [(0x89ab_u16, 5_u8), (1234, 15), (1, 0)];

    /// A payload taken apart.
    fn sorte_payload_parse((bytes, _): &([u8; 16], u16)) -> [Slice; 4] {
        Payload::parse(*bytes).0
    } over OUTPUTS;

    /// SYNC through a device, byte by byte.
    fn sorte_sync_rewrite(frame: &[u8; 14]) -> ([u8; 14], Result<Passed, Error>) {
        let mut rewriter = Rewriter::sync(76, Status::ERROR);
        let passed = frame.map(|byte| rewriter.byte(byte));
        (passed, rewriter.finish())
    } over [SYNC];

    /// 64 bytes of DISCOVERY through a device.
    fn sorte_discovery_rewrite(frame: &[u8; 64]) -> ([u8; 64], Result<Passed, Error>) {
        let mut rewriter = Rewriter::discovery(Entry::STOCK, Status::LAST);
        let passed = frame.map(|byte| rewriter.byte(byte));
        (passed, rewriter.finish())
    } over [[0xff; 64], {
        let mut head = [0; 64];
        head[0] = 0xff;
        head[2] = 1;
        head
    }];

    /// A whole DISCOVERY through a device, a call for each byte, as its port sees them. 1030 bytes.
    fn sorte_passage(frame: &[u8; 1030]) -> (u8, Option<Path>) {
        through(frame)
    } over [DISCOVERY];

    /// The first 16 bytes of it: count, offsets, and the entry of the first device.
    fn sorte_passage_head(frame: &[u8; 16]) -> (u8, Option<Path>) {
        through(frame)
    } over [{
        let mut head = [0; 16];
        head[0] = 0xff;
        head[2] = 1;
        head
    }];

    /// A word with its position, done by a device that has missed one before it.
    fn sorte_follow(words: &[u16; 3]) -> (Pto, i16, [u8; 3]) {
        let (mut asked, mut follower) = (Asked::new(), Follower::new(128));
        let mut last = Pto::DriverOff;
        for (word, lost) in words.iter().zip([false, true, false]) {
            let slice = asked.slice(Pto::from_word(*word));
            last = follower.next((!lost).then_some(slice));
        }
        let input = InputSlice { ordered: follower.ordered().unwrap_or_default(), ..InputSlice::default() };
        (last, asked.lag(InputSlice::parse(input.emit()).ordered), input.emit())
    } over [[0_u16, 1000, 0], [1000, 2000, 3000], [1000, 0x8001, 0x7fff]];

    /// A long-header frame with its checks.
    fn sorte_long_frame(frame: &[u8; 14]) -> Result<LongFrame<'static>, Error> {
        LongFrame::parse(frame)
    } over [SYNC];

    /// SYNC read and written.
    fn sorte_sync_frame(frame: &[u8; 14]) -> Result<[u8; 14], Error> {
        Sync::parse(frame).map(|sync| sync.emit())
    } over [SYNC];

    /// DELAY_REQ read and written.
    fn sorte_delay_req(frame: &[u8; 8]) -> Result<[u8; 8], Error> {
        DelayReq::parse(frame).map(|request| request.emit())
    } over [DELAY_REQ];

    /// PARAM written, and what a device takes of it.
    fn sorte_param(parameters: &Parameters) -> Result<Param, Error> {
        Param::parse(&Param::request(*parameters, Place::Last).emit())
    } over [Parameters::STOCK, Parameters::CNC];

    /// DISCOVERY of one device: written, passed, read, and the network it tells.
    fn sorte_discovery(lengths: &Entry) -> Result<(u8, u16), Error> {
        let mut bytes = Discovery::request(Place::Last).emit();
        Rewriter::discovery(*lengths, Status::LAST).pass(&mut bytes)?;
        let network = Network::new(DiscoveryView::parse(&bytes)?)?;
        let last = network.members().last().map_or(0, |member| member.assignment.out_offset);
        Ok((network.devices(), network.output_total().saturating_add(last)))
    } over [Entry::STOCK];

    /// Preamble and a frame off the front of a stream.
    fn sorte_stream(wire: &[u8; 12]) -> IResult<&'static [u8], LongFrame<'static>, Error> {
        let (rest, ((), frame)) = (stream::preamble, stream::long_frame).parse(wire.as_slice())?;
        Ok((rest, frame))
    } over [[0x55, 0x55, 0x55, 0xd5, 0xff, 0, 3, 0x20, 0xe6, 0xaa, 0x02, 0xef]];

    /// Both frames of the exchange off the front of a stream.
    fn sorte_stream_exchange(frame: &[u8; 21]) -> (bool, bool) {
        let master = stream::master_frame::<Error>(16).parse(frame.as_slice()).is_ok();
        (master, stream::device_frame::<Error>(3).parse(frame.as_slice()).is_ok())
    } over FRAMES;

    /// The bytes after a preamble, and both checks over them.
    fn sorte_checks(wire: &[u8; 12]) -> Result<(u8, u32), Error> {
        strip_preamble(wire).map(|frame| (crc8(frame), fcs(frame)))
    } over [[0x55, 0xd5, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]];

    /// Sixteen round trips to a line delay, as master and as device.
    fn sorte_line_delay(rtt_ns: &[u32; 16]) -> (Result<u16, Error>, u16) {
        let mut measured = [DelayModel::MASTER, DelayModel::DEVICE].map(LineDelay::new);
        for ns in rtt_ns {
            for delay in &mut measured {
                delay.add(*ns);
            }
        }
        let [master, device] = measured;
        (master.checked(), device.published())
    } over [[472; 16]];

    /// The clock takes a frame.
    fn sorte_clock((stamp, sof): &(u32, u32)) -> (Correction, Correction) {
        let mut clock = black_box(Clock::new());
        (clock.frame(*stamp, *sof, *sof), clock.frame(*stamp, *sof, *sof))
    } over [(10_856, 10_860)];

    /// What fits into a cycle.
    fn sorte_timing((devices, delays): &(u8, [u16; 4])) -> (Budget, Option<Misfit>) {
        let line = Timing::new(delays, *devices).with_output_len(16);
        (line.budget(), line.misfit(4000))
    } over [(4_u8, [85_u16; 4])];

    /// The master from IDLE to its first frame, and an answer that does not fit.
    fn sorte_master((frame, sof_ns): &([u8; 14], u64)) -> (Action, Result<(), Error>, usize) {
        let mut master = Master::new(master::Config::default());
        master.set_link(Link::Up);
        let first = master.poll(0);
        let mut buffer = [0; 64];
        let written = match first {
            Action::Send { frame: Outgoing::Discovery { .. }, .. } => Outgoing::Sync(Sync::of_master(500, 76, Place::Last)),
            _ => Outgoing::Discovery { place: Place::Last },
        };
        let len = written.emit_into(&mut buffer).unwrap_or_default();
        let answer = master.hear(frame, *sof_ns).map(|_| ());
        let _ = master.poll(*sof_ns);
        let _ = master.hear(frame, *sof_ns);
        let _ = master.emit_into(frame, 0, &mut buffer);
        (first, answer, len)
    } over [(SYNC, 3130_u64)];

    /// A device in IDLE takes a start-up frame.
    fn sorte_device((frame, port): &([u8; 14], PortId)) -> (Reaction, device::Action) {
        let mut device = Device::new(device::Config::default());
        device.set_links(Link::Up, Link::Down);
        let mut frame = *frame;
        let handled = device.hear(*port, &mut frame, FrameTimes { sof_ns: 0, counter_ns: 0, now_ns: 0 });
        let restarted = device.poll(0, u64::MAX);
        let _ = device.hear_reflection(handled.trigger, &frame, 500);
        let _ = device.answer([0; 3]);
        let _ = (device.line_delay_next_ns(), device.cycle_zero_ns(), device.send_time_ns(), device.parameters());
        (handled, restarted)
    } over [(SYNC, PortId::A), (SYNC, PortId::B)];

    /// A device that the host takes out and puts back, with what its ports do in between.
    fn sorte_device_modes(port: &PortId) -> [Forwarding; 3] {
        let mut device = black_box(Device::new(device::Config::default()));
        let idle = device.forwarding(*port);
        device.enter_error();
        let error = device.forwarding(*port);
        device.reset();
        [idle, error, device.forwarding(*port)]
    } over [PortId::A, PortId::B];

    /// A device refuses an exchange it is not in.
    fn sorte_device_exchange(frame: &[u8; 21]) -> bool {
        // A device in any state.
        let mut device = black_box(Device::new(device::Config::default()));
        device.hear_exchange(frame, FrameTimes { sof_ns: 1060, counter_ns: 1640, now_ns: 0 }).is_ok()
    } over FRAMES;

    /// Ten cycles of the timer model with a pulse each.
    fn sorte_iep(start: &u16) -> (u32, Option<Edge>) {
        let mut axis = Channel::new(Variant::Lossless, 2000, 300);
        axis.set_start(StartTime::new(*start));
        let (mut edges, mut last) = (0_u32, None);
        while let Some(edge) = axis.next_edge(40_000) {
            (edges, last) = (edges.saturating_add(1), Some(edge));
        }
        (edges, last)
    } over [1000_u16, 2600];
}
