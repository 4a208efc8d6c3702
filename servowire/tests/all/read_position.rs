//! The example `read-position` at a pseudo-terminal, with an encoder at the other end that is written from the protocol's documents alone: bytes and bits
//! are literals here. Right, and wrong in the ways of a bench: silent, at another rate, an adapter that hears itself, another encoder.

#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{Read, Write};
use std::thread;
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

#[expect(dead_code, reason = "its `main` is for the command line")]
#[path = "../../examples/read-position.rs"]
mod example;

/// Data ID 3: the control field has the sink code 010, the ID 0011 and its parity, 1.
const READ_ALL: u8 = 0x1a;
/// For a machine that is busy; what comes at once is not waited for.
const PATIENCE: Duration = Duration::from_secs(1);
/// For what never comes.
const SHORT: Duration = Duration::from_millis(20);

/// CF, SF, ABS, ENID, ABM, ALMC, and the exclusive or of all.
fn answer(abs: u32, enid: u8, abm: u16, almc: u8) -> Vec<u8> {
    let [low, middle, high, _] = abs.to_le_bytes();
    let [turns, more] = abm.to_le_bytes();
    let sf = if almc == 0 { 0 } else { 0x20 };
    let mut bytes = vec![READ_ALL, sf, low, middle, high, enid, turns, more, 0, almc];
    bytes.push(bytes.iter().fold(0, |sum, byte| sum ^ byte));
    bytes
}

/// What a UART of 8N1 makes of bytes that were sent at `times` its own rate: it looks at the middle of its bits from a falling edge on,
/// and gives 0 for a wrong stop bit, as Linux does.
fn at_another_rate(bytes: &[u8], times: f64) -> Vec<u8> {
    let mut line = vec![true];
    for byte in bytes {
        line.push(false);
        line.extend((0..8).map(|bit| byte >> bit & 1 == 1));
        line.push(true);
    }
    let end = line.len() as f64;
    let level = |at: f64| line.get(at as usize).copied().unwrap_or(true);
    let (mut at, mut heard) = (0.0, Vec::new());
    while at < end {
        if level(at) {
            at += 0.01;
            continue;
        }
        let bit = |number: f64| level(at + (number + 0.5) * times);
        let byte = (0..8).fold(0, |sum, number| sum | u8::from(bit(1.0 + f64::from(number))) << number);
        let framed = bit(9.0);
        heard.push(if framed { byte } else { 0 });
        at += 9.5 * times;
        while !framed && !level(at) && at < end {
            at += 0.01;
        }
    }
    heard
}

/// What the example says with an encoder that makes `reply` of the bytes it hears, the number of its answer given too; and its error.
fn say(patience: Duration, mut reply: impl FnMut(&[u8], u32) -> Vec<u8> + Send + 'static) -> (Vec<String>, String) {
    let (mut master, slave) = TTYPort::pair().unwrap();
    let name = slave.name().unwrap();
    // As long as this is open, the encoder's end is; the program locks the port for itself.
    let kept = File::options().read(true).write(true).open(&name);
    drop(slave);
    master.set_timeout(Duration::from_millis(5)).unwrap();
    let (ended, end) = std::sync::mpsc::channel::<()>();
    let encoder = thread::spawn(move || {
        let mut number = 0;
        while end.try_recv() == Err(std::sync::mpsc::TryRecvError::Empty) {
            let mut heard = [0; 16];
            let Ok(count) = master.read(&mut heard) else { continue };
            master.write_all(&reply(&heard[..count], number)).unwrap();
            number += 1;
        }
    });
    let mut out = Vec::new();
    let error = example::read(&name, patience, &mut out).err().map_or_else(String::new, |error| error.to_string());
    drop(ended);
    encoder.join().unwrap();
    drop(kept);
    (String::from_utf8(out).unwrap().lines().map(str::to_owned).collect(), error)
}

/// The shaft is at another place in each answer.
fn count(number: u32) -> u32 {
    0x12_3456 + 1_000 * number
}

#[test]
fn positions_are_those_of_the_encoder() {
    for echo in [false, true] {
        let (said, error) = say(PATIENCE, move |heard, number| {
            assert_eq!(heard, [READ_ALL]);
            let own = if echo { heard } else { &[] };
            [own, &answer(count(number), 0x17, 7, 0)].concat()
        });
        assert_eq!((said.len(), error.as_str()), (10, ""), "{said:?}");
        // Some answers tell whether the adapter hears itself; the ten that follow are printed.
        let first = (1..6).find(|number| said[0].starts_with(&format!("turn 7, {} counts at ", count(*number))));
        let first = first.unwrap_or_else(|| panic!("{said:?}"));
        for (line, number) in said.iter().zip(first..) {
            assert!(line.starts_with(&format!("turn 7, {} counts at ", count(number))), "{line}");
            assert!(line.contains(" ns, the call took ") && line.ends_with(" us"), "{line}");
        }
    }
}

#[test]
fn nobody_gives_no_position() {
    let (said, error) = say(SHORT, |_, _| Vec::new());
    assert_eq!((said, error.as_str()), (vec![], "no response"));
    let (said, error) = say(SHORT, |heard, _| heard.to_vec());
    let only = "only our own request came back: no encoder is connected, it has no power, or A and B are swapped";
    assert_eq!((said, error.as_str()), (vec![], only));
}

#[test]
fn another_rate_gives_no_position() {
    // 0.5: what one of 5 Mbit/s hears of a request at 2.5; 2: what the adapter hears of its answer.
    assert_eq!(at_another_rate(&[0x1a, 0x55], 1.0), [0x1a, 0x55]);
    assert!(!at_another_rate(&[READ_ALL], 0.5).contains(&READ_ALL), "the encoder would be silent");
    // One that answers all the same.
    for (times, alike) in [(2.0, false), (0.5, false), (1.0, true)] {
        let (said, error) = say(SHORT, move |_, number| at_another_rate(&answer(count(number), 0x17, 7, 0), times));
        let good = said.iter().any(|line| line.starts_with("turn "));
        assert!(good == alike && error.is_empty() == alike, "{times}: {said:?}, {error}");
    }
}

#[test]
fn another_encoder_and_an_alarm_give_no_position() {
    // 11h: 17 bits a turn. BE and BA: the battery.
    for (enid, almc, word) in [(0x11, 0, "calls itself"), (0x17, 0x40, "BE"), (0x17, 0x80, "BA")] {
        let (said, error) = say(PATIENCE, move |_, number| answer(count(number), enid, 7, almc));
        assert_eq!((said.len(), error.as_str()), (10, ""), "{said:?}");
        assert!(said.iter().all(|line| line.starts_with("no position: ") && line.contains(word)), "{said:?}");
    }
}
