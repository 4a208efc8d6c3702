//! What the release notes of the vendor's receiver list as open or fixed, one test each. The numbers are theirs.

use crate::bench::Bench;
use crate::cable::Disturbance;
use hdsl::device::Fault;
use hdsl::frame::{Stuffing, Tail, Trailer};
use hdsl::master::{Master, RestartReason, State};
use hdsl::message::{Access, Length, LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::{Event, EventS, Online1, OnlineD, Register};
use hdsl::rssi::Rssi;
use hdsl::symbol::Character;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{AlignmentStage, Dialect, EncoderId};

const DIALECTS: [Dialect; 2] = [Dialect::SICK, Dialect::TI];

fn resolution() -> LongRequest {
    LongRequest {
        address: ResourceAddress::RESOLUTN,
        indirect: false,
        offset: None,
        access: Access::Read(Length::Eight),
    }
}

/// 7474: no 100 m cable in sync mode.
#[test]
fn hundred_metres_in_both_modes() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 100);
        bench.lock();
        bench.master = Master::synchronised(dialect, Synchroniser::new(1500, Es::ONE).unwrap());
        bench.lock();
        assert_eq!(bench.master.counters().restarts, 0);
    }
}

/// 7157: sync with more than one frame for a pulse.
#[test]
fn every_es() {
    for es in 1..=10 {
        let mut bench = Bench::on_cable(Dialect::TI, 10);
        let es = Es::new(es).unwrap();
        bench.master =
            Master::synchronised(Dialect::TI, Synchroniser::new(u32::from(es.get()) * 1000 + 1, es).unwrap());
        bench.lock();
        let on_pulse = (0..1000).filter(|_| {
            let on = bench.master.is_on_pulse();
            let _ = bench.frame();
            on
        });
        assert!(on_pulse.count().abs_diff(1000 / usize::from(es.get())) <= 1);
    }
}

/// 6526: FREL and FRES stuck. The event is there once for every message and goes when it is cleared; the online status
/// is 0 exactly while the message is under way.
#[test]
fn free_flags() {
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.lock();
    for _ in 0..3 {
        let _ = bench.map.take_events();
        bench.write(Register::SlaveRegCtrl, 0x80 | RemoteRegister::PING.index());
        for (register, value) in [(0x28, 0xcc), (0x29, 0x81), (0x2c, 1)] {
            bench.map.write(&mut bench.master, register, value).unwrap();
        }
        let map = bench.map;
        assert!(!map.online_1().contains(Online1::FRES) && !map.online_d().contains(OnlineD::FREL));
        let (mut short, mut long) = (false, false);
        for _ in 0..100 {
            let finished = bench.frame().finished;
            (short, long) = (short || finished.short.is_some(), long || finished.long.is_some());
            let map = bench.map;
            assert_eq!((map.online_1().contains(Online1::FRES), map.event_s().contains(EventS::FRES)), (short, short));
            assert_eq!((map.online_d().contains(OnlineD::FREL), map.event().contains(Event::FREL)), (long, long));
        }
        assert!(short && long);
        bench.write(Register::EventL, 0);
        bench.write(Register::EventS, 0);
        bench.frames(50);
        assert!(!bench.map.event().contains(Event::FREL));
        assert!(!bench.map.event_s().contains(EventS::FRES));
    }
}

/// 6944: increments of the quality monitor. A perfect link gains two a V-frame.
#[test]
fn quality_gains_two_a_v_frame() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 0);
        while bench.master.state() != State::Running {
            let _ = bench.frame();
        }
        let values: Vec<u8> = (0..6)
            .map(|_| {
                bench.frames(8);
                bench.map.quality()
            })
            .collect();
        assert_eq!(values, [10, 12, 14, 15, 15, 15]);
    }
}

/// 6630: POS during the first alignment. The manual's dialect shows it from the lock to the first good check; the SDK
/// did not.
#[test]
fn position_flag_during_the_first_alignment() {
    for (dialect, shown) in [(Dialect::SICK, true), (Dialect::TI, false)] {
        let mut bench = Bench::on_cable(dialect, 0);
        while bench.master.state() != State::Running {
            let _ = bench.frame();
        }
        for _ in 0..31 {
            let _ = bench.frame();
            assert_eq!(bench.map.online_d().contains(OnlineD::POS), shown);
        }
        bench.frames(1);
        assert_eq!(bench.map.stage(), AlignmentStage::Check);
        assert!(!bench.map.online_d().contains(OnlineD::POS));
    }
}

/// 7048: SCE cleared too early. It stays until the next block with a right CRC.
#[test]
fn wrong_crc_stays_until_a_right_one() {
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.lock();
    while bench.master.frame() != 0 {
        let _ = bench.frame();
    }
    bench.device.set_fault(Fault::BadCrc);
    bench.frames(8);
    bench.device.set_fault(Fault::None);
    for frame in 0..9 {
        let _ = bench.frame();
        // The block's result is shown one frame after its end.
        let sce = bench.map.online_1().contains(Online1::SCE);
        assert_eq!(sce, frame < 8, "{frame}");
    }
    assert!(bench.map.event_s().contains(EventS::SCE));
}

/// 6486: RSSI higher than expected: edges in every sample period counted as perfect.
#[test]
fn many_edges_are_a_bad_signal() {
    assert_eq!(Rssi::of_edges(0xff).get(), 0);
    let mut bench = Bench::on_cable(Dialect::SICK, 10);
    bench.lock();
    assert_eq!(bench.map.get::<1>(Register::Delay)[0] >> 4, 12);
    bench.cable.disturbance.glitches = 3000;
    let rssi = (0..20).map(|_| {
        let _ = bench.frame();
        bench.map.get::<1>(Register::Delay)[0] >> 4
    });
    assert!(rssi.min() < Some(12));
}

/// 5690: EDGES not filled. On a clean line edges are in one sample period, with jitter in its neighbours too.
#[test]
fn edges_register() {
    for (jitter, periods) in [(0, 1), (1, 3)] {
        let mut bench = Bench::new(Dialect::TI, 0x00153, Disturbance::default().with_jitter(jitter).with_delay(20));
        bench.frames(70);
        let [edges] = bench.map.get(Register::Edges);
        assert_eq!(edges.count_ones(), periods, "{edges:08b}");
    }
}

/// 7126, 7130: repeated protocol resets with some encoders. Whatever identifier, latency and delay, a sound encoder is
/// never restarted.
#[test]
fn no_restart_without_a_fault() {
    for dialect in DIALECTS {
        for id in [0x00153, 0x00133, 0x000d3, 0x1_0133, 0x0_f553, 0x0_0053] {
            for delay in [8, 13, 22, 40, 87] {
                let mut bench = Bench::new(dialect, id, Disturbance::default().with_delay(delay));
                bench.position = 1 << 15;
                bench.lock();
                bench.frames(2000);
                assert_eq!(bench.master.counters().restarts, 0);
                assert_eq!(bench.master.encoder_id(), EncoderId::new(id));
            }
        }
    }
}

/// 7480: continuous messages hang, also with a line that loses some.
#[test]
fn continuous_messages() {
    for bit_errors in [0, 100] {
        let mut bench = Bench::on_cable(Dialect::SICK, 10);
        bench.lock();
        bench.cable.disturbance.bit_errors = bit_errors;
        let (mut short, mut long, mut last) = (0, 0, 0);
        for frame in 0..60_000 {
            let _ = bench.master.start_short(ShortRequest::Read(RemoteRegister::PING));
            let _ = bench.master.start_long(resolution());
            let finished = bench.frame().finished;
            short += i32::from(finished.short.is_some_and(|r| r.is_ok()));
            if finished.long.is_some_and(|r| r.is_ok()) {
                long += 1;
                last = frame;
            }
            assert!(frame - last < 34_000);
        }
        assert!(short > 500 && long > 10, "{short} {long}");
    }
}

/// 5651: wrong multi-turn bits. A position of 40 bits is right in every bit.
#[test]
fn all_forty_bits() {
    // 11 + 29 bits
    for dialect in DIALECTS {
        let mut bench = Bench::new(dialect, 0x001d3, Disturbance::metres(0));
        bench.position = 0xa5_1234_5678;
        bench.speed = 1 << 9;
        bench.lock();
        bench.frames(100);
        assert!(bench.aligned());
        // The safe position of a V-frame that began some frames ago.
        let age = bench.position as u64 - bench.map.vpos();
        assert!(age <= 20 << 9 && age % (1 << 9) == 0);
    }
}

/// 5689: the fast position deviates at standstill.
#[test]
fn standstill() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 10);
        bench.lock();
        for _ in 0..100_000 {
            let _ = bench.frame();
            assert!(bench.aligned() && bench.map.vel() == Some(0));
        }
    }
}

/// 5538: long messages with several channels at once.
#[test]
fn several_links() {
    let mut benches: Vec<Bench> = (0..3).map(|k| Bench::on_cable(Dialect::TI, 30 * k)).collect();
    for bench in &mut benches {
        bench.lock();
        bench.master.start_long(resolution()).unwrap();
    }
    let mut done = [0; 3];
    for _ in 0..100 {
        for (bench, done) in benches.iter_mut().zip(&mut done) {
            if let Some(result) = bench.frame().finished.long {
                assert_eq!(result.unwrap().result.unwrap().as_bytes(), b"RESOLUTN");
                *done += 1;
            }
        }
    }
    assert_eq!(done, [1; 3]);
}

/// PIPE_D: every byte of the pipe channel, and a difference between the byte FEh and nothing.
#[test]
fn pipe_data() {
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.lock();
    assert_eq!(bench.map.get(Register::PipeD), [0xfe]);
    assert_eq!(bench.frame().pipe_character(), None);
    for byte in 0..=255 {
        bench.device.set_pipe(Some(byte));
        assert_eq!(bench.frame().pipe_character(), Some(Ok(Character::data(byte))));
        assert_eq!(bench.map.get(Register::PipeD), [byte]);
    }
    // The manual has a FIFO: eight bytes, the oldest go.
    let mut bench = Bench::on_cable(Dialect::SICK, 0);
    bench.lock();
    for byte in 0..10 {
        bench.device.set_pipe(Some(byte));
        let _ = bench.frame();
    }
    let mut read = || [bench.map.read(0x2d), bench.map.read(0x2e)].map(Option::unwrap);
    assert_eq!((read(), read()), ([0x08, 2], [0x00, 3]));
    for byte in 4..10 {
        assert_eq!(read(), [0x00, byte]);
    }
    assert_eq!(read(), [0x04, 0x00]);
}

/// 6487: the fixed bits of STATUS2 were lost.
#[test]
fn fixed_bits_of_status_2() {
    for dialect in DIALECTS {
        let mut bench = Bench::on_cable(dialect, 0);
        bench.lock();
        for _ in 0..100 {
            let _ = bench.frame();
            let [status] = bench.map.get(Register::Status2);
            assert_eq!(status & 0x1f, 0b1_1100);
        }
    }
}

/// 6489: offsets of the online status.
#[test]
fn addresses_of_the_online_status() {
    let bench = Bench::on_cable(Dialect::SICK, 0);
    let map = bench.map;
    let bytes: Vec<_> = (0x50..=0x55).map(|at| map.byte(at).unwrap()).collect();
    assert_eq!(bytes, [0x11, 0x04, 0x11, 0x04, 0x11, 0x04]);
    assert_eq!(Register::OnlineStatus1 as u8, 0x52);
    assert_eq!(Register::PosTx as u8, 0x4e);
}

/// 6492: the protocol reset does not work.
#[test]
fn protocol_reset() {
    for register in [Register::SysCtrl, Register::SafeCtrl] {
        let mut bench = Bench::on_cable(Dialect::TI, 0);
        bench.lock();
        let _ = bench.map.take_events();
        bench.write(register, 0x80);
        let report = bench.frame();
        assert_eq!(report.restarted, Some(RestartReason::Requested));
        let map = bench.map;
        assert_eq!((map.get(register), map.link()), ([0], false));
        assert!(map.event().contains(Event::PRST) && map.event_s().contains(EventS::PRST));
        assert_eq!(map.get::<2>(Register::OnlineStatusD), [0x11, 0x04]);
        bench.lock();
    }
}

/// The message reset: one INIT, messages dropped, MIN while the encoder answers INIT.
#[test]
fn message_reset() {
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.lock();
    bench.master.start_long(resolution()).unwrap();
    bench.frames(3);
    let _ = bench.map.take_events();
    bench.write(Register::SysCtrl, 0x40);
    let mut min = 0;
    for _ in 0..20 {
        let _ = bench.frame();
        min += i32::from(bench.map.online_d().contains(OnlineD::MIN));
    }
    assert_eq!(min, 1);
    assert!(bench.map.event().contains(Event::MIN) && bench.map.event_s().contains(EventS::MIN));
    bench.master.start_long(resolution()).unwrap();
    let answered = (0..100).any(|_| bench.frame().finished.long.is_some_and(|r| r.is_ok()));
    assert!(answered && bench.map.online_d().contains(OnlineD::FREL));
}

/// 7129: wrong stuffing during the search for the delay: four blocks and one for each further bit, 16 if in vain.
#[test]
fn stuffing_while_searching() {
    for (delay, stuffing) in [(1, 4), (2, 5), (8, 11), (11, 14)] {
        let mut bench = Bench::new(Dialect::TI, 0x00153, Disturbance::default().with_delay(8 * delay));
        bench.frames(18);
        for _ in 0..9 {
            assert_eq!(
                bench.frame().tail,
                Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::new(stuffing).unwrap() }
            );
        }
        assert_eq!(bench.frame().tail.stuffing.get(), 0);
    }
    let mut bench = Bench::on_cable(Dialect::TI, 0);
    bench.device.set_fault(Fault::Silent);
    bench.frames(18);
    assert_eq!(bench.frame().tail.stuffing.get(), 16);
}

/// 7163: four zeros instead of five in TRAILER. It takes eight bit times, the line idles in the first two.
#[test]
fn trailer() {
    let tail = Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::MIN };
    assert_eq!(tail.time(), 8);
    assert!(tail.bits().eq([false, false, false, false, true, true]));
    let whole = Tail { trailer: Trailer::Whole, stuffing: Stuffing::MIN };
    assert!(whole.bits().eq([false, false, false, false, false, false, true, true]));
}

/// 6629: the safe event SSUM was masked with MASK_SUM.
#[test]
fn summary_events_and_their_mask() {
    for (mask, masked_in) in [(0x00, false), (0x01, false), (0x04, true)] {
        let mut bench = Bench::on_cable(Dialect::TI, 0);
        bench.lock();
        let _ = bench.map.take_events();
        bench.write(Register::MaskSum, mask);
        bench.device.resources_mut().set_register(RemoteRegister::new(0x42).unwrap(), 0x10);
        bench.frames(20);
        let map = bench.map;
        assert_eq!(map.get(Register::SafeSum), [0x04]);
        assert!(
            map.event_s().contains(EventS::SSUM)
                && map.online_d().contains(OnlineD::SUM)
                && map.online_1().contains(Online1::SSUM)
        );
        assert_eq!(map.event().contains(Event::SUM), masked_in);
    }
}
