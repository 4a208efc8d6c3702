//! The laws of time on a hostile line: single transactions and buses.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile:: -- --nocapture` prints the mix.

use crate::common::exchanges::{Setup, Shown, bus, seeds, single};
use crate::common::line::{USUAL_FAULTS, faults};
use crate::common::switches::assert_all_drawn;
use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{BusTransaction, Line, Progress};
use nikon_aformat::{
    BitRate, Command, Data, EncoderAddress, EncoderStatus, Operation, Request, Resolution, Response, U40,
};
use servowire_world::Kind;

/// Runs seeds until enough has happened.
fn hostile(run: impl Fn(&Setup, &mut Shown)) -> Shown {
    let shown: Shown = seeds(Setup::hostile, |shown: &Shown| &shown.tally, run);
    println!("{shown:?}");
    assert_all_drawn(&shown.mix);
    shown
}

#[test]
fn hostile_transactions() {
    hostile(|setup, shown| single(setup, 60, shown));
}

#[test]
fn hostile_buses() {
    let shown = hostile(|setup, shown| bus(setup, 30, shown));
    assert!(faults() < USUAL_FAULTS || shown.tally.of(Kind::Flip) > 0);
}

/// A line on which nothing happens: eight encoders with any positions and status, and with shafts at rest of which one looks
/// like the start of a response, frame by frame and all in one block. `HOSTILE_EVENTS=100000000` runs as many cycles, 10,000 are usual.
#[test]
fn a_perfect_line_loses_nothing() {
    let line = Line::new(BitRate::Mbit16);
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let mut draw = 0x9e37_79b9_7f4a_7c15_u64;
    let cycles = faults();
    for cycle in 0..cycles {
        let mut bus = BusTransaction::start(request, Resolution::default(), Addresses::ALL, line, 0);
        let (mut block, mut want, mut at_ns) = (Vec::with_capacity(32), [0; 8], 4_125);
        for (ea, abs) in EncoderAddress::ALL.into_iter().zip(&mut want) {
            draw = draw.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            *abs = match cycle % 4 {
                // Bits 0..=15 and 16..=31 stand where a response to command 4 begins.
                0 => draw >> 44 << 12 & 0xff_f000 | 0x104,
                1 => draw >> 28 & 0xff_0000_ffff | 0x0104 << 16,
                _ => draw >> 24,
            } & 0xf_ffff_ffff;
            let es = EncoderStatus::from_bits_truncate((draw >> 20) as u8);
            let sent = Response::new(ea, Command::Abs40Mt, es, Data::Abs40 { abs: U40::truncate(*abs) }).emit();
            for content in sent.contents() {
                at_ns += 1_125;
                if cycle % 2 == 0 {
                    let _ = bus.hear(&[Some(*content)], at_ns);
                }
                block.push(Some(*content));
            }
            at_ns += 1_500;
        }
        if cycle % 2 == 1 {
            let _ = bus.hear_since(&block, 4_125, at_ns - 1_500);
        }
        assert!(matches!(bus.progress(), Progress::Done { .. }), "cycle {cycle}: {} missing", bus.bus().missing());
        let got = EncoderAddress::ALL.map(|ea| bus.bus().response(ea).and_then(Response::abs));
        assert_eq!(got, want.map(Some), "cycle {cycle}");
    }
    println!("{cycles} cycles of eight encoders");
}
