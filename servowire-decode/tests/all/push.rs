//! What is pushed in edge by edge says the same as a file; a file as vectors is what was read.

use servowire_decode::capture::{Capture, Change, columns};
use servowire_decode::line::PushDecoder;
use servowire_decode::output::Output;
use servowire_decode::protocols::CODECS;
use servowire_decode::settings::Settings;
use servowire_decode::time::Time;

use crate::{Keep, events, line};

/// All changes of a capture and its end.
fn changes(name: &str, bytes: &'static [u8]) -> (Vec<String>, Vec<Change>, Time) {
    let mut line = line(name, bytes);
    let mut changes = Vec::new();
    while line.read(&mut changes).unwrap() {}
    (line.channels().to_vec(), changes, line.reached())
}

#[test]
fn edges_pushed_in_pieces_say_what_the_file_says() {
    for codec in CODECS {
        for (name, bytes) in codec.captures {
            let due = events(name, Capture::Edges(line(name, bytes)), Some(*codec));
            assert!(due.iter().filter(|event| event.verdict.is_ok()).count() > 1, "{name}: {due:?}");
            let (channels, changes, end) = changes(name, bytes);
            for size in [1, 7, 1000] {
                let mut keep = Keep::default();
                let mut out = Output::new(name, &mut keep);
                let mut decoder = PushDecoder::new(name, &channels, Some(*codec), &Settings::default()).unwrap();
                for piece in changes.chunks(size) {
                    decoder.changes(piece, &mut out).unwrap();
                    decoder.reach(piece.last().unwrap().time, &mut out).unwrap();
                }
                decoder.finish(end, &mut out).unwrap();
                assert_eq!(keep.0, due, "{name} in pieces of {size}");
            }
        }
    }
}

#[test]
fn a_pause_shows_what_is_certain_before_the_end() {
    let (name, bytes) = CODECS[0].captures[0];
    let (channels, changes, end) = changes(name, bytes);
    let mut keep = Keep::default();
    let mut out = Output::new(name, &mut keep);
    let mut decoder = PushDecoder::new(name, &channels, None, &Settings::default()).unwrap();
    // Half of a recording that is too short to be judged without being asked.
    let (first, second) = changes.split_at(changes.len() / 2);
    decoder.changes(first, &mut out).unwrap();
    decoder.reach(first.last().unwrap().time, &mut out).unwrap();
    assert_eq!(out.tally.ok, 0);
    decoder.pause(first.last().unwrap().time, &mut out).unwrap();
    assert!(out.tally.ok > 4, "{:?}", out.tally);
    decoder.changes(second, &mut out).unwrap();
    decoder.finish(end, &mut out).unwrap();
    assert_eq!(keep.0.len(), 18);
}

#[test]
fn columns_are_the_changes() {
    for (name, bytes) in CODECS.iter().flat_map(|codec| codec.captures) {
        let (channels, changes, _) = changes(name, bytes);
        let columns = columns(line(name, bytes).as_mut()).unwrap();
        assert_eq!(columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>(), channels);
        for (channel, column) in (0_u16..).zip(&columns) {
            let own: Vec<(Time, bool)> =
                changes.iter().filter(|it| it.channel == channel).map(|it| (it.time, it.level)).collect();
            assert!(own.len() > 10, "{name}");
            assert!(column.times.iter().copied().zip(column.levels.iter().copied()).eq(own), "{name}");
        }
    }
}
