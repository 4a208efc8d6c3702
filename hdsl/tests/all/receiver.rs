//! What the receiver reports beside positions: places, counters, causes, quality; each against a number of the documents.

use hdsl::device::{Device, Fault};
use hdsl::frame::Trailer;
use hdsl::master::{Master, RestartReason, SignalQuality, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::rssi::Rssi;
use hdsl::sampling::{Delay, TEST_PATTERN, line};
use hdsl::sync::Es;
use hdsl::{Dialect, Doubt, EncoderId, Error, Policy};

/// Both ends without a line between them.
struct Pair {
    master: Master,
    device: Device,
}

impl Pair {
    fn new(dialect: Dialect) -> Self {
        Self { master: Master::new(dialect), device: Device::new(EncoderId::new(0x00153).unwrap()) }
    }

    fn running(dialect: Dialect) -> Self {
        let mut pair = Self::new(dialect);
        for _ in 0..61 + 40 {
            pair.frame(0, None);
        }
        assert_eq!((pair.master.state(), pair.master.h_frame().quality), (State::Running, 15));
        pair
    }

    /// An H-frame with these bits of the answer inverted.
    fn frame(&mut self, damage: u64, signal: Option<SignalQuality>) {
        let answer = self.device.set_position(1000).hear(self.master.transmission().head.bits());
        let _ = self.master.hear_bits(answer.map_or(u64::MAX, |answer| answer.bits ^ damage), signal, 0);
    }

    /// Up to place `at` of a V-frame.
    fn to(&mut self, at: u8) {
        while self.master.frame() != at {
            self.frame(0, None);
        }
    }
}

/// The frames of the start-up: 2 RESET, 16 SYNC, 9 START, 9 LEARN, 16 CHECK, 1 IDREQ, then INIT up to VSYNC, then RX0 to RX7.
#[test]
fn places_of_the_start_up() {
    let mut pair = Pair::new(Dialect::SICK);
    for (state, frames) in [
        (State::Reset, 2),
        (State::Sync, 16),
        (State::Start, 9),
        (State::Learn, 9),
        (State::Check, 16),
        (State::IdReq, 1),
        (State::WaitVsync, 8),
        (State::Running, 8),
    ] {
        for frame in 0..frames {
            assert_eq!((pair.master.state(), pair.master.frame()), (state, frame));
            assert!(!pair.master.h_frame().long_free && !pair.master.h_frame().short_free || state == State::Running);
            pair.frame(0, None);
        }
        let known = matches!(state, State::WaitVsync | State::Running);
        assert_eq!(state.frames(), (!known).then_some(frames));
    }
    assert_eq!(pair.master.frame(), 0);
    assert!(pair.master.h_frame().long_free && pair.master.h_frame().short_free);
}

/// A front end that finds the bits itself: silence is no edge, other bits are no pattern; a wrong bit in LEARN or CHECK begins
/// anew, and one in the identifier is a difference of its copies or a word in no table.
#[test]
fn causes_in_the_start_up() {
    for (frames, damage, want) in [
        (18, 1 << 60, RestartReason::Learn(Error::Pattern)),
        (18, TEST_PATTERN ^ u64::MAX >> 3, RestartReason::Learn(Error::NoEdge)),
        (18 + 9, 1, RestartReason::Pattern),
        (18 + 18, 1, RestartReason::Pattern),
        (18 + 33, 1 << 60, RestartReason::Pattern),
    ] {
        let mut pair = Pair::new(Dialect::SICK);
        for _ in 0..frames {
            pair.frame(0, None);
        }
        pair.frame(damage, None);
        let report = pair.master.h_frame();
        assert_eq!((report.restarted, report.state, pair.master.counters().restarts), (Some(want), State::Reset, 1));
    }
    // 53h is D19.2; with its first six bits inverted it is D12.2, 4Ch. Ten zeros are no word.
    for (damage, zeros, want) in [
        (0b11_1111, 0, Error::EncoderIdMismatch { first: 0x0014c, second: 0x00153 }),
        (0, 0x3ff, Error::InvalidWord { word: 0 }),
    ] {
        let mut pair = Pair::new(Dialect::SICK);
        for _ in 0..52 {
            pair.frame(0, None);
        }
        let bits = pair.device.set_position(1000).hear(pair.master.transmission().head.bits()).unwrap().bits;
        let _ = pair.master.hear_bits((bits ^ damage) & !zeros, None, 0);
        assert_eq!(pair.master.h_frame().restarted, Some(RestartReason::Identifier(want)));
        assert_eq!(pair.master.encoder_id(), None);
    }
}

/// The three bits above those of an answer are not looked at.
#[test]
fn sixty_one_bits() {
    let mut pair = Pair::running(Dialect::SICK);
    for _ in 0..20 {
        pair.frame(7 << 61, None);
    }
    assert_eq!((pair.master.counters().words, pair.master.h_frame().quality), (0, 15));
}

/// RSSI below 2 costs 4 a frame by the manual, nothing in the SDK (table 21; HDSL firmware).
#[test]
fn weak_signals() {
    let signal = |rssi| Some(SignalQuality { rssi: Rssi::new(rssi).unwrap(), delay: Delay::new(1).unwrap(), edges: 0 });
    for (dialect, rssi, want) in [
        (Dialect::SICK, 0, 11),
        (Dialect::SICK, 1, 11),
        (Dialect::SICK, 2, 15),
        (Dialect::SICK, 12, 15),
        (Dialect::TI, 0, 15),
    ] {
        let mut pair = Pair::running(dialect);
        pair.to(3);
        pair.frame(0, signal(rssi));
        assert_eq!(pair.master.h_frame().quality, want, "{rssi}");
        assert_eq!(pair.master.h_frame().signal, signal(rssi));
    }
}

/// The SDK's firmware looks at TEST2 only where channel 1 is good.
#[test]
fn test_2_beside_a_bad_channel_1() {
    let quality = |damage: u64, fault: Fault| {
        let mut pair = Pair::running(Dialect::TI);
        pair.to(7);
        pair.device.set_fault(fault);
        pair.frame(0, None);
        pair.frame(damage, None);
        pair.to(6);
        pair.device.set_fault(Fault::None);
        pair.frame(0, None);
        pair.frame(0, None);
        pair.frame(0, None);
        pair.master.h_frame().quality
    };
    assert!(quality(0, Fault::Test2) < quality(0, Fault::None));
    // The first bit of the vertical word.
    assert_eq!(quality(1 << 60, Fault::Test2), quality(1 << 60, Fault::None));
}

/// Each kind of damage has its counter, and counts once.
#[test]
fn counters() {
    let mut pair = Pair::running(Dialect::SICK);
    let start = pair.master.counters();
    assert_eq!((start.frames, start.restarts, start.words, start.switch_bits), (101, 0, 0, 0));
    assert_eq!((start.safe1, start.safe2, start.acceleration), (0, 0, 0));
    pair.to(3);
    // The switch bit is the 51st.
    pair.frame(1 << 50, None);
    assert_eq!(pair.master.counters().switch_bits, 1);
    assert_eq!((pair.master.counters().words, pair.master.h_frame().quality), (0, 15));
    // IDLE, D16.0, with its first six bits inverted is in no table.
    pair.frame(0b11_1111 << 10, None);
    assert_eq!((pair.master.counters().words, pair.master.h_frame().quality), (1, 14));
    let counters = pair.master.counters();
    assert_eq!((counters.safe1, counters.safe2, counters.acceleration, counters.switch_bits), (0, 0, 0, 1));
    for (channel, want) in [(0, (1, 0)), (51, (0, 1))] {
        let mut pair = Pair::running(Dialect::SICK);
        pair.to(2);
        // Zeros in both channels: ten equal bits.
        let bits = pair.device.set_position(1000).hear(pair.master.transmission().head.bits()).unwrap().bits
            & !(0x3ff << channel);
        let _ = pair.master.hear_bits(bits, None, 0);
        pair.to(0);
        let counters = pair.master.counters();
        assert_eq!((counters.words, (counters.safe1, counters.safe2)), (1, want), "{channel}");
    }
}

/// The link is lost with messages under way: both end, the report says in which state, what was measured stays.
#[test]
fn a_loss_ends_the_messages() {
    let mut pair = Pair::running(Dialect::SICK);
    pair.master.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap();
    pair.master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap();
    let signal = Some(SignalQuality { rssi: Rssi::MAX, delay: Delay::new(3).unwrap(), edges: 0x18 });
    for _ in 0..10 {
        let _ = pair.device.set_position(1000).hear(pair.master.transmission().head.bits());
        let _ = pair.master.hear_bits(0, signal, 0);
        if pair.master.h_frame().restarted.is_some() {
            break;
        }
        assert_eq!(pair.master.h_frame().finished, hdsl::message::Finished::default());
    }
    let report = pair.master.h_frame();
    assert_eq!(
        (report.restarted, report.was, report.state),
        (Some(RestartReason::Quality), State::Running, State::Reset)
    );
    assert_eq!((report.finished.short, report.finished.long), (Some(Err(Error::Dropped)), Some(Err(Error::Dropped))));
    assert_eq!((report.signal, report.long_free, report.short_free), (signal, false, false));
    assert_eq!((pair.master.state(), pair.master.encoder_id()), (State::Reset, None));
    let refused = pair.master.start_short(ShortRequest::Read(RemoteRegister::PING));
    assert_eq!(refused, Err(Error::NotLocked));
    // The next link has none of it.
    for _ in 0..101 {
        pair.frame(0, None);
    }
    assert!(pair.master.h_frame().long_free && pair.master.h_frame().finished.long.is_none());
}

/// Messages only after the first whole V-frame (HDSL firmware, flag of the normal flow).
#[test]
fn messages_wait_for_a_v_frame() {
    let mut pair = Pair::new(Dialect::SICK);
    for frame in 0..80 {
        let result = pair.master.start_short(ShortRequest::Read(RemoteRegister::PING));
        let want = if frame < 61 + 8 { Err(Error::NotLocked) } else { Ok(()) };
        assert_eq!(result, want, "{frame}");
        // A safe position neither.
        let doubt = [Doubt::NoLink, Doubt::NoVFrame][usize::from(frame >= 61)];
        assert_eq!(pair.master.safe().at(0, Policy::new(u64::MAX)).err(), (frame < 61 + 8).then_some(doubt), "{frame}");
        if result.is_ok() {
            let dropped = pair.master.reset_messages().unwrap();
            assert_eq!(dropped.short, Some(Err(Error::Dropped)));
        } else {
            assert_eq!(pair.master.start_long(LongRequest::read_name(ResourceAddress::DIR)), Err(Error::NotLocked));
            assert_eq!(pair.master.reset_messages(), Err(Error::NotLocked));
        }
        pair.frame(0, None);
    }
}

/// EDGES collects the edges of LEARN and CHECK frames, bit n for sample period n, and stays; samples as bytes.
#[test]
fn edges_of_the_start_up() {
    let mut pair = Pair::new(Dialect::SICK);
    for frame in 0..120 {
        let answer = pair.device.set_position(1000).hear(pair.master.transmission().head.bits());
        // Eleven eighths of delay: edges before sample 3. In two CHECK frames and while the link runs they are a sample later.
        let late = [40, 41].contains(&frame) || frame > 90;
        let samples = answer.map_or([0xff; 72], |answer| line(answer.bits, if late { 12 } else { 11 }));
        let report = pair.master.hear(&samples, 0).unwrap();
        let want = match frame {
            ..27 => None,
            27..40 => Some(0x08),
            _ => Some(0x18),
        };
        assert_eq!(report.signal.map(|signal| signal.edges), want, "{frame}");
    }
    assert_eq!(pair.master.state(), State::Running);
    // Eleven eighths and half a bit: sample 7 of the next bit but one (E = 4 + 3 ones).
    let alignment = pair.master.alignment().unwrap();
    assert_eq!((alignment.index.get(), alignment.delay.get()), (7, 1));
}

/// A glitch in one bit of every answer of the start-up is seen in one frame of four, whichever bit it is: each frame examines another
/// quarter.
#[test]
fn the_signal_of_the_start_up() {
    for bit in [2, 20, 40, 55] {
        let mut pair = Pair::new(Dialect::SICK);
        let mut low = 0;
        for frame in 0..52 {
            let answer = pair.device.set_position(1000).hear(pair.master.transmission().head.bits());
            let mut samples = answer.map_or([0xff; 72], |answer| line(answer.bits, 0));
            // From CHECK on, away from the sample that is taken.
            if frame >= 36 {
                samples[bit] ^= 0x42;
            }
            let report = pair.master.hear(&samples, 0).unwrap();
            low += u32::from(report.signal.is_some_and(|signal| signal.rssi < Rssi::MAX));
        }
        assert_eq!((pair.master.state(), low), (State::IdReq, 4), "{bit}");
    }
}

/// Samples of a frame without an answer are not looked at, also when a link was there before.
#[test]
fn frames_without_an_answer() {
    for words in [false, true] {
        let mut pair = Pair::new(Dialect::SICK);
        for _ in 0..19 {
            let answer = pair.device.set_position(1000).hear(pair.master.transmission().head.bits());
            let _ = pair.master.hear(&answer.map_or([0xff; 72], |answer| line(answer.bits, 11)), 0).unwrap();
        }
        pair.master.request_restart();
        let _ = pair.master.hear(&line(TEST_PATTERN, 11), 0).unwrap();
        assert!(pair.master.alignment().is_some() && pair.master.state() == State::Reset);
        for frame in 0..18 {
            let report =
                if words { pair.master.hear_words(&[0; 18], 0) } else { pair.master.hear(&[0; 72], 0).unwrap() };
            assert_eq!((report.signal, report.restarted), (None, None), "{frame}");
        }
        assert_eq!(pair.master.state(), State::Start);
    }
}

/// What is sent when a LEARN frame has failed is the TRAILER without its first bits; otherwise it follows the answer, or a frame
/// without an answer as a whole.
#[test]
fn trailers() {
    for (good, want) in
        [(20, Trailer::AfterAnswer), (27, Trailer::Cut), (36, Trailer::AfterAnswer), (90, Trailer::AfterAnswer)]
    {
        let mut pair = Pair::new(Dialect::SICK);
        for frame in 0..good {
            pair.frame(0, None);
            let whole = frame < 18;
            assert_eq!(pair.master.h_frame().tail.trailer == Trailer::Whole, whole, "{frame}");
        }
        pair.frame(1, None);
        assert_eq!(pair.master.h_frame().tail.trailer, want, "{good}");
    }
}

/// Messages pass in sync mode too.
#[test]
fn a_message_in_sync_mode() {
    let mut pair = Pair::running(Dialect::SICK);
    pair.master.set_pulse_period(4687);
    pair.master.set_frames_per_pulse(Es::new(5)).unwrap();
    for _ in 0..20 {
        pair.frame(0, None);
    }
    pair.master.start_short(ShortRequest::Read(RemoteRegister::SRSSI)).unwrap();
    let mut data = None;
    for _ in 0..40 {
        assert!(pair.master.transmission().head.extra().is_some());
        pair.frame(0, None);
        data = data.or(pair.master.h_frame().finished.short);
    }
    assert_eq!(data.unwrap().unwrap().data, Some(7));
}

/// The pipe channel: a byte, the byte FEh, no data (K30.7), a word in no table.
#[test]
fn pipe_words() {
    let mut pair = Pair::running(Dialect::SICK);
    for byte in [Some(0x42), Some(0xfe), None] {
        pair.device.set_pipe(byte);
        pair.frame(0, None);
        let got = pair.master.h_frame().pipe_character().map(|character| character.unwrap().byte());
        assert_eq!(got, byte);
    }
    let bits =
        pair.device.set_position(1000).hear(pair.master.transmission().head.bits()).unwrap().bits & !(0x3ff << 20);
    let report = pair.master.hear_bits(bits, None, 0);
    assert_eq!(report.pipe_character(), Some(Err(Error::InvalidWord { word: 0 })));
}

/// 7C AB F6, the high nibble of each byte first.
#[test]
fn nibbles_in_the_order_sent() {
    let bytes = ShortRequest::Read(RemoteRegister::SRSSI).emit();
    let nibbles = [0, 1, 2, 3, 4, 5, 6, 7].map(|at| bytes.nibble(at).map(hdsl::Nibble::get));
    let want = [Some(0x7), Some(0xc), Some(0xa), Some(0xb), Some(0xf), Some(0x6), None, None];
    assert_eq!(nibbles, want);
}
