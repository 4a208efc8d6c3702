//! HIPERFACE DSL: symbols, answers, checks, position, messages, sync, and both machines.

use hdsl::device::Device;
use hdsl::frame::{Extra, Head, ParsedHead};
use hdsl::master::{Counters, Master};
use hdsl::message::{Access, Data, Length, LongRequest, RemoteRegister, ResourceAddress, ShortAnswer, ShortRequest};
use hdsl::registers::Registers;
use hdsl::sampling::{Alignment, Delay, EdgeRule, SampleIndex, SampledAnswer, TEST_PATTERN, WINDOW};
use hdsl::symbol::{Character, DisparityCheck, DisparityStatus, Encoded, Reading, RunningDisparity, Word};
use hdsl::sync::{Es, Next, Synchroniser};
use hdsl::{
    Answer, Content, DeltaDelta, Dialect, EncodedAnswer, EncoderByte, EncoderId, EncoderSymbol, Error, LineDisparity,
    MasterSymbol, ParameterByte, PositionBits, PositionRule, PositionTracker, QualityEvent, QualityMonitor,
    QualityRule, Rule, VFrame, crc16,
};

use super::hdsl_cable::{Cable, Disturbance};
use super::kernels;
use crate::self_test::hdsl::{ANSWERS, WORDS};

/// Words of the code and others.
const SYMBOLS: [u64; 8] = {
    let mut words = [0; 8];
    let mut at = 0;
    while at < 8 {
        words[at] = WORDS[at * 117].word;
        at += 1;
    }
    words
};

/// Undamaged answers.
const LINES: [u64; 8] = {
    let mut lines = [0; 8];
    let mut at = 0;
    while at < 8 {
        lines[at] = ANSWERS[at].bits;
        at += 1;
    }
    lines
};

/// Two groups of answers for a V-frame.
const GROUPS: [[u64; 8]; 2] = [LINES, [LINES[3]; 8]];

/// Message bytes: 32 of them.
const BLOCKS: [[u8; 32]; 2] = [[0xa5; 32], *b"ROOT RESOLUTN EESIZE UWARNING   "];

/// The samples of an answer after a delay, in eighths.
const fn samples(bits: u64, delay: usize) -> [u8; WINDOW] {
    let mut all = [0xff; WINDOW];
    let mut at = 0;
    while at < WINDOW * 8 {
        if at >= delay && (at - delay) / 8 < 61 && bits >> ((at - delay) / 8) & 1 == 0 {
            all[at / 8] &= !(0x80 >> (at % 8));
        }
        at += 1;
    }
    all
}

const PATTERNS: [[u8; WINDOW]; 3] = [samples(TEST_PATTERN, 5), samples(TEST_PATTERN, 42), samples(LINES[0], 20)];

/// The same with the place that is learned for their delays.
const PLACED: [(Alignment, [u8; WINDOW]); 3] =
    [(PLACES[0], PATTERNS[0]), (PLACES[1], PATTERNS[1]), (PLACES[2], PATTERNS[2])];

const PLACED_WORDS: [(Alignment, [u32; WINDOW / 4]); 3] =
    [(PLACES[0], words(&PATTERNS[0])), (PLACES[1], words(&PATTERNS[1])), (PLACES[2], words(&PATTERNS[2]))];

/// Four samples a word, the first in the low bits.
const fn words(samples: &[u8; WINDOW]) -> [u32; WINDOW / 4] {
    let mut all = [0; WINDOW / 4];
    let mut at = 0;
    while at < WINDOW {
        all[at / 4] |= (samples[at] as u32) << (8 * (at % 4));
        at += 1;
    }
    all
}

/// Where to sample after a delay in eighths.
const fn place(delay: u8) -> Alignment {
    let bits = match Delay::new((delay + 4) / 8) {
        Some(bits) => bits,
        None => Delay::MIN,
    };
    Alignment { index: SampleIndex::truncate(delay + 4), delay: bits }
}

const PLACES: [Alignment; 3] = [place(5), place(42), place(20)];

/// Values of the acceleration channel, present or not.
const ACCELERATIONS: [[Option<i16>; 4]; 2] =
    [[Some(0), Some(-5), Some(1023), Some(7)], [Some(300), None, None, Some(-1024)]];

/// Parameter byte, EXTRA edge, line disparity.
const HEADS: [(u8, u8, i8); 4] = [(0xd0, 0, 0), (0x1f, 0, -2), (0x90, 40, 5), (0x8c, 71, 9)];

const PERIODS: [(u32, u8); 4] = [(900, 1), (1500, 2), (20_000, 10), (5, 1)];

/// Frames from the start of a link.
const LINKS: [u32; 1] = [30];

fn es_of(es: u8) -> Result<Es, Error> {
    Es::new(es).ok_or(Error::NoPulse)
}

fn content(word: u64) -> Content {
    let idle = EncoderByte::of(EncoderSymbol::Idle);
    Content {
        vertical: Character::data(word.to_le_bytes()[0]),
        parameter: if word & 1 == 1 { idle.with_vsync() } else { idle },
        pipe: Character::control(hdsl::symbol::Control::K30_7),
        acceleration: Some(DeltaDelta::clamp(i64::from(word.to_le_bytes()[1]))),
        secondary: Character::data(word.to_le_bytes()[2]),
    }
}

kernels! {
    /// A word by the strict tables.
    fn hdsl_symbol(word: &u64) -> Reading {
        Word::truncate(*word as u16).read(Rule::Strict)
    } over SYMBOLS;

    /// A word by the reduced rule.
    fn hdsl_symbol_reduced(word: &u64) -> Reading {
        Word::truncate(*word as u16).read(Rule::Reduced)
    } over SYMBOLS;

    /// A byte to a word.
    fn hdsl_symbol_encode(word: &u64) -> Encoded {
        Character::data(word.to_le_bytes()[0]).encode(RunningDisparity::Plus)
    } over SYMBOLS;

    /// The running disparity of a word.
    fn hdsl_disparity(word: &u64) -> DisparityStatus {
        DisparityCheck::new(RunningDisparity::Minus).step(Word::truncate(*word as u16))
    } over SYMBOLS;

    /// 61 bits to six judged words and the checked acceleration.
    fn hdsl_answer(line: &u64) -> (Answer, Result<DeltaDelta, Error>) {
        let answer = Answer::from_bits(Rule::Strict, *line);
        (answer, answer.delta_delta())
    } over LINES;

    /// An answer to send.
    fn hdsl_answer_emit(word: &u64) -> EncodedAnswer {
        content(*word).emit(RunningDisparity::Minus)
    } over LINES;

    /// Eight answers to both safe positions.
    fn hdsl_v_frame(lines: &[u64; 8]) -> (Result<u64, Error>, Result<u64, Error>) {
        let frame = VFrame::of(Rule::Strict, &lines.map(|line| Answer::from_bits(Rule::Strict, line)));
        (frame.safe1.vpos(), frame.safe2.vpos())
    } over GROUPS;

    /// The identifier of an encoder.
    fn hdsl_encoder_id(line: &u64) -> Result<PositionBits, Error> {
        EncoderId::from_answer(Answer::from_bits(Rule::Strict, *line)).and_then(EncoderId::check)
    } over LINES;

    /// CRC-16 over 32 bytes.
    fn hdsl_crc16_32(bytes: &[u8; 32]) -> u16 {
        crc16(bytes)
    } over BLOCKS;

    /// Four steps of the position and an alignment.
    fn hdsl_position(values: &[Option<i16>; 4]) -> (u64, i32) {
        let mut tracker = PositionTracker::new(PositionBits::MAX);
        for value in values {
            tracker.step(value.and_then(DeltaDelta::new));
        }
        tracker.align(12_345);
        (tracker.registers().pos, tracker.registers().vel)
    } over ACCELERATIONS;

    /// The same with the position of the SDK.
    fn hdsl_position_ti(values: &[Option<i16>; 4]) -> (u64, i32) {
        let mut tracker = PositionTracker::with_rule(PositionBits::MAX, PositionRule::Ti);
        for value in values {
            tracker.step(value.and_then(DeltaDelta::new));
        }
        tracker.no_safe_position();
        (tracker.registers().pos, tracker.registers().vel)
    } over ACCELERATIONS;

    /// One event of the quality monitor.
    fn hdsl_quality(word: &u64) -> u8 {
        let mut monitor = QualityMonitor::new(QualityRule::Sick);
        monitor.count(if word & 1 == 1 { QualityEvent::VsyncOk } else { QualityEvent::Safe1Error });
        monitor.value()
    } over SYMBOLS;

    /// The head of a frame, and what an encoder reads of it.
    fn hdsl_head((byte, edge, disparity): &(u8, u8, i8)) -> Result<ParsedHead, Error> {
        let head = Head::new(ParameterByte::new(*byte), Extra::new(*edge), LineDisparity::new(*disparity));
        Head::parse(head.bits())
    } over HEADS;

    /// The head as samples.
    fn hdsl_head_samples((byte, edge, disparity): &(u8, u8, i8)) -> u8 {
        let head = Head::new(ParameterByte::new(*byte), Extra::new(*edge), LineDisparity::new(*disparity));
        head.samples().fold(0, |all, byte| all ^ byte)
    } over HEADS;

    /// Sampling index and delay from the test pattern.
    fn hdsl_learn(samples: &[u8; WINDOW]) -> Result<Alignment, Error> {
        Alignment::learn(EdgeRule::Leading, samples)
    } over PATTERNS;

    /// The bits, the edges and the RSSI of an answer at a learned place.
    fn hdsl_read((place, samples): &(Alignment, [u8; WINDOW])) -> Result<SampledAnswer, Error> {
        place.read(samples)
    } over PLACED;

    /// The same from whole words.
    fn hdsl_read_words((place, samples): &(Alignment, [u32; WINDOW / 4])) -> SampledAnswer {
        place.read_words(samples)
    } over PLACED_WORDS;

    /// The bits alone.
    fn hdsl_bits((place, samples): &(Alignment, [u8; WINDOW])) -> Result<u64, Error> {
        place.bits(samples)
    } over PLACED;

    /// A short message there and back.
    fn hdsl_short(word: &u64) -> Result<ShortAnswer, Error> {
        let request = ShortRequest::Read(RemoteRegister::of_index(word.to_le_bytes()[0]));
        let request = ShortRequest::parse(request.emit().as_bytes())?;
        let answer = ShortAnswer { register: request.register(), data: Some(word.to_le_bytes()[1]) };
        request.parse_answer(answer.emit().as_bytes())
    } over SYMBOLS;

    /// A long message there and its answer.
    fn hdsl_long(bytes: &[u8; 32]) -> Result<Data, Error> {
        let access = Access::Write(Data::new(&bytes[..8])?);
        let request = LongRequest { address: ResourceAddress::RWFILE, indirect: true, offset: None, access };
        LongRequest::parse(request.emit().as_bytes())?.parse_answer(bytes)
    } over BLOCKS;

    /// Ten frames in sync mode.
    fn hdsl_sync((period, es): &(u32, u8)) -> Result<Next, Error> {
        let mut sync = Synchroniser::new(*period, es_of(*es)?)?;
        for late in 0..9 {
            sync.next(Some(late));
        }
        Ok(sync.next(None))
    } over PERIODS;

    /// The first frames of a link: master, registers, cable and encoder. (The timer cannot count the calls of a longer one.)
    fn hdsl_link(frames: &u32) -> Result<(Counters, u64), Error> {
        let mut master = Master::new(Dialect::SICK);
        let mut map = Registers::new(&Dialect::SICK);
        let mut encoder = Device::new(EncoderId::truncate(0x00153));
        let mut line = Cable::new(Disturbance::metres(10).with_jitter(1), 1);
        for frame in 0..*frames {
            let head = line.down(master.transmission().head.bits());
            let samples = line.up(encoder.set_position(u64::from(frame)).hear(head));
            if frame == 25 {
                let _ = master.start_short(ShortRequest::Read(RemoteRegister::PING));
                let access = Access::Read(Length::Eight);
                let address = ResourceAddress::RESOLUTN;
                let _ = master.start_long(LongRequest { address, indirect: false, offset: None, access });
            }
            let _ = map.apply(master.hear(&samples, 11_520 * u64::from(frame))?);
        }
        Ok((master.counters(), map.vpos()))
    } over LINKS;

    /// Symbols of both directions.
    fn hdsl_parameter(word: &u64) -> (Result<MasterSymbol, Error>, Result<EncoderSymbol, Error>) {
        let [byte, ..] = word.to_le_bytes();
        (ParameterByte::new(byte).symbol(), EncoderByte::new(byte).symbol())
    } over SYMBOLS;
}
