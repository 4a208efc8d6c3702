//! From what is said to what a logic analyser records: clocks, jitter, ringing, sampling, other channels.

use super::rng::Rng;
use super::speech::{Expect, Kind, Side, Speech, aformat, tformat};
use super::{dsl, speech};

/// What is not ideal about a capture.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Samples a bit; none for exact times.
    pub samples: Option<(f64, f64)>,
    /// The nominal rate in bits a second; none for any of the protocol's.
    pub nominal: Option<f64>,
    /// Both rates, and that of the encoder alone, off by up to this fraction.
    pub rate: f64,
    pub encoder: f64,
    pub inverted: bool,
    /// Edges move by up to this many bits, either way.
    pub jitter: f64,
    /// Spikes of 0.05 to 0.2 bit anywhere: least and most.
    pub spikes: (u64, u64),
    /// Share of edges with a spike after them.
    pub ringing: f64,
    pub decoys: (u64, u64),
    /// A UART of 2.5 Mbit/s on another channel.
    pub stranger: bool,
    /// Idle time before the first request, in milliseconds, beside a busy channel.
    pub idle: (f64, f64),
    /// Requests and answers on two channels.
    pub apart: bool,
    /// The controller's transmit signal on a second channel.
    pub transmit: bool,
    pub inside: bool,
    pub encoders: usize,
    pub transactions: (u64, u64),
    pub missing: f64,
}

impl Scene {
    pub fn clean() -> Self {
        Self {
            samples: None,
            nominal: None,
            rate: 0.0,
            encoder: 0.0,
            inverted: false,
            jitter: 0.0,
            spikes: (0, 0),
            ringing: 0.0,
            decoys: (0, 0),
            stranger: false,
            idle: (0.0, 0.0),
            apart: false,
            transmit: false,
            inside: false,
            encoders: 1,
            transactions: (4, 30),
            missing: 0.0,
        }
    }
}

/// A channel of the capture.
#[derive(Debug, Clone)]
pub struct Channel {
    pub name: String,
    /// Times in picoseconds; the first is the level at the beginning.
    pub edges: Vec<(i64, bool)>,
}

/// What is due on a line.
#[derive(Debug, Clone)]
pub struct Due {
    pub kind: Kind,
    /// Names of its channels, requests first.
    pub channels: Vec<String>,
    pub events: Vec<Expect>,
    /// What began before the capture did: enough of it may be there.
    pub before: Vec<Expect>,
}

#[derive(Debug, Clone)]
pub struct Capture {
    pub channels: Vec<Channel>,
    pub due: Vec<Due>,
    pub end: i64,
}

/// A speech with its time on the line, in picoseconds.
struct Placed {
    side: Side,
    start: f64,
    end: f64,
    edges: Vec<(f64, bool)>,
    expect: Option<Expect>,
}

/// Draws a capture.
pub fn capture(kind: Kind, scene: &Scene, seed: u64) -> Capture {
    let mut rng = Rng::new(seed);
    let mut channels = Vec::new();
    let mut due = Vec::new();
    let mut end = 0.0_f64;
    for k in 0..scene.encoders {
        let kind = if k == 0 { kind } else { rng.pick(&Kind::ALL) };
        let nominal = 1e12 / scene.nominal.unwrap_or_else(|| rng.pick(kind.rates()));
        let off = |rng: &mut Rng, part: f64| 1.0 + rng.between(-part, part);
        let controller = nominal * off(&mut rng, scene.rate);
        let encoder = if scene.encoder > 0.0 { nominal * off(&mut rng, scene.encoder) } else { controller };
        let (said, over) = conversation(kind, scene, &mut rng, nominal, controller, encoder);
        end = end.max(over);
        let begin = if scene.inside { inside(&said, &mut rng) } else { 0.0 };
        let whole = said.iter().filter(|speech| speech.start >= begin);
        // An answer of DSL cannot be told without its head, nor that nobody answers without the request.
        let after =
            whole.skip_while(|speech| speech.side == Side::Encoder && (kind == Kind::Dsl || speech.edges.is_empty()));
        let events: Vec<Expect> = after.filter_map(|speech| speech.expect.clone()).collect();
        let all = said.iter().filter(|speech| speech.expect.is_some()).count();
        let before = said.iter().filter_map(|speech| speech.expect.clone()).take(all - events.len()).collect();
        let line = |side: &dyn Fn(Side) -> bool| -> Vec<(f64, bool)> {
            let edges = said.iter().filter(|speech| side(speech.side)).flat_map(|speech| speech.edges.iter().copied());
            [(0.0, true)].into_iter().chain(edges).collect()
        };
        let tag = if scene.encoders > 1 { format!("{k}") } else { String::new() };
        let mut wires: Vec<(String, Vec<(f64, bool)>)> = Vec::new();
        if scene.apart {
            wires.push((format!("TX{tag}"), line(&|side| side == Side::Controller)));
            wires.push((format!("RX{tag}"), line(&|side| side == Side::Encoder)));
        } else {
            wires.push((format!("RS485{tag}"), line(&|_| true)));
            if scene.transmit {
                wires.push((format!("DI{tag}"), line(&|side| side == Side::Controller)));
            }
        }
        let heard = if scene.apart { 2 } else { 1 };
        let names = wires.iter().take(heard).map(|(name, _)| name.clone()).collect();
        due.push(Due { kind, channels: names, events, before });
        let period = scene.samples.map(|(least, most)| nominal / rng.between(least, most));
        for (name, edges) in wires {
            let edges = imperfect(&edges, nominal, scene, end, &mut rng);
            let edges = sampled(&edges, period, begin);
            let edges = edges.into_iter().map(|(time, level)| (time, level != scene.inverted)).collect();
            channels.push(Channel { name, edges });
        }
    }
    let busy = u64::from(scene.idle.1 > 0.0);
    let decoys = scene.decoys.0 + rng.below(scene.decoys.1 - scene.decoys.0 + 1) + busy;
    for k in 0..decoys {
        let which = if busy == 1 && k == 0 { 0 } else { rng.below(7) };
        let (name, edges) = decoy(which, end, busy == 1, &mut rng);
        channels.push(Channel { name: format!("{name}{k}"), edges: sampled(&edges, None, 0.0) });
    }
    if scene.stranger {
        channels.push(Channel { name: "UART".into(), edges: sampled(&uart(2.5e6, end, &mut rng), None, 0.0) });
    }
    // The order of channels says nothing.
    for k in (1..channels.len()).rev() {
        channels.swap(k, rng.below(k as u64 + 1) as usize);
    }
    Capture { channels, due, end: end as i64 }
}

fn conversation(
    kind: Kind,
    scene: &Scene,
    rng: &mut Rng,
    nominal: f64,
    controller: f64,
    encoder: f64,
) -> (Vec<Placed>, f64) {
    let mut now = rng.between(15.0, 60.0) * nominal + rng.between(scene.idle.0, scene.idle.1) * 1e9;
    let count = scene.transactions.0 + rng.below(scene.transactions.1 - scene.transactions.0 + 1);
    let mut out = Vec::new();
    let mut place = |speech: Speech, now: &mut f64| {
        *now += speech.pause * nominal;
        let bit = if speech.side == Side::Controller { controller } else { encoder };
        // The head of a frame of DSL is whole without the TRAILER before it.
        let trailer = if kind == Kind::Dsl && speech.bits.len() == 32 { 6.0 } else { 0.0 };
        let start = *now + trailer * bit;
        let mut edges = Vec::new();
        let mut level = true;
        for next in &speech.bits {
            if *next != level {
                level = *next;
                edges.push((*now, level));
            }
            *now += bit;
        }
        if !level {
            edges.push((*now, true));
        }
        out.push(Placed { side: speech.side, start, end: *now, edges, expect: speech.expect });
    };
    if kind == Kind::Dsl {
        let delay = rng.between(0.3, 6.0);
        let missing = scene.missing;
        let frames = if scene.transactions.1 <= 3 { 8 * count } else { 16 + count };
        let said = dsl::link(rng, frames as usize, delay, &mut |rng| rng.chance(missing));
        let mut next = now;
        for speech in said {
            if speech.side == Side::Controller {
                // The frame has 108 bits; TRAILER begins six bits before its end, its first two are not driven.
                now = next;
                let trailer = if speech.bits.len() > 26 { 6.0 } else { 0.0 };
                next = now + (trailer + 108.0 - 6.0) * controller;
                if trailer == 0.0 {
                    next = now + 102.0 * controller;
                }
            }
            place(speech, &mut now);
        }
        return (out, next + 20.0 * nominal);
    }
    for _ in 0..count {
        let answered = !rng.chance(scene.missing);
        // About 3 us for T-Format, 7 bits or more for A-format.
        let delay = match kind {
            Kind::Tformat => rng.between(2.7, 4.0) * 1e6 / nominal,
            _ => rng.between(7.0, 20.0),
        };
        let said: Vec<speech::Speech> = match kind {
            Kind::Tformat => tformat(rng, answered, delay),
            _ => aformat(rng, answered, delay),
        };
        for speech in said {
            place(speech, &mut now);
        }
        now += match (kind, answered) {
            (Kind::Tformat, false) => rng.between(25.0, 120.0) * 1e6,
            (_, false) => rng.between(1200.0, 3000.0) * nominal,
            _ => rng.between(10.0, 120.0) * 1e6,
        };
    }
    (out, now)
}

/// A time inside what is said at first.
fn inside(said: &[Placed], rng: &mut Rng) -> f64 {
    let until = said.get(1).map_or(0.0, |speech| speech.end);
    rng.between(said[0].start, until)
}

/// Jitter, ringing and spikes.
fn imperfect(edges: &[(f64, bool)], bit: f64, scene: &Scene, end: f64, rng: &mut Rng) -> Vec<(f64, bool)> {
    let mut out: Vec<(f64, bool)> = Vec::new();
    for (k, (time, level)) in edges.iter().enumerate() {
        let time = if k == 0 { *time } else { time + rng.between(-scene.jitter, scene.jitter) * bit };
        out.push((time, *level));
    }
    // Spikes: two edges each, inside a run.
    let mut spikes: Vec<(f64, f64)> = Vec::new();
    for (time, _) in out.iter().skip(1) {
        if rng.chance(scene.ringing) {
            let from = time + rng.between(0.05, 0.3) * bit;
            spikes.push((from, from + rng.between(0.05, 0.2) * bit));
        }
    }
    for _ in 0..scene.spikes.0 + rng.below(scene.spikes.1 - scene.spikes.0 + 1) {
        let from = rng.between(0.0, end);
        spikes.push((from, from + rng.between(0.05, 0.2) * bit));
    }
    if scene.ringing > 0.0 {
        for _ in 0..3 {
            let from = rng.between(0.0, end);
            spikes.push((from, from + rng.between(0.05, 0.2) * bit));
        }
    }
    // A spike inverts the level while it lasts.
    let mut toggles: Vec<f64> = out.iter().skip(1).map(|(time, _)| *time).collect();
    toggles.extend(spikes.iter().flat_map(|(from, to)| [*from, *to]));
    toggles.sort_by(f64::total_cmp);
    let mut level = true;
    let mut line = vec![(0.0, true)];
    for time in toggles {
        level = !level;
        line.push((time, level));
    }
    line
}

/// The levels at the sampling instants from `begin` on, as edges.
fn sampled(edges: &[(f64, bool)], period: Option<f64>, begin: f64) -> Vec<(i64, bool)> {
    let mut out: Vec<(i64, bool)> = Vec::new();
    for (time, level) in edges {
        let at = match period {
            Some(period) => ((time / period).ceil() * period).round(),
            None => time.round(),
        };
        let at = (at.max(begin) - begin) as i64;
        match out.last_mut() {
            Some((before, last)) if *before == at => *last = *level,
            _ => out.push((at, *level)),
        }
    }
    out.dedup_by_key(|(_, level)| *level);
    out
}

fn decoy(which: u64, end: f64, slow: bool, rng: &mut Rng) -> (&'static str, Vec<(f64, bool)>) {
    let mut line = vec![(0.0, rng.chance(0.5))];
    let mut now = 0.0;
    let toggle = |line: &mut Vec<(f64, bool)>, at: f64| {
        let level = !line.last().unwrap().1;
        line.push((at, level));
    };
    match which {
        0 => {
            let half = 0.5e12 / if slow { rng.between(1e5, 4e5) } else { rng.between(2e5, 2e7) };
            while now < end {
                now += half;
                toggle(&mut line, now);
            }
            ("CLK", line)
        }
        1 => {
            let period = 1e12 / rng.between(8e3, 1e5);
            while now < end {
                let duty = rng.between(0.1, 0.9);
                toggle(&mut line, now + 1.0);
                toggle(&mut line, now + duty * period);
                now += period;
            }
            ("PWM", line)
        }
        2 => {
            let half = 0.5e12 / rng.between(1e6, 1e7);
            while now < end {
                now += rng.between(1e7, 1e8);
                for _ in 0..16 {
                    if rng.chance(0.5) {
                        toggle(&mut line, now);
                    }
                    now += 2.0 * half;
                }
            }
            ("MOSI", line)
        }
        3 => ("LOG", uart(115_200.0, end, rng)),
        4 => {
            while now < end {
                now += rng.between(5e6, 5e7);
                toggle(&mut line, now);
            }
            ("QEP", line)
        }
        5 => ("DEAD", line),
        _ => {
            let half = 0.5e12 / rng.between(1e6, 1e7);
            while now < end {
                now += rng.between(1e7, 1e8);
                for _ in 0..32 {
                    toggle(&mut line, now);
                    now += half;
                }
            }
            ("SCK", line)
        }
    }
}

/// Random bytes, 8N1.
fn uart(rate: f64, end: f64, rng: &mut Rng) -> Vec<(f64, bool)> {
    let bit = 1e12 / rate;
    let mut line = vec![(0.0, true)];
    let mut now = 0.0;
    while now < end {
        now += rng.between(0.0, 40.0) * bit;
        for _ in 0..rng.below(20) {
            let byte = rng.below(256) as u8;
            let mut level = true;
            for next in [false].into_iter().chain((0..8).map(|k| byte >> k & 1 == 1)).chain([true]) {
                if next != level {
                    level = next;
                    line.push((now, level));
                }
                now += bit;
            }
        }
    }
    line
}
