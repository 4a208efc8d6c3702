//! What is said of a frame beside its verdict: what spoilt it, and what is strange though it holds.

use crate::common::{Bench, Wave, id3, sealed};
use crate::random::dsl;
use crate::random::rng::Rng;
use crate::random::speech::{Kind, Speech, aformat, tformat};
use serde_json::Value;

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
    assert_eq!(notes(&wave), ["SF contradicts ALMC: EA0 is expected"]);
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

/// Exchanges that are sound, then one whose answer `spoil` changes; the verdict and cause of that.
fn spoilt(kind: Kind, rng: &mut Rng, rate: f64, spoil: impl Fn(&mut Vec<bool>)) -> (String, String) {
    let mut wave = Wave::new(rate);
    wave.idle_us(20.0);
    for k in 0..4 {
        let said: Vec<Speech> = match kind {
            Kind::Tformat => tformat(rng, true, 3e-6 * rate),
            _ => aformat(rng, true, 10.0),
        };
        for mut speech in said {
            let answer = speech.expect.as_ref().unwrap().answer;
            if answer && k == 3 {
                spoil(&mut speech.bits);
            }
            wave.idle_us(speech.pause * 1e6 / rate).bits(&speech.bits);
        }
        wave.idle_us(60.0);
    }
    let events = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]).json();
    let text = |key: &str| events.last().unwrap()[key].as_str().unwrap_or_default().to_owned();
    (text("verdict"), text("cause"))
}

/// Of a hundred damaged answers ninety-five causes are right, and no value is taken for good. `field`: bits of one.
///
/// `SEED=1234 cargo test -p servowire --test all causes:: -- --nocapture` draws others.
fn damage_is_told(kind: Kind, rates: &[f64], field: usize, repeats: usize) {
    let mut rng = Rng::new(std::env::var("SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(7));
    let mut faults = Vec::new();
    let (mut right, mut all) = (0, 0);
    for k in 0..repeats {
        for (what, word) in [("lost", "lost"), ("added", "doubled"), ("cut", "cut"), ("flipped", "disturbed")] {
            let at = rng.below(1 << 20) as usize;
            let same = std::cell::Cell::new(false);
            let (verdict, cause) = spoilt(kind, &mut rng, rates[k % rates.len()], |bits| {
                let before = bits.clone();
                // Not the first bits, which say that it is an answer, and of which.
                let first = if kind == Kind::Tformat { field } else { 4 };
                let at = first + at % (bits.len() - first - 4);
                match what {
                    "lost" => drop(bits.remove(at)),
                    "added" => bits.insert(at, bits[at]),
                    // The first field alone would be the request come back.
                    "cut" => bits.truncate(at.max(field + 4)),
                    _ => bits[at] ^= true,
                }
                // A one before idle line is idle line.
                let end = |bits: &[bool]| bits.iter().rposition(|bit| !bit);
                let idle = bits[..=end(bits).unwrap()] == before[..=end(&before).unwrap()];
                // And one more before a start bit is a pause between two fields.
                let run = before[at..].iter().take_while(|bit| **bit).count();
                same.set(idle || what == "added" && (at..at + run).any(|bit| bit % field == field - 1));
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
    println!("{}: {right} of {all} causes are right", kind.name());
    assert!(100 * right >= 95 * all, "{right} of {all}:\n{}", faults.join("\n"));
}

#[test]
fn damage_to_a_format_is_told() {
    damage_is_told(Kind::Aformat, &[2.5e6, 4e6, 8e6], 18, 40);
}

#[test]
fn damage_to_t_format_is_told() {
    damage_is_told(Kind::Tformat, &[2.5e6, 5e6], 10, 40);
}

/// A link of forty frames, of which `spoil` changes the head and the answer of the twentieth; its events from there on.
fn spoilt_link(rng: &mut Rng, spoil: impl Fn(&mut Vec<bool>, &mut Vec<bool>)) -> Vec<Value> {
    const SPOILT: usize = 20;
    let bit = 1e12 / 9.375e6;
    let mut wave = Wave::new(9.375e6);
    wave.idle_us(5.0);
    let mut due = 0;
    for (k, pair) in dsl::link(rng, 40, 2.0, &mut |_| false).chunks(2).enumerate() {
        let (mut head, mut answer) = (pair[0].bits.clone(), pair[1].bits.clone());
        // A frame has 108 bits; its TRAILER, the last six, stands before the next head.
        let idle = [pair[1].pause, 102.0 - 26.0 - pair[1].pause - 61.0];
        let gone = head.len();
        if k == SPOILT {
            due = wave.end;
            spoil(&mut head, &mut answer);
        }
        if head.is_empty() {
            wave.level(true, (gone as f64 + 102.0 - 26.0) * bit);
            continue;
        }
        wave.bits(&head).level(true, idle[0] * bit).bits(&answer).level(true, idle[1] * bit);
    }
    wave.idle_us(30.0);
    let events = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]).json();
    // What was said before is good.
    let early = |event: &&Value| event["start_ps"].as_i64().unwrap() < due - 1_000_000;
    assert!(events.iter().filter(early).all(|event| event["verdict"] == "ok"));
    events.into_iter().filter(|event| !early(&event)).collect()
}

/// Every bit of a frame in turn: TRAILER and the bit between the acceleration and channel 2 carry nothing, so they are
/// worth a note; of what else is flipped the frame is refused, and none other but by the check of its V-frame.
#[test]
fn each_flipped_bit_of_a_dsl_link_is_told() {
    const TRAILER: usize = 6;
    const HEAD: usize = TRAILER + 26;
    const SWITCH: usize = HEAD + 50;
    let mut rng = Rng::new(11);
    for at in 0..HEAD + 61 {
        let events = spoilt_link(&mut rng, |head, answer| match at {
            0..HEAD => head[at] ^= true,
            _ => answer[at - HEAD] ^= true,
        });
        let refused: Vec<_> = events.iter().filter(|event| event["verdict"] != "ok").collect();
        let kinds: Vec<_> = refused.iter().map(|event| event["kind"].as_str().unwrap()).collect();
        let notes = events.iter().filter(|event| event["fields"].get("note").is_some()).count();
        match at {
            0..TRAILER | SWITCH => assert_eq!((kinds.len(), notes), (0, 1), "bit {at}: {events:?}"),
            TRAILER..HEAD => assert_eq!((kinds, notes), (vec!["H-frame"], 0), "bit {at}: {refused:?}"),
            _ => {
                // Words one and six are of the V-frame too, whose check sees them but for a data character that became
                // the control character of the same value.
                let checked = !(HEAD + 10..SWITCH).contains(&at) && refused[0]["verdict"] != "wrong_kind";
                let due = if checked { vec!["answer", "V-frame"] } else { vec!["answer"] };
                assert_eq!((kinds, notes), (due, 0), "bit {at}: {refused:?}");
                assert_eq!(refused[0]["start_ps"], events[1]["start_ps"], "bit {at}: not the answer that is damaged");
            }
        }
    }
}

#[test]
fn damage_to_a_dsl_link_is_told() {
    let mut rng = Rng::new(3);
    let refused = |events: &[Value]| -> Vec<String> {
        let verdicts = events.iter().map(|event| event["verdict"].as_str().unwrap().to_owned());
        verdicts.filter(|verdict| verdict != "ok").collect()
    };
    for _ in 0..20 {
        // SYNC and SAMPLE of the head, after the six bits of TRAILER.
        let at = 6 + rng.below(12) as usize;
        let events = spoilt_link(&mut rng, |head, _| head[at] ^= true);
        assert_eq!(refused(&events).first().map(String::as_str), Some("head"), "bit {at}: {events:?}");
        let events = spoilt_link(&mut rng, |head, answer| {
            head.clear();
            answer.clear();
        });
        assert_eq!(refused(&events).first().map(String::as_str), Some("missing"), "{events:?}");
        let events = spoilt_link(&mut rng, |_, answer| answer.fill(true));
        assert_eq!(refused(&events).first().map(String::as_str), Some("no_response"), "{events:?}");
    }
}
