//! What is said of a frame beside its verdict: what spoilt it, and what is strange though it holds.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod common;
mod random;

use common::{Bench, Wave, id3, sealed};
use random::rng::Rng;
use random::speech::{Speech, aformat};

/// All notes beside answers that hold.
fn notes(wave: &Wave) -> Vec<String> {
    let run = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]);
    let events = run.json();
    let notes =
        events.iter().filter(|event| event["verdict"] == "ok").filter_map(|event| event["fields"]["note"].as_str());
    notes.map(str::to_owned).collect()
}

#[test]
fn another_encoder_id() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..4 {
        let mut answer = id3(1000, 0, 0);
        if k == 2 {
            // Two bits of one column: the check field does not see it.
            answer[5] ^= 1;
            answer[9] ^= 1;
        }
        wave.exchange(&[0x1a], &answer);
    }
    let notes = notes(&wave);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].starts_with("the encoder ID was 23 and is 22: another encoder"), "{notes:?}");
    assert!(notes[1].starts_with("the encoder ID was 22 and is 23"), "{notes:?}");
}

#[test]
fn a_position_that_cannot_be() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..24 {
        wave.exchange(&[0x1a], &id3(if k == 15 { 4_000_000 } else { 1000 * k }, 3, 0));
    }
    let notes = notes(&wave);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].starts_with("moved +0.4") && notes[0].ends_with("faster than any motor turns"), "{notes:?}");
}

#[test]
fn a_status_that_contradicts_the_alarms() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    // CE in ALMC, and EA1 in SF where EA0 is due.
    let wrong = sealed(&[0x1a, 0x20, 1, 0, 0, 0x17, 0, 0, 0, 0x04]);
    // SF left at 0: some encoders do so.
    let silent = sealed(&[0x1a, 0x00, 1, 0, 0, 0x17, 0, 0, 0, 0x04]);
    wave.exchange(&[0x1a], &id3(1, 0, 0x40)).exchange(&[0x1a], &wrong).exchange(&[0x1a], &silent);
    assert_eq!(notes(&wave), ["SF does not say what ALMC says: EA0 is due"]);
}

#[test]
fn two_masters_are_named() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0).exchange(&[0x1a], &id3(1, 0, 0)).exchange(&[0x1a], &id3(2, 0, 0));
    // Somebody else asks before the answer can be over.
    wave.send(&[0x1a]).idle_us(8.0).exchange(&[0x02], &sealed(&[0x02, 0, 1, 2, 3]));
    wave.send(&[0x1a]).idle_us(60.0);
    let events = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]).json();
    let causes: Vec<&str> = events.iter().filter_map(|event| event["cause"].as_str()).collect();
    assert_eq!(causes.len(), 2, "{causes:?}");
    assert!(causes[0].contains("two masters") && causes[0].contains("8.0 us later"), "{causes:?}");
    assert!(causes[1].contains("only the request is on the line"), "{causes:?}");
}

/// An exchange of A-format that is sound, then one whose reply `spoil` changes; the cause and verdict of that.
fn spoilt(rng: &mut Rng, rate: f64, spoil: impl Fn(&mut Vec<bool>)) -> (String, String) {
    let mut wave = Wave::new(rate);
    wave.idle_us(20.0);
    let mut last = 0;
    for k in 0..4 {
        let said: Vec<Speech> = aformat(rng, true, 10.0);
        for mut speech in said {
            let answer = speech.expect.as_ref().unwrap().answer;
            if answer && k == 3 {
                spoil(&mut speech.bits);
            }
            wave.idle_us(speech.pause * 1e6 / rate).bits(&speech.bits);
            last = speech.bits.len();
        }
        wave.idle_us(60.0);
    }
    assert!(last > 0);
    let events = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]).json();
    let text = |key: &str| events.last().unwrap()[key].as_str().unwrap_or_default().to_owned();
    (text("verdict"), text("cause"))
}

/// Of a hundred damaged replies of A-format, ninety-five causes are right and no value is taken for good.
#[test]
fn damage_to_a_format_is_told() {
    let mut rng = Rng::new(7);
    let mut faults = Vec::new();
    let (mut right, mut all) = (0, 0);
    for k in 0..40 {
        for (what, word) in [("lost", "lost"), ("added", "twice"), ("cut", "cut"), ("flipped", "disturbed")] {
            let at = rng.below(1 << 20) as usize;
            let rate = [2.5e6, 4e6, 8e6][k % 3];
            let same = std::cell::Cell::new(false);
            let (verdict, cause) = spoilt(&mut rng, rate, |bits| {
                let before = bits.clone();
                // Not the first bits, which say that it is a reply.
                let at = 4 + at % (bits.len() - 8);
                match what {
                    "lost" => drop(bits.remove(at)),
                    "added" => bits.insert(at, bits[at]),
                    "cut" => bits.truncate(at.max(18)),
                    _ => bits[at] ^= true,
                }
                // A one before idle line is idle line.
                let end = |bits: &[bool]| bits.iter().rposition(|bit| !bit);
                let idle = bits[..=end(bits).unwrap()] == before[..=end(&before).unwrap()];
                // And one more before a start bit is a pause between two frames.
                let run = before[at..].iter().take_while(|bit| **bit).count();
                same.set(idle || what == "added" && (at..at + run).any(|bit| bit % 18 == 17));
            });
            if same.get() {
                continue;
            }
            all += 1;
            assert_ne!(verdict, "ok", "{what} at {at}");
            if cause.contains(word) {
                right += 1;
            } else {
                faults.push(format!("{what} at {at}: {verdict}, {cause}"));
            }
        }
    }
    assert!(100 * right >= 95 * all, "{right} of {all}:\n{}", faults.join("\n"));
}
