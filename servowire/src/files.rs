//! Files and the standard input, as captures are read from them.

use std::fs::File;
use std::io::{self, BufReader, IsTerminal, Read};
use std::path::Path;
use std::time::{Duration, Instant};

use servowire_decode::capture::{Input, Live};
use servowire_decode::fault::{At, Fault};

use crate::pipe::Pipe;

/// How long a pipe that nobody asked for may be silent.
const PATIENCE: Duration = Duration::from_millis(400);
/// A source that gives nothing for so long has nothing for now.
const PAUSE: Duration = Duration::from_millis(60);
/// What comes live is shown after this time at the latest, if it is complete.
const SHOWN: Duration = Duration::from_millis(250);

/// What the standard input is where nobody asked for it.
pub(crate) enum Piped {
    /// A terminal, or at its end.
    Nothing,
    /// A pipe that is open and gives nothing for a moment.
    Silence,
    /// Something to read.
    Content(Input),
}

/// A pipe with the time at which what came through it was shown.
struct Watched {
    pipe: Pipe,
    shown: Instant,
}

impl Read for Watched {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.pipe.read(buffer)
    }
}

impl Live for Watched {
    fn is_ready(&mut self) -> bool {
        self.pipe.is_ready(PAUSE)
    }

    fn is_overdue(&mut self) -> bool {
        let overdue = self.shown.elapsed() > SHOWN;
        if overdue {
            self.shown = Instant::now();
        }
        overdue
    }
}

fn over_pipe(name: &str, pipe: Pipe) -> Input {
    Input::live(name, Watched { pipe, shown: Instant::now() })
}

/// What the standard input is called.
const STDIN: &str = "standard input";

/// Opens `path`, or the standard input for `-`. `grows`: its end is waited for.
pub(crate) fn open(path: &Path, grows: bool) -> Result<Input, Fault> {
    let name = path.display().to_string();
    if path.as_os_str() == "-" {
        return Ok(over_pipe(STDIN, Pipe::over(io::stdin(), false)));
    }
    let fault = |e: &io::Error| Fault::new(&name, At::File, format!("cannot be opened: {}", plain(e)));
    let file = File::open(path).map_err(|e| fault(&e))?;
    let data = file.metadata().map_err(|e| fault(&e))?;
    if data.is_dir() {
        return Err(Fault::new(&name, At::File, "is a folder; name the capture files in it"));
    }
    if grows || !data.is_file() {
        return Ok(over_pipe(&name, Pipe::over(file, grows)));
    }
    Ok(Input::seeking(&name, BufReader::new(file)))
}

/// What comes through a pipe or from a redirected file. `wanted`: it is waited for, however long it takes.
pub(crate) fn piped(wanted: bool) -> Piped {
    if io::stdin().is_terminal() {
        return Piped::Nothing;
    }
    let mut pipe = Pipe::over(io::stdin(), false);
    loop {
        match (pipe.is_ready(PATIENCE), pipe.is_over()) {
            (true, true) => return Piped::Nothing,
            (true, false) => return Piped::Content(over_pipe(STDIN, pipe)),
            (false, _) if wanted => {}
            (false, _) => return Piped::Silence,
        }
    }
}

/// The system's words without its error number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
