//! `talk` over pseudo-terminals: against its own encoder, and against one on a line with faults. A pseudo-terminal has no bit
//! rate and no time, so this tests content, order and recovery.

#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use serialport::{SerialPort, TTYPort};
use servowire::talk::backup::Backup;
use servowire::talk::fault::Fault;
use servowire::talk::link::Link;
use servowire::talk::simulate;
use servowire_world::{Cable, Scenario, Tally};
use tformat::device::Device;
use tformat::{Abm, Abs, Address, Almc, BitRate, Request, Response};

/// An encoder in a thread of its own at the other end of a pseudo-terminal.
pub(crate) struct Bench {
    pub(crate) name: String,
    stop: Arc<AtomicBool>,
    encoder: Option<JoinHandle<Tally>>,
    /// As long as this is open, the encoder's end is; the program locks the port for itself.
    _kept: Option<File>,
}

impl Bench {
    fn new(encoder: impl FnOnce(TTYPort, &AtomicBool) -> Tally + Send + 'static) -> (Self, TTYPort) {
        let (master, slave) = TTYPort::pair().unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let encoder = Some(thread::spawn(move || encoder(master, &seen)));
        let name = slave.name().unwrap();
        let kept = File::options().read(true).write(true).open(&name);
        (Self { name, stop, encoder, _kept: kept.ok() }, slave)
    }

    pub(crate) fn end(mut self) -> Tally {
        self.stop.store(true, Ordering::Relaxed);
        self.encoder.take().unwrap().join().unwrap()
    }

    /// The program at this port.
    fn talk(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_servowire"))
            .args(["talk", "--port", &self.name])
            .args(arguments)
            .output()
            .unwrap()
    }
}

/// The encoder of `talk simulate`.
pub(crate) fn simulated(id: u8) -> (Bench, TTYPort) {
    Bench::new(move |master, stop| {
        let encoder = simulate::Simulated { rate: BitRate::Mbit2_5, id, rpm: 0.0, echo: false };
        simulate::run(Box::new(master), encoder, Some(stop)).unwrap();
        Tally::default()
    })
}

/// An encoder whose answers go through a line with these faults, and whose requests come back if `echo`.
pub(crate) fn hurt(scenario: Scenario, echo: bool) -> (Bench, TTYPort) {
    Bench::new(move |mut master, stop| {
        let mut device = Device::<6>::new(0x17, BitRate::Mbit2_5);
        device.raise_alarms(Almc::OS);
        device.end_alarms(Almc::OS);
        let mut line = Cable::new(0, scenario);
        let (begin, mut shaft) = (Instant::now(), 0);
        master.set_timeout(Duration::from_millis(5)).unwrap();
        while !stop.load(Ordering::Relaxed) {
            let mut buffer = [0; 64];
            let Ok(count) = master.read(&mut buffer) else { continue };
            let now_ns = u64::try_from(begin.elapsed().as_nanos()).unwrap();
            for byte in &buffer[..count] {
                if echo {
                    master.write_all(&[*byte]).unwrap();
                }
                shaft += 1;
                device.set_position(Abs::truncate(shaft), Abm::truncate(2));
                if let Some(answer) = device.hear(&[*byte], now_ns) {
                    for arrival in line.carry(answer.frame.as_bytes(), 0) {
                        thread::sleep(Duration::from_nanos(arrival.at_ns));
                        // In two pieces, as USB likes it.
                        let (first, second) = arrival.bytes.split_at(arrival.bytes.len() / 3);
                        master.write_all(first).unwrap();
                        thread::sleep(Duration::from_micros(200));
                        master.write_all(second).unwrap();
                    }
                }
            }
        }
        line.tally
    })
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn the_program_reads_what_its_own_encoder_says() {
    let (bench, port) = simulated(0x17);
    drop(port);
    let output = bench.talk(&["read"]);
    assert!(output.status.success(), "{}", text(&output));
    assert_eq!(text(&output), "   0.00000 deg         0 counts  turn 0  no alarms\n");
    let output = bench.talk(&["info"]);
    assert!(text(&output).starts_with("encoder ID 0x17: 23 bits a turn, 16 of turns\n"), "{}", text(&output));
    assert!(text(&output).contains("does not hear itself"));
    let output = bench.talk(&["clear-errors"]);
    assert_eq!(text(&output), "alarms before: none; after: none\n");
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("out.csv");
    let output = bench.talk(&["watch", "--count", "3", "--period", "1", "--csv", csv.to_str().unwrap()]);
    assert!(text(&output).ends_with("3 good, 0 refused or missing\n"), "{}", text(&output));
    // In a pipe a line each, and no escape code.
    assert!(text(&output).lines().count() == 5 && !text(&output).contains(['\x1b', '\r']), "{}", text(&output));
    assert_eq!(std::fs::read_to_string(csv).unwrap().lines().count(), 4);
    // How long answers took, and how often there was one.
    let said = text(&output);
    assert!(said.contains("\nanswers took ") && said.contains(" ms on average; one reading every "), "{said}");
    // Ctrl-C ends it with the figures.
    let watch = Command::new(env!("CARGO_BIN_EXE_servowire"))
        .args(["talk", "--port", &bench.name, "watch", "--json"])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    thread::sleep(Duration::from_millis(700));
    assert!(Command::new("kill").args(["-INT", &watch.id().to_string()]).status().unwrap().success());
    let output = watch.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let last: serde_json::Value = serde_json::from_str(text(&output).lines().last().unwrap()).unwrap();
    assert!(last["good"].as_u64().unwrap() > 1 && last["answer_ms"]["mean"].as_f64().unwrap() > 0.0, "{last}");
    assert!(last["bad"] == 0 && last["cycle_ms"]["max"].is_f64(), "{last}");
    bench.end();
}

#[test]
fn the_memory_is_backed_up_and_restored_only_when_one_insists() {
    let (bench, port) = simulated(0x11);
    drop(port);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (first, second, before) = (at("first.json"), at("second.json"), at("before.json"));
    let output = bench.talk(&["eeprom", "backup", "--pages", "2", &first]);
    assert_eq!(text(&output), format!("2 pages of encoder ID 0x11 are in {first}\n"));
    let backup = Backup::parse(&std::fs::read_to_string(&first).unwrap()).unwrap();
    assert_eq!((backup.encoder_id(), backup.pages()), (0x11, &[[0xff; 127]; 2][..]));
    // A backup is not overwritten.
    let output = bench.talk(&["eeprom", "backup", "--pages", "1", &first]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(text(&output), format!("error: {first}: the file already exists; backups are not overwritten\n"));

    let mut pages = backup.pages().to_vec();
    pages[1][0] = 0x12;
    std::fs::write(&second, Backup::new(SystemTime::UNIX_EPOCH, 0x11, pages.clone()).emit()).unwrap();
    let output = bench.talk(&["eeprom", "restore", &second]);
    assert_eq!(output.status.code(), Some(2), "without the option it is wrong use");
    let output = bench.talk(&["eeprom", "restore", "--overwrite-eeprom", &second]);
    assert!(text(&output).contains("nothing was written"), "{}", text(&output));
    // Where the memory would go is a file already: nothing is written.
    let output = bench.talk(&["eeprom", "restore", "--overwrite-eeprom", "--yes", "--before", &first, &second]);
    assert_eq!(text(&output), format!("error: {first}: the file already exists; backups are not overwritten\n"));
    let output =
        bench.talk(&["--json", "eeprom", "restore", "--overwrite-eeprom", "--yes", "--before", &before, &second]);
    assert_eq!(text(&output), format!("{{\"backup\":\"{before}\",\"differed\":1,\"written\":1}}\n"));
    let kept = Backup::parse(&std::fs::read_to_string(&before).unwrap()).unwrap();
    assert_eq!(kept.pages(), backup.pages(), "what was there before");
    let output = bench.talk(&["eeprom", "dump", "--pages", "2"]);
    assert_eq!(Backup::parse(&text(&output)).unwrap().pages(), pages);
    // And back, with the name that the tool chooses.
    let output = bench.talk(&["eeprom", "restore", "--overwrite-eeprom", "--yes", &before]);
    assert!(text(&output).starts_with("1 of 1 bytes that differed were written and read back; "), "{}", text(&output));
    let names =
        std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert_eq!(names.filter(|name| name.starts_with("before.before-20")).count(), 1);
    let output = bench.talk(&["eeprom", "restore", "--overwrite-eeprom", "--yes", &first]);
    assert_eq!(text(&output), "the memory already holds this: nothing was written\n");
    // A file that was touched by hand.
    let touched = std::fs::read_to_string(&second).unwrap().replacen("12 ff", "13 ff", 1);
    std::fs::write(&second, touched).unwrap();
    let output = bench.talk(&["eeprom", "restore", "--overwrite-eeprom", "--yes", &second]);
    assert!(text(&output).contains("it was changed or damaged"), "{}", text(&output));
    bench.end();
}

#[test]
fn zeros_want_a_word_of_danger_and_are_read_back() {
    let (bench, port) = simulated(0x17);
    drop(port);
    for arguments in [&["zero-turns"] as &[_], &["zero-single-turn", "--tolerance", "0"]] {
        assert_eq!(bench.talk(arguments).status.code(), Some(2), "{arguments:?}");
    }
    let single = ["zero-single-turn", "--shift-commutation-angle", "--tolerance", "0"];
    let output = bench.talk(&single);
    assert!(text(&output).contains("shifts the commutation angle") && text(&output).ends_with("nothing was written\n"));
    let output = bench.talk(&[&single[..], &["--yes", "--json"]].concat());
    let said: serde_json::Value = serde_json::from_str(&text(&output)).unwrap();
    assert_eq!((&said["after"]["counts"], &said["after"]["encoder_id"]), (&0.into(), &0x17.into()));
    let output = bench.talk(&["zero-turns", "--lose-multi-turn-reference", "--yes"]);
    assert!(output.status.success() && text(&output).contains("\nafter:  "), "{}", text(&output));
    bench.end();
}

/// What the log holds is decoded by the same program.
#[test]
fn the_log_of_bytes_is_decoded() {
    let (bench, port) = simulated(0x17);
    drop(port);
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("bytes.txt");
    let log = log.to_str().unwrap();
    let output = bench.talk(&["--json", "--log", log, "read"]);
    let said: serde_json::Value = serde_json::from_str(&text(&output)).unwrap();
    assert_eq!((&said["counts"], &said["turns"], &said["alarms"]), (&0.into(), &0.into(), &serde_json::json!([])));
    let output = Command::new(env!("CARGO_BIN_EXE_servowire")).args(["decode", log]).output().unwrap();
    let decoded = text(&output);
    assert!(
        output.status.success() && decoded.contains("ENID"),
        "{decoded}\n{}",
        std::fs::read_to_string(log).unwrap()
    );
    bench.end();
}

#[test]
fn the_echo_is_found_and_taken_away() {
    for echo in [false, true] {
        let (bench, port) = hurt(Scenario::quiet(), echo);
        let mut link = Link::open(Box::new(port), Duration::from_millis(50)).unwrap();
        assert_eq!(link.echo(), echo);
        let write = Request::write_eeprom(Address::truncate(3), 0x77);
        let Response::WriteEeprom(memory) = link.exchange(write).unwrap() else { panic!() };
        assert_eq!((memory.adf.busy(), memory.edf), (false, 0x77));
        bench.end();
    }
}

/// A request that comes back, and nothing else, is no answer: not even a write, whose answer looks the same.
#[test]
fn an_echo_alone_is_no_answer() {
    let (bench, port) = hurt(Scenario::quiet(), true);
    let mut link = Link::open(Box::new(port), Duration::from_millis(30)).unwrap();
    // from here on nobody is there
    bench.end();
    assert!(link.exchange(Request::write_eeprom(Address::truncate(3), 0x77)).is_err());

    let (bench, port) = Bench::new(|mut master, stop| {
        master.set_timeout(Duration::from_millis(5)).unwrap();
        while !stop.load(Ordering::Relaxed) {
            let mut byte = [0];
            if master.read(&mut byte).is_ok() {
                master.write_all(&byte).unwrap();
            }
        }
        Tally::default()
    });
    let fault = Link::open(Box::new(port), Duration::from_millis(20)).unwrap_err();
    assert!(matches!(fault, Fault::OnlyEcho), "{fault}");
    bench.end();
}

/// An output that cannot be written is not the fault of the port; who reads no further has read enough.
#[test]
fn the_output_is_not_the_port() {
    let (bench, port) = simulated(0x17);
    drop(port);
    for arguments in [&["read"] as &[_], &["info"], &["watch"], &["eeprom", "dump", "--pages", "1"]] {
        let mut program = Command::new("timeout");
        program.args(["20", env!("CARGO_BIN_EXE_servowire"), "talk", "--port", &bench.name]).args(arguments);
        let full = File::options().write(true).open("/dev/full").unwrap();
        let output = program.stdout(full).output().unwrap();
        let said = text(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.contains("the output cannot be written: ") && !said.contains(&bench.name),
            "{arguments:?}: {said}"
        );
        let mut program =
            program.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        drop(program.stdout.take());
        let output = program.wait_with_output().unwrap();
        assert_eq!((output.status.code(), text(&output).as_str()), (Some(0), ""), "{arguments:?}");
    }
    bench.end();
}

/// What can be wrong is said in a sentence that names it, with exit code 1, and at once.
#[test]
fn what_is_wrong_is_said() {
    let (bench, port) = simulated(0x17);
    drop(port);
    let at = |port: &str, arguments: &[&str]| {
        let begin = Instant::now();
        let mut program = Command::new(env!("CARGO_BIN_EXE_servowire"));
        let output = program.args(["talk", "--port", port]).args(arguments).output().unwrap();
        assert!(begin.elapsed() < Duration::from_secs(10));
        assert_eq!(output.status.code(), Some(1), "{}", text(&output));
        let said = String::from_utf8(output.stderr).unwrap();
        said.strip_prefix("error: ").unwrap().to_owned()
    };
    assert!(at("/dev/ttyNone", &["read"]).starts_with("/dev/ttyNone: there is no such port; there "));
    assert!(at("/dev/null", &["read"]).starts_with("/dev/null: this is not a serial port"));
    assert!(at("/", &["read"]).starts_with("/: this is not a serial port"));
    let said = at(&bench.name, &["simulate", "--encoder", "/dev/ttyNone"]);
    assert!(said.starts_with("/dev/ttyNone: there is no such port"), "{said}");
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("no/file");
    let missing = missing.to_str().unwrap();
    for arguments in [
        &["eeprom", "restore", "--overwrite-eeprom", "--yes", missing] as &[_],
        &["eeprom", "dump", "--pages", "1", missing],
        &["watch", "--csv", missing],
    ] {
        assert!(at(&bench.name, arguments).starts_with(&format!("{missing}: ")), "{arguments:?}");
    }
    let empty = folder.path().join("empty");
    File::create(&empty).unwrap();
    let empty = empty.to_str().unwrap();
    let said = at(&bench.name, &["eeprom", "restore", "--overwrite-eeprom", "--yes", empty]);
    assert!(said.starts_with(&format!("{empty}: this is not a backup: ")), "{said}");
    std::fs::write(empty, "{\"\\u001b[31m\": 1}").unwrap();
    let said = at(&bench.name, &["eeprom", "restore", "--overwrite-eeprom", "--yes", empty]);
    assert!(said.contains("`\\x1b[31m`") && !said.contains('\x1b'), "{said:?}");
    // Six pages are read before: a thousand exchanges, which take as long as the machine lets them.
    let output = bench.talk(&["eeprom", "dump", "--pages", "7"]);
    let said = text(&output);
    assert!(output.status.code() == Some(1) && said.ends_with("it has no page 6\n"), "{said}");
    bench.end();
}

/// Nobody at the other end; and a port that goes away while the program reads.
#[test]
fn an_encoder_that_is_not_there_is_said_to_be_so() {
    let (bench, port) = Bench::new(|_, stop| {
        while !stop.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(5));
        }
        Tally::default()
    });
    drop(port);
    for arguments in [&["read"] as &[_], &["watch"], &["info"], &["clear-errors"], &["eeprom", "dump"]] {
        let output = bench.talk(arguments);
        assert_eq!(output.status.code(), Some(1));
        let said = text(&output);
        let want = "no response: is the encoder's power on, is 2.5 Mbit/s its rate, are A and B the right way round?\n";
        assert!(said.ends_with(want), "{said}");
    }
    bench.end();

    let (bench, port) = simulated(0x17);
    drop(port);
    // Our end of the pseudo-terminal is inherited; as long as the program has it open itself, it does not go away.
    let close = "for f in /proc/self/fd/*; do f=${f##*/}; [ $f -lt 3 ] || eval \"exec $f>&-\"; done; exec \"$@\"";
    let program = Command::new("bash")
        .args(["-c", close, "bash", "timeout", "20", env!("CARGO_BIN_EXE_servowire")])
        .args(["talk", "--port", &bench.name, "--timeout", "2000", "watch", "--period", "1"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // It first waits as long as for an answer.
    thread::sleep(Duration::from_secs(3));
    bench.end();
    let output = program.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains(": the port is gone or refused: "), "{}", text(&output));
    let counted = String::from_utf8_lossy(&output.stdout);
    // That the port is gone counts as nothing missing. But programs of other tests may hold its other end for a moment, where nobody
    // answers any more: then the last request has no response.
    let (good, bad) = counted.lines().last().unwrap().split_once(" good, ").unwrap();
    assert!(good.parse::<u32>().unwrap() > 100, "{counted}");
    assert!(["0 refused or missing", "1 refused or missing"].contains(&bad), "{counted}");
}
