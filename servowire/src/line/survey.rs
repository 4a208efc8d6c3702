//! What the first changes tell: which channel, how fast, which way up.

use std::fmt;

use super::{EdgeReceiver, Options, Setup, StartStop};
use crate::capture::Change;
use crate::output::Tally;

/// A nominal rate is met within this share.
const TOLERANCE: f64 = 0.025;

/// Fewer changes, the level at the beginning included, are no traffic: the shortest frame has four edges.
const FEWEST: usize = 5;

/// A line that can be decoded, and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// What to decode.
    pub setup: Setup,
    /// Name of the channel.
    name: String,
    /// Bits a second as seen; none where the runs do not tell.
    seen: Option<f64>,
    /// The level at which the line rests, where it does.
    idle: Option<bool>,
}

impl fmt::Display for Survey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { setup, name, seen, idle } = self;
        let rests = match (setup.inverted, idle) {
            (false, Some(false)) => "taken as idling high, though it idles low (A and B swapped?)",
            (false, _) => "idles high",
            (true, Some(true)) => "taken as idling low, though it idles high",
            (true, _) => "idles low (A and B swapped) and is decoded inverted",
        };
        write!(f, "channel \"{name}\" {rests}, {} Mbit/s", f64::from(setup.rate) / 1e6)?;
        match seen.map(|seen| (seen, (seen / f64::from(setup.rate) - 1.0) * 100.0)) {
            Some((_, off)) if off.abs() < 10.0 => write!(f, " ({off:+.2} % on the line)"),
            Some((seen, _)) => write!(f, ", though the runs look like {:.3} Mbit/s", seen / 1e6),
            None => Ok(()),
        }
    }
}

/// Finds the line to decode among the channels, as far as the options leave it open.
///
/// The bit rate comes from the lengths of the runs; channel and polarity are those that decode best.
pub fn survey<P: StartStop>(
    changes: &[Change],
    reached: i64,
    channels: &[String],
    options: &Options,
    make: &dyn Fn(i64) -> P,
) -> Result<Survey, String> {
    let wanted = options.channel.as_deref().map(|name| find(name, channels)).transpose()?;
    let mut best: Option<(Survey, (u64, i64, bool, bool))> = None;
    let mut misfits = Vec::new();
    for (channel, name) in (0_u16..).zip(channels) {
        if wanted.is_some_and(|wanted| wanted != channel) {
            continue;
        }
        let own: Vec<(i64, bool)> =
            changes.iter().filter(|c| c.channel == channel).map(|c| (c.time, c.level)).collect();
        let (rate, seen) = match options.bit_rate {
            Some(rate) => (rate, bit_rate(&own, &[rate]).seen()),
            None if own.len() < FEWEST => continue,
            None => match bit_rate(&own, P::RATES) {
                Rate::Nominal { rate, seen } => (rate, Some(seen)),
                Rate::Other(seen) => {
                    misfits.push((name, seen));
                    continue;
                }
                Rate::Unclear => continue,
            },
        };
        for inverted in [false, true] {
            if options.inverted.is_some_and(|given| given != inverted) {
                continue;
            }
            let setup = Setup { channel, rate, inverted };
            let tally = trial(&own, reached, setup, &mut make(setup.bit()));
            let idle = idle_level(&own, setup.bit());
            let idles_so = idle.is_none_or(|idle| idle != inverted);
            let second = if tally.ok > 0 { -(tally.refused as i64) } else { own.len() as i64 };
            let score = (tally.ok, second, idles_so, !inverted);
            // With equal marks the first stays.
            if best.as_ref().is_none_or(|(_, mark)| score > *mark) {
                best = Some((Survey { setup, name: name.clone(), seen, idle }, score));
            }
        }
    }
    best.map(|(found, _)| found).ok_or_else(|| nothing::<P>(changes, channels, wanted, &misfits))
}

/// Why no channel can be decoded.
fn nothing<P: StartStop>(
    changes: &[Change],
    channels: &[String],
    wanted: Option<u16>,
    misfits: &[(&String, f64)],
) -> String {
    let protocol = P::NAME;
    let rates = P::RATES.iter().map(|rate| (f64::from(*rate) / 1e6).to_string()).collect::<Vec<_>>().join(" and ");
    if let Some((name, seen)) = misfits.first() {
        let digits = (2.0 - (seen / 1e6).log10().floor()).clamp(0.0, 6.0) as usize;
        let mbit = seen / 1e6;
        return format!(
            "channel \"{name}\" runs at about {mbit:.digits$} Mbit/s, where {protocol} has {rates} Mbit/s; \
             if that is right, say it with --bit-rate"
        );
    }
    let edges = |channel: u16| changes.iter().filter(|c| c.channel == channel).count().saturating_sub(1);
    if let Some(channel) = wanted {
        let name = channels.get(usize::from(channel)).map_or("", String::as_str);
        return format!("no traffic on channel \"{name}\": {} edges", edges(channel));
    }
    let most = (0_u16..).zip(channels).map(|(channel, _)| edges(channel)).max().unwrap_or(0);
    format!("no traffic: at most {most} edges on any of {} channels", channels.len())
}

/// A channel by its name, or by its number from 0.
fn find(name: &str, channels: &[String]) -> Result<u16, String> {
    let by_name = channels.iter().position(|c| c == name).or_else(|| {
        let last = |c: &String| c.rsplit('.').next().is_some_and(|end| end == name);
        channels.iter().position(last)
    });
    let by_number = || name.parse().ok().filter(|&n: &usize| n < channels.len());
    by_name.or_else(by_number).and_then(|index| u16::try_from(index).ok()).ok_or_else(|| {
        let shown = channels.iter().take(20).map(|c| format!("\"{c}\"")).collect::<Vec<_>>().join(", ");
        let more = if channels.len() > 20 { ", ..." } else { "" };
        format!("no channel \"{name}\"; the file has {shown}{more}")
    })
}

/// The lengths between changes of level.
fn runs(own: &[(i64, bool)]) -> impl Iterator<Item = (bool, i64)> {
    let mut edges = own.to_vec();
    edges.dedup_by_key(|(_, level)| *level);
    let ends = edges.clone();
    edges.into_iter().zip(ends.into_iter().skip(1)).map(|((from, level), (to, _))| (level, to.saturating_sub(from)))
}

/// What the runs say of the rate, in bits a second.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rate {
    /// One that the protocol has.
    Nominal {
        /// As the protocol has it.
        rate: u32,
        /// As it is on the line.
        seen: f64,
    },
    /// Another one.
    Other(f64),
    /// Too little to tell.
    Unclear,
}

impl Rate {
    fn seen(self) -> Option<f64> {
        match self {
            Self::Nominal { seen, .. } | Self::Other(seen) => Some(seen),
            Self::Unclear => None,
        }
    }
}

fn bit_rate(own: &[(i64, bool)], rates: &[u32]) -> Rate {
    let mut lengths: Vec<f64> = runs(own).map(|(_, length)| length as f64).filter(|length| *length > 0.0).collect();
    lengths.sort_by(f64::total_cmp);
    let fitting = rates.iter().find_map(|rate| Some((*rate, fit(&lengths, 1e12 / f64::from(*rate))?)));
    match fitting {
        Some((rate, seen)) if (seen / f64::from(rate) - 1.0).abs() <= TOLERANCE => Rate::Nominal { rate, seen },
        Some((_, seen)) => Rate::Other(seen),
        None => shortest_bit(&lengths).map_or(Rate::Unclear, |bit| Rate::Other(1e12 / mean_bit(&lengths, bit).0)),
    }
}

/// The rate seen, if the sorted lengths are whole numbers of bits of about `bit` picoseconds and some are one bit.
fn fit(lengths: &[f64], bit: f64) -> Option<f64> {
    let runs = lengths.partition_point(|length| *length < 9.5 * bit);
    let single =
        lengths.partition_point(|length| *length < 1.25 * bit) - lengths.partition_point(|length| *length < 0.75 * bit);
    let (mean, fitting) = mean_bit(lengths, bit);
    let enough = 10 * fitting >= 8 * runs && 32 * single >= runs && single > 0;
    enough.then(|| 1e12 / mean)
}

/// The mean bit of the runs of up to nine bits that fit `bit`, and how many these are. Over long runs it is exact,
/// because all edges are off by the same few nanoseconds.
fn mean_bit(lengths: &[f64], bit: f64) -> (f64, usize) {
    let (mut time, mut bits, mut fitting) = (0.0, 0.0, 0);
    for length in lengths.iter().take_while(|length| **length < 9.5 * bit) {
        let count = (length / bit).round();
        if count > 0.0 && (length - count * bit).abs() < 0.3 * bit {
            time += length;
            bits += count;
            fitting += 1;
        }
    }
    (if bits > 0.0 { time / bits } else { bit }, fitting)
}

/// The shortest length that is frequent enough not to be a spike.
fn shortest_bit(lengths: &[f64]) -> Option<f64> {
    let enough = (lengths.len() / 32).max(2);
    lengths.iter().enumerate().find_map(|(k, shortest)| {
        let group: Vec<f64> =
            lengths.get(k..)?.iter().copied().take_while(|length| *length <= 1.4 * shortest).collect();
        (group.len() >= enough).then(|| group.iter().sum::<f64>() / group.len() as f64)
    })
}

/// The level of what is longer than any field's run, by time.
fn idle_level(own: &[(i64, bool)], bit: i64) -> Option<bool> {
    let (mut high, mut low) = (0_i64, 0_i64);
    for (level, length) in runs(own).filter(|(_, length)| *length > 20 * bit) {
        let sum = if level { &mut high } else { &mut low };
        *sum = sum.saturating_add(length);
    }
    (high != low).then_some(high > low)
}

/// What the protocol makes of the changes.
fn trial<P: StartStop>(own: &[(i64, bool)], reached: i64, setup: Setup, protocol: &mut P) -> Tally {
    let mut receiver = EdgeReceiver::new(setup, P::CONTENT_BITS);
    let mut tally = Tally::default();
    protocol.begin(own.first().map_or(0, |(time, _)| *time));
    // A tally takes whatever comes.
    for (time, level) in own {
        if let Some(field) = receiver.change(*time, *level) {
            let _ = protocol.field(&field, &mut tally);
        }
    }
    if let Some(field) = receiver.finish(reached) {
        let _ = protocol.field(&field, &mut tally);
    }
    let _ = protocol.finish(Some(reached), &mut tally);
    tally
}
