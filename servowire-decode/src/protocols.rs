//! The protocols that can be decoded.
//!
//! To add one, write a file below `protocols/` that turns the input of its line into [`Event`](crate::event::Event)s by a
//! [`Codec`], and add a line to [`CODECS`]. A start-stop protocol implements [`StartStop`](crate::line::StartStop), any
//! other protocol on a pair of wires [`LineDecoder`](crate::line::LineDecoder); the survey then finds it automatically.

mod group;
pub mod hdsl;
pub mod nikon;
mod plausible;
pub mod rtex;
pub mod sorte;
pub mod tformat;

use crate::codec::Codec;

/// All of them. If nothing else distinguishes them, the first is taken.
pub const CODECS: &[&dyn Codec] = &[&tformat::Tformat, &nikon::Nikon, &hdsl::Hdsl, &rtex::Rtex, &sorte::Sorte];

/// Returns the protocols in question: the one that was named, or all.
pub(crate) fn meant(protocol: Option<&'static dyn Codec>) -> impl Iterator<Item = &'static dyn Codec> {
    CODECS.iter().copied().filter(move |codec| protocol.is_none_or(|protocol| protocol == *codec))
}
