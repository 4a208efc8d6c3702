//! A machine of several axes under commands from a console.

use core::fmt::{self, Write};
use core::str::SplitAsciiWhitespace;

use step_motion::{Axes, Error, Work};

/// Longest line that can be typed.
const MOST: usize = 64;

/// The axes, and the line being typed. Each line is answered by `ok` or by why it is refused:
///
/// | line | does |
/// |---|---|
/// | `line 8000 4000 100000` | adds a line to these places in steps, one for each axis, at a feed in um/s |
/// | `hold`, `resume` | comes to rest along the lines; continues |
/// | `override 50` | sets the speed in percent of the feed |
/// | `stop` | comes to rest and forgets the lines |
/// | `halt` | makes no further step |
#[derive(Debug)]
pub struct Machine<'q, const N: usize, const M: usize, const S: usize> {
    axes: Axes<'q, N, M, S>,
    line: [u8; MOST],
    len: usize,
    was_at_rest: bool,
}

/// Why a line was not executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refused {
    Unknown,
    Motion(Error),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("?"),
            Self::Motion(error) => write!(f, "refused: {error}"),
        }
    }
}

impl<'q, const N: usize, const M: usize, const S: usize> Machine<'q, N, M, S> {
    /// Creates a machine that is at rest.
    pub const fn new(axes: Axes<'q, N, M, S>) -> Self {
        Self { axes, line: [0; MOST], len: 0, was_at_rest: true }
    }

    /// Does a slice of the background's work, and takes typed input. Returns whether the interrupt has to be started.
    /// Prints where the axes are whenever they have come to rest, with the number of pulses that were `late`.
    ///
    /// # Errors
    /// Those of `console`.
    pub fn turn(&mut self, typed: Option<u8>, console: &mut impl Write, late: u32) -> Result<bool, fmt::Error> {
        if let Some(done) = typed.and_then(|byte| self.hear(byte)) {
            match done {
                Ok(()) => console.write_str("ok\n")?,
                Err(refused) => writeln!(console, "{refused}")?,
            }
        }
        let work = self.axes.poll();
        if work == Work::TooFewSlots {
            console.write_str("the queue is too short for the stop\n")?;
        }
        let is_at_rest = self.axes.is_at_rest();
        if is_at_rest && !self.was_at_rest {
            console.write_str("rest at")?;
            for steps in self.axes.commanded() {
                write!(console, " {steps}")?;
            }
            writeln!(console, ", {late} late")?;
        }
        self.was_at_rest = is_at_rest;
        Ok(work == Work::Start)
    }

    /// Takes a typed byte; at the end of a line, returns the result of the line.
    fn hear(&mut self, byte: u8) -> Option<Result<(), Refused>> {
        if byte != b'\n' && byte != b'\r' {
            if let Some(place) = self.line.get_mut(self.len) {
                *place = byte;
            }
            self.len = self.len.saturating_add(1);
            return None;
        }
        let line = self.line;
        let typed = line.get(..core::mem::take(&mut self.len)).and_then(|line| core::str::from_utf8(line).ok());
        match typed {
            Some("") => None,
            Some(text) => Some(self.ask(text.split_ascii_whitespace())),
            None => Some(Err(Refused::Unknown)),
        }
    }

    fn ask(&mut self, mut words: SplitAsciiWhitespace<'_>) -> Result<(), Refused> {
        match words.next() {
            Some("line") => self.push(words),
            Some("override") => {
                let percent = words.next().and_then(|percent| percent.parse().ok());
                self.axes.set_override(percent.ok_or(Refused::Unknown)?);
                Ok(())
            }
            Some(request) => self.request(request),
            None => Err(Refused::Unknown),
        }
    }

    fn request(&mut self, request: &str) -> Result<(), Refused> {
        match request {
            "hold" => self.axes.hold(),
            "resume" => self.axes.resume(),
            "stop" => self.axes.stop(),
            "halt" => self.axes.halt(),
            _ => return Err(Refused::Unknown),
        }
        Ok(())
    }

    fn push(&mut self, mut words: SplitAsciiWhitespace<'_>) -> Result<(), Refused> {
        let mut target = [0; N];
        for place in &mut target {
            *place = words.next().and_then(|steps| steps.parse().ok()).ok_or(Refused::Unknown)?;
        }
        let feed = words.next().and_then(|feed| feed.parse().ok()).ok_or(Refused::Unknown)?;
        self.axes.push(target, feed).map_err(Refused::Motion)
    }
}

#[cfg(test)]
mod tests {
    use std::string::String;

    use step_motion::{AxesQueue, AxesTimer, AxisSetup, Clock, Limits, Path};

    use super::*;

    static QUEUE: AxesQueue<2, 129> = AxesQueue::new();

    /// Types a line and runs until the machine is at rest; returns the console's output and the steps made.
    fn run(machine: &mut Machine<'_, 2, 8, 129>, timer: &mut AxesTimer<'_, 2, 129>, typed: &str) -> (String, [u32; 2]) {
        let (mut said, mut steps) = (String::new(), [0_u32; 2]);
        for byte in typed.bytes() {
            machine.turn(Some(byte), &mut said, 0).unwrap();
        }
        // A machine at rest no longer asks for a start.
        let mut quiet = 0;
        while quiet < 10_000 {
            quiet += 1;
            if machine.turn(None, &mut said, 0).unwrap() {
                quiet = 0;
                loop {
                    let fired = timer.fire();
                    for (axis, steps) in steps.iter_mut().enumerate() {
                        *steps += u32::from(fired.steps() >> axis & 1);
                    }
                    if fired.wait() == 0 {
                        break;
                    }
                    for _ in 0..20 {
                        machine.turn(None, &mut said, 0).unwrap();
                    }
                }
            }
        }
        (said, steps)
    }

    #[test]
    fn a_machine_does_what_was_typed() {
        let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap(), 80_000).with_soft_limits(-10, 1_000);
        let path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 0).unwrap();
        let (axes, mut timer) = Axes::new(&QUEUE, path);
        let mut machine = Machine::new(axes);
        let mut type_in = |typed: &str| run(&mut machine, &mut timer, typed);
        assert_eq!(type_in("line 300 100 100000\n"), ("ok\nrest at 300 100, 0 late\n".into(), [300, 100]));
        assert_eq!(type_in("hold\r\nline 0 0 100000\r\n").1, [0, 0]);
        assert_eq!(type_in("override 50\nresume\n"), ("ok\nok\nrest at 0 0, 0 late\n".into(), [300, 100]));
        assert_eq!(type_in("line 2000 0 1000\n").0, "refused: target 2000 is outside the soft limits\n");
        for wrong in ["line 1 2", "line 1 x 3", "override", "jump", "line 1 2 3 ".repeat(9).as_str()] {
            assert_eq!(type_in(&std::format!("{wrong}\n")).0, "?\n", "{wrong}");
        }
        assert_eq!(type_in("line 10 0 1000\nstop\n").0, "ok\nok\nrest at 0 0, 0 late\n");
        assert_eq!(type_in("halt\nline 5 5 1000\n").0, "ok\nrefused: the axis is still moving\nrest at 0 0, 0 late\n");
        assert_eq!(type_in("line 5 0 1000\n"), ("ok\nrest at 5 0, 0 late\n".into(), [5, 0]));
    }
}
