//! Describes what was recognised in a capture, and why, as values that print as a sentence.

use std::collections::BTreeMap;
use std::fmt;

use crate::codec::Codec;
use crate::line::receive::Rates;
use crate::sink::Tally;

/// Spikes are mentioned if there is at least one in this many edges.
const SPIKY: u64 = 50;

/// Shows a rate in bits per second as Mbit/s.
pub(crate) fn mbit(rate: f64) -> f64 {
    rate / 1e6
}

/// The protocol recognised on a line, and the evidence for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recognition {
    /// The name of its channel, or of the channels of the requests and the answers.
    pub channels: Vec<String>,
    /// The protocol.
    pub protocol: &'static dyn Codec,
    /// The rate of the protocol in bits per second.
    pub rate: u32,
    /// Whether the line is decoded inverted.
    pub inverted: bool,
    /// The level at which the line idles, if it does.
    pub idle: Option<bool>,
    /// The rate that the runs of the line suggest, in bits per second.
    pub seen: Option<f64>,
    /// The measurements of the line.
    pub rates: Rates,
    /// The first frames by their verdict.
    pub tally: Tally,
    /// Whether these are all the frames.
    pub whole: bool,
    /// The next best protocol and rate of the same channel, if it is close.
    pub rival: Option<(&'static dyn Codec, u32)>,
}

/// `channel "A" idles high, 2.5 Mbit/s (+0.00 % on the line): T-Format, 24 of 24 frames hold`
impl fmt::Display for Recognition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.channels.as_slice() {
            [tx, rx] => write!(f, "channels \"{tx}\" (requests) and \"{rx}\" (answers)"),
            channels => write!(f, "channel \"{}\"", channels.join(" + ")),
        }?;
        let rests = match (self.inverted, self.idle) {
            (false, _) if self.rates.floats_low => {
                "floats low, no bias: nobody drives it between frames; taken as high there"
            }
            (false, Some(false)) => "taken as idling high, though it idles low (A and B swapped?)",
            (false, _) if self.channels.len() > 1 => "idle high",
            (false, _) => "idles high",
            (true, Some(true)) => "taken as idling low, though it idles high",
            (true, _) => "idles low (A and B swapped) and is decoded inverted",
        };
        let rate = f64::from(self.rate);
        write!(f, " {rests}, {} Mbit/s", mbit(rate))?;
        let off = |share: f64| (share - 1.0) * 100.0;
        // No sign for what is no difference.
        let none = |off: f64| if off.abs() < 0.05 { 0.0 } else { off };
        let wide = off(self.rates.most) - off(self.rates.least) > 1.0;
        let ends = self.rates.ends().or(wide.then_some([self.rates.least, self.rates.most])).unwrap_or_default();
        let strange = self.seen.filter(|seen| (seen / rate - 1.0).abs() > 0.1);
        match (strange, self.rates.mean()) {
            (Some(seen), _) => write!(f, ", though the runs look like {:.3} Mbit/s", mbit(seen))?,
            (None, Some(_)) if ends[1] - ends[0] > 0.0 => {
                write!(f, " ({:+.1} to {:+.1} % on the line)", none(off(ends[0])), none(off(ends[1])))?;
            }
            (None, Some(mean)) => {
                // No sign for what is no difference.
                let off = if off(mean).abs() < 0.005 { 0.0 } else { off(mean) };
                write!(f, " ({off:+.2} % on the line)")?;
            }
            (None, None) => {}
        }
        let Tally { ok, refused, .. } = self.tally;
        let first = if self.whole { "" } else { "the first " };
        write!(f, ": {}, {ok} of {first}{} frames hold", self.protocol.title, ok + refused)?;
        if let Some((protocol, rate)) = self.rival {
            write!(f, "; next {} at {} Mbit/s", protocol.title, mbit(f64::from(rate)))?;
        }
        if self.rates.spikes * SPIKY > self.rates.edges {
            write!(f, "; {} spikes", self.rates.spikes)?;
            let [rising, falling] = self.rates.spikes_at;
            let (most, near) = (rising.max(falling), rising + falling);
            if 4 * near > 3 * self.rates.spikes {
                let edges = if falling > rising { "falling" } else { "rising" };
                let bits = self.rates.spike_bits / near as f64;
                let edges = if 4 * most > 3 * near { edges } else { "all" };
                write!(f, " of {bits:.1} bit on {edges} edges")?;
            }
            write!(f, " beside {} edges: check termination", self.rates.edges)?;
        }
        if self.rates.dips > 0 {
            let bits = self.rates.dip_bits / self.rates.dips as f64;
            write!(f, "; {} dips of {bits:.1} bits when a driver lets go: check the bias", self.rates.dips)?;
        }
        Ok(())
    }
}

/// Notes to a user who decodes a capture.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// A line was found.
    Line {
        /// The file.
        file: String,
        /// What is on the line.
        line: Recognition,
    },
    /// A line is not what the user said it is.
    LineRather {
        /// The file.
        file: String,
        /// What it looks like.
        line: Recognition,
    },
    /// More channels have edges than are tried.
    Channels {
        /// The file.
        file: String,
        /// Number of channels with edges.
        moving: usize,
        /// Number of channels tried.
        tried: usize,
    },
    /// Packets of ordinary network traffic were skipped.
    Traffic {
        /// The file.
        file: String,
        /// Their numbers by kind.
        packets: BTreeMap<&'static str, u64>,
    },
    /// A log of bytes was recognised.
    Log {
        /// The protocol.
        protocol: &'static dyn Codec,
        /// Share of good frames among the first frames, in per cent.
        share: u64,
    },
    /// A log is not what the user said it is.
    LogRather {
        /// The protocol.
        protocol: &'static dyn Codec,
        /// The first frames by their verdict.
        tally: Tally,
    },
    /// The appearance of a log as a whole.
    Shape(String),
}

/// Describes packets of ordinary network traffic.
pub(crate) fn traffic(packets: &BTreeMap<&'static str, u64>) -> String {
    let kinds: Vec<String> = packets.iter().map(|(name, count)| format!("{name} {count}")).collect();
    format!("{} packets of ordinary network traffic ({})", packets.values().sum::<u64>(), kinds.join(", "))
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let so = "frames are valid that way; leave out the option that says otherwise";
        match self {
            Self::Line { file, line } => write!(f, "{file}: {line}"),
            Self::LineRather { file, line } => {
                let (title, Tally { ok, refused, .. }) = (line.protocol.title, line.tally);
                let upside = if line.inverted { ", inverted" } else { "" };
                let rate = mbit(f64::from(line.rate));
                write!(f, "{file}: it looks like {title} at {rate} Mbit/s{upside}: {ok} of {} {so}", ok + refused)
            }
            Self::Channels { file, moving, tried } => {
                write!(
                    f,
                    "{file}: {moving} channels move, and only the {tried} busiest were tried: name one with --channel"
                )
            }
            Self::Traffic { file, packets } => write!(f, "{file}: {} were skipped", traffic(packets)),
            Self::Log { protocol, share } => {
                write!(f, "taken as {}, of which {share} % of the first frames hold", protocol.title)
            }
            Self::LogRather { protocol, tally } => {
                let (ok, all) = (tally.ok, tally.ok + tally.faults());
                write!(f, "it looks like {}: {ok} of {all} {so}", protocol.title)
            }
            Self::Shape(text) => f.write_str(text),
        }
    }
}
