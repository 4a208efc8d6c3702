//! One field received in three ways, and windows at any offset.

use nrz_line::{BitOrder, Receiver, Samples, Window};

use super::{Tally, Topic, each};
use crate::kernels::nrz_line::{BUFFERS, Buffer, CONTENT, LEVELS, RECEIVER, RUNS, WORDS};

pub(crate) const TOPICS: &[Topic] = &[("nrz-line/reception", reception), ("nrz-line/windows", windows)];

/// A way to receive a field, by name.
type Way = (&'static str, fn(&mut Receiver) -> Option<u16>);

fn reception() -> Tally {
    let ways: [Way; 3] = [("samples", by_sample), ("runs", by_run), ("words", by_word)];
    each(&ways, |(name, _)| name, |(_, receive)| receive(&mut { RECEIVER }) == Some(CONTENT))
}

fn by_sample(receiver: &mut Receiver) -> Option<u16> {
    LEVELS.iter().find_map(|level| receiver.push(*level)).map(|field| field.content)
}

fn by_run(receiver: &mut Receiver) -> Option<u16> {
    RUNS.iter().find_map(|(level, len)| receiver.run(*level, *len)).map(|field| field.content)
}

fn by_word(receiver: &mut Receiver) -> Option<u16> {
    WORDS.iter().find_map(|word| receiver.feed(&mut Samples::new(*word))).map(|field| field.content)
}

/// What is read at an offset is written there again, and its inverse is something else.
fn windows() -> Tally {
    each(
        &BUFFERS,
        |_| "of a window",
        |buffer| [BitOrder::LsbFirst, BitOrder::MsbFirst].iter().all(|o| is_kept(buffer, *o)),
    )
}

fn is_kept((bytes, offset): &Buffer, order: BitOrder) -> bool {
    let written = |window: Window| {
        let mut out = *bytes;
        window.write(&mut out, *offset, order).map(|()| out)
    };
    let Ok(window) = Window::read(bytes, *offset, 110, order) else { return false };
    written(window) == Ok(*bytes) && written(window.inverted()) != Ok(*bytes)
}
