use super::*;
use crate::evidence::{Policy, Tolerated};
use proptest::prelude::*;

/// An encoder with positions of this width.
fn id(bits: u8) -> EncoderId {
    EncoderId::truncate(3 | (u32::from(bits) - 11) << 4)
}

/// What happens in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    Good,
    /// The acceleration word is missing.
    NoWord,
    /// If the V-frame ends here, it brings no safe position.
    NoBlock,
}

/// A shaft that moves within the speed that the width can tell, and what follows it.
struct Follow {
    fast: FastPosition,
    bits: u8,
    limit: i64,
    position: i64,
    velocity: i64,
    before: i64,
    frame: u32,
}

impl Follow {
    fn new(bits: u8, start: i64, speed: i64) -> Self {
        let limit = (1_i64 << (bits - 4)).min(1 << 30);
        let velocity = speed.rem_euclid(2 * limit) - limit;
        let fast = FastPosition::new(id(bits)).unwrap();
        Self { fast, bits, limit, position: start, velocity, before: start, frame: 0 }
    }

    fn truth(&self) -> (i64, i64) {
        (self.position.rem_euclid(1 << self.bits), self.velocity)
    }

    fn frame(&mut self, acceleration: i64, event: Event) -> Result<Sample, Doubt> {
        let next = (self.velocity + acceleration.clamp(-1024, 1023)).clamp(-self.limit, self.limit - 1);
        let value = DeltaDelta::new((next - self.velocity) as i16);
        self.velocity = next;
        self.position += next;
        self.fast.step(if event == Event::NoWord { None } else { value });
        self.frame += 1;
        if self.frame % 8 == 0 {
            let safe = self.before.rem_euclid(1 << self.bits).unsigned_abs();
            self.fast.align((event != Event::NoBlock).then_some(safe));
            self.before = self.position;
        }
        self.at(Tolerated::NOTHING)
    }

    fn at(&self, tolerated: Tolerated) -> Result<Sample, Doubt> {
        self.fast.evidence(self.frame, 0).at(0, Policy::new(0).tolerating(tolerated))
    }

    /// How far the position given is from the truth.
    fn error(&self, sample: Sample) -> u64 {
        self.fast.signed_of(sample.position() - self.truth().0).unsigned_abs()
    }
}

fn events() -> impl Strategy<Value = Event> {
    prop_oneof![1 => Just(Event::NoWord), 1 => Just(Event::NoBlock), 60 => Just(Event::Good)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 2 } else { 2000 }))]

    /// Words and safe positions are lost, small ranges pass often, the speed is anything that can be told: what is given is the
    /// truth, and over missing words it is within its bound.
    #[test]
    fn the_truth_or_within_the_bound(
        bits in 11..=40_u8, start in 0..1_i64 << 40, speed: i64, wild: bool,
        steps in prop::collection::vec((-1100..1100_i64, events()), 160)
    ) {
        let mut follow = Follow::new(bits, start, speed);
        for (acceleration, event) in steps {
            let acceleration = if wild { acceleration } else { acceleration / 40 };
            if let Ok(sample) = follow.frame(acceleration, event) {
                prop_assert_eq!((sample.position(), i64::from(sample.velocity())), follow.truth());
                prop_assert_eq!((sample.bound(), sample.frame()), (0, follow.frame));
            }
            if let Ok(sample) = follow.at(Tolerated::missing_words(200, if wild { 1024 } else { 28 })) {
                prop_assert!(follow.error(sample) <= sample.bound().into(), "{:?} {:?}", sample, follow.truth());
            }
        }
    }

    /// Whatever words are missing in 40 frames, the position is there 32 frames later; one alone costs 24 at most.
    #[test]
    fn it_comes_back(
        bits in 11..=40_u8, speed: i64, push in -3..=3_i64, lost in prop::collection::btree_set(40..80_u32, 1..20)
    ) {
        let mut follow = Follow::new(bits, 5, speed);
        let last = lost.last().copied().unwrap();
        for frame in 0..last + 60 {
            let event = if lost.contains(&frame) { Event::NoWord } else { Event::Good };
            let sample = follow.frame(push, event);
            prop_assert!(sample.is_ok() || frame < if lost.len() == 1 { last + 24 } else { last + 32 }, "{}", frame);
        }
    }
}

/// From the start on: three V-frames; over one missing word: by the place of the word in its V-frame.
#[test]
fn how_long_it_takes() {
    for bits in 11..=40 {
        for place in 0..8 {
            let mut follow = Follow::new(bits, 77, 3);
            let first = (1..99).find(|_| follow.frame(0, Event::Good).is_ok());
            assert_eq!(first, Some(24));
            for _ in 0..place {
                assert!(follow.frame(1, Event::Good).is_ok());
            }
            assert_eq!(follow.frame(1, Event::NoWord), Err(Doubt::Estimated));
            assert_eq!(follow.frame(1, Event::Good), Err(Doubt::Alignment));
            let first = (1..99).find(|_| follow.frame(0, Event::Good).is_ok()).unwrap();
            assert_eq!(first, 22 - place, "{bits}");
        }
    }
}

/// The bound of one missing word grows by what it can be off in each frame, until a safe position has told.
#[test]
fn the_bound_grows_frame_by_frame() {
    let mut follow = Follow::new(32, 0, 1 << 28);
    for _ in 0..24 {
        let _ = follow.frame(0, Event::Good);
    }
    let tolerated = Tolerated::missing_words(1, 10);
    let _ = follow.frame(10, Event::NoWord);
    let mut bounds = std::vec![follow.at(tolerated).unwrap().bound()];
    for _ in 0..15 {
        let _ = follow.frame(0, Event::Good);
        bounds.push(follow.at(tolerated).unwrap().bound());
    }
    assert_eq!(bounds, [10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130, 140, 150, 0]);
    // A second one, while one is tolerated.
    for event in [Event::NoWord, Event::NoWord] {
        let _ = follow.frame(0, event);
    }
    assert_eq!(follow.at(tolerated), Err(Doubt::Estimated));
    assert!(follow.at(Tolerated::missing_words(2, 10)).is_ok());
}

/// A wrong word that passed its checks: up to 16 frames, and then nothing until two safe positions more.
#[test]
fn a_wrong_word() {
    for place in 0..8 {
        let mut follow = Follow::new(24, 0, 1 << 20);
        for _ in 0..24 + place {
            let _ = follow.frame(0, Event::Good);
        }
        // It says 5 where there is nothing.
        follow.fast.velocity += 5;
        let mut given = 0;
        for frame in 0..40 {
            match follow.frame(0, Event::Good) {
                Ok(sample) if follow.error(sample) != 0 => given += 1,
                Ok(_) => assert!(frame >= 31 - place),
                Err(doubt) => assert_eq!((doubt, frame >= 15 - place), (Doubt::Alignment, true)),
            }
            let tolerated = follow.at(Tolerated::missing_words(9, 1024));
            assert_eq!(tolerated.is_ok(), follow.at(Tolerated::NOTHING).is_ok());
        }
        assert_eq!(given, 15 - place);
    }
}

/// Two wrong words whose errors of the position cancel at the end of their V-frame pass one comparison: 24 frames from the first.
#[test]
fn two_wrong_words_that_cancel() {
    let mut follow = Follow::new(24, 0, 1 << 20);
    for _ in 0..24 {
        let _ = follow.frame(0, Event::Good);
    }
    // 3 from frame 0 on count 8 frames, -4 from frame 2 on 6 frames.
    let mut given = 0;
    for frame in 0..40 {
        follow.fast.velocity += match frame {
            0 => 3,
            2 => -4,
            _ => 0,
        };
        if let Ok(sample) = follow.frame(0, Event::Good) {
            given += u32::from(follow.error(sample) != 0 || i64::from(sample.velocity()) != follow.velocity);
        }
    }
    // The last one is that in which it is found out.
    assert_eq!(given, 23);
}

/// Beyond a sixteenth of the range a frame nothing is given, whatever is tolerated.
#[test]
fn too_fast() {
    for bits in 11..=40 {
        let mut follow = Follow::new(bits, 0, 0);
        for _ in 0..24 {
            let _ = follow.frame(0, Event::Good);
        }
        // At the lower end, which is inside.
        assert!(follow.at(Tolerated::NOTHING).is_ok());
        follow.fast.step(DeltaDelta::new(-1));
        let tolerated = Tolerated::missing_words(9, 1024);
        assert_eq!((follow.at(Tolerated::NOTHING), follow.at(tolerated)), (Err(Doubt::Speed), Err(Doubt::Speed)));
        // The upper end is outside.
        let mut follow = Follow::new(bits, 0, -1);
        for _ in 0..24 {
            let _ = follow.frame(0, Event::Good);
        }
        assert!(follow.at(Tolerated::NOTHING).is_ok());
        follow.fast.step(DeltaDelta::new(1));
        assert_eq!(follow.at(Tolerated::NOTHING), Err(Doubt::Speed));
    }
}

/// A register map shows what may be used if both its position and its speed are those.
#[test]
fn what_a_register_map_shows() {
    let mut follow = Follow::new(24, 7, 1 << 20);
    for frame in 1..=30 {
        let _ = follow.frame(3, Event::Good);
        let (position, velocity) = (follow.truth().0.unsigned_abs(), follow.truth().1 as i32);
        let at = |position, velocity| follow.fast.is_at(position, velocity);
        assert_eq!(at(position, velocity), frame >= 24);
        assert!(!at(position ^ 1, velocity) && !at(position, velocity + 1));
        // Bits above the width do not count.
        assert_eq!(at(position | 1 << 24, velocity), frame >= 24);
    }
}

/// Frames that went by unheard: nothing until three safe positions.
#[test]
fn an_interruption() {
    let mut follow = Follow::new(30, 9, 1 << 26);
    for _ in 0..24 {
        let _ = follow.frame(0, Event::Good);
    }
    follow.fast.interrupt();
    let first = (0..99).find(|_| follow.frame(0, Event::Good).is_ok());
    assert_eq!(first, Some(23));
}

/// At a constant acceleration the estimate is exact, and it is never beyond the 11 bits of a real value.
#[test]
fn the_estimate() {
    for a in [-7, 0, 7] {
        let mut fast = FastPosition::new(id(40)).unwrap();
        for k in 1..100 {
            fast.step(if (20..30).contains(&k) { None } else { DeltaDelta::new(a) });
            assert_eq!(fast.velocity, i32::from(a) * k);
        }
    }
    let mut fast = FastPosition::new(id(40)).unwrap();
    for value in [-1024, 1023, -1024, 1023] {
        fast.step(DeltaDelta::new(value));
    }
    for _ in 0..20 {
        let before = fast.velocity;
        fast.step(None);
        assert!((-1024..=1023).contains(&(fast.velocity - before)));
    }
    // last 10, before it 4, 2, 1, 1, 1: 10 + (16 * 6 + 8 * 2 + 4 * 1) / 32, rounded down.
    let mut fast = FastPosition::new(id(40)).unwrap();
    for value in [1, 1, 1, 2, 4, 10] {
        fast.step(DeltaDelta::new(value));
    }
    let before = fast.velocity;
    fast.step(None);
    assert_eq!((fast.velocity - before, fast.missing_in_a_row()), (13, 1));
    fast.step(Some(DeltaDelta::ZERO));
    assert_eq!(fast.missing_in_a_row(), 0);
}

#[test]
fn encoders_that_it_cannot_follow() {
    assert!(FastPosition::new(EncoderId::truncate(0x00150)).is_err());
    assert!(FastPosition::new(EncoderId::truncate(0x001e3)).is_err());
}

/// Exact quotients and no others.
#[test]
fn divisions() {
    for frames in 1..=8 {
        for way in (-300..300).chain([(1 << 39) - 840, -(1 << 39), (1 << 40) / 840 * 840]) {
            let exact = (way % i64::from(frames) == 0).then(|| way / i64::from(frames));
            assert_eq!(divide(way, frames), exact, "{way} / {frames}");
        }
    }
    assert_eq!((divide(0, 0), divide(9, 9)), (None, None));
}

/// A wrong word in the first frame of a V-frame, by an eighth of the range: all safe positions agree with the speed that comes of it.
/// Nothing is given, and the position comes back.
#[test]
fn off_by_an_eighth_of_the_range() {
    for bits in 11..=26 {
        for eighths in [-1, 1, 3] {
            let mut follow = Follow::new(bits, 0, 1 << (bits - 4));
            for _ in 0..24 {
                let _ = follow.frame(0, Event::Good);
            }
            follow.fast.velocity += eighths << (bits - 3);
            for frame in 0..32 {
                let sample = follow.frame(0, Event::Good);
                assert_eq!(sample.is_ok(), frame >= 15, "{bits} {frame}");
                assert!(sample.is_err() || follow.error(sample.unwrap()) == 0);
            }
        }
    }
}

/// A V-frame without a safe position: what two of them have told stays told and wants another one that agrees; what one has told is
/// forgotten.
#[test]
fn a_v_frame_without_a_safe_position() {
    for bits in 11..=40 {
        // The first V-frame without one, and when the position comes.
        for (without, first) in [(0, 32), (1, 40), (2, 32), (9, 24)] {
            let mut follow = Follow::new(bits, 5, 1 << 29);
            let came = (0..80_u32).find(|frame| {
                let event = if frame / 8 == without { Event::NoBlock } else { Event::Good };
                follow.frame(0, event).is_ok()
            });
            assert_eq!(came, Some(first - 1), "{bits} {without}");
        }
    }
}

/// Two words are missing, and the next safe position tells where the shaft was eight frames ago: the bound is that of these eight.
#[test]
fn a_safe_position_makes_the_bound_smaller() {
    let mut follow = Follow::new(32, 0, 1 << 28);
    for frame in 0..48 {
        let _ = follow.frame(0, if matches!(frame, 32 | 33) { Event::NoWord } else { Event::Good });
        let sample = follow.at(Tolerated::missing_words(2, 10));
        // Each word counts from its own frame on.
        let frames = match frame {
            32 => 1,
            33..=46 => 2 * (frame - 33) + 3,
            47 => 16,
            _ => 0,
        };
        assert!(frame < 24 || sample.unwrap().bound() == 10 * frames, "{frame} {sample:?}");
    }
}
