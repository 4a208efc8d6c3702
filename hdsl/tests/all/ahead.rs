//! The next head leaves before the answer of the present frame is taken in.

use hdsl::device::Device;
use hdsl::master::{HFrame, Master, RestartReason, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::sync::Es;
use hdsl::{Dialect, Doubt, EncoderId, Error, MasterSymbol, Policy, Sample};

/// A free-running frame.
const FRAME_NS: u64 = 11_520;

/// Both ends; heads leave early where they can.
struct Early {
    master: Master,
    device: Device,
    position: i64,
    /// Bits that are inverted in the answers.
    damage: u64,
    sampled_ns: u64,
    /// Frames whose head left early.
    heads: u32,
}

impl Early {
    fn new(dialect: Dialect) -> Self {
        let device = Device::new(EncoderId::new(0x00153).unwrap());
        Self { master: Master::new(dialect), device, position: 1 << 20, damage: 0, sampled_ns: 0, heads: 0 }
    }

    fn frame(&mut self) -> HFrame {
        self.position += 321;
        let head = self.master.transmission().head;
        let bits =
            self.device.set_position(self.position as u64).hear(head.bits()).map_or(u64::MAX, |answer| answer.bits);
        let next = self.master.ahead();
        assert_eq!(self.master.ahead(), next);
        self.sampled_ns += FRAME_NS;
        let report = *self.master.hear_bits(bits ^ self.damage, None, self.sampled_ns + 9_707);
        if let Some(next) = next {
            self.heads += 1;
            assert_eq!(self.master.transmission(), next);
        }
        report
    }

    fn fast(&self) -> Result<Sample, Doubt> {
        self.master.fast().at(self.sampled_ns, Policy::new(0))
    }

    fn lock(dialect: Dialect) -> Self {
        let mut both = Self::new(dialect);
        for _ in 0..150 {
            let _ = both.frame();
        }
        assert_eq!(both.master.state(), State::Running);
        both
    }
}

/// The same heads as without, frame by frame: symbol, FIRST, MSYNC and balance.
#[test]
fn the_heads_are_the_same() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut both = Early::new(dialect);
        let (mut plain, mut device) = (both.master, both.device);
        for _ in 0..300 {
            assert_eq!(both.master.transmission(), plain.transmission());
            let report = both.frame();
            let bits = device
                .set_position(both.position as u64)
                .hear(plain.transmission().head.bits())
                .map_or(u64::MAX, |answer| answer.bits);
            assert_eq!(report, *plain.hear_bits(bits, None, both.sampled_ns + 9_707));
        }
        // All of RX0..RX7, from the lock on.
        assert_eq!(both.heads, 300 - 61);
    }
}

/// Messages go on, and the position is exact in every frame.
#[test]
fn messages_and_positions() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut both = Early::lock(dialect);
        both.device.resources_mut().set_register(RemoteRegister::PING, 0x5a);
        for _ in 0..20 {
            both.master.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
            both.master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
            let (mut short, mut long) = (None, None);
            for _ in 0..80 {
                let report = both.frame();
                short = short.or(report.finished.short);
                long = long.or(report.finished.long);
                assert_eq!(both.fast().map(|fast| (fast.position(), fast.velocity())), Ok((both.position, 321)));
                let safe = both.master.safe().at(both.sampled_ns, Policy::new(15 * FRAME_NS)).unwrap();
                let age = (both.sampled_ns - safe.sampled_ns()) / FRAME_NS;
                assert_eq!(safe.position(), both.position - 321 * age as i64);
            }
            assert_eq!(short.unwrap().unwrap().data, Some(0x5a));
            assert_eq!(long.unwrap().unwrap().result.unwrap().as_bytes(), b"RESOLUTN");
        }
        assert_eq!(both.master.counters().restarts, 0);
    }
}

/// The link is lost: nothing is given from then on; the frame that is out is sent to its end, and then the start-up begins.
#[test]
fn a_loss_while_the_next_frame_is_out() {
    let mut both = Early::lock(Dialect::SICK);
    both.damage = u64::MAX >> 3;
    let lost = (0..20).find(|_| both.frame().quality == 0);
    assert!(lost.is_some());
    // The head of this frame had left.
    let present = both.master.transmission();
    assert_eq!((present.head.byte().symbol(), present.lead_in), (Ok(MasterSymbol::Idle), 0));
    assert_eq!((both.master.state(), both.master.h_frame().restarted), (State::Running, None));
    let safe = both.master.safe().at(both.sampled_ns, Policy::new(u64::MAX)).err();
    assert_eq!((both.fast().err(), safe), (Some(Doubt::NoLink), Some(Doubt::NoLink)));
    assert_eq!(both.master.start_short(ShortRequest::Read(RemoteRegister::PING)), Err(Error::NotLocked));
    assert_eq!((both.master.ahead(), both.master.counters().restarts), (None, 0));
    // A good answer changes nothing.
    both.damage = 0;
    let report = both.frame();
    assert_eq!((report.restarted, both.master.state()), (Some(RestartReason::Quality), State::Reset));
    let present = both.master.transmission();
    assert_eq!((present.head.byte().symbol(), present.lead_in), (Ok(MasterSymbol::Reset), 16));
    assert_eq!(both.master.counters().restarts, 1);
    for _ in 0..150 {
        let _ = both.frame();
    }
    assert_eq!(both.fast().map(|fast| fast.position()), Ok(both.position));
    assert_eq!(both.master.counters().restarts, 1);
}

/// A restart that is asked for comes after the frame that is out; without one it comes at once.
#[test]
fn a_restart_while_the_next_frame_is_out() {
    for out in [true, false] {
        let mut both = Early::lock(Dialect::SICK);
        assert!(both.master.ahead().is_some());
        let _ = both.master.hear_bits(u64::MAX, None, 0);
        if out {
            let _ = both.master.ahead();
        }
        both.master.request_restart();
        assert_eq!(both.master.ahead().is_some(), out);
        let first = both.master.hear_bits(0, None, 0).restarted;
        assert_eq!(first, (!out).then_some(RestartReason::Requested));
        if out {
            let second = both.master.hear_bits(0, None, 0).restarted;
            assert_eq!(second, Some(RestartReason::Requested));
        }
        assert_eq!((both.master.state(), both.master.counters().restarts), (State::Reset, 1));
    }
}

/// Both at once: the frame that is out goes before the restart, and the gap is told.
#[test]
fn a_restart_and_lost_frames_while_the_next_frame_is_out() {
    let mut both = Early::lock(Dialect::SICK);
    assert!(both.master.ahead().is_some());
    both.master.skip(1);
    both.master.request_restart();
    let mut hear = || {
        let answer = both.device.set_position(1 << 20).hear(both.master.transmission().head.bits());
        *both.master.hear_bits(answer.map_or(u64::MAX, |answer| answer.bits), None, both.sampled_ns)
    };
    let first = hear();
    assert_eq!((first.gap, first.restarted), (true, None));
    let second = hear();
    assert_eq!((second.gap, second.restarted), (false, Some(RestartReason::Requested)));
}

/// In sync mode the window of the next head depends on the pulse: nothing leaves early.
#[test]
fn not_in_sync_mode() {
    let mut both = Early::lock(Dialect::SICK);
    both.master.set_pulse_period(4687);
    both.master.set_frames_per_pulse(Es::new(4)).unwrap();
    assert_eq!(both.master.ahead(), None);
    let _ = both.frame();
    assert!(both.master.transmission().head.extra().is_some() && both.master.ahead().is_none());
    both.master.set_frames_per_pulse(None).unwrap();
    let _ = both.frame();
    assert!(both.master.transmission().head.extra().is_none() && both.master.ahead().is_some());
}

/// Neither frames that were lost nor other stuffing make the next head wait.
#[test]
fn not_held_up() {
    let mut both = Early::lock(Dialect::SICK);
    both.master.skip(3);
    assert!(both.master.ahead().is_some());
    let gaps = [(); 3].map(|()| both.frame().gap);
    assert_eq!(gaps, [true, false, false]);
    both.master.set_stuffing(hdsl::frame::Stuffing::MAX);
    assert!(both.master.ahead().is_some());
    assert_eq!(both.frame().tail.stuffing, hdsl::frame::Stuffing::MAX);
    both.master.request_restart();
    assert!(both.master.ahead().is_none());
}
