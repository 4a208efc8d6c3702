use proptest::prelude::*;
use std::vec::Vec;

use super::*;
use crate::cut_through::Rewriter;
use crate::place::Place;
use crate::status::Status;

fn pass_all(lengths: &[Entry]) -> Discovery {
    let mut bytes = Discovery::request(Place::Inner).emit();
    for (k, entry) in lengths.iter().enumerate() {
        let adds = Status::of_device(k + 1 == lengths.len(), false);
        Rewriter::discovery(*entry, adds).pass(&mut bytes).unwrap();
    }
    Discovery::parse(&bytes).unwrap()
}

#[test]
fn a_full_line_ends_exactly_at_the_fcs() {
    let frame = pass_all(&[Entry::STOCK; 254]);
    let bytes = frame.emit();
    assert_eq!(bytes.len(), 1030);
    assert_eq!(&bytes[1022..1026], &[4, 0, 4, 0]);
    let network = Network::new(DiscoveryView::parse(&bytes).unwrap()).unwrap();
    assert_eq!((network.devices(), network.input_total(), network.output_total()), (254, 1016, 1016));
    assert_eq!(network.members().last().unwrap().assignment.out_offset, 1012);
}

#[test]
fn a_request_without_a_copy_is_the_same() {
    for place in [Place::Inner, Place::Last] {
        let mut buffer = [0x55; 1031];
        assert_eq!(Discovery::emit_request_into(place, &mut buffer), Ok(1030));
        assert_eq!((&buffer[..1030], buffer[1030]), (&Discovery::request(place).emit()[..], 0x55));
    }
    let error = Error::BufferTooSmall { got: 1029, want: 1030 };
    assert_eq!(Discovery::emit_request_into(Place::Last, &mut [0; 1029]), Err(error));
}

#[test]
fn the_255th_device_is_an_error_that_the_master_sees() {
    let mut bytes = pass_all(&[Entry::STOCK; 254]).emit();
    for _ in 0..2 {
        let told = Rewriter::discovery(Entry::STOCK, Status::LAST).pass(&mut bytes);
        assert!(matches!(told, Err(Error::TooManyDevices { .. })));
        let answer = DiscoveryView::parse(&bytes).unwrap();
        assert_eq!(Network::new(answer), Err(Error::TooManyDevices { count: 255 }));
        assert_eq!(answer.output_total(), 1016);
    }
}

#[test]
fn totals_that_are_not_the_sums_are_refused() {
    let frame = pass_all(&[Entry { input: 2, output: 6 }, Entry { input: 1, output: 1 }]);
    let good = frame.emit();
    assert!(DiscoveryView::parse(&good).and_then(Network::new).is_ok());
    for (at, want) in [(6, 3), (8, 7)] {
        let mut bytes = good;
        bytes[at] += 1;
        refresh_fcs(&mut bytes);
        let error = Error::TableMismatch { got: want + 1, want };
        assert_eq!(DiscoveryView::parse(&bytes).and_then(Network::new), Err(error));
    }
    let huge = pass_all(&[Entry { input: 0xffff, output: 0 }, Entry { input: 0xffff, output: 0 }]).emit();
    assert!(matches!(DiscoveryView::parse(&huge).and_then(Network::new), Err(Error::TableMismatch { .. })));
}

#[test]
fn entries_of_the_devices_counted() {
    let bytes = pass_all(&[Entry { input: 2, output: 6 }, Entry { input: 1, output: 3 }]).emit();
    let answer = DiscoveryView::parse(&bytes).unwrap();
    let entry = |n| answer.entry(DeviceAddress::new(n).unwrap());
    assert_eq!(
        [entry(1), entry(2), entry(3)],
        [Some(Entry { input: 2, output: 6 }), Some(Entry { input: 1, output: 3 }), None]
    );
}

/// 31 blocks of 32 bytes with the words 16, 48, 80 ..., then 0xBEEF: 248 entries and six more.
#[test]
fn the_debug_pattern_of_the_published_master() {
    let bytes = Discovery::published_request(Place::Inner).emit();
    let words: Vec<u16> = bytes[10..1026].chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    let want = (0..31).flat_map(|block| [16 + 32 * block; 16]).chain([0xbeef; 12]);
    assert!(words.into_iter().eq(want));
}

fn entries() -> impl Strategy<Value = Vec<Entry>> {
    proptest::collection::vec((0u16..200, 0u16..200).prop_map(|(input, output)| Entry { input, output }), 0..=254)
}

proptest! {
    #[test]
    fn offsets_are_running_sums(lengths in entries()) {
        let frame = pass_all(&lengths);
        let network = Network::new(DiscoveryView::parse(&frame.emit()).unwrap()).unwrap();
        let mut sums = (0, 0);
        for (Member { assignment, lengths: entry }, want) in network.members().zip(&lengths) {
            prop_assert_eq!((assignment.in_offset, assignment.out_offset), sums);
            prop_assert_eq!(entry, *want);
            sums = (sums.0 + entry.input, sums.1 + entry.output);
        }
        prop_assert_eq!((network.input_total(), network.output_total()), sums);
        prop_assert_eq!(network.members().count(), lengths.len());
    }

    #[test]
    fn what_was_emitted_is_parsed_and_back(source: u8, status: u8, count: u16, lengths in entries()) {
        let mut frame = pass_all(&lengths);
        (frame.source, frame.status, frame.count) = (source, Status::from_bits_retain(status), count);
        let bytes = frame.emit();
        let back = Discovery::parse(&bytes).unwrap();
        prop_assert_eq!(back, frame);
        prop_assert_eq!(back.emit(), bytes);
    }
}
