//! `decode --serial`: a line heard through a port, here a pseudo-terminal.

#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};

use crate::common::id3;

const LONG: Duration = Duration::from_secs(20);

/// The program at one end of a pseudo-terminal, and what it prints.
struct Heard {
    program: Child,
    line: TTYPort,
    lines: Receiver<String>,
    /// As long as this is open, the line's end is.
    _kept: File,
}

impl Heard {
    fn new(arguments: &[&str]) -> Self {
        let (line, ours) = TTYPort::pair().unwrap();
        let name = ours.name().unwrap();
        let kept = File::options().read(true).write(true).open(&name).unwrap();
        drop(ours);
        let mut program = Command::new(env!("CARGO_BIN_EXE_servowire"))
            .args(["decode", "--serial", &name])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (send, lines) = mpsc::channel();
        let out = BufReader::new(program.stdout.take().unwrap());
        thread::spawn(move || out.lines().map_while(Result::ok).for_each(|line| drop(send.send(line))));
        Self { program, line, lines, _kept: kept }
    }

    /// The next line with these words.
    #[track_caller]
    fn shows(&self, words: &str) -> String {
        let until = Instant::now() + LONG;
        loop {
            let line =
                self.lines.recv_timeout(until - Instant::now()).unwrap_or_else(|_| panic!("{words:?} was not shown"));
            if line.contains(words) {
                return line;
            }
        }
    }

    fn says(&mut self, position: u32) {
        self.line.write_all(&[&[0x1a][..], &id3(position, 0, 0)].concat()).unwrap();
    }

    /// Speaks until the program listens.
    fn begin(&mut self) {
        let until = Instant::now() + LONG;
        while self.lines.try_recv().is_err() {
            assert!(Instant::now() < until, "nothing was heard");
            self.says(1);
            thread::sleep(Duration::from_millis(100));
        }
    }

    /// Ctrl-C: the exit code, and what was said.
    fn end(mut self) -> (Option<i32>, Vec<String>, String) {
        assert!(Command::new("kill").args(["-INT", &self.program.id().to_string()]).status().unwrap().success());
        let code = self.program.wait().unwrap().code();
        let mut said = String::new();
        self.program.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        (code, self.lines.iter().collect(), said)
    }
}

#[test]
fn exchanges_are_shown_as_they_are_heard() {
    let mut heard = Heard::new(&[]);
    heard.begin();
    // In two pieces, and three at once.
    let exchange = [&[0x1a][..], &id3(4711, 0, 0)].concat();
    heard.line.write_all(&exchange[..5]).unwrap();
    thread::sleep(Duration::from_millis(10));
    heard.line.write_all(&exchange[5..]).unwrap();
    heard.shows("ABS 4711 ");
    for position in 100..103 {
        heard.says(position);
    }
    for position in 100..103 {
        heard.shows(&format!("ABS {position} "));
    }
    // The request of the next exchange shows that the answer to this one is missing.
    heard.line.write_all(&[0x1a]).unwrap();
    thread::sleep(Duration::from_millis(200));
    heard.says(200);
    assert!(heard.shows("no answer before the next request").contains("REFUSED"));
    heard.shows("ABS 200 ");
    let mut damaged = exchange;
    damaged[4] ^= 1;
    heard.line.write_all(&damaged).unwrap();
    assert!(heard.shows("crc").contains("REFUSED"));
    let (code, _, said) = heard.end();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains(" frames refused: crc 1 "), "{said}");
    assert!(said.contains("; 1 request without an answer"), "{said}");
}

#[test]
fn figures_are_shown_while_one_listens_and_at_the_end() {
    let mut heard = Heard::new(&["--stats", "--every", "200ms"]);
    heard.begin();
    for position in 5..40 {
        heard.says(position);
        thread::sleep(Duration::from_millis(20));
    }
    heard.shows(" frames  no errors");
    // Without times a position is still the newest one.
    assert!(heard.shows("ABS 39 (").contains(" frames  no errors"));
    let (code, rest, said) = heard.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(rest.iter().any(|line| line.contains("verdicts") && line.ends_with(" 0 refused")), "{rest:?}");
}

#[test]
fn what_cannot_be_heard_is_said() {
    let run = |arguments: &[&str]| Command::new(env!("CARGO_BIN_EXE_servowire")).args(arguments).output().unwrap();
    let text = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let missing = run(&["decode", "--serial", "/dev/ttyNONE7"]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(text(&missing).contains("there is no such port"), "{}", text(&missing));
    for (arguments, what) in [
        (&["--protocol", "nikon"][..], "bytes of T-Format only"),
        (&["--bit-rate", "9600"], "is not one of the rates 2.5M, 5M"),
        (&["--follow"], "cannot be used with"),
    ] {
        let output = run(&[&["decode", "--serial", "/dev/null"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(what), "{}", text(&output));
    }
}
