//! The numbers of the error classes. Logs and programs in other languages keep them, so none ever changes or is given again: a
//! new class gets the next number and a new line in `error-numbers.txt`, and a class that goes leaves its line there, with
//! `(gone)` after it.

use std::collections::BTreeSet;

use servowire_core::Class;

const RECORDED: &str = include_str!("../../error-numbers.txt");

fn lines<C: Class>(name: &str) -> impl Iterator<Item = String> {
    C::ALL.iter().map(move |class| format!("{name} {} {}", class.number(), class.name()))
}

#[test]
fn no_number_has_changed() {
    let present: BTreeSet<String> = lines::<tformat::ErrorClass>("tformat")
        .chain(lines::<nikon_aformat::ErrorClass>("nikon-aformat"))
        .chain(lines::<hdsl::ErrorClass>("hdsl"))
        .chain(lines::<rtex_block::ErrorClass>("rtex-block"))
        .chain(lines::<servowire_drivers::drv8711::ErrorClass>("servowire-drivers/drv8711"))
        .chain(lines::<sorte_proto::ErrorClass>("sorte-proto"))
        .chain(lines::<step_motion::ErrorClass>("step-motion"))
        .chain(lines::<step_profile::ErrorClass>("step-profile"))
        .collect();
    let recorded: BTreeSet<String> =
        RECORDED.lines().filter(|line| !line.ends_with("(gone)")).map(str::to_owned).collect();
    let (new, missing): (Vec<_>, Vec<_>) =
        (present.difference(&recorded).collect(), recorded.difference(&present).collect());
    assert!(new.is_empty() && missing.is_empty(), "not recorded: {new:?}; recorded and not there: {missing:?}");
}

#[test]
fn no_number_is_given_twice() {
    let mut seen = BTreeSet::new();
    for line in RECORDED.lines() {
        let mut words = line.split(' ');
        let (name, number) = (words.next(), words.next().and_then(|number| number.parse::<u8>().ok()));
        assert!(number.is_some_and(|number| number > 0), "{line}");
        assert!(seen.insert((name, number)), "given twice: {line}");
    }
}
