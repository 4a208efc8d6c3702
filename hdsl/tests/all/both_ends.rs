//! Master and encoder talk to each other over a simulated line.

use crate::bench::Bench;
use crate::cable::Disturbance;
use hdsl::device::{Acknowledgement, BadHead, Behaviour, Complement, Disparity, Fault, Overload};
use hdsl::frame::Extra;
use hdsl::master::{Master, RestartReason, State};
use hdsl::message::{Access, Data, Length, LongRequest, RemoteRegister, ResourceAddress, ResourceError, ShortRequest};
use hdsl::registers::{BusError, Event, Interrupts, Online1, Online2, OnlineD, Register, RegisterBus, RemoteReceiver};
use hdsl::symbol::RunningDisparity;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Channel2Findings, Channel2Monitor, Dialect, Error};

const DIALECTS: [Dialect; 2] = [Dialect::SICK, Dialect::TI];

/// The link comes up in the documented number of frames, and position and speed are exact from then on.
#[test]
fn comes_up_at_every_length() {
    for dialect in DIALECTS {
        for (metres, delay) in [(0, 1), (10, 2), (50, 6), (100, 10)] {
            let mut bench = Bench::on_cable(dialect, metres);
            bench.speed = -1234;
            // 2 RESET, 16 SYNC, 9 START, 9 LEARN, 16 CHECK, IDREQ, 8 INIT, 4 V-frames
            bench.frames(2 + 16 + 9 + 9 + 16 + 1 + 8);
            assert_eq!(bench.master.state(), State::Running);
            bench.frames(4 * 8);
            assert!(bench.aligned());
            let map = bench.map;
            assert_eq!((map.vel(), map.quality(), map.link()), (Some(-1234), 15, true));
            assert_eq!(map.get::<1>(Register::Delay)[0] & 15, delay, "{metres} m");
            for _ in 0..1000 {
                let _ = bench.frame();
                assert!(bench.aligned());
            }
            assert_eq!(bench.master.counters().restarts, 0);
        }
    }
}

/// More than 11 bits of delay do not fit between the answer and the next frame.
#[test]
fn a_cable_that_is_too_long() {
    let mut bench = Bench::on_cable(Dialect::SICK, 130);
    bench.frames(18);
    let report = bench.frame();
    assert!(matches!(report.restarted, Some(RestartReason::Learn(Error::PatternNotFound { .. }))));
    assert_eq!(bench.master.state(), State::Reset);
}

/// One sample of jitter on every edge makes no bit error, at any place of the edges.
#[test]
fn one_sample_of_jitter() {
    for eighths in 0..8 {
        let disturbance = Disturbance::default().with_delay(16 + eighths).with_jitter(1);
        let mut bench = Bench::new(Dialect::SICK, 0x00153, disturbance);
        bench.speed = 77;
        bench.lock();
        bench.frames(50_000);
        let counters = bench.master.counters();
        assert_eq!((counters.words, counters.switch_bits, counters.acceleration, counters.restarts), (0, 0, 0, 0));
        assert!(bench.aligned());
    }
}

/// Noise takes the quality down until the link is given up; without the noise it comes back by itself.
#[test]
fn noise_loses_the_link_and_silence_regains_it() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 20);
        bench.lock();
        bench.cable.disturbance.bit_errors = 20_000;
        let mut lost = None;
        for _ in 0..5000 {
            let before = bench.map;
            if let Some(cause) = bench.frame().restarted {
                lost = Some(cause);
                assert!(before.link() && !bench.map.link());
                break;
            }
        }
        assert_eq!(lost, Some(RestartReason::Quality));
        let map = bench.map;
        assert!(
            map.online_d().contains(OnlineD::PRST)
                && map.online_1().contains(Online1::PRST)
                && map.online_2().contains(Online2::PRST)
        );
        bench.frames(500);
        bench.cable.disturbance.bit_errors = 0;
        bench.lock();
        assert!(!bench.map.online_d().intersects(OnlineD::PRST | OnlineD::POS | OnlineD::QMLW));
    }
}

/// Under moderate noise the link holds, and what it shows as aligned is right.
#[test]
fn moderate_noise_gives_no_wrong_safe_position() {
    let mut bench = Bench::on_cable(Dialect::SICK, 20);
    bench.speed = 5;
    bench.lock();
    bench.cable.disturbance.bit_errors = 200;
    let mut shown = 0;
    for _ in 0..40_000 {
        let _ = bench.frame();
        if bench.interrupts.contains(Interrupts::VPOS) {
            // That of the sampling edge before the V-frame, which ended one frame ago; a head that the encoder could
            // not read makes the V-frame longer.
            shown += 1;
            let age = bench.position - bench.map.vpos() as i64;
            assert!(age % 5 == 0 && (9 * 5..=16 * 5).contains(&age), "{age}");
        }
    }
    assert!(shown > 3000 && bench.master.counters().words > 0, "{shown}");
}

fn write_and_read() -> [LongRequest; 2] {
    let address = ResourceAddress::RWFILE;
    let write = Access::Write(Data::new(b"MOTOR 42").unwrap());
    let read = Access::Read(Length::Eight);
    [write, read].map(|access| LongRequest { address, indirect: true, offset: None, access })
}

/// A short and a long message complete while the position keeps running.
#[test]
fn messages_while_the_position_runs() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 50);
        bench.speed = 3;
        bench.lock();
        for request in write_and_read() {
            bench.master.start_long(request).unwrap();
            bench.master.start_short(ShortRequest::Write(RemoteRegister::PING, 0xa5)).unwrap();
            assert_eq!(bench.master.start_short(ShortRequest::Read(RemoteRegister::PING)), Err(Error::Busy));
            let (mut short, mut long) = (None, None);
            for _ in 0..120 {
                let finished = bench.frame().finished;
                short = short.or(finished.short);
                long = long.or(finished.long);
                assert!(bench.aligned());
            }
            assert!(short.unwrap().is_ok() && long.unwrap().unwrap().result.is_ok());
        }
        let map = bench.map;
        assert_eq!(&map.get::<8>(Register::PcBuffer), b"MOTOR 42");
        assert_eq!(bench.device.resources().register(RemoteRegister::PING), 0xa5);
    }
}

/// The order of the two error bytes in PC_BUFFER is the dialect's; the typed result has names.
#[test]
fn a_refused_long_message() {
    for (dialect, bytes) in [(Dialect::SICK, [0x10, 0x40]), (Dialect::TI, [0x40, 0x10])] {
        let mut bench = Bench::on_cable(dialect, 0);
        bench.lock();
        let [_, read] = write_and_read();
        let unknown = LongRequest { address: ResourceAddress::new(0x200).unwrap(), ..read };
        bench.master.start_long(unknown).unwrap();
        let mut result = None;
        for _ in 0..100 {
            result = result.or(bench.frame().finished.long);
        }
        let refusal = result.unwrap().unwrap().result.unwrap_err();
        assert_eq!(refusal, ResourceError::NOT_THERE);
        assert_eq!(bench.map.get::<2>(Register::PcBuffer), bytes);
        assert_eq!(bench.map.get::<2>(Register::PcAdd), [0xf6, 0x00]);
    }
}

/// What the encoder can do wrong, and what the receiver makes of it.
#[test]
fn faults_of_the_encoder() {
    let faulty = |dialect, fault| {
        let mut bench = Bench::on_cable(dialect, 0);
        bench.lock();
        bench.device.set_fault(fault);
        let mut cause = None;
        for _ in 0..100 {
            cause = cause.or(bench.frame().restarted);
        }
        (cause, bench.map)
    };
    for dialect in DIALECTS {
        assert_eq!(faulty(dialect, Fault::Silent).0, Some(RestartReason::Quality));
        assert_eq!(faulty(dialect, Fault::NoVsync).0, Some(RestartReason::Quality));
        let (cause, map) = faulty(dialect, Fault::NoPosition);
        assert!(cause.is_none() && map.online_1().contains(Online1::VPOS) && map.online_d().contains(OnlineD::POS));
        let (cause, map) = faulty(dialect, Fault::NoPosition2);
        assert!(cause.is_none() && map.online_2().contains(Online2::VPOS2) && !map.online_d().contains(OnlineD::POS));
        let (_, map) = faulty(dialect, Fault::BadCrc);
        assert!(map.event_s().contains(hdsl::registers::EventS::SCE));
    }
    // The manual counts a wrong CRC of channel 2, the SDK counts TEST2.
    assert_eq!(faulty(Dialect::SICK, Fault::BadCrc2).0, Some(RestartReason::Quality));
    let (cause, map) = faulty(Dialect::TI, Fault::BadCrc2);
    assert!(cause.is_none() && map.online_2().contains(Online2::SCE2));
    let (cause, map) = faulty(Dialect::SICK, Fault::Test2);
    assert!(cause.is_none() && map.online_2().contains(Online2::SUM2));
    assert_eq!(faulty(Dialect::TI, Fault::Test2).0, Some(RestartReason::Quality));
    // No acceleration: the SDK restarts after 31 words, the manual stops counting there.
    assert_eq!(faulty(Dialect::TI, Fault::NoAcceleration).0, Some(RestartReason::AccelerationErrors));
    let (cause, map) = faulty(Dialect::SICK, Fault::NoAcceleration);
    assert_eq!((cause, map.get::<1>(Register::AccErrCnt)), (None, [31]));
}

#[test]
fn an_encoder_without_vsync() {
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.device.set_fault(Fault::NoVsync);
    bench.frames(53 + 15);
    assert_eq!(bench.frame().restarted, Some(RestartReason::NoVsync));
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.device.set_fault(Fault::NoVsync);
    bench.frames(1000);
    assert_eq!((bench.master.state(), bench.master.counters().restarts), (State::WaitVsync, 0));
}

#[test]
fn an_encoder_that_is_not_supported() {
    for id in [0x00150, 0x80153, 0x001f3] {
        let mut bench = Bench::new(Dialect::SICK, id, Disturbance::metres(0));
        bench.frames(52);
        assert_eq!(bench.frame().restarted, Some(RestartReason::Identifier(Error::UnsupportedEncoder { id })));
    }
}

#[test]
fn too_few_samples_change_nothing() {
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.lock();
    let before = bench.master;
    for len in 0..72 {
        let refused = bench.master.hear(&[0xff; 72][..len], 0);
        assert_eq!(refused, Err(Error::Truncated { got: len as u16, want: 72 }));
        assert_eq!(bench.master, before);
    }
}

/// Brings a synchronised link up against a pulse and gives the largest distance of the edge from it, in tenths of an
/// eighth, after the link runs.
fn synchronised(dialect: Dialect, period: i64, es: u8, metres: u32) -> i64 {
    let sync = Synchroniser::new((period / 10) as u32, Es::new(es).unwrap()).unwrap();
    let mut bench = Bench::on_cable(dialect, metres);
    bench.master = Master::synchronised(dialect, sync);
    bench.speed = 9;
    let (mut edge, mut pulse, mut worst) = (37_i64, 0_i64, 0);
    let extra = |bench: &Bench| bench.master.transmission().head.extra().map_or(0, Extra::get);
    for _ in 0..2000 {
        let on_pulse = bench.master.is_on_pulse();
        let late = on_pulse.then(|| (pulse - edge + 5).div_euclid(10) as i16);
        if on_pulse {
            if bench.master.state() == State::Running {
                worst = worst.max((pulse - edge).abs());
            }
            pulse += period;
        }
        let before = extra(&bench);
        let report = bench.frame_with(late);
        let rest = i64::from(before.div_ceil(8)) * 8 - i64::from(before);
        let frame = rest + 864 + 48 * i64::from(report.tail.stuffing.get()) + i64::from(extra(&bench));
        edge += 10 * frame;
        assert!(report.restarted.is_none());
    }
    assert!(bench.aligned());
    worst
}

#[test]
fn synchronised_to_a_pulse() {
    for dialect in DIALECTS {
        for (tenths_of_us, es) in
            [(120, 1), (121, 1), (160, 1), (200, 1), (253, 1), (270, 1), (250, 2), (625, 5), (1250, 10)]
        {
            for metres in [0, 100] {
                let worst = synchronised(dialect, tenths_of_us * 75, es, metres);
                assert!(worst <= 10, "{tenths_of_us} {es} {metres}: {worst}");
            }
        }
    }
}

/// Everything that the documents leave to the encoder, in all combinations of extremes: the link comes up, position and
/// messages are right.
#[test]
fn whatever_the_encoder_makes_of_open_points() {
    for combination in 0..256_u32 {
        let on = |bit: u32| combination >> bit & 1 == 1;
        let mut bench = Bench::on_cable(DIALECTS[usize::from(on(0))], 10);
        let mut behaviour = Behaviour::new();
        behaviour.overload = if on(1) { Overload::NoValue } else { Overload::Saturated };
        behaviour.complement = if on(2) { Complement::Twos } else { Complement::Ones };
        behaviour.second_shift = if on(2) { 8 } else { 0 };
        behaviour.disparity = if on(3) { Disparity::EachAnswer(RunningDisparity::Plus) } else { Disparity::CarriedOn };
        behaviour.reserved_bits = if on(4) { 3 } else { 0 };
        behaviour.sync_frames = if on(5) { 16 } else { 1 };
        behaviour.first_place = if on(6) { 5 } else { 0 };
        behaviour.bad_head = if on(7) { BadHead::Stalls } else { BadHead::Counts };
        behaviour.acknowledgement = if on(6) { Acknowledgement::RepeatsLength } else { Acknowledgement::Empty };
        behaviour.latency_frames = if on(7) { 300 } else { 0 };
        bench.device.set_behaviour(behaviour);
        bench.speed = -321;
        bench.lock();
        bench.master.start_short(ShortRequest::Write(RemoteRegister::PING, 0x5a)).unwrap();
        let [write, _] = write_and_read();
        bench.master.start_long(write).unwrap();
        let mut monitor = Channel2Monitor::new();
        let (mut answered, mut written) = (false, None);
        for _ in 0..if on(7) { 500 } else { 80 } {
            let report = bench.frame();
            written = written.or(report.finished.long);
            answered |= report.finished.short.is_some_and(|result| result.is_ok());
            let fast = bench.fast().unwrap();
            assert_eq!((fast.position(), fast.velocity()), (bench.position, -321));
            let (safe, age) = bench.safe().unwrap();
            assert_eq!(safe, bench.position + 321 * age as i64, "{combination}");
            if let Some(frame) = report.v_frame {
                assert_eq!(monitor.v_frame(&frame), Channel2Findings::empty());
            }
        }
        assert_eq!(written.map(|end| end.map(|answer| answer.result)), Some(Ok(Ok(Data::NONE))), "{combination}");
        // A latency beyond 64 frames is a message that is not answered in time, and sent again.
        assert!(answered != on(7) || bench.device.resources().register(RemoteRegister::PING) == 0x5a, "{combination}");
    }
}

/// The safe position is the true one also while the acceleration channel is overloaded and the fast position lags.
#[test]
fn an_overload_is_no_wrong_position() {
    for overload in [Overload::Saturated, Overload::NoValue] {
        let mut bench = Bench::on_cable(Dialect::SICK, 0);
        bench.device.set_behaviour(Behaviour::new().with_overload(overload));
        bench.lock();
        let mut positions = [bench.position; 16];
        for frame in 0..400 {
            // Jerks of ten thousand steps a frame, now and then.
            bench.speed = if frame % 100 == 3 { 10_000 } else { 0 };
            let _ = bench.frame();
            positions.rotate_right(1);
            positions[0] = bench.position;
            if let Ok((safe, age)) = bench.safe() {
                assert_eq!(safe, positions[age], "{frame}");
            }
            if overload == Overload::NoValue {
                let fast = bench.fast();
                assert!(fast.is_err() || fast.unwrap().position() == bench.position, "{frame}");
            }
        }
    }
}

/// An encoder that was not synchronised is silent; one that forgets requests is asked again.
#[test]
fn an_impolite_encoder() {
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.device.set_behaviour(Behaviour::new().with_sync_frames(17));
    bench.frames(18);
    assert_eq!(bench.frame().restarted, Some(RestartReason::Learn(Error::NoEdge)));

    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.lock();
    bench.device.set_behaviour(Behaviour::new().with_forgets_every(2));
    for _ in 0..6 {
        bench.master.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
        let answered = (0..200).any(|_| bench.frame().finished.short.is_some_and(|result| result.is_ok()));
        assert!(answered);
    }
}

/// What the monitor of channel 2 says about each fault of it.
#[test]
fn channel_2_is_watched() {
    let cases = [
        (Fault::None, Channel2Findings::empty()),
        (Fault::Test2, Channel2Findings::TEST2),
        (Fault::Error2, Channel2Findings::ERR2),
        (Fault::StuckToggle, Channel2Findings::TOG2),
        (Fault::NoPosition2, Channel2Findings::VPOS2),
        (Fault::BadCrc2, Channel2Findings::STALE),
    ];
    for (fault, want) in cases {
        let mut bench = Bench::on_cable(Dialect::SICK, 0);
        bench.lock();
        bench.device.set_fault(fault);
        let mut monitor = Channel2Monitor::new();
        let mut all = Channel2Findings::empty();
        for _ in 0..40 {
            if let Some(frame) = bench.frame().v_frame {
                all |= monitor.v_frame(&frame);
            }
        }
        assert_eq!(all, want, "{want}");
    }
}

/// Signed positions come with their sign.
#[test]
fn signed_positions() {
    // 00153h with bit 10: 32 bits, signed.
    let mut bench = Bench::new(Dialect::SICK, 0x00553, Disturbance::metres(0));
    bench.position = 1000;
    bench.speed = -7;
    while bench.position > -5000 {
        let _ = bench.frame();
        if let Ok(fast) = bench.fast() {
            assert_eq!(fast.position(), bench.position);
        }
    }
    let (safe, age) = bench.safe().unwrap();
    assert_eq!(safe, bench.position + 7 * age as i64);
    assert!(bench.fast().unwrap().position() < 0 && safe < 0);
}

/// The registers of a bench as a bus to a receiver elsewhere: every access lets some frames pass.
impl RegisterBus for Bench {
    type Error = Error;

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), Error> {
        self.frames(3);
        for (at, byte) in (address..).zip(bytes) {
            *byte = self.map.read(at).ok_or(Error::NoRegister { address: at })?;
        }
        Ok(())
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Error> {
        self.frames(1);
        (address..).zip(bytes).try_for_each(|(at, byte)| self.map.write(&mut self.master, at, *byte))
    }
}

/// Typed messages, events and positions of a receiver that is reached through its registers only.
#[test]
fn a_receiver_behind_a_bus() {
    // The map by the manual's rules has the addresses of the SDK; the core has others.
    let dialect = Dialect::TI;
    let mut bench = Bench::on_cable(dialect, 10);
    bench.speed = 4;
    bench.lock();
    let mut remote = RemoteReceiver::new(dialect, bench);
    remote.start_short(ShortRequest::Write(RemoteRegister::PING, 0x77)).unwrap();
    assert_eq!(remote.start_short(ShortRequest::Read(RemoteRegister::PING)), Err(BusError::Link(Error::Busy)));
    while remote.poll_short().unwrap().is_none() {}
    remote.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
    let data = (0..100).find_map(|_| remote.poll_short().unwrap());
    assert_eq!(data, Some(0x77));

    let [write, read] = write_and_read();
    for (request, want) in [(write, &b""[..]), (read, b"MOTOR 42")] {
        remote.start_long(&request).unwrap();
        assert_eq!(remote.start_long(&request), Err(BusError::Link(Error::Busy)));
        let data = (0..100).find_map(|_| remote.poll_long().unwrap()).unwrap();
        assert_eq!(data.as_bytes(), want);
    }
    remote.start_long(&LongRequest::read(ResourceAddress::new(0x3ff).unwrap(), Length::Two)).unwrap();
    let refused = (0..100).find_map(|_| remote.poll_long().err());
    assert_eq!(refused, Some(BusError::Link(Error::Resource { error: ResourceError::NOT_THERE })));

    let map = remote.registers().unwrap();
    assert_eq!((map.vel(), map.quality(), map.link()), (Some(4), 15, true));
    let _ = remote.take_events().unwrap();
    assert!(!remote.take_events().unwrap().drive.intersects(Event::FREL | Event::PRST));
}
