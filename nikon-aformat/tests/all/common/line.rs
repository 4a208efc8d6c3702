//! Encoders and a master on the hostile line.

use std::collections::VecDeque;

use nikon_aformat::device::{Device, Encoders, Transmission};
use nikon_aformat::{Alm, BitRate, Frames};
use servowire_world::{
    Event, Framing, Host, Id, Message, Rates, Scenario, Speaker, Stamp, Transmission as Sent, Wire, World,
};

/// What the host is given at once.
#[derive(Debug)]
pub struct Handed {
    /// `None` where a delimiter read 0.
    pub frames: Vec<Option<u16>>,
    /// When the hand-over before was.
    pub since_ns: u64,
    pub end_ns: u64,
}

/// Faults of a run, unless the environment says another number.
pub const USUAL_FAULTS: u64 = 10_000;

/// Faults of this run.
pub fn faults() -> u64 {
    servowire_world::wanted_events(USUAL_FAULTS)
}

/// The encoders of a line, and what carries their words.
#[derive(Debug)]
pub struct Bench<const N: usize> {
    pub world: World,
    pub encoders: Encoders<N, 2>,
    pub rate: BitRate,
    /// Makes every position that is sent another one.
    pub serial: u64,
    /// Hand-overs: since when, until when, and of how many frames.
    pub handed: Vec<(u64, u64, usize)>,
    /// What each encoder keeps, as it was last seen: a change is an act.
    kept: [Kept; N],
    /// Frames that the first encoder heard and that no master sent like that, and what others than encoders and master put on
    /// the line.
    pub misheard: u64,
    /// Bank and address that are watched.
    pub watch: (u8, u8),
    /// Widths of single turn and turns of all encoders, and whether they speak version 3.0.
    pub widths: (u32, u32),
    pub version_3: bool,
    /// What was said last.
    spoken: VecDeque<Spoken>,
    /// Whether the response to a reset that took effect showed it.
    pub shown_at_once: Vec<bool>,
    /// The request that made each encoder busy last.
    busy_by: [Option<Id>; N],
    /// Writes that reached a busy encoder though nothing held the request up that had made it busy.
    pub hasty: u64,
}

/// A response as an encoder sent it.
#[derive(Debug, Clone, Copy)]
pub struct Spoken {
    /// What it is known by.
    pub tag: u64,
    /// Command that it repeats; nonsense for commands 21 and 22.
    pub code: u16,
    /// Where the shaft was.
    pub single_turn: u32,
    pub turns: u32,
}

/// What an encoder keeps when a request is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    pub zero: nikon_aformat::device::Zero,
    pub word: Option<u16>,
    pub id: u32,
    pub ea: u8,
}

/// Bits of a request frame and of a response frame.
const WIDTH: u32 = 16;

/// A bit in ps, from the rates of the protocol and not from the crate.
pub const fn bit_ps(rate: BitRate) -> u64 {
    match rate {
        BitRate::Mbit2_5 => 400_000,
        BitRate::Mbit4 => 250_000,
        BitRate::Mbit6_67 => 150_000,
        BitRate::Mbit8 => 125_000,
        BitRate::Mbit16 => 62_500,
    }
}

/// Idle time that a master allows between two responses by default: twice what vendors' receivers wait.
pub const fn between_ns(rate: BitRate) -> u64 {
    match rate {
        BitRate::Mbit2_5 => 6_000,
        BitRate::Mbit4 | BitRate::Mbit6_67 => 4_000,
        BitRate::Mbit8 | BitRate::Mbit16 => 3_000,
    }
}

/// 18 bits in ns: whole at every rate.
pub const fn frame_ns(rate: BitRate) -> u64 {
    18 * bit_ps(rate) / 1000
}

/// Idle time that a master allows in front of a frame of a response by default.
pub const fn idle_ns(rate: BitRate) -> u64 {
    match rate {
        BitRate::Mbit2_5 => 750,
        BitRate::Mbit4 | BitRate::Mbit6_67 => 500,
        BitRate::Mbit8 | BitRate::Mbit16 => 375,
    }
}

/// A host that is told the end times of the line, or is late by at most `latency_ns`.
pub fn host_within(scenario: Scenario, latency_ns: u32) -> Scenario {
    let Scenario { host, mut script } = scenario;
    let late = host.stamp == Stamp::Handler;
    if late {
        script.rates = script.rates.with(servowire_world::Kind::Preempt, 0);
    }
    let latency_ns = if late { host.latency_ns % (latency_ns + 1) } else { host.latency_ns };
    Scenario { host: Host { latency_ns, ..host }, script }
}

impl<const N: usize> Bench<N> {
    pub fn new(encoders: Encoders<N, 2>, rate: BitRate, scenario: Scenario) -> Self {
        let wire = Wire { bit_ps: bit_ps(rate), framing: Framing::StartStop { width: WIDTH }, devices: N as u8 };
        let watch = (0, 0);
        let kept = encoders.all.map(|device| kept(&device, watch));
        let handed = vec![(0, 0, 0)];
        Self {
            world: World::new(wire, scenario),
            encoders,
            rate,
            serial: 0,
            handed,
            kept,
            misheard: 0,
            watch,
            widths: (20, 16),
            version_3: true,
            spoken: VecDeque::new(),
            shown_at_once: Vec::new(),
            busy_by: [None; N],
            hasty: 0,
        }
    }

    /// With encoders of other widths, or of version 2.1.
    pub const fn with_encoders(mut self, widths: (u32, u32), version_3: bool) -> Self {
        self.widths = widths;
        self.version_3 = version_3;
        self
    }

    /// The response with this tag, unless it is long ago.
    pub fn spoken(&self, tag: u64) -> Option<&Spoken> {
        self.spoken.iter().find(|spoken| spoken.tag == tag)
    }

    /// What each encoder keeps now.
    pub fn kept(&self) -> [Kept; N] {
        self.encoders.all.map(|device| kept(&device, self.watch))
    }

    /// Watches another word from now on.
    pub fn watch(&mut self, bank: u8, address: u8) {
        self.watch = (bank, address);
        self.kept = self.kept();
    }

    /// Sends the frames of a request, the gaps between them as long as the protocol demands at least.
    ///
    /// Commands 23 to 26 and frame code 3 came with version 3.0: an encoder of version 2.1 is never asked with them.
    pub fn send(&mut self, frames: Frames, at_ns: u64) -> Id {
        let [first, ..] = frames.as_slice() else { panic!("a request without frames") };
        let (code, frame_code) = (first.content() >> 8 & 0x1f, first.content() >> 3 & 3);
        let is_new = (23..=26).contains(&code) || frame_code == 3;
        assert!(self.version_3 || !is_new, "command {code}, frame code {frame_code} sent to an encoder of version 2.1");
        let contents = frames.as_slice().iter().map(|frame| u64::from(frame.content()));
        let gap = 1_000_000_u64.div_ceil(bit_ps(self.rate));
        let message = Message::frames(WIDTH, contents).with_gap_bits(gap as usize);
        self.world.send(&message, at_ns)
    }

    /// Goes on to the next block for the host, or to `until_ns`; the encoders do their part on the way.
    pub fn next(&mut self, until_ns: u64) -> Result<Handed, u64> {
        loop {
            match self.world.next(until_ns) {
                Event::Heard { device, unit } => {
                    self.serial += 1;
                    let at = usize::from(device);
                    let foreign = !matches!(unit.origin.speaker, Speaker::Host | Speaker::Device(_));
                    self.misheard += u64::from(foreign || at == 0 && unit.damaged);
                    let (content, framed) = unit.bits.content();
                    let serial = self.serial;
                    let (single_turn, turns) = self.shaft(serial);
                    self.encoders.all[at].set_position(single_turn, turns);
                    let was_busy = self.is_busy(at, unit.end_ns);
                    let answer = if framed {
                        self.encoders.all[at].hear(&[Some(content as u16)], unit.end_ns)
                    } else {
                        self.encoders.all[at].framing_error(unit.end_ns);
                        None
                    };
                    let acted = self.note_acts(device, unit.origin.transmission);
                    if let Some(answer) = answer {
                        let code = command_of(answer.frames.contents());
                        // Commands 8 to 12 are resets; 14 and 18 to 20 write.
                        if acted && !was_busy && (8..=12).contains(&code) {
                            self.shown_at_once.push(shows_busy_memory(answer.frames.contents()));
                        }
                        if was_busy && matches!(code, 14 | 18..=20) {
                            self.hasty += u64::from(self.busy_by[at].is_some_and(|by| self.left_in_time(by)));
                        }
                        self.answer(device, unit.origin.transmission, &answer, (single_turn, turns));
                    }
                    if !was_busy && self.is_busy(at, unit.end_ns) {
                        self.busy_by[at] = Some(unit.origin.transmission);
                    }
                }
                Event::Delivered(block) => {
                    let frame = |unit: &servowire_world::Unit| match unit.bits.content() {
                        (content, true) => Some(content as u16),
                        _ => None,
                    };
                    // A handler's clock is late, so what it saw last may have ended before.
                    let host = self.world.host();
                    let late = if host.stamp == Stamp::Handler { host.latency_ns } else { 0 };
                    let since_ns = self.handed.last().map_or(0, |last| last.1.saturating_sub(late.into()));
                    self.handed.push((since_ns, block.end_ns, block.units.len()));
                    if self.handed.len() > 400 {
                        self.handed.drain(..200);
                    }
                    return Ok(Handed {
                        frames: block.units.iter().map(frame).collect(),
                        since_ns,
                        end_ns: block.end_ns,
                    });
                }
                Event::Time { now_ns } => return Err(now_ns),
            }
        }
    }

    /// Whether a master may pass a response over though it arrived whole: idle time between two of its frames was longer than
    /// the master allows, or others followed it in its last block, and this block held only a part of it or began before the
    /// request had left: nothing told its age.
    pub fn is_excused(&self, response: &Sent) -> bool {
        let asked_ns =
            response.answers.and_then(|id| self.world.truth().transmission(id)).map_or(0, |sent| sent.end_ns);
        let within = |(since, end, _): &&(u64, u64, usize)| *since <= response.start_ns && response.start_ns < *end;
        // A frame that was repeated and lost once leaves a gap as long as itself.
        if response.end_ns - response.start_ns >= (response.units as u64 + 1) * frame_ns(self.rate) {
            return true;
        }
        if response.longest_idle(18) as u64 * bit_ps(self.rate) > idle_ns(self.rate) * 1000 {
            return true;
        }
        let whole = self.handed.iter().find(within);
        // The block that holds its end.
        let behind = self.handed.iter().find(|(since, end, _)| *since < response.end_ns && response.end_ns <= *end);
        let inside = |(_, end, _): &(u64, u64, usize)| end.saturating_sub(response.end_ns) > frame_ns(self.rate) / 2;
        let split = whole != behind;
        behind.is_some_and(|block| inside(block) && (split || block.0 < asked_ns))
    }

    /// A place of the shaft that is another one every time; the turns use all their bits.
    fn shaft(&self, serial: u64) -> (u32, u32) {
        let (single, turns) = self.widths;
        let spread = serial.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 24;
        ((serial & ((1 << single) - 1)) as u32, (spread & ((1 << turns) - 1)) as u32)
    }

    fn is_busy(&self, at: usize, now_ns: u64) -> bool {
        self.encoders.all[at].alm(now_ns).contains(Alm::MEMBUSY)
    }

    /// Whether a request of the master left when the master believed.
    fn left_in_time(&self, id: Id) -> bool {
        let sent = self.world.truth().transmission(id);
        sent.is_some_and(|sent| sent.speaker == Speaker::Host && sent.start_ns == sent.asked_ns)
    }

    fn answer(&mut self, device: u8, request: Id, answer: &Transmission, (single_turn, turns): (u32, u32)) {
        let contents = answer.frames.contents();
        let tag = value_of(contents);
        self.spoken.push_back(Spoken { tag, code: command_of(contents), single_turn, turns });
        if self.spoken.len() > 400 {
            self.spoken.pop_front();
        }
        let message = Message::frames(WIDTH, contents.iter().map(|content| u64::from(*content))).tagged(tag);
        self.world.answer(device, request, &message, answer.start_ns);
    }

    /// Whether the encoder did something that it keeps.
    fn note_acts(&mut self, device: u8, request: Id) -> bool {
        let at = usize::from(device);
        let (old, new) = (self.kept[at], kept(&self.encoders.all[at], self.watch));
        self.kept[at] = new;
        let changed = [
            ("zero", old.zero != new.zero),
            ("word", old.word != new.word),
            ("id", old.id != new.id),
            ("address", old.ea != new.ea),
        ];
        for (what, _) in changed.into_iter().filter(|(_, changed)| *changed) {
            self.world.act(device, what, request);
        }
        old != new
    }
}

fn kept(device: &Device<2>, (bank, address): (u8, u8)) -> Kept {
    Kept { zero: device.zero(), word: device.eeprom(bank, address), id: device.id().get(), ea: device.ea().get() }
}

/// What a response is known by: all its bits.
pub fn value_of(contents: &[u16]) -> u64 {
    contents
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, content| (hash ^ u64::from(*content)).wrapping_mul(0x0100_0000_01b3))
}

/// The command in the information field: its bits 6 to 10.
fn command_of(contents: &[u16]) -> u16 {
    contents[0] >> 6 & 0x1f
}

/// Whether ALM of a STATUS has MEMBUSY, its bit 8. ALM is the first thing after the information field.
fn shows_busy_memory(contents: &[u16]) -> bool {
    contents[1] >> 8 & 1 == 1
}

/// How rough a run is, by its seed.
pub fn rates(seed: u64) -> Rates {
    match seed % 4 {
        0 => Rates::QUIET,
        1 => Rates { per_million: [4_000; 12], longest_ns: 60_000 },
        2 => Rates { per_million: [20_000; 12], longest_ns: 200_000 },
        _ => Rates { per_million: [60_000; 12], longest_ns: 30_000 },
    }
}
