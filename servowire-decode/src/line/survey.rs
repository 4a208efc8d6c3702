//! Determines from their first edges which channels carry a protocol, which protocol it is, how fast, and with which polarity.
//!
//! Every rate of every protocol is tried on every channel with edges, in both polarities; a trial ends early if hardly any
//! frame is good. A spike, a slow encoder or a decoy therefore never hides a line. Failed frames are read a second time
//! only if that can decide between two readings.

use super::evidence::{CERTAIN, Evidence};
use super::lane::{Tap, Wires};
use super::receive::Rates;
use crate::codec::Codec;
use crate::protocols::meant;
use crate::recognition::Recognition;
use crate::settings::Settings;
use crate::time::Time;

/// Number of edges of a channel that are examined.
pub(super) const SAMPLE: usize = 3000;
/// Edges after which a trial may be given up.
const PIECE: usize = 96;
/// Fewer changes than this, including the initial level, are not traffic: the shortest frame has four edges.
pub(super) const FEWEST: usize = 5;
/// A rival with at least this share of the best score is mentioned.
const CLOSE: f64 = 0.5;
/// If a line is certain at first sight, readings with less than this fraction (one in so many) of its score are not
/// examined again.
const FAR: i64 = 4;

/// The edges of a channel, by time.
pub(super) type Edges = [(Time, bool)];

/// A protocol at a rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Speech {
    /// The protocol.
    pub(super) protocol: &'static dyn Codec,
    /// Bits per second.
    pub(super) rate: u32,
}

/// How a line is read in a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// At first sight.
    Once,
    /// With a second reading of failed frames.
    Again,
}

/// A line that was found.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) taps: Vec<Tap>,
    pub(super) speech: Speech,
    pub(super) evidence: Evidence,
    pub(super) rates: Rates,
    /// The level at which the line idles, if it does.
    pub(super) idle: Option<bool>,
    /// Bits per second suggested by the runs.
    pub(super) seen: Option<f64>,
    /// The next best reading of the same channel.
    pub(super) rival: Option<(Speech, i64)>,
    /// Whether everything on the line was examined.
    pub(super) whole: bool,
}

impl Found {
    pub(super) fn is_certain(&self) -> bool {
        self.evidence.score >= CERTAIN
    }

    fn bit(&self) -> i64 {
        1_000_000_000_000 / i64::from(self.speech.rate.max(1))
    }

    /// Returns whether all taps idle low.
    pub(super) fn is_inverted(&self) -> bool {
        self.taps.iter().all(|tap| tap.inverted)
    }

    /// Describes what was found, on channels of these names.
    pub(super) fn recognition(&self, channels: Vec<String>) -> Recognition {
        Recognition {
            channels,
            protocol: self.speech.protocol,
            rate: self.speech.rate,
            inverted: self.is_inverted(),
            idle: self.idle,
            seen: self.seen,
            rates: self.rates,
            tally: self.evidence.tally,
            whole: self.whole,
            rival: self.rival.map(|(speech, _)| (speech.protocol, speech.rate)),
        }
    }
}

/// The candidates for the lines.
#[derive(Debug, Clone)]
pub(super) struct Candidates {
    pub(super) speeches: Vec<Speech>,
    pub(super) inverted: Option<bool>,
    pub(super) settings: Settings,
    /// Whether the user named the protocol.
    asked: bool,
    pair: Option<[u16; 2]>,
}

impl Candidates {
    /// Collects the candidates that the options leave open.
    pub(super) fn new(protocol: Option<&'static dyn Codec>, settings: Settings, pair: Option<[u16; 2]>) -> Self {
        let rated = |protocol: &'static dyn Codec| {
            let rates: Vec<u32> = match settings.line.bit_rate {
                Some(rate) if !protocol.rates.is_empty() && !protocol.clocked => vec![rate],
                _ => protocol.rates.to_vec(),
            };
            rates.into_iter().map(move |rate| Speech { protocol, rate })
        };
        let speeches = meant(protocol).flat_map(rated).collect();
        let (line, inverted) = (&settings.line, settings.line.inverted);
        let asked = protocol.is_some() || line.bit_rate.is_some() || line.inverted.is_some();
        Self { speeches, inverted, settings, asked, pair }
    }

    /// Returns whether the user said what the lines are.
    pub(super) fn is_asked_for(&self) -> bool {
        self.asked
    }

    /// Returns the channels of requests and answers as the user named them.
    pub(super) fn pair(&self) -> Option<[u16; 2]> {
        self.pair
    }

    /// Returns the best reading of two channels as one line.
    pub(super) fn read_pair(&self, channels: [u16; 2], edges: [&Edges; 2]) -> Option<Found> {
        let edges = edges.map(|edges| edges.get(..SAMPLE.min(edges.len())).unwrap_or_default());
        let mut readings = Vec::new();
        for speech in &self.speeches {
            for inverted in self.polarities() {
                let taps = channels.into_iter().map(|channel| Tap { channel, inverted }).collect();
                readings.push(self.reading(*speech, taps, None, &edges));
            }
        }
        self.look_again(&mut readings, &edges);
        // The first of the best.
        readings.into_iter().rev().max_by_key(mark)
    }

    /// Returns the best reading of a channel, and the second best.
    pub(super) fn read(&self, channel: u16, edges: &Edges) -> Option<Found> {
        let edges = edges.get(..SAMPLE.min(edges.len()))?;
        let mut readings = Vec::new();
        for speech in &self.speeches {
            let bit = 1e12 / f64::from(speech.rate.max(1));
            if !may_run_at(edges, bit) && self.speeches.len() > 1 {
                continue;
            }
            // A line with a clock never rests.
            let idle = if speech.protocol.clocked { None } else { idle_level(edges, bit as i64) };
            for inverted in self.polarities() {
                readings.push(self.reading(*speech, vec![Tap { channel, inverted }], idle, &[edges]));
            }
        }
        self.look_again(&mut readings, &[edges]);
        let mut best: Option<Found> = None;
        let mut second: Option<(Speech, i64)> = None;
        for found in readings {
            let (speech, score) = (found.speech, found.evidence.score);
            if best.as_ref().is_none_or(|best| mark(&found) > mark(best)) {
                if let Some(old) = best.replace(found).filter(|old| old.speech != speech) {
                    second = Some((old.speech, old.evidence.score));
                }
            } else if best.as_ref().is_some_and(|best| best.speech != speech)
                && second.is_none_or(|(_, second)| score > second)
            {
                second = Some((speech, score));
            }
        }
        let mut best = best?;
        let close = |score: i64| score > 0 && score as f64 > CLOSE * best.evidence.score as f64;
        best.rival = second.filter(|(_, score)| close(*score));
        if !best.is_certain() {
            best.seen = seen_rate(edges);
        }
        Some(best)
    }

    /// Returns the polarities that the options leave open.
    fn polarities(&self) -> impl Iterator<Item = bool> {
        let given = self.inverted;
        [false, true].into_iter().filter(move |inverted| given.is_none_or(|given| given == *inverted))
    }

    /// Returns a reading at first sight.
    fn reading(&self, speech: Speech, taps: Vec<Tap>, idle: Option<bool>, channels: &[&Edges]) -> Found {
        let (evidence, rates) = self.trial(speech, &taps, channels, Look::Once);
        Found { taps, speech, evidence, rates, idle, seen: None, rival: None, whole: false }
    }

    /// Reads failed frames a second time, if that may still make a reading the best or the second best.
    fn look_again(&self, readings: &mut [Found], channels: &[&Edges]) {
        let most = readings.iter().map(|found| found.evidence.score).max().unwrap_or(0);
        for found in readings {
            let far = most >= CERTAIN && found.evidence.score.saturating_mul(FAR) < most;
            if found.evidence.tally.faults() > 0 && !far && !found.speech.protocol.clocked {
                (found.evidence, found.rates) = self.trial(found.speech, &found.taps, channels, Look::Again);
            }
        }
    }

    /// Returns what a protocol makes of one channel, or of two as one line.
    fn trial(&self, speech: Speech, taps: &[Tap], channels: &[&Edges], look: Look) -> (Evidence, Rates) {
        let mut evidence = Evidence::new(speech.protocol.weights);
        let Some(mut decoder) = speech.protocol.line(speech.rate, &self.settings) else {
            return (evidence, Rates::default());
        };
        if look == Look::Once {
            decoder.look_once();
        }
        let mut wires = Wires::new(taps);
        let mut at = vec![0_usize; channels.len()];
        let mut end = Time::ZERO;
        let mut count = 0;
        // The next edge of all channels.
        while let Some((k, (time, level))) = channels
            .iter()
            .zip(&at)
            .enumerate()
            .filter_map(|(k, (edges, at))| Some((k, *edges.get(*at)?)))
            .min_by_key(|(_, (time, _))| *time)
        {
            if let Some(next) = at.get_mut(k) {
                *next += 1;
            }
            end = time;
            let channel = taps.get(k).map_or(0, |tap| tap.channel);
            // Evidence accepts everything.
            if let Some(level) = wires.change(channel, level) {
                let _ = decoder.change(time, level, &mut evidence);
            }
            count += 1;
            if count % PIECE == 0 && evidence.is_hopeless() {
                break;
            }
        }
        let _ = decoder.finish(end, &mut evidence);
        evidence.until = end;
        (evidence, decoder.rates())
    }

    /// Picks the lines among the readings of channels: a line heard twice counts once; requests and answers on two channels
    /// form one line.
    pub(super) fn lines(
        &self,
        mut readings: Vec<Found>,
        judged: &[u16],
        edges: &dyn Fn(u16) -> Vec<(Time, bool)>,
    ) -> Vec<Found> {
        self.join(&mut readings, edges);
        self.join_unnamed(&mut readings, judged, edges);
        readings.sort_by_key(|found| std::cmp::Reverse(mark(found)));
        let mut lines: Vec<Found> = Vec::new();
        for found in readings {
            let again = |line: &Found| {
                line.speech.protocol == found.speech.protocol
                    && found.evidence.is_part_of(&line.evidence, 3 * line.bit())
            };
            if !lines.iter().any(again) {
                lines.push(found);
            }
        }
        lines
    }

    /// Answers of HIPERFACE DSL prove nothing by themselves, so they are looked for on every channel without another protocol.
    fn join_unnamed(&self, readings: &mut Vec<Found>, judged: &[u16], edges: &dyn Fn(u16) -> Vec<(Time, bool)>) {
        let asks = |found: &Found| {
            let evidence = &found.evidence;
            !found.speech.protocol.answers_alone && evidence.requests > 8 && evidence.alone * 4 < evidence.requests
        };
        for asking in readings.clone().into_iter().filter(asks) {
            let own = asking.taps.clone();
            let other = |channel: &&u16| {
                let sure = |found: &Found| found.is_certain() && found.taps.iter().any(|tap| tap.channel == **channel);
                !own.iter().any(|tap| tap.channel == **channel) && !readings.iter().any(sure)
            };
            let mut best: Option<Found> = None;
            for channel in judged.iter().filter(other) {
                for inverted in [false, true] {
                    let taps: Vec<Tap> = own.iter().copied().chain([Tap { channel: *channel, inverted }]).collect();
                    let lines: Vec<Vec<(Time, bool)>> = taps.iter().map(|tap| edges(tap.channel)).collect();
                    let lines: Vec<&Edges> =
                        lines.iter().filter_map(|edges| edges.get(..SAMPLE.min(edges.len()))).collect();
                    let (evidence, rates) = self.trial(asking.speech, &taps, &lines, Look::Again);
                    let found = Found { taps, evidence, rates, ..asking.clone() };
                    let most = best.as_ref().map_or(asking.evidence.alone, |best| best.evidence.alone);
                    if found.evidence.alone > most {
                        best = Some(found);
                    }
                }
            }
            if let Some(best) = best {
                readings
                    .retain(|found| !found.taps.iter().any(|tap| best.taps.iter().any(|t| t.channel == tap.channel)));
                readings.push(best);
            }
        }
    }

    /// Joins requests alone on one channel with their answers on another.
    fn join(&self, readings: &mut Vec<Found>, edges: &dyn Fn(u16) -> Vec<(Time, bool)>) {
        let asks = |found: &Found| found.evidence.requests > 0 && found.evidence.answers * 4 < found.evidence.requests;
        let answers = |found: &Found| found.evidence.alone > found.evidence.requests;
        let mut pairs = Vec::new();
        for (a, asking) in readings.iter().enumerate().filter(|(_, found)| asks(found)) {
            for (b, answering) in readings.iter().enumerate().filter(|(_, found)| answers(found)) {
                if a == b || asking.speech.protocol != answering.speech.protocol {
                    continue;
                }
                let taps: Vec<Tap> = asking.taps.iter().chain(&answering.taps).copied().collect();
                let channels: Vec<Vec<(Time, bool)>> = taps.iter().map(|tap| edges(tap.channel)).collect();
                let channels: Vec<&Edges> =
                    channels.iter().filter_map(|edges| edges.get(..SAMPLE.min(edges.len()))).collect();
                let (evidence, rates) = self.trial(answering.speech, &taps, &channels, Look::Again);
                if evidence.answers > 0 && evidence.score > answering.evidence.score {
                    pairs.push((evidence.score, a, b, Found { taps, evidence, rates, ..answering.clone() }));
                }
            }
        }
        pairs.sort_by_key(|(score, ..)| std::cmp::Reverse(*score));
        let mut used: Vec<usize> = Vec::new();
        for (_, a, b, found) in pairs {
            if !used.contains(&a) && !used.contains(&b) {
                used.extend([a, b]);
                readings.push(found);
            }
        }
        let mut at = 0;
        readings.retain(|_| {
            at += 1;
            !used.contains(&(at - 1))
        });
    }
}

/// Returns what makes one reading better than another: sound frames, then the level at which the line rests.
fn mark(found: &Found) -> (i64, bool, bool) {
    let inverted = found.is_inverted();
    (found.evidence.score, found.idle.is_none_or(|idle| idle != inverted), !inverted)
}

/// Returns whether there are any runs of about this bit length. With spikes beside every edge, two of three runs are spikes.
fn may_run_at(edges: &Edges, bit: f64) -> bool {
    let (mut short, mut fitting, mut all) = (0_u32, 0_u32, 0_u32);
    for pair in edges.windows(2).take(1024) {
        let [(from, _), (to, _)] = pair else { continue };
        let bits = (*to - *from) as f64 / bit;
        all += 1;
        short += u32::from(bits < 0.375);
        fitting += u32::from((0.45..3.6).contains(&bits));
    }
    5 * short <= 4 * all && 12 * fitting >= all
}

/// Returns the level, weighted by time, of runs longer than any in a field. The level before the first edge may be from
/// before power-on:
/// it counts only if nothing else does.
pub(super) fn idle_level(edges: &Edges, bit: i64) -> Option<bool> {
    let later = edges.get(1..).unwrap_or_default();
    level_of_rest(later, bit).or_else(|| level_of_rest(edges, bit))
}

fn level_of_rest(edges: &Edges, bit: i64) -> Option<bool> {
    let (mut high, mut low) = (0_i64, 0_i64);
    for pair in edges.windows(2) {
        let [(from, level), (to, _)] = pair else { continue };
        let length = *to - *from;
        if length > 20 * bit {
            let sum = if *level { &mut high } else { &mut low };
            *sum = sum.saturating_add(length);
        }
    }
    (high != low).then_some(high > low)
}

/// Estimates the rate from the runs of a channel, in bits per second: by the shortest length that is too frequent to be a
/// spike. `None` if there are hardly any runs.
pub(super) fn seen_rate(edges: &Edges) -> Option<f64> {
    let mut lengths: Vec<f64> = edges
        .windows(2)
        .filter_map(|pair| match pair {
            [(from, _), (to, _)] => Some((*to - *from) as f64),
            _ => None,
        })
        .filter(|length| *length > 0.0)
        .collect();
    lengths.sort_by(f64::total_cmp);
    let enough = (lengths.len() / 32).max(2);
    let bit = lengths.iter().enumerate().find_map(|(k, shortest)| {
        let group: Vec<f64> =
            lengths.get(k..)?.iter().copied().take_while(|length| *length <= 1.4 * shortest).collect();
        (group.len() >= enough).then(|| group.iter().sum::<f64>() / group.len() as f64)
    })?;
    let (mut time, mut bits) = (0.0, 0.0);
    for length in lengths.iter().take_while(|length| **length < 9.5 * bit) {
        let count = (length / bit).round();
        if count > 0.0 && (length - count * bit).abs() < 0.3 * bit {
            time += length;
            bits += count;
        }
    }
    Some(1e12 / if bits > 0.0 { time / bits } else { bit })
}
