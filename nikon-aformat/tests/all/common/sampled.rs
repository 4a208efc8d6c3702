//! What a sampler sees of the hostile line, and what a receiver makes of it.

use nikon_aformat::bus::Addresses;
use nikon_aformat::reception::LineReceiver;
use nikon_aformat::{EncoderAddress, Error, Operation, RawResponse, Request, Resolution, Response};
use nrz_line::Samples;
use servowire_world::{Fault, Host, Kind, Planned, Rates, Scenario, Script, Speaker, Tally, Transmission};

use super::exchanges::{Setup, encoders};
use super::line::{Bench, between_ns, bit_ps, frame_ns, value_of};

/// What a run has shown.
#[derive(Debug, Default)]
pub struct Shown {
    pub heard: u64,
    pub refused: u64,
    /// Responses that had to be heard because nothing had happened to them, though something had to others.
    pub owed: u64,
    pub tally: Tally,
}

/// Samples a bit: those of the vendor's receivers, and a plain bit stream.
const DENSITIES: [u64; 5] = [1, 4, 5, 6, 8];

/// A line with encoders that nobody but a sampler listens to.
struct Sampled<const N: usize> {
    bench: Bench<N>,
    setup: Setup,
    at_ns: u64,
}

impl<const N: usize> Sampled<N> {
    fn new(setup: &Setup, addresses: [u8; N], script: Script) -> Self {
        let mut encoders = encoders(setup.rate, addresses, Addresses::ALL, setup.switches, Resolution::default());
        for (encoder, ea) in encoders.all.iter_mut().zip(addresses) {
            // Soon, and in ascending order.
            encoder.set_behaviour(setup.switches.behaviour(ea, ea).with_response_delay_ns(900).with_place(Some(ea)));
        }
        let scenario = Scenario { host: Host::IDEAL, script };
        Self { bench: Bench::new(encoders, setup.rate, scenario), setup: setup.clone(), at_ns: 1_000 }
    }

    /// Sends a request and waits until the last of `places` responses of `frames` frames is over; gives what a receiver
    /// makes of the line since the request.
    fn ask(&mut self, request: Request, places: u64, frames: u64, idle_bits: u64) -> Vec<Result<RawResponse, Error>> {
        let Setup { rate, seed, .. } = self.setup;
        let expected = request.expected(Resolution::default());
        self.bench.send(request.emit(), self.at_ns);
        let from_ns = self.at_ns + frame_ns(rate) + 100;
        let idle_ns = idle_bits * bit_ps(rate) / 1000;
        let until_ns = from_ns + 1_000 + places * (frames * frame_ns(rate) + between_ns(rate) + idle_ns);
        while self.bench.next(until_ns).is_ok() {}

        let density = DENSITIES[(seed / 5) as usize % 5];
        let period_ps = bit_ps(rate) / density;
        let count = ((until_ns - from_ns) * 1_000 / period_ps) as usize;
        let line = self.bench.world.truth().sampled(from_ns, count, period_ps, bit_ps(rate));
        let mut receiver = match density {
            1 => LineReceiver::bits(expected.layout()),
            _ => LineReceiver::oversampled(density as u32, expected.layout()).unwrap(),
        };
        let mut heard = Vec::new();
        for eight in line.chunks(8) {
            let mut word = [0; 8];
            word[..eight.len()].copy_from_slice(eight);
            let mut samples = Samples::partial(u64::from_le_bytes(word), eight.len() as u32 * 8);
            while let Some(end) = receiver.feed(&mut samples) {
                heard.push(end);
            }
        }
        heard.extend(receiver.finish().map(Err));
        self.at_ns = until_ns + 10_000;
        heard
    }

    fn forget(&mut self) {
        let now_ns = self.bench.world.now_ns();
        self.bench.world.truth_mut().forget_before(now_ns);
    }
}

/// One wrong bit in three responses of four, in the middle of a frame, its start bit or its delimiter: it never gives another
/// value, because the CRC-8 finds every single error, and a start bit or a delimiter that is wrong shows. The fourth arrives.
pub fn single_flips(setup: &Setup, turns: u16, shown: &mut Shown) {
    let seed = setup.seed;
    let place = |turn: u16| (seed ^ u64::from(turn) << 20).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
    // Transmission 0 is a request, 1 its response, and so on.
    let flip = |turn: u16| {
        let bit = match place(turn) >> 8 & 7 {
            0..=3 => 0,
            4 => 17,
            _ => place(turn) as u16 >> 12,
        };
        Planned { transmission: 2 * turn + 1, unit: place(turn) as u8, fault: Fault::Flip { bit } }
    };
    let planned = (0..turns).filter(|turn| turn % 4 != 3).map(flip).collect();
    let mut line = Sampled::new(setup, [7], Script::planned(planned));
    for turn in 0..turns {
        let (operation, frames) = [(Operation::Abs17, 2), (Operation::Abs24Low, 3), (Operation::Abs40, 4)]
            [[0, 0, 0, 1, 2][usize::from(turn) % 5]];
        let request = Request::new(EncoderAddress::MAX, operation);
        let heard = line.ask(request, 1, frames, 0);
        let expected = request.expected(Resolution::default()).from_address(EncoderAddress::MAX);
        let sent = line.bench.world.truth().transmissions().find_map(|t| t.tag.filter(|_| t.start_ns < line.at_ns));
        let good: Vec<_> =
            heard.iter().filter_map(|end| end.ok().and_then(|raw| Response::parse(&expected, &raw).ok())).collect();
        for response in &good {
            let got = value_of(response.emit().contents());
            assert_eq!(Some(got), sent, "seed {seed} turn {turn}: one wrong bit made {response} of another");
        }
        assert!(turn % 4 != 3 || good.len() == 1, "seed {seed} turn {turn}: a sound response is lost, {heard:?}");
        shown.heard += good.len() as u64;
        shown.refused += u64::from(good.is_empty());
        line.forget();
    }
    shown.tally.add(line.bench.world.tally());
}

/// Frames are lost, cut off or late in some responses of a bus: those that nothing happened to arrive.
pub fn lost_frames(setup: &Setup, turns: u16, shown: &mut Shown) {
    let seed = setup.seed;
    let mut rates = Rates { per_million: [0; 12], longest_ns: 1_000 };
    for kind in [Kind::Drop, Kind::Cut, Kind::Idle] {
        rates = rates.with(kind, 60_000);
    }
    let mut line = Sampled::new(setup, [0, 1, 2], Script::random(seed, rates));
    for turn in 0..turns {
        let request = Request::new(EncoderAddress::truncate(2), Operation::Abs40Mt);
        let heard = line.ask(request, 3, 4, 64);
        let expected = request.expected(Resolution::default()).any_address();
        let values: Vec<_> = heard
            .iter()
            .filter_map(|end| end.ok().filter(|raw| Response::parse(&expected, raw).is_ok()))
            .map(|raw| value_of(raw.contents()))
            .collect();
        // Two at once make frames of their own, which may run into the next response; and the sampler begins when the request
        // should have left.
        let truth = line.bench.world.truth();
        let apart =
            truth.collisions.is_empty() && truth.transmissions().all(|t| t.start_ns == t.asked_ns || t.tag.is_some());
        let spoken = |t: &&Transmission| apart && matches!(t.speaker, Speaker::Device(_));
        for sent in truth.transmissions().filter(spoken) {
            let Some(tag) = sent.tag else { continue };
            // A cut response can look like another request to those that hear it, and be answered.
            let is_answer = line.bench.spoken(tag).is_some_and(|spoken| spoken.code == 4);
            let gapless = is_answer && sent.intact && sent.longest_idle(18) == 0;
            let earlier = truth.transmissions().filter(|t| t.start_ns < sent.start_ns);
            let before = earlier.map(|t| t.end_ns).max().unwrap_or(0);
            // Six idle bits, a little less than the shortest gap between two responses, separate it from what was before.
            let whole = gapless && sent.start_ns >= before + 6 * bit_ps(setup.rate) / 1000;
            assert!(!whole || values.contains(&tag), "seed {seed} turn {turn}: {sent:?} is lost, {heard:?}");
            shown.owed += u64::from(whole);
        }
        shown.heard += values.len() as u64;
        shown.refused += heard.iter().filter(|end| end.is_err()).count() as u64;
        line.forget();
    }
    shown.tally.add(line.bench.world.tally());
}
