//! Explains in one line why nothing was found on a capture's channels.

use super::survey::{Edges, seen_rate};
use crate::codec::Codec;
use crate::protocols::meant;
use crate::recognition::mbit;

/// Explains why no channel can be decoded. `busiest`: the channel with most edges, and the first of these; `moves`: edges
/// by channel.
pub(super) fn nothing(
    busiest: Option<(u16, &Edges)>,
    moves: &[u64],
    names: &[String],
    protocol: Option<&'static dyn Codec>,
    only: Option<&[u16]>,
) -> String {
    let name = |channel: u16| names.get(usize::from(channel)).map_or("", String::as_str);
    let Some((channel, edges)) = busiest else {
        let moved = |channel: u16| moves.get(usize::from(channel)).copied().unwrap_or(0).saturating_sub(1);
        if let Some([channel]) = only {
            return format!("no traffic on channel \"{}\": {} edges", name(*channel), moved(*channel));
        }
        let most = (0_u16..).zip(names).map(|(channel, _)| moved(channel)).max().unwrap_or(0);
        return format!("no traffic: at most {most} edges on any of {} channels", names.len());
    };
    strange(name(channel), edges, protocol)
}

/// Explains a channel with edges but without frames.
fn strange(name: &str, edges: &Edges, protocol: Option<&'static dyn Codec>) -> String {
    let of_lines = || meant(protocol).filter(|protocol| !protocol.rates.is_empty());
    let rates = |protocol: &'static dyn Codec| {
        let rates = protocol.rates.iter().map(|rate| mbit(f64::from(*rate)).to_string()).collect::<Vec<_>>();
        let (last, first) = rates.split_last().map_or(("", &[][..]), |(last, first)| (last.as_str(), first));
        let list = if first.is_empty() { last.to_owned() } else { format!("{} and {last}", first.join(", ")) };
        format!("{} has {list} Mbit/s", protocol.title)
    };
    let known = of_lines().map(rates).collect::<Vec<_>>().join(", ");
    let Some(seen) = seen_rate(edges) else {
        return format!("nothing on channel \"{name}\" is decoded: {known}");
    };
    let digits = (2.0 - mbit(seen).log10().floor()).clamp(0.0, 6.0) as usize;
    let near = |rate: &u32| (seen / f64::from(*rate) - 1.0).abs() < 0.05;
    if of_lines().any(|protocol| protocol.rates.iter().any(near)) {
        return format!(
            "channel \"{name}\" runs at about {:.digits$} Mbit/s, but hardly a frame on it holds: {known}; \
             say what it is with --protocol",
            mbit(seen)
        );
    }
    format!(
        "channel \"{name}\" runs at about {:.digits$} Mbit/s, where {known}; if that is right, give it with --bit-rate",
        mbit(seen)
    )
}
