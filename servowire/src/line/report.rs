//! What was found on a capture's channels, and why nothing was, in a line each.

use std::fmt::Write as _;

use super::survey::{Edges, Found, Speech, seen_rate};
use super::watch::Watch;
use crate::protocols::Protocol;

/// Spikes are worth a word from one in so many edges on.
const SPIKY: u64 = 50;

fn mbit(rate: f64) -> f64 {
    rate / 1e6
}

/// `channel "A" idles high, 2.5 Mbit/s (+0.00 % on the line): T-Format, 24 of 24 frames hold`
pub(super) fn found(found: &Found, names: &[&str]) -> String {
    let mut text = match names {
        [tx, rx] => format!("channels \"{tx}\" (requests) and \"{rx}\" (answers)"),
        _ => format!("channel \"{}\"", names.join(" + ")),
    };
    let inverted = found.is_inverted();
    let rests = match (inverted, found.idle) {
        (false, Some(false)) => "taken as idling high, though it idles low (A and B swapped?)",
        (false, _) if names.len() > 1 => "idle high",
        (false, _) => "idles high",
        (true, Some(true)) => "taken as idling low, though it idles high",
        (true, _) => "idles low (A and B swapped) and is decoded inverted",
    };
    let rate = f64::from(found.speech.rate);
    let _ = write!(text, " {rests}, {} Mbit/s", mbit(rate));
    let off = |share: f64| (share - 1.0) * 100.0;
    match found.rates.mean() {
        _ if found.seen.is_some_and(|seen| (seen / rate - 1.0).abs() > 0.1) => {}
        Some(_) if off(found.rates.most) - off(found.rates.least) > 1.0 => {
            let _ = write!(text, " ({:+.1} to {:+.1} % on the line)", off(found.rates.least), off(found.rates.most));
        }
        Some(mean) => {
            // No sign for what is no difference.
            let off = if off(mean).abs() < 0.005 { 0.0 } else { off(mean) };
            let _ = write!(text, " ({off:+.2} % on the line)");
        }
        None => {}
    }
    if let Some(seen) = found.seen.filter(|seen| (seen / rate - 1.0).abs() > 0.1) {
        let _ = write!(text, ", though the runs look like {:.3} Mbit/s", mbit(seen));
    }
    let tally = found.evidence.tally;
    let _ =
        write!(text, ": {}, {} of {} frames hold", found.speech.protocol.title(), tally.ok, tally.ok + tally.refused);
    if let Some((speech, _)) = found.rival {
        let _ = write!(text, "; next {} at {} Mbit/s", speech.protocol.title(), mbit(f64::from(speech.rate)));
    }
    if found.rates.spikes * SPIKY > found.rates.edges {
        let _ = write!(text, "; {} spikes beside {} edges: check termination", found.rates.spikes, found.rates.edges);
    }
    text
}

/// `it looks like A-format at 2.5 Mbit/s: 12 of 12 frames hold so; leave out what says otherwise`
pub(super) fn rather(found: &Found) -> String {
    let (Speech { protocol, rate }, tally) = (found.speech, found.evidence.tally);
    let upside = if found.is_inverted() { ", inverted" } else { "" };
    format!(
        "it looks like {} at {} Mbit/s{upside}: {} of {} frames hold so; leave out what says otherwise",
        protocol.title(),
        mbit(f64::from(rate)),
        tally.ok,
        tally.ok + tally.refused
    )
}

/// Why no channel can be decoded.
pub(super) fn nothing(watch: &Watch<'_>, protocol: Protocol, names: &[String], only: Option<&[u16]>) -> String {
    let name = |channel: u16| names.get(usize::from(channel)).map_or("", String::as_str);
    let Some((channel, edges)) = &watch.busiest else {
        let moved = |channel: u16| watch.moves.get(usize::from(channel)).copied().unwrap_or(0).saturating_sub(1);
        if let Some([channel]) = only {
            return format!("no traffic on channel \"{}\": {} edges", name(*channel), moved(*channel));
        }
        let most = (0_u16..).zip(names).map(|(channel, _)| moved(channel)).max().unwrap_or(0);
        return format!("no traffic: at most {most} edges on any of {} channels", names.len());
    };
    strange(name(*channel), edges, protocol)
}

/// A channel that moves and holds nothing.
fn strange(name: &str, edges: &Edges, protocol: Protocol) -> String {
    let rates = |protocol: &Protocol| {
        let rates = protocol.rates().iter().map(|rate| mbit(f64::from(*rate)).to_string()).collect::<Vec<_>>();
        let (last, first) = rates.split_last().map_or(("", &[][..]), |(last, first)| (last.as_str(), first));
        let list = if first.is_empty() { last.to_owned() } else { format!("{} and {last}", first.join(", ")) };
        format!("{} has {list} Mbit/s", protocol.title())
    };
    let known = protocol.of_lines().iter().map(rates).collect::<Vec<_>>().join(", ");
    let Some(seen) = seen_rate(edges) else {
        return format!("nothing on channel \"{name}\" is decoded: {known}");
    };
    let digits = (2.0 - mbit(seen).log10().floor()).clamp(0.0, 6.0) as usize;
    let near = |rate: &u32| (seen / f64::from(*rate) - 1.0).abs() < 0.05;
    if protocol.of_lines().iter().any(|protocol| protocol.rates().iter().any(near)) {
        return format!(
            "channel \"{name}\" runs at about {:.digits$} Mbit/s, but hardly a frame on it holds: {known}; \
             say what it is with --protocol",
            mbit(seen)
        );
    }
    format!(
        "channel \"{name}\" runs at about {:.digits$} Mbit/s, where {known}; if that is right, say it with --bit-rate",
        mbit(seen)
    )
}
