//! Eight encoders on one line at 16 Mbit/s, through noise: what is refused, what is accepted, and what the CRC-8 cannot
//! see.
//!
//! `cargo run --release -p nikon-aformat --example noisy_bus -- [TRANSACTIONS] [WRONG BITS IN A MILLION]`
#![allow(clippy::std_instead_of_core, clippy::arithmetic_side_effects, clippy::cast_possible_truncation)]
#![allow(clippy::cast_precision_loss, clippy::cast_sign_loss, unreachable_pub)]

use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::device::{Device, Encoders, Transmission};
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{
    BitOrder, BitRate, EncoderAddress, Error, FRAME_BITS, Layout, Operation, RawResponse, Request, RequestFrame,
    Resolution, Window,
};
use nrz_line::Samples;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<u64>());
    let mut next = |default| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (transactions, per_million) = (next(1_000_000), next(2_000));
    let tally = run(transactions, per_million, 1);
    println!("{transactions} transactions with 8 encoders, {per_million} wrong bits in a million");
    println!("{tally:#?}");
    println!(
        "wrong and accepted: {} of {} raws. Those on the grid have three wrong bits or more that make a multiple of the\n\
         generator; the others were put together from frames that begin at a wrong edge, and 1 in 256 of such passes\n\
         any 8-bit check.",
        tally.unseen_by_crc + tally.slipped,
        tally.sent
    );
}

/// What became of the responses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Responses that the encoders sent.
    pub sent: u64,
    /// Accepted and as sent.
    pub good: u64,
    /// Refused, or never begun: asked for and not accepted.
    pub lost: u64,
    /// Requests that no encoder understood.
    pub unheard: u64,
    /// Accepted and not as sent, on the grid of the response: three wrong content bits or more.
    pub unseen_by_crc: u64,
    /// Fewest wrong content bits of those; no response with one or two is ever accepted.
    pub fewest_bits: Option<u32>,
    /// Accepted from a place where no response was: a wrong edge was taken for a start bit.
    pub slipped: u64,
}

/// Idle line before the first response and after the last.
const MARGIN: usize = 30;

/// A million transactions take some seconds in release.
pub fn run(transactions: u64, per_million: u64, seed: u64) -> Tally {
    let resolution = Resolution::default();
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let expected = request.expected(resolution);
    let mut encoders =
        Encoders { all: EncoderAddress::ALL.map(|ea| Device::<1>::new(ea, resolution, BitRate::Mbit16)) };
    let mut noise = Noise::new(seed, per_million);
    let mut tally = Tally::default();
    for cycle in 0..transactions {
        for device in &mut encoders.all {
            let random = noise.random();
            device.set_position(random as u32 & 0xf_ffff, (random >> 32) as u32 & 0xffff);
        }
        let now_ns = cycle * 125_000;
        let answers = ask(&mut encoders, request, &mut noise, now_ns);
        tally.unheard += u64::from(answers.iter().all(Option::is_none));
        let mut line = Line::of(&answers);
        line.disturb(&mut noise);
        let mut bus = Bus::new(expected, Addresses::ALL);
        let mut receiver = LineReceiver::bits(Layout::Abs40);
        let mut good = 0;
        for word in &line.words {
            let mut samples = Samples::new(*word);
            while !samples.is_empty() {
                let Some(raw) = receiver.feed(&mut samples) else { continue };
                let arrival = bus.push(raw);
                if let (Ok(raw), Ok(_)) = (raw, arrival.outcome) {
                    good += u64::from(line.judge(&raw, &answers, &mut tally));
                }
            }
        }
        let sent = answers.iter().flatten().count() as u64;
        tally.sent += sent;
        tally.good += good;
        tally.lost += sent.saturating_sub(good);
    }
    tally
}

/// Sends the request, noise included, and gives what the encoders answer.
fn ask(encoders: &mut Encoders<8, 1>, request: Request, noise: &mut Noise, now_ns: u64) -> [Option<Transmission>; 8] {
    let mut answers = [None; 8];
    for frame in request.emit().as_slice() {
        let bits = noise.flips(FRAME_BITS as usize).fold(frame.line().bits(), |bits, at| bits ^ 1 << at);
        let line = Window::from_bits(bits, FRAME_BITS).unwrap_or(Window::EMPTY);
        match RequestFrame::from_line(line) {
            Err(Error::StartBit { .. } | Error::Delimiter { .. }) => encoders.framing_error(now_ns),
            _ => answers = encoders.hear(&[Some((bits >> 1) as u16)], now_ns),
        }
    }
    answers
}

/// The answers on one line, a bit a sample.
struct Line {
    words: Vec<u64>,
    /// Where the responses begin.
    starts: [Option<usize>; 8],
}

impl Line {
    fn of(answers: &[Option<Transmission>; 8]) -> Self {
        let first_ns = answers.iter().flatten().map(|answer| answer.start_ns).min().unwrap_or(0);
        let place = |answer: &Transmission| {
            MARGIN + ((answer.start_ns - first_ns) * 1000 / u64::from(BitRate::Mbit16.bit_ps())) as usize
        };
        let starts = answers.map(|answer| answer.as_ref().map(place));
        let end = starts.iter().flatten().max().map_or(0, |start| start + 72 + MARGIN);
        let mut bytes = vec![0xff; end.div_ceil(64) * 8];
        for (answer, start) in answers.iter().zip(starts) {
            if let (Some(answer), Some(start)) = (answer, start) {
                let written = answer.line.write(&mut bytes, start, BitOrder::LsbFirst);
                assert!(written.is_ok(), "the line is long enough");
            }
        }
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte));
        Self { words: bytes.chunks(8).map(word).collect(), starts }
    }

    fn disturb(&mut self, noise: &mut Noise) {
        for at in noise.flips(self.words.len() * 64) {
            if let Some(word) = self.words.get_mut(at / 64) {
                *word ^= 1 << (at % 64);
            }
        }
    }

    /// The line bits as they were received, at the place of a response.
    fn received(&self, start: usize) -> Window {
        let bytes: Vec<u8> = self.words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Window::read(&bytes, start, Layout::Abs40.line_bits(), BitOrder::LsbFirst).unwrap_or(Window::EMPTY)
    }

    /// Whether an accepted response is one that was sent; if not, counts why it was accepted.
    fn judge(&self, raw: &RawResponse, answers: &[Option<Transmission>; 8], tally: &mut Tally) -> bool {
        let sent = answers.iter().flatten().map(|answer| answer.frames);
        if sent.clone().any(|sent| sent == *raw) {
            return true;
        }
        let on_grid = |start: &usize| RawResponse::from_line(Layout::Abs40, self.received(*start)) == Ok(*raw);
        let place = self.starts.iter().position(|start| start.as_ref().is_some_and(on_grid));
        let Some(sent) = place.and_then(|place| answers.get(place).copied().flatten()) else {
            tally.slipped += 1;
            return false;
        };
        let wrong = (sent.frames.line().bits() ^ raw.line().bits()).count_ones();
        tally.unseen_by_crc += 1;
        tally.fewest_bits = Some(tally.fewest_bits.map_or(wrong, |fewest| fewest.min(wrong)));
        false
    }
}

/// Wrong bits at random places.
struct Noise {
    state: u64,
    per_million: u64,
}

impl Noise {
    fn new(seed: u64, per_million: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1, per_million }
    }

    /// Xorshift, multiplied.
    fn random(&mut self) -> u64 {
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        self.state.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Places among `len` bits; the distance between two is exponential.
    fn flips(&mut self, len: usize) -> impl Iterator<Item = usize> {
        let mut places = Vec::new();
        let mut at = 0.0;
        while self.per_million > 0 {
            let uniform = ((self.random() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
            at += -uniform.ln() * 1e6 / self.per_million as f64;
            if at >= len as f64 {
                break;
            }
            places.push(at as usize);
        }
        places.into_iter()
    }
}
