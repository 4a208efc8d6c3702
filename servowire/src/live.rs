//! `servowire decode --stats` while a capture arrives: repeatedly shows the figures since the last ones.

use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;
use std::time::{Duration, Instant};

use serde_json::Value;
use servowire_decode::event::Event;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::output::stats::Gathered;

use crate::pipe;

/// How the figures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shown {
    /// One below the other, in a file or pipe.
    Lines,
    /// Replacing the last ones, on a terminal.
    InPlace,
    /// One object per line.
    Json,
}

/// Shows figures while events arrive, and while nothing arrives.
pub(crate) struct Live<W>(Rc<RefCell<Figures<W>>>);

impl<W: Write + 'static> Live<W> {
    /// `limit`: moves of the position above it are listed as jumps.
    pub(crate) fn new(out: W, shown: Shown, every: Duration, limit: Option<u64>) -> Self {
        let figures = Rc::new(RefCell::new(Figures::new(out, shown, every, limit)));
        let waiting = Rc::clone(&figures);
        pipe::while_waiting(move || {
            // Who no longer reads is noticed with the next event.
            let _ = waiting.borrow_mut().show();
        });
        Self(figures)
    }
}

/// Figures of the whole capture, and of the part since they were last shown.
struct Figures<W> {
    out: W,
    shown: Shown,
    every: Duration,
    limit: Option<u64>,
    whole: Gathered,
    since: Gathered,
    /// When the first event came, and when figures were last shown.
    times: Option<(Instant, Instant)>,
    /// Lines on the terminal that the next ones replace.
    lines: usize,
    origin: Origin,
}

impl<W: Write> Figures<W> {
    fn new(out: W, shown: Shown, every: Duration, limit: Option<u64>) -> Self {
        Self {
            out,
            shown,
            every,
            limit,
            whole: Gathered::new(limit),
            since: Gathered::new(limit),
            times: None,
            lines: 0,
            origin: Origin::default(),
        }
    }

    /// Shows the new figures, if it is time to.
    fn show(&mut self) -> io::Result<()> {
        let now = Instant::now();
        let Some((begin, last)) = self.times.filter(|(_, last)| now - *last >= self.every) else { return Ok(()) };
        let (seconds, over) = ((now - begin).as_secs_f64(), (now - last).as_secs_f64());
        self.times = Some((begin, now));
        let since = std::mem::replace(&mut self.since, Gathered::new(self.limit));
        if self.shown == Shown::Json {
            for mut object in since.objects(&self.whole, &self.origin) {
                if let Some(object) = object.as_object_mut() {
                    object.insert("at_s".to_owned(), Value::from((seconds * 1e3).round() / 1e3));
                    object.insert("over_s".to_owned(), Value::from((over * 1e3).round() / 1e3));
                }
                writeln!(self.out, "{object}")?;
            }
            return self.out.flush();
        }
        let lines = since.brief(&self.whole, &self.origin);
        self.erase()?;
        for line in &lines {
            writeln!(self.out, "{seconds:>9.1} s  {line}")?;
        }
        self.lines = lines.len();
        self.out.flush()
    }

    /// Removes the lines on the terminal.
    fn erase(&mut self) -> io::Result<()> {
        if self.shown == Shown::InPlace && self.lines > 0 {
            write!(self.out, "\x1b[{}A\x1b[J", self.lines)?;
        }
        self.lines = 0;
        Ok(())
    }
}

impl<W: Write> Printer for Live<W> {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        let mut figures = self.0.borrow_mut();
        // Lines are only ever added to it.
        if figures.origin.lanes.len() != origin.lanes.len() || figures.origin.file != origin.file {
            figures.origin = origin.clone();
        }
        figures.show()?;
        let now = Instant::now();
        figures.times.get_or_insert((now, now));
        figures.whole.add(origin, event);
        figures.since.add(origin, event);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.borrow_mut().show()
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        let mut figures = self.0.borrow_mut();
        figures.erase()?;
        let empty = Gathered::new(figures.limit);
        let whole = std::mem::replace(&mut figures.whole, empty);
        match figures.shown {
            Shown::Json => whole.write_json(origin, &mut figures.out),
            _ => whole.write(origin, &mut figures.out),
        }
    }
}
