//! The protocols that can be decoded.
//!
//! To add one: a file below `protocols/` that turns what its line delivers into [`Event`](crate::event::Event)s by a
//! [`Codec`], and a line in [`CODECS`]. A start-stop protocol implements
//! [`StartStop`](crate::line::StartStop), another one on a pair of wires [`LineDecoder`](crate::line::LineDecoder); the
//! survey then finds it by itself.

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

/// The protocols that are meant: the one that was named, or all.
pub(crate) fn meant(protocol: Option<&'static dyn Codec>) -> impl Iterator<Item = &'static dyn Codec> {
    CODECS.iter().copied().filter(move |codec| protocol.is_none_or(|protocol| protocol == *codec))
}
