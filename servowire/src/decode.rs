//! `servowire decode`: files in, frames out.

mod arguments;

use std::fs::{self, File};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anstream::{AutoStream, ColorChoice};
use indicatif::{ProgressBar, ProgressStyle};

use servowire_decode::capture::{self, Capture, Format, Hints, Input};
use servowire_decode::codec::Codec;
use servowire_decode::fault::{At, Fault, Stop, printable};
use servowire_decode::output::Output;
use servowire_decode::output::json::JsonLines;
use servowire_decode::output::printer::Printer;
use servowire_decode::output::stats::Stats;
use servowire_decode::output::table::Csv;
use servowire_decode::output::text::Text;
use servowire_decode::output::vcd::VcdOut;
use servowire_decode::protocols::CODECS;
use servowire_decode::recognition::Note;
use servowire_decode::sink::Tally;
use tformat::BitRate;

pub(crate) use arguments::Decode;

use crate::files::{self, Piped};
use crate::interrupt;
use crate::live::{Live, Shown};
use crate::overwrite::refusal;
use crate::picture::Picture;
use crate::units::tformat_rate;
use crate::{serial, terminal};

/// Files of at least this size have a progress bar.
const LONG: u64 = 1 << 24;

/// How often figures are shown on a terminal.
const A_SECOND: Duration = Duration::from_secs(1);

/// What was found, as bits of the exit code; several files or findings add up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct End {
    /// A frame was refused, or a file cannot be read to its end.
    bad: bool,
    /// All frames are good, but show something that needs attention.
    trouble: bool,
}

impl End {
    const BAD: Self = Self { bad: true, trouble: false };

    fn and(self, other: Self) -> Self {
        Self { bad: self.bad | other.bad, trouble: self.trouble | other.trouble }
    }

    fn code(self) -> u8 {
        u8::from(self.bad) | u8::from(self.trouble) << 2
    }
}

/// Decodes all files. 0: all frames good; 1: not all; 4: something needs attention; 5: both; 2: the options do not go
/// together.
pub(crate) fn run(arguments: &Decode) -> ExitCode {
    if let Some(what) = arguments.contradiction().map(str::to_owned).or_else(|| overwrites(arguments)) {
        eprintln!("error: {what}");
        return ExitCode::from(2);
    }
    if let Some(port) = &arguments.serial {
        return listen(arguments, port);
    }
    let files = arguments.files.len();
    let described = arguments.reading.describes_a_file();
    let mut empty = false;
    let piped = match if files == 0 { files::piped(described.is_some()) } else { Piped::Nothing } {
        Piped::Content(input) => Some(input),
        Piped::Silence => {
            eprintln!("nothing has arrived on standard input: showing the bundled captures; name - to wait for input");
            None
        }
        Piped::EmptyFile => {
            eprintln!("error: standard input: the file is empty");
            return ExitCode::FAILURE;
        }
        Piped::EmptyPipe => {
            empty = true;
            None
        }
        Piped::Nothing => None,
    };
    if let (0, None, Some(option)) = (files, &piped, described) {
        eprintln!("error: {option} describes a capture: name its file, or - for the standard input");
        return ExitCode::from(2);
    }
    if files == 0 && piped.is_none() && bundled(arguments).is_empty() {
        eprintln!("error: no captures of this protocol come with the program: name a file");
        return ExitCode::from(2);
    }
    for (out, option) in [(&arguments.vcd, "--vcd"), (&arguments.svg, "--svg")] {
        if out.is_some() && files + usize::from(piped.is_some()) != 1 {
            eprintln!("error: {option} writes one capture: name one file, not {files}");
            return ExitCode::from(2);
        }
    }
    let headed = files != 1 && piped.is_none();
    let code = print(arguments, piped.is_some(), headed, |printer| all(arguments, piped, printer));
    if empty {
        eprintln!("standard input was empty: these are the bundled captures");
    }
    code
}

/// Returns what to say if an output is a capture, or the same file as another output.
fn overwrites(arguments: &Decode) -> Option<String> {
    let piped = arguments.files.is_empty().then_some(Path::new("-"));
    let captures = arguments.files.iter().map(PathBuf::as_path).chain(piped);
    let captures: Vec<_> = captures.map(|file| ("the capture", file)).collect();
    refusal(&captures, &[("--vcd", arguments.vcd.as_deref()), ("--svg", arguments.svg.as_deref())])
}

/// Decodes the bytes heard by a serial port.
fn listen(arguments: &Decode, port: &str) -> ExitCode {
    let protocol =
        arguments.reading.protocol.0.or_else(|| CODECS.iter().copied().find(|codec| codec.name == "tformat"));
    if protocol.is_none_or(|protocol| protocol.name != "tformat") {
        eprintln!("error: a serial port receives bytes of T-Format only: record the line with a logic analyser");
        return ExitCode::from(2);
    }
    let rate = arguments.reading.bit_rate().unwrap_or(BitRate::Mbit2_5.bits_per_second());
    let rate = match tformat_rate(&rate.to_string()) {
        Ok(rate) => rate,
        Err(what) => {
            eprintln!("error: {what}");
            return ExitCode::from(2);
        }
    };
    let input = match serial::listen(port, rate) {
        Ok(input) => input,
        Err(what) => {
            eprintln!("error: {what}");
            return ExitCode::FAILURE;
        }
    };
    let hints = Hints { format: Some(Format::Hex), ..arguments.reading.hints() };
    print(arguments, true, false, |printer| one(arguments, Ok(input), hints, protocol, &Bar { bar: None }, printer))
}

/// Prints the results of `decode` as the arguments require. `live`: the data arrive as they occur; `headed`: each file has
/// a heading.
fn print(
    arguments: &Decode,
    live: bool,
    headed: bool,
    decode: impl FnOnce(&mut dyn Printer) -> io::Result<End>,
) -> ExitCode {
    interrupt::note();
    let stdout = io::stdout();
    let out = BufWriter::with_capacity(1 << 16, stdout.lock());
    let mut printer: Box<dyn Printer> = if let Some(every) = every(arguments, live, stdout.is_terminal()) {
        let shown = match (arguments.json, stdout.is_terminal()) {
            (true, _) => Shown::Json,
            (false, true) => Shown::InPlace,
            (false, false) => Shown::Lines,
        };
        Box::new(Live::new(out, shown, every, arguments.jump))
    } else if arguments.stats {
        let stats = Stats::new(out, arguments.jump);
        Box::new(if arguments.json { stats.in_json() } else { stats })
    } else if arguments.json {
        Box::new(JsonLines::new(out))
    } else if arguments.csv {
        Box::new(Csv::new(out))
    } else {
        let mut text = Text::new(out);
        if headed {
            text = text.with_headings();
        }
        if AutoStream::choice(&stdout) != ColorChoice::Never {
            text = text.with_colour();
        }
        if let Some(columns) = terminal::columns() {
            text = text.with_columns(columns);
        }
        Box::new(text)
    };
    match decode(printer.as_mut()) {
        Ok(end) => ExitCode::from(end.code()),
        // The reader has seen enough.
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: cannot write: {e}");
            ExitCode::FAILURE
        }
    }
}

/// How often figures are shown while a capture comes in; `None`: only at its end.
fn every(arguments: &Decode, piped: bool, terminal: bool) -> Option<Duration> {
    let live = piped || arguments.reading.file.follow || arguments.files.iter().any(|file| file.as_os_str() == "-");
    arguments.every.or((arguments.stats && live && terminal && !arguments.json).then_some(A_SECOND))
}

/// What was found in all files.
fn all(arguments: &Decode, piped: Option<Input>, printer: &mut dyn Printer) -> io::Result<End> {
    let mut end = End::default();
    let (hints, protocol) = (arguments.reading.hints(), arguments.reading.protocol.0);
    if let Some(input) = piped {
        return one(arguments, Ok(input), hints, protocol, &Bar { bar: None }, printer);
    }
    for path in arguments.files.iter().take_while(|_| !interrupt::asked()) {
        let bar = Bar::new(path);
        let input = files::open(path, arguments.reading.file.follow);
        end = end.and(one(arguments, input, hints, protocol, &bar, printer)?);
        bar.finish();
    }
    if arguments.files.is_empty() {
        for (name, bytes) in bundled(arguments) {
            let hints = Hints { format: Some(Format::Vcd), ..Hints::default() };
            end = end.and(one(arguments, Ok(Input::over(name, *bytes)), hints, protocol, &Bar { bar: None }, printer)?);
        }
    }
    Ok(end)
}

/// Returns the bundled captures of the chosen protocol.
fn bundled(arguments: &Decode) -> &'static [(&'static str, &'static [u8])] {
    arguments.reading.protocol.0.or(CODECS.first().copied()).map_or(&[], |codec| codec.captures)
}

/// Decodes one file, and reports what is wrong with it.
fn one(
    arguments: &Decode,
    input: Result<Input, Fault>,
    hints: Hints,
    protocol: Option<&'static dyn Codec>,
    bar: &Bar,
    printer: &mut dyn Printer,
) -> io::Result<End> {
    let opened = input.and_then(|input| Ok((input.name().to_owned(), input.meter(), capture::open(input, hints)?)));
    let (name, meter, mut capture) = match opened {
        Ok((name, meter, capture)) => (name, meter, capture),
        Err(fault) => return Ok(complain(&fault, bar)),
    };
    let name = name.as_str();
    let mut filter = arguments.filter();
    if let Some(what) = cannot(arguments, &mut capture, filter.has_times()) {
        return Ok(complain(&Fault::new(name, At::File, what), bar));
    }
    let mut picture = arguments.svg.as_ref().map(|_| Picture::new(name));
    let mut vcd = match vcd_out(arguments) {
        Ok(vcd) => vcd,
        Err(fault) => return Ok(complain(&fault, bar)),
    };
    let progress = || bar.set(meter.get());
    let notes = |note: &Note| bar.say(&note.to_string());
    let mut out = Output::new(name, printer).with_progress(&progress).with_notes(&notes).with_filter(&mut filter);
    out = out.with_beside(vcd.as_mut().map(|vcd| vcd as &mut dyn Printer));
    out = out.with_beside(picture.as_mut().map(|picture| picture as &mut dyn Printer));
    out = out.with_enough(&interrupt::asked);
    if arguments.until.is_some() {
        out = out.until_error(arguments.around.unwrap_or(0));
    }
    out.begin()?;
    let mut settings = arguments.reading.settings();
    // A row of a table stands alone.
    settings.rtex.whole = arguments.csv;
    let end = servowire_decode::decode(name, capture, protocol, &settings, &mut out);
    out.end()?;
    let (tally, chosen, refusals, done) = (out.tally, out.chosen, out.refusals(), out.is_done());
    if let (Some(picture), Some(path)) = (&picture, &arguments.svg) {
        if let Err(e) = picture.draw().and_then(|svg| Ok(fs::write(path, svg)?)) {
            let what = format!("cannot be drawn: {e}");
            return Ok(complain(&Fault::new(&path.display().to_string(), At::File, what), bar));
        }
    }
    if let Some(refusals) = &refusals {
        bar.say(&format!("error: {name}: {refusals}"));
    }
    let nothing = match end {
        Ok(()) if tally == Tally::default() => "no frame in it: the line is idle, or not of this protocol".to_owned(),
        Ok(()) if chosen == Tally::default() => {
            format!("none of its {} frames passes the filter", tally.ok + tally.refused)
        }
        Ok(()) => return Ok(End { bad: refusals.is_some(), trouble: false }),
        // Where the user had enough, what he read was cut there by himself.
        Err(Stop::Fault(_) | Stop::Trouble { .. }) if done => {
            return Ok(End { bad: refusals.is_some(), trouble: false });
        }
        Err(Stop::Trouble { fault, broken }) => {
            complain(&fault, bar);
            return Ok(End { bad: broken || refusals.is_some(), trouble: true });
        }
        Err(Stop::Fault(fault)) => return Ok(complain(&fault, bar)),
        Err(Stop::Output(error)) => return Err(error),
    };
    Ok(complain(&Fault::new(name, At::File, nothing), bar))
}

/// Creates the file for the decoded line, if one is asked for.
fn vcd_out(arguments: &Decode) -> Result<Option<VcdOut>, Fault> {
    let Some(path) = &arguments.vcd else { return Ok(None) };
    let file = File::create(path)
        .map_err(|e| Fault::new(&path.display().to_string(), At::File, format!("cannot be created: {e}")))?;
    let vcd = VcdOut::new(files::written(path, file));
    Ok(Some(match (arguments.cut, arguments.around) {
        (Some((from, to)), _) => vcd.within(from, to),
        (None, Some(around)) => vcd.around(around),
        (None, None) => vcd,
    }))
}

/// Returns why the request is impossible for a capture of this kind.
fn cannot(arguments: &Decode, capture: &mut Capture, has_times: bool) -> Option<String> {
    if let Some(what) = arguments.reading.misplaced(capture) {
        return Some(what);
    }
    let timeless = match capture {
        Capture::Bytes(log) => arguments.reading.rtex.period.is_none() && !log.has_times(),
        _ => false,
    };
    let levels = matches!(capture, Capture::Edges(_) | Capture::Samples(_));
    let cannot = [
        (arguments.vcd.is_some() && !levels, "there are no levels in it for a VCD"),
        (arguments.svg.is_some() && timeless, "a log of bytes has no times for a picture"),
        (has_times && timeless, "a log of bytes has no times for --from and --to"),
    ];
    cannot.into_iter().find(|(is, _)| *is).map(|(_, what)| what.to_owned())
}

/// Reports what is wrong; the file is not good.
fn complain(fault: &Fault, bar: &Bar) -> End {
    bar.say(&format!("error: {fault}"));
    End::BAD
}

/// Returns the progress bar, on a terminal and for a long file.
struct Bar {
    bar: Option<ProgressBar>,
}

impl Bar {
    fn new(path: &Path) -> Self {
        let size = path.metadata().map_or(0, |file| file.len());
        if size < LONG || !io::stderr().is_terminal() {
            return Self { bar: None };
        }
        let style = ProgressStyle::with_template("{bytes}/{total_bytes} [{bar:40}] {bytes_per_sec}, {eta} left");
        Self { bar: Some(ProgressBar::new(size).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))) }
    }

    fn set(&self, bytes: u64) {
        if let Some(bar) = &self.bar {
            bar.set_position(bytes);
        }
    }

    /// Writes a line to standard error, above the bar.
    fn say(&self, text: &str) {
        let print = || drop(writeln!(io::stderr(), "{}", printable(text)));
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
