//! HIPERFACE DSL.

use hdsl::device::{Device, Heard};
use hdsl::frame::Head;
use hdsl::master::{Master, State};
use hdsl::message::{LongAnswer, LongRequest, ShortRequest};
use hdsl::registers::Registers;
use hdsl::sampling::{Alignment, EdgeRule, TEST_PATTERN, WINDOW};
use hdsl::symbol::{Character, Control, Rule, RunningDisparity, Word};
use hdsl::sync::{Es, Synchroniser};
use hdsl::{
    Answer, DeltaDelta, Dialect, EncoderId, Error, FastPosition, Policy, PositionBits, PositionRule, PositionTracker,
    Window,
};

#[path = "../../hdsl/tests/all/cable.rs"]
mod cable;

use crate::byte;
use cable::{Cable, Disturbance};

/// Eight bytes off the front.
fn word(data: &mut &[u8]) -> u64 {
    u64::from_le_bytes(core::array::from_fn(|_| byte(data)))
}

/// Words, two bytes each: the strict decoder against a search through all encodings.
pub fn symbol(mut data: &[u8]) {
    while !data.is_empty() {
        let word = Word::truncate(u16::from_le_bytes([byte(&mut data), byte(&mut data)]));
        let controls = Control::ALL.into_iter().map(Character::control);
        let found = (0..=255).map(Character::data).chain(controls).find(|character| {
            [RunningDisparity::Minus, RunningDisparity::Plus].iter().any(|rd| character.encode(*rd).word == word)
        });
        assert_eq!(word.decode(), found);
        let strict = word.read(Rule::Strict);
        assert_eq!(strict.byte().ok(), found.map(Character::byte));
        assert!(strict.is_byte_error() || strict.is_special() == found.is_some_and(Character::is_control));
    }
}

/// An answer: the kernel against bits taken one by one, and good words back onto the line.
pub fn answer(mut data: &[u8]) {
    let line = word(&mut data) >> 3;
    for rule in [Rule::Strict, Rule::Reduced] {
        let answer = Answer::from_bits(rule, line);
        for (at, reading) in [0, 10, 20, 30, 40, 51].into_iter().zip(answer.words()) {
            let bits = (0..10).fold(0, |word, k| word | ((line >> (at + k) & 1) as u16) << k);
            assert_eq!(reading.word(), Word::truncate(bits));
        }
        if let Ok(value) = answer.delta_delta() {
            let [high, low] = answer.acceleration_words().map(hdsl::symbol::Reading::raw);
            assert_eq!(value.to_word().to_be_bytes(), [high, low]);
        }
        if let Ok(id) = EncoderId::from_answer(answer) {
            assert_eq!(EncoderId::new(id.get()), Some(id));
        }
    }
}

/// The head of a frame: what is accepted has the fixed bits, and its parameter byte is one that a word stands for. As samples too.
pub fn head(mut data: &[u8]) {
    if let Some(heard) = Heard::on_line(data) {
        let end = u32::from(heard.start) + 8 * heard.bits.len();
        assert!((26..=35).contains(&heard.bits.len()));
        assert!(heard.start < heard.edge && u32::from(heard.edge) < end);
    }
    let bits = u128::from(word(&mut data)) | u128::from(word(&mut data)) << 64;
    let len = u32::from(byte(&mut data)) % 129;
    let Some(line) = Window::from_bits(bits, len) else { return };
    match Head::parse(line) {
        Ok(head) => {
            assert!(head.len == Head::BITS + head.extra_bits && head.len <= len && head.extra_bits <= 10);
            let text: String =
                (0..head.len - 14).map(|at| if line.get(at) == Some(true) { '1' } else { '0' }).collect();
            assert_eq!(text, format!("00101111{}0110", "1".repeat(head.extra_bits as usize)));
        }
        Err(Error::Truncated { got, want }) => assert!(u32::from(got) == len && got < want),
        Err(Error::Framing | Error::InvalidWord { .. }) => {}
        Err(error) => panic!("{error} is not an error of a head"),
    }
}

/// Messages of both directions: what is accepted would be sent again, the acknowledgement of a write aside.
pub fn message(data: &[u8]) {
    if let Ok(request) = ShortRequest::parse(data) {
        assert!(data.starts_with(request.emit().as_bytes()));
        if let Ok(answer) = request.parse_answer(data) {
            assert!(data.starts_with(answer.emit().as_bytes()));
        }
    }
    if let Ok(request) = LongRequest::parse(data) {
        assert!(data.starts_with(request.emit().as_bytes()));
        let _ = request.parse_answer(data);
    }
    if let Ok(answer) = LongAnswer::parse(data) {
        assert_eq!(LongAnswer::parse(answer.emit().as_bytes()), Ok(answer));
    }
}

/// Samples of the test pattern: a place that was learned gives the pattern.
pub fn learn(data: &[u8]) {
    for rule in [EdgeRule::Leading, EdgeRule::All] {
        match Alignment::learn(rule, data) {
            Ok(place) => {
                assert_eq!(place.bits(data), Ok(TEST_PATTERN));
                assert!(place.rssi(data).is_ok());
            }
            Err(Error::Truncated { got, want: 61 }) => assert!(usize::from(got) == data.len() && got < 61),
            Err(Error::NoEdge) => assert!(data.iter().all(|byte| *byte == 0xff)),
            Err(Error::PatternNotFound { index }) => assert!(index < 8),
            Err(error) => panic!("{error} is not an error of the search"),
        }
    }
}

/// Acceleration words and safe positions in any order: widths hold, as long as no estimate leaves 11 bits both register rules agree,
/// and a position is given only after three safe positions.
///
/// ```text
/// 0  width      then steps: 0 a safe position follows (8 bytes), 1 none, 2 no word, other: a word (2 bytes)
/// ```
pub fn position(mut data: &[u8]) {
    let Some(bits) = PositionBits::new(byte(&mut data)) else { return };
    // From 11 bits on an encoder can have them.
    let id = u32::from(bits.get()).checked_sub(11).and_then(|more| EncoderId::new(3 | more << 4));
    let mut fast = id.and_then(|id| FastPosition::new(id).ok());
    let mut safe_positions = 0;
    let mut tracker = PositionTracker::new(bits);
    let mut other = PositionTracker::with_rule(bits, PositionRule::Ti);
    // Of a position with fewer bits the vendor's receiver takes differences that are too large.
    let mut agree = bits == PositionBits::MAX;
    while !data.is_empty() {
        let before = tracker.registers().vel;
        match byte(&mut data) {
            0 => {
                let safe = word(&mut data) & bits.mask();
                tracker.align(safe);
                other.align(safe);
                if let Some(fast) = &mut fast {
                    fast.align(Some(safe));
                }
                safe_positions += 1;
            }
            1 => {
                tracker.no_safe_position();
                other.no_safe_position();
                if let Some(fast) = &mut fast {
                    fast.align(None);
                }
            }
            event => {
                let value = u16::from_le_bytes([byte(&mut data), byte(&mut data)]);
                let value = DeltaDelta::from_word(value).ok().filter(|_| event != 2);
                tracker.step(value);
                other.step(value);
                if let Some(fast) = &mut fast {
                    fast.step(value);
                }
                let change = tracker.registers().vel.wrapping_sub(before).wrapping_shl(8) >> 8;
                assert!((-1024..=1023).contains(&change), "{change}");
                agree &= value.is_some() || (-1023..=1022).contains(&change);
            }
        }
        let (shown, others) = (tracker.registers(), other.registers());
        assert!(shown.pos <= bits.mask() && (-(1 << 23)..1 << 23).contains(&shown.vel));
        if let Some(Ok(fast)) = fast.map(|fast| fast.evidence(0, 0).at(0, Policy::new(0))) {
            assert!(safe_positions > 2 && fast.bound() == 0 && fast.position().unsigned_abs() <= bits.mask());
        }
        assert!(!agree || (shown.pos, shown.vel) == (others.pos, others.vel));
    }
}

/// A receiver under any samples and any writes to its registers, in both dialects and both modes.
///
/// ```text
/// 0  dialect (bit 0), sync mode (bit 1)      then frames: 0 the pattern comes, 1 nothing comes, 2 register write
///                                                         (2 bytes), other: 72 bytes of samples follow
/// ```
pub fn master(mut data: &[u8]) {
    let options = byte(&mut data);
    let dialect = if options & 1 == 0 { Dialect::SICK } else { Dialect::TI };
    let mut master = match Synchroniser::new(1333, Es::ONE) {
        Ok(sync) if options & 2 != 0 => Master::synchronised(dialect, sync),
        _ => Master::new(dialect),
    };
    let mut map = Registers::new(&dialect);
    while !data.is_empty() {
        let samples = match byte(&mut data) {
            0 => hdsl::sampling::line(TEST_PATTERN, 11),
            1 => [0xff; WINDOW],
            2 => {
                let _ = map.write(&mut master, byte(&mut data), byte(&mut data));
                let _ = map.read(byte(&mut data));
                continue;
            }
            _ => core::array::from_fn(|_| byte(&mut data)),
        };
        if options & 2 != 0 {
            master.hear_pulse(i16::from(i8::from_le_bytes([samples[0]])));
        }
        let h_frame = *master.hear(&samples, 0).expect("there are enough samples");
        let _ = map.apply(&h_frame);
        let restarts = h_frame.restarted.is_some();
        assert_eq!(restarts, master.state() == State::Reset && master.frame() == 0);
        assert!(map.quality() <= 15 && map.link() == (master.state() > State::IdReq));
        assert!(Head::parse(master.transmission().head.bits()).is_ok());
    }
}

/// Both ends on a line that the input disturbs: whatever happens, a clean line brings the link up again.
///
/// ```text
/// 0  dialect (bit 0)      1  delay      2  jitter      3  bit errors      4  frames      then speeds, 2 bytes each
/// ```
pub fn link(mut data: &[u8]) {
    let dialect = if byte(&mut data) & 1 == 0 { Dialect::SICK } else { Dialect::TI };
    let clean = Disturbance::default().with_delay(u32::from(byte(&mut data)) % 84);
    let jitter = byte(&mut data) % 4;
    let bit_errors = u32::from(byte(&mut data)) * 100;
    let mut cable = Cable::new(clean.with_jitter(jitter).with_bit_errors(bit_errors), 7);
    let mut master = Master::new(dialect);
    let mut encoder = Device::new(EncoderId::new(0x00153).expect("20 bits"));
    let mut position = 1_u64 << 30;
    let noisy = u16::from(byte(&mut data)) * 4;
    for frame in 0..noisy + 700 {
        if frame == noisy {
            cable.disturbance = clean;
        }
        if frame < noisy && !data.is_empty() {
            // Small enough that no difference leaves the 11 bits.
            let speed = i16::from_le_bytes([byte(&mut data), byte(&mut data)]) >> 7;
            position = position.wrapping_add_signed(i64::from(speed));
        }
        let line = cable.down_samples(master.transmission().head);
        let samples = match Heard::on_line(&line) {
            Some(heard) => {
                let answer = encoder.set_position(position).hear(heard.bits);
                cable.up_heard(answer, &heard)
            }
            None => cable.up(encoder.set_position(position).hear(Window::EMPTY)),
        };
        let _ = master.hear(&samples, 0).expect("there are enough samples");
    }
    assert_eq!(master.state(), State::Running);
    let fast = master.fast().at(0, Policy::new(0)).expect("the clean line brings the position");
    assert_eq!(fast.position(), i64::from(position as u32));
}
