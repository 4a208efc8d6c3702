//! What is set on a running receiver, and what it says of itself: every setter is seen in what comes out.

use hdsl::device::Device;
use hdsl::frame::Stuffing;
use hdsl::master::{HFrame, Master, RestartReason, State};
use hdsl::message::{RemoteRegister, ShortRequest};
use hdsl::sampling::line;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Dialect, EncoderId, Policy};

const ANY_AGE: Policy = Policy::new(u64::MAX);
/// A free-running frame.
const FRAME_NS: u64 = 11_520;

/// Both ends.
struct Ends {
    master: Master,
    device: Device,
    position: u64,
    now_ns: u64,
    /// Bits that are inverted in the next answer.
    damage: u64,
}

impl Ends {
    fn new(dialect: Dialect, sync: Option<Synchroniser>) -> Self {
        let master = sync.map_or_else(|| Master::new(dialect), |sync| Master::synchronised(dialect, sync));
        let device = Device::new(EncoderId::new(0x00153).unwrap());
        Self { master, device, position: 250, now_ns: 0, damage: 0 }
    }

    fn up(dialect: Dialect) -> Self {
        let mut ends = Self::new(dialect, None);
        ends.frames(61 + 64);
        assert_eq!((ends.master.state(), ends.master.h_frame().quality), (State::Running, 15));
        ends
    }

    fn answer(&mut self) -> u64 {
        let answer = self.device.set_position(self.position).hear(self.master.transmission().head.bits());
        answer.map_or(u64::MAX, |answer| answer.bits) ^ core::mem::take(&mut self.damage)
    }

    fn frame_after(&mut self, ns: u64) -> HFrame {
        self.now_ns += ns;
        let bits = self.answer();
        *self.master.hear_bits(bits, None, self.now_ns)
    }

    fn frame(&mut self) -> HFrame {
        self.frame_after(FRAME_NS)
    }

    fn frames(&mut self, count: u32) {
        (0..count).for_each(|_| _ = self.frame());
    }

    fn to(&mut self, place: u8) {
        while self.master.frame() != place {
            let _ = self.frame();
        }
    }
}

/// A quarter of a turn, and 250 ns of cable and encoder.
#[test]
fn the_angle_and_the_latency() {
    let mut ends = Ends::up(Dialect::SICK);
    let at = |ends: &Ends| {
        let sample = ends.master.fast().at(ends.now_ns, ANY_AGE).unwrap();
        (sample.angle().millidegrees(), sample.sampled_ns())
    };
    let (angle, sampled_ns) = at(&ends);
    assert_eq!(angle, 0);
    ends.master.set_steps_per_turn(1000);
    ends.master.set_latency_ns(250);
    assert_eq!(at(&ends), (90_000, sampled_ns + 250));
    ends.frames(1);
    assert_eq!(at(&ends), (90_000, sampled_ns + FRAME_NS + 250));
}

/// The receiver says that its frames are in step once four pulses came close to their edges.
#[test]
fn in_step() {
    let mut ends = Ends::new(Dialect::SICK, Some(Synchroniser::new(1500, Es::ONE).unwrap()));
    let mut steps = Vec::new();
    for late in [0, 0, 0, 0, 3, 20] {
        ends.master.hear_pulse(late);
        let _ = ends.frame();
        steps.push(ends.master.is_in_step());
    }
    assert_eq!(steps, [false, false, false, true, true, false]);
    assert!(!Master::new(Dialect::SICK).is_in_step());
}

/// Frames are put in step with a pulse while a restart waits: both happen.
#[test]
fn sync_mode_does_not_lose_a_restart() {
    let mut ends = Ends::up(Dialect::SICK);
    ends.master.set_pulse_period(1500);
    ends.master.request_restart();
    ends.master.set_frames_per_pulse(Some(Es::ONE)).unwrap();
    let report = ends.frame();
    assert_eq!(report.restarted, Some(RestartReason::Requested));
    assert!(ends.master.transmission().head.extra().is_some());
}

/// Nothing of the link that was lost is told of the start-up after it.
#[test]
fn a_restart_clears_what_a_frame_says() {
    let mut ends = Ends::up(Dialect::SICK);
    ends.device.set_pipe(Some(7));
    ends.master.reset_messages().unwrap();
    let report = (0..9).map(|_| ends.frame()).find(|report| report.init).unwrap();
    assert!(report.acceleration.is_some() && report.pipe.is_some() && report.quality == 15);
    ends.damage = 1 << 32 | 1 << 40;
    assert_eq!(ends.frame().acceleration_errors, 1);
    ends.master.request_restart();
    ends.damage = 1 << 32 | 1 << 40;
    for report in [ends.frame(), ends.frame()] {
        let told =
            (report.quality, report.acceleration, report.acceleration_errors, report.pipe.is_some(), report.init);
        assert_eq!(told, (8, None, 0, false, false), "{report:?}");
    }
}

/// MSYNC of the heads alternates from V-frame to V-frame, also where the end of one was not heard.
#[test]
fn msync_over_lost_frames() {
    for lost in [1, 8, 9, 17] {
        let mut ends = Ends::up(Dialect::SICK);
        ends.to(7);
        let (mut place, mut v_frame) = (7_u32, 0);
        let before = ends.master.transmission().head.byte().msync();
        for step in 0..40 {
            if step == 0 {
                // The heads of these frames are on the line all the same.
                for _ in 0..lost {
                    let _ = ends.answer();
                }
                ends.master.skip(lost);
                ends.now_ns += u64::from(lost) * FRAME_NS;
                place += u32::from(lost);
            }
            let _ = ends.frame();
            place += 1;
            (place, v_frame) = (place % 8, v_frame + place / 8);
            if step > 0 {
                let head = ends.master.transmission().head.byte();
                assert_eq!(head.msync(), before == (v_frame % 2 == 0), "{lost} {step}");
                assert_eq!(u32::from(ends.master.frame()), place);
            }
        }
    }
}

/// A frame is lost if the window ends more than half a frame late, to the nanosecond.
#[test]
fn half_a_frame_late() {
    for (late_ns, gap) in [(5_759, false), (5_760, false), (5_761, true)] {
        let mut ends = Ends::up(Dialect::SICK);
        let _ = ends.frame_after(FRAME_NS + late_ns);
        assert_eq!(ends.master.h_frame().gap, gap, "{late_ns}");
    }
}

/// In step with a pulse frames have other lengths: none is taken for lost, one that is lost is known.
#[test]
fn a_lost_frame_in_sync_mode() {
    // 20 us: 1,500 eighths of a bit.
    for (period, frame_ns) in [(900, 12_000), (1_500, 20_000), (2_100, 28_000)] {
        let mut ends = Ends::new(Dialect::SICK, Some(Synchroniser::new(period, Es::ONE).unwrap()));
        for _ in 0..120 {
            ends.master.hear_pulse(0);
            assert!(!ends.frame_after(frame_ns).gap);
        }
        assert_eq!(ends.master.state(), State::Running);
        let _ = ends.answer();
        ends.master.hear_pulse(0);
        assert!(ends.frame_after(2 * frame_ns).gap, "{period}");
    }
}

/// A quarter of an answer is looked at in each frame, another one each time: glitches in any of them are found within four frames,
/// from bytes and from words.
#[test]
fn every_quarter_is_looked_at() {
    for words in [false, true] {
        for quarter in 0..4 {
            let mut ends = Ends::new(Dialect::SICK, None);
            let mut low = 0;
            for frame in 0..140 {
                ends.now_ns += FRAME_NS;
                let bits = ends.answer();
                let mut samples = line(bits, 12);
                if frame >= 100 {
                    // Beside the sample that is taken; the edges are three samples further on.
                    for byte in samples.iter_mut().skip(4 + 16 * quarter).take(8) {
                        *byte ^= 0x40;
                    }
                }
                let report = if words {
                    let mut all = [0; 18];
                    for (to, from) in all.iter_mut().zip(samples.chunks_exact(4)) {
                        *to = u32::from_le_bytes([from[0], from[1], from[2], from[3]]);
                    }
                    *ends.master.hear_words(&all, ends.now_ns)
                } else {
                    *ends.master.hear(&samples, ends.now_ns).unwrap()
                };
                let rssi = report.signal.map_or(12, |signal| signal.rssi.get());
                if frame >= 100 {
                    low += u32::from(rssi == 6);
                }
            }
            assert!((10..=21).contains(&low), "{words} {quarter}: {low} of 40");
        }
    }
}

/// Frames were lost before the one that ends the link, and the next head is out: the restart comes after its frame.
#[test]
fn a_loss_behind_lost_frames_with_the_next_head_out() {
    let mut ends = Ends::up(Dialect::SICK);
    let _ = ends.master.ahead();
    ends.frames(3);
    ends.master.skip(1);
    ends.now_ns += FRAME_NS;
    let mut told = None;
    for _ in 0..200 {
        let next = ends.master.ahead();
        // Ten equal bits in every word: the link is lost within some frames.
        ends.now_ns += FRAME_NS;
        let report = *ends.master.hear_bits(0, None, ends.now_ns);
        assert!(told.is_none() || next.is_none());
        if report.restarted.is_some() {
            assert_eq!(report.restarted, Some(RestartReason::Quality));
            assert_eq!(ends.master.state(), State::Reset);
            return;
        }
        if ends.master.fast().at(ends.now_ns, ANY_AGE) == Err(hdsl::Doubt::NoLink) {
            told = Some(());
        }
    }
    panic!("the link is never lost");
}

/// Settings do not touch a message on its way.
#[test]
fn settings_leave_messages_alone() {
    let mut ends = Ends::up(Dialect::SICK);
    ends.master.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
    ends.master.set_stuffing(Stuffing::new(1).unwrap());
    let answer = (0..60).find_map(|_| ends.frame_after(FRAME_NS + 640).finished.short);
    assert_eq!(answer.map(|answer| answer.map(|answer| answer.data)), Some(Ok(Some(7))));
}
