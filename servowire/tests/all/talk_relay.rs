//! `talk simulate --encoder`: the program between a master and its encoder, with an adapter at each.

#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{Read, Write};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};
use servowire::talk::link::Link;
use servowire::talk::relay;
use servowire_world::Scenario;
use tformat::{Address, Request, Response};

use crate::talk::{hurt, simulated};

/// Two adapters: the master at one, the encoder at the other, and the program between them.
#[test]
fn a_man_in_the_middle_passes_on_and_logs() {
    let (encoder, encoder_port) = simulated(0x17);
    drop(encoder_port);
    let (master, ours) = TTYPort::pair().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("log.csv");
    let name = ours.name().unwrap();
    // Open by name, so that the master's end lives on until the program has the port for itself.
    let kept = File::options().read(true).write(true).open(&name).unwrap();
    drop(ours);
    let mut program = Command::new(env!("CARGO_BIN_EXE_servowire"))
        .args(["talk", "--port", &name, "simulate", "--encoder", &encoder.name])
        .args(["--csv", csv.to_str().unwrap()])
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let mut master: Box<dyn SerialPort> = Box::new(master);
    // The program begins with a look at the encoder.
    let mut link = (0..100)
        .find_map(|_| {
            thread::sleep(Duration::from_millis(20));
            Link::open(master.try_clone().unwrap(), Duration::from_millis(300)).ok()
        })
        .unwrap();
    let write = Request::write_eeprom(Address::truncate(3), 0x77);
    let Response::WriteEeprom(memory) = link.exchange(write).unwrap() else { panic!() };
    assert_eq!(memory.edf, 0x77);
    for _ in 0..5 {
        assert!(matches!(link.exchange(Request::ReadAll), Ok(Response::ReadAll(all)) if all.enid == 0x17));
    }
    master.write_all(&[0x55]).unwrap();
    let end = Instant::now() + Duration::from_secs(5);
    let log = loop {
        let log = std::fs::read_to_string(&csv).unwrap();
        if log.contains("no request: [55]") || Instant::now() > end {
            break log;
        }
        thread::sleep(Duration::from_millis(20));
    };
    program.kill().unwrap();
    program.wait().unwrap();
    drop(kept);
    encoder.end();
    assert!(log.starts_with("time_s,request,answer,fault\n"), "{log}");
    let asked = |request: Request| {
        let request = request.to_string();
        log.lines().filter(|line| line.split(',').nth(1) == Some(&request)).count()
    };
    assert!(asked(Request::ReadAll) >= 6, "{log}");
    assert_eq!(asked(write), 1, "a write is passed on once: {log}");
    assert!(log.contains("no request: [55]"), "{log}");
}

/// What the encoder does not answer well is logged and not passed on; a request may come in pieces, and after a pause it is no longer one.
#[test]
fn only_good_answers_are_passed_on() {
    for echo in [false, true] {
        let (bench, port) = hurt(Scenario::quiet(), false);
        let mut encoder = Link::open(Box::new(port), Duration::from_millis(50)).unwrap();
        let (mut master, ours) = TTYPort::pair().unwrap();
        master.set_timeout(Duration::from_secs(1)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let relay = thread::spawn(move || {
            let mut said = Vec::new();
            let log = |entry: &relay::Said| {
                said.push(format!("{entry:?}"));
                Ok(())
            };
            let ours: Box<dyn SerialPort> = Box::new(ours);
            let end = relay::run(ours, &mut encoder, echo, log, Some(&seen));
            (said, end)
        });
        let mut answer = [0; 11];
        master.write_all(&[0x1a]).unwrap();
        master.read_exact(&mut answer).unwrap();
        assert_eq!(answer[0], 0x1a);
        if echo {
            // The adapter hears what it has sent.
            master.write_all(&answer).unwrap();
        }
        // Reads the EEPROM at 3, in two pieces.
        let request = Request::read_eeprom(Address::truncate(3)).emit();
        master.write_all(&request.as_bytes()[..1]).unwrap();
        master.write_all(&request.as_bytes()[1..]).unwrap();
        master.read_exact(&mut answer[..4]).unwrap();
        assert!(Response::parse(Request::read_eeprom(Address::truncate(3)), &answer[..4]).is_ok());
        bench.end();
        // The encoder is gone: no answer.
        master.set_timeout(Duration::from_millis(150)).unwrap();
        thread::sleep(Duration::from_millis(150));
        master.write_all(&[0x1a]).unwrap();
        assert!(master.read(&mut answer).is_err());
        stop.store(true, Ordering::Relaxed);
        let (said, end) = relay.join().unwrap();
        assert!(end.unwrap_err().to_string().starts_with("the encoder's port is gone"));
        let requests = said.iter().filter(|entry| entry.starts_with("Request")).count();
        assert_eq!(requests, 3, "{said:?}");
        assert!(said.last().unwrap().contains("Err"), "{said:?}");
    }
}
